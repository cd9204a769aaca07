//! Confidence regions of pairs of parameters: where χ², least over the others, is so far above its
//! minimum, beside the ellipse that its curvature says.

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, OMatrix, U2, Vector2};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::profile::{EDGE, Ray};
use crate::fit::minimum::Minimum;
use crate::fit::slice::Slice;
use crate::measurement::parameter::Parameter;
use crate::numerics::least_squares::Bounds;

/// The regions that are drawn: they hold the true pair with this probability.
pub const LEVELS: [f64; 2] = [0.68, 0.95];

/// Directions in which the edge of a region is looked for, and where each takes long: with many shots, or where frames are
/// fitted. Between them its distance, in units of the ellipse's, is on a straight line: where that is by 10 % of a circle's
/// cosine, 0.4 % off.
const DIRECTIONS: usize = 48;
const MANY_SHOTS: usize = 1000;
const FEWER_DIRECTIONS: usize = 12;

/// Points of an edge and of an ellipse.
const POINTS: usize = 48;

/// The confidence regions of two parameters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Contour {
    /// The parameters.
    pub parameters: [Parameter; 2],
    /// The estimates.
    pub centre: [f64; 2],
    /// The regions, in the order of [`LEVELS`].
    pub levels: Vec<Level>,
}

/// One confidence region.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// The probability with which the region holds the true pair.
    pub probability: f64,
    /// How far χ² on the edge is above its minimum.
    pub rise: f64,
    /// The edge, a closed polygon within the bounds.
    pub edge: Vec<[f64; 2]>,
    /// The same region if χ² were the parabola that it is at the minimum.
    pub ellipse: Vec<[f64; 2]>,
}

/// Regions of all pairs of free parameters but the ratios of the balls. `estimated_dof`: the degrees of freedom that noise was
/// estimated with.
pub(in crate::fit) fn contours(
    slice: &Slice,
    minimum: &Minimum,
    estimated_dof: Option<usize>,
) -> Vec<Contour> {
    let of_contact = |column: &usize| !slice.free[*column].parameter.is_of_balls();
    let own: Vec<usize> = (0..slice.free.len()).filter(of_contact).collect();
    let after =
        |(i, first): (usize, &usize)| own[i + 1..].iter().map(|second| [*first, *second]).collect::<Vec<_>>();
    let pairs: Vec<[usize; 2]> = own.iter().enumerate().flat_map(after).collect();
    pairs.into_par_iter().filter_map(|pair| contour(slice, minimum, pair, estimated_dof)).collect()
}

/// χ² rises by this on the edge of the region of two parameters.
fn rise(probability: f64, estimated_dof: Option<usize>) -> Option<f64> {
    match estimated_dof {
        None => Some(ChiSquared::new(2.0).ok()?.inverse_cdf(probability)),
        Some(dof) => Some(2.0 * FisherSnedecor::new(2.0, dof as f64).ok()?.inverse_cdf(probability)),
    }
}

fn contour(
    slice: &Slice,
    minimum: &Minimum,
    pair: [usize; 2],
    estimated_dof: Option<usize>,
) -> Option<Contour> {
    let all = minimum.covariance()?;
    let [i, j] = pair;
    let own = Matrix2::new(all[(i, i)], all[(i, j)], all[(j, i)], all[(j, j)]);
    let root = own.cholesky()?.l();
    let centre = pair.map(|column| minimum.x[column]);
    let rises = [rise(LEVELS[0], estimated_dof)?, rise(LEVELS[1], estimated_dof)?];
    let edges = Rays::new(slice, minimum, pair, (&all, own), rises.map(f64::sqrt)).edges()?;
    let level = |((probability, rise), edge): ((f64, f64), _)| {
        let ellipse = (0..POINTS).map(|k| {
            let along = rise.sqrt() * (root * on_circle(k, POINTS));
            [centre[0] + along.x, centre[1] + along.y]
        });
        Level { probability, rise, edge, ellipse: ellipse.collect() }
    };
    let levels = LEVELS.into_iter().zip(rises).zip(edges).map(level).collect();
    Some(Contour { parameters: pair.map(|column| slice.free[column].parameter), centre, levels })
}

