//! The range of an axis, its ticks and their labels.

use std::ops::Range;

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
#[derive(Clone, Debug)]
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
    /// Returns a linear axis.
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), symmetric: None, is_logarithmic: false, is_whole: false, words: Vec::new() }
    }

    /// Returns an axis about 0 that reaches at least to ± `least`.
    pub fn symmetric(name: impl Into<String>, least: f64) -> Self {
        Self { symmetric: Some(least), ..Self::new(name) }
    }

    /// Returns an axis of decimal logarithms.
    pub fn logarithmic(name: impl Into<String>) -> Self {
        Self { is_logarithmic: true, ..Self::new(name) }
    }

    /// Returns an axis of words, one at each whole number.
    pub fn of_words(words: Vec<String>) -> Self {
        Self { words, ..Self::new("") }
    }

    /// Returns the range that holds all values with some room.
    pub(super) fn range(&self, values: impl Iterator<Item = f64>) -> Range<f64> {
        if !self.words.is_empty() {
            return -0.5..self.words.len() as f64 - 0.5;
        }
        let [low, high] = ends(values.filter(|value| is_drawable(*value)));
        if let Some(least) = self.symmetric {
            let end = least.max((1.0 + PADDING) * low.abs().max(high.abs()).min(TOO_LARGE));
            return if low > high { -least..least } else { -end..end };
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
        // a line's width beside the end is on it
        let width = 1e-3 * (range.end - range.start);
        let inside = |tick: &f64| range.start - width <= *tick && *tick <= range.end + width;
        if self.is_logarithmic && range.end - range.start < most as f64 {
            let decades = range.start.floor() as i32..=range.end.ceil() as i32;
            let of = |factors: &'static [f64]| {
                decades
                    .clone()
                    .flat_map(move |power| factors.iter().map(move |f| f64::from(power) + f.log10()))
            };
            let sets: [&[f64]; 4] =
                [&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
            let chosen = sets.into_iter().map(|set| of(set).filter(inside).collect::<Vec<_>>());
            return chosen.into_iter().find(|ticks| ticks.len() <= most).unwrap_or_default();
        }
        let raw = (range.end - range.start) / most as f64;
        let power = 10_f64.powf(raw.log10().floor());
        let least = if self.is_logarithmic || self.is_whole { 1.0 } else { 0.0 };
        let steps = [0.5, 1.0, 2.0, 5.0, 10.0].map(|step| step * power);
        let Some(chosen) = (1..steps.len()).find(|i| steps[*i] >= raw.max(least)) else { return Vec::new() };
        // counted in steps, so that rounding errors do not add up
        let ticks = |step: f64| -> Vec<f64> {
            let first = (range.start / step).ceil() as i64;
            (0..=most as i64).map(|n| (first + n) as f64 * step).filter(inside).collect()
        };
        // a single tick shows no scale
        let few = ticks(steps[chosen]);
        if few.len() < 2 && steps[chosen - 1] >= least { ticks(steps[chosen - 1]) } else { few }
    }

    /// Returns the label of a tick.
    pub(super) fn label(&self, tick: f64) -> String {
        if let Some(word) = self.words.get(tick.max(0.0).round() as usize) {
            return word.clone();
        }
        let value = if self.is_logarithmic { 10_f64.powf(tick) } else { tick };
        plain(value, 6).replace('-', "−")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, range: Range<f64>) -> Vec<String> {
        axis.ticks(&range, 6).into_iter().map(|tick| axis.label(tick)).collect()
    }

    #[test]
    fn ticks_are_round() {
        let axis = Axis::new("");
        assert_eq!(labels(&axis, -0.5..3.2), ["0", "1", "2", "3"]);
        assert_eq!(labels(&axis, -3.1..3.1), ["−2", "0", "2"]);
        assert_eq!(labels(&axis, 0.0..0.3), ["0", "0.05", "0.1", "0.15", "0.2", "0.25", "0.3"]);
        assert_eq!(labels(&axis, 0.0..90.0), ["0", "20", "40", "60", "80"]);
        let few: Vec<String> =
            axis.ticks(&(-0.19..0.19), 3).into_iter().map(|tick| axis.label(tick)).collect();
        assert_eq!(few, ["−0.1", "0", "0.1"]);
    }

    #[test]
    fn logarithmic_ticks_are_the_numbers_themselves() {
        let axis = Axis::logarithmic("");
        assert_eq!(labels(&axis, -3.52..-1.7), ["0.0005", "0.001", "0.002", "0.005", "0.01", "0.02"]);
        assert_eq!(labels(&axis, 0.0..2.3), ["1", "3", "10", "30", "100"]);
        assert!((3..=7).contains(&labels(&axis, -9.0..9.0).len()));
    }

    #[test]
    fn a_range_holds_all_values_with_room() {
        let range = Axis::new("").range([5.0, 10.0].into_iter());
        assert!(range.start < 5.0 && range.end > 10.0);
        assert_eq!(Axis::new("").range([0.5, 10.0].into_iter()).start, 0.0);
        let around = Axis::symmetric("", 2.5).range([-4.0, 1.0].into_iter());
        assert!(around.start < -4.0 && around.end > 4.0);
        assert_eq!(Axis::new("").range(std::iter::empty()), 0.0..1.0);
        assert!(!is_drawable(f64::NAN) && !is_drawable(1e300));
    }
}
