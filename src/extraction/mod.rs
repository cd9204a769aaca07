//! Preparation of tracks for a fit of their frames: first guesses, correlation of the noise, corners
//! of paths; and reasons for which a shot cannot be used.

mod initial_guess;
mod noise_correlation;
mod unusable;

pub(crate) use initial_guess::{FirstGuess, from_paths, leave_out_after_cushion, leave_out_before_cushion};
pub(crate) use noise_correlation::{MIN_RHO, noise_correlation};
pub(crate) use unusable::{Bodies, Unusable};
