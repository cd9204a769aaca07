//! Conversion of the tracks of a data set to the block of its frames: in metres from the middle of
//! the impacts, with first guesses.

use std::sync::Arc;

use rayon::prelude::*;

use super::block::{DiscBlock, NOISES, PointTrack, ShotFrames};
use super::own::{self, CORE, DISTANCE_SD, list_unknowns, spreads};
use super::stuck::Stuck;
use crate::film::frame_noise::{MIN_NOISE_M, constant_axis, noise_of_near};
use crate::film::meeting::{LEAST, Line, Meeting, lines_beside};
use crate::film::rigid_body;
use crate::film::unusable::{Bodies, Unusable};
use crate::measurement::dataset::Dataset;
use crate::measurement::spin::Spin;
use crate::measurement::track::{Sample, TrackShot, TrackedBall};
use crate::numerics::{median, wrap};
use crate::problem::film::camera::Point;
use crate::problem::film::film_data::{FilmError, Reading, repair_drops};
use crate::problem::problem::{Block, Prepared, Problem, Record, State};
use crate::problem::sums::{Noise, Variation};
use crate::problem::unknowns::{Id, Own, Shared};

/// Standard error of a parabola through 15 frames at twice their reach, over the noise of a frame:
/// √(1 + 3x² + 5(3x² − 1)²/4)/√15 at x = 3.
const EXTRAPOLATED: f64 = 7.6;

/// Part by which distances between points of one disc change at most, the tenth at either end left
/// out for mistaken points: a camera that leans by 25° shortens them by as much in one direction.
const NOT_RIGID: f64 = 0.1;

/// Frames on either side of the impact in which these are looked at, and frames with both points
/// that are needed.
const MAX_FRAMES_AWAY: f64 = 60.0;
const LEAST_FRAMES: usize = 8;

/// A shot that can be fitted.
struct Guessed {
    shot: TrackShot,
    meeting: Meeting,
    stuck: Option<Stuck>,
}

/// Returns the films of discs of a data set as a problem.
///
/// # Errors
/// See [`FilmError`].
pub(crate) fn prepare_discs(dataset: &Dataset) -> Result<Prepared, FilmError> {
    let tracks = dataset.tracks.as_ref().filter(|tracks| !tracks.shots.is_empty());
    let tracks = tracks.ok_or(FilmError::NoFilm)?;
    let discs = tracks.discs.ok_or(FilmError::NoFilm)?;
    let mut shots = tracks.shots.clone();
    // each disc has its own noise, which is estimated
    for shot in &mut shots {
        shot.position_sd = None;
    }
    let findings = repair_drops(&mut shots).into_iter().collect();
    let (refused, guessed): (Vec<_>, Vec<_>) =
        shots.into_par_iter().partition_map(|shot| Guessed::new(shot).into());
    let mut left_out = tracks.left_out.clone();
    left_out.extend(refused.into_iter().map(|(name, why)| (name, why.to_string())));
    if guessed.is_empty() {
        return Err(FilmError::NoImpact(left_out));
    }
    let typical = |of: &dyn Fn(&Meeting) -> f64| median(guessed.iter().map(|g| of(&g.meeting)).collect());
    let middle = Point::from([0, 1].map(|axis| typical(&|meeting| meeting.before(0)[0][axis])));
    let distance = typical(&|meeting| meeting.relative(0)[0].norm());
    let stated = discs.radii.map(|[first, second]| first + second);
    let unit = stated.filter(|_| tracks.from_balls).map_or(1.0, |stated| stated / distance);
    let means = [unit * distance, typical(&Meeting::mass_ratio)];
    let is_flat = guessed.iter().any(|guessed| constant_axis(&guessed.shot).is_some());
    let unknowns = list_unknowns(dataset, tracks, &discs, means, (guessed.len(), is_flat));
    let shared = Shared::starts(&unknowns);
    let reading = Reading { middle, unit, states_noise: false, may_be_held: false };
    let frames = guessed.iter().map(|guessed| guessed.read(&reading, &shared));
    let (shots, own): (Vec<ShotFrames>, Vec<Own>) = frames.unzip();
    let noise = |Guessed { shot, meeting, .. }: &Guessed| {
        let sd = noise_of_near(&[&shot.cue, &shot.object], shot, meeting.time);
        // lines through the frames next to an impact miss the discs by as much
        let sd = unit * (DISTANCE_SD * meeting.relative(0)[0].norm()).max(EXTRAPOLATED * sd);
        [Noise { sd, rho: shot.correlation }; NOISES]
    };
    let noises = guessed.iter().flat_map(noise).collect();
    let names: Vec<String> = guessed.iter().map(|guessed| guessed.shot.name.clone()).collect();
    let variation = Variation { noises, is_stated: false, spreads: spreads(&discs, shots.len()) };
    let block = DiscBlock { shots: Arc::new(shots), discs, has_law: false, variation };
    let start = State { own: vec![own], shared };
    let problem = Problem::of_one(Block::Discs(block), names, unknowns);
    let record = Record { findings, left_out, unit, middle: middle.into() };
    Ok(Prepared { problem, start, record })
}

