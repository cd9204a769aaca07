//! Points followed in a film, grouped into the rigid bodies that they are on, by the distances that they keep.

use super::rigid_body::circle_centres;
use super::track::Sample;
use crate::numerics::median;

/// Two points are on one body where their distance changes by at most this part of its median. Points of one puck change theirs by
/// up to 0.035 (calibration, and tape that is seen from another side; 0.16 while a hand holds the puck), points of two by 0.8 and
/// more (30 films of two pucks, Chalmers 2023).
const RIGID: f64 = 0.25;

/// A distance is the median over so many frames, so that a frame with two markers mistaken for each other does not count.
const FRAMES: usize = 5;

/// A path is bent where it is off the middle between its points before and after: this part of the film before and after, but at most
/// so many frames.
const REACH: usize = 8;
const MOST: usize = 60;

/// Of two points on a disc that turns, the centre's path is this many times straighter in most frames. Noise alone makes it so in a
/// twentieth of the frames, either way.
const STRAIGHTER: f64 = 5.0;

/// In so many more frames, as a part of all, is the path of the centre the straighter one. In a collision both are bent.
const SURE: f64 = 0.25;

/// A point may be the centre where its distances to the others differ by at most this part: markers are put on by hand.
const EQUAL: f64 = 0.1;

/// Groups of points of which every two keep their distance. Those nearest to rigid are joined first.
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
        changes.iter().find(of_pair).is_some_and(|(change, ..)| *change <= RIGID)
    };
    let mut groups: Vec<Vec<usize>> = (0..points.len()).map(|i| vec![i]).collect();
    for (_, i, j) in changes.iter().take_while(|(change, ..)| *change <= RIGID) {
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

/// How much the distance of two points changes, over its median; infinite where they are hardly ever seen together.
fn change(one: &[Sample], other: &[Sample]) -> f64 {
    let at = |t: f64| other.get(other.partition_point(|s| s.t < t)).filter(|s| s.t == t);
    let distances: Vec<f64> =
        one.iter().filter_map(|s| at(s.t).map(|o| (s.x - o.x).hypot(s.y - o.y))).collect();
    let mut smooth: Vec<f64> = distances.windows(FRAMES).map(|window| median(window.to_vec())).collect();
    if smooth.is_empty() {
        return f64::INFINITY;
    }
    smooth.sort_by(f64::total_cmp);
    (smooth[smooth.len() - 1] - smooth[0]) / smooth[smooth.len() / 2].max(f64::MIN_POSITIVE)
}

/// Which of the points on a disc is its centre, `None` where all are on a circle about it. Only a centre moves straight on while the
/// disc turns.
///
/// # Errors
/// A point that may be the centre or not, since the disc does not turn enough to tell.
pub(crate) fn central(points: &[&[Sample]]) -> Result<Option<usize>, usize> {
    let Ok(circle) = circle_centres(points) else { return Ok(None) };
    let is_like_centre = |i: &usize| {
        let others = (0..points.len()).filter(|j| j != i).map(|j| distance(points[*i], points[j]));
        let (least, most) = others.fold((f64::INFINITY, 0.0_f64), |(a, b), d| (a.min(d), b.max(d)));
        most <= (1.0 + EQUAL) * least
    };
    let like_centre: Vec<usize> = (0..points.len()).filter(is_like_centre).collect();
    let sureness = like_centre.iter().map(|i| {
        let sure = straighter(points[*i], &circle);
        // small turns show where the whole of a straight stretch is looked at
        let sure = if sure.abs() > SURE { sure } else { straighter_next_to_impact(points[*i], &circle) };
        (sure, *i)
    });
    match sureness.max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((sure, i)) if sure > SURE => Ok(Some(i)),
        // a centre is the only one; points on the rim may all be as far from each other
        Some((sure, i)) if like_centre.len() == 1 && sure > -SURE => Err(i),
        _ => Ok(None),
    }
}

/// Median distance of two points.
fn distance(one: &[Sample], other: &[Sample]) -> f64 {
    let at = |t: f64| other.get(other.partition_point(|s| s.t < t)).filter(|s| s.t == t);
    let all: Vec<f64> = one.iter().filter_map(|s| at(s.t).map(|o| (s.x - o.x).hypot(s.y - o.y))).collect();
    if all.is_empty() { f64::INFINITY } else { median(all) }
}

/// In how many more frames, as a part of all, the first path is the straighter one.
fn straighter(one: &[Sample], other: &[Sample]) -> f64 {
    let at = |t: f64| other.get(other.partition_point(|s| s.t < t)).filter(|s| s.t == t);
    let both: Vec<[&Sample; 2]> = one.iter().filter_map(|s| at(s.t).map(|o| [s, o])).collect();
    let reach = (both.len() / REACH).clamp(1, MOST);
    let bend = |[a, b, c]: [&Sample; 3]| (0.5 * (a.x + c.x) - b.x).hypot(0.5 * (a.y + c.y) - b.y);
    let (mut more, mut all) = (0.0, 0.0);
    for window in both.windows(2 * reach + 1) {
        let [one, other] = [0, 1].map(|k| bend([window[0][k], window[reach][k], window[2 * reach][k]]));
        all += 1.0;
        more += f64::from(i8::from(other > STRAIGHTER * one) - i8::from(one > STRAIGHTER * other));
    }
    if all > 0.0 { more / all } else { 0.0 }
}

