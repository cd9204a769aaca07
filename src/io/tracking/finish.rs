//! From the rows of a file to a shot: which track is which ball, when, and where in metres.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::calibration::Calibration;
use super::check::{self, Wrong};
use super::input::quoted;
use super::raw::{FORMAT, NAMES, Notes, RawShot, RawTrack, Row};
use super::settings::{Balls, Names, TrackSettings, Unit};
use super::{resolution, time};
use crate::film::frame_noise::noise;
use crate::film::rigid_body::circle_centres;
use crate::io::number::shortened;
use crate::measurement::spin::Spin;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};

/// What the shots table and `[cue_spin]` say of a shot.
#[derive(Clone, Debug)]
pub(super) struct Facts {
    pub spin: Spin,
    pub labels: BTreeMap<String, String>,
    pub own: Own,
    /// Where it had to be found out, the discs: the one that moves first, and the other. As an error why they were not found.
    pub discs: Option<Result<[Disc; 2], String>>,
}

/// What the shots table says of a shot in place of dataset.toml.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Own {
    /// In the order of [`NAMED`](super::settings::NAMED).
    pub names: [Option<Names>; 4],
    pub capture_fps: Option<f64>,
}

impl Own {
    fn states_balls(&self) -> bool {
        self.names[..2].iter().any(Option::is_some)
    }

    /// The settings that hold for the shot.
    pub(super) fn settings<'a>(&self, all: &'a TrackSettings) -> Cow<'a, TrackSettings> {
        if *self == Self::default() {
            return Cow::Borrowed(all);
        }
        let mut own = all.clone();
        let names = [&mut own.cue, &mut own.object, &mut own.cue_markers, &mut own.object_markers];
        for (name, given) in names.into_iter().zip(&self.names) {
            if let Some(given) = given {
                name.clone_from(given);
            }
        }
        if self.states_balls() {
            own.balls = Balls::Stated;
        }
        own.capture_fps = self.capture_fps.or(own.capture_fps);
        Cow::Owned(own)
    }
}

impl Facts {
    /// Nothing is known of the shot.
    pub(super) fn unknown() -> Self {
        Self { spin: Spin::Unknown, labels: BTreeMap::new(), own: Own::default(), discs: None }
    }
}

/// The tracks of a disc, by their indices.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Disc {
    /// The centre, or points on a circle about it.
    pub centre: Vec<usize>,
    /// Further points on the disc.
    pub markers: Vec<usize>,
}

/// The tracks of one ball.
struct Ball {
    /// The ball's centre, or the points whose mean it is.
    centres: Vec<RawTrack>,
    /// Points on it.
    markers: Vec<RawTrack>,
}

/// Makes a shot of its rows. `Err` says everything that has to be given in dataset.toml first, or the first fault of the
/// rows.
pub(super) fn shot(
    mut raw: RawShot,
    mut facts: Facts,
    settings: &TrackSettings,
    calibration: &Calibration,
    notes: &Notes,
) -> Result<TrackShot, Vec<Wrong>> {
    let discs = facts.discs.take();
    let settings = &*facts.own.settings(settings);
    let mut tracks = std::mem::take(&mut raw.tracks);
    let mut names: Vec<_> = tracks.iter().map(|track| format!("\"{}\"", shortened(&track.name))).collect();
    names.dedup();
    names.truncate(12);
    let names = if names.is_empty() { "there are none".to_string() } else { names.join(", ") };
    let (cue, object) = if let Some(discs) = discs {
        let [cue, object] = grouped_balls(&mut tracks, discs, &raw, notes).map_err(|wrong| vec![wrong])?;
        (Ok(cue), Ok(object))
    } else {
        let mut ball = |keys: [&str; 2], centre: &Names, markers: &Names| {
            let mut ball = assign(&mut tracks, keys[0], centre, &names, &raw, notes)?;
            ball.markers.append(&mut assign(&mut tracks, keys[1], markers, &names, &raw, notes)?.centres);
            Ok(ball)
        };
        let cue = ball(["cue", "cue_markers"], &settings.cue, &settings.cue_markers);
        (cue, ball(["object", "object_markers"], &settings.object, &settings.object_markers))
    };
    let (cue, object) = match (cue, object) {
        (Ok(cue), Ok(object)) => (cue, object),
        (cue, object) => {
            // names that stand in the table of shots are wrong, and not the shot
            let stated = facts.own.states_balls();
            let checked = |wrong: Wrong| Wrong { is_damage: wrong.is_damage && !stated, ..wrong };
            let mut wrong: Vec<Wrong> = cue.err().into_iter().chain(object.err()).map(checked).collect();
            raw.tracks = tracks;
            if let Err(message) = time::settle(&mut raw, settings, &Notes::default()) {
                wrong.push(Wrong::input(raw.line, message));
            }
            return Err(wrong);
        }
    };
    for other in &tracks {
        let message =
            format!("the track \"{}\" is neither cue nor object; passed over", shortened(&other.name));
        notes.of(&raw.file).add(NAMES, other.line(), message);
    }
    of_balls(raw, cue, object, facts, (settings, calibration), notes).map_err(|wrong| vec![wrong])
}

