//! Films of balls as blocks.

pub(crate) mod block;
pub(crate) mod camera;
pub(crate) mod causes;
pub(crate) mod dual;
pub(crate) mod film_data;
pub(crate) mod filmed;
pub(crate) mod impact;
pub(crate) mod marker_rotation;
pub(crate) mod motion;
pub(crate) mod outliers;
pub(crate) mod own;
#[cfg(feature = "io")]
pub(crate) mod planned;
pub(crate) mod priors;
pub(crate) mod shots;
pub(crate) mod spins;
