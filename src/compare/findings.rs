//! Everything that can be wrong or worth saying of a comparison, as data.

use serde::Serialize;

use super::quantity::Quantity;
use crate::problem::Severity;

/// A finding of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub(crate) enum Finding {
    /// The data rule the model out: the estimates have no errors, and differences are not judged.
    Refuted {
        /// Indices of the samples whose own residuals do, with their χ² per degree of freedom.
        samples: Vec<(usize, f64)>,
        /// χ² per degree of freedom of all.
        reduced_chi2: f64,
    },
    /// The descent did not end at a minimum.
    NotConverged,
    /// The data do not determine all unknowns together: there are no errors.
    Undetermined,
    /// The fit of one sample alone found this.
    OfSample {
        sample: usize,
        /// How far the finding affects the trust in the sample.
        #[serde(skip)]
        severity: Severity,
        sentence: String,
    },
    /// The data contradict that a shared quantity is the same for all labels.
    NotShared {
        quantity: Quantity,
        /// Probability of such a contradiction by chance.
        p_value: f64,
    },
    AtBound {
        quantity: Quantity,
        /// Its label; `None` if it is shared.
        label: Option<String>,
        bound: f64,
    },
    /// A contact that is compliant along its surface was adopted for all samples together.
    Compliance {
        /// Decrease of −2 log L.
        fall: f64,
    },
    /// Mass ratios that the labels do not share make up most of the error of a difference.
    MassRatios {
        quantity: Quantity,
        std_error: f64,
        /// Its part from the mass ratios.
        part: f64,
    },
}

impl Finding {
    /// Returns how far it affects the trust in a comparison.
    pub fn severity(&self) -> Severity {
        match self {
            Self::Refuted { .. } | Self::NotConverged => Severity::Unusable,
            Self::Undetermined | Self::NotShared { .. } | Self::AtBound { .. } => Severity::Doubtful,
            Self::Compliance { .. } | Self::MassRatios { .. } => Severity::Note,
            Self::OfSample { severity, .. } => *severity,
        }
    }
}

/// Why a label does not determine a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Reason {
    /// It has no shot that can be used.
    NoShots,
    /// Its fit does not have the quantity.
    Absent,
    /// Its contacts stick at the best fit: the friction is only known to be large.
    Sticks,
    /// Its observations do not depend on the quantity.
    Independent,
    /// The standard error is larger than the distance of the bounds, or χ² does not depend on it at
    /// the best fit.
    Uncertain,
}
