//! From the numbers of a shot to those of its impact, and from the impulses back to both balls: the same lines for plain numbers and
//! for numbers with derivatives.
//!
//! All impulses are per unit of the object ball's mass, r = m_cue/m_object (Kim 2024, Eqs. 10–16 and 42–49; unequal balls beyond
//! the paper). Radii R_c and R_o that differ tilt the line of centres by sin δ = (R_o − R_c)/(R_o + R_c): to first order the normal
//! impulse P has a vertical part P sin δ. A larger cue ball presses the object ball into the cloth and rises itself, a smaller one
//! lifts the object ball. The cloth's friction on a ball so pressed takes part in the impact: dv_x/dq = N + μ_s sin δ. (The slip
//! along the surface that the tilt makes of the closing speed, k sin δ, is left out: it turns the friction by k sin δ/v_∥0.)

use std::ops::Index;

use nalgebra::{SMatrix, SVector};
use num_dual::{Derivative, DualSVec64};

use super::{Coefficients, Input, Model, Number};
use crate::physics::ball::BallState;
use crate::physics::friction_law::Law;

/// A number with its derivatives by the first N inputs.
pub(super) type Dual<const N: usize> = DualSVec64<N>;

/// What an outcome depends on, in the order of [`Input`].
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
    /// The values of a shot; those of effects that are off are what takes them away.
    #[inline(always)]
    pub fn new(model: &Model, cue: &BallState, coefficients: &Coefficients) -> Self {
        let &Coefficients { mu, mu_s, e } = coefficients;
        let effects = model.effects.and(model.fidelity.effects());
        let (b, c) = match model.law {
            Law::Exponential { b, c } if effects.friction => (b, c),
            _ => (0.0, 0.0),
        };
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

    /// The same with derivatives by the first N; nothing depends on the coefficient of an effect that is off.
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

    /// The same with one input changed.
    pub fn moved(mut self, input: Input, by: f64) -> Self {
        self.0[input as usize] += by;
        self
    }
}

/// The numbers that the impulses follow from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Impact<D> {
    /// k, the closing speed, m/s.
    pub k: D,
    /// v_y0, v_z0, m/s.
    pub slip: [D; 2],
    /// Whether the cloth takes part: v_z0 > 0.
    pub topspin: bool,
    /// 2β_y, 2β_z.
    pub lever: [D; 2],
    /// N = 1 + 1/r: dv_x/dq without the cloth.
    pub n: D,
    /// m_s: μ_s with topspin, else 0.
    pub m_s: D,
    /// e at this closing speed.
    pub e: D,
    /// μ, at a large slip if it falls.
    pub mu: D,
    /// b and c of a friction that falls.
    pub fall: Option<[D; 2]>,
}

/// The impulses q, J_y and J_z between the balls on the object ball, per unit of its mass, m/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Impulses<D> {
    pub q: D,
    pub y: D,
    pub z: D,
}

impl<D: Number> Impact<D> {
    #[inline(always)]
    pub fn new(values: &Values<D>, model: &Model) -> Self {
        let [nu_c, nu] = [model.ball.inertia, model.object_ball().inertia];
        let (k, radius) = (values[Input::VelocityX], model.ball.radius);
        let slip = [-values[Input::VelocityY] - values[Input::SpinZ] * radius, values[Input::SpinY] * radius];
        let topspin = slip[1].re() > 0.0;
        let m_s = if topspin { values[Input::MuS] } else { D::from(0.0) };
        let per_r = values.per_mass_ratio();
        let [per_c, per_o] = if nu_c == nu { [1.0 / nu; 2] } else { [1.0 / nu_c, 1.0 / nu] };
        let lever_y = per_r * (1.0 + per_c) + (1.0 + per_o);
        let lever_z = if topspin {
            per_r * (1.0 + per_c) + (-m_s * model.cloth_torque.sign() + 1.0) * per_o
        } else {
            per_r * per_c + (1.0 + per_o)
        };
        // e = e₀ − e₁k, not below 0
        let e = values[Input::E] - values[Input::ESlope] * k;
        let e = if e.re() < 0.0 { D::from(0.0) } else { e };
        // b = 0 is a constant friction, except to its derivative by b
        let falls = model.law != Law::Constant && (D::NDERIV > 0 || values[Input::B].re() != 0.0);
        let fall = falls.then(|| [values[Input::B], values[Input::C]]);
        Self {
            k,
            slip,
            topspin,
            lever: [lever_y, lever_z],
            n: per_r + 1.0,
            m_s,
            e,
            mu: values[Input::Mu],
            fall,
        }
    }

