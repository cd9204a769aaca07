//! Conversion of a file's rows to a shot: balls, times, and positions in metres.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::calibration::Calibration;
use super::input::quoted;
use super::raw::{FORMAT, Log, NAMES, Notes, RawShot, RawTrack, Row};
use super::repair::{self, Wrong};
use super::settings::{NAMED, Names, TrackSettings};
use super::units::Unit;
use super::{resolution, time};
use crate::film::rigid_body::circle_centres;
use crate::io::number::shortened;
use crate::measurement::spin::Spin;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};

/// Statements of the table of shots and of `[cue_spin]` about a shot.
#[derive(Clone, Debug)]
pub(super) struct Facts {
    pub spin: Spin,
    pub labels: BTreeMap<String, String>,
    pub own: Own,
    /// The reason if its discs were not found.
    pub refused: Option<String>,
}

impl Facts {
    /// Returns facts with the spin alone.
    pub(super) fn of(spin: Spin) -> Self {
        Self { spin, labels: BTreeMap::new(), own: Own::default(), refused: None }
    }
}

/// Statements of the table of shots that replace those of dataset.toml.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Own {
    /// Names of tracks, in the order of [`NAMED`].
    pub names: [Option<Names>; 4],
    pub capture_fps: Option<f64>,
}

impl Own {
    pub(super) fn settings<'a>(&self, all: &'a TrackSettings) -> Cow<'a, TrackSettings> {
        if *self == Self::default() {
            return Cow::Borrowed(all);
        }
        let mut own = all.clone();
        for (name, given) in own.names.iter_mut().zip(&self.names) {
            *name = given.as_ref().unwrap_or(name).clone();
        }
        own.states_balls |= self.names[..2].iter().any(Option::is_some);
        own.capture_fps = self.capture_fps.or(own.capture_fps);
        Cow::Owned(own)
    }
}

struct Ball {
    /// Track of the ball's centre, or tracks of the points whose mean is the centre.
    centres: Vec<RawTrack>,
    /// Further points on the ball.
    markers: Vec<RawTrack>,
}

/// Returns the shot of a file's rows. `Err`: all missing statements, or else the first fault.
pub(super) fn shot(
    mut raw: RawShot,
    mut facts: Facts,
    settings: &TrackSettings,
    calibration: &Calibration,
    notes: &Notes,
) -> Result<TrackShot, Vec<Wrong>> {
    if let Some(message) = facts.refused.take() {
        return Err(vec![Wrong::damaged(raw.line, message)]);
    }
    let settings = &*facts.own.settings(settings);
    let file = raw.file.clone();
    let log = notes.of(&file);
    let mut there: Vec<String> = raw.tracks.iter().map(|track| shortened(&track.name)).collect();
    there.dedup();
    there.truncate(12);
    let there = if there.is_empty() { "there are none".to_string() } else { quoted(there) };
    let line = raw.line;
    let tracks = &mut raw.tracks;
    let mut assigned = |which| assign(tracks, which, settings, &there, line, log);
    let balls = [0, 1].map(|ball| {
        let mut found = assigned(ball)?;
        found.markers.append(&mut assigned(ball + 2)?.centres);
        Ok(found)
    });
    let balls = match balls {
        [Ok(cue), Ok(object)] => [cue, object],
        balls => {
            // wrong names in the table of shots are its fault, not the shot's
            let are_stated = facts.own.names[..2].iter().any(Option::is_some);
            let mut wrong: Vec<Wrong> = balls.into_iter().filter_map(Result::err).collect();
            for wrong in &mut wrong {
                wrong.is_damage &= !are_stated;
            }
            if let Err(message) = time::convert(&mut raw, settings, &Notes::default()) {
                wrong.push(Wrong::input(line, message));
            }
            return Err(wrong);
        }
    };
    for other in &raw.tracks {
        let message =
            format!("the track \"{}\" is neither cue nor object; passed over", shortened(&other.name));
        log.add(NAMES, other.line(), message);
    }
    of_balls(raw, balls, facts, settings, calibration, notes).map_err(|wrong| vec![wrong])
}

