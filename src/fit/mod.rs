//! Data set + settings → [`Fit`]: estimates, uncertainties, residuals, and what to think of them.
//!
//! # How to add an unknown
//!
//! A parameter of the collision is an entry of [`Parameter`](crate::measurement::parameter::Parameter) with its bounds and its start, and
//! one of the inputs by which `physics::collision` gives derivatives. What the shots of a film share besides is a [`SharedKind`]:
//!
//! 1. Give it a place among what all shots share: if the motion depends on it, a component of `SHARED` in `likelihood/frames` and a use
//!    where a path begins (`path_start`); if it moves frames, a [`Correction`](crate::measurement::correction::Correction) with its formula
//!    in `film/camera.rs`.
//! 2. Add it to [`SharedKind`] with its name, start, prior and bounds (`likelihood/frames/shared_unknowns.rs`).
//! 3. Ask for it: the list of a fit is what `shared_unknowns::of_fit` returns.
//!
//! Solver, bounds, errors, profiles and the reports take it from the list. The cloth's bounce e_t is an example:
//! [`FilmUnknowns::bounce`] asks for it.

pub(crate) mod analysis;
mod assemble;
mod calibration;
mod camera;
pub mod causes;
pub mod check;
mod counted;
pub(crate) mod diagnostics;
mod disc_curve;
pub(crate) mod discs;
mod doubts;
pub(crate) mod effort;
mod error;
mod estimate;
mod estimates;
pub(crate) mod fidelity_choice;
pub mod footage;
mod footage_doubts;
pub(crate) mod frames;
pub(crate) mod global;
pub(crate) mod intervals;
pub(crate) mod minimum;
pub(crate) mod model_choice;
pub(crate) mod noise;
mod nonsmooth;
mod options;
pub(crate) mod outlying;
pub(crate) mod outlying_rows;
mod request;
mod result;
pub(crate) mod robust;
pub(crate) mod rows;
pub(crate) mod run;
pub(crate) mod samples;
pub(crate) mod saturation;
mod scan;
mod scatter;
mod scatter_starts;
pub(crate) mod search;
pub(crate) mod settled;
mod shot_loss;
mod side_spin;
pub(crate) mod slice;
mod starts;
pub(crate) mod uncertainty;
mod verdict;
pub(crate) mod warnings;

pub use crate::likelihood::frames::shared_unknowns::Kind as SharedKind;
pub use analysis::{Analysis, Prepared, analyse, analyse_watched, calibrated_discs};
pub use camera::{FoundCamera, FoundCorrection};
pub use counted::Counted;
pub use diagnostics::goodness::{Goodness, NoiseVerdict, Normality};
pub use diagnostics::identifiability::{Combination, Identifiability};
pub use diagnostics::influence::Influence;
pub use diagnostics::other_models::{Alternative, LikelihoodRatio};
pub(crate) use diagnostics::refuted::mean as mean_of_shots;
pub use diagnostics::refuted::{MeasuredRestitution, Refuted};
pub use diagnostics::trends::{Trend, Variable};
pub use disc_curve::FrictionCurve;
pub use error::FitError;
pub use estimate::{Estimate, Intervals, Status};
pub use frames::{FittedFrames, OfShot};
pub use intervals::bootstrap::{Bootstrap, Resampled};
pub use intervals::confidence_region::{Contour, LEVELS, Level};
pub use intervals::profile::Profile;
pub use options::{Depth, Falling, FilmUnknowns, Films, Method, Options};
pub use result::{Bound, Computed, Diagnostics, Fit, JointFit, Noise, Rejected, Residual, SharedEstimate};
pub use robust::{DOWN_WEIGHTED, Robust};
pub use saturation::Plateau;
pub use scatter::Scatter;
pub use starts::{FoundMinimum, Starts};
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

/// Fits a data set whose impacts have been extracted ([`Prepared`], [`footage::with_impacts`]), with the frames of its shots where there
/// are any: [`Method::Joint`] fits these themselves; otherwise they give the smallest standard errors that they would allow. A method
/// of `None` is joint where every shot has its frames. `done` is called after each sample of the bootstrap, from any thread.
///
/// # Errors
/// See [`FitError`]; the first label that fails ends it.
pub fn fit_watched(
    dataset: &Dataset,
    films: &Films,
    options: &Options,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Fit>, FitError> {
    fit_with(dataset, films, (options, false), done)
}

/// The same; causes of residuals are not looked for where the spins are suspect, if others look for these `spins_first`.
fn fit_with(
    dataset: &Dataset,
    films: &Films,
    (options, spins_first): (&Options, bool),
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Fit>, FitError> {
    if dataset.awaits_extraction() {
        return Err(FitError::NotExtracted(dataset.name.clone()));
    }
    check(dataset, options)?;
    let filmed = || !films.is_empty() && films.iter().all(Option::is_some);
    let method = options.method.unwrap_or_else(|| if filmed() { Method::Joint } else { Method::TwoStage });
    let options = &Options { method: Some(method), ..*options };
    let fit = |(label, places): (Option<String>, Vec<usize>)| {
        let shots: Vec<&Shot> = places.iter().map(|i| &dataset.shots[*i]).collect();
        let films: Vec<_> = places.iter().map(|i| films.get(*i).cloned().flatten()).collect();
        let group = dataset.by.clone().zip(label);
        let group = group.as_ref();
        let shots = shots.as_slice();
        run::fit_shots(&request::Request { dataset, shots, films: &films, group, options, spins_first, done })
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
