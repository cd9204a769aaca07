//! Conversion of a file's rows to a shot: balls, times, and positions in metres.

use super::Facts;
use super::camera::Calibration;
use super::names::{assign, find_discs, number_twins};
use super::raw::{Job, RawShot, RawTrack, Role, Row, Subject, sorted};
use super::repair::{self, Wrong};
use super::time;
use super::words::Unit;
use crate::film::rigid_body::circle_centres;
use crate::io::text::shortened;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};

/// Least number of different steps between neighbouring coordinates: fewer fit some grid by chance.
const MIN_GAPS: usize = 8;
/// Largest ratio of the smallest step between coordinates to the grid: fast balls skip steps.
const MAX_SKIPPED: usize = 12;
/// Largest deviation of coordinates from the grid, in steps, if they were scaled and printed with
/// few decimals. Eight random ones fit one of the grids tried in 12·0.04⁸ = 8e-11 of tracks.
const MAX_DEVIATION: f64 = 0.02;
/// Relative difference below which two coordinates are the same number, computed differently.
const SAME_NUMBER: f64 = 1e-12;

/// Returns the shot of a file's rows. `Err`: all missing statements, or else the first fault.
pub(super) fn shot(mut raw: RawShot, mut facts: Facts, job: Job) -> Result<TrackShot, Vec<Wrong>> {
    let settings = job.settings;
    number_twins(&mut raw.tracks);
    let names_balls = facts.names_balls || settings.tracks.cue.is_some() || settings.tracks.object.is_some();
    if settings.discs && !names_balls {
        find_discs(&raw, &mut facts, job).map_err(|wrong| vec![wrong])?;
    }
    if let Err(mut wrong) = assign(&mut raw, &facts.names, job) {
        // wrong names in the table of shots are its fault, not the shot's
        for wrong in &mut wrong {
            wrong.is_damage &= !facts.names_balls;
        }
        let time = time::convert(&mut raw, facts.capture_fps, job);
        wrong.extend(time.err().map(|message| Wrong::input(raw.line, message)));
        return Err(wrong);
    }
    for other in raw.tracks.extract_if(.., |track| track.role.is_none()) {
        let message = format!("the track \"{}\" is not cue or object; passed over", shortened(&other.name));
        job.note(Subject::Names, other.line(), message);
    }
    raw.tracks.sort_by_key(|track| track.role);
    of_balls(raw, facts, job).map_err(|wrong| vec![wrong])
}

fn of_balls(mut raw: RawShot, facts: Facts, job: Job) -> Result<TrackShot, Wrong> {
    let calibration = &job.settings.calibration(raw.stated.unit);
    let fps = time::convert(&mut raw, facts.capture_fps, job);
    let fps = fps.map_err(|message| Wrong::input(raw.line, message))?;
    repair::unite_frames(&mut raw, job)?;
    let mut centres = [0, 1].map(|ball| centre(&mut raw.tracks, ball));
    let of = |ball: usize, is_marker: bool| {
        let is_it = move |role: Role| (role.ball, role.is_marker) == (ball, is_marker);
        raw.tracks.iter().filter(move |track| track.role.is_some_and(is_it))
    };
    let step = grid_step(&centres.each_ref()).unwrap_or(0.0);
    repair::remove_repeated_frames(&mut centres, fps, step, job)?;
    let swapped = repair::undo_swaps(&mut centres, fps, job)?;
    if let Some(line) = swapped.filter(|_| !raw.tracks.is_empty()) {
        let message = "cue and object ball have exchanged their names from here on, and with markers on them it is \
                       not certain which of both did; expected them set right, or the shot skipped";
        return Err(Wrong::damaged(line, message));
    }
    let resolution = resolution(&centres, calibration, job);
    let mut paths = centres.each_ref().map(|centre| samples(centre, calibration));
    let mut markers: Vec<Marker> = Vec::new();
    for (i, ball) in [TrackedBall::Cue, TrackedBall::Object].into_iter().enumerate() {
        let first = markers.len();
        for track in of(i, true).chain(of(i, false)) {
            let name = track.point.as_ref().unwrap_or(&track.name).clone();
            let samples = if track.is_angle {
                turned(track, &centres[i], calibration)
            } else {
                samples(track, calibration)
            };
            markers.push(Marker { ball, name, samples });
        }
        if job.settings.discs && of(i, false).next().is_some() {
            let points: Vec<&[Sample]> =
                markers[first..].iter().map(|marker| marker.samples.as_slice()).collect();
            paths[i] = circle_centres(&points).map_err(|message| Wrong::damaged(raw.line, message))?;
        }
    }
    let spin = facts.spin();
    let mut shot = TrackShot {
        file: raw.file,
        line: raw.line,
        labels: facts.labels,
        markers,
        position_sd: job.settings.tracks.position_sd_m,
        resolution,
        ..TrackShot::new(raw.name, fps, spin, paths)
    };
    let is_finite = |s: &mut Sample| [s.t, s.x, s.y].iter().all(|number| number.is_finite());
    if shot.samples_mut().all(is_finite) {
        return Ok(shot);
    }
    Err(Wrong::input(shot.line, "a position or time is too large to be converted"))
}

