//! First guesses from straight lines through the frames on both sides of the nearest approach: how
//! discs meet and turn, or stick together, so that the distance of their centres stays.

use super::own::DISTANCE_SD;
use crate::film::frame_noise::{constant_axis, noise_of};
use crate::film::rigid_body::{distances, frames};
use crate::film::unusable::{Bodies, Unusable};
use crate::measurement::dataset::Measured;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::{SIGNIFICANT, median, median_error, wrap};
use crate::problem::film::camera::Point;

/// Frames of each disc on either side of the impact that are needed.
pub(super) const LEAST: usize = 4;

/// Frames next to the impact that give the lines.
const NEAR: usize = 12;

/// Frames, besides a gap in the tracks, by which the instant differs from that of the frame in
/// which the discs are nearest.
const FARTHEST: f64 = 2.0;

/// Part of itself by which the relative velocity changes at least.
const MIN_VELOCITY_CHANGE: f64 = 1e-3;

/// Returns times and distances of the centres, each the middle one of three neighbours, so that a
/// frame in which a disc was mistaken for another does not count.
fn smooth_distances(shot: &TrackShot) -> Vec<(f64, f64)> {
    let middle = |three: &[(f64, f64)]| (three[1].0, middle(three));
    distances(&shot.cue, &shot.object).windows(3).map(middle).collect()
}

/// Returns the median of the second numbers.
fn middle(pairs: &[(f64, f64)]) -> f64 {
    median(pairs.iter().map(|pair| pair.1).collect())
}

/// Returns the median slope of pairs of numbers (Theil and Sen): wrong ones do not count.
fn median_slope(points: &[(f64, f64)]) -> f64 {
    let pairs = points.iter().enumerate().flat_map(|(i, a)| points[i + 1..].iter().map(move |b| (a, b)));
    median(pairs.map(|(a, b)| (b.1 - a.1) / (b.0 - a.0)).collect())
}

/// A straight path: place and velocity at the instant that it was asked for.
type Line = [Point; 2];

/// Returns the lines through the frames of a disc next to an instant, before and after it.
///
/// # Errors
/// These frames are too few.
fn lines_beside(samples: &[Sample], disc: usize, at: f64, frame: f64) -> Result<[Line; 2], Unusable> {
    let before = samples.partition_point(|s| s.t < at - 0.5 * frame);
    let after = samples.partition_point(|s| s.t < at + 0.5 * frame);
    let sides =
        [&samples[before.saturating_sub(NEAR)..before], &samples[after..samples.len().min(after + NEAR)]];
    if let Some(side) = sides.iter().position(|near| near.len() < LEAST) {
        return Err(Unusable::too_few(Bodies::Discs, [disc, side], sides[side].len(), LEAST));
    }
    Ok(sides.map(|near| {
        let [x, y] = [|s: &Sample| s.x, |s: &Sample| s.y].map(|pick| {
            let points: Vec<(f64, f64)> = near.iter().map(|s| (s.t - at, pick(s))).collect();
            let slope = median_slope(&points);
            [median(points.iter().map(|(t, x)| x - slope * t).collect()), slope]
        });
        [Point::new(x[0], y[0]), Point::new(x[1], y[1])]
    }))
}

/// A first guess of an impact: the lines of each disc before and after it.
pub(super) struct Meeting {
    /// Instant, s.
    pub(crate) time: f64,
    lines: [[Line; 2]; 2],
}

impl Meeting {
    /// Returns the meeting of the discs of a shot, which part again unless they stick together.
    ///
    /// # Errors
    /// They do not, or the frames are too few.
    pub fn find(shot: &TrackShot, stuck: Option<&Stuck>) -> Result<Self, Unusable> {
        let bodies = Bodies::Discs;
        let discs = [shot.cue.as_slice(), &shot.object];
        let frame = shot.fps.recip();
        if discs.iter().any(|samples| samples.len() < 2 * LEAST) {
            return Err(Unusable::TooShort { bodies, frames: discs.map(<[_]>::len), least: 2 * LEAST });
        }
        let beside = |time: f64| -> Result<Self, Unusable> {
            let [first, second] = [0, 1].map(|disc| lines_beside(discs[disc], disc, time, frame));
            Ok(Self { time, lines: [first?, second?] })
        };
        if let Some(stuck) = stuck {
            // the lines after it are those of no disc
            return beside(stuck.settling[0]);
        }
        let nearest = smooth_distances(shot).into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let mut meeting = beside(nearest.ok_or(Unusable::NoCollision(bodies))?.0)?;
        let steps = discs.iter().flat_map(|samples| samples.windows(2)).map(|two| two[1].t - two[0].t);
        let farthest = steps.fold(FARTHEST * frame, f64::max);
        let late = meeting.crossing().clamp(-farthest, farthest);
        meeting.time += late;
        for [place, velocity] in meeting.lines.iter_mut().flatten() {
            *place += *velocity * late;
        }
        let [[apart, g], [apart_after, h]] = [0, 1].map(|side| meeting.relative(side));
        let is_met = match constant_axis(shot) {
            // marks on the edges that touch are at no distance
            Some(_) => g.dot(&h) < 0.0,
            None => apart.dot(&g) < 0.0 && apart_after.dot(&h) > 0.0,
        };
        let is_pushed = (h - g).norm() > MIN_VELOCITY_CHANGE * g.norm();
        if is_met && is_pushed { Ok(meeting) } else { Err(Unusable::NoCollision(bodies)) }
    }

    /// Returns place and velocity of a disc before the impact.
    pub fn before(&self, disc: usize) -> Line {
        self.lines[disc][0]
    }

