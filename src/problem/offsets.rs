//! Outcome offsets: velocities after the impact less the model's, shot by shot, to first order from
//! what the frames of the shot show. They are the residuals of a fit in the terms of the impact,
//! and how they change with speed, cut or spin tests the model.

use nalgebra::{DMatrix, DVector, Matrix2, Vector2, dmatrix};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal};

use super::eliminated::Offsets;
use super::film::shots::VELOCITIES;
use super::rows::shot::Deviations;
use super::solution::Solution;
use super::uncertainty::OWN_PART;
use super::unknowns::Id;

/// How offsets change with a variable.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope {
    /// Slope, in standard deviations of an offset per unit of the variable.
    pub(crate) value: f64,
    /// Slope over its standard error.
    pub(crate) t: f64,
    /// Probability of a slope as far from 0 by chance.
    pub(crate) p_value: f64,
    /// Decrease of χ² with a mean of the offsets beside it; `None` if the free unknowns take that
    /// up.
    pub(crate) level: Option<f64>,
}

/// The score of a shift of the outcome of one shot by a standard deviation.
pub(crate) struct ShiftScore {
    pub(crate) square: f64,
    /// Its product with the residuals.
    pub(crate) along: f64,
    /// Its products with the unknowns of the sample, in the order of [`Solution::determined`].
    pub(crate) beside: DVector<f64>,
}

impl Solution {
    /// Returns the deviations of each shot of the only sample, a table or a film of balls.
    pub(crate) fn deviations(&self) -> Vec<Option<Deviations>> {
        let (state, problem) = (self.state(), &self.problem);
        let shared = problem.samples[0].gather(&state.shared);
        let of_shot = |i: usize| match problem.rows() {
            Some(rows) => rows.deviations(i, &shared),
            None => self.deviations_of_film(i),
        };
        (0..state.own[0].len()).into_par_iter().map(of_shot).collect()
    }

    /// Returns the velocities after the impact of shot `i` of a film, as its frames show them, less
    /// the model's, in the frame of the table.
    fn deviations_of_film(&self, i: usize) -> Option<Deviations> {
        let motion = self.motion(i)?;
        let contribution = self.problem.contribute(self.state(), (0, i));
        let Offsets { values, covariance, .. } = contribution.offsets()?;
        let (sin, cos) = motion.direction.sin_cos();
        let turn = dmatrix![cos, -sin, 0.0, 0.0; sin, cos, 0.0, 0.0; 0.0, 0.0, cos, -sin; 0.0, 0.0, sin, cos];
        let ids = [self.determined(), Id::OFFSETS.to_vec()].concat();
        let shared = ids.len() - Id::OFFSETS.len();
        let (information, _) = contribution.reduced(&ids)?;
        let beside = &turn * &covariance * information.view((shared, 0), (Id::OFFSETS.len(), shared));
        let mut by = DMatrix::zeros(Id::OFFSETS.len(), Id::ALL.len());
        for (place, id) in ids[..shared].iter().enumerate() {
            by.set_column(*id as usize, &beside.column(place));
        }
        let values = &turn * values;
        let after = &turn * DVector::from_row_slice(&motion.after);
        Some(Deviations {
            observables: VELOCITIES.to_vec(),
            measured: (after + &values).as_slice().to_vec(),
            values,
            covariance: &turn * covariance * turn.transpose(),
            by,
            normal: [cos, sin],
            cut: motion.cut,
            speed: Some(motion.speed),
            spins: [motion.topspin, f64::NAN],
        })
    }

    /// Returns how shifts change with a variable, from the score of the shift of each shot.
    pub(crate) fn slope_of(&self, variable: &[f64], scores: &[Option<ShiftScore>]) -> Option<Slope> {
        let is_used = |i: &usize| variable[*i].is_finite() && scores[*i].is_some();
        let used: Vec<usize> = (0..variable.len()).filter(is_used).collect();
        let mean = used.iter().map(|i| variable[*i]).sum::<f64>() / used.len().max(1) as f64;
        let spread = used.iter().map(|i| (variable[*i] - mean).abs()).fold(0.0, f64::max);
        if spread <= OWN_PART * mean.abs().max(1e-3) {
            return None;
        }
        // level and slope beside the free unknowns
        let mut beside = DMatrix::<f64>::zeros(self.covariance.columns.len(), 2);
        let (mut matrix, mut gradient) = (Matrix2::<f64>::zeros(), Vector2::<f64>::zeros());
        for i in used {
            let Some(score) = &scores[i] else { continue };
            let factors = Vector2::new(1.0, variable[i] - mean);
            gradient += factors * score.along;
            matrix += factors * factors.transpose() * score.square;
            beside += &score.beside * factors.transpose();
        }
        let left = matrix - beside.tr_mul(&(&self.covariance.covariance * &beside));
        let (level, rise) = (left[(0, 0)], left[(1, 1)]);
        if !(rise > OWN_PART * matrix[(1, 1)]) {
            return None;
        }
        // without a level that the unknowns take up, the slope stands alone
        let is_own = level > OWN_PART * matrix[(0, 0)];
        let factor = if is_own { left[(0, 1)] / level } else { 0.0 };
        let (information, along) = (rise - factor * left[(0, 1)], gradient[1] - factor * gradient[0]);
        let level = is_own.then(|| gradient[0] * gradient[0] / level);
        if !(information > OWN_PART * matrix[(1, 1)]) {
            return None;
        }
        let t = -along / information.sqrt();
        let p_value = 2.0 * Normal::standard().sf(t.abs());
        Some(Slope { value: -along / information, t, p_value, level })
    }
}
