//! Films of discs as blocks: pucks on ice or on air tables.

pub(crate) mod block;
pub(crate) mod first_guess;
pub(crate) mod impact;
pub(crate) mod law;
pub(crate) mod measure;
mod motion;
pub(crate) mod own;
mod stuck;