/// Returns the regions of two parameters as their covariance has them, within their bounds.
pub(in crate::fit) fn ellipses(
    parameters: [Parameter; 2],
    centre: [f64; 2],
    covariance: &DMatrix<f64>,
    bounds: [[f64; 2]; 2],
) -> Option<Contour> {
    let root = Matrix2::from_fn(|i, j| covariance[(i, j)]).cholesky()?.l();
    let rises = [rise(LEVELS[0], None)?, rise(LEVELS[1], None)?];
    let level = |(probability, rise): (f64, f64)| {
        let point = |k: usize| {
            let along = rise.sqrt() * (root * on_circle(k, POINTS));
            [centre[0] + along.x, centre[1] + along.y]
        };
        let ellipse: Vec<[f64; 2]> = (0..POINTS).map(point).collect();
        let inside = |point: &[f64; 2]| [0, 1].map(|i| point[i].clamp(bounds[i][0], bounds[i][1]));
        Level { probability, rise, edge: ellipse.iter().map(inside).collect(), ellipse }
    };
    Some(Contour { parameters, centre, levels: LEVELS.into_iter().zip(rises).map(level).collect() })
}

fn on_circle(k: usize, count: usize) -> Vector2<f64> {
    let (sin, cos) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
    Vector2::new(cos, sin)
}

/// Rays within a region to its edge.
struct Rays<'a> {
    slice: &'a Slice<'a>,
    lowest: f64,
    pair: [usize; 2],
    /// Where they begin, and the cost there: at the estimate, or where bounds cut the ellipse off, in the middle of what is left.
    from: (DVector<f64>, f64),
    /// From the unit circle to the ellipse of what is left, where √(χ² − χ²_min) is about 1.
    to_ellipse: Matrix2<f64>,
    /// How all unknowns follow the pair.
    follow: Option<OMatrix<f64, Dyn, U2>>,
    /// √(χ² − χ²_min) on the edges of the regions.
    t: [f64; 2],
}

impl<'a> Rays<'a> {
    /// `all`: the covariance, `own`: that of the pair.
    fn new(
        slice: &'a Slice<'a>,
        minimum: &Minimum,
        pair: [usize; 2],
        (all, own): (&DMatrix<f64>, Matrix2<f64>),
        t: [f64; 2],
    ) -> Self {
        // C_·p C_pp⁻¹
        let follow =
            own.try_inverse().map(|inverse| all.select_columns(&pair).fixed_columns::<2>(0) * inverse);
        let Bounds { lower, upper } = &slice.bounds;
        let sides = [0, 1].map(|which| {
            let (value, half) = (minimum.x[pair[which]], t[1] * own[(which, which)].sqrt());
            [lower[pair[which]].max(value - half), upper[pair[which]].min(value + half)]
        });
        let halves = sides.map(|[low, high]| 0.5 * (high - low));
        let left = [0, 1].map(|which| halves[which] / (t[1] * own[(which, which)].sqrt()));
        // the one that is cut off more, and the other, as it follows that and beside it
        let (cut, other) = if left[1] < left[0] - EDGE { (1, 0) } else { (0, 1) };
        let by_cut = own[(other, cut)] / own[(cut, cut)];
        let beside = (own[(other, other)] - by_cut * own[(other, cut)]).max(0.0).sqrt();
        let mut to_ellipse = Matrix2::zeros();
        to_ellipse[(cut, 0)] = halves[cut] / t[1];
        to_ellipse[(other, 0)] = by_cut * halves[cut] / t[1];
        to_ellipse[(other, 1)] = beside.min(halves[other] / t[1]);
        let from = (minimum.x.clone(), minimum.cost);
        let mut rays = Self { slice, lowest: minimum.cost, pair, from, to_ellipse, follow, t };
        let middle = |which: usize| 0.5 * (sides[which][0] + sides[which][1]) - minimum.x[pair[which]];
        let to_middle = Vector2::new(middle(0), middle(1));
        if left[cut] < 1.0 - EDGE {
            let mut shift = to_middle;
            if left[other] >= 1.0 - EDGE {
                shift[other] = by_cut * shift[cut];
            }
            rays.begin_at(shift);
        }
        rays
    }

