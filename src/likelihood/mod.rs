//! How likely the measurements of a shot are, given the parameters: of frames, of velocities, of angles.

pub(crate) mod corrected;
pub(crate) mod errors_in_variables;
pub(crate) mod fitted;
pub(crate) mod frames;
mod joint_errors;
mod kinks;
pub(crate) mod prediction;
pub(crate) mod problem;
pub(crate) mod sample;
mod shot_errors;
mod small_products;
pub(crate) mod whitening;

pub use frames::{Film, rows};
pub use prediction::{Plan, Prediction, Unpredictable, wrap};
pub use whitening::{EstimatedSd, covariance};
