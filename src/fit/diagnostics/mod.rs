//! How far a fit can be trusted.
pub(crate) mod goodness;
pub(crate) mod identifiability;
pub(crate) mod refuted;
pub(crate) mod trends;
