//! Conversion of the tracks of a data set to the block of its frames: cleaned, in metres from the
//! middle of the impacts, with first guesses.

use std::sync::Arc;

use rayon::prelude::*;

use super::camera::{Camera, Point};
use super::filmed::{FilmBlock, FilmedShot, set_apart};
use super::impact::Contact;
use super::marker_rotation::MarkerTrack;
use super::own::{self, SCATTERED};
use super::priors::list_unknowns;
use super::spins::{ShotSpin, first_spreads};
use crate::film::corners::{leave_out_after_cushion, leave_out_before_cushion};
use crate::film::meeting::Meeting;
use crate::film::noise_correlation::noise_correlation;
use crate::film::unusable::{Bodies, Unusable};
use crate::film::{drops, frame_noise};
use crate::measurement::dataset::{Dataset, Measured, Tracks};
use crate::measurement::loss::Loss;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};
use crate::numerics::{SIGNIFICANT, median};
use crate::problem::findings::Finding;
use crate::problem::frames::Frame;
use crate::problem::loss::ShotLoss;
use crate::problem::policy::Choices;
use crate::problem::problem::{Block, Prepared, Problem, Record, State};
use crate::problem::sums::{Noise, Variation};
use crate::problem::unknowns::{Id, Own, Shared};

/// Ratio of lengths to those expected, less 1, beyond which they are in another unit than stated,
/// or those of two films by another camera.
pub(crate) const OTHER_UNIT: f64 = 0.1;

const MOVING: &str = "the object ball was moving before the impact";

/// Why a film cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// The data set has no films of such bodies.
    #[error("the data set has no such films")]
    NoFilm,
    /// No shot shows an impact; with the name and the reason of each.
    #[error("none of {} shots shows an impact; of the first: {}", .0.len(), .0.first().map_or("", |(_, why)| why))]
    NoImpact(Vec<(String, String)>),
    /// No start of the search describes a collision.
    #[error("no values of the unknowns describe a collision that the frames show")]
    NoStart,
    /// The frames leave an unknown undetermined.
    #[error("the frames do not determine the unknowns")]
    Undetermined,
}

/// Returns the films of balls of a data set as a problem.
///
/// # Errors
/// See [`FilmError`].
pub(crate) fn prepare_film(dataset: &Dataset, choices: &Choices) -> Result<Prepared, FilmError> {
    let tracks = dataset.tracks.as_ref().filter(|tracks| tracks.discs.is_none());
    let tracks = tracks.filter(|tracks| !tracks.shots.is_empty()).ok_or(FilmError::NoFilm)?;
    let model = choices.model(dataset);
    let ball = model.ball;
    let (shots, mut findings) = cleaned(tracks, ball.radius);
    let mut left_out = tracks.left_out.clone();
    let mut shots = guess_all(shots, tracks.from_balls, &mut left_out);
    if shots.is_empty() {
        return Err(FilmError::NoImpact(left_out));
    }
    let distance = ball.contact_distance(&model.object_ball());
    let ratio = distance / median(shots.iter().map(|shot| shot.guess.relative(0)[0].norm()).collect());
    let is_other = (ratio - 1.0).abs() > OTHER_UNIT;
    let unit = if tracks.from_balls || is_other { ratio } else { 1.0 };
    if unit != 1.0 {
        findings.push(Finding::OtherUnit { factor: unit, stated: !tracks.from_balls });
    }
    findings.extend(refute_noise(&mut shots, unit));
    let contact = |shot: &Guessed| (shot.guess.before(0)[0] + shot.guess.before(1)[0]) * 0.5;
    let middle = shots.iter().map(contact).sum::<Point>() / shots.len() as f64;
    let states_noise = shots.iter().all(|shot| shot.track.states_noise());
    let rho = shots[0].track.correlation;
    let noises = [0, 1].map(|ball| {
        let sd = || unit * median(shots.iter().map(|shot| shot.noise(ball)).collect());
        Noise { sd: if states_noise { 1.0 } else { sd() }, rho }
    });
    let names: Vec<String> = shots.iter().map(|shot| shot.track.name.clone()).collect();
    let read = |shot: &Guessed| shot.read((middle, unit), (states_noise, &noises), ball.radius);
    let (mut shots, mut own): (Vec<FilmedShot>, Vec<Own>) = shots.iter().map(read).unzip();
    let settings = dataset.settings_of_balls();
    let camera = Camera::new(&Shared::starts(&list_unknowns(&settings, tracks, &[])));
    let measured = shots.par_iter_mut().zip(&mut own);
    measured.for_each(|(shot, own)| shot.measure_spins(own, camera, ball.radius));
    let spins: Vec<ShotSpin> = shots.iter().map(|shot| shot.spin).collect();
    let mut unknowns = list_unknowns(&settings, tracks, &spins);
    if unit != 1.0 {
        unknowns[Id::Scale as usize].prior = None;
    }
    let loss = choices.loss.unwrap_or(dataset.loss);
    let block = FilmBlock {
        shots: Arc::new(shots),
        contact: Contact::new(&model, &unknowns),
        variation: Variation {
            noises: noises.to_vec(),
            is_stated: states_noise,
            spreads: first_spreads(dataset.side_sd).to_vec(),
        },
        scatters: [false; SCATTERED.len()],
        loss: (loss != Loss::Squares).then(|| ShotLoss::new(loss, Id::OFFSETS.len())),
    };
    let start = State { own: vec![own], shared: Shared::starts(&unknowns) };
    let problem = Problem::of_one(Block::Film(block), names, unknowns);
    let record = Record { findings, left_out, unit, middle: middle.into() };
    Ok(Prepared { problem, start, record })
}

