//! Tracks → what a fit of their frames begins with: first guesses, the noise that lasts, corners of paths,
//! spins that markers show. Why a shot cannot be used is in `unusable`.

mod cushion;
mod initial_guess;
mod marker_rotation;
mod noise_correlation;
mod unusable;

pub(crate) use cushion::{leave_out_after_cushion, leave_out_before_cushion};
pub(crate) use initial_guess::{FirstGuess, from_paths, object_speed};
#[cfg(feature = "io")]
pub(crate) use marker_rotation::turn;
pub use marker_rotation::{Rotation, Rotations};
pub use noise_correlation::NoiseCorrelation;
pub(crate) use noise_correlation::noise_correlation;
pub use unusable::{Bodies, Unusable};
