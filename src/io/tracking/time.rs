//! The time of each row, from the camera's frame rate and the times of the file.

use super::input::{Log, Subject};
use super::raw::{RawShot, sorted, span};
use super::settings::TrackSettings;
use super::units::TimeUnit;

/// Largest relative deviation of the spacing of times from 1/`capture_fps`.
const MAX_MISMATCH: f64 = 0.02;
/// Largest deviation of a step from a whole number of frames, beyond its rounding.
const MAX_OFF_GRID: f64 = 0.02;
/// Largest relative difference of an even clock's steps beyond rounding, and of a varying one's.
const MAX_EVEN: f64 = 0.01;
const MAX_VARYING: f64 = 0.3;

/// The grid of frames behind the times of a shot.
struct Grid {
    /// Different times, ascending, in seconds of the file's own clock.
    times: Vec<f64>,
    /// Rounding of the times; 0 if they are exact.
    resolution: f64,
    /// Time between neighbouring frames; NaN for less than two times.
    spacing: f64,
}

/// Converts the times of a shot's rows to seconds of the camera's clock and returns its frame rate;
/// `fps` is the stated one. `Err`: the reason, and the remedy.
pub(super) fn convert(
    shot: &mut RawShot,
    fps: Option<f64>,
    settings: &TrackSettings,
    log: Log,
) -> Result<f64, String> {
    let (clock, playback_fps) = (shot.clock, settings.video.playback_fps);
    if settings.video.has_unknown_rate() && (clock.unit != Some(TimeUnit::Frames) || clock.fps.is_some()) {
        let message = "[video] capture_fps is \"unknown\", but this file has times; expected frame numbers, or no capture_fps";
        return Err(message.to_string());
    }
    if let (Some(given), Some(stated)) = (fps, clock.fps)
        && (given / stated - 1.0).abs() > MAX_MISMATCH
    {
        return Err(format!(
            "the file states {stated} fps, but [video] capture_fps is {given}; expected the same, or no capture_fps"
        ));
    }
    let fps = fps.or(clock.fps);
    let rate = playback_fps.or(fps);
    let stated_unit = settings.tracks.time_unit.filter(|_| clock.rounding.is_none());
    let unit = match clock.unit {
        Some(TimeUnit::Frames) => TimeUnit::Frames,
        Some(unit) => stated_unit.unwrap_or(unit),
        None => stated_unit.map_or_else(|| guess_unit(shot, rate), Ok)?,
    };
    let Some(second) = unit.seconds() else {
        let missing =
            "time is in frames; expected [video] capture_fps, the frames per second that the camera recorded";
        let fps = fps.ok_or(missing)?;
        if let Some(frame) = shot.times.iter().position(|time| time.fract() != 0.0) {
            let line = shot.tracks.iter().map(|track| track.rows[frame].line).find(|line| *line > 0);
            return Err(format!(
                "line {}: frame {} is not a whole number; if it is a time, say [tracks] time_unit",
                line.unwrap_or_default(),
                shot.times[frame]
            ));
        }
        shot.times.iter_mut().for_each(|time| *time /= fps);
        return Ok(fps);
    };
    let grid = Grid::of(shot, second);
    shot.times.iter_mut().for_each(|time| *time *= second);
    let line = shot.line;
    let note = |message: String| log.add(Subject::Clock, line, message);
    let Some((rate, fps)) = rate.zip(fps) else {
        let (frames, fps) = grid.own_frames();
        let is_regular = |two: &&[f64]| ((two[1] - two[0]) / grid.spacing - 1.0).abs() < 0.1;
        let irregular = grid.times.windows(2).filter(|two| !is_regular(two)).count();
        let is_coarse = grid.is_coarse(grid.spacing);
        let why = match &frames {
            _ if grid.spacing.is_nan() => "fewer than two times, which give no frame rate",
            None if is_coarse || irregular * 4 >= grid.times.len() => "times are not regularly spaced",
            _ => {
                note(format!("capture_fps is not given; taken from the spacing of the times, {fps:.4} fps"));
                if let Some(frames) = frames.filter(|_| is_coarse) {
                    replace(shot, &grid.times, |i| grid.times[0] + frames[i] / fps);
                }
                return Ok(fps);
            }
        };
        return Err(format!(
            "{why}; expected [video] capture_fps, the frames per second that the camera recorded"
        ));
    };
    let repeats = grid.times.len() < shot.times.len();
    if repeats && grid.resolution > 0.3 / rate && !grid.has_time_per_frame(rate) {
        count_frames(shot, &grid, [rate, fps])?;
        let rounding = grid.resolution;
        note(format!("times are rounded to {rounding} s; rebuilt from the number of the row at {fps} fps"));
        return Ok(fps);
    }
    let times = grid.camera_times([rate, fps], playback_fps.is_some(), note)?;
    replace(shot, &grid.times, |i| times[i]);
    Ok(fps)
}

