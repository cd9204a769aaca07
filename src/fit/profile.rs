//! The least-squares problem with some of its unknowns held, and the intervals that follow: a
//! parameter's 95 % interval is where χ², least over all others, is within t² of its minimum. Unlike
//! value ± t·error this knows bounds, kinks and curvature.

use nalgebra::DVector;

use super::search::Search;
use super::uncertainty::{Minimum, Quantiles};
use super::{Estimate, Status, kink};
use crate::optimise::{Constraints, Options};
use crate::parameters::Parameter;
use crate::residuals::{Problem, Whitening};

/// χ² at a given point of a profile needs no more than this: it errs by the square.
const QUICK: Options = Options { max_iterations: 100, orthogonality: 1e-6 };

/// An end of an interval is found to this part of its distance from the estimate.
const END: f64 = 1e-3;

/// Evaluations for one end; a smooth profile takes two or three.
const MAX_TRIALS: usize = 40;

/// A part of the least-squares problem: within some constraints, with the weights of the minimum.
#[derive(Clone)]
pub(super) struct Slice<'a> {
    pub search: &'a Search<'a>,
    pub free: &'a [Parameter],
    pub constraints: Constraints,
    pub whitening: &'a Whitening,
}

impl<'a> Slice<'a> {
    pub(super) fn problem(&self) -> Problem<'a> {
        let Search { fitted, model, settings, initial, .. } = *self.search;
        Problem::new(fitted, model, settings, self.free, initial, self.whitening)
    }

    /// ½χ² least over what is not held, and where; from `start`. `None` where nothing can be
    /// evaluated, or the constraints do not allow the values.
    pub(super) fn at(&self, held: &[(usize, f64)], start: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let mut slice = self.clone();
        let mut start = start.clone();
        for &(column, value) in held {
            slice.constraints.lower[column] = value;
            slice.constraints.upper[column] = value;
            start[column] = value;
        }
        let start = slice.constraints.nearest(&start)?;
        if slice.constraints.lower == slice.constraints.upper {
            let (residuals, _) = slice.problem().evaluate_at(&start);
            let cost = 0.5 * residuals.norm_squared();
            return cost.is_finite().then_some((start, cost));
        }
        let (solution, _) = kink::minimise(&slice, &start, &QUICK).ok()?;
        Some((solution.x, solution.cost))
    }
}

/// Profile-likelihood intervals of the free parameters, one-sided at an active bound; `None` where
/// there is none. Also the lowest cost met, in case that is below the minimum.
pub(super) fn intervals(
    slice: &Slice,
    minimum: &Minimum,
    estimates: &[Estimate],
    quantiles: &Quantiles,
) -> (Vec<Option<[f64; 2]>>, f64) {
    let mut lowest = minimum.cost;
    let mut profile = Profile { slice, minimum, column: 0, lowest: &mut lowest };
    let intervals = estimates.iter().enumerate().map(|(column, estimate)| {
        profile.column = column;
        let value = minimum.x[column];
        let reach = |side: usize| {
            estimate.interval_95.map(|ends| (ends[side] - value).abs()).filter(|r| *r > 0.0 && r.is_finite())
        };
        match estimate.status {
            Status::Free => {
                let t = quantiles.two_sided;
                Some([profile.end(-1.0, t, reach(0))?, profile.end(1.0, t, reach(1))?])
            }
            Status::AtLowerBound => Some([value, profile.end(1.0, quantiles.one_sided, reach(1))?]),
            Status::AtUpperBound => Some([profile.end(-1.0, quantiles.one_sided, reach(0))?, value]),
            Status::Fixed | Status::NotIdentified => None,
        }
    });
    let intervals = intervals.collect();
    (intervals, lowest)
}

struct Profile<'a> {
    slice: &'a Slice<'a>,
    minimum: &'a Minimum,
    column: usize,
    lowest: &'a mut f64,
}

impl Profile<'_> {
    /// Where √(χ² − χ²_min), nearly a straight line, reaches t; the bound if it does not.
    fn end(&mut self, direction: f64, t: f64, reach: Option<f64>) -> Option<f64> {
        let (column, best) = (self.column, self.minimum.x[self.column]);
        let constraints = &self.slice.constraints;
        let bound = if direction > 0.0 { constraints.upper[column] } else { constraints.lower[column] };
        if best == bound {
            return Some(best);
        }
        let within = |value: f64| if direction > 0.0 { value.min(bound) } else { value.max(bound) };
        let first = reach.unwrap_or(0.1 * best.abs().max(0.01));
        // inside: χ² is lower than t² above the minimum; outside: higher, or cannot be had
        let (mut inside, mut at_inside) = ((best, 0.0), self.minimum.x.clone());
        let mut outside: Option<(f64, f64)> = None;
        let mut trial = within(best + direction * first);
        for _ in 0..MAX_TRIALS {
            let rise = match self.slice.at(&[(column, trial)], &at_inside) {
                Some((x, cost)) => {
                    *self.lowest = self.lowest.min(cost);
                    let rise = (2.0 * (cost - self.minimum.cost)).max(0.0).sqrt();
                    if rise <= t {
                        at_inside = x;
                    }
                    rise
                }
                None => f64::INFINITY,
            };
            if (rise - t).abs() <= END * t {
                return Some(trial);
            }
            if rise < t {
                if trial == bound {
                    return Some(bound);
                }
                inside = (trial, rise);
            } else {
                outside = Some((trial, rise));
            }
            trial = match outside {
                None => {
                    let factor = (t / inside.1).clamp(1.05, 3.0);
                    within(best + factor * (inside.0 - best))
                }
                Some((far, rise)) => {
                    if (far - inside.0).abs() <= END * (far - best).abs() {
                        // a cliff
                        return Some(inside.0);
                    }
                    let part = (t - inside.1) / (rise - inside.1);
                    let part = if rise.is_finite() { part.clamp(0.1, 0.9) } else { 0.5 };
                    inside.0 + part * (far - inside.0)
                }
            };
        }
        None
    }
}
