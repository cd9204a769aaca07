//! The range of an axis, its ticks and their labels.

/// Numbers from here on are left out of a plot: their differences could overflow.
const TOO_LARGE: f64 = 1e150;

/// Part of the range that is left free at either end.
const PADDING: f64 = 0.06;

/// A linear axis, or one of decimal logarithms.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// Quantity and unit.
    pub(super) name: String,
    pub(super) low: f64,
    pub(super) high: f64,
    /// What a tick is called, where that is not its number.
    pub(super) words: Option<fn(f64) -> String>,
    /// Places are logarithms; its ticks show the numbers themselves.
    pub(super) logarithmic: bool,
}

/// Whether a number has a place on an axis.
pub(super) fn drawable(value: f64) -> bool {
    value.abs() < TOO_LARGE
}

impl Axis {
    /// From end to end.
    pub(super) fn between(name: impl Into<String>, low: f64, high: f64) -> Self {
        Self { name: name.into(), low, high, words: None, logarithmic: false }
    }

    /// From the smallest to the largest of the values, with some room. Equal values stand in the
    /// middle; without any the axis goes from 0 to 1.
    pub(super) fn around(name: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = values
            .into_iter()
            .filter(|value| drawable(*value))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            return Self::between(name, 0.0, 1.0);
        }
        let largest = low.abs().max(high.abs());
        let room = if high - low > 1e-6 * largest {
            PADDING * (high - low)
        } else if largest > 0.0 {
            0.1 * largest
        } else {
            1.0
        };
        Self::between(name, low - room, high + room)
    }

    /// The same of values with bars of ± sd, which all stand inside, but for a few that are much wider than the rest: these must not
    /// shrink the data to a dot.
    pub(super) fn around_bars(
        name: impl Into<String>,
        values: &[(f64, Option<f64>)],
        others: impl IntoIterator<Item = f64>,
    ) -> Self {
        const WIDER: f64 = 3.0;
        const PART: f64 = 0.35;
        let others: Vec<f64> = others.into_iter().collect();
        let plain = Self::around("", values.iter().map(|(value, _)| *value).chain(others.iter().copied()));
        let mut sds: Vec<f64> = values.iter().filter_map(|(_, sd)| sd.filter(|sd| drawable(*sd))).collect();
        sds.sort_by(f64::total_cmp);
        let usual = sds.get(sds.len() / 2).copied().unwrap_or(0.0);
        let most = (WIDER * usual).max(PART * (plain.high - plain.low));
        let ends = values.iter().flat_map(|(value, sd)| {
            let sd = sd.filter(|sd| drawable(*sd)).map_or(0.0, |sd| sd.min(most));
            [value - sd, value + sd]
        });
        Self::around(name, ends.chain(others))
    }

    /// As far below zero as above, at least `least` to either side.
    pub(super) fn symmetric(
        name: impl Into<String>,
        values: impl IntoIterator<Item = f64>,
        least: f64,
    ) -> Self {
        let largest =
            values.into_iter().filter(|value| drawable(*value)).fold(0.0_f64, |a, b| a.max(b.abs()));
        let end = least.max(largest * (1.0 + PADDING));
        Self::between(name, -end, end)
    }

    /// With other words for its ticks than their numbers.
    pub(super) fn in_words(mut self, words: fn(f64) -> String) -> Self {
        self.words = Some(words);
        self
    }

    /// From the smallest to the largest of some positive values, whose places are their decimal logarithms.
    pub(super) fn logarithmic(name: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        Self { logarithmic: true, ..Self::around(name, values.into_iter().map(f64::log10)) }
    }

    /// Starts at zero where values none of which is negative come near it.
    pub(super) fn starting_at_zero(mut self) -> Self {
        let least = self.low + PADDING / (1.0 + 2.0 * PADDING) * (self.high - self.low);
        if (-1e-9 * self.high..0.25 * self.high).contains(&least) {
            self.low = self.low.min(0.0).max(-PADDING * self.high);
        }
        self
    }

    /// So long, about the same middle.
    pub(super) fn widen(&mut self, length: f64) {
        let middle = 0.5 * (self.low + self.high);
        (self.low, self.high) = (middle - 0.5 * length, middle + 0.5 * length);
    }

    /// Where a value is between the ends: 0 to 1.
    pub(super) fn position(&self, value: f64) -> f64 {
        ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }

    /// Some `count` round numbers in the range, with their labels.
    pub(super) fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        if self.logarithmic {
            return self.decades(count);
        }
        let raw = (self.high - self.low) / count.max(2) as f64;
        let power = 10_f64.powf(raw.log10().floor());
        let wide = |step: &f64| *step >= raw * 0.999;
        let steps = [0.5, 1.0, 2.0, 5.0, 10.0].map(|m| m * power);
        let chosen = steps.iter().position(wide).unwrap_or(steps.len() - 1);
        // A tick at the very end counts in spite of rounding errors.
        let ends = |step: f64| ((self.low / step - 1e-9).ceil(), (self.high / step + 1e-9).floor());
        let enough = |step: &&f64| ends(**step).1 - ends(**step).0 >= count.min(3) as f64 - 1.0;
        // one or two ticks give no scale: a finer step then
        let step = *steps[..=chosen].iter().rev().find(enough).unwrap_or(&steps[chosen]);
        if !(step.is_finite() && step > 0.0) {
            return Vec::new();
        }
        let (first, last) = ends(step);
        // Counted in steps, so that rounding errors do not add up.
        let steps = (0..=(last - first).clamp(0.0, 50.0) as u32).map(|i| first + f64::from(i));
        let largest = self.low.abs().max(self.high.abs());
        let label = |value: f64| self.words.map_or_else(|| label(value, step, largest), |words| words(value));
        steps.map(|n| (n * step, label(n * step))).collect()
    }

    /// Powers of ten; with 2 and 5 times these where they are few, without some where they are many.
    fn decades(&self, count: usize) -> Vec<(f64, String)> {
        let inside = |place: &f64| (self.low..=self.high).contains(place);
        let (first, last) = (self.low.floor() as i32, self.high.ceil() as i32);
        let with = |factors: &[i32]| {
            let all = (first..=last).flat_map(|power| {
                factors.iter().map(move |m| (f64::from(power) + f64::from(*m).log10(), power, *m))
            });
            all.filter(|(place, ..)| inside(place)).collect::<Vec<_>>()
        };
        let sets: [&[i32]; 5] = [&[1, 2, 3, 4, 5, 6, 7, 8, 9], &[1, 2, 3, 5, 7], &[1, 2, 5], &[1, 3], &[1]];
        let few = sets.into_iter().map(with).find(|ticks| ticks.len() <= count + 1);
        let ticks = few.unwrap_or_else(|| {
            let all = with(&[1]);
            let step = all.len().div_ceil(count.max(1));
            all.into_iter().step_by(step).collect()
        });
        let label = |power: i32, m: i32| match power {
            -5..0 => format!("{:.*}", power.unsigned_abs() as usize, f64::from(m) * 10_f64.powi(power)),
            0..5 => format!("{}", m * 10_i32.pow(power.unsigned_abs())),
            _ => format!("{m}e{power}").replace('-', "−"),
        };
        ticks.into_iter().map(|(place, power, m)| (place, label(power, m))).collect()
    }
}

