//! Times of clocks: h:mm:ss.fff, perhaps after a date, and h:mm:ss:cs.

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

pub(super) fn is_clock(cell: &str) -> bool {
    cell.contains(':')
}

/// Returns the seconds since midnight (or since the clock began), and their notation.
pub(super) fn seconds(cell: &str) -> Option<(f64, Style)> {
    let (time, is_dated) = without_date(cell.trim());
    let mut whole: Vec<&str> = time.split(':').collect();
    let last = whole.pop()?;
    let (fraction, style) = match last.split_once(['.', ',']) {
        Some((second, fraction)) if second.len() <= 2 && fraction.len() <= 9 => {
            whole.push(second);
            (fraction, Style::Fraction(fraction.len()))
        }
        None if is_dated => {
            whole.push(last);
            ("0", Style::Fraction(0))
        }
        None if (2..=3).contains(&last.len()) => (last, Style::Colon(last.len())),
        _ => return None,
    };
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let are_parts = whole.iter().all(|part| is_number(part) && part.len() <= 4);
    if !(are_parts && is_number(fraction) && (2..=3).contains(&whole.len())) {
        return None;
    }
    let mut sum = 0.0;
    for (i, part) in whole.iter().enumerate() {
        let number: f64 = part.parse().ok()?;
        if i > 0 && number >= 60.0 {
            return None;
        }
        sum = sum * 60.0 + number;
    }
    let part: f64 = fraction.parse().ok()?;
    Some((sum + part / 10.0_f64.powi(fraction.len() as i32), style))
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
