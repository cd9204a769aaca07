//! Intervals and regions beyond value ± t·error.

pub(crate) mod bootstrap;
pub(crate) mod regions;