/// Makes a shot of the tracks of its balls.
fn of_balls(
    mut raw: RawShot,
    cue: Ball,
    object: Ball,
    facts: Facts,
    (settings, calibration): (&TrackSettings, &Calibration),
    notes: &Notes,
) -> Result<TrackShot, Wrong> {
    let sizes = [&cue.centres, &cue.markers, &object.centres].map(Vec::len);
    raw.tracks = [cue.centres, cue.markers, object.centres, object.markers].into_iter().flatten().collect();
    let file = raw.file.clone();
    let log = notes.of(&file);
    let fps = time::settle(&mut raw, settings, notes).map_err(|message| Wrong::input(raw.line, message))?;
    for track in &mut raw.tracks {
        check::order(track, log)?;
    }
    check::stray(&mut raw.tracks, log);
    let mut rest = raw.tracks.into_iter();
    let mut take = |n: usize| rest.by_ref().take(n).collect::<Vec<_>>();
    let [mut cue_centres, mut cue_markers, mut object_centres] = sizes.map(&mut take);
    let mut object_markers: Vec<_> = rest.collect();
    let mut cue = mean(&mut cue_centres, &mut cue_markers);
    let mut object = mean(&mut object_centres, &mut object_markers);
    check::thaw(&mut cue, &mut object, fps, log)?;
    let swapped = check::unswap(&mut cue, &mut object, fps, log)?;
    if let Some(line) = swapped.filter(|_| !cue_markers.is_empty() || !object_markers.is_empty()) {
        let message = "cue and object ball have exchanged their names from here on, and with markers on them it is \
                       not certain which of these did; expected them set right, or the shot skipped";
        return Err(Wrong::damaged(line, message));
    }
    let (resolution, coarse) = resolution(&cue, &object, (settings, calibration));
    if let Some(message) = coarse {
        log.add(FORMAT, None, message);
    }
    let several = [sizes[0] > 1, sizes[2] > 1];
    let marker = |ball: TrackedBall, centre: &RawTrack, track: &RawTrack| Marker {
        ball,
        name: track.point.clone().unwrap_or_else(|| track.name.clone()),
        samples: if track.is_angle {
            turned(track, centre, calibration)
        } else {
            samples(track, calibration)
        },
    };
    let mut markers: Vec<_> = cue_markers.iter().map(|track| marker(TrackedBall::Cue, &cue, track)).collect();
    markers.extend(object_markers.iter().map(|track| marker(TrackedBall::Object, &object, track)));
    let (cue, object) = (samples(&cue, calibration), samples(&object, calibration));
    let centre = |ball: TrackedBall, several: bool, mean: Vec<Sample>| {
        if !(settings.discs && several) {
            return Ok(mean);
        }
        let own = markers.iter().filter(|marker| marker.ball == ball);
        let points: Vec<&[Sample]> = own.map(|marker| marker.samples.as_slice()).collect();
        circle_centres(&points).map_err(|message| Wrong::damaged(raw.line, message))
    };
    let (cue, object) =
        (centre(TrackedBall::Cue, several[0], cue)?, centre(TrackedBall::Object, several[1], object)?);
    let shot = TrackShot {
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
    if !settings.discs && is_held(&shot) {
        let message = "the object ball is at exactly one place before it moves, though other positions scatter: how that place was found \
                       is not known, and its frames count as many as the square root of their number";
        log.add(FORMAT, None, message);
    }
    let finite = |s: &Sample| [s.t, s.x, s.y].iter().all(|number| number.is_finite());
    let mut all = shot.cue.iter().chain(&shot.object).chain(shot.markers.iter().flat_map(|m| &m.samples));
    if all.all(finite) {
        return Ok(shot);
    }
    Err(Wrong::input(shot.line, "a position or time is too large to be converted"))
}

/// Whether the object ball at rest is held in its place: in several frames exactly, though the noise exceeds the step of the coordinates.
fn is_held(shot: &TrackShot) -> bool {
    /// Noise of one step leads to the same number in both coordinates so often by chance about once in 100 000 shots.
    const OFTEN: usize = 6;
    let same = |two: &[Sample]| [two[0].x, two[0].y] == [two[1].x, two[1].y];
    let held = 1 + shot.object.windows(2).take_while(|two| same(two)).count();
    held >= OFTEN && noise(shot) > shot.resolution[0].max(shot.resolution[1])
}

/// Takes the tracks of both discs out of the list, grouped by the distances that points keep.
fn grouped_balls(
    tracks: &mut Vec<RawTrack>,
    discs: Result<[Disc; 2], String>,
    raw: &RawShot,
    notes: &Notes,
) -> Result<[Ball; 2], Wrong> {
    let discs = discs.map_err(|message| Wrong::damaged(raw.line, message))?;
    let mut all: Vec<Option<RawTrack>> = std::mem::take(tracks).into_iter().map(Some).collect();
    let mut take =
        |which: &[usize]| -> Vec<RawTrack> { which.iter().filter_map(|i| all[*i].take()).collect() };
    let balls = discs.map(|disc| Ball { centres: take(&disc.centre), markers: take(&disc.markers) });
    tracks.extend(all.into_iter().flatten());
    let said = |ball: &Ball| {
        let names = |tracks: &[RawTrack]| quoted(tracks.iter().map(|track| &track.name));
        let centre = names(&ball.centres);
        match (ball.centres.len(), ball.markers.len()) {
            (1, 0) => centre,
            (1, _) => format!("{centre} (its centre) with {}", names(&ball.markers)),
            _ => format!("{centre} (on a circle about its centre)"),
        }
    };
    let message = format!(
        "[tracks] cue and object are not given: the disc that moves first, taken as cue, is {}; the other is {}",
        said(&balls[0]),
        said(&balls[1])
    );
    notes.of(&raw.file).add(NAMES, raw.line, message);
    Ok(balls)
}

/// Takes the tracks of a ball out of the list.
fn assign(
    tracks: &mut Vec<RawTrack>,
    ball: &str,
    names: &Names,
    there: &str,
    raw: &RawShot,
    notes: &Notes,
) -> Result<Ball, Wrong> {
    let mut found = Ball { centres: Vec::new(), markers: Vec::new() };
    for name in &names.0 {
        let (own, i) =
            find(tracks, name).map_err(|message| Wrong::input(raw.line, message))?.ok_or_else(|| {
                let apart = if tracks.len() + found.centres.len() < 2 {
                    " (one file a ball: named alike but for the ball, as in kick-A.txt and kick-B.txt)"
                } else {
                    ""
                };
                let meant = if name == ball { ", which is meant where the key is left out" } else { "" };
                let message = format!(
                    "there is no track \"{name}\" ([tracks] {ball} = {}{meant}); there are: {there}. Expected \
                     both balls in one file or shot{apart}, and their names in [tracks] cue and object",
                    names.shown()
                );
                // other shots may have both balls
                Wrong::damaged(raw.line, message)
            })?;
        if own != *name {
            let message = format!("the track \"{own}\" is [tracks] {ball} = \"{name}\"");
            notes.of(&raw.file).add(NAMES, tracks[i].line(), message);
        }
        found.centres.push(tracks.remove(i));
        let is_on_it = |track: &mut RawTrack| track.point.is_some() && track.name == own;
        found.markers.extend(tracks.extract_if(.., is_on_it));
    }
    Ok(found)
}

/// Numbers tracks of the same name, in their order: "A (1)", "A (2)".
pub(super) fn number_twins(tracks: &mut [RawTrack]) {
    let names: Vec<String> =
        tracks.iter().filter(|track| track.point.is_none()).map(|track| track.name.clone()).collect();
    for name in &names {
        if names.iter().filter(|other| *other == name).count() > 1 {
            let twins = tracks.iter_mut().filter(|track| track.point.is_none() && track.name == *name);
            for (i, track) in twins.enumerate() {
                track.name = format!("{name} ({})", i + 1);
            }
        }
    }
}

pub(super) fn last_word(name: &str) -> &str {
    name.rsplit(|c: char| c.is_whitespace() || c == '_').next().unwrap_or_default()
}

/// The track that a name of dataset.toml means, with the name that it has in the file.
pub(super) fn find(tracks: &[RawTrack], wanted: &str) -> Result<Option<(String, usize)>, String> {
    let ways: [&dyn Fn(&str) -> bool; 3] = [
        &|name| name == wanted,
        &|name| name.to_lowercase() == wanted.to_lowercase(),
        // Tracker calls them "mass A", or mass_A
        &|name| name.to_lowercase().starts_with("mass") && last_word(name) == wanted,
    ];
    for way in ways {
        let fits = |i: &usize| tracks[*i].point.is_none() && way(&tracks[*i].name);
        let found: Vec<usize> = (0..tracks.len()).filter(fits).collect();
        match found.as_slice() {
            [] => {}
            [one] => return Ok(Some((tracks[*one].name.clone(), *one))),
            many => return Err(several(tracks, many, wanted)),
        }
    }
    let twin = |name: &str| {
        let number = name.strip_prefix(wanted).and_then(|rest| rest.strip_prefix(" (")?.strip_suffix(')'));
        number.is_some_and(|number| number.parse::<usize>().is_ok())
    };
    let twins: Vec<usize> = (0..tracks.len()).filter(|i| twin(&tracks[*i].name)).collect();
    if twins.len() > 1 {
        return Err(several(tracks, &twins, wanted));
    }
    Ok(None)
}

fn several(tracks: &[RawTrack], which: &[usize], wanted: &str) -> String {
    let names: Vec<_> =
        which.iter().map(|i| format!("\"{}\" (line {})", tracks[*i].name, tracks[*i].line())).collect();
    format!(
        "{} tracks are named \"{wanted}\"; write in [tracks] which of them it is: {}",
        names.len(),
        names.join(", ")
    )
}

/// The mean of several points, which then are markers.
fn mean(centres: &mut Vec<RawTrack>, markers: &mut Vec<RawTrack>) -> RawTrack {
    if centres.len() < 2 {
        return centres.pop().unwrap_or_else(|| RawTrack::new("", None));
    }
    let names: Vec<_> = centres.iter().map(|track| track.name.as_str()).collect();
    let mut mean = RawTrack::new(names.join(" + "), None);
    let (first, others) = centres.split_at(1);
    for row in &first[0].rows {
        let mut sum = *row;
        for other in others {
            let found = other.at(row.time);
            sum.x += found.map_or(f64::NAN, |found| found.x);
            sum.y += found.map_or(f64::NAN, |found| found.y);
        }
        sum.x /= centres.len() as f64;
        sum.y /= centres.len() as f64;
        mean.rows.push(sum);
    }
    markers.append(centres);
    mean
}

/// Coarser coordinates than this, m, are worth a note: a ball that is tracked well errs by as much.
const COARSE: f64 = 1.5e-4;

/// The same of coordinates in pixels where no scale says how long one is.
const COARSE_PX: f64 = 0.1;

/// Step of the grid that the coordinates of both balls lie on, m, where it is at the first position; 0 where there is none. It is
/// recognised in the file's own unit, since a calibration by points bends it. A ball that hardly moves has that of the other. With what
/// there is to say of a coarse one, in pixels where the balls are yet to tell how long one is.
fn resolution(
    cue: &RawTrack,
    object: &RawTrack,
    (settings, calibration): (&TrackSettings, &Calibration),
) -> ([f64; 2], Option<String>) {
    let steps = [cue, object].map(|track| {
        let step = resolution::step(&[track]).or_else(|| resolution::step(&[cue, object]))?;
        let first = track.seen().next()?;
        let [x, y] = calibration.sd(first.x, first.y, [step; 2]);
        let step = (0.5 * (x * x + y * y)).sqrt();
        step.is_finite().then_some(step)
    });
    let steps = steps.map(|step| step.unwrap_or(0.0));
    let coarsest = steps[0].max(steps[1]);
    let (limit, rounded, unit) = match settings.unit {
        Some(Unit::Px) if settings.from_balls => (COARSE_PX, coarsest, "px"),
        _ => (COARSE, 1e3 * coarsest, "mm"),
    };
    let message = || {
        let least = rounded / 12.0_f64.sqrt();
        format!("positions are rounded to {rounded:.2} {unit}: each errs by {least:.2} {unit} at least")
    };
    (steps, (coarsest > limit).then(message))
}

fn samples(track: &RawTrack, calibration: &Calibration) -> Vec<Sample> {
    let rows = track.rows.iter().enumerate().filter(|(_, row)| !row.is_gap());
    let sample = |(i, row): (usize, &Row)| {
        let [x, y] = calibration.metres(row.x, row.y);
        let sd = track.sds.get(i).filter(|sd| !sd[0].is_nan() && !sd[1].is_nan());
        let sd = sd.map(|sd| calibration.sd(row.x, row.y, *sd));
        Sample { t: row.time + calibration.delay(row.y), x, y, sd }
    };
    let mut samples = Vec::with_capacity(rows.clone().count());
    samples.extend(rows.map(sample));
    samples
}

/// Distance of a point that stands for the angle of a disc from its centre, m: any will do.
const ARM: f64 = 0.02;

/// A point that turns with the disc, for angles in the place of positions: they are told from the axes of the file.
fn turned(angles: &RawTrack, centre: &RawTrack, calibration: &Calibration) -> Vec<Sample> {
    let point = |row: &Row| {
        let middle = centre.at(row.time).filter(|row| !row.is_gap())?;
        let (sin, cos) = row.x.sin_cos();
        let [x, y] = calibration.metres(middle.x, middle.y);
        let [along, up] = calibration.metres(middle.x + cos, middle.y + sin);
        let length = (along - x).hypot(up - y);
        let [x, y] = [x + ARM * (along - x) / length, y + ARM * (up - y) / length];
        Some(Sample { t: row.time + calibration.delay(middle.y), x, y, sd: None })
    };
    angles.seen().filter_map(point).collect()
}
