//! The motion of both balls before, through and after an impact.

pub(crate) mod frames;
pub mod scene;
pub(crate) mod unknowns;