/// Makes a shot of the tracks of its balls.
fn of_balls(
    mut raw: RawShot,
    balls: [Ball; 2],
    facts: Facts,
    settings: &TrackSettings,
    calibration: &Calibration,
    notes: &Notes,
) -> Result<TrackShot, Wrong> {
    let sizes = balls.each_ref().map(|ball| [ball.centres.len(), ball.markers.len()]);
    raw.tracks = balls.into_iter().flat_map(|ball| [ball.centres, ball.markers]).flatten().collect();
    let file = raw.file.clone();
    let log = notes.of(&file);
    let fps = time::convert(&mut raw, settings, notes).map_err(|message| Wrong::input(raw.line, message))?;
    for track in &mut raw.tracks {
        repair::order(track, log)?;
    }
    repair::remove_outliers(&mut raw.tracks, log);
    let mut rest = raw.tracks.into_iter();
    let mut balls = sizes.map(|sizes| {
        let [centres, markers] = sizes.map(|n| rest.by_ref().take(n).collect());
        Ball { centres, markers }
    });
    let [mut cue, mut object] = balls.each_mut().map(Ball::mean);
    repair::remove_repeated_frames(&mut cue, &mut object, fps, log)?;
    let swapped = repair::undo_swaps(&mut cue, &mut object, fps, log)?;
    if let Some(line) = swapped.filter(|_| balls.iter().any(|ball| !ball.markers.is_empty())) {
        let message = "cue and object ball have exchanged their names from here on, and with markers on them it is \
                       not certain which of both did; expected them set right, or the shot skipped";
        return Err(Wrong::damaged(line, message));
    }
    let centres = [cue, object];
    let resolution = resolution(&centres, settings, calibration, log);
    let mut paths = centres.each_ref().map(|centre| samples(centre, calibration));
    let mut markers: Vec<Marker> = Vec::new();
    for (i, ball) in [TrackedBall::Cue, TrackedBall::Object].into_iter().enumerate() {
        let marker = |track: &RawTrack| Marker {
            ball,
            name: track.point.clone().unwrap_or_else(|| track.name.clone()),
            samples: if track.is_angle {
                turned(track, &centres[i], calibration)
            } else {
                samples(track, calibration)
            },
        };
        let own: Vec<Marker> = balls[i].markers.iter().map(marker).collect();
        if settings.discs && sizes[i][0] > 1 {
            let points: Vec<&[Sample]> = own.iter().map(|marker| marker.samples.as_slice()).collect();
            paths[i] = circle_centres(&points).map_err(|message| Wrong::damaged(raw.line, message))?;
        }
        markers.extend(own);
    }
    let [cue, object] = paths;
    let mut shot = TrackShot {
        name: raw.name,
        file: raw.file.to_path_buf(),
        line: raw.line,
        labels: facts.labels,
        fps,
        cue,
        object,
        markers,
        spin: facts.spin,
        position_sd: settings.position_sd,
        resolution,
        correlation: 0.0,
    };
    let is_finite = |s: &mut Sample| [s.t, s.x, s.y].iter().all(|number| number.is_finite());
    if shot.samples_mut().all(is_finite) {
        return Ok(shot);
    }
    Err(Wrong::input(shot.line, "a position or time is too large to be converted"))
}

