//! The motion of both balls before, through and after an impact.

pub(crate) mod both_balls;
pub(crate) mod frames;
pub mod scene;
pub(crate) mod shot_scene;
pub(crate) mod unknowns;
