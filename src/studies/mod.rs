//! What accuracy costs in time, and what a simpler model does to the fitted parameters.
pub mod accuracy;
pub mod bias;
