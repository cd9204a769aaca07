//! The error of every fidelity on a set of shots, and the time of a collision.
//!
//! The numerical error is against the same equations: for a rigid contact solved to 30 digits
//! ([`exact`]), for a compliant one integrated to [`REFERENCE`]. The model error, by the effects
//! that a fidelity leaves out, is against `contact` to [`REFERENCE`].

pub mod exact;

use std::hint::black_box;
use std::time::Instant;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::Serialize;

use crate::measurement::written::written_by_name;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{Coefficients, Fidelity, Model, NotACollision, Outcome};
use crate::physics::contact_frame::cue_velocity;
use crate::physics::name::worded;

/// Tolerance of a compliant contact as a reference; only a rigid one is run at it.
pub const REFERENCE: f64 = 1e-12;

/// One shot of the study, in the collision frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// The cue ball before the impact.
    pub cue: BallState,
    /// The coefficients.
    pub coefficients: Coefficients,
}

/// The distribution of an error over the shots.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Spread {
    /// Unit of the numbers: deg, or 1 for a ratio.
    pub unit: &'static str,
    /// Half of the shots err by less.
    #[schemars(with = "Option<f64>")]
    pub median: f64,
    /// 95 % of the shots err by less.
    #[schemars(with = "Option<f64>")]
    pub p95: f64,
    /// The largest error.
    #[schemars(with = "Option<f64>")]
    pub worst: f64,
}

/// Errors of all quantities, in parts of the cue ball's speed but for the first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Errors {
    /// Error of the throw.
    pub throw_deg: Spread,
    /// Error of the horizontal velocities.
    pub speed: Spread,
    /// Error of the spins times the radius.
    pub spin: Spread,
    /// Error of the vertical velocities.
    pub jump: Spread,
}

impl Errors {
    /// Returns the error of each quantity, with its name.
    #[cfg(feature = "report")]
    pub(crate) fn each(self) -> [(&'static str, Spread); 4] {
        let Self { throw_deg, speed, spin, jump } = self;
        [("throw_deg", throw_deg), ("speed", speed), ("spin", spin), ("jump", jump)]
    }
}

worded! {
    /// Which effects a row of the study includes.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Includes {
        /// Those that `full` can simulate.
        AsFull = "as-full",
        /// All effects.
        All = "all",
        /// Those that `full` can simulate, and the compliance of the contact.
        Compliant = "compliant",
    }
    /// The name in accuracy.csv.
    pub fn name;
}

written_by_name!(Includes);

/// A way to compute a collision.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Row {
    /// Name of the fidelity.
    pub fidelity: Fidelity,
    /// Effects that are on: all that the fidelity has, those of full, or those of a compliant
    /// contact.
    #[serde(rename = "effects")]
    pub includes: Includes,
    /// Tolerance of ode and contact.
    pub tolerance: Option<f64>,
    /// Duration of one collision on one core, s.
    pub seconds: f64,
    /// Number of shots that it could not compute, which are left out of the errors.
    pub failed: usize,
    /// Errors against the same equations solved closely; null of contact, whose model error is a
    /// numerical one.
    #[serde(rename = "numerical_error")]
    pub numerical: Option<Errors>,
    /// Errors against contact with all effects.
    #[serde(rename = "model_error")]
    pub model: Errors,
}

/// Returns seeded shots as on a table: 0.5 to 5 m/s, cuts up to 70°, natural roll, stun, draw or
/// side spin.
#[must_use]
pub fn shots(count: usize, seed: u64) -> Vec<Shot> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };
    let mut shot = |number: usize| {
        let velocity = cue_velocity(rng.random_range(0.5..5.0), rng.random_range(-70_f64..70.0).to_radians());
        let roll = BallState::natural_roll(velocity, Ball::POOL.radius).spin;
        let share: f64 = rng.random();
        let spin = match number % 4 {
            0 => roll,
            1 => Vec3::zeros(),
            2 => -share * roll,
            _ => share * roll + Vec3::z() * (rng.random_range(-1.0..1.0) * roll.norm()),
        };
        Shot { cue: BallState { velocity, spin }, coefficients }
    };
    (0..count).map(&mut shot).collect()
}

