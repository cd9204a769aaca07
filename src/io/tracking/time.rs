//! The time of each row, from the camera's frame rate and the times of the file: its clock shows
//! frame n at t = t₀ + n/rate, rounded; whole numbers n are searched for that agree with all times.

use super::raw::{Job, RawShot, RawTrack, Row, sorted, span};
use super::words::Unit;
use crate::io::error::{Subject, message, quoted};
use crate::numerics::median;

/// Largest deviation from even steps beyond rounding, in steps: of frame rates, of times from whole
/// frames, and of coordinates from a grid. Eight random coordinates fit one of the grids tried in
/// 12·0.04⁸ = 8e-11 of tracks.
pub(super) const MAX_OFF: f64 = 0.02;
/// Largest deviation, by rounding or a varying clock, at which a time shows its frame, in frames.
const MAX_ROUNDING: f64 = 0.3;
/// Frames per second of time codes.
const CODE_RATES: [f64; 6] = [24.0, 25.0, 30.0, 48.0, 50.0, 60.0];

const NEEDS_RATE: &str = "expected [video] capture_fps, the frames per second that the camera recorded";

/// Converts the times of a shot's rows to seconds of the camera's clock and returns its frame rate;
/// `fps` is the stated one. `Err`: the reason, and the remedy.
pub(super) fn convert(shot: &mut RawShot, fps: Option<f64>, job: Job) -> Result<f64, String> {
    let (stated, video) = (shot.stated, &job.settings.video);
    if video.has_unknown_rate() && (stated.time != Some(Unit::Frames) || stated.fps.is_some()) {
        let message = "[video] capture_fps is \"unknown\", but this file has times; expected frame numbers, or no capture_fps";
        return Err(message.to_owned());
    }
    let differs = |(given, own): &(f64, f64)| (given / own - 1.0).abs() > MAX_OFF;
    if let Some((given, own)) = fps.zip(stated.fps).filter(differs) {
        return Err(message!("contradicted_rate", own, given));
    }
    let fps = fps.or(stated.fps);
    let rate = video.playback_fps.or(fps);
    let is_fixed = stated.rounding.is_some() || stated.time == Some(Unit::Frames);
    let unit = job.settings.tracks.time_unit.filter(|_| !is_fixed).or(stated.time);
    let unit = unit.map_or_else(|| guess_unit(shot, rate), Ok)?;
    let Some(second) = unit.seconds() else {
        let fps = fps.ok_or_else(|| format!("time is in frames; {NEEDS_RATE}"))?;
        let mut rows = shot.tracks.iter().flat_map(|track| &track.rows);
        if let Some(Row { time, line, .. }) = rows.find(|row| row.time.fract() != 0.0) {
            let hint = "thousands have no mark, and times need [tracks] time_unit";
            return Err(format!("frame {time} is not a whole number (line {line}); {hint}"));
        }
        shot.map_times(|time| time / fps);
        return Ok(fps);
    };
    let mut grid = Grid::of(shot, second);
    let line = shot.line;
    let note = |message: String| job.note(Subject::Clock, line, message);
    let (times, fps) = if let Some((rate, fps)) = rate.zip(fps) {
        grid.count_repeated(shot, second, rate)?;
        (grid.camera_times([rate, fps], video.playback_fps.is_some(), note)?, fps)
    } else {
        let (frames, fps) = grid.own_frames();
        let frames = frames.filter(|_| grid.spacing.is_finite());
        let frames = frames.ok_or_else(|| format!("times are not regularly spaced; {NEEDS_RATE}"))?;
        note(format!("capture_fps is not given; taken from the spacing of the times, {fps:.4} fps"));
        (grid.without_rounding(&frames, fps), fps)
    };
    for (i, row) in shot.tracks.iter_mut().flat_map(|track| track.rows.iter_mut().enumerate()) {
        let place = grid.times.partition_point(|time| *time < row.time * second);
        row.time = times[if grid.are_rows { i } else { place }];
    }
    Ok(fps)
}

/// The frames behind the times of a shot.
struct Grid {
    /// Times of the file's clock, s, ascending: of each row if rows are counted, else all different.
    times: Vec<f64>,
    are_rows: bool,
    /// Rounding of the times, s; 0 if they are exact.
    resolution: f64,
    /// Time between neighbouring frames, s; NaN for less than two times.
    spacing: f64,
}

