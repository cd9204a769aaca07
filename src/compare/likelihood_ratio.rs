//! One value of a quantity for all labels against one for each.

use nalgebra::DVector;

use super::joint::{Joint, estimate, settle};
use super::result::{LikelihoodRatio, TestKind};
use super::verdict::wald;
use crate::problem::{Estimates, Evaluation, Id, Normal, Problem, State};

impl Joint<'_> {
    /// Returns the test of one value of an unknown for all of some labels against one for each; `None` if
    /// the data determine fewer than two of the values.
    pub(super) fn test(&self, id: Id, labels: &[usize]) -> Option<LikelihoodRatio> {
        let shared = self.column(*labels.first()?, id)?;
        let (problem, at) = match self.column(*labels.get(1)?, id) {
            Some(other) if other != shared => (self.solution.problem.clone(), self.solution.at.clone()),
            _ => self.freed(id, shared, labels),
        };
        let columns = problem.columns_of(id);
        let estimates = estimate(&problem, &at, &columns)?;
        let is_known = |column: &usize| {
            let [low, high] = problem.unknowns[*column].bounds;
            estimates.sd(*column).is_some_and(|sd| sd < high - low)
        };
        let columns: Vec<usize> = columns.into_iter().filter(is_known).collect();
        let extra = columns.len().checked_sub(1).filter(|extra| *extra > 0)?;
        let tests = self.tests;
        let judged = |statistic: f64, rise: f64, by: TestKind| LikelihoodRatio {
            statistic,
            by,
            extra_parameters: extra,
            p_value: tests.of_rise(rise, extra),
            delta_aic: 2.0 * extra as f64 - statistic,
        };
        if problem.is_robust() {
            let places: Option<Vec<usize>> =
                columns.iter().map(|column| estimates.position(*column)).collect();
            let values: Vec<f64> =
                estimates.columns.iter().map(|column| at.state.shared.0[*column]).collect();
            let statistic = wald(&values, &estimates.covariance, &places?, extra)?;
            return Some(judged(statistic, statistic, TestKind::Wald));
        }
        let same = merged(&problem, &columns);
        // where contacts stick χ² is no parabola: from the value of each label, too
        let of_labels = columns.iter().map(|column| {
            let mut state = at.state.clone();
            state.shared.0[columns[0]] = at.state.shared.0[*column];
            state
        });
        let starts = equalised(&problem, &at, &estimates, &columns).into_iter().chain(of_labels);
        let least = starts.map(|start| settle(&same, start).cost).min_by(f64::total_cmp)?;
        let rise = (least - at.cost).max(0.0);
        let (chi2, count) = self.solution.chi2_of_data();
        // Gaussian noise of unknown size: n ln of the ratio of the sums of squares
        let statistic = if tests.estimated { count * (rise / chi2).ln_1p() } else { rise };
        rise.is_finite().then(|| judged(statistic, rise, TestKind::LikelihoodRatio))
    }

    /// Returns the least χ² with a column of its own for each label, at the present noise.
    fn freed(&self, id: Id, shared: usize, labels: &[usize]) -> (Problem, Evaluation) {
        let mut problem = self.solution.problem.clone();
        let mut state = self.solution.at.state.clone();
        for label in &labels[1..] {
            let own = problem.unknowns.len();
            problem.unknowns.push(problem.unknowns[shared]);
            state.shared.0.push(state.shared.0[shared]);
            for (sample, alone) in problem.samples.iter_mut().zip(&self.samples.fitted) {
                let column = &mut sample.columns[id as usize];
                if alone.label == *label && *column == shared {
                    *column = own;
                }
            }
        }
        let end = settle(&problem, state);
        (problem, end)
    }
}

/// Returns the problem with one column instead of several, whose priors all count.
fn merged(problem: &Problem, columns: &[usize]) -> Problem {
    let mut same = problem.clone();
    let first = columns[0];
    for column in same.samples.iter_mut().flat_map(|sample| &mut sample.columns) {
        if columns.contains(column) {
            *column = first;
        }
    }
    let priors = columns.iter().filter_map(|column| problem.unknowns[*column].prior);
    same.unknowns[first].prior = priors.reduce(|a, b| {
        let [p, q] = [a, b].map(|prior| prior.sd.powi(-2));
        Normal { mean: (p * a.mean + q * b.mean) / (p + q), sd: (p + q).sqrt().recip() }
    });
    for column in columns {
        let [low, high] = problem.unknowns[*column].bounds;
        let bounds = &mut same.unknowns[first].bounds;
        *bounds = [bounds[0].max(low), bounds[1].min(high)];
    }
    same
}

/// Returns the least of a quadratic χ² at which some columns are equal: with C the covariance and V that
/// of the columns x, all unknowns change by C₍·ₓ₎V⁻¹(m − x), m = 1ᵀV⁻¹x/1ᵀV⁻¹1.
fn equalised(problem: &Problem, at: &Evaluation, estimates: &Estimates, columns: &[usize]) -> Option<State> {
    let places: Vec<usize> = columns.iter().filter_map(|column| estimates.position(*column)).collect();
    let beside = estimates.covariance.select_columns(&places);
    let of_columns = beside.select_rows(&places).cholesky()?;
    let x = DVector::from_fn(columns.len(), |i, _| at.state.shared.0[columns[i]]);
    let ones = DVector::from_element(columns.len(), 1.0);
    let weights = of_columns.solve(&ones);
    let mean = weights.dot(&x) / weights.sum();
    let step = beside * of_columns.solve(&(ones * mean - x));
    let mut state = at.eliminate(problem, 0.0)?.step(problem, &at.state, &estimates.columns, &step);
    for (value, unknown) in state.shared.0.iter_mut().zip(&problem.unknowns) {
        *value = value.max(unknown.bounds[0]).min(unknown.bounds[1]);
    }
    Some(state)
}
