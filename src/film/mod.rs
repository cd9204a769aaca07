//! Positions on the table ↔ what the camera and the tracker made of them.

pub(crate) mod drops;
pub(crate) mod frame_noise;
pub(crate) mod grid;
pub(crate) mod rigid_body;