/// A tick's number with the decimals of the step; with a power of ten where it would get long.
fn label(value: f64, step: f64, largest: f64) -> String {
    // A little above, as the step may be 0.000 999….
    let exponent = (step * 1.001).log10().floor() as i32;
    let text = if (1e-4..1e5).contains(&step) && largest < 1e5 || value == 0.0 {
        let decimals = if value == 0.0 && !(1e-4..1e5).contains(&step) { 0 } else { -exponent };
        format!("{value:.*}", usize::try_from(decimals).unwrap_or(0))
    } else {
        let own = (value.abs() * 1.001).log10().floor() as i32;
        format!("{value:.*e}", usize::try_from(own - exponent).unwrap_or(0))
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        Axis::between("", low, high).ticks(6).into_iter().map(|(_, label)| label).collect()
    }

    #[test]
    fn bars_stand_inside_but_for_the_widest() {
        let one = Axis::around_bars("", &[(0.93, Some(0.02))], [0.931]);
        assert!(one.low < 0.91 && one.high > 0.95);
        let usual = [(0.0, Some(0.1)), (1.0, Some(0.1)), (2.0, Some(100.0))];
        let some = Axis::around_bars("", &usual, []);
        assert!(some.low < -0.1 && some.high > 2.1 && some.high < 5.0);
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(labels(-0.5, 3.2), ["0", "1", "2", "3"]);
        assert_eq!(labels(-3.1, 3.1), ["−2", "0", "2"]);
        assert_eq!(labels(0.0, 0.3), ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25", "0.30"]);
        assert_eq!(labels(-0.19, 0.19), ["−0.1", "0.0", "0.1"]);
        let few = |low, high| Axis::between("", low, high).ticks(3).len();
        assert_eq!((few(-0.19, 0.19), few(-0.51, 0.51)), (3, 3));
        assert_eq!(labels(0.0, 90.0), ["0", "20", "40", "60", "80"]);
        assert_eq!(labels(0.0, 3e7), ["0", "5e6", "1.0e7", "1.5e7", "2.0e7", "2.5e7", "3.0e7"]);
    }

    #[test]
    fn logarithmic_ticks_are_the_numbers_themselves() {
        let labels = |low: f64, high: f64| {
            let axis = Axis::logarithmic("x", [low, high]);
            axis.ticks(6).into_iter().map(|(_, label)| label).collect::<Vec<_>>()
        };
        assert_eq!(labels(0.001, 0.01), ["0.001", "0.002", "0.003", "0.005", "0.007", "0.01"]);
        assert_eq!(labels(0.0003, 0.02), ["0.0005", "0.001", "0.002", "0.005", "0.01", "0.02"]);
        assert_eq!(labels(1e-7, 1e-3), ["1e−7", "1e−6", "0.00001", "0.0001", "0.001"]);
        assert_eq!(labels(1.0, 200.0), ["1", "3", "10", "30", "100"]);
        assert!((4..=7).contains(&labels(1e-9, 1e9).len()));
    }

    #[test]
    fn only_what_is_never_negative_starts_at_zero() {
        let axis = |low: f64, high: f64| Axis::around("x", [low, high]).starting_at_zero();
        assert!((-1.0..=0.0).contains(&axis(0.5, 10.0).low));
        assert!(axis(-50.0, 45.0).low < -50.0);
        assert!(axis(5.0, 10.0).low > 4.0);
    }

    #[test]
    fn every_range_can_be_drawn() {
        for values in [vec![], vec![0.0], vec![2.0; 3], vec![1e149, -1e149], vec![f64::NAN, f64::INFINITY]] {
            for axis in [Axis::around("x", values.clone()), Axis::symmetric("y", values.clone(), 3.0)] {
                assert!(axis.high > axis.low && (axis.high - axis.low).is_finite(), "{axis:?}");
                assert!((2..=12).contains(&axis.ticks(5).len()), "{axis:?}");
            }
        }
        assert!((Axis::around("x", [2.0; 3]).position(2.0) - 0.5).abs() < 1e-12);
    }
}
