//! The time of each row, from the camera's frame rate and the times of the file.

use std::sync::Arc;

use super::input::{Log, Notes, Subject};
use super::raw::{Clock, RawShot, RawTrack, sorted, span};
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
pub(super) struct Grid {
    /// Different times, ascending, in seconds of the file's own clock.
    pub(crate) times: Vec<f64>,
    /// Rounding of the times; 0 if they are exact.
    pub(crate) resolution: f64,
    /// Time between neighbouring frames.
    pub(crate) spacing: f64,
}

/// Converts the times of a shot's rows to seconds of the camera's clock and returns its frame rate.
/// `Err`: the reason, and the remedy.
pub(super) fn convert(shot: &mut RawShot, settings: &TrackSettings, notes: &Notes) -> Result<f64, String> {
    let fps = settings.capture_fps;
    if settings.unknown_rate && shot.clock != Clock::In(TimeUnit::Frames) {
        let message = "[video] capture_fps is \"unknown\", but this file has times; expected frame numbers, or no capture_fps";
        return Err(message.to_string());
    }
    let unit = match shot.clock {
        Clock::FramesAt(stated) => {
            if let Some(given) = fps.filter(|fps| (fps / stated - 1.0).abs() > MAX_MISMATCH) {
                return Err(format!(
                    "the file states {stated} fps, but [video] capture_fps is {given}; expected the same, or no capture_fps"
                ));
            }
            let fps = fps.unwrap_or(stated);
            shot.rows_mut().for_each(|row| row.time /= fps);
            return Ok(fps);
        }
        Clock::Unsaid => settings.time_unit.map_or_else(|| guess_unit(shot, settings), Ok)?,
        Clock::Rounded(_) => TimeUnit::S,
        Clock::In(unit) => settings.time_unit.filter(|_| unit != TimeUnit::Frames).unwrap_or(unit),
    };
    let Some(second) = unit.seconds() else {
        let missing =
            "time is in frames; expected [video] capture_fps, the frames per second that the camera recorded";
        let fps = fps.ok_or(missing)?;
        if let Some(row) = shot.rows().find(|row| row.time.fract() != 0.0) {
            return Err(format!(
                "line {}: frame {} is not a whole number; if it is a time, say [tracks] time_unit",
                row.line, row.time
            ));
        }
        shot.rows_mut().for_each(|row| row.time /= fps);
        return Ok(fps);
    };
    shot.rows_mut().for_each(|row| row.time *= second);
    let grid = Grid::of(shot, second);
    let file = Arc::clone(&shot.file);
    let log = notes.of(&file);
    let Some((rate, fps)) = settings.playback_fps.or(fps).zip(fps) else {
        return without_rate(shot, &grid, log);
    };
    let repeats = |track: &RawTrack| track.rows.windows(2).any(|two| two[0].time == two[1].time);
    let is_coarse = grid.resolution > 0.3 / rate && !grid.has_time_per_frame(rate);
    if is_coarse && shot.tracks.iter().any(repeats) {
        return by_row(shot, &grid, rate, fps, log);
    }
    with_rate(shot, &grid, rate, fps, settings.playback_fps.is_some(), log)
}

impl Grid {
    pub(super) fn of(shot: &RawShot, second: f64) -> Self {
        let times = shot.times();
        let resolution = match shot.clock {
            Clock::Rounded(resolution) => resolution,
            _ => resolution(times.iter().map(|t| t / second)) * second,
        };
        let spacing = spacing(&times, resolution);
        Self { times, resolution, spacing }
    }

    fn ends(&self) -> Option<[f64; 2]> {
        Some([*self.times.first()?, *self.times.last()?])
    }

    /// Returns whether a coarse clock has a time of its own for each frame, so that rows with equal
    /// times are one frame twice.
    fn has_time_per_frame(&self, rate: f64) -> bool {
        let is_whole = |t: &f64| (t * rate - (t * rate).round()).abs() < 1e-3;
        self.resolution * rate < 1.5 && self.times.iter().all(is_whole)
    }

    /// Returns whether deviations from expected times, and 0, are within the rounding.
    fn is_rounding(&self, late: impl Iterator<Item = f64>) -> bool {
        let [low, high] = span([0.0].into_iter().chain(late));
        high - low <= 1.02 * self.resolution
    }

