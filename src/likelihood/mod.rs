//! How likely the measurements of a shot are, given the parameters: of frames, of velocities, of angles.
pub mod errors_in_variables;
pub mod fitted;
pub mod frames;
mod joint_errors;
mod kinks;
pub mod prediction;
pub mod problem;
pub mod sample;
mod shot_errors;
pub mod whitening;
