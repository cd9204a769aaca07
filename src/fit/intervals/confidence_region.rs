//! Confidence regions of pairs of parameters: where χ², least over the others, is so far above its
//! minimum, beside the ellipse that its curvature says.

use nalgebra::{DMatrix, Matrix2, Vector2};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::profile::{EDGE, Ray, follow};
use crate::fit::minimum::Minimum;
use crate::fit::slice::Slice;
use crate::measurement::parameter::Parameter;

/// The regions that are drawn: they hold the true pair with this probability.
pub const LEVELS: [f64; 2] = [0.68, 0.95];

/// Strips of a region, and where each takes long: with many shots, or where frames are fitted.
const STRIPS: usize = 25;
const MANY_SHOTS: usize = 1000;
const FEWER_STRIPS: usize = 9;

/// A strip at the end of a region is looked for at this part of the region's width.
const TINY: f64 = 1e-3;

/// Points of an ellipse.
const ELLIPSE: usize = 96;

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

/// Regions of all pairs of free parameters. `estimated_dof`: the degrees of freedom that noise was
/// estimated with.
pub(in crate::fit) fn contours(
    slice: &Slice,
    minimum: &Minimum,
    estimated_dof: Option<usize>,
) -> Vec<Contour> {
    let count = slice.free.len();
    let pairs: Vec<[usize; 2]> = (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j])).collect();
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
    let level = |probability: f64| {
        let rise = rise(probability, estimated_dof)?;
        let t = rise.sqrt();
        let edge = edge(slice, minimum, pair, (&all, &root), t)?;
        let ellipse = (0..ELLIPSE)
            .map(|k| {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / ELLIPSE as f64).sin_cos();
                let along = root * Vector2::new(t * cos, t * sin);
                [centre[0] + along.x, centre[1] + along.y]
            })
            .collect();
        Some(Level { probability, rise, edge, ellipse })
    };
    let levels: Option<Vec<Level>> = LEVELS.into_par_iter().map(level).collect();
    Some(Contour { parameters: pair.map(|column| slice.free[column].parameter), centre, levels: levels? })
}

/// The region of the pair in strips: for values of the first parameter the ends of the second. `all`: the covariance;
/// `root`: a root of that of the pair.
fn edge(
    slice: &Slice,
    minimum: &Minimum,
    [i, j]: [usize; 2],
    (all, root): (&DMatrix<f64>, &Matrix2<f64>),
    t: f64,
) -> Option<Vec<[f64; 2]>> {
    let from = (&minimum.x, minimum.cost);
    let by_first = follow(Some(all), i);
    // …with the first held
    let by_second = by_first.as_ref().and_then(|first| {
        let column = all.column(j) - first * all[(i, j)];
        (column[j] > 0.0).then(|| &column / column[j])
    });
    let end = |sign: f64| {
        let ray =
            Ray { slice, from, lowest: minimum.cost, column: i, follow: &by_first, sign, precision: EDGE };
        Some(ray.value(ray.reach(t, t * root[(0, 0)])?.0))
    };
    let (low, high) = (end(-1.0)?, end(1.0)?);
    let search = slice.search;
    let strips = if search.count() > MANY_SHOTS || search.is_filmed() { FEWER_STRIPS } else { STRIPS };
    let strip = |k: usize| {
        // closer at the ends, where the region is round
        let part = 0.5 * (1.0 - (std::f64::consts::PI * k as f64 / (strips - 1) as f64).cos());
        let first = if k + 1 == strips { high } else { low + part * (high - low) };
        let start = match &by_first {
            Some(follow) => &minimum.x + follow * (first - minimum.x[i]),
            None => minimum.x.clone(),
        };
        let (x, cost) = slice.at(&[(i, first)], &start)?;
        let held = slice.holding(&[(i, first)]);
        let left = (t * t - 2.0 * (cost - minimum.cost)).max(0.0).sqrt();
        let end = |sign: f64| {
            let ray = Ray {
                slice: &held,
                from: (&x, cost),
                lowest: minimum.cost,
                column: j,
                follow: &by_second,
                sign,
                precision: EDGE,
            };
            Some(ray.value(ray.reach(t, (left * root[(1, 1)]).max(TINY * t * root[(1, 1)]))?.0))
        };
        Some([[first, end(-1.0)?], [first, end(1.0)?]])
    };
    let all: Vec<[[f64; 2]; 2]> = (0..strips).into_par_iter().filter_map(strip).collect();
    // a strip that could not be had leaves a straight line; more would leave no shape
    if all.len() + 2 < strips {
        return None;
    }
    let lower = all.iter().map(|strip| strip[0]);
    Some(lower.chain(all.iter().rev().map(|strip| strip[1])).collect())
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
