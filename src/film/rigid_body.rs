//! The centre of the circle through points fixed on a body that moves in a plane.

use crate::measurement::track::Sample;
use crate::numerics;

/// Rounds of superposing all frames on their mean shape.
const ROUNDS: usize = 8;

/// Ratio of the circle's radius to the spread of the points above which they lie on one line.
const MAX_RADIUS_RATIO: f64 = 100.0;

/// A place, m.
pub(crate) type Point = [f64; 2];

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
        let (from, to): (Vec<Point>, Vec<Point>) =
            shape.iter().zip(&points).filter_map(|(own, seen)| Some((*own, (*seen)?))).unzip();
        let [x, y] = (to.len() >= 2).then(|| Pose::of(&from, &to).place(centre))?;
        Some(Sample { t, x, y, sd: None })
    });
    Ok(placed.collect())
}

/// Returns the shape of a body: the superposed median of all complete frames; `None` without any.
pub(crate) fn shape(complete: &[Vec<Point>]) -> Option<Vec<Point>> {
    let mut shape = complete.get(complete.len() / 2)?.clone();
    for _ in 0..ROUNDS {
        let mut placed: Vec<Vec<Point>> = vec![Vec::with_capacity(complete.len()); shape.len()];
        for points in complete {
            // back from the frame onto the shape
            let pose = Pose::of(points, &shape);
            for (point, all) in points.iter().zip(&mut placed) {
                all.push(pose.place(*point));
            }
        }
        shape = placed.into_iter().map(|points| median(&points)).collect();
    }
    Some(shape)
}

/// Returns the points of every frame that has any, in the order of time.
pub(crate) fn frames(markers: &[&[Sample]]) -> Vec<(f64, Vec<Option<Point>>)> {
    let mut times: Vec<f64> = markers.iter().flat_map(|samples| samples.iter().map(|s| s.t)).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let at = |samples: &[Sample], t: f64| {
        let i = samples.partition_point(|s| s.t < t);
        samples.get(i).filter(|s| s.t == t).map(|s| [s.x, s.y])
    };
    times.into_iter().map(|t| (t, markers.iter().map(|samples| at(samples, t)).collect())).collect()
}

pub(crate) struct Pose {
    pub(crate) cos: f64,
    pub(crate) sin: f64,
    from: Point,
    to: Point,
}

impl Pose {
    /// Returns the pose that brings the first points nearest to the second.
    pub(crate) fn of(from: &[Point], to: &[Point]) -> Self {
        let (a, b) = (mean(from), mean(to));
        let (mut along, mut across) = (0.0, 0.0);
        for (p, q) in from.iter().zip(to) {
            let ([px, py], [qx, qy]) = ([p[0] - a[0], p[1] - a[1]], [q[0] - b[0], q[1] - b[1]]);
            along += px * qx + py * qy;
            across += px * qy - py * qx;
        }
        let (sin, cos) = across.atan2(along).sin_cos();
        Self { cos, sin, from: a, to: b }
    }

    pub(crate) fn place(&self, point: Point) -> Point {
        let [x, y] = [point[0] - self.from[0], point[1] - self.from[1]];
        [self.to[0] + self.cos * x - self.sin * y, self.to[1] + self.sin * x + self.cos * y]
    }
}

fn mean(points: &[Point]) -> Point {
    let n = points.len() as f64;
    [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / n)
}

/// Returns the median of each coordinate: a frame with mistaken markers does not count.
fn median(points: &[Point]) -> Point {
    [0, 1].map(|k| numerics::median(points.iter().map(|p| p[k]).collect()))
}

/// Returns the centre of the circle nearest to points: |p|² = 2c·p + (R² − |c|²) is linear in its
/// unknowns (Kåsa 1976), and exact for three points.
pub(crate) fn circle(points: &[Point]) -> Option<Point> {
    let m = mean(points);
    let (mut xx, mut xy, mut yy, mut xq, mut yq, mut q_sum) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for p in points {
        let [x, y] = [p[0] - m[0], p[1] - m[1]];
        let q = x * x + y * y;
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
        (xq, yq, q_sum) = (xq + x * q, yq + y * q, q_sum + q);
    }
    let determinant = xx * yy - xy * xy;
    let [x, y] = [0.5 * (xq * yy - yq * xy) / determinant, 0.5 * (yq * xx - xq * xy) / determinant];
    let spread = (q_sum / points.len() as f64).sqrt();
    let found = x.is_finite() && y.is_finite() && x.hypot(y) < MAX_RADIUS_RATIO * spread;
    found.then_some([m[0] + x, m[1] + y])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact but for rounding.
    const SHAPE_ROUNDING: f64 = 1e-12;

    fn markers(count: usize) -> (Vec<Vec<Sample>>, Vec<Point>) {
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
            let found = circle_centres(&slices).unwrap();
            assert_eq!(found.len(), 40);
            for (i, (sample, [x, y])) in found.iter().zip(&centres).enumerate() {
                let off = (sample.x - x).hypot(sample.y - y);
                assert!(off < SHAPE_ROUNDING || i == 7, "{count} markers, frame {i}: {off}");
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
