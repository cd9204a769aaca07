//! The leverages of the numbers of a table.

use super::block::RowsBlock;
use super::shot::OWN;
use crate::problem::problem::{Reduced, Sample, State};
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::PHYSICS;

impl RowsBlock {
    /// Returns the part of each noise that its numbers spend on unknowns: the sum of their leverages.
    pub(crate) fn leverages(
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
        let place = |id: usize| Some((id, estimates.position(sample.columns[id])?));
        let places: Vec<(usize, usize)> = (0..PHYSICS).filter_map(place).collect();
        for (i, own) in state.own[number].iter().enumerate() {
            let Some(predicted) = self.predict(i, own, &shared) else { continue };
            let weight = self.losses[predicted.rows.len()].weight(self.distance(i, own, &predicted));
            let response = reduced.response(number, i, &estimates.columns);
            let of_own = &reduced.own[number][i].covariance;
            for (residual, row) in predicted.rows.iter().zip(&self.shots[i].rows) {
                let Some(noise) = row.noise else { continue };
                let by_own = residual.by.rows(0, OWN);
                let mut by = response.tr_mul(&by_own);
                for (id, place) in &places {
                    by[*place] += residual.by[OWN + id];
                }
                let variance = by.dot(&(&estimates.covariance * &by)) + by_own.dot(&(of_own * by_own));
                sums[noise] += weight * variance;
            }
        }
        sums
    }
}
