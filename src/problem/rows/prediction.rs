//! What a collision model says of the numbers of one shot.

use nalgebra::SVector;

use super::shot::{OWN, RowShot, SPEEDS, Unpredictable};
use super::view::View;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::observable::Observable;
use crate::physics::ball::BallState;
use crate::physics::collision::{Coefficients, Model};
use crate::physics::friction_law::Law;
use crate::problem::film::dual::{DualVector, constant};
use crate::problem::film::impact::Side;
use crate::problem::unknowns::{Id, Own, SHARED, Shared};

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
