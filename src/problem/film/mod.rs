//! Films of balls as blocks.

pub(crate) mod block;
pub(crate) mod camera;
pub(crate) mod causes;
pub(crate) mod dual;
pub(crate) mod first_guess;
pub(crate) mod frames;
pub(crate) mod impact;
pub(crate) mod motion;
pub(crate) mod outliers;
pub(crate) mod own;
pub(crate) mod priors;
pub(crate) mod spins;
pub(crate) mod states;
