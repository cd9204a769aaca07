//! Do residuals change with something that the model should have taken care of?

use schemars::JsonSchema;
use serde::Serialize;

use crate::measurement::number::{count_of, plain};
use crate::measurement::written::written_by_name;
use crate::physics::name::worded;

/// A χ² or a trend this improbable, a χ² at either end, means that model or noise do not describe
/// the residuals.
pub(in crate::fit) const IMPROBABLE: f64 = 0.001;

/// A trend this improbable, with all the trends that were looked for taken into account, is named.
const TREND_LEVEL: f64 = 0.05;

/// A trend of residuals with something that the model should have taken care of.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Trend {
    /// The quantity of the residuals, in words.
    #[serde(rename = "residuals_of")]
    pub(crate) quantity: &'static str,
    /// The variable that the residuals change with.
    #[serde(rename = "against")]
    pub(crate) variable: Variable,
    /// Change of a residual, in its standard deviations, per unit of what it changes with.
    #[serde(rename = "slope_sd")]
    #[schemars(with = "Option<f64>")]
    pub(crate) slope: f64,
    /// That unit.
    pub(crate) slope_per: &'static str,
    /// Probability of such a slope by chance.
    #[schemars(with = "Option<f64>")]
    pub(crate) p_value: f64,
    /// p_value corrected for all trends that were tested (Holm 1979).
    #[schemars(with = "Option<f64>")]
    pub(crate) p_corrected: f64,
    /// Whether p_corrected is below 0.05.
    pub(crate) significant: bool,
    /// The trend as a sentence, with what it may mean.
    pub(crate) words: String,
}

impl Trend {
    /// Returns a trend before it is corrected for the others.
    pub(in crate::fit) fn new(quantity: &'static str, variable: Variable, slope: f64, p_value: f64) -> Self {
        let (slope_per, words) = (variable.unit(), String::new());
        let (p_corrected, significant) = (p_value, false);
        Self { quantity, variable, slope, slope_per, p_value, p_corrected, significant, words }
    }

    /// Returns whether it is beyond chance however many trends are looked for.
    pub(in crate::fit) fn is_improbable(&self) -> bool {
        self.p_corrected < IMPROBABLE
    }

    /// A likely reason for the trend, in words.
    pub(crate) fn meaning(&self) -> &'static str {
        match (self.quantity, self.variable) {
            ("throw", Variable::Speed) => "friction is not constant",
            ("throw", Variable::Cut) => "friction is not constant, or the cut angles err",
            ("e", Variable::Speed) => "e is not constant",
            ("J_t/J_n", Variable::Slip) => {
                "the friction that is fitted does not describe how J_t/J_n follows the slip"
            }
            (_, Variable::Slip) => "it is not the same for discs that slide on each other",
            (_, Variable::Cut) => "the model leaves something out, or the cut angles err",
            (_, Variable::Roll | Variable::Side) => {
                "the model leaves something out, or the spin is not as stated"
            }
            (_, Variable::Speed) => "the model leaves something out that depends on speed",
        }
    }
}

worded! {
    /// A variable with which residuals may change.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(crate) enum Variable {
        /// The cue ball's speed before the impact, m/s.
        Speed = "speed" | "m/s",
        /// The size of the cut angle, rad.
        Cut = "cut angle" | "rad",
        /// The cue ball's forward spin over that of natural roll.
        Roll = "forward spin" | "natural roll",
        /// The cue ball's side spin Rω_z/U.
        Side = "side spin" | "U/R",
        /// The variable of discs instead of cut angle and spin: the size of the slip over the
        /// closing speed.
        Slip = "the slip over the closing speed" | "closing speed",
    }
    /// The name in reports.
    pub fn name;
    /// The unit of [`Trend::slope`]'s denominator.
    pub fn unit;
}

written_by_name!(Variable);

/// Returns the trends, the most significant first, corrected for the number of trends that were
/// looked for.
pub(in crate::fit) fn ranked(mut trends: Vec<Trend>) -> Vec<Trend> {
    trends.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    holm(trends.iter_mut().map(|trend| &mut trend.p_corrected));
    let count = trends.len();
    for trend in &mut trends {
        trend.significant = trend.p_corrected < TREND_LEVEL;
        trend.words = format!(
            "the residuals of {} change with {} ({:+.2} sd per {}; p = {}, corrected for {}): {}",
            trend.quantity,
            trend.variable.name(),
            trend.slope,
            trend.slope_per,
            plain(trend.p_corrected, 2),
            count_of(count, "test"),
            trend.meaning()
        );
    }
    trends
}

/// Corrects probabilities for their number, step by step from the smallest.
///
/// - Holm, S. (1979). A simple sequentially rejective multiple test procedure. Scand. J. Stat. 6, 65–70.
pub(crate) fn holm<'a>(probabilities: impl IntoIterator<Item = &'a mut f64>) {
    let mut all: Vec<&mut f64> = probabilities.into_iter().collect();
    all.sort_by(|a, b| a.total_cmp(b));
    let (count, mut last) = (all.len(), 0.0_f64);
    for (rank, p) in all.into_iter().enumerate() {
        last = last.max((*p * (count - rank) as f64).min(1.0));
        *p = last;
    }
}

#[cfg(test)]
mod tests {
    /// Four tests: 0.01·4, 0.02·3, then 0.03·2 is at least 0.06, 0.5.
    #[test]
    fn holm_steps_down() {
        let mut p = [0.02, 0.5, 0.01, 0.03];
        super::holm(&mut p);
        for (p, expected) in p.iter().zip([0.06, 0.5, 0.04, 0.06]) {
            assert!((p - expected).abs() < 1e-15, "{p}");
        }
    }
}
