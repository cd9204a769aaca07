//! Numerical methods that know no balls.
pub mod least_squares;
pub(crate) mod optimal_design;
pub(crate) mod quadrature;