impl Grid {
    fn of(shot: &RawShot, second: f64) -> Self {
        let times = shot.times();
        let resolution = shot.stated.rounding.unwrap_or_else(|| resolution(&times) * second);
        let times: Vec<f64> = times.iter().map(|time| time * second).collect();
        let spacing = spacing(&times, resolution);
        Self { times, are_rows: false, resolution, spacing }
    }

    /// Makes every row a frame if neighbours share a time on a coarse clock.
    fn count_repeated(&mut self, shot: &RawShot, second: f64, rate: f64) -> Result<(), String> {
        let is_whole = |t: &f64| (t * rate - (t * rate).round()).abs() < MAX_OFF;
        let has_time_per_frame = self.resolution * rate < 1.5 && self.times.iter().all(is_whole);
        let times_of =
            |track: &RawTrack| -> Vec<f64> { track.rows.iter().map(|row| row.time * second).collect() };
        let mut all: Vec<Vec<f64>> = shot.tracks.iter().map(times_of).collect();
        let repeats = all.iter().any(|times| times.windows(2).any(|two| two[0] == two[1]));
        if !repeats || self.resolution <= MAX_ROUNDING / rate || has_time_per_frame {
            return Ok(());
        }
        if all.iter().any(|times| *times != all[0]) {
            return Err(message!("coarse_times", resolution => self.resolution, rate));
        }
        *self = Self { times: all.swap_remove(0), are_rows: true, spacing: rate.recip(), ..*self };
        Ok(())
    }

    /// Returns the frame at each time, from the first on; `None` if steps are not whole frames.
    fn frames(&self, spacing: f64) -> Option<Vec<f64>> {
        let first = *self.times.first()?;
        let nearest: Vec<f64> = self.times.iter().map(|t| ((t - first) / spacing).round()).collect();
        let is_exact =
            late(&nearest, &self.times, spacing.recip()).all(|late| late.abs() < MAX_OFF * spacing);
        if is_exact && !self.are_rows {
            return Some(nearest);
        }
        if self.resolution > MAX_ROUNDING * spacing {
            // the clock is too coarse: rows are the frames, and each must fit its time
            let rows: Vec<f64> = (0..self.times.len()).map(|row| row as f64).collect();
            let [low, high] = span(late(&rows, &self.times, spacing.recip()));
            return (high - low <= 1.02 * self.resolution).then_some(rows);
        }
        let (mut frame, mut before) = (0.0, first);
        let next = |t: &f64| {
            let step = (t - before) / spacing;
            let whole = step.round();
            let off = MAX_OFF * whole.max(1.0) + 1.02 * self.resolution / spacing;
            frame += whole;
            let stays = whole == 0.0 && *t > before;
            before = *t;
            ((step - whole).abs() <= off && !stays).then_some(frame)
        };
        self.times.iter().map(next).collect()
    }

    /// Returns the frame rate by the given frames.
    fn mean_rate(&self, frames: &[f64]) -> f64 {
        let [first, last] = span(self.times.iter().copied());
        frames.last().copied().unwrap_or_default().max(1.0) / (last - first)
    }

    /// Returns the frames of the coarsest grid of all times, and the roundest rate possible.
    fn own_frames(&self) -> (Option<Vec<f64>>, f64) {
        let steps = || self.times.windows(2).map(|two| two[1] - two[0]);
        // most steps may be of several frames
        let least = steps().fold(f64::INFINITY, f64::min);
        let near: Vec<f64> = steps().filter(|step| *step <= least + 1.02 * self.resolution).collect();
        let shortest = near.iter().sum::<f64>() / near.len() as f64;
        let frames = [self.spacing, shortest].into_iter().find_map(|spacing| self.frames(spacing));
        let fps = frames.as_ref().map_or(self.spacing.recip(), |frames| self.mean_rate(frames));
        let [first, last] = span(self.times.iter().copied());
        let slack = (1.02 * self.resolution / (last - first)).max(1e-6);
        let possible = |rate: &f64| (fps / rate - 1.0).abs() <= slack;
        let units = [3, 2, 1, 0, -2].map(|digits| 10.0_f64.powi(digits));
        let rounded = units.map(|unit| (fps / unit).round() * unit);
        let rate = rounded.into_iter().find(possible).unwrap_or(fps);
        // a lost frame on a coarse clock makes the spacing longer
        (self.frames(rate.recip()).or(frames), rate)
    }

