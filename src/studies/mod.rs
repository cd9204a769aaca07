//! Studies of accuracy against time, and of the bias that a simpler model causes.
pub mod accuracy;
pub mod bias;
