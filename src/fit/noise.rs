//! The noise of observables whose standard deviations the data do not state, from their residuals.

use nalgebra::DMatrix;

use super::robust::Losses;
use super::samples::Search;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::frames::ROWS;
use crate::likelihood::prediction::difference;
use crate::likelihood::whitening::{EstimatedSd, Whitening};
use crate::measurement::dataset::Measurement;
use crate::measurement::observable::Observable;
use crate::measurement::values::Values;

/// An observable's variance needs at least this many degrees of freedom of its own.
const MIN_OWN_DOF: f64 = 0.5;

/// A residual standard deviation below this part of its first value is an exact fit.
pub(super) const EXACT: f64 = 1e-9;

/// Residuals below this, in rad, m/s, rad/s or as a ratio, are no noise of a measurement: the search began where it meets all exactly.
const MEASURED: f64 = 1e-6;

/// The noise of an observable of a data set without stated standard deviations.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// Number of its data set.
    pub dataset: usize,
    pub observable: Observable,
    pub sd: f64,
    /// The first guess, against which a residual is seen to vanish.
    first: f64,
    /// Whether the residuals tell it.
    pub estimable: bool,
}

impl Group {
    pub(super) fn is_of(&self, dataset: usize, observable: Observable) -> bool {
        (self.dataset, self.observable) == (dataset, observable)
    }
}

/// What was estimated of a data set.
pub(crate) fn of_dataset(groups: &[Group], dataset: usize) -> EstimatedSd {
    let own = groups.iter().filter(|group| group.dataset == dataset);
    own.map(|group| (group.observable, group.sd)).collect()
}

/// An observation at some values.
pub(super) struct Residual<'a> {
    pub dataset: usize,
    /// Its place among the residuals of a problem.
    pub row: usize,
    pub of: &'a Measurement,
    /// Predicted less measured.
    pub difference: f64,
    pub variance_from_inputs: f64,
}

impl Search<'_> {
    /// Residuals of each observable without stated errors: root mean square at `at`.
    pub(super) fn first_noise(&self, at: &[Values]) -> Vec<Group> {
        let mut groups: Vec<(usize, Observable, f64, usize)> = Vec::new();
        self.each_residual(
            at,
            &[],
            |Residual { dataset, of: Measurement { observable, measured }, difference, .. }| {
                if measured.sd.is_some() {
                    return;
                }
                let known = groups.iter().position(|g| (g.0, g.1) == (dataset, *observable));
                let index = known.unwrap_or_else(|| {
                    groups.push((dataset, *observable, 0.0, 0));
                    groups.len() - 1
                });
                groups[index].2 += difference * difference;
                groups[index].3 += 1;
            },
        );
        let sd = |sum: f64, count: usize| match (sum / count as f64).sqrt() {
            nothing if nothing < MEASURED => 1.0,
            sd => sd,
        };
        let group = |(dataset, observable, sum, count)| {
            let sd = sd(sum, count);
            Group { dataset, observable, sd, first: sd, estimable: true }
        };
        groups.into_iter().map(group).collect()
    }

    /// Calls `f` for every observation that is not of a frame; without weights at the inputs as they were measured.
    pub(super) fn each_residual(&self, at: &[Values], whitening: &[Whitening], mut f: impl FnMut(Residual)) {
        let plain = Whitening::default();
        let mut first = 0;
        for (i, (sample, at)) in self.samples.iter().zip(at).enumerate() {
            let (mut next, whitening) = (first, whitening.get(i).unwrap_or(&plain));
            first += sample.rows();
            if sample.is_filmed() {
                continue;
            }
            let model = at.model(sample.model);
            for (number, Fitted { plan, .. }) in sample.fitted.iter().enumerate() {
                let rows = plan.rows();
                if let Ok(prediction) = whitening.predict(number, plan, &model, &at.coefficients) {
                    for (i, of) in rows.iter().enumerate() {
                        let g = prediction.by_inputs.row(i).transpose();
                        f(Residual {
                            dataset: sample.dataset,
                            row: next + i,
                            of,
                            difference: difference(of.observable, prediction.values[i], of.measured.value),
                            variance_from_inputs: g.component_mul(&g).dot(plan.variance_in()),
                        });
                    }
                }
                next += rows.len();
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
        at: &[Values],
        whitening: &[Whitening],
        jacobian: &DMatrix<f64>,
        losses: &[Losses],
        weights: &[f64],
    ) -> f64 {
        if groups.is_empty() {
            return 0.0;
        }
        let leverage = super::minimum::leverages(jacobian);
        let mut sums = vec![[0.0; 4]; groups.len()];
        let mut weights = weights.iter();
        let mut scale: Vec<f64> = Vec::new();
        for (sample, losses) in self.samples.iter().zip(losses) {
            for (shot, weight) in sample.fitted.iter().zip(weights.by_ref()) {
                let own = weight.powi(2) / losses.of(shot).consistency;
                let rows = if sample.is_filmed() { ROWS } else { shot.plan.rows().len() };
                scale.extend(std::iter::repeat_n(own, rows));
            }
        }
        self.each_residual(
            at,
            whitening,
            |Residual { dataset, row, of, difference, variance_from_inputs }| {
                let known = groups.iter().position(|g| g.is_of(dataset, of.observable));
                if let Some(group) = known.filter(|_| of.measured.sd.is_none()) {
                    let terms =
                        [scale[row] * difference * difference, 1.0, leverage[row], variance_from_inputs];
                    for (sum, term) in sums[group].iter_mut().zip(terms) {
                        *sum += term;
                    }
                }
            },
        );
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
