//! Profile intervals: χ², least over all other unknowns, as one unknown moves away from its estimate,
//! until it has risen by t² (Venzon and Moolgavkar, Appl. Statist. 37 (1988) 87). They know bounds,
//! kinks and curvature, which value ± t·error does not.

use nalgebra::DVector;

use super::descent::descend_until;
use super::problem::{Evaluation, Problem};
use super::solution::Solution;
use super::unknowns::Id;

/// Relative precision of the root of the rise of χ² at an end.
const PRECISION: f64 = 2e-3;

/// Fall of χ² below which the least χ² at a point is found: 0.01 standard deviations.
const STALL: f64 = 1e-4;

/// Evaluations of a descent at one point, and points for one end; typical are 3 and 3.
const MAX_STEPS: usize = 60;
const MAX_POINTS: usize = 40;

/// Relative width of a bracket at which a jump of χ² is an end.
const JUMP: f64 = 1e-6;

/// Part of t that the rise is taken to be at least, so that a flat χ² is left in bounded steps.
const FLAT: f64 = 1e-3;

/// One end of an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct End {
    /// Value of the unknown.
    pub value: f64,
    /// Rise of χ² there: below t² at a bound.
    pub rise: f64,
}

impl Solution {
    /// Returns both ends of the interval of a column of the problem, where χ² is `t²` above its
    /// minimum, or at bounds that are met before; `None` if χ² cannot be minimised there.
    pub(crate) fn profile(&self, column: usize, t: f64) -> Option<[End; 2]> {
        let value = self.at.state.shared.0[column];
        let error = self.covariance.sd(column).map(|sd| t * sd).filter(|sd| *sd > 0.0 && sd.is_finite());
        let first = error.unwrap_or(0.1 * value.abs().max(0.01));
        let end = |sign: f64| profile_end(&self.problem, &self.at, column, t, sign * first);
        Some([end(-1.0)?, end(1.0)?])
    }
}

impl Solution {
    /// Returns the 95 % interval of an unknown of the first sample by its profile if χ² is not the
    /// parabola that its standard error says; `None` if it is, or cannot be minimised.
    pub(crate) fn lopsided_interval(&self, id: Id, t: f64) -> Option<[f64; 2]> {
        /// Part of t by which the root of the rise may differ.
        const PARABOLA: f64 = 0.1;
        let column = self.column(0, id)?;
        let (value, sd) = (self.at.state.shared.0[column], self.covariance.sd(column)?);
        let [low, high] = self.problem.unknowns[column].bounds;
        let is_parabola = |to: f64| {
            let rise = follow(&self.problem, &self.at, column, to)
                .map_or(f64::INFINITY, |there| (there.cost - self.at.cost).max(0.0).sqrt());
            (low..=high).contains(&to) && (rise / t - 1.0).abs() < PARABOLA
        };
        if is_parabola(value - t * sd) && is_parabola(value + t * sd) {
            return None;
        }
        let [below, above] = self.profile(column, t)?;
        Some([below.value, above.value])
    }
}

/// Returns the end of the interval of a column in the direction of `first`, which is the distance of
/// the first point.
fn profile_end(problem: &Problem, minimum: &Evaluation, column: usize, t: f64, first: f64) -> Option<End> {
    let from = minimum.state.shared.0[column];
    let [low, high] = problem.unknowns[column].bounds;
    let (sign, limit) = if first > 0.0 { (1.0, high - from) } else { (-1.0, from - low) };
    let end = |distance: f64, rise: f64| {
        let bound = if sign > 0.0 { high } else { low };
        let value = if distance >= limit { bound } else { from + sign * distance };
        Some(End { value, rise: rise * rise })
    };
    if limit <= 0.0 {
        return end(0.0, 0.0);
    }
    let mut inside = (0.0, 0.0, minimum.clone());
    let mut outside: Option<(f64, f64)> = None;
    let mut trial = first.abs().min(limit);
    for _ in 0..MAX_POINTS {
        let value = if trial >= limit { if sign > 0.0 { high } else { low } } else { from + sign * trial };
        let there = least_at(problem, &inside.2, column, value);
        let rise = there.as_ref().map_or(f64::INFINITY, |at| (at.cost - minimum.cost).max(0.0).sqrt());
        if (rise - t).abs() <= PRECISION * t {
            return end(trial, rise);
        }
        match there {
            Some(at) if rise < t => inside = (trial, rise, at),
            _ => outside = Some((trial, rise)),
        }
        if rise < t && trial >= limit {
            return end(limit, rise);
        }
        trial = match outside {
            None => (inside.0 * (t / inside.1.max(FLAT * t)).clamp(1.05, 3.0)).min(limit),
            Some((far, rise)) => {
                if far - inside.0 <= JUMP * far {
                    return end(inside.0, inside.1);
                }
                let part = (t - inside.1) / (rise - inside.1);
                let part = if rise.is_finite() { part.clamp(0.05, 0.95) } else { 0.5 };
                inside.0 + part * (far - inside.0)
            }
        };
    }
    None
}

/// Returns where the other unknowns follow one, which has this value, to first order from a minimum.
fn follow(problem: &Problem, from: &Evaluation, column: usize, value: f64) -> Option<Evaluation> {
    let others: Vec<usize> = problem.free().into_iter().filter(|other| *other != column).collect();
    let by = value - from.state.shared.0[column];
    from.eliminate(problem, 0.0).and_then(|reduced| {
        let moving: Vec<usize> = others.iter().copied().filter(|other| reduced.informs(*other)).collect();
        let all: Vec<usize> = moving.iter().copied().chain([column]).collect();
        let n = moving.len();
        let matrix = reduced.matrix(&all);
        let beside = matrix.view((0, n), (n, 1)).column(0) * by;
        let mut step = -matrix.view((0, 0), (n, n)).into_owned().cholesky()?.solve(&beside);
        for (column, step) in moving.iter().zip(step.iter_mut()) {
            let ([low, high], x) = (problem.unknowns[*column].bounds, from.state.shared.0[*column]);
            *step = (x + *step).clamp(low, high) - x;
        }
        let step = DVector::from_iterator(n + 1, step.iter().copied().chain([by]));
        let mut state = reduced.step(problem, &from.state, &all, &step);
        state.shared.0[column] = value;
        let there = problem.evaluate(state);
        there.cost.is_finite().then_some(there)
    })
}

/// Returns the least χ² over all unknowns but one, which has this value; descends from another
/// minimum, from where the others follow to first order.
fn least_at(problem: &Problem, from: &Evaluation, column: usize, value: f64) -> Option<Evaluation> {
    let others: Vec<usize> = problem.free().into_iter().filter(|other| *other != column).collect();
    let start = follow(problem, from, column, value).unwrap_or_else(|| {
        let mut state = from.state.clone();
        state.shared.0[column] = value;
        problem.evaluate(state)
    });
    let end = descend_until(problem, start, &others, MAX_STEPS, STALL).end;
    end.cost.is_finite().then_some(end)
}
