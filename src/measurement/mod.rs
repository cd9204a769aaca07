//! Measurements and the quantities asked for, as values: shots, tracks, observables, parameters.
pub mod correction;
pub mod dataset;
pub mod fault;
pub mod loss;
pub mod observable;
pub mod parameter;
pub mod spin;
pub mod track;
pub mod valid;
pub(crate) mod written;

pub(crate) use crate::numerics::number;
