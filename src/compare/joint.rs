//! The fit of all samples together.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

use super::CompareError;
use super::findings::Finding;
use super::quantity::Quantity;
use super::result::Difference;
use super::samples::{Alone, Samples};
use crate::measurement::loss::Loss;
use crate::problem::{
    self, Descent, Estimates, Evaluation, Id, Mode, Policy, Problem, Solution, State, comply, descend,
    descend_with_noise, robust_covariance,
};

/// Ratio of lengths in two films, less 1, beyond which they are not by one camera that was not
/// moved.
const OTHER_CAMERA: f64 = 0.1;

/// Steps of a descent at given noise, typical are 3, and the decrease of χ² that ends it.
const STEPS: usize = 40;
const SAMPLES_STALL: f64 = 1e-12;

/// All samples in one problem at its minimum.
pub(super) struct Joint<'a> {
    pub(crate) samples: Samples<'a>,
    pub(crate) solution: Solution,
    pub(crate) tests: Tests,
}

impl<'a> Joint<'a> {
    /// Fits all samples together.
    ///
    /// # Errors
    /// Films that are not by one camera though they are said to be.
    pub fn new(mut samples: Samples<'a>) -> Result<Self, CompareError> {
        check_cameras(&samples)?;
        let (mut problem, start) = samples.join();
        let start = best_start(&problem, start, &samples.fitted);
        let mut descent = descend_with_noise(&mut problem, start);
        let adopted = samples.fitted.iter().flat_map(|alone| &alone.solution.findings);
        let adopted = adopted.filter_map(|finding| match finding {
            problem::Finding::Compliance { fall, adopted: true, .. } => Some(*fall),
            _ => None,
        });
        let mut compliance = adopted.reduce(f64::max);
        if samples.options.fidelity.is_none()
            && let Some(problem::Finding::Compliance { fall, adopted: true, .. }) =
                comply(&mut problem, &mut descent, &Policy::default())
        {
            compliance = Some(fall);
        }
        samples.findings.extend(compliance.map(|fall| Finding::Compliance { fall }));
        if problem.is_weighed() {
            problem.weigh(&descent.end.state);
            descent = descend_with_noise(&mut problem, descent.end.state);
        }
        problem.weigh_again(&mut descent.end);
        // χ² of likelihood ratios is that of the noise as it was estimated last
        let end = settle(&problem, descent.end.state);
        if !descent.converged {
            samples.findings.push(Finding::NotConverged);
        }
        let covariance = estimate(&problem, &end, &[]).unwrap_or_else(|| {
            samples.findings.push(Finding::Undetermined);
            Estimates { columns: Vec::new(), covariance: DMatrix::zeros(0, 0) }
        });
        let of_fit = |alone: &Alone| alone.solution.names.iter().flatten().cloned().collect();
        let names = samples.fitted.iter().map(of_fit).collect();
        let solution = Solution::new(problem, Descent { end, ..descent }, covariance, names);
        Ok(Self { samples, tests: Tests::new(&solution), solution })
    }

    /// Returns the column of an unknown that a label's samples estimate.
    pub fn column(&self, label: usize, id: Id) -> Option<usize> {
        let own = |sample: usize| {
            let column = self.solution.column(sample, id)?;
            let is_free = self.solution.problem.unknowns[column].mode == Mode::Free;
            (self.samples.fitted[sample].label == label && is_free).then_some(column)
        };
        (0..self.samples.fitted.len()).find_map(own)
    }

    /// Returns that most of the variance of a difference is due to mass ratios that the labels do
    /// not share: dᵀC⁻¹d, with d the covariances of the difference and the ratios, and C the
    /// covariance of the ratios.
    pub(super) fn limit(&self, quantity: Quantity) -> Option<Finding> {
        let Estimates { columns, covariance } = &self.solution.covariance;
        let places = |id: Id| -> Vec<usize> {
            let of = |i: &usize| self.solution.problem.unknowns[columns[*i]].id == id;
            (0..columns.len()).filter(of).collect()
        };
        let (ratios, values) = (places(Id::MassRatio), places(quantity.id()));
        let [first, second, ..] = values[..] else { return None };
        if ratios.len() < 2 {
            return None;
        }
        let inverse = covariance.select_rows(&ratios).select_columns(&ratios).try_inverse()?;
        let difference = covariance.column(second) - covariance.column(first);
        let variance = difference[second] - difference[first];
        let by_ratios = DVector::from_iterator(ratios.len(), ratios.iter().map(|ratio| difference[*ratio]));
        let part = by_ratios.dot(&(&inverse * &by_ratios));
        let (std_error, root) = (variance.sqrt(), part.sqrt());
        (2.0 * part > variance).then_some(Finding::MassRatios { quantity, std_error, part: root })
    }

    /// Returns the names of the losses other than least squares.
    pub(super) fn losses(&self) -> Vec<&'static str> {
        let loss = |alone: &Alone| self.samples.options.loss.unwrap_or(alone.dataset.loss);
        let losses = self.samples.fitted.iter().map(loss).filter(|loss| *loss != Loss::Squares);
        let mut names: Vec<&'static str> = losses.map(Loss::name).collect();
        names.sort_unstable();
        names.dedup();
        names
    }
}