impl Guessed {
    fn new(shot: TrackShot) -> Result<Self, (String, Unusable)> {
        let stuck = Stuck::find(&shot);
        // the lines after it are those of no disc
        let meeting = match stuck {
            Some(Stuck { settling, .. }) => Meeting::beside(&shot, Bodies::Discs, settling[0]),
            None => Meeting::find(&shot, Bodies::Discs),
        };
        // points that are not on one disc explain all other faults
        let rigid = check_rigidity(&shot, meeting.as_ref().ok().map(|meeting| meeting.time));
        match rigid.and(meeting) {
            Ok(meeting) => Ok(Self { shot, meeting, stuck }),
            Err(why) => Err((shot.name, why)),
        }
    }

    /// Returns the frames of the shot and a first guess of its own unknowns.
    fn read(&self, reading: &Reading, shared: &Shared) -> (ShotFrames, Own) {
        let Self { shot, meeting, stuck } = self;
        let flat = constant_axis(shot);
        let Reading { middle, unit, .. } = *reading;
        let (mut own, mut tracks) = (vec![0.0; CORE], Vec::new());
        let (mut turns, mut position_sd) = ([false; 2], [0.0; 2]);
        let bodies = [(TrackedBall::Cue, &shot.cue), (TrackedBall::Object, &shot.object)];
        for (disc, (ball, centre)) in bodies.into_iter().enumerate() {
            let mut add = |marker: Option<[usize; 2]>, samples: &[Sample]| {
                let mut frames = reading.frames(shot, samples, shot.resolution[disc]);
                frames.retain(|frame| frame.used);
                if let Some(axis) = flat {
                    for frame in &mut frames {
                        frame.weight[axis] = 0.0;
                    }
                }
                tracks.push(PointTrack { disc, marker, frames });
            };
            let points = shot.markers.iter().filter(|marker| marker.ball == ball);
            let points: Vec<&[Sample]> = points.map(|marker| &marker.samples[..]).collect();
            let is_circle = is_of_points(centre, &points);
            let shown = if is_circle { &points } else { &vec![&centre[..]] };
            position_sd[disc] = unit * noise_of_near(shown, shot, meeting.time);
            let seen = points.into_iter().filter(|_| flat.is_none());
            let seen =
                seen.filter_map(|point| Some((point, turning(point, centre, meeting.time, shot.fps)?)));
            let (seen, turnings): (Vec<&[Sample]>, Vec<[Point; 2]>) = seen.unzip();
            turns[disc] = !seen.is_empty();
            if !is_circle || seen.is_empty() {
                add(None, centre);
            }
            // directions, then the radius of all or those of each
            let first = own.len();
            for (i, point) in seen.iter().enumerate() {
                let radius = first + seen.len() + if is_circle { 0 } else { i };
                add(Some([first + i, radius]), point);
            }
            own.extend(turnings.iter().map(|[at, _]| at.x));
            let radii: Vec<f64> = turnings.iter().map(|[at, _]| unit * at.y).collect();
            if turns[disc] {
                own[own::SPIN + disc] = median(turnings.iter().map(|[_, rate]| rate.x).collect());
                own.extend(if is_circle { vec![median(radii)] } else { radii });
            }
        }
        let knows_slip = (turns == [true; 2] || shot.spin == Spin::Stun) && flat.is_none();
        let frames = ShotFrames {
            tracks,
            fps: shot.fps,
            turns,
            knows_slip,
            flat,
            stuck: *stuck,
            position_sd,
            outliers: 0,
            reach: 0.0,
            tried: Some(Vec::new()),
        };
        let [[across, g], [_, h]] = [0, 1].map(|side| meeting.relative(side).map(|vector| vector * unit));
        // marks on the edges that touch are at no distance
        let n = if flat.is_some() { -g } else { across }.normalize();
        let distance = stuck.map_or(across.dot(&n), |stuck| unit * stuck.distance);
        let mut own = Own::from_vec(own);
        own[own::TIME] = meeting.time;
        own.fixed_rows_mut::<2>(own::X).copy_from(&((meeting.before(0)[0] - middle) * unit));
        own[own::DIRECTION] = n.y.atan2(n.x);
        own[own::DISTANCE] = distance - shared[Id::ContactDistance];
        for disc in 0..2 {
            let velocity = meeting.before(disc)[1] * unit;
            own.fixed_rows_mut::<2>(own::VELOCITY + 2 * disc).copy_from(&velocity);
        }
        if stuck.is_none() {
            own[own::RESTITUTION] = -h.dot(&n) / g.dot(&n);
            own[own::RATIO] = n.perp(&(h - g)) / n.dot(&(h - g));
        }
        (frames, own)
    }
}

