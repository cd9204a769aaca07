//! Do residuals change with something that the model should have taken care of?

use super::goodness::IMPROBABLE;
use crate::measurement::number::plain;
use crate::physics::name::worded;

/// A trend this improbable, with all the trends that were looked for taken into account, is named.
const SIGNIFICANT: f64 = 0.05;

/// How residuals change with something that the model should have taken care of.
#[derive(Clone, Debug, PartialEq)]
pub struct Trend {
    /// The quantity whose residuals are looked at.
    pub quantity: &'static str,
    /// The variable with which they may change.
    pub variable: Variable,
    /// The change of the residuals, in standard deviations of the quantity, per unit of the variable.
    pub slope: f64,
    /// The probability of a slope as far from 0 by chance.
    pub p_value: f64,
    /// The same, corrected for the number of trends that were looked for (Holm 1979).
    pub p_corrected: f64,
    /// Whether the trend is no chance, with all others taken into account.
    pub significant: bool,
    /// The trend in words, with what it may mean.
    pub words: String,
}

impl Trend {
    /// Returns whether it is beyond chance however many trends are looked for.
    pub(in crate::fit) fn is_improbable(&self) -> bool {
        self.p_corrected < IMPROBABLE
    }

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

/// A slope that was looked for.
pub(in crate::fit) struct Slope {
    pub quantity: &'static str,
    pub variable: Variable,
    /// Change of the residuals in standard deviations per unit of the variable.
    pub value: f64,
    /// Probability of such a slope by chance.
    pub p_value: f64,
}

/// Returns the trends of slopes, the most significant first, corrected for the number of trends that were looked for
/// (Holm 1979).
pub(in crate::fit) fn ranked(mut slopes: Vec<Slope>) -> Vec<Trend> {
    slopes.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let count = slopes.len();
    let mut largest = 0.0_f64;
    let trend = |(rank, Slope { quantity, variable, value, p_value }): (usize, Slope)| {
        largest = largest.max(p_value * (count - rank) as f64).min(1.0);
        let mut trend = Trend {
            quantity,
            variable,
            slope: value,
            p_value,
            p_corrected: largest,
            significant: largest < SIGNIFICANT,
            words: String::new(),
        };
        trend.words = format!(
            "{quantity} residuals {} with {} ({value:+.2} sd per {}; by chance with probability {}, {count} trends looked \
             for): {}",
            if value < 0.0 { "fall" } else { "rise" },
            variable.name(),
            variable.unit(),
            plain(largest, 2),
            trend.meaning()
        );
        trend
    };
    slopes.into_iter().enumerate().map(trend).collect()
}
