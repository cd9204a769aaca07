//! Profile intervals: χ², least over all other unknowns, as one unknown moves away from its
//! estimate, until it has risen by t² (Venzon and Moolgavkar, Appl. Statist. 37 (1988) 87). They
//! know bounds, corners and curvature, which value ± t·error does not.

use std::f64::consts::TAU;

use nalgebra::{DVector, Matrix2, Vector2};
use rayon::prelude::*;

use super::evaluation::Evaluation;
use super::minimise::{Descent, descend};
use super::problem::Problem;
use super::solution::Solution;

/// Part of t·error by which a profile differs from that of a parabola, from which on it is the
/// interval.
pub(super) const DIFFERENT: f64 = 0.1;

/// Evaluations of a descent at one point of a table, and of a film, whose steps gain little
/// after the first; and points for one end, typical are 3.
const MAX_STEPS: [usize; 2] = [60, 3];
const MAX_POINTS: [usize; 2] = [80, 8];

/// Relative width of a bracket at which a jump of χ² is an end.
const JUMP: f64 = 1e-6;

/// Largest ratio of the decrease that a step promises, and which is taken for made, to the error of
/// χ²: steps gain what they promise within a quarter.
const PROMISED: f64 = 2.0;

/// Directions of the edge of a region, and of one that is an ellipse.
const DIRECTIONS: [usize; 2] = [24, 48];

/// Relative precision of the root of the rise of χ² at ends of intervals and edges of regions: a
/// line's width, and as much as χ² of films is rough.
pub(super) const EDGE: f64 = 0.02;

impl Solution {
    /// Returns both ends of the interval of a column of the problem: χ² is `t²` above its minimum
    /// there, or they are bounds met before; `None` if χ² cannot be minimised there. The root of
    /// its rise is as precise, relatively, as `precision` has it for the first value that is tried,
    /// the end of a parabola, and for others.
    pub(crate) fn profile(&self, column: usize, (t, precision): (f64, [f64; 2])) -> Option<[f64; 2]> {
        let from = self.at.state.shared.0[column];
        let error = self.covariance.sd(column).map(|sd| t * sd).filter(|sd| *sd > 0.0 && sd.is_finite());
        let first = error.unwrap_or(0.1 * from.abs().max(0.01));
        let [low, high] = self.problem.unknowns[column].bounds;
        let end = |sign: f64, bound: f64| {
            let limit = (bound - from).abs();
            let value = |distance: f64| if distance >= limit { bound } else { from + sign * distance };
            let place = |distance: f64| [(column, value(distance))];
            reach(&self.problem, &self.at, (t, precision), (first, limit), place).map(value)
        };
        Some([end(-1.0, low)?, end(1.0, high)?])
    }

    /// Returns the 95 % interval of a column of the problem by its profile if χ² is not the parabola
    /// that its standard error says; `None` if it is, or cannot be minimised.
    pub(crate) fn lopsided_interval(&self, column: usize, t: f64) -> Option<[f64; 2]> {
        let (value, half) = (self.at.state.shared.0[column], t * self.covariance.sd(column)?);
        let ends = self.profile(column, (t, [DIFFERENT, EDGE]))?;
        (ends != [value - half, value + half]).then_some(ends)
    }

    /// Returns the edge of the region of two columns on which χ², least over all others, is `rise`
    /// above its minimum, within the bounds; `root` takes the unit circle to the ellipse of rise 1,
    /// which is the region if `is_ellipse` is true. `None` if an edge has no end.
    pub(crate) fn region(
        &self,
        pair: [usize; 2],
        root: &Matrix2<f64>,
        (rise, is_ellipse): (f64, bool),
    ) -> Option<Vec<[f64; 2]>> {
        let (centre, t) = (pair.map(|column| self.at.state.shared.0[column]), rise.sqrt());
        let directions = DIRECTIONS[usize::from(is_ellipse)];
        let point = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / directions as f64).sin_cos();
            let along = root * Vector2::new(cos, sin);
            let place = |distance: f64| {
                [0, 1].map(|i| {
                    let [low, high] = self.problem.unknowns[pair[i]].bounds;
                    (pair[i], (centre[i] + distance * along[i]).clamp(low, high))
                })
            };
            if is_ellipse {
                return Some(place(t).map(|(_, value)| value));
            }
            // distance at which both are at their bounds
            let room = |i: usize| {
                let [low, high] = self.problem.unknowns[pair[i]].bounds;
                if along[i] > 0.0 { (high - centre[i]) / along[i] } else { (low - centre[i]) / along[i] }
            };
            let limit = room(0).max(room(1));
            let distance = reach(&self.problem, &self.at, (t, [EDGE; 2]), (t, limit), place)?;
            Some(place(distance).map(|(_, value)| value))
        };
        (0..directions).into_par_iter().map(point).collect()
    }
}