/// Removes and returns the centre of a ball, or returns the mean of several points, which remain.
fn centre(tracks: &mut Vec<RawTrack>, ball: usize) -> RawTrack {
    let is_of = |track: &RawTrack| track.role.is_some_and(|role| role.ball == ball && !role.is_marker);
    let points: Vec<&RawTrack> = tracks.iter().filter(|track| is_of(track)).collect();
    if points.len() < 2 {
        return tracks.extract_if(.., |track| is_of(track)).next().unwrap_or_default();
    }
    let mean = |row: &Row| {
        let place = |track: &&RawTrack, k: usize| track.at(row.time).map_or(f64::NAN, |row| row.place[k]);
        let axis = |k: usize| points.iter().map(|track| place(track, k)).sum::<f64>();
        Row { place: [axis(0), axis(1)].map(|sum| sum / points.len() as f64), ..*row }
    };
    let names: Vec<_> = points.iter().map(|track| track.name.as_str()).collect();
    let rows = points[0].rows.iter().map(mean).collect();
    RawTrack { name: names.join(" + "), rows, ..RawTrack::default() }
}

/// Returns the grid step of the coordinates of each ball, m, at its first position (0 without a
/// grid), and notes if one is coarse, in pixels if the scale is not known. The step is determined
/// in the file's unit, since a calibration by points bends the grid. A ball that is nearly at rest
/// has the other ball's step.
fn resolution(centres: &[RawTrack; 2], calibration: &Calibration, job: Job) -> [f64; 2] {
    /// Step of the coordinates, m and px, above which it is noted: good tracking errs by as much.
    const COARSE_STEP: f64 = 1.5e-4;
    const COARSE_PX: f64 = 0.1;
    let step = |track: &RawTrack| {
        let step = grid_step(&[track]).or_else(|| grid_step(&centres.each_ref()))?;
        let first = track.seen().next()?;
        let [x, y] = calibration.sd(first.place, [step; 2]);
        Some((0.5 * (x * x + y * y)).sqrt()).filter(|step| step.is_finite())
    };
    let steps = centres.each_ref().map(|track| step(track).unwrap_or(0.0));
    let coarsest = steps[0].max(steps[1]);
    let (limit, rounded, unit) = match job.settings.scale.length_unit {
        Some(Unit::Px) if job.settings.from_balls => (COARSE_PX, coarsest, "px"),
        _ => (COARSE_STEP, 1e3 * coarsest, "mm"),
    };
    if coarsest > limit {
        let least = rounded / 12.0_f64.sqrt();
        let message =
            format!("positions are rounded to {rounded:.2} {unit}: each errs by {least:.2} {unit} at least");
        job.note(Subject::Format, None, message);
    }
    steps
}

/// Returns the step of the grid on which all coordinates of some tracks lie, in the unit of the
/// file; `None` if they lie on none, or if too few differ.
fn grid_step(tracks: &[&RawTrack]) -> Option<f64> {
    let mut gaps = Vec::new();
    for axis in [0, 1] {
        let mut values = sorted(tracks.iter().flat_map(|track| track.seen()).map(|row| row.place[axis]));
        values.dedup_by(|later, earlier| *later - *earlier <= SAME_NUMBER * later.abs());
        gaps.extend(values.windows(2).map(|two| two[1] - two[0]));
    }
    let gaps = sorted(gaps.into_iter());
    let smallest = gaps.first().filter(|_| gaps.len() >= MIN_GAPS)?;
    let step = (1..=MAX_SKIPPED).find_map(|parts| fitted(&gaps, smallest / parts as f64))?;
    (step > 0.0 && step.is_finite()).then_some(step)
}

/// Returns the step near `guess` of which all these lengths (ascending) are multiples.
fn fitted(gaps: &[f64], guess: f64) -> Option<f64> {
    // least squares of d = k·step, each length with the step from all shorter ones
    let (mut products, mut squares) = (guess, 1.0);
    for gap in gaps {
        let step: f64 = products / squares;
        let multiple = (gap / step).round();
        if !((gap / step - multiple).abs() <= MAX_DEVIATION && multiple >= 1.0) {
            return None;
        }
        products += multiple * gap;
        squares += multiple * multiple;
    }
    Some(products / squares)
}

fn samples(track: &RawTrack, calibration: &Calibration) -> Vec<Sample> {
    let sample = |row: &Row| {
        let is_stated = row.sd.iter().all(|sd| !sd.is_nan());
        let sd = is_stated.then(|| calibration.sd(row.place, row.sd));
        let t = row.time + calibration.delay(row.place[1]);
        Sample { sd, ..Sample::new(t, calibration.metres(row.place)) }
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
    let point = |[i, j]: [usize; 2]| {
        let (row, centre) = (&angles.rows[i], &centre.rows[j]);
        let (sin, cos) = row.place[0].sin_cos();
        let middle = centre.place;
        let [x, y] = calibration.metres(middle);
        let [along, up] = calibration.metres([middle[0] + cos, middle[1] + sin]);
        let length = (along - x).hypot(up - y);
        let place = [x + ARM * (along - x) / length, y + ARM * (up - y) / length];
        Sample::new(row.time + calibration.delay(middle[1]), place)
    };
    angles.frames_with(centre).into_iter().map(point).collect()
}
