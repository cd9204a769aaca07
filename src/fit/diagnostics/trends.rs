//! Do residuals change with something that the model should have taken care of?

use schemars::JsonSchema;
use serde::Serialize;

use crate::measurement::number::plain;
use crate::measurement::written::written_by_name;
use crate::physics::name::worded;

/// A trend this improbable, with all the trends that were looked for taken into account, is named.
const SIGNIFICANT: f64 = 0.05;

/// A trend of residuals with something that the model should have taken care of.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Trend {
    /// What the residuals are of, in words.
    #[serde(rename = "residuals_of")]
    pub quantity: &'static str,
    /// What the residuals change with.
    #[serde(rename = "against")]
    pub variable: Variable,
    /// Change of a residual, in its standard deviations, per unit of what it changes with.
    #[serde(rename = "slope_sd")]
    #[schemars(with = "Option<f64>")]
    pub slope: f64,
    /// That unit.
    pub slope_per: &'static str,
    /// Probability of such a slope by chance.
    #[schemars(with = "Option<f64>")]
    pub p_value: f64,
    /// p_value corrected for all trends that were tested (Holm 1979).
    #[schemars(with = "Option<f64>")]
    pub p_corrected: f64,
    /// Whether p_corrected is below 0.05.
    pub significant: bool,
    /// The trend as a sentence, with what it may mean.
    pub words: String,
}

impl Trend {
    /// A likely reason for the trend, in words.
    #[must_use]
    pub fn meaning(&self) -> &'static str {
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
    pub enum Variable {
        /// The cue ball's speed before the impact, m/s.
        Speed = "speed" | "m/s",
        /// The size of the cut angle, rad.
        Cut = "cut angle" | "rad",
        /// The cue ball's forward spin over that of natural roll.
        Roll = "forward spin" | "natural roll",
        /// The cue ball's side spin Rω_z/U.
        Side = "side spin" | "U/R",
        /// Of discs, in the place of the cut angle and the spin: the size of the slip over the closing speed.
        Slip = "the slip over the closing speed" | "closing speed",
    }
    /// The name in reports.
    pub fn name;
    /// The unit of [`Trend::slope`]'s denominator.
    pub fn unit;
}

written_by_name!(Variable);

/// Returns the trends of slopes (quantity, variable, slope, probability by chance), the most significant
/// first, corrected for the number of trends that were looked for (Holm 1979).
pub(in crate::fit) fn ranked(mut found: Vec<(&'static str, Variable, f64, f64)>) -> Vec<Trend> {
    found.sort_by(|a, b| a.3.total_cmp(&b.3));
    let count = found.len();
    let mut largest = 0.0_f64;
    let trend = |(rank, (quantity, variable, slope, p_value)): (usize, (_, Variable, _, f64))| {
        largest = largest.max(p_value * (count - rank) as f64).min(1.0);
        let significant = largest < SIGNIFICANT;
        let words = String::new();
        let slope_per = variable.unit();
        let p_corrected = largest;
        let trend = Trend { quantity, variable, slope, slope_per, p_value, p_corrected, significant, words };
        Trend { words: words_of(&trend, count), ..trend }
    };
    found.into_iter().enumerate().map(trend).collect()
}

fn words_of(trend: &Trend, count: usize) -> String {
    let verb = if trend.slope < 0.0 { "fall" } else { "rise" };
    let meaning = trend.meaning();
    format!(
        "{} residuals {verb} with {} ({:+.2} sd per {}; by chance with probability {}, {count} trends looked \
         for): {meaning}",
        trend.quantity,
        trend.variable.name(),
        trend.slope,
        trend.slope_per,
        plain(trend.p_corrected, 2)
    )
}
