//! What a collision model says of the numbers of one shot, and what is measured of it less what a fit
//! predicts.

use nalgebra::{DMatrix, DVector, SVector};

use super::block::RowsBlock;
use super::shot::{OWN, RowShot, SPEEDS, Unpredictable};
use super::view::View;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::observable::Observable;
use crate::physics::ball::BallState;
use crate::physics::collision::{Coefficients, Model};
use crate::physics::friction_law::Law;
use crate::problem::film::dual::{DualVector, constant, gradient};
use crate::problem::film::impact::Side;
use crate::problem::film::own;
use crate::problem::solution::Solution;
use crate::problem::sums::OwnPrior;
use crate::problem::unknowns::{Id, Own, PHYSICS, SHARED, Shared};

/// Steps until an unknown speed before the impact gives the measured one afterwards, and the relative
/// difference at which they end.
const STEPS: usize = 20;
const SAME: f64 = 1e-14;

/// The numbers of a shot as a model has them.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The cue ball before the impact in the collision frame.
    pub cue: BallState,
    /// What is measured of the shot; a speed that determines an unknown one before is not among it.
    pub observables: Vec<Observable>,
    /// Predicted numbers, SI and radians.
    pub values: Vec<f64>,
}

/// Predicts the numbers of a shot from its measured inputs.
///
/// # Errors
/// A shot whose inputs are not all known, or that is no collision.
pub fn predict(shot: &Shot, model: &Model, coefficients: &Coefficients) -> Result<Prediction, Unpredictable> {
    let bare = Dataset::new("", model.ball, Vec::new());
    let made = RowShot::new(shot, &bare, model.law != Law::Constant || model.e_slope.is_some())?;
    let mut shared = Shared(vec![0.0; SHARED]);
    shared[Id::RadiusRatio] = model.ball.radius / model.object_ball().radius;
    let mut own = Own::zeros(OWN);
    let determined = (made.own_unknowns_without_prior() > 0)
        .then(|| SPEEDS.iter().find_map(|speed| made.rows.iter().position(|row| row.observable == *speed)));
    let mut steps = 0;
    loop {
        let (cue, view) = made.approach(&own, &shared);
        let cue = cue.state(model.ball.radius);
        let after = model.collide(&cue, coefficients)?.components();
        let all = made.rows.iter().map(|row| view.observe(row.observable, &sides(&after, &view, model)).re);
        let values: Vec<f64> = all.collect();
        if let Some(row) = determined.flatten()
            && steps < STEPS
        {
            // speeds afterwards are nearly in proportion to the one before
            let part = made.rows[row].value / values[row];
            if (part - 1.0).abs() > SAME {
                own[1] = (1.0 + own[1]) * part - 1.0;
                steps += 1;
                continue;
            }
        }
        let is_kept = |row: &usize| determined.flatten() != Some(*row);
        let kept: Vec<usize> = (0..values.len()).filter(is_kept).collect();
        return Ok(Prediction {
            cue,
            observables: kept.iter().map(|row| made.rows[*row].observable).collect(),
            values: kept.iter().map(|row| values[*row]).collect(),
        });
    }
}

/// Returns both balls after the impact.
fn sides(after: &SVector<f64, 12>, view: &View, model: &Model) -> [Side; 2] {
    let side = |first: usize, radius: f64| Side {
        velocity: DualVector::new(constant(after[first]), constant(after[first + 1])),
        rise: constant(after[first + 2]),
        spin: [3, 4, 5].map(|i| constant(after[first + i] * radius)),
        inertia: model.object_ball().inertia,
    };
    [side(0, view.radii[0].re), side(6, view.radii[1].re)]
}

