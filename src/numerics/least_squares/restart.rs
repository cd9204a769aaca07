//! Minimisation of sums of squares with small kinks, as those of frames have if a landing or the
//! end of sliding crosses one.
use argmin::core::{Jacobian, Operator};
use nalgebra::{DMatrix, DVector};

use super::{Bounds, OptimiseError, Options, Solution, Termination, minimise};

/// Reduction of ½‖r‖² in a second search below which the first had ended between kinks: a tenth of
/// a standard error.
const NEGLIGIBLE_REDUCTION: f64 = 5e-3;

/// Minimises as [`minimise`] does, and once more from its end if the iteration limit was reached.
/// Also returns whether the search has ended: at a minimum, at a kink, or between kinks. `problem`
/// makes the problem.
///
/// # Errors
///
/// As [`minimise`].
pub fn minimise_with_restart<P>(
    problem: impl Fn() -> P,
    start: &DVector<f64>,
    bounds: &Bounds,
    options: &Options,
) -> Result<(Solution, bool), OptimiseError>
where
    P: Operator<Param = DVector<f64>, Output = DVector<f64>>
        + Jacobian<Param = DVector<f64>, Jacobian = DMatrix<f64>>,
{
    let has_ended = |solution: &Solution| {
        solution.termination.converged() || solution.termination == Termination::Stalled
    };
    let first = minimise(problem(), start, bounds, options)?;
    if first.termination != Termination::MaxIterations {
        let ended = has_ended(&first);
        return Ok((first, ended));
    }
    let mut second = minimise(problem(), &first.x, bounds, options)?;
    second.iterations += first.iterations;
    let ended = has_ended(&second) || first.cost - second.cost < NEGLIGIBLE_REDUCTION;
    Ok((second, ended))
}