fn replace(shot: &mut RawShot, times: &[f64], new: impl Fn(usize) -> f64) {
    for time in &mut shot.times {
        let i = times.partition_point(|t| *t < *time);
        *time = new(i.min(times.len() - 1));
    }
}

impl Grid {
    /// Returns the grid of times in this unit.
    fn of(shot: &RawShot, second: f64) -> Self {
        let times = shot.instants();
        let resolution = shot.clock.rounding.unwrap_or_else(|| resolution(&times) * second);
        let times: Vec<f64> = times.iter().map(|time| time * second).collect();
        let spacing = spacing(&times, resolution);
        Self { times, resolution, spacing }
    }

    /// Returns whether a coarse clock has a time of its own for each frame, so that rows with equal
    /// times are one frame twice.
    fn has_time_per_frame(&self, rate: f64) -> bool {
        let is_whole = |t: &f64| (t * rate - (t * rate).round()).abs() < 1e-3;
        self.resolution * rate < 1.5 && self.times.iter().all(is_whole)
    }

    fn is_coarse(&self, spacing: f64) -> bool {
        self.resolution > MAX_OFF_GRID * spacing
    }

    /// Returns whether deviations from expected times, and 0, are within the rounding.
    fn is_rounding(&self, late: impl Iterator<Item = f64>) -> bool {
        let [low, high] = span([0.0].into_iter().chain(late));
        high - low <= 1.02 * self.resolution
    }

    /// Returns the frame number of each time from the first one on; `None` if the steps are not
    /// whole frames of `spacing` (within the rounding and [`MAX_OFF_GRID`] of a frame).
    fn frames(&self, spacing: f64) -> Option<Vec<f64>> {
        let first = *self.times.first()?;
        let exact = |t: &f64| ((t - first) / spacing).round();
        let is_exact = |t: &f64| ((t - first) / spacing - exact(t)).abs() < 1e-3;
        if self.times.iter().all(is_exact) {
            return Some(self.times.iter().map(exact).collect());
        }
        if self.resolution > 0.3 * spacing {
            // the clock is too coarse: rows are the frames, and each must fit its time
            let late = self.times.iter().enumerate().map(|(i, t)| t - first - i as f64 * spacing);
            return self.is_rounding(late).then(|| (0..self.times.len()).map(|i| i as f64).collect());
        }
        let (mut frame, mut before) = (0.0, first);
        let next = |t: &f64| {
            let step = (t - before) / spacing;
            let whole = step.round();
            let off = MAX_OFF_GRID * whole.max(1.0) + 1.02 * self.resolution / spacing;
            frame += whole;
            let stays = whole == 0.0 && *t > before;
            before = *t;
            ((step - whole).abs() <= off && !stays).then_some(frame)
        };
        self.times.iter().map(next).collect()
    }

    /// Returns the frame rate by the given frames, or without frames by the spacing.
    fn mean_rate(&self, frames: Option<&Vec<f64>>) -> f64 {
        let ends = self.times.first().zip(self.times.last());
        let mean = |((first, last), frame): ((&f64, &f64), &f64)| frame.max(1.0) / (last - first);
        ends.zip(frames.and_then(|frames| frames.last())).map_or(1.0 / self.spacing, mean)
    }

    /// Returns the frames of the coarsest grid on which all times lie, and their rate: the
    /// roundest one that rounding leaves possible.
    fn own_frames(&self) -> (Option<Vec<f64>>, f64) {
        let steps = || self.times.windows(2).map(|two| two[1] - two[0]);
        // most steps may be of several frames
        let least = steps().fold(f64::INFINITY, f64::min);
        let near: Vec<f64> = steps().filter(|step| *step <= least + 1.02 * self.resolution).collect();
        let shortest = near.iter().sum::<f64>() / near.len() as f64;
        let frames = [self.spacing, shortest].into_iter().find_map(|spacing| self.frames(spacing));
        let fps = self.mean_rate(frames.as_ref());
        let length = self.times.last().zip(self.times.first()).map_or(0.0, |(last, first)| last - first);
        let slack = (self.resolution / length).max(1e-6);
        let possible = |rate: &f64| (rate / fps - 1.0).abs() <= slack;
        let rounded = [10.0, 1.0, 0.01].map(|unit| (fps / unit).round() * unit);
        (frames, rounded.into_iter().find(possible).unwrap_or(fps))
    }

