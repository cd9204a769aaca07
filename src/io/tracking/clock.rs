//! Times of clocks: h:mm:ss.fff, perhaps after a date, h:mm:ss:cs, and time codes h:mm:ss:ff.

use super::raw::{RawShot, sorted};
use crate::numerics::median;

/// Notation of a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Style {
    /// h:mm:ss.fff, with the number of digits after the mark.
    Fraction(usize),
    /// h:mm:ss:cs, with the number of digits after the last colon.
    Colon(usize),
}

impl Style {
    pub(super) fn resolution(self) -> f64 {
        let (Self::Fraction(digits) | Self::Colon(digits)) = self;
        1.0 / 10.0_f64.powi(digits as i32)
    }
}

/// Frames per second of time codes.
const CODE_RATES: [f64; 6] = [24.0, 25.0, 30.0, 48.0, 50.0, 60.0];

pub(super) fn is_clock(cell: &str) -> bool {
    cell.contains(':')
}

/// Returns the seconds since midnight (or since the clock began), and their notation.
pub(super) fn seconds(cell: &str) -> Option<(f64, Style)> {
    let (time, is_dated) = without_date(cell.trim());
    let has_colon = !is_dated && !time.contains(['.', ',']);
    let (clock, part) = if has_colon {
        time.rsplit_once(':').filter(|(_, part)| (2..=3).contains(&part.len()))?
    } else {
        time.rsplit_once(['.', ',']).unwrap_or((time, ""))
    };
    let number = |text: &str| text.parse::<u32>().ok().filter(|_| !text.starts_with('+')).map(f64::from);
    let parts: Vec<f64> = clock.split(':').map(number).collect::<Option<_>>()?;
    if !(2..=3).contains(&parts.len()) || parts[1..].iter().any(|part| *part >= 60.0) {
        return None;
    }
    let style = if has_colon { Style::Colon(part.len()) } else { Style::Fraction(part.len()) };
    let whole = parts.iter().fold(0.0, |sum, part| 60.0 * sum + part);
    let fraction = if part.is_empty() { 0.0 } else { number(part)? };
    Some((whole + fraction / 10.0_f64.powi(part.len() as i32), style))
}

/// Returns `2024-05-01T12:00:00Z` without the date and the zone, and whether there was a date.
fn without_date(cell: &str) -> (&str, bool) {
    let is_date = |date: &str| date.len() == 10 && date.bytes().filter(u8::is_ascii_digit).count() == 8;
    match cell.split_once(['T', ' ']) {
        Some((date, time)) if is_date(date) => {
            (time.split(['Z', '+', '-']).next().unwrap_or(time).trim(), true)
        }
        _ => (cell, false),
    }
}

/// Converts times h:mm:ss:ff to numbers of frames, and returns the frame rate. `None`, without
/// changes, for hundredths: frames begin again at a film's rate when a second is full.
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
