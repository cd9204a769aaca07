//! Films before a fit: the effects of camera and tracker on the positions (noise, its correlation,
//! rounding, dropped frames), first guesses of impacts, corners of paths, and reasons for which a
//! shot cannot be used.

pub(crate) mod corners;
pub(crate) mod drops;
pub(crate) mod frame_noise;
pub(crate) mod meeting;
pub(crate) mod noise_correlation;
pub(crate) mod rigid_body;
pub(crate) mod unusable;
