//! Nonlinear least squares within bounds: min ½‖r(x)‖² over lower ≤ x ≤ upper.
//!
//! A problem is any type that implements argmin's [`Operator`] (x ↦ r, m residuals) and
//! [`Jacobian`] (x ↦ ∂r/∂x, m × n). [`minimise`] is a trust-region Gauss–Newton method: a step
//! minimises the linear model ½‖J s + r‖² within a radius and the bounds, and the radius follows
//! the quality of the model. The search ends when the residuals are orthogonal to every direction
//! that the bounds leave open. `trust_region` is the loop, `step` makes a step, `linear_algebra`
//! holds its factorisations.
//!
//! - Moré, J. J. (1978). The Levenberg–Marquardt algorithm: implementation and theory. Lecture Notes
//!   in Mathematics 630, 105–116.
//! - Bates, D. M. and Watts, D. G. (1981). A relative offset orthogonality convergence criterion for
//!   nonlinear least squares. Technometrics 23, 179–183.
use argmin::core::{Error, Executor, Jacobian, Operator};
use nalgebra::{DMatrix, DVector};

mod bounds;
mod linear_algebra;
mod step;
mod termination;
mod trust_region;

pub use bounds::{Activity, Bounds};
pub use termination::Termination;

use trust_region::TrustRegion;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Maximum number of steps tried. 1000 by default: the hardest certified problem of NIST takes
    /// 810, most take ten to twenty.
    pub max_iterations: u32,
    /// The search ends if ‖J s‖ ≤ this · ‖r‖ for a full step s within the bounds. The length of s
    /// is then about this · √(m − n) standard errors. 1e-14 by default: the rounding of the
    /// residuals.
    pub orthogonality: f64,
}

impl Options {
    /// The default: to minimise to the rounding of the residuals.
    pub const DEFAULT: Self = Self { max_iterations: 1000, orthogonality: 1e-14 };
}

impl Default for Options {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The outcome of a minimisation, converged or not.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The minimum x, of length n.
    pub x: DVector<f64>,
    /// The residuals r(x), of length m.
    pub residuals: DVector<f64>,
    /// Their derivatives ∂r/∂x at x, m × n.
    pub jacobian: DMatrix<f64>,
    /// The value ½‖r(x)‖².
    pub cost: f64,
    /// Why the search ended.
    pub termination: Termination,
    /// Number of steps tried, refused ones included.
    pub iterations: u64,
    /// Which parameters are at a bound, of length n.
    pub active: Vec<Activity>,
}

/// Wrong use of [`minimise`].
#[derive(Debug, thiserror::Error)]
pub enum OptimiseError {
    /// The start has no elements.
    #[error("the problem has no parameters")]
    NoParameters,
    /// The problem has no residuals.
    #[error("there are no residuals to minimise")]
    NoResiduals,
    /// Two lengths that must agree differ.
    #[error("expected {expected} {what}, found {found}")]
    Length {
        /// Name of the length.
        what: &'static str,
        /// The expected number.
        expected: usize,
        /// The number found.
        found: usize,
    },
    /// The start is not finite or outside its bounds, which may leave it no value.
    #[error(
        "parameter {index} starts at {value}; expected a finite number between its bounds {lower} and {upper}"
    )]
    Start {
        /// The parameter, from 0.
        index: usize,
        /// Its start.
        value: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// [`Options::orthogonality`] is not a number from 0 to 1.
    #[error("the orthogonality to stop at is {0}; expected a number from 0 to 1")]
    Orthogonality(f64),
    /// The residuals, their squares or their Jacobian are not finite at the start.
    #[error("the residuals, their squares or their derivatives are not finite at the start")]
    NotFinite,
    /// The problem's own error at the start.
    #[error("the residuals cannot be evaluated at the start")]
    Problem(#[source] Error),
    /// Any other error of argmin's.
    #[error("the minimisation could not be run")]
    Executor(#[source] Error),
}

/// Minimises ½‖r(x)‖² from `start` within `bounds`. Every point at which `problem` is evaluated
/// lies within the bounds, exactly. A step is shortened if the problem returns an error or values
/// that are not finite at its end.
///
/// # Errors
///
/// Wrong use only: lengths that differ, bounds that cross, a start that is outside the bounds or
/// has residuals that are not finite, a problem whose number of residuals changes. A failure to
/// converge is a [`Solution::termination`].
pub fn minimise<P>(
    problem: P,
    start: &DVector<f64>,
    bounds: &Bounds,
    options: &Options,
) -> Result<Solution, OptimiseError>
where
    P: Operator<Param = DVector<f64>, Output = DVector<f64>>
        + Jacobian<Param = DVector<f64>, Jacobian = DMatrix<f64>>,
{
    if start.is_empty() {
        return Err(OptimiseError::NoParameters);
    }
    if !(0.0..1.0).contains(&options.orthogonality) {
        return Err(OptimiseError::Orthogonality(options.orthogonality));
    }
    bounds.check(start)?;
    let result = Executor::new(problem, TrustRegion::new(bounds, options))
        .configure(|state| state.param(start.clone()).max_iters(u64::from(options.max_iterations)))
        .run()
        .map_err(|error| error.downcast().unwrap_or_else(OptimiseError::Executor))?;
    let state = result.state;
    let (Some(x), Some(residuals), Some(jacobian)) = (state.param, state.residuals, state.jacobian) else {
        return Err(OptimiseError::NoParameters);
    };
    Ok(Solution {
        active: bounds.activity(&x),
        x,
        residuals,
        jacobian,
        cost: state.cost,
        termination: result.solver.termination().unwrap_or(Termination::MaxIterations),
        iterations: state.iter,
    })
}

fn expect_length(what: &'static str, expected: usize, found: usize) -> Result<(), OptimiseError> {
    if expected == found { Ok(()) } else { Err(OptimiseError::Length { what, expected, found }) }
}