    /// Returns the times as written or, if the clock is coarse and steady, without their rounding.
    fn without_rounding(&self, frames: &[f64], rate: f64) -> Vec<f64> {
        let is_steady = first_apart(frames, &self.times, self.resolution, rate).is_none();
        if is_steady && self.resolution > MAX_OFF / rate {
            return frames.iter().map(|frame| self.times[0] + frame / rate).collect();
        }
        self.times.clone()
    }

    /// Returns whether the typical spacing fits this rate.
    fn fits(&self, rate: f64) -> bool {
        let count = self.times.len() as f64;
        let slack = (2.0 * self.resolution / (count * self.spacing)).min(0.1);
        self.spacing.is_nan() || (self.spacing * rate - 1.0).abs() <= MAX_OFF + slack
    }

    /// Returns the times of the camera at `fps` if those of the file follow `rate`: frame number /
    /// `fps`, or as written if they follow no frames. A stated rate may mean frames left out.
    fn camera_times(
        &self,
        [rate, fps]: [f64; 2],
        is_stated: bool,
        note: impl Fn(String),
    ) -> Result<Vec<f64>, String> {
        let own = self.spacing.recip();
        if !self.fits(rate) && (!is_stated || own > rate) {
            let (spacing, own) = (format!("{:.6}", self.spacing), format!("{own:.4}"));
            return Err(message!("other_rate", spacing, own, rate, fps, is_stated));
        }
        // the spacing shows how a clock drifts, but a lost frame on a coarse one makes it longer
        let drifting = || self.frames(self.spacing).filter(|_| !is_stated);
        let Some(frames) = self.frames(rate.recip()).or_else(drifting) else {
            if self.resolution >= MAX_ROUNDING / rate {
                return Err(message!("coarse_times", resolution => self.resolution, rate));
            }
            note(message!("unsteady_times", rate));
            return Ok(self.times.iter().map(|t| t * rate / fps).collect());
        };
        let first = self.times.first().copied().unwrap_or_default();
        if let Some(row) = first_apart(&frames, &self.times, self.resolution, rate).filter(|_| !is_stated) {
            note(message!("drifting_times", frame => frames[row], fps));
            // rounding is averaged out if the clock is steady
            return Ok(self.without_rounding(&frames, self.mean_rate(&frames)));
        }
        let number = (first * rate).round();
        let is_on_grid = (first - number / rate).abs() <= self.resolution + 1e-6 / rate;
        let start = if is_on_grid { number } else { first * rate };
        let times: Vec<f64> = frames.iter().map(|frame| (start + frame) / fps).collect();
        if self.are_rows {
            note(format!("times are coarser than frames; rebuilt from the number of the row at {fps} fps"));
        } else if times.iter().zip(&self.times).any(|(new, time)| (new - time).abs() > 1e-6 / fps) {
            note(format!("times as written are replaced by frame number / capture_fps ({fps})"));
        }
        Ok(times)
    }
}

/// Returns the frame rate that the times of a shot follow; `None` for numbers of frames.
pub(super) fn followed(shot: &RawShot) -> Option<f64> {
    let second = shot.stated.time.map_or(Some(1.0), Unit::seconds)?;
    let (_, fps) = Grid::of(shot, second).own_frames();
    Some(fps).filter(|fps| *fps > 0.0 && fps.is_finite())
}

/// Returns the largest power of ten of which all times are multiples, 0 if it is below a millionth.
pub(super) fn resolution(times: &[f64]) -> f64 {
    let is_whole = |x: f64| (x - x.round()).abs() < (1e-9 * x.abs().max(1.0) + 1e-7).min(MAX_OFF);
    let fits = |scale: &f64| times.iter().all(|t| is_whole(t * scale));
    (0..=6).map(|digits| 10.0_f64.powi(digits)).find(fits).map_or(0.0, f64::recip)
}

