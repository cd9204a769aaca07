//! Effects of camera and tracker on the positions: noise, rounding, dropped frames.

pub(crate) mod drops;
pub(crate) mod frame_noise;
pub(crate) mod rigid_body;
