//! Data set + settings → [`Fit`]: estimates, uncertainties, residuals, and what to think of them.

pub(crate) mod analysis;
mod bootstrap;
mod camera;
pub mod check;
mod common;
pub(crate) mod deviations;
mod doubts;
mod error;
mod estimate;
pub(crate) mod film;
pub(crate) mod film_words;
pub(crate) mod goodness;
mod notes;
mod of_discs;
mod of_film;
mod of_rows;
mod options;
mod refuted;
mod regions;
mod result;
pub(crate) mod trends;
mod verdict;

pub use analysis::{ExtractedDiscs, extract_discs, fit, fit_watched, with_impacts};
pub use bootstrap::{Bootstrap, Resampled};
pub use camera::{FoundCamera, FoundCorrection};
pub use doubts::{About, Remark};
pub use error::FitError;
pub use estimate::Counted;
pub use film::FittedFilm;
pub use goodness::{Goodness, Identifiability, Influence, NoiseVerdict, Normality};
pub use options::{Depth, Falling, Options};
pub use refuted::{MeasuredRestitution, Refuted};
pub use regions::{Contour, Level};
pub use result::{
    Computed, Diagnostics, Explanation, Fit, Noise, Rejected, Residual, Robust, Scatter, Weight,
};
pub use trends::{Trend, Variable};
pub use verdict::{Grade, Verdict};

pub use crate::problem::{
    Budget, Combination, DiscImpact, Doubt, Id, IntervalPair as Intervals, ParameterEstimate as Estimate,
    Quantity, Severity, Status, predict,
};