/// Returns the best of the ends of descents from one value of κ for all: their mean and that of
/// each sample, as χ² has several minima in a free κ.
fn best_start(problem: &Problem, start: State, fitted: &[Alone]) -> State {
    let columns = problem.columns_of(Id::Kappa);
    if columns.iter().all(|column| problem.unknowns[*column].mode != Mode::Free) {
        return start;
    }
    let with_kappa = |kappa: f64| {
        let mut state = start.clone();
        for column in &columns {
            let [low, high] = problem.unknowns[*column].bounds;
            state.shared.0[*column] = kappa.clamp(low, high);
        }
        state
    };
    let of_samples = fitted.iter().map(|alone| with_kappa(alone.solution.value(Id::Kappa)));
    let starts = std::iter::once(start.clone()).chain(of_samples);
    let ends = starts.map(|start| settle(problem, start)).filter(|end| end.cost.is_finite());
    ends.min_by(|a, b| a.cost.total_cmp(&b.cost)).map_or(start, |end| end.state)
}

/// Returns the minimum at the present noise to rounding: tables are as smooth as their arithmetic.
pub(super) fn settle(problem: &Problem, state: State) -> Evaluation {
    descend(problem, problem.evaluate(state), &problem.free(), (STEPS, SAMPLES_STALL)).end
}

/// Returns the covariance with all of some columns, even at a bound.
pub(super) fn estimate(problem: &Problem, at: &Evaluation, columns: &[usize]) -> Option<Estimates> {
    let is_inside = |column: &usize| {
        !problem.unknowns[*column].bounds.contains(&at.state.shared.0[*column]) || columns.contains(column)
    };
    let free = problem.free().into_iter().filter(is_inside).collect();
    let estimates = Estimates::of_columns(&at.eliminate(problem, 0.0)?, free)?;
    let covariance = robust_covariance(problem, at, &estimates).or_else(|| {
        // without enough shots by a robust loss there are no errors
        (!problem.is_robust()).then(|| estimates.covariance.clone())
    });
    Some(Estimates { covariance: covariance?, ..estimates })
}

/// Checks that lengths in all films by one camera are the same.
fn check_cameras(samples: &Samples) -> Result<(), CompareError> {
    let length = |alone: &Alone| alone.solution.value(Id::Scale) / alone.solution.unit;
    for other in &samples.fitted {
        let first = samples.first_film(other);
        let factor = length(other) / length(first);
        if (factor - 1.0).abs() > OTHER_CAMERA {
            return Err(CompareError::Refused(format!(
                "{} and {}: lengths in their films differ by a factor of {factor:.2}, but camera has the same label in both; \
                 expected it of one camera that was not moved",
                first.dataset.name, other.dataset.name
            )));
        }
    }
    Ok(())
}

/// How sums of squares are judged.
#[derive(Clone, Copy)]
pub(super) struct Tests {
    pub(crate) dof: usize,
    /// Whether the noise was estimated from the residuals, or the errors from the scatter of the
    /// shots.
    pub(crate) estimated: bool,
}

impl Tests {
    /// Returns how sums of squares of a fit are judged. With a robust loss the scatter of the shots
    /// gives the errors.
    pub fn new(solution: &Solution) -> Self {
        let is_robust = solution.problem.is_robust();
        let count = if is_robust {
            solution.names.iter().map(Vec::len).sum::<usize>() as f64
        } else {
            solution.chi2_of_data().1 - solution.own_count() as f64
        };
        let dof = (count - solution.covariance.count_data(&solution.problem)).max(0.0) as usize;
        let estimates = solution.problem.samples.iter().any(|sample| sample.block.estimates_noise());
        Self { dof, estimated: is_robust || estimates }
    }

    /// Returns Student's t if the scatter of the data gives the errors.
    fn student(&self) -> Option<StudentsT> {
        StudentsT::new(0.0, 1.0, self.dof.max(1) as f64).ok().filter(|_| self.estimated)
    }

    /// Returns the 97.5 % quantile.
    pub fn quantile(&self) -> f64 {
        self.student().map_or_else(|| Normal::standard().inverse_cdf(0.975), |t| t.inverse_cdf(0.975))
    }

    /// Returns the two-sided probability of a difference above `errors` standard errors; 1 if it is
    /// NaN.
    fn p_value(&self, errors: f64) -> f64 {
        if errors.is_nan() {
            return 1.0;
        }
        2.0 * self.student().map_or_else(|| Normal::standard().sf(errors.abs()), |t| t.sf(errors.abs()))
    }

    /// Returns the probability of a larger rise of χ² by `extra` parameters.
    pub(crate) fn of_rise(&self, rise: f64, extra: usize) -> f64 {
        let extra = extra as f64;
        if self.estimated {
            FisherSnedecor::new(extra, self.dof.max(1) as f64).map_or(f64::NAN, |f| f.sf(rise / extra))
        } else {
            ChiSquared::new(extra).map_or(f64::NAN, |d| d.sf(rise))
        }
    }

    /// Returns the difference of two labels, `value` the second less the first.
    pub fn pair(&self, [first, second]: [&str; 2], value: f64, std_error: f64) -> Difference {
        let t = self.quantile();
        let p_value = self.p_value(value / std_error);
        let interval_95 = [value - t * std_error, value + t * std_error];
        let [first, second] = [first, second].map(str::to_owned);
        Difference { first, second, value, std_error, interval_95, p_value, p_holm: p_value, real: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One shot a label leaves no error: such labels do not differ.
    #[test]
    fn labels_without_errors_do_not_differ() {
        for estimated in [true, false] {
            let tests = Tests { dof: 0, estimated };
            for (value, std_error) in [(0.0, 0.0), (0.1, f64::NAN)] {
                assert!(tests.pair(["a", "b"], value, std_error).p_value >= 1.0);
            }
        }
    }
}
