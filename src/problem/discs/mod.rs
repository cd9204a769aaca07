//! Films of discs as blocks: pucks on ice or on air tables.

pub(crate) mod block;
pub(crate) mod first_guess;
mod frames;
pub(crate) mod impact;
mod law;
mod lines;
pub(crate) mod measure;
mod motion;
mod outcome;
pub(crate) mod own;
mod points;
mod priors;
pub(crate) mod quantities;
pub(crate) mod run;
pub(crate) mod stick;
