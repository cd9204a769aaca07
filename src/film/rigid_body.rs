//! The centre of the circle through points fixed on a body that moves in a plane.

use nalgebra::{Isometry2, Matrix2, Point2, UnitComplex, Vector2};

use crate::measurement::track::Sample;
use crate::numerics::median;

/// Rounds of superposing all frames on their mean shape.
const ROUNDS: usize = 8;

/// Ratio of the circle's radius to the spread of the points above which they lie on one line.
const MAX_RADIUS_RATIO: f64 = 100.0;

/// A place, m.
type Point = Point2<f64>;

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
    let whole = |points: &Vec<Option<[f64; 2]>>| points.iter().map(|p| p.map(Point::from)).collect();
    let complete: Vec<Vec<Point>> = frames.iter().filter_map(|(_, points)| whole(points)).collect();
    let Some(shape) = shape(&complete) else {
        return Err("no frame has all points on the disc; expected some that do".to_string());
    };
    let centre = circle(&shape).ok_or_else(|| {
        "the points on the disc are on one line; expected three or more on a circle about its centre"
            .to_string()
    })?;
    let placed = frames.into_iter().filter_map(|(t, points)| {
        let seen = shape.iter().zip(points).filter_map(|(own, seen)| Some((*own, Point::from(seen?))));
        let (from, to): (Vec<Point>, Vec<Point>) = seen.unzip();
        let place = (to.len() >= 2).then(|| pose(&from, &to) * centre)?;
        Some(Sample::new(t, place.into()))
    });
    Ok(placed.collect())
}

/// Returns the shape of a body: the superposed median of all complete frames, so that mistaken
/// markers of one do not count; `None` without any.
fn shape(complete: &[Vec<Point>]) -> Option<Vec<Point>> {
    let mut shape = complete.get(complete.len() / 2)?.clone();
    for _ in 0..ROUNDS {
        let placed: Vec<Vec<Point>> = complete
            .iter()
            .map(|points| {
                let pose = pose(points, &shape);
                points.iter().map(|point| pose * point).collect()
            })
            .collect();
        let typical = |marker: usize, axis: usize| median(placed.iter().map(|p| p[marker][axis]).collect());
        shape = (0..shape.len()).map(|marker| Point::new(typical(marker, 0), typical(marker, 1))).collect();
    }
    Some(shape)
}

/// Returns the points of every frame that has any, in the order of time.
pub(crate) fn frames(markers: &[&[Sample]]) -> Vec<(f64, Vec<Option<[f64; 2]>>)> {
    let mut times: Vec<f64> = markers.iter().flat_map(|samples| samples.iter().map(|s| s.t)).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let at = |samples: &[Sample], t: f64| {
        let i = samples.partition_point(|s| s.t < t);
        samples.get(i).filter(|s| s.t == t).map(|s| [s.x, s.y])
    };
    times.into_iter().map(|t| (t, markers.iter().map(|samples| at(samples, t)).collect())).collect()
}

/// Returns times and distances of two points, in the frames that have both.
pub(crate) fn distances(a: &[Sample], b: &[Sample]) -> Vec<(f64, f64)> {
    let distance = |(time, places): (f64, Vec<Option<[f64; 2]>>)| match places[..] {
        [Some([x, y]), Some([u, v])] => Some((time, (u - x).hypot(v - y))),
        _ => None,
    };
    frames(&[a, b]).into_iter().filter_map(distance).collect()
}

/// Returns the motion that brings the first points nearest to the second.
fn pose(from: &[Point], to: &[Point]) -> Isometry2<f64> {
    let (a, b) = (mean(from), mean(to));
    let (mut along, mut across) = (0.0, 0.0);
    for (p, q) in from.iter().zip(to) {
        let (p, q) = (p.coords - a, q.coords - b);
        along += p.dot(&q);
        across += p.perp(&q);
    }
    let turn = UnitComplex::new(across.atan2(along));
    Isometry2::from_parts((b - turn * a).into(), turn)
}

fn mean(points: &[Point]) -> Vector2<f64> {
    points.iter().map(|p| p.coords).sum::<Vector2<f64>>() / points.len() as f64
}

/// Returns the centre of the circle nearest to points: |p|² = 2c·p + (R² − |c|²) is linear in its
/// unknowns (Kåsa 1976), and exact for three points.
fn circle(points: &[Point]) -> Option<Point> {
    let middle = mean(points);
    let off = || points.iter().map(|p| p.coords - middle);
    let normal: Matrix2<f64> = off().map(|p| p * p.transpose()).sum();
    let moments: Vector2<f64> = off().map(|p| p * p.norm_squared()).sum();
    let centre = normal.try_inverse()? * moments * 0.5;
    let spread = (normal.trace() / points.len() as f64).sqrt();
    (centre.norm() < MAX_RADIUS_RATIO * spread).then(|| Point::from(middle + centre))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::EXACT;

    fn markers(count: usize) -> (Vec<Vec<Sample>>, Vec<[f64; 2]>) {
        let mut markers = vec![Vec::new(); count];
        let mut centres = Vec::new();
        for frame in 0..40 {
            let t = frame as f64 * 0.002;
            let (angle, centre) = (20.0 * t, [0.3 + 0.5 * t, 0.2 - 0.8 * t]);
            for (i, samples) in markers.iter_mut().enumerate() {
                let (sin, cos) = (angle + 1.9 * i as f64).sin_cos();
                let wrong = if frame == 7 && i == 1 { 0.1 } else { 0.0 };
                if (frame + i) % 9 != 0 {
                    let (x, y) = (centre[0] + 0.023 * cos + wrong, centre[1] + 0.023 * sin);
                    samples.push(Sample { t, x, y, sd: None });
                }
            }
            centres.push(centre);
        }
        (markers, centres)
    }

    #[test]
    fn the_centre_is_found_from_turning_markers_with_gaps() {
        for count in [3, 5] {
            let (markers, centres) = markers(count);
            let slices: Vec<_> = markers.iter().map(Vec::as_slice).collect();
            let placed = circle_centres(&slices).unwrap();
            assert_eq!(placed.len(), 40);
            for (i, (sample, [x, y])) in placed.iter().zip(&centres).enumerate() {
                let off = (sample.x - x).hypot(sample.y - y);
                assert!(off < EXACT || i == 7, "{count} markers, frame {i}: {off}");
            }
        }
    }

    #[test]
    fn what_has_no_centre_is_refused() {
        let (markers, _) = markers(3);
        let two: Vec<_> = markers.iter().take(2).map(Vec::as_slice).collect();
        assert!(circle_centres(&two).unwrap_err().contains("three"));
        let line: Vec<Vec<Sample>> = (0..3)
            .map(|i| vec![Sample { t: 0.0, x: f64::from(i), y: 2.0 * f64::from(i), sd: None }])
            .collect();
        let line: Vec<_> = line.iter().map(Vec::as_slice).collect();
        assert!(circle_centres(&line).unwrap_err().contains("one line"));
    }
}
