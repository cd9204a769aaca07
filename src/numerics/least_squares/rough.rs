//! Sums of squares with small kinks, as those of frames have where a landing or the end of sliding crosses one.

use argmin::core::{Jacobian, Operator};
use nalgebra::{DMatrix, DVector};

use super::{Constraints, OptimiseError, Options, Solution, Termination, minimise};

/// Where as many iterations again lower ½‖r‖² by less than this, a tenth of a standard error, they are at its least.
const NO_LOWER: f64 = 5e-3;

/// As [`minimise`], and whether the solution rests: at a minimum, at a kink, or going to and fro between kinks. `problem`
/// makes the problem, which may be minimised twice.
///
/// # Errors
///
/// As [`minimise`].
pub fn minimise_rough<P>(
    problem: impl Fn() -> P,
    start: &DVector<f64>,
    constraints: &Constraints,
    options: &Options,
) -> Result<(Solution, bool), OptimiseError>
where
    P: Operator<Param = DVector<f64>, Output = DVector<f64>>
        + Jacobian<Param = DVector<f64>, Jacobian = DMatrix<f64>>,
{
    let first = minimise(problem(), start, constraints, options)?;
    let rests = |solution: &Solution| {
        solution.termination.converged() || solution.termination == Termination::Stalled
    };
    if first.termination != Termination::MaxIterations {
        let rests = rests(&first);
        return Ok((first, rests));
    }
    let again = minimise(problem(), &first.x, constraints, options)?;
    let rests = rests(&again) || first.cost - again.cost < NO_LOWER;
    let iterations = first.iterations + again.iterations;
    let evaluations = first.evaluations + again.evaluations;
    let jacobian_evaluations = first.jacobian_evaluations + again.jacobian_evaluations;
    Ok((Solution { iterations, evaluations, jacobian_evaluations, ..again }, rests))
}

#[cfg(test)]
mod tests {
    use argmin::core::Error;

    use super::*;

    /// r = (x − 1, 100·height·|sin 1000x|): kinks everywhere, that lie `height` above the parabola.
    struct Saw(f64);

    impl Operator for Saw {
        type Param = DVector<f64>;
        type Output = DVector<f64>;

        fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
            Ok(DVector::from_vec(vec![x[0] - 1.0, self.0 * (1000.0 * x[0]).sin().abs()]))
        }
    }

    impl Jacobian for Saw {
        type Param = DVector<f64>;
        type Jacobian = DMatrix<f64>;

        fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
            let slope = 1000.0 * (1000.0 * x[0]).cos() * (1000.0 * x[0]).sin().signum();
            Ok(DMatrix::from_vec(2, 1, vec![1.0, self.0 * slope]))
        }
    }

    fn options(max_iterations: u32) -> Options {
        Options { max_iterations, ..Options::default() }
    }

    #[test]
    fn small_kinks_are_a_minimum_and_a_long_way_is_not() {
        let free = Constraints::none(1);
        let start = DVector::from_element(1, 1.02);
        let (_, rests) = minimise_rough(|| Saw(0.01), &start, &free, &options(50)).unwrap();
        assert!(rests);
        // one step does not reach the minimum from far away
        let far = DVector::from_element(1, 1e6);
        let (solution, rests) = minimise_rough(|| Saw(1e3), &far, &free, &options(1)).unwrap();
        assert!(!rests, "{:?}", solution.termination);
    }
}