/// 1 where straight lines on either side of the impact fit the first path better than the second by what is no chance, −1 where they fit the
/// second better, or else 0.
fn straighter_next_to_impact(one: &[Sample], other: &[Sample]) -> f64 {
    /// χ² by which a path is surely the less straight one, and as a part of that of the straighter.
    const SURELY: f64 = 30.0;
    const MORE: f64 = 0.3;
    /// χ²/dof of a straight path.
    const STRAIGHT: f64 = 3.0;
    let at = |t: f64| other.get(other.partition_point(|s| s.t < t)).filter(|s| s.t == t);
    let both: Vec<[Sample; 2]> = one.iter().filter_map(|s| at(s.t).map(|o| [*s, *o])).collect();
    let reach = (both.len() / REACH).clamp(1, MOST);
    if both.len() < 4 * REACH {
        return 0.0;
    }
    let bend = |window: &[[Sample; 2]]| {
        let [a, b, c] = [window[0], window[reach], window[2 * reach]].map(|s| s[1]);
        (0.5 * (a.x + c.x) - b.x).hypot(0.5 * (a.y + c.y) - b.y)
    };
    let bends: Vec<f64> = both.windows(2 * reach + 1).map(bend).collect();
    let steady: Vec<f64> = bends.windows(FRAMES).map(|some| median(some.to_vec())).collect();
    let Some((place, _)) = steady.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)) else { return 0.0 };
    let impact = place + FRAMES / 2 + reach;
    let sides = [
        &both[impact.saturating_sub(MOST)..impact.saturating_sub(1)],
        &both[(impact + 2).min(both.len())..(impact + MOST).min(both.len())],
    ];
    let of_path = |k: usize| {
        let off = sides.map(|side| off_line(&side.iter().map(|s| s[k]).collect::<Vec<_>>()));
        off.iter().fold((0.0, 0.0), |sum, off| (sum.0 + off.0, sum.1 + off.1))
    };
    let [(first, dof), (second, of_second)] = [0, 1].map(of_path);
    // what else bends the paths bends both
    if first.min(second) > STRAIGHT * dof.min(of_second) {
        return 0.0;
    }
    let surely = SURELY.max(MORE * first.min(second));
    f64::from(i8::from(second > first + surely) - i8::from(first > second + surely))
}

/// χ² of a path about a straight line and its degrees of freedom, with the noise that second differences show, and without frames that are
/// wrong alone.
fn off_line(samples: &[Sample]) -> (f64, f64) {
    /// Of a second difference, in standard deviations.
    const ALONE: f64 = 6.0;
    let second = |three: &[Sample]| {
        (three[0].x - 2.0 * three[1].x + three[2].x).hypot(three[0].y - 2.0 * three[1].y + three[2].y)
    };
    let differences: Vec<f64> = samples.windows(3).map(second).collect();
    if differences.len() < REACH {
        return (0.0, 0.0);
    }
    // the median length of a vector of two normal deviates is 1.18, and the variance of a second difference six times that of a coordinate
    let noise = median(differences.clone()) / 1.177 / 6.0_f64.sqrt();
    let most = ALONE * 6.0_f64.sqrt() * noise;
    let good: Vec<Sample> =
        samples.windows(3).zip(&differences).filter(|(_, d)| **d < most).map(|(three, _)| three[1]).collect();
    let n = good.len() as f64;
    let mean = |of: &dyn Fn(&Sample) -> f64| good.iter().map(of).sum::<f64>() / n;
    let [t, x, y] = [mean(&|s| s.t), mean(&|s| s.x), mean(&|s| s.y)];
    let spread = mean(&|s| (s.t - t).powi(2));
    let [by_x, by_y] = [mean(&|s| (s.t - t) * (s.x - x)) / spread, mean(&|s| (s.t - t) * (s.y - y)) / spread];
    let off = |s: &Sample| (s.x - x - by_x * (s.t - t)).powi(2) + (s.y - y - by_y * (s.t - t)).powi(2);
    (good.iter().map(off).sum::<f64>() / (noise * noise), 2.0 * (n - 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on two discs that turn, in turns from one and the other; the second is hit half-way.
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
            // a seventh that is on neither, and one that is never seen
            points.push(
                (0..400).map(|i| Sample { t: f64::from(i) * 0.002, x: 0.3, y: 0.1, sd: None }).collect(),
            );
            points.push(Vec::new());
            assert_eq!(rigid_groups(&slices(&points)), [vec![0, 2, 4], vec![1, 3, 5], vec![6], vec![7]]);
        }
    }

    #[test]
    fn a_centre_moves_straight_while_the_disc_turns() {
        // rim only, centre and two on the rim, centre and three, three on the rim as far from each other
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
        // where it does not turn, nothing tells
        let points = film(0.0, &[(0.02, 0.0), (0.0, 0.0), (0.02, 1.6)]);
        let one: Vec<&[Sample]> = points.iter().step_by(2).map(Vec::as_slice).collect();
        assert_eq!(central(&one), Err(1));
    }
}
