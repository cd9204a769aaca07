//! One pair of balls for data sets that were played with the same ones.

use super::error::CompareError;
use crate::measurement::dataset::Dataset;

/// Returns the data sets, those of the same `balls` label with the object ball that one of them states.
///
/// # Errors
/// Data sets of the same label that state different balls.
pub(super) fn share_balls(datasets: &[Dataset]) -> Result<Vec<Dataset>, CompareError> {
    let share = |dataset: &Dataset| {
        let mut same = datasets.iter().filter(|other| other.balls.is_some() && other.balls == dataset.balls);
        let first = same.clone().find(|other| other.object.is_some()).or(same.next()).unwrap_or(dataset);
        let differs = dataset.object.is_some() && dataset.object != first.object;
        if differs || dataset.ball.radius != first.ball.radius || dataset.ball.inertia != first.ball.inertia {
            return Err(CompareError::OtherBalls {
                label: dataset.balls.clone().unwrap_or_default(),
                first: first.name.clone(),
                other: dataset.name.clone(),
            });
        }
        Ok(Dataset { ball: first.ball, object: first.object, ..dataset.clone() })
    };
    datasets.iter().map(share).collect()
}