/// A shot that can be fitted.
struct Guessed {
    track: TrackShot,
    guess: Meeting,
}

/// Returns the shots that show an impact, with first guesses; adds names and reasons of the others
/// to `left_out`.
fn guess_all(shots: Vec<TrackShot>, from_balls: bool, left_out: &mut Vec<(String, String)>) -> Vec<Guessed> {
    let guess = |track: TrackShot| match Meeting::find(&track, Bodies::Balls) {
        Ok(guess) => Ok(Guessed { track, guess }),
        Err(why) => Err((track.name, why)),
    };
    let (refused, guessed): (Vec<_>, Vec<_>) =
        shots.into_par_iter().partition_map(|track| guess(track).into());
    let is_moving = |why: &Unusable| matches!(why, Unusable::ObjectMoving { .. });
    let are_all = guessed.is_empty() && refused.len() > 1 && refused.iter().all(|(_, why)| is_moving(why));
    let in_all = if are_all { ", as in all shots" } else { "" };
    for (name, why) in refused {
        // a speed has a meaning only in a known unit
        let words = if is_moving(&why) && from_balls { MOVING.to_owned() } else { why.to_string() };
        let hint = format!("{in_all}: are cue and object interchanged ([tracks] cue, object)?");
        left_out.push((name, if is_moving(&why) { words + &hint } else { words }));
    }
    guessed
}

impl Guessed {
    /// Returns the noise of a coordinate of a ball, in the unit of the film: at least that of both,
    /// since rest, in which a tracker may hold a ball, shows less.
    fn noise(&self, ball: usize) -> f64 {
        let samples: &[Sample] = [&self.track.cue, &self.track.object][ball];
        frame_noise::noise(&self.track).max(frame_noise::noise_of(&[samples], &self.track))
    }

    /// Returns the shot in metres from the middle, with the spin that is stated, and the first guess
    /// of its own unknowns. The radius is in metres.
    fn read(
        &self,
        (middle, unit): (Point, f64),
        (states_noise, typical): (bool, &[Noise; 2]),
        radius: f64,
    ) -> (FilmedShot, Own) {
        let Self { track, guess } = self;
        let reading = Reading { middle, unit, states_noise, may_be_held: !track.states_noise() };
        let [of_cue, of_object] = track.resolution;
        let mut tracks =
            [reading.frames(track, &track.cue, of_cue), reading.frames(track, &track.object, of_object)];
        for (ball, frames) in tracks.iter_mut().enumerate().filter(|_| !track.states_noise()) {
            // frames that scatter significantly more, as those of fast balls may, count less
            let times = unit * self.noise(ball) / typical[ball].sd;
            if times > 1.0 + SIGNIFICANT / (frames.len() as f64).sqrt() {
                for frame in frames {
                    frame.weight /= times;
                }
            }
        }
        set_apart(&mut tracks, track.fps, radius);
        let marker = |Marker { ball, samples, .. }: &Marker| {
            let ball = usize::from(*ball == TrackedBall::Object);
            MarkerTrack {
                ball,
                frames: reading.frames(track, samples, track.resolution[ball]),
                noise: if states_noise { 1.0 } else { unit * frame_noise::noise(track) },
                states_noise: track.position_sd.is_some() || samples.iter().all(|sample| sample.sd.is_some()),
            }
        };
        let place = (guess.before(1)[0] - middle) * unit;
        let normal = guess.relative(0)[0].normalize();
        let velocity = guess.before(0)[1] * unit;
        let [along, across] = [normal.dot(&velocity), normal.perp(&velocity)];
        let direction = normal.y.atan2(normal.x);
        let own = own::moving([guess.time, place.x, place.y, direction, along, across]);
        let shot = FilmedShot {
            tracks: Arc::new(tracks),
            markers: Arc::new(track.markers.iter().map(marker).collect()),
            fps: track.fps,
            side_spins: Vec::new(),
            spin: ShotSpin::stated(track.spin, own::velocity(&own), radius),
            correction: None,
        };
        (shot, own)
    }
}