    /// Returns whether times can be of this rate by their typical spacing or, for a clock that
    /// varies much, by the mean. Rounding makes few times uncertain.
    fn fits(&self, rate: f64) -> bool {
        let slack = 2.0 * self.resolution / (self.times.len() as f64 * self.spacing);
        let steps = (self.times.len() as f64 - 1.0).max(1.0);
        let mean =
            self.times.first().zip(self.times.last()).map_or(0.0, |(first, last)| (last - first) / steps);
        let fits = |spacing: f64| (spacing * rate - 1.0).abs() <= MAX_MISMATCH + slack.min(0.1);
        self.spacing.is_nan() || fits(self.spacing) || fits(mean)
    }

    /// Returns the times of the camera at `fps`, if those of the file follow `rate`: frame number /
    /// `fps`, or as they are written if they follow no frames. A stated rate may mean frames left
    /// out.
    fn camera_times(
        &self,
        [rate, fps]: [f64; 2],
        is_stated: bool,
        note: impl Fn(String),
    ) -> Result<Vec<f64>, String> {
        let (fits, own) = (self.fits(rate), 1.0 / self.spacing);
        if !is_stated && !fits {
            return Err(format!(
                "times are {:.6} s apart ({own:.4} fps), but [video] capture_fps is {fps}; expected the rate of the camera. If the times \
                 are those of slow playback, write playback_fps = {own:.4} below it; if they are right and some frames are missing, \
                 playback_fps = {fps}; if they are not in seconds, [tracks] time_unit",
                self.spacing
            ));
        }
        if is_stated && self.spacing * rate < 1.0 - MAX_MISMATCH && !fits {
            return Err(format!(
                "times are {:.6} s apart, closer than [video] playback_fps = {rate} allows; expected the rate that they follow, {:.4}",
                self.spacing,
                self.own_frames().1
            ));
        }
        let spacing = if is_stated || self.spacing.is_nan() { 1.0 / rate } else { self.spacing };
        let Some(frames) = self.frames(spacing).or_else(|| self.frames(1.0 / rate)) else {
            if self.is_coarse(spacing) {
                return Err(format!(
                    "times do not follow frames at {rate} fps, even allowing for their being rounded to {} s; expected frame numbers, or \
                     times with more digits",
                    self.resolution
                ));
            }
            note(format!(
                "times are not spaced like whole frames at {rate} fps throughout; taken as they are written"
            ));
            return Ok(self.times.iter().map(|t| t * rate / fps).collect());
        };
        let first = self.times.first().copied().unwrap_or_default();
        if let Some(row) = first_apart(&frames, &self.times, self.resolution, rate).filter(|_| !is_stated) {
            note(format!(
                "after {:.0} frames times are more than half a frame off capture_fps = {fps} (a clock that drifts, or another rate); taken \
                 as they are written",
                frames[row]
            ));
            // rounding is averaged out if the clock is steady
            let mean = 1.0 / self.mean_rate(Some(&frames));
            let is_steady = first_apart(&frames, &self.times, self.resolution, mean.recip()).is_none();
            let steady = frames.iter().map(|frame| first + frame * mean);
            return Ok(if self.is_coarse(spacing) && is_steady {
                steady.collect()
            } else {
                self.times.clone()
            });
        }
        let number = (first * rate).round();
        let is_on_grid = (first - number / rate).abs() <= self.resolution + 1e-6 / rate;
        let start = if is_on_grid { number } else { first * rate };
        let times: Vec<f64> = frames.iter().map(|frame| (start + frame) / fps).collect();
        if times.iter().zip(&self.times).any(|(new, time)| (new - time).abs() > 1e-6 / fps) {
            note(format!("times as written are replaced by frame number / capture_fps ({fps})"));
        }
        Ok(times)
    }
}

/// Returns the frame rate that the times of a shot follow; `None` for numbers of frames.
pub(super) fn followed(shot: &RawShot) -> Option<f64> {
    let second = shot.clock.unit.map_or(Some(1.0), TimeUnit::seconds)?;
    let (_, fps) = Grid::of(shot, second).own_frames();
    Some(fps).filter(|fps| *fps > 0.0 && fps.is_finite())
}

