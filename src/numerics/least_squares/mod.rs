//! Nonlinear least squares with constraints: min ½‖r(x)‖² over lower ≤ x ≤ upper, A x ≤ b, A x = b.
//!
//! A problem is any type that implements argmin's [`Operator`] (x ↦ r, m residuals) and [`Jacobian`]
//! (x ↦ ∂r/∂x, m × n). [`minimise`] is a trust-region Gauss–Newton method: the linear model
//! ½‖J s + r‖² is minimised within a radius, the step is tried, the radius grows or shrinks by how well
//! the model did, until the residuals are orthogonal to every direction that is left. The files in the
//! order of the algorithm: `constraints`, `solver` (the loop), `step`, `qp` (which constraints are
//! active, by Clarabel), `active_set` (the step exactly), `working_set` and `linear_algebra`,
//! `termination`. Apart from these, `scan` finds where to begin where there are several minima.
//!
//! - Moré, J. J. (1978). The Levenberg–Marquardt algorithm: implementation and theory. Lecture Notes in
//!   Mathematics 630, 105–116.
//! - Bates, D. M. and Watts, D. G. (1981). A relative offset orthogonality convergence criterion for
//!   nonlinear least squares. Technometrics 23, 179–183.
use argmin::core::{Error, Executor, Jacobian, Operator};
use nalgebra::{DMatrix, DVector};

mod active_set;
mod constraints;
mod linear_algebra;
mod nearest;
mod qp;
mod rough;
mod scan;
mod solver;
mod step;
mod termination;
#[cfg(test)]
mod testing;
mod working_set;

pub use constraints::{Constraints, Linear};
pub(crate) use rough::minimise_rough;
pub(crate) use scan::scan;
pub use termination::Termination;

use solver::TrustRegion;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The most steps that are tried. 1000 by default: the hardest certified problem
    /// of NIST takes 810, most take ten to twenty.
    pub max_iterations: u32,
    /// Stop when ‖J s‖ ≤ this · ‖r‖ for a full step s that the constraints allow. A step at that point
    /// is about this · √(m − n) standard errors long. 1e-14 by default, which is rounding: to
    /// minimise as far as the digits of the residuals go.
    pub orthogonality: f64,
}

impl Options {
    /// The default: to minimise as far as the digits of the residuals go.
    pub const DEFAULT: Self = Self { max_iterations: 1000, orthogonality: 1e-14 };

