//! Numerical methods that know no balls.
#[cfg(feature = "fit")]
pub mod least_squares;
#[cfg(feature = "fit")]
pub(crate) mod optimal_design;
pub(crate) mod quadrature;
#[cfg(feature = "fit")]
pub(crate) mod small_products;