/// Returns the largest power of ten of which all times are multiples, 0 if it is below a millionth.
fn resolution(times: &[f64]) -> f64 {
    let is_whole = |x: f64| (x - x.round()).abs() < 1e-9 * x.abs().max(1.0) + 1e-7;
    let fits = |scale: &f64| times.iter().all(|t| is_whole(t * scale));
    [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6].into_iter().find(fits).map_or(0.0, f64::recip)
}

/// Returns the mean of the steps near the median, in which rounding cancels and gaps do not count;
/// of a clock that varies from frame to frame, the mean of all steps but gaps.
fn spacing(times: &[f64], resolution: f64) -> f64 {
    let steps = sorted(times.windows(2).map(|two| two[1] - two[0]));
    let Some(median) = steps.get(steps.len().saturating_sub(1) / 2) else { return f64::NAN };
    let mean_within = |off: f64| {
        let near = steps.iter().filter(|step| (*step - median).abs() <= 1.02 * resolution + off * median);
        near.fold((0.0, 0.0), |(sum, n), step| (sum + step, n + 1.0))
    };
    let steady = mean_within(MAX_EVEN);
    let (sum, n) = if 2.0 * steady.1 < steps.len() as f64 { mean_within(MAX_VARYING) } else { steady };
    sum / n
}

/// Returns the first row whose time and frame number, from the first row, contradict each other at
/// this rate, frames/s, by more than half a frame and the rounding of the times.
pub(super) fn first_contradiction(frames: &[f64], seconds: &[f64], rate: f64) -> Option<usize> {
    first_apart(frames, seconds, resolution(seconds), rate)
}

fn first_apart(frames: &[f64], seconds: &[f64], rounding: f64, rate: f64) -> Option<usize> {
    let (first_frame, first_second) = (*frames.first()?, *seconds.first()?);
    let is_apart = |(frame, second): (&f64, &f64)| {
        ((frame - first_frame) / rate - (second - first_second)).abs() > 0.5 / rate + rounding
    };
    frames.iter().zip(seconds).position(is_apart)
}

/// Counts frames if neighbouring ones have the same time on a coarse clock.
fn count_frames(shot: &mut RawShot, grid: &Grid, [rate, fps]: [f64; 2]) -> Result<(), String> {
    let start = shot.times.first().copied().unwrap_or(0.0);
    let late = shot.times.iter().enumerate().map(|(i, time)| time - start - i as f64 / rate);
    let are_whole = shot.tracks.iter().all(|track| track.rows.iter().all(|row| row.line > 0));
    if !are_whole || !grid.is_rounding(late) {
        return Err(format!(
            "times are rounded to {} s, coarser than frames at {rate} fps; expected frame numbers, or times with more digits",
            grid.resolution
        ));
    }
    for (i, time) in shot.times.iter_mut().enumerate() {
        *time = start * rate / fps + i as f64 / fps;
    }
    Ok(())
}

/// Returns the unit of a time column without one: that which agrees with the frame rate.
fn guess_unit(shot: &RawShot, rate: Option<f64>) -> Result<TimeUnit, String> {
    let help = "expected [tracks] time_unit = \"frames\", \"s\", \"ms\" or \"us\"";
    let grid = Grid::of(shot, 1.0);
    let (are_whole, spacing) = (grid.resolution >= 1.0, grid.spacing);
    let Some(rate) = rate else {
        if !are_whole && spacing < 0.2 {
            return Ok(TimeUnit::S);
        }
        return Err(format!("the unit of the times is not stated; {help}, and [video] capture_fps"));
    };
    let is_near = |unit: &TimeUnit| unit.seconds().is_some_and(|second| grid.fits(rate * second));
    let mut units: Vec<TimeUnit> = TimeUnit::ALL.into_iter().filter(is_near).collect();
    if are_whole && (spacing - 1.0).abs() < 0.02 {
        // a frame each millisecond: both units agree
        units.retain(|unit| *unit != TimeUnit::Ms || rate != 1000.0);
        units.push(TimeUnit::Frames);
    }
    match units[..] {
        [unit] => Ok(unit),
        [] => Err(format!(
            "times are {spacing} apart, which at {rate} fps is not a frame or its length in s, ms or µs; {help}, or another rate"
        )),
        _ => Err(format!("times may be frames or ms at {rate} fps; {help}")),
    }
}
