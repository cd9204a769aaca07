//! Positions on the table ↔ what the camera and the tracker made of them.

pub mod camera;
pub(crate) mod discs;
pub(crate) mod drops;
