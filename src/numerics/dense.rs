//! Least squares of some unknowns by their normal equations.

use nalgebra::{DMatrix, DVector};

use super::least_squares::{self, Descending, FIRST_DAMPING, ROUNDING, Step, SumOfSquares};

/// A sum of squares at a place, with its normal equations.
#[derive(Clone)]
pub(crate) struct Place<T> {
    /// Values of the unknowns.
    pub(crate) x: DVector<f64>,
    pub(crate) sum: f64,
    /// JᵀJ, with the Jacobian J of the residuals r.
    pub(crate) matrix: DMatrix<f64>,
    /// Jᵀr
    pub(crate) gradient: DVector<f64>,
    /// Other results at the place.
    pub(crate) rest: T,
}

/// A function that returns the sum of squares at values of the unknowns.
struct Function<F>(F);

/// Descends from `x` until a step promises or gains less than `stall`; returns the lowest place
/// met.
pub(crate) fn descend<T: Clone>(
    x: DVector<f64>,
    (steps, stall): (usize, f64),
    evaluate: impl Fn(DVector<f64>) -> Place<T>,
) -> Place<T> {
    let start = evaluate(x);
    let how = Descending { damping: FIRST_DAMPING, steps, stall };
    least_squares::descend(&Function(evaluate), start, how).end
}

impl<T: Clone, F: Fn(DVector<f64>) -> Place<T>> SumOfSquares for Function<F> {
    type State = DVector<f64>;
    type Evaluation = Place<T>;

    fn evaluate(&self, x: DVector<f64>) -> Place<T> {
        (self.0)(x)
    }

    fn sum(&self, at: &Place<T>) -> f64 {
        at.sum
    }

    fn rounding(&self, at: &Place<T>) -> f64 {
        ROUNDING * at.sum
    }

    fn step(&self, at: &Place<T>, damping: f64) -> Option<Step<DVector<f64>>> {
        let mut raised = at.matrix.clone();
        raised.set_diagonal(&(at.matrix.diagonal() * (1.0 + damping)));
        let step = -raised.cholesky()?.solve(&at.gradient);
        // −(2 gᵀs + sᵀJᵀJs)
        let promise = -(2.0 * at.gradient.dot(&step) + step.dot(&(&at.matrix * &step)));
        promise.is_finite().then(|| Step { end: &at.x + step, promise })
    }
}