/// Removes the tracks that a key of [`NAMED`] names from the list, and the points on them.
fn assign(
    tracks: &mut Vec<RawTrack>,
    which: usize,
    settings: &TrackSettings,
    there: &str,
    line: usize,
    log: Log,
) -> Result<Ball, Wrong> {
    let (key, names) = (NAMED[which], &settings.names[which]);
    let mut found = Ball { centres: Vec::new(), markers: Vec::new() };
    for name in &names.0 {
        let Some(i) = find(tracks, name).map_err(|message| Wrong::input(line, message))? else {
            let apart = if tracks.len() + found.centres.len() < 2 {
                " (one file a ball: their names differ by the ball only, as in kick-A.txt and kick-B.txt)"
            } else {
                ""
            };
            let meant = if name == key { ", the default of the key" } else { "" };
            let message = format!(
                "there is no track \"{name}\" ([tracks] {key} = {}{meant}); there are: {there}. Expected \
                 both balls in one file or shot{apart}, and their names in [tracks] cue and object",
                names.shown()
            );
            // other shots may have both balls
            return Err(Wrong::damaged(line, message));
        };
        let track = tracks.remove(i);
        if track.name != *name {
            let message = format!("the track \"{}\" is [tracks] {key} = \"{name}\"", track.name);
            log.add(NAMES, track.line(), message);
        }
        let is_on_it = |other: &mut RawTrack| other.point.is_some() && other.name == track.name;
        found.markers.extend(tracks.extract_if(.., is_on_it));
        found.centres.push(track);
    }
    Ok(found)
}

/// Numbers tracks of the same name, in their order: "A (1)", "A (2)".
pub(super) fn number_twins(tracks: &mut [RawTrack]) {
    let mut bodies: Vec<&mut RawTrack> = tracks.iter_mut().filter(|track| track.point.is_none()).collect();
    let names: Vec<String> = bodies.iter().map(|track| track.name.clone()).collect();
    for (i, track) in bodies.iter_mut().enumerate() {
        let before = names[..i].iter().filter(|name| **name == names[i]).count();
        if before > 0 || names[i + 1..].contains(&names[i]) {
            track.name = format!("{} ({})", names[i], before + 1);
        }
    }
}

pub(super) fn last_word(name: &str) -> &str {
    name.rsplit(|c: char| c.is_whitespace() || c == '_').next().unwrap_or_default()
}

/// Returns the track that a name of dataset.toml means.
///
/// # Errors
/// The name is ambiguous.
pub(super) fn find(tracks: &[RawTrack], wanted: &str) -> Result<Option<usize>, String> {
    let small = wanted.to_lowercase();
    let is_number = |rest: &str| {
        let number = rest.strip_prefix(" (").and_then(|rest| rest.strip_suffix(')'));
        number.is_some_and(|number| number.parse::<usize>().is_ok())
    };
    let ways: [&dyn Fn(&str) -> bool; 4] = [
        &|name| name == wanted,
        &|name| name.to_lowercase() == small,
        // Tracker calls them "mass A", or mass_A
        &|name| name.to_lowercase().starts_with("mass") && last_word(name) == wanted,
        // numbers of tracks with equal names
        &|name| name.strip_prefix(wanted).is_some_and(is_number),
    ];
    for (i, way) in ways.into_iter().enumerate() {
        let fits = |i: &usize| tracks[*i].point.is_none() && way(&tracks[*i].name);
        let found: Vec<usize> = (0..tracks.len()).filter(fits).collect();
        match found.as_slice() {
            [] => {}
            [_] if i == 3 => {}
            [one] => return Ok(Some(*one)),
            many => {
                let shown = |i: &usize| format!("\"{}\" (line {})", tracks[*i].name, tracks[*i].line());
                return Err(format!(
                    "{} tracks are named \"{wanted}\"; write in [tracks] which one it is: {}",
                    many.len(),
                    many.iter().map(shown).collect::<Vec<_>>().join(", ")
                ));
            }
        }
    }
    Ok(None)
}

