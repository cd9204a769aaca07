//! The fit of all samples together.

use minijinja::context;
use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

use super::CompareError;
use super::result::{Difference, NOT_CONVERGED};
use super::samples::{Alone, Samples};
use crate::fit::film_words::{Remark, doubt, note};
use crate::numerics::EXACT;
use crate::problem::Severity::Unusable;
use crate::problem::{
    self, Descent, Estimates, Evaluation, Id, Mode, Problem, Record, Solution, State, comply, descend,
    descend_with_noise, robust_covariance,
};

/// Steps of a descent at given noise, typical are 3.
const STEPS: usize = 40;

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
        let (mut problem, start) = samples.join()?;
        let start = best_start(&problem, start, &samples.fitted);
        let mut descent = descend_with_noise(&mut problem, start);
        if samples.options.fidelity.is_none()
            && let Some(problem::Finding::Compliance { fall, adopted: true, .. }) =
                comply(&mut problem, &mut descent)
        {
            samples.remarks.push(note("compliance/compliant-together", context! { fall }));
        }
        if problem.is_weighed() {
            problem.weigh(&descent.end.state);
            descent = descend_with_noise(&mut problem, descent.end.state);
        }
        problem.weigh_again(&mut descent.end);
        // χ² of likelihood ratios is that of the noise as it was estimated last
        let end = settle(&problem, descent.end.state);
        if !descent.converged {
            let values = context! { termination => NOT_CONVERGED };
            samples.remarks.push(Remark::new(Unusable, "not-converged/joint-search-failed", values));
        }
        let covariance = estimate(&problem, &end, &[]).unwrap_or_else(|| {
            samples.remarks.push(doubt("undetermined/joint-undetermined", context! {}));
            Estimates { columns: Vec::new(), covariance: DMatrix::zeros(0, 0) }
        });
        let record = Record { findings: Vec::new(), left_out: Vec::new(), unit: 1.0, middle: [0.0; 2] };
        let solution = Solution::new(problem, Descent { end, ..descent }, covariance, record);
        Ok(Self { samples, tests: Tests::new(&solution), solution })
    }
}

/// Returns the best of the ends of descents from one value of κ for all: their mean and that of
/// each sample, as χ² has several minima in a free κ.
fn best_start(problem: &Problem, start: State, fitted: &[Alone]) -> State {
    let mut columns = problem.columns_of(Id::Kappa);
    columns.retain(|column| problem.unknowns[*column].mode == Mode::Free);
    if columns.is_empty() {
        return start;
    }
    let from = |alone: &Alone| {
        let value = |column: &usize| {
            let [low, high] = problem.unknowns[*column].bounds;
            (*column, alone.solution.value(Id::Kappa).clamp(low, high))
        };
        start.clone().with(columns.iter().map(value))
    };
    let starts = std::iter::once(start.clone()).chain(fitted.iter().map(from));
    let ends = starts.map(|start| settle(problem, start)).filter(|end| end.cost.is_finite());
    ends.min_by(|a, b| a.cost.total_cmp(&b.cost)).map_or(start, |end| end.state)
}

/// Returns the minimum at the present noise to rounding: tables are as smooth as their arithmetic.
pub(super) fn settle(problem: &Problem, state: State) -> Evaluation {
    descend(problem, problem.evaluate(state), &problem.free(), (STEPS, EXACT)).end
}

/// Returns the covariance with all of some columns, even at a bound.
pub(super) fn estimate(problem: &Problem, at: &Evaluation, columns: &[usize]) -> Option<Estimates> {
    let is_inside = |column: &usize| {
        !problem.unknowns[*column].bounds.contains(&at.state.shared.0[*column]) || columns.contains(column)
    };
    let free = problem.free().into_iter().filter(is_inside).collect();
    let estimates = Estimates::of_columns(at.reduced()?, free)?;
    let covariance = robust_covariance(problem, at, &estimates).or_else(|| {
        // without enough shots by a robust loss there are no errors
        (!problem.is_robust()).then(|| estimates.covariance.clone())
    });
    Some(Estimates { covariance: covariance?, ..estimates })
}

/// Returns the problem with one column instead of several, whose priors all count.
pub(super) fn merged(problem: &Problem, columns: &[usize]) -> Problem {
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
    let bounds = columns.iter().map(|column| problem.unknowns[*column].bounds);
    let within = |all: [f64; 2], own: [f64; 2]| [all[0].max(own[0]), all[1].min(own[1])];
    same.unknowns[first].bounds = bounds.fold(problem.unknowns[first].bounds, within);
    same
}

/// How sums of squares are judged.
#[derive(Clone, Copy)]
pub(super) struct Tests {
    /// Degrees of freedom if the noise was estimated from the residuals, or, with a robust loss,
    /// the errors from the scatter of the shots.
    pub(crate) dof: Option<f64>,
}

impl Tests {
    fn new(solution: &Solution) -> Self {
        let is_robust = solution.problem.is_robust();
        let is_estimated =
            solution.problem.samples.iter().any(|sample| sample.block.variation().is_estimated());
        let count = if is_robust {
            solution.at.shots.iter().map(Vec::len).sum::<usize>() as f64
        } else {
            solution.chi2_of_data().1 - solution.own_count() as f64
        };
        let dof = (count - solution.covariance.count_data(&solution.problem)).floor().max(1.0);
        Self { dof: (is_robust || is_estimated).then_some(dof) }
    }

    /// Returns the distribution of deviations in standard errors.
    fn of_errors(&self) -> Box<dyn ContinuousCDF<f64, f64>> {
        match self.dof.map(|dof| StudentsT::new(0.0, 1.0, dof)) {
            Some(Ok(student)) => Box::new(student),
            _ => Box::new(Normal::standard()),
        }
    }

    /// Returns the 97.5 % quantile of deviations in standard errors.
    pub fn quantile(&self) -> f64 {
        self.of_errors().inverse_cdf(0.975)
    }

    /// Returns the probability of a larger rise of χ² by `extra` parameters.
    pub(crate) fn of_rise(&self, rise: f64, extra: usize) -> f64 {
        let extra = extra as f64;
        match self.dof {
            _ if rise.is_nan() => f64::NAN,
            Some(dof) => FisherSnedecor::new(extra, dof).map_or(f64::NAN, |f| f.sf(rise / extra)),
            None => ChiSquared::new(extra).map_or(f64::NAN, |d| d.sf(rise)),
        }
    }

    /// Returns the difference of two labels, `value` the second less the first.
    pub fn pair(&self, [first, second]: [&str; 2], value: f64, std_error: f64) -> Difference {
        let half = self.quantile() * std_error;
        // labels without errors do not differ
        let errors = (value / std_error).abs().max(0.0);
        let p_value = 2.0 * self.of_errors().sf(errors);
        let interval_95 = [value - half, value + half];
        let [first, second] = [first, second].map(str::to_owned);
        Difference { first, second, value, std_error, interval_95, p_value, p_holm: p_value, real: false }
    }
}
