//! What was measured and what is asked of it, as values: shots, tracks, observables, parameters.
pub mod correction;
pub mod dataset;
pub(crate) mod disc_centres;
pub(crate) mod isolate;
pub mod loss;
pub(crate) mod marker_groups;
pub(crate) mod number;
pub(crate) mod object_ball;
pub mod observable;
pub mod parameter;
pub mod relation;
pub(crate) mod rigid_body;
pub mod spin;
pub mod track;
pub(crate) mod valid;
pub mod values;
pub mod viewpoint;