/// How the positions of a shot are read.
pub(crate) struct Reading {
    /// Middle of the film, in its unit.
    pub(crate) middle: Point,
    /// Metres in a unit of length of the film.
    pub(crate) unit: f64,
    /// Whether the noise of every frame is stated, so that it counts in metres.
    pub(crate) states_noise: bool,
    /// Whether a ball that repeats its place may be held there by a program.
    pub(crate) may_be_held: bool,
}

impl Reading {
    /// Returns the frames of a ball, or of a point on a disc; coordinates lie on a grid of this
    /// step.
    pub fn frames(&self, shot: &TrackShot, samples: &[Sample], step: f64) -> Vec<Frame> {
        let noise = frame_noise::noise(shot);
        let repeats =
            frame_noise::repeats(samples, noise.max(frame_noise::rounding(step)), step, self.may_be_held);
        let frame = |(sample, repeats): (&Sample, [f64; 2])| {
            let seen = (Point::new(sample.x, sample.y) - self.middle) * self.unit;
            let weight = |axis: usize| {
                // that of all frames is in metres
                let stated = sample.sd.map(|sd| sd[axis] * self.unit).or(shot.position_sd);
                // over the noise of the film, which is 1 m if all noise is stated
                let noise = if self.states_noise { 1.0 } else { noise * self.unit };
                let sd = stated.map_or(1.0, |sd| sd / noise);
                (repeats[axis].sqrt() * if sd > 0.0 { sd } else { 1.0 }).recip()
            };
            Frame {
                time: sample.t,
                seen,
                weight: Point::new(weight(0), weight(1)),
                apart: Point::zeros(),
                used: seen.x.is_finite() && seen.y.is_finite(),
            }
        };
        samples.iter().zip(repeats).map(frame).collect()
    }
}

/// Scatter of neighbouring frames, in units of the stated noise, that does not refute it.
const AS_STATED: std::ops::Range<f64> = 0.7..1.5;

/// Returns the shots of a film with their faults repaired as far as single tracks show them, and
/// what was found. The radius of the balls is in m.
pub(super) fn cleaned(tracks: &Tracks, radius: f64) -> (Vec<TrackShot>, Vec<Finding>) {
    let mut shots = tracks.shots.clone();
    let all_shots = shots.len();
    let mut findings: Vec<Finding> = repair_drops(&mut shots).into_iter().collect();
    let corners = shots.par_iter_mut().map(leave_out_before_cushion).filter(|has_one| *has_one).count();
    if corners > 0 {
        findings.push(Finding::Corners { shots: corners, of: all_shots });
    }
    if let Some(Measured { value: rho, sd }) = noise_correlation(&shots) {
        findings.push(Finding::NoiseLasts { rho, sd: sd.unwrap_or(f64::NAN) });
        for shot in &mut shots {
            shot.correlation = rho;
        }
    }
    let after = shots.par_iter_mut().map(|shot| leave_out_after_cushion(shot, radius));
    let ends = after.filter(|has_one| *has_one).count();
    if ends > 0 {
        findings.push(Finding::Ends { shots: ends, of: all_shots });
    }
    (shots, findings)
}

/// Moves the frames after dropped ones in time; says so if there are any.
pub(in crate::problem) fn repair_drops(shots: &mut [TrackShot]) -> Option<Finding> {
    let drops: Vec<usize> = shots.par_iter_mut().map(drops::repair).filter(|count| *count > 0).collect();
    (!drops.is_empty()).then(|| Finding::Drops { shots: drops.len(), drops: drops.iter().sum() })
}

/// Says so if the scatter of neighbouring frames refutes the stated noise, and forgets what is
/// stated if that is too small. `unit`: metres in a unit of the film.
fn refute_noise(shots: &mut [Guessed], unit: f64) -> Option<Finding> {
    let scatter_over_stated = |Guessed { track, .. }: &Guessed| {
        let samples = track.cue.iter().chain(&track.object);
        let typical_sd = || unit * median(samples.filter_map(|sample| sample.sd).flatten().collect());
        let stated = track.position_sd.unwrap_or_else(typical_sd);
        (stated > 0.0).then(|| unit * frame_noise::noise(track) / stated)
    };
    let times: Vec<f64> = shots.par_iter().filter_map(scatter_over_stated).collect();
    let times = (!times.is_empty()).then(|| median(times)).filter(|times| !AS_STATED.contains(times))?;
    for Guessed { track, .. } in shots.iter_mut().filter(|_| times > 1.0) {
        track.position_sd = None;
        track.tracks_mut().flatten().for_each(|sample| sample.sd = None);
    }
    Some(Finding::NoiseRefuted { times })
}
