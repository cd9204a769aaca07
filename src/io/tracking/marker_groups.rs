//! Groups of tracked points on one rigid body, by the distances that they keep.

use crate::film::rigid_body::circle_centres;
use crate::measurement::track::Sample;
use crate::numerics::median;

/// Largest relative change of the distance of two points on one body. Points of one puck change
/// theirs by up to 0.035 (calibration, and tape that is seen from another side; 0.16 while a hand
/// holds the puck), points of two by 0.8 and more (30 films of two pucks, Chalmers 2023).
const MAX_CHANGE: f64 = 0.25;

/// Number of frames of a median distance, so that a frame with two mistaken markers does not count.
const MEDIAN_FRAMES: usize = 5;

/// Time on either side over which a path's bend is measured: the film over this, up to a maximum.
const REACH_PART: usize = 8;
const MAX_REACH: usize = 60;

/// Ratio of the bends of two points on a turning disc at which the straighter one may be the
/// centre. Noise alone exceeds it in a twentieth of the frames, either way.
const MIN_BEND_RATIO: f64 = 5.0;

/// Least excess of frames in which the centre's path is the straighter one, as a part of all.
const MIN_EXCESS: f64 = 0.25;

/// Largest relative difference of the centre's distances to markers, which are placed by hand.
const MAX_INEQUALITY: f64 = 0.1;

/// Returns groups of points of which every two keep their distance, the most rigid joined first.
pub(crate) fn rigid_groups(points: &[&[Sample]]) -> Vec<Vec<usize>> {
    let mut changes = Vec::new();
    for i in 0..points.len() {
        for j in 0..i {
            changes.push((change(points[i], points[j]), i, j));
        }
    }
    changes.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_rigid = |i: usize, j: usize| {
        let of_pair = |(_, a, b): &&(f64, usize, usize)| (*a, *b) == (i.max(j), i.min(j));
        changes.iter().find(of_pair).is_some_and(|(change, ..)| *change <= MAX_CHANGE)
    };
    let mut groups: Vec<Vec<usize>> = (0..points.len()).map(|i| vec![i]).collect();
    for (_, i, j) in changes.iter().take_while(|(change, ..)| *change <= MAX_CHANGE) {
        let at = |point: &usize| groups.iter().position(|group| group.contains(point));
        let (Some(a), Some(b)) = (at(i), at(j)) else { continue };
        if a != b && groups[a].iter().all(|p| groups[b].iter().all(|q| is_rigid(*p, *q))) {
            let (into, from) = (a.min(b), a.max(b));
            let mut joined = groups.remove(from);
            groups[into].append(&mut joined);
            groups[into].sort_unstable();
        }
    }
    groups
}

/// Returns the positions of two points in the frames that have both.
fn together<'a>(one: &'a [Sample], other: &'a [Sample]) -> impl Iterator<Item = [&'a Sample; 2]> {
    let at = |t: f64| other.get(other.partition_point(|s| s.t < t)).filter(|s| s.t == t);
    one.iter().filter_map(move |sample| Some([sample, at(sample.t)?]))
}

fn distances(one: &[Sample], other: &[Sample]) -> Vec<f64> {
    together(one, other).map(|[a, b]| (a.x - b.x).hypot(a.y - b.y)).collect()
}

/// Returns the relative change of the distance of two points; infinite for too few common frames.
fn change(one: &[Sample], other: &[Sample]) -> f64 {
    let distances = distances(one, other);
    let mut smooth: Vec<f64> =
        distances.windows(MEDIAN_FRAMES).map(|window| median(window.to_vec())).collect();
    if smooth.is_empty() {
        return f64::INFINITY;
    }
    smooth.sort_by(f64::total_cmp);
    (smooth[smooth.len() - 1] - smooth[0]) / smooth[smooth.len() / 2].max(f64::MIN_POSITIVE)
}

/// The index of the point at the centre of a disc, `None` if all are on a circle about it. `Err`:
/// the points that may be the centre, if the disc does not turn enough.
pub(crate) type Centre = Result<Option<usize>, Vec<usize>>;

/// Returns the centre of the points on a disc: only the centre moves straight while the disc turns.
pub(crate) fn central(points: &[&[Sample]]) -> Centre {
    let Ok(circle) = circle_centres(points) else { return Ok(None) };
    let is_like_centre = |i: &usize| {
        let others = (0..points.len()).filter(|j| j != i).map(|j| distance(points[*i], points[j]));
        let (least, most) = others.fold((f64::INFINITY, 0.0_f64), |(a, b), d| (a.min(d), b.max(d)));
        most <= (1.0 + MAX_INEQUALITY) * least
    };
    let like_centre: Vec<usize> = (0..points.len()).filter(is_like_centre).collect();
    let sureness = like_centre.iter().map(|i| (straighter(points[*i], &circle), *i));
    match sureness.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((sure, i)) if sure > MIN_EXCESS => Ok(Some(i)),
        // only one point can be the centre; points on the rim may have equal distances
        Some((sure, i)) if like_centre.len() == 1 && sure > -MIN_EXCESS => Err(vec![i]),
        _ => Ok(None),
    }
}

