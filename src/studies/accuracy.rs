//! The error of every fidelity on a set of shots, and the time of a collision.
//!
//! The numerical error is against the same equations: of a rigid contact against `full`, whose own
//! error is against a table of 25 digits; of a compliant one against itself at the least of
//! [`TOLERANCES`]. The model error, by the effects that a fidelity leaves out, is against `contact`
//! at the least of [`TOLERANCES`].

use std::hint::black_box;
use std::time::Instant;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::Settings;
use crate::measurement::written::written_by_name;
use crate::name::worded;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{Coefficients, Fidelity, Model, NotACollision, Outcome, TOLERANCES};
use crate::physics::contact_frame::cue_velocity;
use crate::problem::predict;
use crate::simulate::{self, Spec, SynthError};

/// Collisions of rigid balls to 25 digits, made independently (tests/reference/SOURCE.md).
const TABLE: &str = include_str!("../../tests/reference/collisions.json");

/// The distribution of an error over the shots.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Spread {
    /// Half of the shots err by less.
    #[schemars(with = "Option<f64>")]
    pub(crate) median: f64,
    /// 95 % of the shots err by less.
    #[schemars(with = "Option<f64>")]
    pub(crate) p95: f64,
    /// The largest error.
    #[schemars(with = "Option<f64>")]
    pub(crate) worst: f64,
}

/// Errors of all quantities, in parts of the cue ball's speed but for the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Errors {
    /// Error of the throw.
    pub(crate) throw_deg: Spread,
    /// Error of the horizontal velocities.
    pub(crate) speed: Spread,
    /// Error of the spins times the radius.
    pub(crate) spin: Spread,
    /// Error of the vertical velocities.
    pub(crate) jump: Spread,
}

worded! {
    /// Which effects a row of the study includes.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum Includes {
        /// Those that `full` can simulate.
        AsFull = "as-full",
        /// All effects.
        All = "all",
        /// Those that `full` can simulate, and the compliance of the contact.
        Compliant = "compliant",
    }
    /// The name in the JSON of `accuracy`.
    pub fn name;
}

written_by_name!(Includes);

/// A way to compute a collision.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Row {
    /// Name of the fidelity.
    pub(crate) fidelity: Fidelity,
    /// Effects that are on: all that the fidelity has, those of full, or those of a compliant
    /// contact.
    #[serde(rename = "effects")]
    pub(crate) includes: Includes,
    /// Tolerance of ode and contact.
    pub(crate) tolerance: Option<f64>,
    /// Duration of one collision on one core, s.
    pub(crate) seconds: f64,
    /// Number of shots that it could not compute, which are left out of the errors.
    pub(crate) failed: usize,
    /// Errors against the same equations solved closely, of full against a table of 25 digits; null
    /// of contact, whose model error is a numerical one.
    #[serde(rename = "numerical_error")]
    pub(crate) numerical: Option<Errors>,
    /// Errors against contact with all effects.
    #[serde(rename = "model_error")]
    pub(crate) model: Errors,
}

/// Returns seeded shots as on a table, without noise: natural roll, stun, draw and side spin.
///
/// # Errors
/// The number of shots is out of its range, or temporary files cannot be written.
pub fn dataset(count: u32, seed: u64) -> Result<Dataset, SynthError> {
    let Coefficients { mu, mu_s, e } = Settings::default().coefficients();
    let spec: Spec = format!(
        "name = \"accuracy\"\nkind = \"impacts\"\nseed = {seed}\ntruth = {{ mu = {mu:?}, mu_s = {mu_s:?}, e = {e:?} }}\n\
         [shots]\ncount = {count}\nspeed_m_s = [0.5, 5.0]\ncut_deg = [-70.0, 70.0]\n\
         cue_spin = [\"natural-roll\", \"stun\", \"draw\", \"side\"]\n"
    )
    .parse()?;
    simulate::dataset(&spec)
}

/// Returns the cue ball of each shot of a data set that can be computed, in the collision frame.
pub fn cue_balls(dataset: &Dataset) -> Vec<BallState> {
    let (coefficients, model) = (dataset.settings.coefficients(), dataset.model(Fidelity::Full));
    let shots = dataset.shots.iter();
    shots.filter_map(|shot| Some(predict(shot, &model, &coefficients).ok()?.cue)).collect()
}

/// Returns the errors of `full` on the collisions of pool balls in the reference table.
fn errors_of_full() -> Errors {
    let cases: Vec<Value> = serde_json::from_str(TABLE).unwrap_or_default();
    // digits are strings
    let number = |value: &Value| value.as_f64().or_else(|| value.as_str()?.parse().ok()).unwrap_or(f64::NAN);
    let vector = |value: &Value| Vec3::from([0, 1, 2].map(|i| number(&value[i])));
    let ball =
        |value: &Value| BallState { velocity: vector(&value["velocity"]), spin: vector(&value["spin"]) };
    let model = Model::new(Fidelity::Full, Ball::POOL);
    let mut errors = Vec::new();
    for case in cases.iter().filter(|case| case["as_printed"] == false) {
        let [speed, cut_deg, mu, mu_s, e] =
            ["speed", "cut_deg", "mu", "mu_s", "e"].map(|key| number(&case[key]));
        let velocity = cue_velocity(speed, cut_deg.to_radians());
        let cue = BallState { velocity, spin: vector(&case["omega"]) };
        let Ok(outcome) = model.collide(&cue, &Coefficients { mu, mu_s, e }) else { continue };
        let reference = Outcome { cue: ball(&case["cue"]), object: ball(&case["object"]), ..outcome };
        errors.push(errors_of(speed, Ball::POOL.radius, &outcome, &reference));
    }
    spreads(&errors)
}

