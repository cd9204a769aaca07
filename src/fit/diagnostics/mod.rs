//! How far a fit can be trusted.
pub(crate) mod goodness;
pub(crate) mod identifiability;
pub(crate) mod other_models;
pub(crate) mod refuted;
pub(crate) mod trends;
