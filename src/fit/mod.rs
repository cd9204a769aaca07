//! Data set + settings → [`Fit`]: estimates, uncertainties, residuals, and what to think of them.

pub(crate) mod analysis;
mod camera;
pub mod check;
mod common;
pub(crate) mod deviations;
pub(crate) mod diagnostics;
mod doubts;
mod error;
mod estimate;
pub(crate) mod film;
pub(crate) mod film_words;
pub(crate) mod intervals;
mod notes;
mod of_discs;
mod of_film;
mod of_rows;
mod options;
mod remark;
mod result;
mod verdict;

pub use analysis::{ExtractedDiscs, extract_discs, fit, fit_watched, with_impacts};
pub use camera::{FoundCamera, FoundCorrection};
pub use diagnostics::goodness::{Goodness, Influence, NoiseVerdict, Normality};
pub use diagnostics::identifiability::{Combination, Identifiability};
pub use diagnostics::refuted::{MeasuredRestitution, Refuted};
pub use diagnostics::trends::{Trend, Variable};
pub use error::FitError;
pub use estimate::Counted;
pub use film::FittedFilm;
pub use intervals::bootstrap::{Bootstrap, Resampled};
pub use intervals::regions::{Contour, Level, Profile};
pub use options::{Depth, Falling, Options};
pub use remark::{About, Remark};
pub use result::{
    Computed, Diagnostics, Explanation, Fit, Noise, Rejected, Residual, Robust, Scatter, Weight,
};
pub(crate) use result::{DOWN_WEIGHTED, JointFit};
pub use verdict::{Grade, Verdict};

pub use crate::problem::{
    Budget, DiscImpact, Doubt, Id, IntervalPair as Intervals, ParameterEstimate as Estimate, Quantity,
    Severity, Status, predict,
};