    /// Options that stop as early as these or others do.
    pub(crate) fn at_most(&self, others: &Self) -> Self {
        Self {
            max_iterations: self.max_iterations.min(others.max_iterations),
            orthogonality: self.orthogonality.max(others.orthogonality),
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Where a parameter is within its bounds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Activity {
    /// Between its bounds.
    Free,
    /// Exactly at its lower bound; also one whose bounds are equal.
    AtLower,
    /// Exactly at its upper bound.
    AtUpper,
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
    /// The value ½‖r(x)‖² that was minimised.
    pub cost: f64,
    /// Why it stopped.
    pub termination: Termination,
    /// Steps considered, those that were refused included.
    pub iterations: u64,
    /// Evaluations of the residuals.
    pub evaluations: u64,
    /// Evaluations of the Jacobian.
    pub jacobian_evaluations: u64,
    /// Which parameters are at a bound, of length n.
    pub active: Vec<Activity>,
    /// The rows of [`Constraints::inequalities`] that hold with equality, to rounding.
    pub active_inequalities: Vec<usize>,
}

/// Wrong use of [`minimise`].
#[derive(Debug, thiserror::Error)]
pub enum OptimiseError {
    /// The start has no elements.
    #[error("there is no parameter to fit")]
    NoParameters,
    /// The problem has no residuals.
    #[error("there are no residuals to minimise")]
    NoResiduals,
    /// Two lengths that must agree do not.
    #[error("expected {expected} {what}, found {found}")]
    Length {
        /// What is counted.
        what: &'static str,
        /// How many there must be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A lower bound is above its upper one, not a number, or infinite on the wrong side.
    #[error("the bounds of parameter {index} leave it no value: {lower} to {upper}")]
    Bounds {
        /// The parameter, from 0.
        index: usize,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// A linear constraint has a row of zeros, or an entry that is not finite.
    #[error("row {row} of the {what} constraints is zero or not finite")]
    Row {
        /// "inequality" or "equality".
        what: &'static str,
        /// The row, from 0.
        row: usize,
    },
    /// The start is not finite.
    #[error("parameter {index} starts at {value}, which is not finite")]
    StartNotFinite {
        /// The parameter, from 0.
        index: usize,
        /// Its start.
        value: f64,
    },
    /// The start is outside the bounds.
    #[error("parameter {index} starts at {value}, outside its bounds {lower} to {upper}")]
    StartOutside {
        /// The parameter, from 0.
        index: usize,
        /// Its start.
        value: f64,
        /// Its lower bound.
        lower: f64,
        /// Its upper bound.
        upper: f64,
    },
    /// The start violates a linear constraint.
    #[error("the start violates row {row} of the {what} constraints by {excess}")]
    StartViolates {
        /// "inequality" or "equality".
        what: &'static str,
        /// The row, from 0.
        row: usize,
        /// By how much.
        excess: f64,
    },
    /// [`Options::orthogonality`] is not a number from 0 to 1.
    #[error("the orthogonality to stop at is {0}; expected a number from 0 to 1")]
    Orthogonality(f64),
    /// A residual is not finite at the start.
    #[error("residual {index} is {value} at the start")]
    ResidualNotFinite {
        /// The residual, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The Jacobian or the sum of squares is not finite, or too large to compute with, at the start.
    #[error("the Jacobian or the sum of squares is not finite at the start")]
    JacobianNotFinite,
    /// The problem's own error at the start.
    #[error("the residuals cannot be evaluated at the start")]
    Problem(#[source] Error),
    /// An error of argmin's that none of the above covers.
    #[error("the minimisation could not be run")]
    Executor(#[source] Error),
}

/// Minimises ½‖r(x)‖² from `start` (n) within `constraints`. Every point at which `problem` is evaluated
/// satisfies them, the bounds exactly. Where it returns an error or values that are not finite the step is
/// shortened.
///
/// # Errors
///
/// Wrong use only: lengths that disagree, bounds that cross, a start that is not finite, violates the
/// constraints or has residuals that are not finite, a problem that changes its number of residuals. How
/// the minimisation went is [`Solution::termination`].
pub fn minimise<P>(
    problem: P,
    start: &DVector<f64>,
    constraints: &Constraints,
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
    constraints.check(start)?;
    let result = Executor::new(problem, TrustRegion::new(constraints, options))
        .configure(|state| state.param(start.clone()).max_iters(u64::from(options.max_iterations)))
        .run()
        .map_err(|error| error.downcast().unwrap_or_else(OptimiseError::Executor))?;
    let count = |what: &str| result.problem.counts.get(what).copied().unwrap_or(0);
    let (evaluations, jacobian_evaluations) = (count("operator_count"), count("jacobian_count"));
    let state = result.state;
    let (Some(x), Some(residuals), Some(jacobian)) = (state.param, state.residuals, state.jacobian) else {
        return Err(OptimiseError::NoParameters);
    };
    Ok(Solution {
        active: constraints.activity(&x),
        active_inequalities: constraints.active_inequalities(&x),
        x,
        residuals,
        jacobian,
        cost: state.cost,
        termination: result.solver.termination().unwrap_or(Termination::MaxIterations),
        iterations: state.iter,
        evaluations,
        jacobian_evaluations,
    })
}

fn expect_length(what: &'static str, expected: usize, found: usize) -> Result<(), OptimiseError> {
    if expected == found { Ok(()) } else { Err(OptimiseError::Length { what, expected, found }) }
}
