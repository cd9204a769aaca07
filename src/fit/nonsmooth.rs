//! Minima at a kink. As μ grows, a thick shot's contact begins to stick, and from there on its
//! outcome no longer follows μ: χ² has a kink, where it can be least without being flat. A
//! least-squares step stalls there; μ is then found by golden sections of the profile of χ².

use argmin::core::{CostFunction, Error, Executor};
use argmin::solver::goldensectionsearch::GoldenSectionSearch;
use nalgebra::DVector;

use super::FitError;
use super::minimum::Minimum;
use super::noise::Group;
use super::robust::Losses;
use super::samples::Search;
use super::slice::Slice;
use crate::likelihood::sample::{Sample, Unknown};
use crate::likelihood::whitening::{Hold, Whitening};
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;
use crate::numerics::least_squares;
use crate::numerics::least_squares::{Options, Solution, Termination};

/// What a fit says that ends at a kink.
pub(super) const TERMINATION: &str = "converged: at the value of μ where a shot begins to stick";

/// Golden sections end at this part of μ, an error of χ² in the last digits, or where what is asked for is less precise.
const TOLERANCE: f64 = 1e-12;

/// Each section leaves 0.618 of the bracket: 100 leave nothing.
const MAX_SECTIONS: u64 = 100;

/// The stalled step is this near to the minimum.
const BRACKET: f64 = 0.1;

/// The bracket is looked at in so many places before it is divided: it may hold several kinks.
const PLACES: usize = 16;

/// A search that ends at an end of the bracket goes on from there, at most so often.
const MAX_BRACKETS: usize = 5;

/// Where μ is one of several unknowns that the friction depends on, kinks are valleys across all of them, and a search with μ
/// held stalls as well: the places of the bracket then say as much as sections of it would.
const LAW: [Parameter; 2] = [Parameter::B, Parameter::C];
const BRACKETS_OF_A_LAW: usize = 2;
const PLACES_OF_A_LAW: Options = Options { max_iterations: 30, orthogonality: 1e-6 };

/// χ² at a given point of a profile needs no more than this: it errs by the square.
const QUICK: Options = Options { max_iterations: 100, orthogonality: 1e-6 };

/// That of frames is the sum of thousands of squares, each about 1, so that 1e-3 of its root is a twentieth of a standard error; that
/// of integrated collisions is rough.
const QUICK_ROUGH: Options = Options { max_iterations: 100, orthogonality: 1e-3 };

/// The minimum from a start within the bounds, and whether it is at a kink.
pub(super) fn minimise(
    slice: &Slice,
    start: &DVector<f64>,
    options: &Options,
) -> Result<(Solution, bool), FitError> {
    let bounds = &slice.bounds;
    let mut solution = least_squares::minimise(slice.problem(), start, bounds, options)?;
    let has_kinks = |(column, unknown): &(usize, &Unknown)| {
        unknown.parameter == Parameter::Mu
            && bounds.lower[*column] < bounds.upper[*column]
            // discs whose contact gives way go over from sliding to sticking smoothly
            && slice.search.members(**unknown).any(|i| !is_smooth(&slice.search.samples[i]))
    };
    let frictions: Vec<usize> =
        slice.free.iter().enumerate().filter(has_kinks).map(|(column, _)| column).collect();
    if frictions.is_empty() || slice.search.is_rough() {
        return Ok((solution, false));
    }
    let is_law = slice.free.iter().any(|unknown| LAW.contains(&unknown.parameter));
    for _ in 0..if is_law { BRACKETS_OF_A_LAW } else { MAX_BRACKETS } {
        if !matches!(solution.termination, Termination::Stalled | Termination::MaxIterations) {
            break;
        }
        let of = |mu: &usize| {
            if is_law { places(slice, *mu, &solution) } else { across(slice, *mu, &solution, options) }
        };
        let found = frictions.iter().filter_map(of).min_by(|a, b| a.cost.total_cmp(&b.cost));
        let Some(Lowest { x, is_inside: at_kink, .. }) = found else { break };
        let next = least_squares::minimise(slice.problem(), &x, bounds, options)?;
        let iterations = solution.iterations + next.iterations;
        if at_kink && !next.termination.converged() {
            (solution.residuals, solution.jacobian) = slice.problem().evaluate_at(&x);
            solution.cost = 0.5 * solution.residuals.norm_squared();
            solution.active = bounds.activity(&x);
            solution.x = x;
            return Ok((Solution { iterations, ..solution }, true));
        }
        if next.cost >= solution.cost {
            break;
        }
        solution = Solution { iterations, ..next };
    }
    Ok((solution, false))
}

