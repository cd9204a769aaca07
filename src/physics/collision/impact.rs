//! From the inputs of a shot to the numbers of its impact, and from the impulses back to both
//! balls: the same lines for plain numbers and for numbers with derivatives.
//!
//! All impulses are per unit of the object ball's mass, r = m_cue/m_object (Kim 2024, Eqs. 10–16
//! and 42–49; unequal balls beyond the paper). Radii R_c and R_o that differ tilt the line of
//! centres by sin δ = (R_o − R_c)/(R_o + R_c): to first order the normal impulse P has a vertical
//! part P sin δ. A larger cue ball presses the object ball into the cloth and rises itself, a
//! smaller one lifts the object ball. The cloth's friction on a ball so pressed takes part in the
//! impact: dv_x/dq = N + μ_s sin δ. (The slip along the surface that the tilt makes of the closing
//! speed, k sin δ, is left out: it turns the friction by k sin δ/v_∥0.)

use std::ops::Index;

use nalgebra::{SMatrix, SVector};
use num_dual::{Derivative, DualSVec64};

use super::{Coefficients, Input, Model, Number};
use crate::physics::ball::BallState;
use crate::physics::friction_law::Law;

/// A number with its derivatives by the first N inputs.
pub(super) type Dual<const N: usize> = DualSVec64<N>;

/// The values of the inputs, in the order of [`Input`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Values<D>([D; Input::COUNT]);

impl<D> Index<Input> for Values<D> {
    type Output = D;

    #[inline(always)]
    fn index(&self, input: Input) -> &D {
        &self.0[input as usize]
    }
}

impl<D: Number> Values<D> {
    /// 1/r; of equal balls without a division.
    #[inline(always)]
    fn per_mass_ratio(&self) -> D {
        let ratio = self[Input::MassRatio];
        if D::NDERIV == 0 && ratio.re() == 1.0 { ratio } else { ratio.recip() }
    }
}

impl Values<f64> {
    /// Returns the values of a shot, with those that switch off the effects that are off.
    #[inline(always)]
    pub fn new(model: &Model, cue: &BallState, coefficients: &Coefficients) -> Self {
        let &Coefficients { mu, mu_s, e } = coefficients;
        let effects = model.effects.and(model.fidelity.effects());
        let [b, c] = if effects.friction { model.law.numbers() } else { [0.0; 2] };
        let (v, w) = (cue.velocity, cue.spin);
        Self([
            if effects.friction { mu } else { 0.0 },
            if effects.cloth { mu_s } else { 0.0 },
            if effects.inelasticity { e } else { 1.0 },
            v.x,
            v.y,
            w.x,
            w.y,
            w.z,
            b,
            c,
            model.kappa,
            model.mass_ratio(),
            model.radius_ratio(),
            model.e_slope.filter(|_| effects.inelasticity).unwrap_or(0.0),
        ])
    }

    /// Returns the values with derivatives by the first N; by a coefficient of an effect that is
    /// off they are 0.
    pub fn with_derivatives<const N: usize>(&self, model: &Model) -> Values<Dual<N>> {
        Values(std::array::from_fn(|i| {
            if i >= N || Self::is_off(Input::ALL[i], model) {
                return Dual::from(self.0[i]);
            }
            let mut by = SVector::<f64, N>::zeros();
            by[i] = 1.0;
            Dual::new(self.0[i], Derivative::some(by))
        }))
    }

    /// Whether an input belongs to an effect that is off.
    pub fn is_off(input: Input, model: &Model) -> bool {
        let effects = model.effects.and(model.fidelity.effects());
        match input {
            Input::Mu | Input::B | Input::C => !effects.friction,
            Input::MuS => !effects.cloth,
            Input::E | Input::ESlope => !effects.inelasticity,
            _ => false,
        }
    }

    /// Returns the values with one input changed.
    pub fn moved(mut self, input: Input, by: f64) -> Self {
        self.0[input as usize] += by;
        self
    }
}

/// The numbers that determine the impulses.
#[derive(Clone, Copy, Debug)]
pub(super) struct Impact<D> {
    /// k, the closing speed, m/s.
    pub k: D,
    /// v_y0, v_z0, m/s.
    pub slip: [D; 2],
    /// 2β_y, 2β_z.
    pub lever: [D; 2],
    /// 1/r.
    pub per_r: D,
    /// N = 1 + 1/r: dv_x/dq without the cloth.
    pub n: D,
    /// m_s: μ_s with topspin (v_z0 > 0), else 0.
    pub m_s: D,
    /// e at this closing speed.
    pub e: D,
    /// μ, at a large slip if it falls.
    pub mu: D,
    /// b and c of a friction that falls.
    pub fall: Option<[D; 2]>,
}

/// Impulses per unit of the object ball's mass, m/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Impulses<D> {
    /// The normal impulse.
    pub q: D,
    /// J_y and J_z of the friction between the balls, on the object ball.
    pub friction: [D; 2],
    /// The impulses of the cloth on the cue ball and on the object ball, x and y of each.
    pub cloth: [[D; 2]; 2],
    /// The vertical velocities of both balls.
    pub up: [D; 2],
}

