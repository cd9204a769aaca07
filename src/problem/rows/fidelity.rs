//! Effects beyond those of the sliding contact: its compliance, and the balls' weight with all that
//! the cloth does during the impact.

use std::sync::Arc;

use nalgebra::SVector;

use super::shot::Row;
use crate::measurement::observable::{Axis, Observable};
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::effects::{self, Compared};
use crate::physics::collision::{Coefficients, Fidelity, FidelityChoice, Model};
use crate::physics::friction_law::Law;
use crate::problem::descent::Descent;
use crate::problem::film::impact::Side;
use crate::problem::minimise::{descend_with_noise, fit};
use crate::problem::policy::Policy;
use crate::problem::problem::{Problem, State};
use crate::problem::unknowns::{Id, Mode, Shared};

/// Part of the smallest error of a shot that may be left out: squared it adds a hundredth.
const PART: f64 = 0.1;

/// Part of the speed that may be left out if no error is stated.
const OTHERWISE: f64 = 1e-4;

/// Rounds of computing offsets and fitting.
const ROUNDS: usize = 2;

/// An effect that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// `compliance` or `weight`.
    pub name: &'static str,
    /// Number of shots on which it is as large as a part of their errors.
    pub shots: usize,
    /// Fall of −2 log L with it.
    pub fall: f64,
    /// Whether it was adopted.
    pub adopted: bool,
}

/// Adopts the effects that make the shots likelier by enough.
pub(super) fn choose_effects(
    problem: &mut Problem,
    descent: &mut Descent,
    fidelity: FidelityChoice,
    (settings, ball): (&Settings, Ball),
    policy: &Policy,
) -> Vec<Effect> {
    let mut tried = Vec::new();
    let is_auto = fidelity == FidelityChoice::Auto;
    if is_auto && settings.compliance == Compliance::Auto && settings[Parameter::Kappa].initial > 0.0 {
        tried.extend(try_compliance(problem, descent, settings[Parameter::Kappa].initial, policy));
    }
    if is_auto || fidelity == FidelityChoice::Of(Fidelity::Contact) {
        tried.extend(try_weight(problem, descent, (ball, !is_auto), policy));
    }
    tried
}

/// Tries a compliant contact if shots stick.
fn try_compliance(
    problem: &mut Problem,
    descent: &mut Descent,
    kappa: f64,
    policy: &Policy,
) -> Option<Effect> {
    let shots = descent.end.shots.iter().flatten().filter(|shot| shot.sticks).count();
    if shots == 0 {
        return None;
    }
    let mut compliant = problem.clone();
    compliant.unknown_mut(Id::Kappa).start = kappa;
    compliant.refresh_contact();
    let mut start = descent.end.state.clone();
    start.shared[Id::Kappa] = kappa;
    let with = fit(&mut compliant, &start)?;
    Some(adopt("compliance", shots, (problem, descent), (compliant, with), policy.cause))
}

/// Tries the outcomes with the balls' weight of the shots on which it is as large as a part of their
/// errors.
fn try_weight(
    problem: &mut Problem,
    descent: &mut Descent,
    (ball, of_all): (Ball, bool),
    policy: &Policy,
) -> Option<Effect> {
    let mut weighed = problem.clone();
    let shots = offset_by_weight(&mut weighed, &descent.end.state, ball, of_all);
    if shots == 0 {
        return None;
    }
    let mut with = descend_with_noise(&mut weighed, descent.end.state.clone());
    for _ in 1..ROUNDS {
        offset_by_weight(&mut weighed, &with.end.state, ball, of_all);
        with = descend_with_noise(&mut weighed, with.end.state);
    }
    let least = if of_all { f64::NEG_INFINITY } else { policy.cause };
    Some(adopt("weight", shots, (problem, descent), (weighed, with), least))
}

/// Adopts a refit if −2 log L falls by more than `least`.
fn adopt(
    name: &'static str,
    shots: usize,
    (problem, descent): (&mut Problem, &mut Descent),
    (other, with): (Problem, Descent),
    least: f64,
) -> Effect {
    let fall = minus_two_log(problem, descent) - minus_two_log(&other, &with);
    let adopted = fall > least;
    if adopted {
        (*problem, *descent) = (other, with);
    }
    Effect { name, shots, fall, adopted }
}

/// Returns −2 log L up to a constant, greatest over the noises that are not stated.
fn minus_two_log(problem: &Problem, descent: &Descent) -> f64 {
    let sums = descent.end.noises(0);
    let Some(rows) = problem.rows() else { return descent.end.cost };
    let of_noise = sums
        .iter()
        .zip(&rows.noises)
        .map(|(sum, noise)| sum.count * (sum.weighted * noise.sd * noise.sd / sum.count).ln() - sum.weighted);
    descent.end.cost + of_noise.sum::<f64>()
}

