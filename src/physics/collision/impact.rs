//! Conversion of the inputs of a shot to the numbers of its impact, and of the impulses back to
//! both balls: the same lines for plain numbers and for numbers with derivatives.
//!
//! All impulses are per unit of the object ball's mass, r = m_cue/m_object (Kim 2024, Eqs. 10–16
//! and 42–49; unequal balls beyond the paper). Radii R_c and R_o that differ tilt the line of
//! centres by sin δ = (R_o − R_c)/(R_o + R_c): to first order the normal impulse P has a vertical
//! part P sin δ, with which a larger cue ball presses the object ball into the cloth, dv_x/dq = N +
//! μ_s sin δ. (The slip k sin δ that the tilt makes of the closing speed is left out.)

use std::ops::Index;

use nalgebra::SVector;
use num_dual::DualSVec64;

use super::{Coefficients, Input, Jacobian, Model, Number};
use crate::physics::ball::BallState;
use crate::physics::friction_law::Law;

/// A number with its derivatives by the first N of [`DIFFERENTIATED`].
pub(super) type Dual<const N: usize> = DualSVec64<N>;

/// Inputs whose derivatives give those by all others, the first six for equal balls and constant
/// friction, eight for constant friction.
pub(super) const DIFFERENTIATED: [Input; 10] = [
    Input::Mu,
    Input::MuS,
    Input::E,
    Input::VelocityX,
    Input::VelocityY,
    Input::SpinY,
    Input::MassRatio,
    Input::RadiusRatio,
    Input::B,
    Input::C,
];

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

    /// Returns the values with derivatives; by a coefficient of an effect that is off they are 0.
    pub fn with_derivatives<const N: usize>(&self, model: &Model) -> Values<Dual<N>> {
        let mut dual = self.0.map(Dual::from);
        for (i, input) in DIFFERENTIATED.into_iter().take(N).enumerate() {
            if !Self::is_off(input, model) {
                dual[input as usize] = dual[input as usize].derivative(i);
            }
        }
        Values(dual)
    }

    /// Whether an input belongs to an effect that is off, or to balls that are equal.
    pub fn is_off(input: Input, model: &Model) -> bool {
        let effects = model.effects.and(model.fidelity.effects());
        match input {
            Input::Mu => !effects.friction,
            Input::B | Input::C => !effects.friction || model.law == Law::Constant,
            Input::MuS => !effects.cloth,
            Input::E | Input::ESlope => !effects.inelasticity,
            Input::MassRatio | Input::RadiusRatio => model.object.is_none(),
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
    /// μ, at a large slip if it decreases.
    pub mu: D,
    /// b and c of a friction that decreases.
    pub fall: Option<[D; 2]>,
}

/// Impulses per unit of the object ball's mass, m/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Impulses<D> {
    /// The normal impulse.
    pub q: D,
    /// J_y and J_z of the friction between the balls, on the object ball.
    pub friction: [D; 2],
    /// The impulses of the cloth on each ball, x and y.
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
        let per_r = values[Input::MassRatio].recip();
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

    /// Returns the impulses of a rigid contact, from those between the balls.
    #[inline(always)]
    pub fn impulses(&self, values: &Values<D>, [mut q, j_y, j_z]: [D; 3]) -> Impulses<D> {
        let (zero, ratio, mu_s) = (D::from(0.0), values[Input::RadiusRatio], values[Input::MuS]);
        let tilt = (-ratio + 1.0) / (ratio + 1.0);
        let up = j_z + tilt * q;
        let [mut carried, mut rises] = [zero; 2];
        if up.re() < 0.0 {
            // N/(N + μ_s sin δ), to first order
            q -= q * tilt * mu_s / self.n;
            carried = up;
        } else {
            rises = up;
        }
        let cloth = [[zero; 2], [mu_s * carried, zero]];
        Impulses { q, friction: [j_y, j_z], cloth, up: [-self.per_r * carried, rises] }
    }
}

/// Returns both balls after the impact in the order of [`super::Outcome::components`].
#[inline(always)]
pub(super) fn components<D: Number>(values: &Values<D>, model: &Model, impulses: &Impulses<D>) -> [D; 12] {
    let &Impulses { q, friction: [j_y, j_z], cloth: [[c_x, c_y], [o_x, o_y]], up: [cue_up, object_up] } =
        impulses;
    let per_r = values[Input::MassRatio].recip();
    // 1/(rν_c R_c) and 1/(ν_o R_o)
    let ([per_c, per_o], per_radius) = (model.per_inertia(), 1.0 / model.ball.radius);
    let on_cue = per_r * (per_c * per_radius);
    let on_object = values[Input::RadiusRatio] * (per_o * per_radius);
    let sigma = model.torque_sign();
    [
        values[Input::VelocityX] + per_r * (c_x - q),
        values[Input::VelocityY] + per_r * (c_y - j_y),
        cue_up,
        values[Input::SpinX] + on_cue * c_y,
        values[Input::SpinY] + on_cue * (j_z - c_x),
        values[Input::SpinZ] - on_cue * j_y,
        q + o_x,
        j_y + o_y,
        object_up,
        on_object * o_y * sigma,
        on_object * (j_z - o_x * sigma),
        -on_object * j_y,
    ]
}

/// Completes derivatives: e = e₀ − e₁k, and if the cloth does not act on the cue ball (`plain`)
/// only U_y + Rω_z counts, no spin about the line of centres.
pub(super) fn complete(by: &mut Jacobian, values: &Values<f64>, model: &Model, plain: bool) {
    if plain {
        let kept = |row: usize| SVector::<f64, 12>::from_fn(|i, _| f64::from(i == row));
        let by_spin = model.ball.radius * (by.column(Input::VelocityY as usize) - kept(1)) + kept(5);
        by.set_column(Input::SpinX as usize, &kept(3));
        by.set_column(Input::SpinZ as usize, &by_spin);
    }
    let by_slope = -values[Input::VelocityX] * by.column(Input::E as usize);
    by.set_column(Input::ESlope as usize, &by_slope);
}