/// Runs every fidelity over the shots of a data set, at the initial values of its parameters;
/// `kappa` is the κ of a compliant contact.
///
/// # Errors
/// A shot is not a collision.
pub(crate) fn study(dataset: &Dataset, shots: &[BallState], kappa: f64) -> Result<Vec<Row>, NotACollision> {
    let (ball, coefficients) = (dataset.ball, dataset.settings.coefficients());
    let all = |model: &Model| -> Result<Vec<Outcome>, NotACollision> {
        let model = Model { tolerance: *TOLERANCES.start(), ..*model };
        shots.iter().map(|cue| model.collide(cue, &coefficients)).collect()
    };
    let contact = Model { kappa, ..Model::new(Fidelity::Contact, ball) };
    let compliant = Model { kappa, ..Model::new(Fidelity::Ode, ball) };
    let rigid = Model::new(Fidelity::Ode, ball);
    let exact = all(&Model::new(Fidelity::Full, ball))?;
    let (with_compliance, with_everything) = (all(&compliant)?, all(&contact)?);
    let row = |model: Model, includes: Includes| {
        let outcomes: Vec<Option<Outcome>> =
            shots.iter().map(|cue| model.collide(cue, &coefficients).ok()).collect();
        let against = |reference: &[Outcome]| {
            let each = shots.iter().zip(&outcomes).zip(reference);
            let errors = each.filter_map(|((cue, outcome), reference)| {
                Some(errors_of(cue.velocity.norm(), ball.radius, outcome.as_ref()?, reference))
            });
            spreads(&errors.collect::<Vec<_>>())
        };
        Row {
            fidelity: model.fidelity,
            tolerance: model.fidelity.is_integrated().then_some(model.tolerance),
            includes,
            seconds: timed(&model, shots, &coefficients),
            numerical: match includes {
                Includes::AsFull if model.fidelity == Fidelity::Full => Some(errors_of_full()),
                Includes::AsFull => Some(against(&exact)),
                Includes::Compliant => Some(against(&with_compliance)),
                Includes::All => None,
            },
            model: against(&with_everything),
            failed: outcomes.iter().filter(|outcome| outcome.is_none()).count(),
        }
    };
    let closed = [Fidelity::Elastic, Fidelity::Inelastic, Fidelity::Linear, Fidelity::Full];
    let mut rows = closed.map(|fidelity| row(Model::new(fidelity, ball), Includes::AsFull)).to_vec();
    let ways = [(rigid, Includes::AsFull), (compliant, Includes::Compliant), (contact, Includes::All)];
    for (model, includes) in ways {
        // the reference has no error against itself
        let run = |tolerance: &f64| includes == Includes::AsFull || *tolerance > *TOLERANCES.start();
        let tolerances = [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, *TOLERANCES.start()].into_iter().filter(run);
        rows.extend(tolerances.map(|tolerance| row(Model { tolerance, ..model }, includes)));
    }
    Ok(rows)
}

/// Returns seconds per collision: the fastest of the passes over all shots within 0.1 s.
fn timed(model: &Model, shots: &[BallState], coefficients: &Coefficients) -> f64 {
    let begun = Instant::now();
    let mut least = f64::INFINITY;
    while begun.elapsed().as_secs_f64() < 0.1 {
        let pass = Instant::now();
        for cue in shots {
            // a failure has taken its time too
            let _ = black_box(model.collide(black_box(cue), black_box(coefficients)));
        }
        least = least.min(pass.elapsed().as_secs_f64());
    }
    least / shots.len().max(1) as f64
}

/// Returns the errors of throw, speed, spin and jump of the outcome of a shot of this speed.
fn errors_of(speed: f64, radius: f64, outcome: &Outcome, reference: &Outcome) -> [f64; 4] {
    let throw = |o: &Outcome| o.object.velocity.y.atan2(o.object.velocity.x).to_degrees();
    let worst = |error: fn(&BallState, &BallState) -> f64| {
        error(&outcome.cue, &reference.cue).max(error(&outcome.object, &reference.object)) / speed
    };
    [
        (throw(outcome) - throw(reference)).abs(),
        worst(|a, b| (a.velocity - b.velocity).xy().norm()),
        radius * worst(|a, b| (a.spin - b.spin).norm()),
        worst(|a, b| (a.velocity.z - b.velocity.z).abs()),
    ]
}

/// Returns the distributions of the errors of all shots.
fn spreads(errors: &[[f64; 4]]) -> Errors {
    let quantity = |i: usize| spread(errors.iter().map(|of_shot| of_shot[i]).collect());
    Errors { throw_deg: quantity(0), speed: quantity(1), spin: quantity(2), jump: quantity(3) }
}

fn spread(mut errors: Vec<f64>) -> Spread {
    errors.sort_by(f64::total_cmp);
    let last = errors.len().saturating_sub(1) as f64;
    let at = |part: f64| errors.get((part * last).round() as usize).copied().unwrap_or(f64::NAN);
    Spread { median: at(0.5), p95: at(0.95), worst: at(1.0) }
}
