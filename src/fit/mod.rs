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
mod result;
mod verdict;

pub use analysis::{Analysis, ExtractedDiscs, analyse, analyse_watched, extract_discs, with_impacts};
pub use camera::{FoundCamera, FoundCorrection};
pub use diagnostics::goodness::{Goodness, Influence, NoiseVerdict, Normality};
pub use diagnostics::identifiability::{Combination, Identifiability};
pub use diagnostics::other_models::{Alternative, LikelihoodRatio};
#[cfg(feature = "report")]
pub(crate) use diagnostics::refuted::mean as mean_of_shots;
pub use diagnostics::refuted::{MeasuredRestitution, Refuted};
pub use diagnostics::trends::{Trend, Variable};
pub use error::FitError;
pub use estimate::{Counted, Estimate, Intervals};
pub use film::{FittedFilm, OfShot, OwnEstimate};
pub use intervals::bootstrap::{Bootstrap, Resampled};
pub use intervals::regions::{Contour, LEVELS, Level, Profile};
pub use of_discs::FrictionCurve;
pub use options::{Depth, Falling, Options};
pub use result::{
    Bound, Computed, DOWN_WEIGHTED, Diagnostics, Explanation, Fit, JointFit, Noise, Rejected, Residual,
    Robust, Scatter,
};
pub use verdict::{Grade, Verdict};

pub use crate::problem::Status;

use crate::measurement::dataset::Dataset;

/// Fits a data set of any kind, as [`analyse`] does: one fit, or one for each label of the column that `[fit] by` names, in the
/// order in which the labels first appear.
///
/// # Errors
/// See [`FitError`]; the first label that fails ends it.
pub fn fit(dataset: &Dataset, options: &Options) -> Result<Vec<Fit>, FitError> {
    analyse(dataset, options).fits
}