/// Returns the mean step of one frame, in which rounding cancels and gaps do not count.
fn spacing(times: &[f64], resolution: f64) -> f64 {
    let steps = sorted(times.windows(2).map(|two| two[1] - two[0]));
    let Some(median) = steps.get(steps.len().saturating_sub(1) / 2) else { return f64::NAN };
    let within = |off: f64| -> Vec<f64> {
        let limit = 1.02 * resolution + off * median;
        steps.iter().copied().filter(|step| (step - median).abs() <= limit).collect()
    };
    let steady = within(MAX_OFF);
    if 2 * steady.len() >= steps.len() {
        return steady.iter().sum::<f64>() / steady.len() as f64;
    }
    // a step of a varying clock is of several frames if it is much longer than one
    let longest = 1.02 * resolution + (1.0 + 2.5 * MAX_ROUNDING) * median;
    let frames = |step: &f64| if *step <= longest { 1.0 } else { (step / median).round() };
    steps.iter().sum::<f64>() / steps.iter().map(frames).sum::<f64>()
}

/// Returns how much later than its frame at this rate, frames/s, each time is, s.
fn late(frames: &[f64], seconds: &[f64], rate: f64) -> impl Iterator<Item = f64> {
    let [first_frame, first_second] = [frames, seconds].map(|all| all.first().copied().unwrap_or_default());
    let both = frames.iter().zip(seconds);
    both.map(move |(frame, second)| (second - first_second) - (frame - first_frame) / rate)
}

/// Returns the first row whose time and frame number, from the first row, contradict each other at
/// this rate, frames/s, by more than half a frame and the rounding of the times.
pub(super) fn first_apart(frames: &[f64], seconds: &[f64], rounding: f64, rate: f64) -> Option<usize> {
    late(frames, seconds, rate).position(|late| late.abs() > 0.5 / rate + rounding)
}

/// Returns the unit of a time column without one: that which agrees with the frame rate.
fn guess_unit(shot: &RawShot, rate: Option<f64>) -> Result<Unit, String> {
    let grid = Grid::of(shot, 1.0);
    let (are_whole, spacing) = (grid.resolution >= 1.0, grid.spacing);
    let is_near = |unit: &Unit| match (unit.seconds(), rate) {
        (Some(second), Some(rate)) => grid.fits(rate * second),
        (Some(second), None) => second == 1.0 && !are_whole && spacing < 0.2,
        (None, _) => are_whole && rate.is_some() && (spacing - 1.0).abs() < MAX_OFF,
    };
    let units: Vec<Unit> = Unit::S.alike().filter(is_near).collect();
    match units[..] {
        [unit] => Ok(unit),
        // a frame each millisecond: both units agree
        [Unit::Frames, Unit::Ms] if rate == Some(1000.0) => Ok(Unit::Frames),
        _ => Err(message!("unknown_time_unit", spacing, units => quoted(Unit::S.names_alike()))),
    }
}

/// Converts times h:mm:ss:ff to numbers of frames; returns the frame rate. `None` for hundredths:
/// frames begin again at a film's rate when a second is full.
pub(super) fn count_frames(shots: &mut [RawShot]) -> Option<f64> {
    let split = |time: f64| {
        let whole = (time + 1e-6).floor();
        (whole, (100.0 * (time - whole)).round())
    };
    let mut times = sorted(shots.iter().flat_map(RawShot::times));
    times.dedup();
    let parts: Vec<(f64, f64)> = times.iter().map(|time| split(*time)).collect();
    let last = parts.iter().map(|(_, frame)| *frame).fold(0.0, f64::max);
    let full: Vec<_> = parts.windows(2).filter(|two| two[1].0 == two[0].0 + 1.0).collect();
    let within = parts.windows(2).filter(|two| two[1].0 == two[0].0).map(|two| two[1].1 - two[0].1);
    let step = Some(median(within.collect())).filter(|step| step.is_finite() && !full.is_empty())?;
    let follows = |rate: f64| full.iter().all(|two| rate + two[1].1 - two[0].1 == step);
    let rate = CODE_RATES.into_iter().find(|rate| *rate > last && follows(*rate))?;
    for shot in shots {
        let number = |(whole, frame): (f64, f64)| rate * whole + frame;
        shot.map_times(|time| number(split(time)));
    }
    Some(rate)
}