/// Whether its shots go over from sliding to sticking smoothly.
fn is_smooth(sample: &Sample) -> bool {
    sample.model.kappa > 0.0 && sample.fitted.iter().all(|shot| shot.plan.is_of_discs())
}

/// The lowest point within a bracket.
struct Lowest {
    x: DVector<f64>,
    cost: f64,
    /// Whether it is not at an end of the bracket.
    is_inside: bool,
}

/// Within the bracket of a stalled search; `None` where no point is lower.
fn across(slice: &Slice, mu: usize, stalled: &Solution, options: &Options) -> Option<Lowest> {
    let (lower, upper) = (slice.bounds.lower[mu], slice.bounds.upper[mu]);
    let value = stalled.x[mu];
    let ends = [(value * (1.0 - BRACKET)).max(lower), (value * (1.0 + BRACKET)).min(upper)];
    let profile = Profile { slice, mu, start: &stalled.x };
    let at = |place: usize| ends[0] + (ends[1] - ends[0]) * place as f64 / PLACES as f64;
    let costs: Vec<f64> =
        (0..=PLACES).map(|i| profile.at(at(i)).map_or(f64::INFINITY, |(_, cost)| cost)).collect();
    let lowest = (0..=PLACES).min_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
    // around where the search stalled, unless another place is lower
    let around = if costs[lowest] < stalled.cost { at(lowest) } else { value };
    let step = (ends[1] - ends[0]) / PLACES as f64;
    let (from, to) = ((around - step).max(ends[0]), (around + step).min(ends[1]));
    let golden = GoldenSectionSearch::new(from, to)
        .and_then(|g| g.with_tolerance(options.orthogonality.max(TOLERANCE)))
        .ok()?;
    let found = Executor::new(&profile, golden)
        .configure(|state| state.param(around.clamp(from, to)).max_iters(MAX_SECTIONS))
        .timer(false)
        .run();
    let best = found.ok()?.state.best_param?;
    let (x, cost) = profile.at(best)?;
    (cost <= stalled.cost).then_some(Lowest { x, cost, is_inside: from < best && best < to })
}

/// As [`across`] to the precision of the places themselves: the lowest of them or, if none is lower, where the search
/// stalled.
fn places(slice: &Slice, mu: usize, stalled: &Solution) -> Option<Lowest> {
    let value = stalled.x[mu];
    let at = |place: usize| {
        let mu_there = value * (1.0 + BRACKET * (2.0 * place as f64 / PLACES as f64 - 1.0));
        let mut start = stalled.x.clone();
        start[mu] = mu_there;
        let held = slice.holding(&[(mu, mu_there)]);
        let start = held.bounds.clamp(&start);
        let found = least_squares::minimise(held.problem(), &start, &held.bounds, &PLACES_OF_A_LAW);
        found.ok().map(|found| (found.x, found.cost))
    };
    let lowest = (0..=PLACES).filter_map(at).min_by(|a, b| a.1.total_cmp(&b.1));
    match lowest {
        Some((x, cost)) if cost < stalled.cost => Some(Lowest { x, cost, is_inside: false }),
        _ => Some(Lowest { x: stalled.x.clone(), cost: stalled.cost, is_inside: true }),
    }
}