/// Runs every fidelity over the shots; `kappa` is the κ of a compliant contact.
///
/// # Errors
/// A shot is not a collision.
pub fn study(shots: &[Shot], ball: Ball, kappa: f64) -> Result<Vec<Row>, NotACollision> {
    let all = |model: &Model| -> Result<Vec<Outcome>, NotACollision> {
        let model = Model { tolerance: REFERENCE, ..*model };
        shots.iter().map(|shot| model.collide(&shot.cue, &shot.coefficients)).collect()
    };
    let contact = Model { kappa, ..Model::new(Fidelity::Contact, ball) };
    let compliant = Model { kappa, ..Model::new(Fidelity::Ode, ball) };
    let exact: Vec<_> = shots.iter().map(|shot| exact::collide(shot, ball)).collect();
    let (with_compliance, with_everything) = (all(&compliant)?, all(&contact)?);
    let row = |model: Model, includes: Includes| {
        let outcomes: Vec<_> =
            shots.iter().map(|shot| model.collide(&shot.cue, &shot.coefficients).ok()).collect();
        let against = |reference: &[Outcome]| spreads(shots, &outcomes, reference, ball.radius);
        Row {
            fidelity: model.fidelity,
            tolerance: model.fidelity.is_integrated().then_some(model.tolerance),
            includes,
            seconds: timed(&model, shots),
            numerical: match includes {
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
    let rigid = Model::new(Fidelity::Ode, ball);
    let ways = [(rigid, Includes::AsFull), (compliant, Includes::Compliant), (contact, Includes::All)];
    for (model, includes) in ways {
        // the reference has no error against itself
        let run = |tolerance: &f64| includes == Includes::AsFull || *tolerance > REFERENCE;
        let tolerances = [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, REFERENCE].into_iter().filter(run);
        rows.extend(tolerances.map(|tolerance| row(Model { tolerance, ..model }, includes)));
    }
    Ok(rows)
}

/// Returns seconds per collision: the fastest of the passes over all shots within 0.1 s.
fn timed(model: &Model, shots: &[Shot]) -> f64 {
    let begun = Instant::now();
    let mut least = f64::INFINITY;
    while begun.elapsed().as_secs_f64() < 0.1 {
        let pass = Instant::now();
        for shot in shots {
            // a failure has taken its time too
            let _ = black_box(model.collide(black_box(&shot.cue), black_box(&shot.coefficients)));
        }
        least = least.min(pass.elapsed().as_secs_f64());
    }
    least / shots.len().max(1) as f64
}

fn spreads(shots: &[Shot], outcomes: &[Option<Outcome>], reference: &[Outcome], radius: f64) -> Errors {
    let mut errors: [Vec<f64>; 4] = Default::default();
    for ((shot, outcome), reference) in shots.iter().zip(outcomes).zip(reference) {
        let Some(outcome) = outcome else { continue };
        let speed = shot.cue.velocity.norm();
        let throw = |o: &Outcome| o.object.velocity.y.atan2(o.object.velocity.x).to_degrees();
        let horizontal = |a: &BallState, b: &BallState| (a.velocity - b.velocity).xy().norm();
        let vertical = |a: &BallState, b: &BallState| (a.velocity.z - b.velocity.z).abs();
        let (a, b) = (outcome, reference);
        let spin = (a.cue.spin - b.cue.spin).norm().max((a.object.spin - b.object.spin).norm());
        errors[0].push((throw(a) - throw(b)).abs());
        errors[1].push(horizontal(&a.cue, &b.cue).max(horizontal(&a.object, &b.object)) / speed);
        errors[2].push(radius * spin / speed);
        errors[3].push(vertical(&a.cue, &b.cue).max(vertical(&a.object, &b.object)) / speed);
    }
    let [throw_deg, speed, spin, jump] = errors;
    Errors {
        throw_deg: spread("deg", throw_deg),
        speed: spread("1", speed),
        spin: spread("1", spin),
        jump: spread("1", jump),
    }
}

fn spread(unit: &'static str, mut errors: Vec<f64>) -> Spread {
    errors.sort_by(f64::total_cmp);
    let last = errors.len().saturating_sub(1) as f64;
    let at = |part: f64| errors.get((part * last).round() as usize).copied().unwrap_or(f64::NAN);
    Spread { unit, median: at(0.5), p95: at(0.95), worst: at(1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_decrease_with_the_tolerance_and_from_fidelity_to_fidelity() {
        let rows = study(&shots(40, 1), Ball::POOL, Model::KAPPA).unwrap();
        let speed = |row: &Row| row.numerical.map(|errors| errors.speed.worst);
        for row in rows.iter().filter(|row| row.fidelity == Fidelity::Ode && row.numerical.is_some()) {
            // some dozen steps, each to the tolerance
            assert!(speed(row).unwrap() < 20.0 * row.tolerance.unwrap() + 1e-13, "{row:?}");
            assert_eq!(row.failed, 0);
        }
        let closed: Vec<f64> = rows.iter().filter(|r| r.tolerance.is_none()).filter_map(speed).collect();
        // elastic, inelastic, linear, full
        assert!(closed.windows(2).all(|pair| pair[1] < pair[0]), "{closed:?}");
        assert!(closed[3] < 3e-15, "{closed:?}");
        // friction of the cloth and weight are of a thousandth
        let full = rows.iter().find(|row| row.fidelity == Fidelity::Full).unwrap();
        assert!((1e-5..1e-2).contains(&full.model.speed.p95), "{:?}", full.model);
    }

    #[test]
    fn a_spread_of_no_errors_is_not_a_number() {
        assert!(spread("1", Vec::new()).worst.is_nan());
        let found = spread("1", vec![3.0, 1.0, 2.0]);
        assert_eq!((found.median, found.worst), (2.0, 3.0));
    }
}
