//! What the numbers of a table spend on unknowns.

use nalgebra::DVector;

use super::block::RowsBlock;
use super::shot::OWN;
use crate::problem::film::own;
use crate::problem::problem::{Reduced, Sample, State};
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::PHYSICS;

impl RowsBlock {
    /// Returns the part of each noise that its numbers spend on unknowns: the sum of their leverages.
    pub fn leverages(
        &self,
        sample: &Sample,
        state: &State,
        (reduced, estimates): (&Reduced, &Estimates),
        number: usize,
    ) -> Vec<f64> {
        let mut sums = vec![0.0; self.noises.len()];
        if sums.is_empty() {
            return sums;
        }
        let shared = sample.gather(&state.shared);
        let place = |id: usize| estimates.position(sample.columns[id]);
        let places: Vec<Option<usize>> = (0..PHYSICS).map(place).collect();
        for (i, own) in state.own[number].iter().enumerate() {
            let Some(predicted) = self.predict(i, own, &shared) else { continue };
            let distance = self.distance(i, own, &predicted);
            let weight = self.losses[predicted.residuals.len()].weight(distance);
            let response = reduced.response(number, i, &estimates.columns);
            let of_own = &reduced.own[number][i].covariance;
            for residual in &predicted.residuals {
                let Some(noise) = residual.noise else { continue };
                let by_own = DVector::from_fn(OWN, |place, _| residual.by[place]);
                let mut by = response.tr_mul(&by_own);
                for (id, place) in places.iter().enumerate() {
                    if let Some(place) = place {
                        by[*place] += residual.by[own::OWN + id];
                    }
                }
                let variance = by.dot(&(&estimates.covariance * &by));
                sums[noise] += weight * variance + weight * by_own.dot(&(of_own * &by_own));
            }
        }
        sums
    }
}