impl Slice<'_> {
    /// ½χ² least over what is not held, and where; from `start`. `None` where nothing can be evaluated.
    pub(crate) fn at(&self, held: &[(usize, f64)], start: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let slice = self.holding(held);
        let mut start = start.clone();
        for (column, value) in held {
            start[*column] = *value;
        }
        let start = slice.bounds.clamp(&start);
        if slice.bounds.lower == slice.bounds.upper {
            let (residuals, _) = slice.problem().evaluate_at(&start);
            let cost = 0.5 * residuals.norm_squared();
            return cost.is_finite().then_some((start, cost));
        }
        let quick = if slice.search.is_rough() { QUICK_ROUGH } else { QUICK };
        let (solution, _) = minimise(&slice, &start, &quick).ok()?;
        Some((solution.x, solution.cost))
    }
}

impl Search<'_> {
    /// The minimum at a kink near some values, by golden sections of what is minimised, least over all other unknowns with
    /// their weights at rest: where the weights differ from one side of a kink to the other, a search of all unknowns goes
    /// to and fro between them.
    pub(super) fn at_kink(
        &self,
        (free, friction): (&[Unknown], Unknown),
        near: &[Values],
        reach: f64,
    ) -> Option<(Minimum, Vec<Group>)> {
        /// The bracket is narrowed to this part of itself, by 0.618 each time.
        const SECTIONS: usize = 30;
        const GOLDEN: f64 = 0.618_033_988_749_895;
        let others: Vec<Unknown> = free.iter().copied().filter(|unknown| *unknown != friction).collect();
        let held = |mu: f64| {
            let search = self.from(&self.set(near, friction, mu));
            let (minimum, groups) = search.converge(&others).ok()?;
            let objective = search.objective(&minimum, &groups);
            objective.is_finite().then_some((objective, minimum, groups))
        };
        let value =
            |found: &Option<(f64, Minimum, Vec<Group>)>| found.as_ref().map_or(f64::INFINITY, |f| f.0);
        let setting = self.setting(friction);
        let centre = self.value(near, friction);
        let [mut low, mut high] =
            [-reach, reach].map(|by| (centre * (1.0 + by)).clamp(setting.lower, setting.upper));
        let mut best = held(centre);
        let mut inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)].map(|mu| (mu, held(mu)));
        for _ in 0..SECTIONS {
            let [left, right] = inner;
            let is_left = value(&left.1) <= value(&right.1);
            let lower = if is_left { &left.1 } else { &right.1 };
            if value(lower) < value(&best) {
                best.clone_from(lower);
            }
            inner = if is_left {
                high = right.0;
                let mu = high - GOLDEN * (high - low);
                [(mu, held(mu)), left]
            } else {
                low = left.0;
                let mu = low + GOLDEN * (high - low);
                [right, (mu, held(mu))]
            };
        }
        let (_, minimum, mut groups) = best?;
        let bounds = self.bounds(free);
        let unknowns = minimum.x.len() - minimum.shared;
        let own = free.iter().map(|unknown| self.value(&minimum.values, *unknown));
        let x = DVector::from_iterator(
            free.len() + minimum.shared,
            own.chain(minimum.x.iter().skip(unknowns).copied()),
        );
        let there = self.from(&minimum.values);
        let at = |whitening: &[Whitening]| there.problem(free, whitening).evaluate_at(&x);
        let mut whitening = minimum.whitening.clone();
        if !groups.is_empty() {
            // estimated noise knows that μ was fitted, too
            let losses: Vec<Losses> = self.samples.iter().map(|sample| Losses::new(sample.loss)).collect();
            let (_, jacobian) = at(&whitening);
            self.reweigh(&mut groups, &minimum.values, &whitening, &jacobian, &losses, &minimum.weights);
            let before = (Some(whitening.as_slice()), Hold::All);
            let anew = self.whitening(&minimum.values, &groups, (free.len(), &x), before).ok()?;
            whitening = if self.is_robust() { self.weighted(anew, &minimum.weights) } else { anew };
        }
        let (residuals, jacobian) = at(&whitening);
        let minimum = Minimum {
            cost: 0.5 * residuals.norm_squared(),
            gradient: jacobian.tr_mul(&residuals),
            active: bounds.activity(&x),
            bounds,
            x,
            residuals,
            jacobian,
            whitening,
            termination: TERMINATION.to_string(),
            ..minimum
        };
        Some((minimum, groups))
    }
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