/// Numbers of one shot less their prediction from its measured inputs.
pub(crate) struct Deviations {
    /// What is measured.
    pub observables: Vec<Observable>,
    /// Measured numbers, SI and radians.
    pub measured: Vec<f64>,
    /// Measured less predicted.
    pub values: DVector<f64>,
    /// Covariance of `values`, errors of the inputs included.
    pub covariance: DMatrix<f64>,
    /// Derivatives of the prediction by the unknowns, of a table those that move the balls, in the order of
    /// [`Id`].
    ///
    /// [`Id`]: crate::problem::Id
    pub by: DMatrix<f64>,
    /// Direction of the line of centres: cosine and sine.
    pub normal: [f64; 2],
    /// Cut angle, rad.
    pub cut: f64,
    /// Speed of the cue ball before the impact, m/s; `None` if it is not known.
    pub speed: Option<f64>,
    /// Topspin and side spin of the cue ball before the impact over those of natural roll; NaN if not known.
    pub spins: [f64; 2],
}

impl Solution {
    /// Returns the deviations of each shot of the only sample, a table or a film of balls.
    pub(crate) fn deviations(&self) -> Vec<Option<Deviations>> {
        let (state, problem) = (self.state(), &self.problem);
        let Some(rows) = problem.rows() else {
            return (0..state.own[0].len()).map(|i| self.deviations_of_film(i)).collect();
        };
        let shared = problem.samples[0].gather(&state.shared);
        state.own[0].iter().enumerate().map(|(i, own)| rows.deviations(i, own, &shared)).collect()
    }
}

impl RowsBlock {
    fn deviations(&self, i: usize, own: &Own, shared: &Shared) -> Option<Deviations> {
        let shot = &self.shots[i];
        // at the measured inputs; an unknown speed is as the fit has it
        let mut measured = own.clone();
        for (place, _) in shot.own_priors() {
            measured[place] = 0.0;
        }
        let found = shot.differences(&measured, shared, &self.contact).ok()?;
        let sds: Vec<f64> =
            shot.rows.iter().map(|row| row.noise.map_or(1.0, |noise| self.noises[noise].sd)).collect();
        let count = shot.rows.len();
        let mut errors = shot.own_errors()?;
        for (row, sd) in sds.iter().enumerate() {
            errors.row_mut(row).scale_mut(*sd);
        }
        let all: Vec<_> = found.values.iter().map(gradient).collect();
        // the speed that determined the unknown one before tells nothing else
        let spent = SPEEDS.iter().find_map(|speed| {
            let place = shot.rows.iter().position(|row| row.observable == *speed)?;
            (shot.own_unknowns_without_prior() > 0).then_some(place)
        });
        let mut inputs = DMatrix::zeros(count, OWN);
        for (place, prior) in shot.priors.iter().enumerate() {
            let sd = match (prior, spent) {
                (Some(OwnPrior::Held), _) => 0.0,
                // of the logarithm of the speed
                (None, Some(row)) => errors.row(row).norm() / shot.rows[row].value.abs(),
                _ => 1.0,
            };
            for (row, by) in all.iter().enumerate() {
                inputs[(row, place)] = sd * by[place];
            }
        }
        let covariance = &errors * errors.transpose() + &inputs * inputs.transpose();
        let kept: Vec<usize> = (0..count).filter(|row| Some(*row) != spent).collect();
        let (cut, speed) = (found.view.cut.re, found.view.speed.re);
        Some(Deviations {
            observables: kept.iter().map(|row| shot.rows[*row].observable).collect(),
            measured: kept.iter().map(|row| shot.rows[*row].value).collect(),
            values: DVector::from_iterator(kept.len(), kept.iter().map(|row| -found.values[*row].re)),
            covariance: covariance.select_rows(&kept).select_columns(&kept),
            by: DMatrix::from_fn(kept.len(), PHYSICS, |row, id| all[kept[row]][own::OWN + id]),
            normal: [found.view.cos.re, found.view.sin.re],
            cut,
            speed: shot.knows_speed.then_some(speed),
            spins: [(found.spin[1] * cut.cos() - found.spin[0] * cut.sin()) / speed, found.spin[2] / speed],
        })
    }
}