    /// Returns the way from the first centre to the second before (0) or after (1) the impact, and
    /// the velocity of the second disc against the first.
    pub fn relative(&self, side: usize) -> Line {
        let [first, second] = self.lines.map(|sides| sides[side]);
        [second[0] - first[0], second[1] - first[1]]
    }

    /// Returns m₁/m₂ of which momentum is conserved along the line of centres.
    pub fn mass_ratio(&self) -> f64 {
        let across = self.relative(0)[0];
        let [first, second] = self.lines.map(|[before, after]| (after[1] - before[1]).dot(&across));
        -second / first
    }

    /// Returns how much later the relative paths before the impact and after it are nearest to each
    /// other, s: τ = −Δp·Δg/|Δg|².
    fn crossing(&self) -> f64 {
        let [before, after] = [0, 1].map(|side| self.relative(side));
        let [jump, turn] = [after[0] - before[0], after[1] - before[1]];
        let square = turn.norm_squared();
        if square > 0.0 { -jump.dot(&turn) / square } else { 0.0 }
    }
}

/// Returns how a marker turns about the centre of its disc before the impact, less than half a turn
/// a frame, as a line: x is its direction at the impact (rad), y its distance from the centre.
/// `None` if it was seen in too few frames on either side.
pub(super) fn turning(marker: &[Sample], centre: &[Sample], time: f64, fps: f64) -> Option<Line> {
    let mut arms: Vec<Sample> = Vec::new();
    for (t, places) in frames(&[centre, marker]) {
        let [Some([x, y]), Some([u, v])] = places[..] else { continue };
        let last = arms.last().map_or(0.0, |last| last.x);
        arms.push(Sample::new(t, [last + wrap((v - y).atan2(u - x) - last), (u - x).hypot(v - y)]));
    }
    let [[mut at, rate], _] = lines_beside(&arms, 0, time, fps.recip()).ok()?;
    at.y = median(arms.iter().map(|arm| arm.y).collect());
    Some([at, rate])
}

/// How two discs stick together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stuck {
    /// Distance of the centres while they stick together, m.
    pub(crate) distance: f64,
    /// Number of frames after the impact in which they stay so.
    pub(crate) frames: usize,
    /// Whether these frames reach to the end of the tracks.
    pub(crate) to_the_end: bool,
    /// Growth rate of the distance over the closing speed, used instead of e.
    pub(crate) restitution: Measured,
    /// Instants at which they touch and from which on they are one rigid body, s.
    pub(crate) settling: [f64; 2],
}

/// Part of the closing speed with which discs that stick may part, three standard errors included.
/// Real discs that part do so at a third of this speed or more; glue and velcro yield by 0.02.
const PARTING: f64 = 0.02;

/// Frames that discs stay together at least, and the number after which more do not help; frames
/// just after the contact, in which the middle one of three may be one before it; and frames in a
/// row at one distance after which the pair has settled.
const LEAST_FRAMES: usize = 24;
const MOST_FRAMES: usize = 120;
const SKIPPED: usize = 2;
const SETTLED: usize = 6;

impl Stuck {
    /// Returns how the discs stick together, as a clause.
    pub fn sentence(&self) -> String {
        format!(
            "the discs stick together: after the impact their centres stay {:.2} mm apart for {} frames{}, so that e = 0 ({:.4} ± \
             {:.4}, the growth of that distance over the closing speed)",
            1e3 * self.distance,
            self.frames,
            if self.to_the_end { ", to the end of the tracks" } else { "" },
            self.restitution.value,
            self.restitution.sd.unwrap_or(f64::NAN)
        )
    }

    /// Returns how the discs of a shot stick together; `None` if they part.
    pub(super) fn find(shot: &TrackShot) -> Option<Self> {
        let distances = smooth_distances(shot);
        let nearest = (0..distances.len()).min_by(|i, j| distances[*i].1.total_cmp(&distances[*j].1))?;
        let distance = middle(&distances[nearest..distances.len().min(nearest + MOST_FRAMES)]);
        let noise = noise_of(&[&shot.cue, &shot.object], shot);
        let most = distance + (DISTANCE_SD * distance).max(SIGNIFICANT * noise);
        let first = distances.iter().position(|(_, d)| *d <= most)?;
        let frames = distances[first..].iter().take_while(|(_, d)| *d <= most).count();
        if first < LEAST || frames < LEAST_FRAMES + SKIPPED {
            return None;
        }
        let used = &distances[first + SKIPPED..first + frames.min(MOST_FRAMES + SKIPPED)];
        let closing = -median_slope(&distances[first.saturating_sub(NEAR)..first]);
        let third = used.len() / 3;
        let growth = middle(&used[2 * third..]) - middle(&used[..third]);
        let way = (used[2 * third].0 - used[0].0) * closing;
        // a median of distances, each with the noise of two coordinates
        let error = median_error() * noise * (2.0 * 2.0 / third as f64).sqrt() / way;
        if !(closing > 0.0 && growth.abs() / way + 3.0 * error < PARTING) {
            return None;
        }
        let touch = distances.iter().position(|(_, d)| *d <= distance + SIGNIFICANT * noise)?;
        let is_near = |(_, d): &(f64, f64)| (d - distance).abs() <= SIGNIFICANT * noise;
        let settled = distances[touch..].windows(SETTLED).position(|run| run.iter().all(is_near))?;
        Some(Self {
            distance,
            frames,
            to_the_end: first + frames == distances.len(),
            restitution: Measured { value: growth / way, sd: Some(error) },
            settling: [distances[touch].0, distances[touch + settled].0],
        })
    }
}