    /// Begins so far from the estimate, or nearer to it if χ² is too high there.
    fn begin_at(&mut self, shift: Vector2<f64>) {
        const PARTS: [f64; 3] = [1.0, 0.5, 0.25];
        const ENOUGH: f64 = 0.9;
        let below = self.lowest + 0.5 * (ENOUGH * self.t[0]).powi(2);
        let at = |part: f64| {
            let moved = self.moved(part * shift);
            let ray = self.ray(&moved);
            self.slice.at(&ray.at(1.0_f64.min(ray.room())), ray.from.0).filter(|(_, cost)| *cost < below)
        };
        if let Some(found) = PARTS.into_iter().find_map(at) {
            self.from = found;
        }
    }

    fn moved(&self, by: Vector2<f64>) -> [(usize, f64); 2] {
        [(self.pair[0], by.x), (self.pair[1], by.y)]
    }

    fn ray<'b>(&'b self, moved: &'b [(usize, f64); 2]) -> Ray<'b> {
        let follow = self.follow.as_ref().map(|by| by * Vector2::new(moved[0].1, moved[1].1));
        let from = (&self.from.0, self.from.1);
        Ray { slice: self.slice, from, lowest: self.lowest, moved, follow, precision: EDGE }
    }

    /// The edges of the regions.
    fn edges(&self) -> Option<[Vec<[f64; 2]>; 2]> {
        let search = self.slice.search;
        let is_slow = search.count() > MANY_SHOTS || search.is_filmed();
        let count = if is_slow { FEWER_DIRECTIONS } else { DIRECTIONS };
        let distances = |k: usize| {
            let moved = self.moved(self.to_ellipse * on_circle(k, count));
            let ray = self.ray(&moved);
            let [near, far] = self.t;
            let reach = ray.reach(far, far)?.beyond_bounds;
            // bent as further out: r/t − 1 grows with t
            let first = near * (1.0 + (reach / far - 1.0) * near / far);
            Some([ray.reach(near, first.clamp(0.1 * near, 10.0 * near))?.beyond_bounds, reach])
        };
        let distances: Vec<Option<[f64; 2]>> = (0..count).into_par_iter().map(distances).collect();
        let edge = |which: usize| -> Vec<[f64; 2]> {
            let found = |k: usize| distances[k % count].map(|both| both[which]);
            let point = |k: usize| {
                let (before, part) = (k * count / POINTS, (k * count % POINTS) as f64 / POINTS as f64);
                let distance = match (found(before)?, found(before + 1)) {
                    (distance, None) => distance,
                    (distance, Some(next)) => distance + part * (next - distance),
                };
                let moved = self.moved(self.to_ellipse * on_circle(k, POINTS));
                let ray = self.ray(&moved);
                let at = ray.at(distance.min(ray.room()));
                Some([at[0].1, at[1].1])
            };
            (0..POINTS).filter_map(point).collect()
        };
        // a direction that could not be had leaves a straight line; more would leave no shape
        (distances.iter().flatten().count() + 2 >= count).then(|| [edge(0), edge(1)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_of_two_parameters() {
        // −2 ln(1 − p) for χ²(2)
        assert!((rise(0.95, None).unwrap() + 2.0 * 0.05_f64.ln()).abs() < 1e-9);
        assert!((rise(0.68, None).unwrap() + 2.0 * 0.32_f64.ln()).abs() < 1e-9);
        // 2 F(2, 10) at 95 %: scipy.stats.f.ppf(0.95, 2, 10) = 4.102 821
        assert!((rise(0.95, Some(10)).unwrap() - 2.0 * 4.102_821).abs() < 1e-5);
    }
}