    /// The friction at first contact, and its direction cos θ₀, sin θ₀; `None` without slip.
    #[inline(always)]
    pub fn first_friction(&self) -> Option<(D, [D; 2])> {
        let most = self.slip[0].re().abs().max(self.slip[1].re().abs());
        if most == 0.0 {
            return None;
        }
        // a square may be out of range
        let (y, z) = (self.slip[0] / most, self.slip[1] / most);
        let part = (y * y + z * z).sqrt();
        let mu = match self.fall {
            None => self.mu,
            Some([b, c]) => self.mu + b * (-c * part * most).exp(),
        };
        Some((mu, [-y / part, -z / part]))
    }
}

/// Both balls after the impact in the order of [`super::Outcome::components`].
#[inline(always)]
pub(super) fn components<D: Number>(values: &Values<D>, model: &Model, impulses: &Impulses<D>) -> [D; 12] {
    let &Impulses { q, y: j_y, z: j_z } = impulses;
    let [nu_c, nu] = [model.ball.inertia, model.object_ball().inertia];
    let (radius, sigma) = (model.ball.radius, model.cloth_torque.sign());
    let per_r = values.per_mass_ratio();
    let ratio = values[Input::RadiusRatio];
    let (mu_s, zero) = (values[Input::MuS], D::from(0.0));
    let (mut q, mut up) = (q, j_z);
    if D::NDERIV > 0 || ratio.re() != 1.0 {
        let tilt = (-ratio + 1.0) / (ratio + 1.0);
        up += tilt * q;
        if up.re() < 0.0 {
            // N/(N + μ_s sin δ), to first order
            q -= q * tilt * mu_s / (per_r + 1.0);
        }
    }
    let pressed = up.re() < 0.0;
    let rises = if up.re() > 0.0 { up } else { zero };
    let carried = if pressed { up } else { zero };
    // of the cloth, along x
    let braked = mu_s * carried;
    // U_f = U_i − (q, J_y, J_z [θ<0])/r,  ω_f = ω_i + (0, J_z, −J_y)/(rν_c R_c)
    let per_inertia = 1.0 / (nu_c * radius);
    let on_cue = per_r * per_inertia;
    // V_f = (q + m_s J_z, J_y, J_z [θ>0]),  Ω_f = (0, J_z − σm_s J_z, −J_y)/νR_o
    let on_object = ratio * (if nu == nu_c { per_inertia } else { 1.0 / (nu * radius) });
    [
        values[Input::VelocityX] - per_r * q,
        values[Input::VelocityY] - per_r * j_y,
        -per_r * carried,
        values[Input::SpinX],
        values[Input::SpinY] + on_cue * j_z,
        values[Input::SpinZ] - on_cue * j_y,
        q + braked,
        j_y,
        rises,
        zero,
        on_object * (j_z - braked * sigma),
        -on_object * j_y,
    ]
}

/// The derivatives of the components.
pub(super) fn derivatives<const N: usize>(components: &[Dual<N>; 12]) -> SMatrix<f64, 12, N> {
    let mut by = SMatrix::<f64, 12, N>::zeros();
    for (row, number) in components.iter().enumerate() {
        if let Some(eps) = &number.eps.0 {
            by.set_row(row, &eps.transpose());
        }
    }
    by
}