/// Returns the distance along a way from the minimum at which the root of the rise of χ² is `t`, or
/// `limit` if that is met before. The way has held columns at each distance. The root is as
/// precise, relatively, as `precision` has it for `first`, the distance tried first, and for
/// others.
fn reach<const N: usize>(
    problem: &Problem,
    minimum: &Evaluation,
    (t, precision): (f64, [f64; 2]),
    (first, limit): (f64, f64),
    place: impl Fn(f64) -> [(usize, f64); N],
) -> Option<f64> {
    if limit <= 0.0 {
        return Some(0.0);
    }
    // distances, the roots of the rise of χ² there, and the point
    let mut inside = (0.0, 0.0, minimum.clone());
    let mut outside: Option<(f64, f64)> = None;
    let mut trial = first.min(limit);
    for count in 0..MAX_POINTS[usize::from(problem.rows().is_none())] {
        let precision = precision[count.min(1)];
        // half as precise as χ² is told apart
        let there = least_at(problem, &inside.2, &place(trial), precision * t * t);
        let least = there.as_ref().map_or(f64::INFINITY, |there| there.end.cost - there.promise);
        let rise = (least - minimum.cost).max(0.0).sqrt();
        if (rise - t).abs() <= precision * t {
            return Some(trial);
        }
        match there {
            Some(there) if rise < t => inside = (trial, rise, there.end),
            _ => outside = Some((trial, rise)),
        }
        if rise < t && trial >= limit {
            return Some(limit);
        }
        trial = match outside {
            None => (inside.0 * (t / inside.1).clamp(1.05, 3.0)).min(limit),
            Some((far, rise)) => {
                if far - inside.0 <= JUMP * far {
                    return Some(inside.0);
                }
                let part = (t - inside.1) / (rise - inside.1);
                // if χ² turns from flat to steep, a secant alone does not converge
                let is_even = rise.is_finite() && count % 3 < 2;
                let part = if is_even { part.clamp(0.05, 0.95) } else { 0.5 };
                inside.0 + part * (far - inside.0)
            }
        };
    }
    None
}

/// Returns the evaluation at these values of some unknowns, which the others follow to first order
/// from a minimum.
fn follow(problem: &Problem, from: &Evaluation, held: &[(usize, f64)]) -> Option<Evaluation> {
    let reduced = from.reduced()?;
    let is_moving = |column: &usize| reduced.informs(*column) && held.iter().all(|(held, _)| held != column);
    let moving: Vec<usize> = problem.free().into_iter().filter(is_moving).collect();
    let columns = held.iter().map(|(column, _)| *column);
    let all: Vec<usize> = moving.iter().copied().chain(columns).collect();
    let (n, count) = (moving.len(), held.len());
    let by = held.iter().map(|(column, value)| value - from.state.shared.0[*column]);
    let by = DVector::from_iterator(count, by);
    let matrix = reduced.matrix(&all);
    let beside = matrix.view((0, n), (n, count)) * &by;
    let mut step = -matrix.view((0, 0), (n, n)).into_owned().cholesky()?.solve(&beside);
    for (column, step) in moving.iter().zip(step.iter_mut()) {
        let ([low, high], x) = (problem.unknowns[*column].bounds, from.state.shared.0[*column]);
        *step = (x + *step).clamp(low, high) - x;
    }
    let step = DVector::from_iterator(n + count, step.iter().chain(by.iter()).copied());
    let state = reduced.step(problem, &from.state, (&all, &step), 1.0);
    let there = problem.evaluate(state.with(held.iter().copied()));
    there.cost.is_finite().then_some(there)
}

/// Returns the least χ² over all unknowns but some, which have these values, with an error of at most
/// `precision`; descends from another minimum, after the others have followed to first order.
fn least_at(problem: &Problem, from: &Evaluation, held: &[(usize, f64)], precision: f64) -> Option<Descent> {
    let is_other = |column: &usize| held.iter().all(|(held, _)| held != column);
    let others: Vec<usize> = problem.free().into_iter().filter(is_other).collect();
    let unmoved = || problem.evaluate(from.state.clone().with(held.iter().copied()));
    let start = follow(problem, from, held).unwrap_or_else(unmoved);
    let steps = MAX_STEPS[usize::from(problem.rows().is_none())];
    let descent = descend(problem, start, &others, (steps, PROMISED * precision));
    descent.end.cost.is_finite().then_some(descent)
}
