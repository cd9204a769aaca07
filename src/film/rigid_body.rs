//! The centre of the circle through points fixed on a body that moves in a plane.

use nalgebra::Complex;

use crate::measurement::track::Sample;
use crate::numerics::median;

/// Rounds of superposing all frames on their mean shape.
const ROUNDS: usize = 8;

/// Ratio of the circle's radius to the spread of the points above which they lie on one line.
const MAX_RADIUS_RATIO: f64 = 100.0;

/// A place x + iy, m.
type Point = Complex<f64>;

/// Returns the centre, in every frame, of a body whose markers stand on a circle about it.
///
/// The shape of the markers is determined from all frames at once, each turned and moved onto their
/// mean (Kabsch, in a plane), and the circle through it by least squares; a frame then needs two
/// markers.
///
/// # Errors
/// The markers are fewer than three, or do not determine a centre.
pub(crate) fn circle_centres(markers: &[&[Sample]]) -> Result<Vec<Sample>, String> {
    if markers.len() < 3 {
        return Err(format!(
            "{} points do not determine the centre of a disc; expected one track of the centre itself, or three \
             or more points on a circle about it",
            markers.len()
        ));
    }
    let frames = frames(markers);
    let complete: Vec<Vec<Point>> =
        frames.iter().filter_map(|(_, points)| points.iter().copied().collect()).collect();
    let Some(shape) = shape(&complete) else {
        return Err("no frame has all points on the disc; expected some that do".to_string());
    };
    let centre = circle(&shape).ok_or_else(|| {
        "the points on the disc are on one line; expected three or more on a circle about its centre"
            .to_string()
    })?;
    let placed = frames.into_iter().filter_map(|(t, points)| {
        let seen = shape.iter().zip(points).filter_map(|(own, seen)| Some((*own, seen?)));
        let (from, to): (Vec<Point>, Vec<Point>) = seen.unzip();
        let place = (to.len() >= 2).then(|| pose(&from, &to)(centre))?;
        Some(Sample::new(t, [place.re, place.im]))
    });
    Ok(placed.collect())
}

/// Returns the shape of a body: the superposed median of all complete frames, so that mistaken
/// markers of one do not count; `None` without any.
fn shape(complete: &[Vec<Point>]) -> Option<Vec<Point>> {
    let mut shape = complete.get(complete.len() / 2)?.clone();
    for _ in 0..ROUNDS {
        let place = |points: &Vec<Point>| points.iter().copied().map(pose(points, &shape)).collect();
        let placed: Vec<Vec<Point>> = complete.iter().map(place).collect();
        let typical = |marker: usize, pick: fn(&Point) -> f64| {
            median(placed.iter().map(|points| pick(&points[marker])).collect())
        };
        shape = (0..shape.len()).map(|i| Point::new(typical(i, |p| p.re), typical(i, |p| p.im))).collect();
    }
    Some(shape)
}

/// Returns the sample of a track at an instant.
pub(crate) fn sample_at(samples: &[Sample], t: f64) -> Option<&Sample> {
    samples.get(samples.partition_point(|s| s.t < t)).filter(|s| s.t == t)
}

/// Returns the points of every frame that has any, in the order of time.
fn frames(markers: &[&[Sample]]) -> Vec<(f64, Vec<Option<Point>>)> {
    let mut times: Vec<f64> = markers.iter().flat_map(|samples| samples.iter().map(|s| s.t)).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let place = |samples: &[Sample], t: f64| sample_at(samples, t).map(|s| Point::new(s.x, s.y));
    times.into_iter().map(|t| (t, markers.iter().map(|samples| place(samples, t)).collect())).collect()
}

/// Returns times and distances of two points, in the frames that have both.
pub(crate) fn distances(a: &[Sample], b: &[Sample]) -> Vec<(f64, f64)> {
    let distance = |a: &Sample| sample_at(b, a.t).map(|b| (a.t, (b.x - a.x).hypot(b.y - a.y)));
    a.iter().filter_map(distance).collect()
}

/// Returns the motion that brings the first points nearest to the second: a turn about their mean
/// by the angle of Σ p̄q, and a shift.
fn pose(from: &[Point], to: &[Point]) -> impl Fn(Point) -> Point + use<> {
    let (a, b) = (mean(from), mean(to));
    let turn: Point = from.iter().zip(to).map(|(p, q)| (p - a).conj() * (q - b)).sum();
    let turn = Point::from_polar(1.0, turn.arg());
    move |point| b + turn * (point - a)
}

fn mean(points: &[Point]) -> Point {
    points.iter().sum::<Point>() / points.len() as f64
}

/// Returns the centre c of the circle nearest to points: |p|² = 2c·p + (R² − |c|²) is linear in its
/// unknowns (Kåsa 1976), and exact for three points. About their mean it is c Σ|p|² + c̄ Σp² =
/// Σ|p|²p.
fn circle(points: &[Point]) -> Option<Point> {
    let middle = mean(points);
    let off = || points.iter().map(|p| p - middle);
    let square: f64 = off().map(|p| p.norm_sqr()).sum();
    let product: Point = off().map(|p| p * p).sum();
    let moment: Point = off().map(|p| p * p.norm_sqr()).sum();
    let centre = (moment * square - product * moment.conj()) / (square * square - product.norm_sqr());
    let spread = (square / points.len() as f64).sqrt();
    (centre.norm() < MAX_RADIUS_RATIO * spread).then(|| middle + centre)
}
