//! Tests of differences: of pairs, and of one value for all labels against one for each.

use nalgebra::{DMatrix, DVector};

use super::joint::{Joint, estimate, settle};
use super::result::{LikelihoodRatio, TestKind};
use crate::problem::{self, Estimates, Evaluation, Id, Problem};

impl Joint<'_> {
    /// Returns the test of one value of an unknown for all of some labels against one for each;
    /// `None` if the data determine fewer than two of the values.
    pub(super) fn test(&self, id: Id, labels: &[usize]) -> Option<LikelihoodRatio> {
        let shared = self.column(*labels.first()?, id)?;
        let (problem, at) = match self.column(*labels.get(1)?, id) {
            Some(other) if other != shared => (self.solution.problem.clone(), self.solution.at.clone()),
            _ => self.freed(id, shared, labels),
        };
        let mut columns = problem.columns_of(id);
        let estimates = estimate(&problem, &at, &columns)?;
        columns.retain(|column| known_error(&problem, &estimates, *column).is_some());
        let extra = columns.len().checked_sub(1).filter(|extra| *extra > 0)?;
        let judged = |statistic: f64, rise: f64, by: TestKind| LikelihoodRatio {
            statistic,
            by,
            extra_parameters: extra,
            p_value: self.tests.of_rise(rise, extra),
            delta_aic: 2.0 * extra as f64 - statistic,
        };
        let places: Vec<usize> = columns.iter().filter_map(|column| estimates.position(*column)).collect();
        if problem.is_robust() {
            let values: Vec<f64> = columns.iter().map(|column| at.state.shared.0[*column]).collect();
            let covariance = estimates.covariance.select_rows(&places).select_columns(&places);
            let statistic = wald(&values, &covariance)?;
            return Some(judged(statistic, statistic, TestKind::Wald));
        }
        let same = merged(&problem, &columns);
        // if contacts stick, χ² is not a parabola: from the value of each label
        let starts = columns.iter().map(|column| {
            let mut state = at.state.clone();
            state.shared.0[columns[0]] = at.state.shared.0[*column];
            state
        });
        let least = starts.map(|start| settle(&same, start).cost).min_by(f64::total_cmp)?;
        let rise = (least - at.cost).max(0.0);
        let (chi2, count) = self.solution.chi2_of_data();
        // Gaussian noise of unknown size: n ln of the ratio of the sums of squares
        let statistic = if self.tests.estimated { count * (rise / chi2).ln_1p() } else { rise };
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

/// Returns the standard error of a column if it is less than its bounds leave open.
pub(super) fn known_error(problem: &Problem, estimates: &Estimates, column: usize) -> Option<f64> {
    let [low, high] = problem.unknowns[column].bounds;
    estimates.sd(column).filter(|sd| *sd < high - low)
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
        problem::Normal { mean: (p * a.mean + q * b.mean) / (p + q), sd: (p + q).sqrt().recip() }
    });
    for column in columns {
        let [low, high] = problem.unknowns[*column].bounds;
        let bounds = &mut same.unknowns[first].bounds;
        *bounds = [bounds[0].max(low), bounds[1].min(high)];
    }
    same
}

/// Returns Wald's statistic dᵀV⁻¹d of the differences d of some values from the first value, with
/// V the covariance of d; `None` of fewer than two, or if an error is missing.
fn wald(x: &[f64], covariance: &DMatrix<f64>) -> Option<f64> {
    let count = x.len().checked_sub(1).filter(|count| *count > 0)?;
    let by = DMatrix::from_fn(count, x.len(), |i, j| f64::from(j == i + 1) - f64::from(j == 0));
    let d = &by * DVector::from_column_slice(x);
    let solved = (&by * covariance * by.transpose()).cholesky()?.solve(&d);
    Some(d.dot(&solved))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The identity holds for independent numbers.
    #[test]
    fn wald_is_the_scatter_about_the_weighted_mean() {
        let (x, sd) = ([0.0_f64, 1.0, 2.0 / 3.0], [1.0_f64, 1.0, 2.0]);
        let covariance = DMatrix::from_fn(3, 3, |i, j| if i == j { sd[i] * sd[i] } else { 0.0 });
        let weight: f64 = sd.iter().map(|s| s.powi(-2)).sum();
        let mean = x.iter().zip(sd).map(|(x, s)| x * s.powi(-2)).sum::<f64>() / weight;
        let scatter: f64 = x.iter().zip(sd).map(|(x, s)| ((x - mean) / s).powi(2)).sum();
        let found = wald(&x, &covariance).unwrap();
        assert!((found - scatter).abs() < 1e-12, "{found} {scatter}");
    }
}
