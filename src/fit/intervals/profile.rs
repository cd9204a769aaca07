//! Intervals from the least-squares problem with some of its unknowns held: a parameter's 95 % interval is where χ², least over all others, is within t² of its minimum. Unlike
//! value ± t·error this knows bounds, kinks and curvature.

use nalgebra::{DMatrix, DVector};

use crate::fit::Status;
use crate::fit::minimum::Minimum;
use crate::fit::slice::Slice;
use crate::fit::uncertainty::Quantiles;
use crate::measurement::parameter::Parameter;
use crate::numerics::least_squares::Bounds;

/// √(χ² − χ²_min) is met to this part at a trial, before the last step along the chord, which leaves a twentieth of it where
/// a profile is bent by 5 %: for an end of an interval…
const END: f64 = 1e-2;
/// …and for the edge of a region that is drawn.
pub(in crate::fit) const EDGE: f64 = 2e-2;

/// √(χ² − χ²_min) that rises by less than this part of what is looked for is taken to rise by this.
const FLAT: f64 = 1e-3;

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
            let follow = follow(self.covariance.as_ref(), column).map(|by| by * sign);
            let lowest = self.minimum.cost;
            let moved = &[(column, sign)];
            let ray = Ray { slice: self.slice, from, lowest, moved, follow, precision: END };
            let reach = ray.reach(t, first)?;
            self.lowest = self.lowest.min(reach.lowest);
            Some(ray.at(reach.distance)[0].1)
        };
        match status {
            Status::Free => end(0, both).and_then(|low| Some([low, end(1, both)?])),
            Status::AtLowerBound => end(1, one).map(|high| [value, high]),
            Status::AtUpperBound => end(0, one).map(|low| [low, value]),
            Status::Fixed | Status::NotIdentified => None,
        }
    }

    /// The part of the 95 % interval of a column about another minimum, `near`; at least the value there.
    pub(in crate::fit) fn around(&self, column: usize, near: &DVector<f64>) -> [f64; 2] {
        /// Where an end is looked for first, as a part of the value, or of one for values near 0.
        const FIRST: f64 = 0.1;
        let value = near[column];
        let Some((x, cost)) = self.slice.at(&[], near) else { return [value; 2] };
        let end = |sign: f64| {
            let moved = &[(column, sign)];
            let lowest = self.minimum.cost;
            let ray =
                Ray { slice: self.slice, from: (&x, cost), lowest, moved, follow: None, precision: END };
            let first = FIRST * value.abs().max(FIRST);
            Some(ray.at(ray.reach(self.quantiles.two_sided, first)?.distance)[0].1)
        };
        let ends = [-1.0, 1.0].map(|sign| end(sign).unwrap_or(value));
        [ends[0].min(value), ends[1].max(value)]
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

/// Some of the unknowns on a straight way from a point; χ² is least over the others.
pub(in crate::fit) struct Ray<'a> {
    pub slice: &'a Slice<'a>,
    /// The point and its cost.
    pub from: (&'a DVector<f64>, f64),
    /// The least cost there is.
    pub lowest: f64,
    /// The unknowns that move, and by how much each for a distance of one.
    pub moved: &'a [(usize, f64)],
    /// How all unknowns move then to first order, where that is known.
    pub follow: Option<DVector<f64>>,
    /// To which part √(χ² − χ²_min) is met.
    pub precision: f64,
}

/// How far an edge is away.
pub(in crate::fit) struct Reach {
    pub distance: f64,
    /// √(χ² − χ²_min) is met at this distance; beyond a bound if it rises on as up to there.
    pub beyond_bounds: f64,
    /// The lowest cost met.
    pub lowest: f64,
}

impl Ray<'_> {
    /// The unknowns that move at some distance; exactly at their bounds, where these are.
    pub(in crate::fit) fn at(&self, distance: f64) -> Vec<(usize, f64)> {
        let value = |&(column, by): &(usize, f64)| {
            let bound = self.bound(column, by);
            let value = self.from.0[column] + by * distance;
            let is_within = by * (bound - value) > 0.0 && distance < self.room_of(column, by);
            (column, if by == 0.0 || is_within { value } else { bound })
        };
        self.moved.iter().map(value).collect()
    }

    fn bound(&self, column: usize, by: f64) -> f64 {
        let Bounds { lower, upper } = &self.slice.bounds;
        if by > 0.0 { upper[column] } else { lower[column] }
    }

    fn room_of(&self, column: usize, by: f64) -> f64 {
        if by == 0.0 {
            return f64::INFINITY;
        }
        ((self.bound(column, by) - self.from.0[column]) / by).max(0.0)
    }

    /// How far away the nearest bound is.
    pub(in crate::fit) fn room(&self) -> f64 {
        self.moved.iter().map(|&(column, by)| self.room_of(column, by)).fold(f64::INFINITY, f64::min)
    }

    /// Where the others may be at some distance: on the line through where they are here and at a nearer one; if there is
    /// none, as they follow at first.
    fn expected(&self, trial: f64, (near, at_near): (f64, &DVector<f64>)) -> DVector<f64> {
        if near > 0.0 {
            return self.from.0 + (at_near - self.from.0) * (trial / near);
        }
        match &self.follow {
            Some(follow) => self.from.0 + follow * trial,
            None => self.from.0.clone(),
        }
    }

    /// Where √(χ² − χ²_min), nearly a straight line far away, reaches t, or the bound if it does not. `first`: where to look
    /// first.
    pub(in crate::fit) fn reach(&self, t: f64, first: f64) -> Option<Reach> {
        let risen = |cost: f64| (2.0 * (cost - self.lowest)).max(0.0).sqrt();
        let (mut lowest, limit, start) = (self.from.1, self.room(), risen(self.from.1));
        let end = |distance: f64, lowest| Some(Reach { distance, beyond_bounds: distance, lowest });
        if limit <= 0.0 || start >= t {
            return end(0.0, lowest);
        }
        // along the chord from where it starts
        let chord = |(distance, rise): (f64, f64)| distance * (t - start) / (rise - start).max(FLAT * t);
        // inside: χ² is less than t² above the minimum; outside: more, or cannot be had
        let (mut inside, mut at_inside) = ((0.0, start), self.from.0.clone());
        let mut outside: Option<(f64, f64)> = None;
        let mut trial = first.min(limit);
        for _ in 0..MAX_TRIALS {
            let start = self.expected(trial, (inside.0, &at_inside));
            let rise = match self.slice.at(&self.at(trial), &start) {
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
                let distance = chord((trial, rise));
                return Some(Reach { distance: distance.min(limit), beyond_bounds: distance, lowest });
            }
            if rise < t {
                inside = (trial, rise);
                if trial >= limit {
                    return Some(Reach { distance: limit, beyond_bounds: chord(inside), lowest });
                }
            } else {
                outside = Some((trial, rise));
            }
            trial = match outside {
                None => ((t / inside.1).clamp(1.05, 3.0) * inside.0).min(limit),
                Some((far, rise)) => {
                    if far - inside.0 <= self.precision * far {
                        // a cliff
                        return end(inside.0, lowest);
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
