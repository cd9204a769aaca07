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
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) name: String,
    scale: Scale,
}

#[derive(Clone, Debug)]
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
        let [low, high] = ends(values.filter(|value| is_drawable(*value)));
        match &self.scale {
            Scale::Words(words) => return -0.5..words.len() as f64 - 0.5,
            Scale::Symmetric(least) => {
                let end = least.max((1.0 + PADDING) * high.max(-low));
                return -end..end;
            }
            _ if low > high => return 0.0..1.0,
            _ => {}
        }
        let largest = low.abs().max(high.abs());
        let room = match high - low {
            length if length > 1e-6 * largest => PADDING * length,
            _ if largest > 0.0 => 0.1 * largest,
            _ => 1.0,
        };
        // what is never negative and comes near 0 starts there
        let starts_at_0 = !matches!(self.scale, Scale::Logarithmic) && low > 0.0 && low < 0.25 * high;
        (if starts_at_0 { 0.0 } else { low - room })..high + room
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
                let of_decades = OF_DECADES.into_iter().map(|factors| {
                    let decades = range.start.floor() as i32..=range.end.ceil() as i32;
                    let places =
                        decades.flat_map(|decade| factors.iter().map(move |f| f64::from(decade) + f.log10()));
                    places.filter(|place| range.contains(place)).collect::<Vec<_>>()
                });
                of_decades.into_iter().find(|ticks| ticks.len() <= most).unwrap_or_else(whole)
            }
            Scale::Linear | Scale::Symmetric(_) => round,
        }
    }

    pub(super) fn label(&self, tick: f64) -> String {
        let value = match &self.scale {
            Scale::Words(words) => {
                return words.get(tick.max(0.0).round() as usize).cloned().unwrap_or_default();
            }
            Scale::Logarithmic => 10_f64.powf(tick),
            _ => tick,
        };
        plain(value, 6).replace('-', "−")
    }
}