impl<D: Number> Impact<D> {
    #[inline(always)]
    pub fn new(values: &Values<D>, model: &Model) -> Self {
        let (k, radius) = (values[Input::VelocityX], model.ball.radius);
        let slip = [-values[Input::VelocityY] - values[Input::SpinZ] * radius, values[Input::SpinY] * radius];
        let topspin = slip[1].re() > 0.0;
        let m_s = if topspin { values[Input::MuS] } else { D::from(0.0) };
        let per_r = values.per_mass_ratio();
        let [per_c, per_o] = model.per_inertia();
        let lever_z = if topspin {
            per_r * (1.0 + per_c) + (-m_s * model.torque_sign() + 1.0) * per_o
        } else {
            per_r * per_c + (1.0 + per_o)
        };
        // e = e₀ − e₁k, not below 0
        let e = values[Input::E] - values[Input::ESlope] * k;
        Self {
            k,
            slip,
            lever: [per_r * (1.0 + per_c) + (1.0 + per_o), lever_z],
            per_r,
            n: per_r + 1.0,
            m_s,
            e: if e.re() < 0.0 { D::from(0.0) } else { e },
            mu: values[Input::Mu],
            fall: (model.law != Law::Constant).then(|| [values[Input::B], values[Input::C]]),
        }
    }

    /// The impulses of a rigid contact, from those between the balls: with the tilt of the line of
    /// centres, and the cloth's friction on the object ball.
    #[inline(always)]
    pub fn impulses(&self, values: &Values<D>, [mut q, j_y, j_z]: [D; 3]) -> Impulses<D> {
        let (zero, ratio, mu_s) = (D::from(0.0), values[Input::RadiusRatio], values[Input::MuS]);
        let mut up = j_z;
        if D::NDERIV > 0 || ratio.re() != 1.0 {
            let tilt = (-ratio + 1.0) / (ratio + 1.0);
            up += tilt * q;
            if up.re() < 0.0 {
                // N/(N + μ_s sin δ), to first order
                q -= q * tilt * mu_s / self.n;
            }
        }
        let pressed = up.re() < 0.0;
        let [carried, rises] = if pressed { [up, zero] } else { [zero, up] };
        let cloth = [[zero; 2], [mu_s * carried, zero]];
        Impulses { q, friction: [j_y, j_z], cloth, up: [-self.per_r * carried, rises] }
    }
}

impl<D> Impulses<D> {
    #[inline(always)]
    fn map<E>(&self, f: impl Fn(&D) -> E) -> Impulses<E> {
        let Self { q, friction, cloth: [cue, object], up } = self;
        let cloth = [cue.each_ref().map(&f), object.each_ref().map(&f)];
        Impulses { q: f(q), friction: friction.each_ref().map(&f), cloth, up: up.each_ref().map(&f) }
    }
}

/// The linear map from impulses to the changes of both balls' velocities and spins.
struct Changes {
    /// 1/r, 1/(rν_c R_c) and 1/(ν_o R_o).
    per_r: f64,
    on_cue: f64,
    on_object: f64,
    sigma: f64,
}

impl Changes {
    #[inline(always)]
    fn new(values: &Values<f64>, model: &Model) -> Self {
        let per_radius = 1.0 / model.ball.radius;
        let [per_c, per_o] = model.per_inertia().map(|per_nu| per_nu * per_radius);
        let per_r = values.per_mass_ratio();
        let on_object = values[Input::RadiusRatio] * per_o;
        Self { per_r, on_cue: per_r * per_c, on_object, sigma: model.torque_sign() }
    }

    #[inline(always)]
    fn of(&self, impulses: &Impulses<f64>) -> [f64; 12] {
        let &Impulses { q, friction: [j_y, j_z], cloth: [[c_x, c_y], [o_x, o_y]], up } = impulses;
        let &Self { per_r, on_cue, on_object, sigma } = self;
        [
            per_r * (c_x - q),
            per_r * (c_y - j_y),
            up[0],
            on_cue * c_y,
            on_cue * (j_z - c_x),
            -on_cue * j_y,
            q + o_x,
            j_y + o_y,
            up[1],
            on_object * sigma * o_y,
            on_object * (j_z - sigma * o_x),
            -on_object * j_y,
        ]
    }
}

/// The inputs that are components of the cue ball's motion, and their rows.
const MOTION: [(Input, usize); 5] =
    [(Input::VelocityX, 0), (Input::VelocityY, 1), (Input::SpinX, 3), (Input::SpinY, 4), (Input::SpinZ, 5)];

/// Returns both balls after the impact in the order of [`super::Outcome::components`].
#[inline(always)]
pub(super) fn components(values: &Values<f64>, model: &Model, impulses: &Impulses<f64>) -> [f64; 12] {
    let mut all = Changes::new(values, model).of(impulses);
    for (input, row) in MOTION {
        all[row] += values[input];
    }
    all
}

/// Returns the derivatives of the components by the first N inputs.
#[inline(always)]
pub(super) fn derivatives<const N: usize>(
    values: &Values<f64>,
    model: &Model,
    impulses: &Impulses<Dual<N>>,
) -> SMatrix<f64, 12, N> {
    let changes = Changes::new(values, model);
    let mut by = SMatrix::<f64, 12, N>::zeros();
    let gradients = impulses.map(|number| number.eps.0.unwrap_or_else(SVector::zeros));
    for column in 0..N {
        by.column_mut(column).copy_from_slice(&changes.of(&gradients.map(|gradient| gradient[column])));
    }
    for (input, row) in MOTION {
        by[(row, input as usize)] += 1.0;
    }
    if N > Input::FIRST {
        // the map itself depends on both ratios
        let change = changes.of(&impulses.map(|number| number.re));
        for row in [0, 1, 3, 4, 5] {
            by[(row, Input::MassRatio as usize)] -= change[row] * changes.per_r;
            by[(row + 6, Input::RadiusRatio as usize)] +=
                if row < 3 { 0.0 } else { change[row + 6] / values[Input::RadiusRatio] };
        }
    }
    by
}