impl Ball {
    /// Removes and returns the centre: the only one, or the mean of several, then markers.
    fn mean(&mut self) -> RawTrack {
        if self.centres.len() < 2 {
            return self.centres.pop().unwrap_or_else(|| RawTrack::new("", None));
        }
        let mean = |row: &Row| {
            let points =
                self.centres.iter().map(|track| track.at(row.time).map_or([f64::NAN; 2], Row::place));
            let sum = points.fold([0.0; 2], |sum, place| [sum[0] + place[0], sum[1] + place[1]]);
            let [x, y] = sum.map(|sum| sum / self.centres.len() as f64);
            Row { x, y, sd: [f64::NAN; 2], ..*row }
        };
        let names: Vec<_> = self.centres.iter().map(|track| track.name.as_str()).collect();
        let rows = self.centres[0].rows.iter().map(mean).collect();
        let mean = RawTrack { rows, ..RawTrack::new(names.join(" + "), None) };
        self.markers.append(&mut self.centres);
        mean
    }
}

/// Returns the grid step of the coordinates of each ball, m, at its first position (0 without a
/// grid), and notes if one is coarse, in pixels if the scale is not known. The step is determined
/// in the file's unit, since a calibration by points bends the grid. A ball that is nearly at rest
/// has the other ball's step.
fn resolution(
    centres: &[RawTrack; 2],
    settings: &TrackSettings,
    calibration: &Calibration,
    log: Log,
) -> [f64; 2] {
    /// Step of the coordinates, m and px, above which it is noted: good tracking errs by as much.
    const COARSE_STEP: f64 = 1.5e-4;
    const COARSE_PX: f64 = 0.1;
    let step = |track: &RawTrack| {
        let step = resolution::step(&[track]).or_else(|| resolution::step(&centres.each_ref()))?;
        let first = track.seen().next()?;
        let [x, y] = calibration.sd(first.x, first.y, [step; 2]);
        Some((0.5 * (x * x + y * y)).sqrt()).filter(|step| step.is_finite())
    };
    let steps = centres.each_ref().map(|track| step(track).unwrap_or(0.0));
    let coarsest = steps[0].max(steps[1]);
    let (limit, rounded, unit) = match settings.unit {
        Some(Unit::Px) if settings.from_balls => (COARSE_PX, coarsest, "px"),
        _ => (COARSE_STEP, 1e3 * coarsest, "mm"),
    };
    if coarsest > limit {
        let least = rounded / 12.0_f64.sqrt();
        let message =
            format!("positions are rounded to {rounded:.2} {unit}: each errs by {least:.2} {unit} at least");
        log.add(FORMAT, None, message);
    }
    steps
}

fn samples(track: &RawTrack, calibration: &Calibration) -> Vec<Sample> {
    let sample = |row: &Row| {
        let [x, y] = calibration.metres(row.x, row.y);
        let is_stated = !row.sd[0].is_nan() && !row.sd[1].is_nan();
        let sd = is_stated.then(|| calibration.sd(row.x, row.y, row.sd));
        Sample { t: row.time + calibration.delay(row.y), x, y, sd }
    };
    // exactly as many as are needed, since all shots stay in memory
    let mut samples = Vec::with_capacity(track.seen().count());
    samples.extend(track.seen().map(sample));
    samples
}

/// Returns a point that turns with the disc, from angles measured from the file's x axis.
fn turned(angles: &RawTrack, centre: &RawTrack, calibration: &Calibration) -> Vec<Sample> {
    /// Distance of the point from the centre, m; arbitrary.
    const ARM: f64 = 0.02;
    let point = |row: &Row| {
        let middle = centre.at(row.time).filter(|row| !row.is_gap())?;
        let (sin, cos) = row.x.sin_cos();
        let [x, y] = calibration.metres(middle.x, middle.y);
        let [along, up] = calibration.metres(middle.x + cos, middle.y + sin);
        let length = (along - x).hypot(up - y);
        let place = [x + ARM * (along - x) / length, y + ARM * (up - y) / length];
        Some(Sample::new(row.time + calibration.delay(middle.y), place))
    };
    angles.seen().filter_map(point).collect()
}