/// Returns how a marker turns about the centre of its disc before the impact, less than half a turn
/// a frame, as a line: x is its direction at the impact (rad), y its distance from the centre.
/// `None` if it was seen in too few frames on either side.
fn turning(marker: &[Sample], centre: &[Sample], time: f64, fps: f64) -> Option<Line> {
    let mut last = 0.0;
    let arm = |point: &Sample| {
        let centre = rigid_body::sample_at(centre, point.t)?;
        let (x, y) = (point.x - centre.x, point.y - centre.y);
        last += wrap(y.atan2(x) - last);
        Some(Sample::new(point.t, [last, x.hypot(y)]))
    };
    let arms: Vec<Sample> = marker.iter().filter_map(arm).collect();
    let [[mut at, rate], _] = lines_beside(&arms, time, (fps.recip(), f64::INFINITY), [LEAST; 2]).ok()?;
    at.y = median(arms.iter().map(|arm| arm.y).collect());
    Some([at, rate])
}

/// Returns whether the centre of a disc was computed from the points on it, as films are loaded if
/// three or more points are on a circle about it.
fn is_of_points(centre: &[Sample], points: &[&[Sample]]) -> bool {
    let Ok(circle) = rigid_body::circle_centres(points) else { return false };
    let is_same = |(a, b): (&Sample, &Sample)| a.t == b.t && (a.x - b.x).hypot(a.y - b.y) < MIN_NOISE_M;
    circle.len() == centre.len() && circle.iter().zip(centre).all(is_same)
}

/// Checks that the points of either disc move as one rigid body near the impact, or else in all
/// frames.
///
/// # Errors
/// They do not.
fn check_rigidity(shot: &TrackShot, impact: Option<f64>) -> Result<(), Unusable> {
    let is_near = |time: f64| impact.is_none_or(|impact| (time - impact).abs() <= MAX_FRAMES_AWAY / shot.fps);
    for (i, a) in shot.markers.iter().enumerate() {
        for b in shot.markers[i + 1..].iter().filter(|b| b.ball == a.ball) {
            let both = rigid_body::distances(&a.samples, &b.samples).into_iter();
            let both = both.filter(|(time, _)| is_near(*time));
            let mut distances: Vec<f64> = both.map(|(_, distance)| distance).collect();
            distances.sort_by(f64::total_cmp);
            if distances.len() < LEAST_FRAMES {
                continue;
            }
            let tail = distances.len() / 10;
            let (least, most) = (distances[tail], distances[distances.len() - 1 - tail]);
            if 2.0 * (most - least) / (most + least) > NOT_RIGID {
                return Err(Unusable::NotRigid {
                    disc: Bodies::Discs.names()[usize::from(a.ball == TrackedBall::Object)],
                    first: a.name.clone(),
                    second: b.name.clone(),
                    least_mm: 1e3 * least,
                    most_mm: 1e3 * most,
                });
            }
        }
    }
    Ok(())
}
