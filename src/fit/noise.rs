//! The noise of observables whose standard deviations the data do not state, from their residuals.

use nalgebra::DMatrix;

use super::robust::Losses;
use super::search::Search;
use super::uncertainty;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::difference;
use crate::likelihood::whitening::Whitening;
use crate::measurement::dataset::Measurement;
use crate::measurement::observable::Observable;
use crate::measurement::values::Values;

/// An observable's variance needs at least this many degrees of freedom of its own.
const MIN_OWN_DOF: f64 = 0.5;

/// A residual standard deviation below this part of its first value is an exact fit.
pub(super) const EXACT: f64 = 1e-9;

/// Residuals below this, in rad, m/s, rad/s or as a ratio, are no noise of a measurement: the search began where it meets all exactly.
const MEASURED: f64 = 1e-6;

/// The noise of an observable without stated standard deviations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub observable: Observable,
    pub sd: f64,
    /// The first guess, against which a residual is seen to vanish.
    first: f64,
    /// Whether the residuals tell it.
    pub estimable: bool,
}

impl Search<'_> {
    /// Residuals of each observable without stated errors: root mean square at `at`.
    pub(super) fn first_noise(&self, at: &Values) -> Vec<Group> {
        let mut groups: Vec<(Observable, f64, usize)> = Vec::new();
        self.each_residual(at, &Whitening::none(), |row, d, _| {
            if row.measured.sd.is_some() {
                return;
            }
            let known = groups.iter().position(|g| g.0 == row.observable);
            let index = known.unwrap_or_else(|| {
                groups.push((row.observable, 0.0, 0));
                groups.len() - 1
            });
            groups[index].1 += d * d;
            groups[index].2 += 1;
        });
        let sd = |sum: f64, count: usize| match (sum / count as f64).sqrt() {
            nothing if nothing < MEASURED => 1.0,
            sd => sd,
        };
        let group = |(observable, sum, count)| {
            let sd = sd(sum, count);
            Group { observable, sd, first: sd, estimable: true }
        };
        groups.into_iter().map(group).collect()
    }

    /// Calls `f(row, difference, variance from the inputs)` for every observation.
    pub(super) fn each_residual(
        &self,
        at: &Values,
        whitening: &Whitening,
        mut f: impl FnMut(&Measurement, f64, f64),
    ) {
        let model = at.model(self.model);
        for (number, shot) in self.fitted.iter().enumerate() {
            if let Ok(prediction) = whitening.predict(number, &shot.plan, &model, &at.coefficients) {
                for (i, row) in shot.plan.rows().iter().enumerate() {
                    let d = difference(row.observable, prediction.values[i], row.measured.value);
                    let g = prediction.by_inputs.row(i).transpose();
                    f(row, d, g.component_mul(&g).dot(shot.plan.variance_in()));
                }
            }
        }
    }

    /// σ² = Σd²/(n − Σh) with the leverages h of the observable's rows (restricted maximum
    /// likelihood), less what the errors of the state before the impact explain. Returns the
    /// largest relative change. With a robust loss Σw²d² instead, less what the weights take (Huber 1964,
    /// proposal 2).
    pub(super) fn reweigh(
        &self,
        groups: &mut [Group],
        at: &Values,
        whitening: &Whitening,
        jacobian: &DMatrix<f64>,
        losses: &Losses,
        weights: &[f64],
    ) -> f64 {
        if groups.is_empty() {
            return 0.0;
        }
        let leverage = uncertainty::leverages(jacobian);
        let mut sums = vec![[0.0; 4]; groups.len()];
        let mut row_number = 0;
        let of_rows = |(shot, weight): (&Fitted, &f64)| {
            let scale = weight.powi(2) / losses.of(shot).consistency;
            std::iter::repeat_n(scale, shot.plan.rows().len())
        };
        let scale: Vec<f64> = self.fitted.iter().zip(weights).flat_map(of_rows).collect();
        self.each_residual(at, whitening, |row, d, from_inputs| {
            if let Some(group) =
                groups.iter().position(|g| g.observable == row.observable && row.measured.sd.is_none())
            {
                let terms = [scale[row_number] * d * d, 1.0, leverage[row_number], from_inputs];
                for (sum, term) in sums[group].iter_mut().zip(terms) {
                    *sum += term;
                }
            }
            row_number += 1;
        });
        let mut changed = 0.0_f64;
        for (group, [square, count, leverage, from_inputs]) in groups.iter_mut().zip(sums) {
            let own_dof = count - leverage;
            group.estimable = own_dof >= MIN_OWN_DOF;
            if !group.estimable {
                continue;
            }
            let own_dof = if self.maximum_likelihood { count } else { own_dof };
            let variance = square / own_dof - from_inputs / count;
            let sd = variance.max((EXACT * group.first).powi(2)).sqrt();
            changed = changed.max((sd / group.sd - 1.0).abs());
            group.sd = sd;
        }
        changed
    }
}