    /// Returns the frame number of each time from the first one on; `None` if the steps are not
    /// whole frames of `spacing` (within the rounding and [`MAX_OFF_GRID`] of a frame).
    pub(super) fn frames(&self, spacing: f64) -> Option<Vec<f64>> {
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

    /// Returns whether times can be of this rate by their typical spacing or, for a clock that
    /// varies much, by the mean. Rounding makes few times uncertain.
    fn fits(&self, rate: f64) -> bool {
        let slack = 2.0 * self.resolution / (self.times.len() as f64 * self.spacing);
        let steps = (self.times.len() as f64 - 1.0).max(1.0);
        let mean = self.ends().map_or(0.0, |[first, last]| (last - first) / steps);
        let fits = |spacing: f64| (spacing * rate - 1.0).abs() <= MAX_MISMATCH + slack.min(0.1);
        self.spacing.is_nan() || fits(self.spacing) || fits(mean)
    }
}

/// Returns the largest power of ten of which all times are multiples, 0 if it is below a millionth.
fn resolution(times: impl Iterator<Item = f64> + Clone) -> f64 {
    let is_whole = |x: f64| (x - x.round()).abs() < 1e-9 * x.abs().max(1.0) + 1e-7;
    let fits = |scale: &f64| times.clone().all(|t| is_whole(t * scale));
    [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6].into_iter().find(fits).map_or(0.0, f64::recip)
}

/// Returns the mean of the steps near the median, in which rounding cancels and gaps do not count;
/// of a clock that varies from frame to frame, the mean of all steps but gaps.
fn spacing(times: &[f64], resolution: f64) -> f64 {
    let steps = sorted(times.windows(2).map(|two| two[1] - two[0]));
    if steps.is_empty() {
        return f64::NAN;
    }
    let median = steps[(steps.len() - 1) / 2];
    let mean_within = |off: f64| {
        let near = steps.iter().filter(|step| (*step - median).abs() <= 1.02 * resolution + off * median);
        near.fold((0.0, 0.0), |(sum, n), step| (sum + step, n + 1.0))
    };
    let steady = mean_within(MAX_EVEN);
    let (sum, n) = if 2.0 * steady.1 < steps.len() as f64 { mean_within(MAX_VARYING) } else { steady };
    sum / n
}

fn with_rate(
    shot: &mut RawShot,
    grid: &Grid,
    rate: f64,
    fps: f64,
    is_stated: bool,
    log: Log,
) -> Result<f64, String> {
    let (fits, own) = (grid.fits(rate), 1.0 / grid.spacing);
    if !is_stated && !fits {
        return Err(format!(
            "times are {:.6} s apart ({own:.4} fps), but [video] capture_fps is {fps}; expected the rate of the camera. If the times \
             are those of slow playback, write playback_fps = {own:.4} below it; if they are right and some frames are missing, \
             playback_fps = {fps}; if they are not in seconds, [tracks] time_unit",
            grid.spacing
        ));
    }
    if is_stated && grid.spacing * rate < 1.0 - MAX_MISMATCH && !fits {
        return Err(format!(
            "times are {:.6} s apart, closer than [video] playback_fps = {rate} allows; expected the rate that they follow, {:.4}",
            grid.spacing,
            tidy(own)
        ));
    }
    // a stated rate may mean frames left out; otherwise the file's own spacing, which is near it
    let spacing = if is_stated || grid.spacing.is_nan() { 1.0 / rate } else { grid.spacing };
    let frames = grid.frames(spacing).or_else(|| grid.frames(1.0 / rate));
    let is_rounded = grid.resolution > MAX_OFF_GRID * spacing;
    let line = shot.line;
    let Some(frames) = frames else {
        if is_rounded {
            return Err(format!(
                "times do not follow frames at {rate} fps, even allowing for their being rounded to {} s; expected frame numbers, or \
                 times with more digits",
                grid.resolution
            ));
        }
        let message = format!(
            "times are not spaced like whole frames at {rate} fps throughout; taken as they are written"
        );
        log.add(Subject::Clock, line, message);
        replace(shot, &grid.times, |i| grid.times[i] * rate / fps);
        return Ok(fps);
    };
    let Some([first, last]) = grid.ends() else { return Ok(fps) };
    if let Some(row) = first_apart(&frames, &grid.times, grid.resolution, rate).filter(|_| !is_stated) {
        let message = format!(
            "after {:.0} frames times are more than half a frame off capture_fps = {fps} (a clock that drifts, or another rate); taken \
             as they are written",
            frames[row]
        );
        log.add(Subject::Clock, line, message);
        // rounding is averaged out if the clock is steady
        let mean = (last - first) / frames[frames.len() - 1];
        if is_rounded && first_apart(&frames, &grid.times, grid.resolution, mean.recip()).is_none() {
            replace(shot, &grid.times, |i| first + frames[i] * mean);
        }
        return Ok(fps);
    }
    let number = (first * rate).round();
    let is_on_grid = (first - number / rate).abs() <= grid.resolution + 1e-6 / rate;
    let time = |i: usize| {
        if is_on_grid { (number + frames[i]) / fps } else { first * rate / fps + frames[i] / fps }
    };
    if (0..frames.len()).any(|i| (time(i) - grid.times[i]).abs() > 1e-6 / fps) {
        let message = format!("times as written are replaced by frame number / capture_fps ({fps})");
        log.add(Subject::Clock, line, message);
    }
    replace(shot, &grid.times, time);
    Ok(fps)
}

/// Returns the first row whose time and frame number, from the first row, contradict each other at
/// this rate, frames/s, by more than half a frame and the rounding of the times.
pub(super) fn first_contradiction(frames: &[f64], seconds: &[f64], rate: f64) -> Option<usize> {
    first_apart(frames, seconds, resolution(seconds.iter().copied()), rate)
}

fn first_apart(frames: &[f64], seconds: &[f64], rounding: f64, rate: f64) -> Option<usize> {
    let (first_frame, first_second) = (*frames.first()?, *seconds.first()?);
    let is_apart = |(frame, second): (&f64, &f64)| {
        ((frame - first_frame) / rate - (second - first_second)).abs() > 0.5 / rate + rounding
    };
    frames.iter().zip(seconds).position(is_apart)
}

/// Takes the frame rate from the times, if no other source exists.
fn without_rate(shot: &mut RawShot, grid: &Grid, log: Log) -> Result<f64, String> {
    let refused = |why: &str| {
        format!("{why}; expected [video] capture_fps, the frames per second that the camera recorded")
    };
    let Some([first, last]) = grid.ends().filter(|_| !grid.spacing.is_nan()) else {
        return Err(refused("fewer than two times, which give no frame rate"));
    };
    let is_rounded = grid.resolution > MAX_OFF_GRID * grid.spacing;
    let frames = grid.frames(grid.spacing);
    let is_regular = |two: &&[f64]| ((two[1] - two[0]) / grid.spacing - 1.0).abs() < 0.1;
    let regular = grid.times.windows(2).filter(is_regular).count();
    if frames.is_none() && (is_rounded || regular * 4 < 3 * (grid.times.len() - 1)) {
        return Err(refused("times are not regularly spaced"));
    }
    let own = match frames.as_ref().and_then(|frames| frames.last()) {
        Some(last_frame) => last_frame.max(1.0) / (last - first),
        None => 1.0 / grid.spacing,
    };
    let fps = tidy(own);
    let message = format!("capture_fps is not given; taken from the spacing of the times, {fps:.4} fps");
    log.add(Subject::Clock, shot.line, message);
    if let Some(frames) = frames.filter(|_| is_rounded) {
        replace(shot, &grid.times, |i| first + frames[i] / fps);
    }
    Ok(fps)
}

fn tidy(fps: f64) -> f64 {
    if (fps - fps.round()).abs() < 1e-6 * fps { fps.round() } else { fps }
}

/// Counts rows if neighbouring frames have the same time on a coarse clock.
fn by_row(shot: &mut RawShot, grid: &Grid, rate: f64, fps: f64, log: Log) -> Result<f64, String> {
    let times = |track: &RawTrack| track.rows.iter().map(|row| row.time).collect::<Vec<f64>>();
    let Some(first) = shot.tracks.first().map(times) else { return Ok(fps) };
    let start = first.first().copied().unwrap_or(0.0);
    let mut late = first.iter().enumerate().map(|(i, time)| time - start - i as f64 / rate);
    if !shot.tracks.iter().all(|track| times(track) == first) || !grid.is_rounding(&mut late) {
        return Err(format!(
            "times are rounded to {} s, coarser than frames at {rate} fps; expected frame numbers, or times with more digits",
            grid.resolution
        ));
    }
    let message = format!(
        "times are rounded to {} s; rebuilt from the number of the row at {fps} fps",
        grid.resolution
    );
    log.add(Subject::Clock, shot.line, message);
    for (i, row) in shot.tracks.iter_mut().flat_map(|track| track.rows.iter_mut().enumerate()) {
        row.time = start * rate / fps + i as f64 / fps;
    }
    Ok(fps)
}

fn replace(shot: &mut RawShot, times: &[f64], new: impl Fn(usize) -> f64) {
    for row in shot.rows_mut() {
        let i = times.partition_point(|t| *t < row.time);
        row.time = new(i.min(times.len() - 1));
    }
}

/// Returns the unit of a time column without one: that which agrees with the frame rate.
fn guess_unit(shot: &RawShot, settings: &TrackSettings) -> Result<TimeUnit, String> {
    let help = "expected [tracks] time_unit = \"frames\", \"s\", \"ms\" or \"us\"";
    let Grid { times, resolution, spacing } = Grid::of(shot, 1.0);
    let are_whole = resolution >= 1.0;
    let Some(rate) = settings.playback_fps.or(settings.capture_fps) else {
        if !are_whole && spacing < 0.2 {
            return Ok(TimeUnit::S);
        }
        return Err(format!("the unit of the times is not stated; {help}, and [video] capture_fps"));
    };
    let is_near = |unit: &TimeUnit| {
        unit.seconds().is_some_and(|second| {
            let times = times.iter().map(|t| t * second).collect();
            Grid { times, resolution: resolution * second, spacing: spacing * second }.fits(rate)
        })
    };
    let mut units: Vec<TimeUnit> = TimeUnit::ALL.into_iter().filter(is_near).collect();
    if are_whole && (spacing - 1.0).abs() < 0.02 {
        // a frame each millisecond: both units agree
        units.retain(|unit| *unit != TimeUnit::Ms || rate != 1000.0);
        units.push(TimeUnit::Frames);
    }
    match units[..] {
        [unit] => Ok(unit),
        [] => Err(format!(
            "times are {spacing} apart, which at {rate} fps is neither a frame nor its length in s, ms or µs; {help}, or another rate"
        )),
        _ => Err(format!("times may be frames or ms at {rate} fps; {help}")),
    }
}
