//! The range of an axis, its ticks and their labels.

use std::ops::Range;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::Ranged;

use crate::measurement::number::plain;

/// Numbers from here on are left out of a figure: their differences could overflow.
const TOO_LARGE: f64 = 1e150;

/// Part of the range that is left free at either end.
const PADDING: f64 = 0.06;

/// Returns the least and the largest of some numbers; infinite, the wrong way round, without any.
pub(in crate::report) fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Returns whether a number has a place on an axis.
pub(super) fn is_drawable(value: f64) -> bool {
    value.abs() < TOO_LARGE
}

/// An axis. Its range follows from the marks of the panel.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    pub name: String,
    /// Half of the smallest range about 0, if the axis reaches as far below 0 as above.
    pub symmetric: Option<f64>,
    /// Whether values are decimal logarithms; the labels then show the numbers themselves.
    pub is_logarithmic: bool,
    /// Whether values are whole numbers.
    pub is_whole: bool,
    /// Words instead of the numbers 0, 1, 2, …
    pub words: Vec<String>,
}

impl Axis {
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }

    /// Returns an axis about 0 that reaches at least to ± `least`.
    pub fn symmetric(name: impl Into<String>, least: f64) -> Self {
        Self { symmetric: Some(least), ..Self::new(name) }
    }

    pub fn logarithmic(name: impl Into<String>) -> Self {
        Self { is_logarithmic: true, ..Self::new(name) }
    }

    /// Returns an axis of words, one at each whole number.
    pub fn of_words(words: Vec<String>) -> Self {
        Self { words, ..Self::default() }
    }

    /// Returns the range that holds all values with some room.
    pub(super) fn range(&self, values: impl Iterator<Item = f64>) -> Range<f64> {
        if !self.words.is_empty() {
            return -0.5..self.words.len() as f64 - 0.5;
        }
        let [low, high] = ends(values.filter(|value| is_drawable(*value)));
        if let Some(least) = self.symmetric {
            let end = if low > high { least } else { least.max((1.0 + PADDING) * high.max(-low)) };
            return -end..end;
        }
        let largest = low.abs().max(high.abs());
        let room = match high - low {
            length if length < 0.0 => return 0.0..1.0,
            length if length > 1e-6 * largest => PADDING * length,
            _ if largest > 0.0 => 0.1 * largest,
            _ => 1.0,
        };
        // what is never negative and comes near 0 starts there
        let starts_at_0 = !self.is_logarithmic && low > 0.0 && low < 0.25 * high;
        (if starts_at_0 { 0.0 } else { low - room })..high + room
    }

    /// Returns round numbers in a range, at most so many.
    pub(super) fn ticks(&self, range: &Range<f64>, most: usize) -> Vec<f64> {
        if !self.words.is_empty() {
            return (0..self.words.len()).map(|place| place as f64).collect();
        }
        // within few decades the round numbers of each
        let of_decades: [&[f64]; 4] =
            [&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
        for factors in of_decades.into_iter().filter(|_| self.is_logarithmic) {
            let decades = range.start.floor() as i32..=range.end.ceil() as i32;
            let places =
                decades.flat_map(|decade| factors.iter().map(move |f| f64::from(decade) + f.log10()));
            let inside: Vec<f64> = places.filter(|place| range.contains(place)).collect();
            if inside.len() <= most {
                return inside;
            }
        }
        let mut ticks = RangedCoordf64::from(range.clone()).key_points(most);
        ticks.retain(|tick| tick.fract() == 0.0 || !(self.is_whole || self.is_logarithmic));
        ticks
    }

    pub(super) fn label(&self, tick: f64) -> String {
        if let Some(word) = self.words.get(tick.max(0.0).round() as usize) {
            return word.clone();
        }
        let value = if self.is_logarithmic { 10_f64.powf(tick) } else { tick };
        plain(value, 6).replace('-', "−")
    }
}
