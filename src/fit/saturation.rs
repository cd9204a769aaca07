//! Where a parameter no longer matters: the edge of its plateau, and what the data say of it.

use super::minimum::Minimum;
use super::noise::{Group, Residual};
use super::samples::Search;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::Unknown;
use crate::likelihood::whitening::Whitening;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;

/// A range of values of a parameter on which nothing depends, as that of μ once every shot sticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plateau {
    /// The parameter.
    pub parameter: Parameter,
    /// The value from which on nothing depends on it.
    pub edge: f64,
    /// The other end of the plateau: a bound, unless the outcomes change again beyond.
    pub bound: f64,
}

impl Search<'_> {
    /// All predictions, one after the other, at the inputs of the shots that were estimated with these weights.
    fn predictions(&self, at: &[Values], whitening: &[Whitening]) -> Vec<f64> {
        let mut predictions = Vec::new();
        for ((sample, at), whitening) in self.samples.iter().zip(at).zip(whitening) {
            let model = at.model(sample.model);
            let predicted = |(number, shot): (usize, &Fitted)| {
                let prediction = whitening.predict(number, &shot.plan, &model, &at.coefficients()).ok()?;
                Some(prediction.values.rows(0, shot.plan.rows().len()).iter().copied().collect::<Vec<_>>())
            };
            predictions.extend(sample.fitted.iter().enumerate().filter_map(predicted).flatten());
        }
        predictions
    }

    /// The plateau on which the search for a parameter ended; `None` where nothing depends on the parameter at all.
    pub(super) fn plateau(&self, unknown: Unknown, minimum: &Minimum) -> Option<Plateau> {
        /// Predictions on the plateau agree to rounding of the largest: a small one may be what is left of large ones.
        const SAME: f64 = 1e-12;
        let Minimum { values: end, whitening, .. } = minimum;
        let (parameter, setting) = (unknown.parameter, self.setting(unknown));
        let there = self.predictions(end, whitening);
        let same = SAME * there.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
        let is_flat = |value: f64| {
            let here = self.predictions(&self.set(end, unknown, value), whitening);
            here.len() == there.len() && here.iter().zip(&there).all(|(a, b)| (a - b).abs() <= same)
        };
        let edge = |mut off: f64| {
            let mut on = self.value(end, unknown);
            if is_flat(off) {
                return off;
            }
            while (on - off).abs() > 1e-12 {
                let middle = 0.5 * (on + off);
                if middle == on || middle == off {
                    break;
                }
                if is_flat(middle) { on = middle } else { off = middle }
            }
            on
        };
        let [low, high] = [edge(setting.lower), edge(setting.upper)];
        match (low > setting.lower, high < setting.upper) {
            (false, false) => None,
            (true, _) => Some(Plateau { parameter, edge: low, bound: high }),
            (false, true) => Some(Plateau { parameter, edge: high, bound: low }),
        }
    }

    /// From where χ² of a fit of one sample is t² above the plateau's to the plateau's far end, the other parameters held.
    pub(super) fn plateau_interval(
        &self,
        plateau: &Plateau,
        at: &Minimum,
        groups: &[Group],
        t: f64,
    ) -> [f64; 2] {
        let Plateau { parameter, edge, bound } = *plateau;
        let chi2 = |value: f64| {
            let mut sum = 0.0;
            let values = [at.first().with(parameter, value)];
            self.each_residual(
                &values,
                &at.whitening,
                |Residual { of, difference, variance_from_inputs, .. }| {
                    let group = groups.iter().find(|g| g.observable == of.observable);
                    let sd = of.measured.sd.or(group.map(|g| g.sd)).unwrap_or(f64::NAN);
                    sum += difference * difference / (sd * sd + variance_from_inputs);
                },
            );
            sum
        };
        let top = chi2(edge) + t * t;
        let setting = &self.first().settings[parameter];
        let (mut inside, mut outside) = (edge, if bound > edge { setting.lower } else { setting.upper });
        if chi2(outside) > top {
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                if chi2(middle) > top { outside = middle } else { inside = middle }
            }
        } else {
            inside = outside;
        }
        [inside.min(bound), inside.max(bound)]
    }
}
