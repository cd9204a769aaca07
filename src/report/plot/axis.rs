//! The range of an axis, its ticks and their labels.

use std::ops::Range;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::Ranged;

use crate::measurement::number::plain;

/// Returns the least and the largest of some numbers; infinite, the wrong way round, without any.
pub(in crate::report) fn ends(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
}

/// Returns whether a number has a place on an axis. Differences of larger ones could overflow.
pub(super) fn is_drawable(value: f64) -> bool {
    value.abs() < 1e150
}

/// An axis. Its range follows from the marks of the panel.
#[derive(Clone)]
pub(super) struct Axis {
    pub(super) name: String,
    scale: Scale,
}

#[derive(Clone)]
pub(super) enum Scale {
    Linear,
    /// Values are whole numbers.
    Whole,
    /// A symmetric axis about 0 that reaches at least this far.
    Symmetric(f64),
    /// Values are decimal logarithms; the labels show the numbers themselves.
    Logarithmic,
    /// Words stand for the numbers 0, 1, 2, …
    Words(Vec<String>),
}

impl Axis {
    pub(super) fn new(name: impl Into<String>) -> Self {
        Self::with(name, Scale::Linear)
    }

    pub(super) fn with(name: impl Into<String>, scale: Scale) -> Self {
        Self { name: name.into(), scale }
    }

    /// Returns the range that holds all values with some room.
    pub(super) fn range(&self, values: impl Iterator<Item = f64>) -> Range<f64> {
        /// Part of the range that is left free at either end.
        const PADDING: f64 = 0.06;
        let [low, high] = ends(values);
        let largest = low.abs().max(high.abs());
        match &self.scale {
            Scale::Words(words) => -0.5..words.len() as f64 - 0.5,
            Scale::Symmetric(least) => {
                let end = least.max((1.0 + PADDING) * high.max(-low));
                -end..end
            }
            _ if low > high => 0.0..1.0,
            _ if largest == 0.0 => -1.0..1.0,
            _ if high - low <= 1e-6 * largest => low - 0.1 * largest..high + 0.1 * largest,
            // what is never negative and comes near 0 starts there
            Scale::Linear | Scale::Whole if low > 0.0 && low < 0.25 * high => {
                0.0..high + PADDING * (high - low)
            }
            _ => low - PADDING * (high - low)..high + PADDING * (high - low),
        }
    }

    /// Returns at most `most` round numbers in a range.
    pub(super) fn ticks(&self, range: &Range<f64>, most: usize) -> Vec<f64> {
        /// Round numbers of a decade, as many as there is room for.
        const OF_DECADES: [&[f64]; 4] =
            [&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
        let round = RangedCoordf64::from(range.clone()).key_points(most);
        let whole = || round.iter().copied().filter(|tick| tick.fract() == 0.0).collect();
        match &self.scale {
            Scale::Words(words) => (0..words.len()).map(|place| place as f64).collect(),
            Scale::Whole => whole(),
            Scale::Logarithmic => {
                let decades = || range.start.floor() as i32..=range.end.ceil() as i32;
                let candidates = OF_DECADES.into_iter().map(|factors| {
                    let places = decades()
                        .flat_map(|decade| factors.iter().map(move |f| f64::from(decade) + f.log10()));
                    places.filter(|place| range.contains(place)).collect::<Vec<_>>()
                });
                candidates.into_iter().find(|ticks| ticks.len() <= most).unwrap_or_else(whole)
            }
            Scale::Linear | Scale::Symmetric(_) => round,
        }
    }

    pub(super) fn label(&self, tick: f64) -> String {
        let number = |value: f64| plain(value, 6).replace('-', "−");
        match &self.scale {
            Scale::Words(words) => words.get(tick.max(0.0).round() as usize).cloned().unwrap_or_default(),
            Scale::Logarithmic => number(10_f64.powf(tick)),
            _ => number(tick),
        }
    }
}
