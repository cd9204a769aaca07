//! Data set + settings → [`Fit`]: estimates, uncertainties, residuals and an assessment.

pub(crate) mod analysis;
mod bootstrap;
mod camera;
pub mod check;
mod common;
pub(crate) mod deviations;
pub(crate) mod doubts;
pub(crate) mod film;
pub(crate) mod film_words;
pub(crate) mod goodness;
mod of_balls;
mod of_discs;
mod regions;
mod request;
mod result;
mod verdict;

pub use analysis::{ExtractedDiscs, extract, extract_discs, fit, fit_watched};
pub(crate) use bootstrap::Bootstrap;
pub use camera::FoundCamera;
pub(crate) use deviations::Trend;
pub(crate) use film::FittedFilm;
pub(crate) use film_words::Remark;
pub(crate) use goodness::{Counted, Goodness, Identifiability, Influence, NoiseVerdict};
pub(crate) use regions::Contour;
pub use request::{Depth, Falling, FitError, Options};
pub(crate) use result::{Computed, Diagnostics, Explanation, Noise, Residual, Robust, Scatter, Weight};
pub use result::{Fit, Rejected};
pub use verdict::{Grade, Verdict};

pub(crate) use crate::problem::Budget;
pub use crate::problem::{
    DiscImpact, FilmError, Id, ParameterEstimate as Estimate, Prediction, RowsError, Status, predict,
};
