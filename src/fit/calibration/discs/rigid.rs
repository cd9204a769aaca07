//! Points on one disc keep their distances, wherever in the picture it is.
//!
//! A frame of n points is turned and shifted back onto the shape of the disc (Kabsch, in a plane), which takes three of its 2n
//! numbers; what is left is independent noise in the other 2n − 3 directions, whatever n is. The shape is the mean of its frames.

use std::collections::BTreeMap;

use super::sums::{Row, Sums, derivatives, repeated};
use crate::film::camera::Camera;
use crate::film::discs::{DISCS, centre, points, velocity};
use crate::film::rigid_body::{Point, Pose, frames, shape};
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;

/// Frames with the same points that tell a shape and its noise.
const LEAST: usize = 16;

/// A frame is wrong where it is off by this many times the median.
const OUTLIER: f64 = 5.0;

/// Points whose distances change by less than this part of them are computed and not seen: they stand for an angle.
const COMPUTED: f64 = 1e-7;

/// More points than this on one disc are not told apart in a frame.
const MOST: usize = 64;

/// What the points on both discs tell between two times; `of_points`: of each disc, whether its centre was computed from its points.
pub(super) fn rigid(shot: &TrackShot, camera: &Camera, of_points: [bool; 2], window: [f64; 2]) -> Sums {
    let mut sums = Sums::zero();
    for (disc, of_points) in DISCS.into_iter().zip(of_points) {
        let mut all = points(shot, disc);
        if !of_points {
            all.push(centre(shot, disc));
        }
        if !(2..=MOST).contains(&all.len()) {
            continue;
        }
        // frames that miss a point have a shape of their own
        let mut alike: BTreeMap<u64, Vec<(f64, Vec<Point>)>> = BTreeMap::new();
        for (t, seen) in frames(&all) {
            if t < window[0] || t > window[1] {
                continue;
            }
            let which = seen.iter().enumerate().map(|(i, p)| u64::from(p.is_some()) << i).sum();
            alike.entry(which).or_default().push((t, seen.into_iter().flatten().collect()));
        }
        for frames in alike.values().filter(|frames| frames.len() >= LEAST && frames[0].1.len() > 1) {
            if let Some(own) = of_frames(frames, camera) {
                sums.add_all(&own);
            }
        }
    }
    sums
}

/// What frames with the same points tell.
fn of_frames(frames: &[(f64, Vec<Point>)], camera: &Camera) -> Option<Sums> {
    let placed: Vec<Vec<Point>> = frames.iter().map(|(_, points)| points.clone()).collect();
    let shape = shape(&placed)?;
    let size = shape.iter().map(|p| (p[0] - shape[0][0]).hypot(p[1] - shape[0][1])).fold(0.0, f64::max);
    let count = shape.len();
    // where the points are, without the noise that bends the shape
    let poses: Vec<Pose> = placed.iter().map(|points| Pose::of(&shape, points)).collect();
    let paths: Vec<Vec<Sample>> = (0..count)
        .map(|i| {
            let at = |((t, _), pose): (&(f64, Vec<Point>), &Pose)| Sample::new(*t, pose.place(shape[i]));
            frames.iter().zip(&poses).map(at).collect()
        })
        .collect();
    let left: Vec<Vec<f64>> = placed
        .iter()
        .map(|points| {
            let back = Pose::of(points, &shape);
            let off = |(own, seen): (&Point, &Point)| {
                let [x, y] = back.place(*seen);
                [x - own[0], y - own[1]]
            };
            shape.iter().zip(points).flat_map(off).collect()
        })
        .collect();
    let sizes: Vec<f64> = left.iter().map(|left| left.iter().map(|r| r * r).sum::<f64>().sqrt()).collect();
    let usual = median(sizes.clone());
    if !(usual > COMPUTED * size) {
        return None;
    }
    let good: Vec<usize> = (0..frames.len()).filter(|i| sizes[*i] <= OUTLIER * usual).collect();
    let by: Vec<Vec<Row>> = good.iter().map(|i| bent(camera, &shape, &poses[*i], &paths, *i)).collect();
    let n = good.len() as f64;
    let mean_left: Vec<f64> =
        (0..2 * count).map(|k| good.iter().map(|i| left[*i][k]).sum::<f64>() / n).collect();
    let mean_by: Vec<Row> = (0..2 * count).map(|k| by.iter().map(|by| by[k]).sum::<Row>() / n).collect();
    let off: Vec<Vec<f64>> =
        (0..2 * count).map(|k| good.iter().map(|i| left[*i][k] - mean_left[k]).collect()).collect();
    let square = off.iter().flatten().map(|r| r * r).sum::<f64>() / ((n - 1.0) * (2 * count - 3) as f64);
    let weight = 1.0 / (square * repeated(off.iter().map(Vec::as_slice)));
    let mut sums = Sums::zero();
    for (frame, by) in by.iter().enumerate() {
        for k in 0..2 * count {
            sums.add(&(by[k] - mean_by[k]), off[k][frame], weight);
        }
    }
    Some(sums)
}

/// How a frame, turned back onto the shape, follows the corrections, without what moves and turns it as a whole.
fn bent(camera: &Camera, shape: &[Point], pose: &Pose, paths: &[Vec<Sample>], frame: usize) -> Vec<Row> {
    let count = shape.len();
    let n = count as f64;
    let mut by = Vec::with_capacity(2 * count);
    for path in paths {
        let at = path[frame];
        let [x, y] = derivatives(camera, [at.x, at.y], velocity(path, frame));
        by.push(x * pose.cos + y * pose.sin);
        by.push(y * pose.cos - x * pose.sin);
    }
    let middle = [0, 1].map(|k| shape.iter().map(|p| p[k]).sum::<f64>() / n);
    let mut turn = Vec::with_capacity(2 * count);
    for p in shape {
        turn.extend([middle[1] - p[1], p[0] - middle[0]]);
    }
    let spread = turn.iter().map(|t| t * t).sum::<f64>();
    let turned = by.iter().zip(&turn).map(|(by, t)| by * *t).sum::<Row>() / spread;
    let mean = [0, 1].map(|axis| by.iter().skip(axis).step_by(2).sum::<Row>() / n);
    by.iter().enumerate().map(|(k, by)| by - mean[k % 2] - turned * turn[k]).collect()
}