/// Returns the median distance of two points.
fn distance(one: &[Sample], other: &[Sample]) -> f64 {
    let all = distances(one, other);
    if all.is_empty() { f64::INFINITY } else { median(all) }
}

/// Returns the excess of frames in which the first path is the straighter one, as a part of all.
fn straighter(one: &[Sample], other: &[Sample]) -> f64 {
    let both: Vec<[&Sample; 2]> = together(one, other).collect();
    let reach = (both.len() / REACH_PART).clamp(1, MAX_REACH);
    let bend = |[a, b, c]: [&Sample; 3]| (0.5 * (a.x + c.x) - b.x).hypot(0.5 * (a.y + c.y) - b.y);
    let (mut more, mut all) = (0.0, 0.0);
    for window in both.windows(2 * reach + 1) {
        let [one, other] = [0, 1].map(|k| bend([window[0][k], window[reach][k], window[2 * reach][k]]));
        all += 1.0;
        more += f64::from(i8::from(other > MIN_BEND_RATIO * one) - i8::from(one > MIN_BEND_RATIO * other));
    }
    if all > 0.0 { more / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on two turning discs, alternately on one and the other; the second is hit half-way.
    fn film(rate: f64, on: &[(f64, f64)]) -> Vec<Vec<Sample>> {
        let mut points = vec![Vec::new(); 2 * on.len()];
        for frame in 0..400 {
            let t = f64::from(frame) * 0.002;
            let late = (t - 0.4).max(0.0);
            let centres = [[0.4 * t - 0.25 * late, 0.0], [0.21 + 0.25 * late, 0.05 * late]];
            for (i, point) in points.iter_mut().enumerate() {
                let (radius, angle) = on[i / 2];
                let (sin, cos) = (angle + rate * t * [1.0, -1.5][i % 2]).sin_cos();
                let [x, y] = centres[i % 2];
                // in one frame, markers are mistaken for each other
                let wrong = if frame == 150 && i < 2 { 0.1 } else { 0.0 };
                point.push(Sample { t, x: x + radius * cos + wrong, y: y + radius * sin, sd: None });
            }
        }
        points
    }

    fn slices(points: &[Vec<Sample>]) -> Vec<&[Sample]> {
        points.iter().map(Vec::as_slice).collect()
    }

    #[test]
    fn points_are_grouped_by_the_distances_that_they_keep() {
        for rate in [0.0, 8.0] {
            let mut points = film(rate, &[(0.023, 0.0), (0.023, 1.7), (0.023, 3.9)]);
            assert_eq!(rigid_groups(&slices(&points)), [vec![0, 2, 4], vec![1, 3, 5]]);
            // a seventh point on neither disc, and one that is never seen
            points.push(
                (0..400).map(|i| Sample { t: f64::from(i) * 0.002, x: 0.3, y: 0.1, sd: None }).collect(),
            );
            points.push(Vec::new());
            assert_eq!(rigid_groups(&slices(&points)), [vec![0, 2, 4], vec![1, 3, 5], vec![6], vec![7]]);
        }
    }

    #[test]
    fn a_centre_moves_straight_while_the_disc_turns() {
        // rim only; centre and two on the rim; centre and three; three at equal distances
        for (on, expected) in [
            (vec![(0.023, 0.0), (0.023, 1.7), (0.023, 3.9)], None),
            (vec![(0.02, 0.0), (0.0, 0.0), (0.02, 1.6)], Some(1)),
            (vec![(0.02, 0.0), (0.0, 0.0), (0.02, 1.6), (0.02, 3.0)], Some(1)),
            (vec![(0.02, 0.0), (0.02, 2.094_395), (0.02, 4.188_790)], None),
        ] {
            let points = film(6.0, &on);
            let one: Vec<&[Sample]> = points.iter().step_by(2).map(Vec::as_slice).collect();
            assert_eq!(central(&one), Ok(expected), "{on:?}");
        }
        // without rotation, the centre is ambiguous
        let points = film(0.0, &[(0.02, 0.0), (0.0, 0.0), (0.02, 1.6)]);
        let one: Vec<&[Sample]> = points.iter().step_by(2).map(Vec::as_slice).collect();
        assert_eq!(central(&one), Err(vec![1]));
    }
}
