//! How far apart the points on two discs are when the discs hit each other.

use std::ops::Range;

use crate::film::rigid_body::{Point, Pose, circle, frames, shape};
use crate::measurement::track::Sample;
use crate::numerics::median;

/// Paths are taken for straight in so many frames before and after an impact, and in no fewer.
const REACH: usize = 16;
const LEAST_FRAMES: usize = 6;

/// A frame in which points are off the shape of their disc by so many times the median has points mistaken for each other.
const MISTAKEN: f64 = 8.0;

/// So many points on a disc have 120 orders, which are all tried.
const MOST_POINTS: usize = 5;

/// What a shot shows of the points on two discs.
pub(crate) struct Contact {
    /// How the points of either disc stand.
    pub shapes: [Vec<Point>; 2],
    /// How far apart the discs are at the impact, by the point that is the centre of the first and that of the second; behind the points of
    /// each stands the centre of the circle through them, which is not a number where they are on a line.
    pub apart: Vec<Vec<f64>>,
}

impl Contact {
    pub(crate) fn of(discs: [&[&[Sample]]; 2]) -> Option<Self> {
        if discs.iter().any(|points| !(3..=MOST_POINTS).contains(&points.len())) {
            return None;
        }
        let complete = |(t, points): (f64, Vec<Option<Point>>)| {
            let points: Vec<Point> = points.into_iter().collect::<Option<_>>()?;
            let (first, second) = points.split_at(discs[0].len());
            Some((t, [first.to_vec(), second.to_vec()]))
        };
        let seen: Vec<(f64, [Vec<Point>; 2])> =
            frames(&discs.concat()).into_iter().filter_map(complete).collect();
        let of_disc = |k: usize| seen.iter().map(|(_, points)| points[k].clone()).collect::<Vec<_>>();
        let shapes = [shape(&of_disc(0))?, shape(&of_disc(1))?];
        let off = |k: usize, points: &[Point]| misfit(&shapes[k], points);
        let usual = [0, 1].map(|k| median(seen.iter().map(|(_, points)| off(k, &points[k])).collect()));
        let good: Vec<_> = seen
            .iter()
            .filter(|(_, points)| [0, 1].iter().all(|k| off(*k, &points[*k]) <= MISTAKEN * usual[*k]))
            .collect();
        // the mean of the points last
        let paths = [0, 1].map(|k| {
            let shape = &shapes[k];
            let middle = [0, 1].map(|c| shape.iter().map(|p| p[c]).sum::<f64>() / shape.len() as f64);
            let places = shape.iter().copied().chain([circle(shape).unwrap_or([f64::NAN; 2]), middle]);
            let path = |place: Point| {
                good.iter().map(|(t, points)| (*t, Pose::of(shape, &points[k]).place(place))).collect()
            };
            places.map(path).collect::<Vec<Vec<(f64, Point)>>>()
        });
        let sides = around_impact([0, 1].map(|k| paths[k].last().map(Vec::as_slice).unwrap_or_default()))?;
        let lines = paths.map(|mut paths| {
            paths.pop();
            paths.iter().map(|path| sides.clone().map(|side| line(&path[side]))).collect::<Vec<_>>()
        });
        let apart = lines[0].iter().map(|a| lines[1].iter().map(|b| meeting([*a, *b]).1).collect()).collect();
        Some(Self { shapes, apart })
    }
}

/// Place at time 0 and velocity of the straight line nearest to a path.
type Line = [Point; 2];

fn line(path: &[(f64, Point)]) -> Line {
    let n = path.len() as f64;
    let middle = path.iter().map(|(t, _)| t).sum::<f64>() / n;
    let spread: f64 = path.iter().map(|(t, _)| (t - middle).powi(2)).sum();
    let velocity = [0, 1].map(|k| path.iter().map(|(t, p)| (t - middle) * p[k]).sum::<f64>() / spread);
    [[0, 1].map(|k| path.iter().map(|(_, p)| p[k]).sum::<f64>() / n - velocity[k] * middle), velocity]
}

/// When the paths of two discs before an impact are nearest to those after it, and how far apart the discs then are.
fn meeting(discs: [[Line; 2]; 2]) -> (f64, f64) {
    let (mut product, mut square) = (0.0, 0.0);
    for [before, after] in &discs {
        for k in 0..2 {
            let (gap, change) = (after[0][k] - before[0][k], after[1][k] - before[1][k]);
            (product, square) = (product + gap * change, square + change * change);
        }
    }
    let t = -product / square;
    let [one, other] = discs
        .map(|lines| [0, 1].map(|k| 0.5 * lines.iter().map(|line| line[0][k] + line[1][k] * t).sum::<f64>()));
    (t, (one[0] - other[0]).hypot(one[1] - other[1]))
}

/// The frames just before and after the impact, without those next to it: there both discs change their velocities most.
fn around_impact(paths: [&[(f64, Point)]; 2]) -> Option<[Range<usize>; 2]> {
    let n = paths[0].len();
    let reach = REACH.min(n / 4);
    if reach < LEAST_FRAMES {
        return None;
    }
    let change = |i: usize| {
        let of = |path: &[(f64, Point)]| {
            let [a, b] = [&path[i - reach..i], &path[i..i + reach]].map(|side| line(side)[1]);
            (a[0] - b[0]).hypot(a[1] - b[1])
        };
        of(paths[0]).min(of(paths[1]))
    };
    let changes = (reach..=n - reach).map(|i| (change(i), i));
    let (_, first) = changes.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let sides =
        |i: usize| [i.saturating_sub(reach + 1)..i.saturating_sub(1), (i + 1).min(n)..(i + 1 + reach).min(n)];
    let (t, _) = meeting(paths.map(|path| sides(first).map(|side| line(&path[side]))));
    let found = sides(paths[0].partition_point(|(time, _)| *time < t));
    found.iter().all(|side| side.len() >= LEAST_FRAMES).then_some(found)
}

/// By how much points are off others, turned and moved onto them, as a part of their distance from their mean.
pub(crate) fn misfit(own: &[Point], others: &[Point]) -> f64 {
    let pose = Pose::of(own, others);
    let n = own.len() as f64;
    let middle = [0, 1].map(|k| others.iter().map(|p| p[k]).sum::<f64>() / n);
    let square = |a: Point, b: Point| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    let off: f64 = own.iter().zip(others).map(|(p, q)| square(pose.place(*p), *q)).sum();
    (off / others.iter().map(|p| square(*p, middle)).sum::<f64>()).sqrt()
}
