//! What [`ode`] and [`contact`] have in common: from a shot to what drives the balls, and
//! from the impulses to the outcome and its derivative.

pub(crate) mod compliant;
pub(crate) mod contact;
pub(crate) mod dynamics;
mod fall;
mod lanes;
pub(crate) mod ode;
pub(crate) mod phase;
mod quick;
mod quick_derivatives;
mod quick_equations;
pub(crate) mod settle;
pub(crate) mod solver;
pub(crate) mod starts;

use super::{
    Coefficients, Contact, Fidelity, Input, Jacobian, MAX_KAPPA, MAX_TOLERANCE, MIN_TOLERANCE, Model,
    NotACollision, Others, Outcome, Regime,
};
use crate::physics::ball::{BallState, Vec3};
use crate::physics::cloth_motion::GRAVITY;
use crate::physics::contact_frame::cloth_slip;
use crate::physics::friction_law::Friction;
use dynamics::{Dynamics, STIFF};

/// All impulses of a collision per unit mass, and the vertical velocities that they leave, m/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Impulses {
    /// q, J_y, J_z between the balls.
    pub normal: f64,
    pub y: f64,
    pub z: f64,
    /// Of the cloth's friction along x, y.
    pub cue_cloth: [f64; 2],
    pub object_cloth: [f64; 2],
    pub cue_up: f64,
    pub object_up: f64,
}

pub(super) fn collide(
    model: &Model,
    cue: &BallState,
    coefficients: &Coefficients,
    contact: &Contact,
) -> Result<Outcome, NotACollision> {
    let dynamics = dynamics(model, cue, coefficients, contact)?;
    let tolerance = model.tolerance;
    let quick = || quick::impulses(&dynamics, contact.e);
    let solved = if let Some(solved) = quick::serves(model, &dynamics).then(quick).flatten() {
        Ok(solved)
    } else if dynamics.kappa > 0.0 {
        compliant::impulses(&dynamics, contact.e, tolerance)
    } else if model.fidelity == Fidelity::Contact {
        contact::impulses(&dynamics, contact.e, tolerance)
    } else {
        ode::impulses(&dynamics, contact.e, tolerance)
    };
    let (impulses, regime) = solved.map_err(|_| match dynamics.kappa {
        kappa if 0.0 < kappa && kappa < STIFF => NotACollision::TooStiff(kappa),
        _ => NotACollision::NotIntegrated(tolerance),
    })?;
    Ok(outcome(model, cue, &impulses, regime))
}

/// What drives the balls of a shot.
fn dynamics(
    model: &Model,
    cue: &BallState,
    coefficients: &Coefficients,
    contact: &Contact,
) -> Result<Dynamics, NotACollision> {
    let &Model { effects, tolerance, mu_k, contact_time, .. } = model;
    if !(MIN_TOLERANCE..=MAX_TOLERANCE).contains(&tolerance) {
        return Err(NotACollision::Tolerance(tolerance));
    }
    let mut friction = model.law.friction(coefficients.mu);
    if !(mu_k >= 0.0 && friction.largest() * mu_k < 1.0 + model.mass_ratio()) {
        return Err(NotACollision::MuKOutOfRange(mu_k));
    }
    if !(0.0..=MAX_KAPPA).contains(&model.kappa) {
        return Err(NotACollision::KappaOutOfRange(model.kappa));
    }
    if !(contact_time > 0.0 && contact_time.is_finite()) {
        return Err(NotACollision::ContactTime(contact_time));
    }
    let effects = effects.and(model.fidelity.effects());
    if !(effects.friction && effects.falling_friction) {
        friction = Friction::Constant(contact.mu);
    }
    let mut dynamics = Dynamics::new(contact, friction, tolerance);
    dynamics.mu_s = if effects.cloth { coefficients.mu_s } else { 0.0 };
    dynamics.cloth_turning = effects.cloth_turning;
    if model.object.is_some() {
        dynamics = dynamics.with_unequal(model.mass_ratio(), model.ball.inertia, model.tilt());
    }
    if effects.cloth_on_cue {
        let slip = cloth_slip(cue, model.ball.radius);
        dynamics = dynamics.with_cloth_on_cue(mu_k, [slip.x, slip.y], cue.velocity.norm());
    }
    if model.fidelity == Fidelity::Contact && effects.gravity {
        dynamics.gravity = GRAVITY * contact::time_unit(contact_time, contact.k) / contact.k;
    }
    if effects.compliance && model.kappa > 0.0 && friction.largest() > 0.0 {
        dynamics.kappa = model.kappa;
    }
    Ok(dynamics)
}