/// Gives shots the difference of the outcome with the balls' weight as their offset; returns how many.
fn offset_by_weight(problem: &mut Problem, state: &State, ball: Ball, of_all: bool) -> usize {
    let shared = problem.samples[0].gather(&state.shared);
    let falls = problem.unknown(Id::FallB).mode == Mode::Free || shared[Id::FallB] != 0.0;
    let Some(rows) = problem.rows_mut() else { return 0 };
    let contact = rows.contact;
    let noises: Vec<f64> = rows.noises.iter().map(|noise| noise.sd).collect();
    let model = model_at(&shared, contact.object(), ball, falls, contact.is_compliant());
    let coefficients = Coefficients { mu: shared[Id::Mu], mu_s: shared[Id::MuS], e: shared[Id::E] };
    let mut count = 0;
    for (shot, own) in Arc::make_mut(&mut rows.shots).iter_mut().zip(&state.own[0]) {
        let sd = |row: &Row, i: usize| row.noise.map_or_else(|| shot.stated_sd(i), |noise| noises[noise]);
        let errors: Vec<(Observable, f64)> =
            shot.rows.iter().enumerate().map(|(i, row)| (row.observable, sd(row, i))).collect();
        let (cue, _) = shot.approach(own, &shared, &contact);
        let cue = state_of(&cue, ball.radius);
        let offset = difference_by_weight(&model, &cue, &coefficients, &errors, of_all);
        count += usize::from(offset.is_some() && shot.knows_speed());
        shot.offset = offset.filter(|_| shot.knows_speed()).unwrap_or_default();
    }
    count
}

/// Returns the difference of velocities and spins times radii, m/s; `None` if it is small.
fn difference_by_weight(
    model: &Model,
    cue: &BallState,
    coefficients: &Coefficients,
    errors: &[(Observable, f64)],
    of_all: bool,
) -> Option<SVector<f64, 12>> {
    let speed = cue.velocity.norm();
    // an error of an angle is one of a velocity over the speed; the object ball is slower in thin cuts
    let relative = |(observable, sd): &(Observable, f64)| match observable {
        Observable::CueSpin(_) | Observable::ObjectSpin(_) => sd * model.ball.radius / speed,
        Observable::ObjectSpeedRatio => *sd,
        observable if observable.is_angle() => sd * cue.velocity.x / speed,
        _ => sd / speed,
    };
    let least = errors.iter().map(relative).fold(f64::INFINITY, f64::min);
    let tolerance = if least.is_finite() { PART * least } else { OTHERWISE };
    let sees_spin = |(observable, _): &(Observable, f64)| {
        matches!(
            observable,
            Observable::CueSpin(_)
                | Observable::ObjectSpin(_)
                | Observable::CueVelocity(Axis::Z)
                | Observable::ObjectVelocity(Axis::Z)
                | Observable::CueTurnRolling
                | Observable::ObjectAngleRolling
                | Observable::CueSpeedRolling
                | Observable::ObjectSpeedRolling
        )
    };
    let compared = if errors.iter().any(sees_spin) { Compared::Everything } else { Compared::Velocities };
    let choice = effects::choose(model, cue, coefficients, tolerance, compared).ok()?;
    if choice.fidelity != Fidelity::Contact && !of_all {
        return None;
    }
    let fine = Model { fidelity: Fidelity::Contact, tolerance: Model::TOLERANCE_OF_FITS, ..*model };
    let effects = if of_all { fine.effects } else { choice.effects };
    let fine = Model { effects, ..fine }.with_some_compliance();
    let with = fine.collide(cue, coefficients).ok()?.components();
    let without = model.collide(cue, coefficients).ok()?.components();
    let radii = [model.ball.radius, model.object_ball().radius];
    let scale = |i: usize| if i % 6 < 3 { 1.0 } else { radii[i / 6] };
    Some(SVector::from_fn(|i, _| (with[i] - without[i]) * scale(i)))
}

/// Returns the model that shots are computed with.
fn model_at(shared: &Shared, object: Ball, ball: Ball, falls: bool, is_compliant: bool) -> Model {
    let object = Ball {
        mass: ball.mass / shared[Id::MassRatio],
        radius: ball.radius / shared[Id::RadiusRatio],
        ..object
    };
    let law =
        if falls { Law::Exponential { b: shared[Id::FallB], c: shared[Id::FallC] } } else { Law::Constant };
    let e_slope = Some(shared[Id::ESlope]).filter(|slope| *slope != 0.0);
    let model = Model { object: Some(object), law, e_slope, ..Model::new(Fidelity::Full, ball) };
    if is_compliant { model.giving_way(shared[Id::Kappa]) } else { model }
}

fn state_of(side: &Side, radius: f64) -> BallState {
    let [x, y, z] = side.spin.map(|spin| spin.re / radius);
    BallState { velocity: Vec3::new(side.velocity.x.re, side.velocity.y.re, 0.0), spin: Vec3::new(x, y, z) }
}
