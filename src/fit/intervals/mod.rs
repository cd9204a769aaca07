//! Confidence intervals and regions: profiles of the likelihood and the bootstrap.
pub(crate) mod bootstrap;
pub(crate) mod confidence_region;
pub(crate) mod profile;
