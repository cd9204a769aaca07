//! Intervals from the least-squares problem with some of its unknowns held: a parameter's 95 % interval is where χ², least over all others, is within t² of its minimum. Unlike
//! value ± t·error this knows bounds, kinks and curvature.

use nalgebra::{DMatrix, DVector};

use crate::fit::Status;
use crate::fit::minimum::Minimum;
use crate::fit::slice::Slice;
use crate::fit::uncertainty::Quantiles;
use crate::measurement::parameter::Parameter;
use crate::numerics::least_squares::Constraints;

/// An end of an interval is found to this part of its distance from the estimate…
const END: f64 = 1e-3;
/// …and the edge of a region that is drawn to this, less than a pixel of most pictures.
pub(in crate::fit) const EDGE: f64 = 1e-2;

/// Evaluations for one end; a smooth profile takes two or three.
const MAX_TRIALS: usize = 40;

/// How χ², least over all other unknowns, rises as one parameter moves.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Profile {
    /// The parameter.
    pub parameter: Parameter,
    /// Its value and by how much χ² is above its minimum there, from the lower end of the 95 % interval to the upper one.
    pub points: Vec<[f64; 2]>,
}

/// Where a profile is taken, as parts of the way from the estimate to an end of its interval.
const PARTS: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Profile-likelihood intervals of a minimum.
pub(in crate::fit) struct Profiles<'a> {
    slice: &'a Slice<'a>,
    minimum: &'a Minimum,
    quantiles: &'a Quantiles,
    covariance: Option<DMatrix<f64>>,
    /// The lowest cost met, in case that is below the minimum.
    pub lowest: f64,
}

impl<'a> Profiles<'a> {
    pub(in crate::fit) fn new(slice: &'a Slice<'a>, minimum: &'a Minimum, quantiles: &'a Quantiles) -> Self {
        Self { slice, minimum, quantiles, covariance: minimum.covariance(), lowest: minimum.cost }
    }

    /// That of a column, one-sided at an active bound; `None` where there is none. `expected`: the Hessian's interval, if it is not that
    /// of the error.
    pub(in crate::fit) fn interval(
        &mut self,
        column: usize,
        status: Status,
        expected: Option<[f64; 2]>,
    ) -> Option<[f64; 2]> {
        let value = self.minimum.x[column];
        let Quantiles { two_sided: both, one_sided: one, .. } = *self.quantiles;
        let mut end = |side: usize, t: f64| {
            let error = self.covariance.as_ref().map_or(f64::NAN, |all| all[(column, column)].sqrt());
            let reach = expected.map_or(t * error, |ends| (ends[side] - value).abs());
            let first = if reach > 0.0 && reach.is_finite() { reach } else { 0.1 * value.abs().max(0.01) };
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let from = (&self.minimum.x, self.minimum.cost);
            let follow = follow(self.covariance.as_ref(), column);
            let lowest = self.minimum.cost;
            let ray = Ray { slice: self.slice, from, lowest, column, follow: &follow, sign, precision: END };
            let (reach, cost) = ray.reach(t, first)?;
            self.lowest = self.lowest.min(cost);
            Some(ray.value(reach))
        };
        match status {
            Status::Free => end(0, both).and_then(|low| Some([low, end(1, both)?])),
            Status::AtLowerBound => end(1, one).map(|high| [value, high]),
            Status::AtUpperBound => end(0, one).map(|low| [low, value]),
            Status::Fixed | Status::NotIdentified => None,
        }
    }

    /// The profile of a column between the ends of its interval; without the points where nothing can be evaluated.
    pub(in crate::fit) fn curve(&self, column: usize, ends: [f64; 2]) -> Vec<[f64; 2]> {
        let (x, cost) = (&self.minimum.x, self.minimum.cost);
        let follow = follow(self.covariance.as_ref(), column);
        let side = |end: f64| {
            let mut near = (0.0, x.clone());
            PARTS.map(|part| {
                let moved = part * (end - x[column]);
                let start = match &follow {
                    Some(follow) if near.0 == 0.0 => x + follow * moved,
                    _ if near.0 == 0.0 => x.clone(),
                    _ => x + (&near.1 - x) * (part / near.0),
                };
                let (there, found) = self.slice.at(&[(column, x[column] + moved)], &start)?;
                near = (part, there);
                Some([x[column] + moved, (2.0 * (found - cost)).max(0.0)])
            })
        };
        let [below, above] = ends.map(side);
        let middle = std::iter::once([x[column], 0.0]);
        below.into_iter().rev().flatten().chain(middle).chain(above.into_iter().flatten()).collect()
    }
}

