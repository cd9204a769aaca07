//! Data set + settings → [`Fit`]: estimates, uncertainties, residuals, and what to think of them.

pub(crate) mod analysis;
mod camera;
pub mod causes;
pub mod check;
mod common;
mod counted;
pub(crate) mod diagnostics;
mod disc_curve;
mod disc_words;
mod error;
mod estimate;
mod extracted_discs;
pub(crate) mod film;
pub(crate) mod film_words;
mod footage_doubts;
pub(crate) mod intervals;
mod of_discs;
pub(crate) mod of_film;
pub(crate) mod of_rows;
mod options;
mod request;
mod result;
mod verdict;
pub(crate) mod warnings;

pub use analysis::{Analysis, analyse, analyse_watched, with_impacts};
pub use camera::{FoundCamera, FoundCorrection};
pub use counted::Counted;
pub use diagnostics::goodness::{Goodness, Influence, NoiseVerdict, Normality};
pub use diagnostics::identifiability::{Combination, Identifiability};
pub use diagnostics::other_models::{Alternative, LikelihoodRatio};
#[cfg(feature = "report")]
pub(crate) use diagnostics::refuted::mean as mean_of_shots;
pub use diagnostics::refuted::{MeasuredRestitution, Refuted};
pub use diagnostics::trends::{Trend, Variable};
pub use disc_curve::FrictionCurve;
pub use error::FitError;
pub use estimate::{Estimate, Intervals, Status};
pub use extracted_discs::{ExtractedDiscs, extract_discs};
pub use film::{FittedFilm, OfShot, OwnEstimate};
pub use intervals::bootstrap::{Bootstrap, Resampled};
pub use intervals::regions::{Contour, LEVELS, Level, Profile};
pub use options::{Depth, Falling, Options};
pub use result::{
    Bound, Computed, DOWN_WEIGHTED, Diagnostics, Fit, JointFit, Noise, Plateau, Rejected, Residual, Robust,
    Scatter,
};
pub use verdict::{Grade, Verdict};

use crate::measurement::dataset::{Dataset, Shot};

/// Fits a data set of any kind, as [`analyse`] does: one fit, or one for each label of the column that `[fit] by` names, in the
/// order in which the labels first appear.
///
/// # Errors
/// See [`FitError`]; the first label that fails ends it.
pub fn fit(dataset: &Dataset, options: &Options) -> Result<Vec<Fit>, FitError> {
    analyse(dataset, options).fits
}

/// Fits a data set of measured impacts or angles. `done` is called after each sample of the bootstrap, from any thread.
///
/// # Errors
/// See [`FitError`]; the first label that fails ends it.
pub(crate) fn fit_rows(
    dataset: &Dataset,
    options: &Options,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Fit>, FitError> {
    let fit = |(label, places): (Option<String>, Vec<usize>)| {
        let shots: Vec<&Shot> = places.iter().map(|i| &dataset.shots[*i]).collect();
        let group = dataset.by.clone().zip(label);
        let group = group.as_ref();
        let shots = shots.as_slice();
        of_rows::fit(request::Request { dataset, shots, group, options, done })
    };
    dataset.labelled().into_iter().map(fit).collect()
}

/// Whether a data set and the choices of its fit are such that it can be tried.
fn check(dataset: &Dataset, options: &Options) -> Result<(), FitError> {
    let faults = options.faults();
    if !faults.is_empty() {
        return Err(FitError::Options(faults));
    }
    let faults = dataset.faults();
    if !faults.is_empty() {
        return Err(FitError::Invalid { dataset: dataset.name.clone(), faults });
    }
    Ok(())
}
