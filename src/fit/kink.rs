//! Minima at a kink. As μ grows, a thick shot's contact begins to stick, and from there on its
//! outcome no longer follows μ: χ² has a kink, where it can be least without being flat. A
//! least-squares step stalls there; μ is then found by golden sections of the profile of χ².

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::goldensectionsearch::GoldenSectionSearch;
use nalgebra::DVector;

use super::FitError;
use super::profile::Slice;
use crate::optimise::{self, Options, Solution, Termination};
use crate::parameters::Parameter;
use crate::residuals::are_filmed;

/// What a fit says that ends at a kink.
pub(super) const TERMINATION: &str = "converged: at the value of μ where a shot begins to stick";

/// Golden sections end at this part of μ: an error of χ² in the last digits.
const TOLERANCE: f64 = 1e-12;

/// Each section leaves 0.618 of the bracket: 100 leave nothing.
const MAX_SECTIONS: u64 = 100;

/// The stalled step is this near to the minimum.
const BRACKET: f64 = 0.1;

/// The minimum from a start that satisfies the constraints, and whether it is at a kink.
pub(super) fn minimise(
    slice: &Slice,
    start: &DVector<f64>,
    options: &Options,
) -> Result<(Solution, bool), FitError> {
    let constraints = &slice.constraints;
    let mut solution = optimise::minimise(slice.problem(), start, constraints, options)?;
    let Some(mu) = slice.free.iter().position(|parameter| *parameter == Parameter::Mu) else {
        return Ok((solution, false));
    };
    let filmed = are_filmed(slice.search.fitted);
    if filmed
        || !matches!(solution.termination, Termination::Stalled | Termination::MaxIterations)
        || constraints.lower[mu] == constraints.upper[mu]
    {
        return Ok((solution, false));
    }
    let stalled = solution.x[mu];
    let (from, to) = (
        (stalled * (1.0 - BRACKET)).max(constraints.lower[mu]),
        (stalled * (1.0 + BRACKET)).min(constraints.upper[mu]),
    );
    let Ok(golden) = GoldenSectionSearch::new(from, to).and_then(|g| g.with_tolerance(TOLERANCE)) else {
        return Ok((solution, false));
    };
    let profile = Profile { slice, mu, start: &solution.x };
    let found = Executor::new(&profile, golden)
        .configure(|state| state.param(stalled).max_iters(MAX_SECTIONS))
        .timer(false)
        .run();
    let Some(best) = found.ok().and_then(|found| found.state.best_param) else {
        return Ok((solution, false));
    };
    let Some((x, cost)) = profile.at(best) else { return Ok((solution, false)) };
    if cost > solution.cost {
        return Ok((solution, false));
    }
    (solution.residuals, solution.jacobian) = slice.problem().evaluate_at(&x);
    (solution.x, solution.cost) = (x, cost);
    Ok((solution, from < best && best < to))
}

/// ½χ² as a function of μ, least over the others.
struct Profile<'a> {
    slice: &'a Slice<'a>,
    mu: usize,
    start: &'a DVector<f64>,
}

impl Profile<'_> {
    /// The unknowns and the cost.
    fn at(&self, mu: f64) -> Option<(DVector<f64>, f64)> {
        self.slice.at(&[(self.mu, mu)], self.start)
    }
}

impl CostFunction for &Profile<'_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, mu: &f64) -> Result<f64, Error> {
        Ok(self.at(*mu).map_or(f64::INFINITY, |(_, cost)| cost))
    }
}