/// How the others follow one of the unknowns where χ² is least over them: C_i/C_ii of their covariance; not at all where there is none.
pub(in crate::fit) fn follow(covariance: Option<&DMatrix<f64>>, column: usize) -> Option<DVector<f64>> {
    let covariance = covariance?;
    let variance = covariance[(column, column)];
    (variance > 0.0).then(|| covariance.column(column) / variance)
}

/// One of the unknowns on its way from a point; χ² is least over the others.
pub(in crate::fit) struct Ray<'a> {
    pub slice: &'a Slice<'a>,
    /// The point and its cost.
    pub from: (&'a DVector<f64>, f64),
    /// The least cost there is.
    pub lowest: f64,
    pub column: usize,
    /// How the others follow it to first order, where that is known.
    pub follow: &'a Option<DVector<f64>>,
    /// Up or down.
    pub sign: f64,
    /// To which part of its distance an end is found.
    pub precision: f64,
}

impl Ray<'_> {
    /// The unknown at some distance; exactly at its bound, where that is.
    pub(in crate::fit) fn value(&self, distance: f64) -> f64 {
        let bound = self.bound();
        let value = self.from.0[self.column] + self.sign * distance;
        if self.sign * (bound - value) > 0.0 && distance < self.room() { value } else { bound }
    }

    fn bound(&self) -> f64 {
        let Constraints { lower, upper, .. } = &self.slice.constraints;
        if self.sign > 0.0 { upper[self.column] } else { lower[self.column] }
    }

    /// How far away the bound is.
    fn room(&self) -> f64 {
        (self.sign * (self.bound() - self.from.0[self.column])).max(0.0)
    }

    /// Where the others may be at some distance: on the line through where they are here and at a nearer one; if there is
    /// none, as they follow at first.
    fn expected(&self, trial: f64, (near, at_near): (f64, &DVector<f64>)) -> DVector<f64> {
        if near > 0.0 {
            return self.from.0 + (at_near - self.from.0) * (trial / near);
        }
        match self.follow {
            Some(follow) => self.from.0 + follow * (self.sign * trial),
            None => self.from.0.clone(),
        }
    }

    /// The distance at which √(χ² − χ²_min), nearly a straight line far away, reaches t, or the bound if
    /// it does not; and the lowest cost met. `first`: where to look first.
    pub(in crate::fit) fn reach(&self, t: f64, first: f64) -> Option<(f64, f64)> {
        let risen = |cost: f64| (2.0 * (cost - self.lowest)).max(0.0).sqrt();
        let (mut lowest, limit, start) = (self.from.1, self.room(), risen(self.from.1));
        if limit <= 0.0 || start >= t {
            return Some((0.0, lowest));
        }
        // inside: χ² is less than t² above the minimum; outside: more, or cannot be had
        let (mut inside, mut at_inside) = ((0.0, start), self.from.0.clone());
        let mut outside: Option<(f64, f64)> = None;
        let mut trial = first.min(limit);
        for _ in 0..MAX_TRIALS {
            let start = self.expected(trial, (inside.0, &at_inside));
            let rise = match self.slice.at(&[(self.column, self.value(trial))], &start) {
                Some((x, cost)) => {
                    lowest = lowest.min(cost);
                    let rise = risen(cost);
                    if rise <= t {
                        at_inside = x;
                    }
                    rise
                }
                None => f64::INFINITY,
            };
            if (rise - t).abs() <= self.precision * t {
                return Some((trial, lowest));
            }
            if rise < t {
                if trial >= limit {
                    return Some((limit, lowest));
                }
                inside = (trial, rise);
            } else {
                outside = Some((trial, rise));
            }
            trial = match outside {
                None => ((t / inside.1).clamp(1.05, 3.0) * inside.0).min(limit),
                Some((far, rise)) => {
                    if far - inside.0 <= self.precision * far {
                        // a cliff
                        return Some((inside.0, lowest));
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
