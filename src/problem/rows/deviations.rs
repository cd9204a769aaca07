//! Measured numbers of shots less their prediction from measured inputs.

use nalgebra::{DMatrix, DVector};

use super::block::RowsBlock;
use super::prediction::{Approach, Residuals};
use crate::measurement::observable::Observable;
use crate::problem::film::dual::gradient;
use crate::problem::film::own::OWN;
use crate::problem::solution::Solution;
use crate::problem::sums::OwnPrior;
use crate::problem::unknowns::{Own, PHYSICS, Shared};

/// Numbers of one shot less their prediction from its measured inputs.
pub(crate) struct Deviations {
    pub(crate) observables: Vec<Observable>,
    /// Measured numbers, SI and radians.
    pub(crate) measured: Vec<f64>,
    /// Measured less predicted.
    pub(crate) values: DVector<f64>,
    /// Covariance of `values`, errors of the inputs included.
    pub(crate) covariance: DMatrix<f64>,
    /// Derivatives of the prediction by the unknowns, of a table those that move the balls, in the
    /// order of
    /// [`Id`].
    pub(crate) by: DMatrix<f64>,
    /// Direction of the line of centres: cosine and sine.
    pub(crate) normal: [f64; 2],
    /// Cut angle, rad.
    pub(crate) cut: f64,
    /// Speed of the cue ball before the impact, m/s; `None` if it is not known.
    pub(crate) speed: Option<f64>,
    /// Topspin and side spin of the cue ball before the impact over those of natural roll; NaN if
    /// not known.
    pub(crate) spins: [f64; 2],
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
        let Residuals { rows, approach, .. } = shot.differences(&measured, shared, &self.contact).ok()?;
        // the speed that determined the unknown one before is spent
        let spent = shot.spent_row();
        let sd = |place: usize| match (shot.priors[place], spent) {
            (Some(OwnPrior::Held), _) => 0.0,
            // of the logarithm of the speed
            (None, Some(row)) => self.sd(&shot.rows[row]) / shot.rows[row].value.abs(),
            _ => 1.0,
        };
        let by: Vec<_> = rows.iter().map(gradient).collect();
        let inputs = DMatrix::from_fn(rows.len(), OWN, |row, place| sd(place) * by[row][place]);
        let mut covariance = &inputs * inputs.transpose();
        for (i, row) in shot.rows.iter().enumerate() {
            covariance[(i, i)] += self.sd(row).powi(2);
        }
        let kept: Vec<usize> = (0..rows.len()).filter(|row| Some(*row) != spent).collect();
        let Approach { cut, speed, cue, cos, sin } = approach;
        let (cut, speed, spin) = (cut.re, speed.re, cue.spin);
        let topspin = spin[1].re * cut.cos() - spin[0].re * cut.sin();
        Some(Deviations {
            observables: kept.iter().map(|row| shot.rows[*row].observable).collect(),
            measured: kept.iter().map(|row| shot.rows[*row].value).collect(),
            values: DVector::from_iterator(kept.len(), kept.iter().map(|row| -rows[*row].re)),
            covariance: covariance.select_rows(&kept).select_columns(&kept),
            by: DMatrix::from_fn(kept.len(), PHYSICS, |row, id| by[kept[row]][OWN + id]),
            normal: [cos.re, sin.re],
            cut,
            speed: shot.knows_speed.then_some(speed),
            spins: [topspin / speed, spin[2].re / speed],
        })
    }
}
