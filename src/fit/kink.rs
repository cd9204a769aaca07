//! Minima at a kink. As μ grows, a thick shot's contact begins to stick, and from there on its
//! outcome no longer follows μ: χ² has a kink, where it can be least without being flat. A
//! least-squares step stalls there; μ is then found by golden sections of the profile of χ².

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::goldensectionsearch::GoldenSectionSearch;
use nalgebra::DVector;

use super::FitError;
use super::search::Search;
use crate::optimise::{self, Constraints, Options, Solution, Termination};
use crate::parameters::Parameter;
use crate::residuals::{Problem, Whitening, parameter_mut};

/// What a fit says that ends at a kink.
pub(super) const TERMINATION: &str = "converged: at the value of μ where a shot begins to stick";

/// Golden sections end at this part of μ: an error of χ² in the last digits.
const TOLERANCE: f64 = 1e-12;

/// Each section leaves 0.618 of the bracket: 100 leave nothing.
const MAX_SECTIONS: u64 = 100;

/// The stalled step is this near to the minimum.
const BRACKET: f64 = 0.1;

/// The minimum, and whether it is at a kink.
pub(super) fn minimise(
    search: &Search,
    free: &[Parameter],
    x: &DVector<f64>,
    constraints: &Constraints,
    whitening: &Whitening,
) -> Result<(Solution, bool), FitError> {
    let problem =
        |free, held| Problem::new(search.fitted, search.model, search.settings, free, held, whitening);
    let options = Options::default();
    let mut solution = optimise::minimise(problem(free, search.initial), x, constraints, &options)?;
    let Some(mu) = free.iter().position(|parameter| *parameter == Parameter::Mu) else {
        return Ok((solution, false));
    };
    if solution.termination != Termination::Stalled {
        return Ok((solution, false));
    }
    let others: Vec<Parameter> = free.iter().copied().filter(|p| *p != Parameter::Mu).collect();
    let profile = Profile {
        search,
        whitening,
        others: &others,
        start: solution.x.clone().remove_row(mu),
        constraints: Constraints::bounds(
            constraints.lower.clone().remove_row(mu),
            constraints.upper.clone().remove_row(mu),
        ),
    };
    let stalled = solution.x[mu];
    let (from, to) = (
        (stalled * (1.0 - BRACKET)).max(constraints.lower[mu]),
        (stalled * (1.0 + BRACKET)).min(constraints.upper[mu]),
    );
    let Ok(golden) = GoldenSectionSearch::new(from, to).and_then(|g| g.with_tolerance(TOLERANCE)) else {
        return Ok((solution, false));
    };
    let found = Executor::new(&profile, golden)
        .configure(|state| state.param(stalled).max_iters(MAX_SECTIONS))
        .timer(false)
        .run();
    let Some(best) = found.ok().and_then(|found| found.state.best_param) else {
        return Ok((solution, false));
    };
    let Some((rest, cost)) = profile.at(best) else { return Ok((solution, false)) };
    if cost > solution.cost {
        return Ok((solution, false));
    }
    let x = rest.insert_row(mu, best);
    (solution.residuals, solution.jacobian) = problem(free, search.initial).evaluate_at(&x);
    (solution.x, solution.cost) = (x, cost);
    Ok((solution, from < best && best < to))
}

/// ½χ² as a function of μ, least over the others.
struct Profile<'a> {
    search: &'a Search<'a>,
    whitening: &'a Whitening,
    others: &'a [Parameter],
    start: DVector<f64>,
    constraints: Constraints,
}

impl Profile<'_> {
    /// The other parameters and the cost.
    fn at(&self, mu: f64) -> Option<(DVector<f64>, f64)> {
        let mut held = self.search.initial;
        *parameter_mut(&mut held, Parameter::Mu) = mu;
        let Search { fitted, model, settings, .. } = *self.search;
        let problem = Problem::new(fitted, model, settings, self.others, held, self.whitening);
        let prior = settings[Parameter::Mu].prior.map_or(0.0, |p| 0.5 * ((mu - p.mean) / p.sd).powi(2));
        if self.start.is_empty() {
            let (residuals, _) = problem.evaluate_at(&self.start);
            return Some((self.start.clone(), 0.5 * residuals.norm_squared() + prior));
        }
        let solution =
            optimise::minimise(problem, &self.start, &self.constraints, &Options::default()).ok()?;
        Some((solution.x, solution.cost + prior))
    }
}

impl CostFunction for &Profile<'_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, mu: &f64) -> Result<f64, Error> {
        Ok(self.at(*mu).map_or(f64::INFINITY, |(_, cost)| cost))
    }
}