fn outcome(model: &Model, cue: &BallState, impulses: &Impulses, regime: Regime) -> Outcome {
    let &Impulses { normal: q, y: j_y, z: j_z, cue_cloth: c, object_cloth: o, cue_up, object_up } = impulses;
    let (object, per_r) = (model.object_ball(), 1.0 / model.mass_ratio());
    let (cue_nu_r, nu_r) = (model.ball.inertia * model.ball.radius, object.inertia * object.radius);
    let sigma = model.cloth_torque.sign();
    // U_f = U_i + ((C_x − q)/r, (C_y − J_y)/r, U_z),  ω_f = ω_i + (C_y, J_z − C_x, −J_y)/(rν_c R_c)
    let cue = BallState {
        velocity: cue.velocity + Vec3::new(per_r * (c[0] - q), per_r * (c[1] - j_y), cue_up),
        spin: cue.spin + per_r * Vec3::new(c[1], j_z - c[0], -j_y) / cue_nu_r,
    };
    // V_f = (q + O_x, J_y + O_y, V_z),  Ω_f = (σO_y, J_z − σO_x, −J_y)/νR
    let object = BallState {
        velocity: Vec3::new(q + o[0], j_y + o[1], object_up),
        spin: Vec3::new(sigma * o[1], j_z - sigma * o[0], -j_y) / nu_r,
    };
    Outcome { regime, impulse: q, cue, object }
}

/// Inputs that a difference moves: the coefficients, and U_x, U_y, ω_x, ω_y, ω_z.
const INPUTS: [Input; 8] = [
    Input::Mu,
    Input::MuS,
    Input::E,
    Input::VelocityX,
    Input::VelocityY,
    Input::SpinX,
    Input::SpinY,
    Input::SpinZ,
];

/// Differences are central, with a step h of the cube root of the tolerance: the truncation h² and the
/// tolerance over h are then equal. Where one side is another regime, or no collision, they are
/// one-sided. What is computed with exact derivatives has one by κ, b and c, too.
pub(super) fn collide_with_jacobian(
    model: &Model,
    cue: &BallState,
    coefficients: &Coefficients,
    contact: &Contact,
) -> Result<(Outcome, Jacobian, Option<Others>), NotACollision> {
    let of_shot = dynamics(model, cue, coefficients, contact)?;
    let quick = || quick_derivatives::with_jacobian(model, cue, contact, &of_shot);
    if let Some((outcome, jacobian, others)) = quick::serves(model, &of_shot).then(quick).flatten() {
        return Ok((outcome, jacobian, Some(others)));
    }
    let start = collide(model, cue, coefficients, contact)?;
    let components = start.components();
    let mut jacobian = Jacobian::zeros();
    for input in INPUTS {
        let step = step(model, contact, input);
        let moved = |by: f64| {
            let (mut cue, mut coefficients) = (*cue, *coefficients);
            let moved = match input {
                Input::Mu => &mut coefficients.mu,
                Input::MuS => &mut coefficients.mu_s,
                Input::E => &mut coefficients.e,
                Input::VelocityX => &mut cue.velocity.x,
                Input::VelocityY => &mut cue.velocity.y,
                Input::SpinX => &mut cue.spin.x,
                Input::SpinY => &mut cue.spin.y,
                Input::SpinZ => &mut cue.spin.z,
            };
            *moved += by;
            let there = model.contact(&cue, &coefficients).ok()?;
            if contact.v_z != 0.0 && (there.v_z > 0.0) != (contact.v_z > 0.0) {
                return None;
            }
            let outcome = collide(model, &cue, &coefficients, &there).ok()?;
            (outcome.regime == start.regime).then(|| outcome.components())
        };
        let difference = |from: f64, to: f64| -> Option<_> {
            let value = |by: f64| if by == 0.0 { Some(components) } else { moved(by) };
            Some((value(to)? - value(from)?) / (to - from))
        };
        let column = difference(-step, step)
            .or_else(|| difference(0.0, step))
            .or_else(|| difference(-step, 0.0))
            .unwrap_or_else(Default::default);
        jacobian.set_column(input as usize, &column);
    }
    Ok((start, jacobian, None))
}

/// The step of an input, in its unit.
fn step(model: &Model, contact: &Contact, input: Input) -> f64 {
    let h = model.tolerance.cbrt();
    let k = contact.k;
    match input {
        Input::Mu | Input::MuS | Input::E => h,
        Input::VelocityX | Input::VelocityY => h * k,
        Input::SpinX | Input::SpinY | Input::SpinZ => h * k / model.ball.radius,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::collision::steps;

    /// Of `contact` with e = 1e-9 at the tightest tolerance; with e of 1e-3 or more, and `ode` with any, a tenth.
    const MOST_STEPS: usize = 1_500;

    #[test]
    fn hard_cases_take_a_bounded_number_of_steps() {
        for fidelity in [Fidelity::Ode, Fidelity::Contact] {
            for tolerance in [MIN_TOLERANCE, Model::TOLERANCE] {
                let same = Fidelity::Full.effects();
                let model = Model { effects: same, tolerance, ..Model::new(fidelity, steps::HARD) };
                let (most, name) = steps::most_of_hard_cases(&model);
                assert!(most <= MOST_STEPS, "{fidelity:?}: {most} steps: {name}");
            }
        }
    }
}
