//! The loop: a trust-region method with the radius rule of MINPACK's LMDER (Moré 1978), as an argmin
//! solver. One iteration tries one step.
use argmin::core::{
    Error, IterState, Jacobian, KV, Operator, Problem, Solver, TerminationReason, TerminationStatus,
};
use nalgebra::{DMatrix, DVector};

use super::constraints::Constraints;
use super::linear_algebra::{Reduced, reduce};
use super::step::{Step, step};
use super::{OptimiseError, Options, Termination, expect_length};

/// The first radius in units of ‖D x₀‖. MINPACK's 100 lets the first step leave the region where the model
/// depends on its parameters (BoxBOD from its first start); from 0.1 to 10 all certified problems are solved.
const FIRST_RADIUS: f64 = 1.0;

/// A step is accepted when it brings this share of the predicted reduction (MINPACK).
const ACCEPTED: f64 = 1e-4;

/// Below this share the radius shrinks, above [`GOOD`] it grows to twice the step (MINPACK).
const POOR: f64 = 0.25;
const GOOD: f64 = 0.75;

/// What the radius is multiplied with after a step at which the residuals cannot be evaluated: nothing is
/// known of the cost there.
const SHRINK: f64 = 0.25;

/// The rounding of the cost in units of ε ‖r‖ (‖r‖ + ‖x‖_J), ‖x‖_J² = Σ ‖J_j‖² x_j²: the residuals are
/// good to the rounding of the data and parameters that they are computed from, with a factor for the
/// operations in between.
const ROUNDING: f64 = 4.0;

/// A predicted reduction below this share of the cost cannot be told from rounding by comparing costs, even
/// where the residuals are exact. The remaining steps are full ones, judged by their length.
const SMALL_REDUCTION: f64 = 1e-14;

/// Where the radius has shrunk until its steps promise no more than rounding, but a full step would promise
/// no more than this many times as much, it was rounding that shrank it and full steps are tried. The root
/// of it, 30, is how much shorter the refused steps may be than the full one.
const ROUNDING_GAP: f64 = 1e3;

/// Where the radius has shrunk until its steps promise less than this part of what a full step still to be taken
/// would, the residuals have a kink: the search ends.
const WORTHLESS: f64 = 0.01;

/// Such steps go on while each is shorter than the one before by this factor. Gauss–Newton converges
/// linearly at worst; at the minimum the lengths are rounding and stop falling.
const CONTRACTION: f64 = 0.9;

/// A step that changes no parameter by more than this share of it is its rounding.
const SMALL_STEP: f64 = 4.0 * f64::EPSILON;

/// What argmin hands from one iteration to the next: x, J(x), r(x) and ½‖r‖².
pub type Iterate = IterState<DVector<f64>, (), DMatrix<f64>, (), DVector<f64>, f64>;

/// The solver's own memory.
pub struct TrustRegion<'a> {
    constraints: &'a Constraints,
    options: &'a Options,
    /// J at the current point, reduced; there is one once `init` has succeeded.
    reduced: Option<Reduced>,
    /// The diagonal of D: the largest norm each column of J has had; 1 for one that was always zero.
    scale: DVector<f64>,
    /// Δ.
    radius: f64,
    /// No step has been accepted or refused yet: the radius is only a guess.
    first: bool,
    /// The length of the last step, if it was accepted for its length.
    polished: Option<f64>,
    /// The last step ended where the residuals cannot be evaluated.
    blocked: bool,
    termination: Option<Termination>,
}

/// Residuals, and what was computed from them, at a point where everything is finite.
struct Evaluation {
    residuals: DVector<f64>,
    cost: f64,
}

impl<'a> TrustRegion<'a> {
    pub fn new(constraints: &'a Constraints, options: &'a Options) -> Self {
        Self {
            constraints,
            options,
            reduced: None,
            scale: DVector::zeros(0),
            radius: f64::INFINITY,
            first: true,
            polished: None,
            blocked: false,
            termination: None,
        }
    }

    /// Why the solver stopped; `None` when argmin stopped it at the iteration limit.
    pub fn termination(&self) -> Option<Termination> {
        self.termination
    }

    /// D grows with the columns of J and never shrinks, so that a parameter that mattered once cannot run
    /// away where it matters less.
    fn rescale(&mut self, reduced: &Reduced) {
        if self.scale.is_empty() {
            self.scale = DVector::zeros(reduced.column_norms.len());
        }
        self.scale.zip_apply(&reduced.column_norms, |d, norm| *d = d.max(norm));
    }

    fn positive_scale(&self) -> DVector<f64> {
        self.scale.map(|d| if d > 0.0 { d } else { 1.0 })
    }

    /// After a trial at which the residuals or their Jacobian cannot be evaluated.
    fn shrink(&mut self, step: &Step) {
        self.blocked = true;
        self.first = false;
        self.polished = None;
        self.radius = SHRINK * step.length;
    }

    /// Δ after a trial that reduced the cost by `actual`.
    fn update_radius(&mut self, step: &Step, actual: f64) {
        if self.first {
            self.radius = self.radius.min(step.length);
            self.first = false;
        }
        let ratio = actual / step.predicted;
        if ratio <= POOR {
            // The minimum along s of the parabola through cost, slope and trial.
            let share =
                if actual >= 0.0 { 0.5 } else { (0.5 * step.slope / (step.slope + actual)).clamp(0.1, 0.5) };
            self.radius = share * self.radius.min(step.length / 0.1);
        } else if ratio >= GOOD || !step.limited {
            self.radius = 2.0 * step.length;
        }
    }
}

impl<P> Solver<P, Iterate> for TrustRegion<'_>
where
    P: Operator<Param = DVector<f64>, Output = DVector<f64>>
        + Jacobian<Param = DVector<f64>, Jacobian = DMatrix<f64>>,
{
    fn name(&self) -> &'static str {
        "trust region with constraints"
    }

    fn init(&mut self, problem: &mut Problem<P>, mut state: Iterate) -> Result<(Iterate, Option<KV>), Error> {
        let x = state.take_param().ok_or(OptimiseError::NoParameters)?;
        let residuals = problem.apply(&x).map_err(OptimiseError::Problem)?;
        if residuals.is_empty() {
            return Err(OptimiseError::NoResiduals.into());
        }
        if let Some(index) = residuals.iter().position(|r| !r.is_finite()) {
            return Err(OptimiseError::ResidualNotFinite { index, value: residuals[index] }.into());
        }
        let jacobian = problem.jacobian(&x).map_err(OptimiseError::Problem)?;
        expect_shape(&jacobian, residuals.len(), x.len())?;
        let cost = 0.5 * residuals.norm_squared();
        let reduced = reduce(&jacobian, &residuals)
            .filter(|_| cost.is_finite())
            .ok_or(OptimiseError::JacobianNotFinite)?;
        self.rescale(&reduced);
        let size = self.positive_scale().component_mul(&x).norm();
        // From x₀ = 0 nothing is known of the size of the steps: the first is a full one.
        self.radius = if size > 0.0 { FIRST_RADIUS * size } else { f64::INFINITY };
        if residuals.norm() <= ROUNDING * f64::EPSILON * spread(&reduced, &x) {
            self.termination = Some(Termination::ZeroResidual);
        }
        self.reduced = Some(reduced);
        Ok((state.param(x).residuals(residuals).jacobian(jacobian).cost(cost), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<P>,
        state: Iterate,
    ) -> Result<(Iterate, Option<KV>), Error> {
        let (Some(x), Some(residuals), Some(reduced)) = (&state.param, &state.residuals, &self.reduced)
        else {
            return Err(OptimiseError::NoParameters.into());
        };
        let (cost, count) = (state.cost, residuals.len());
        let norm = residuals.norm();
        let scale = self.positive_scale();
        let within = |radius: f64| step(x, reduced, &scale, radius, self.constraints);

        let rounding = ROUNDING * f64::EPSILON * norm * (norm + spread(reduced, x));
        let unjudgeable = rounding.max(SMALL_REDUCTION * cost);
        let worthless = WORTHLESS * self.options.orthogonality.powi(2) * cost;
        let mut polishing = self.polished.is_some();
        let mut step = within(if polishing { f64::INFINITY } else { self.radius });
        if !polishing && step.predicted <= unjudgeable {
            let full = if step.limited { within(f64::INFINITY) } else { step.clone() };
            polishing = full.predicted <= ROUNDING_GAP * unjudgeable;
            if polishing {
                step = full;
            }
        }
        let unchanged = step.trial.iter().zip(x.iter()).all(|(t, x)| (t - x).abs() <= SMALL_STEP * x.abs());
        self.termination = if !step.limited && step.tangent <= self.options.orthogonality * norm {
            Some(Termination::Orthogonal)
        } else if !step.limited && unchanged {
            Some(Termination::SmallStep)
        } else if self.polished.is_some_and(|last| step.length > CONTRACTION * last) {
            Some(Termination::SmallReduction)
        } else if !polishing && (unchanged || step.predicted <= rounding.max(worthless)) {
            Some(if self.blocked { Termination::NotFinite } else { Termination::Stalled })
        } else {
            None
        };
        if self.termination.is_some() {
            return Ok((state, None));
        }

        let Some(evaluation) = evaluate(problem, &step.trial, count)? else {
            self.shrink(&step);
            return Ok((state, None));
        };
        let actual = cost - evaluation.cost;
        let accepted = actual >= if polishing { -unjudgeable } else { ACCEPTED * step.predicted };
        if !accepted {
            if polishing {
                self.termination = Some(Termination::SmallReduction);
            }
            self.blocked = false;
            self.update_radius(&step, actual);
            return Ok((state, None));
        }
        let Some((jacobian, reduced)) = linearise(problem, &step.trial, &evaluation.residuals)? else {
            self.shrink(&step);
            return Ok((state, None));
        };
        self.blocked = false;
        self.update_radius(&step, actual);
        self.polished = polishing.then_some(step.length);
        self.rescale(&reduced);
        if evaluation.residuals.norm() <= ROUNDING * f64::EPSILON * spread(&reduced, &step.trial) {
            self.termination = Some(Termination::ZeroResidual);
        }
        self.reduced = Some(reduced);
        let Evaluation { residuals, cost } = evaluation;
        Ok((state.param(step.trial).residuals(residuals).jacobian(jacobian).cost(cost), None))
    }

    fn terminate(&mut self, _state: &Iterate) -> TerminationStatus {
        match self.termination {
            None => TerminationStatus::NotTerminated,
            Some(reason) if reason.converged() => {
                TerminationStatus::Terminated(TerminationReason::SolverConverged)
            }
            Some(reason) => TerminationStatus::Terminated(TerminationReason::SolverExit(reason.to_string())),
        }
    }
}

/// ‖x‖_J: what a relative change of all parameters changes the residuals by.
fn spread(reduced: &Reduced, x: &DVector<f64>) -> f64 {
    reduced.column_norms.component_mul(x).norm()
}

/// The residuals at x; `None` where they cannot be evaluated or are not finite.
fn evaluate<P>(
    problem: &mut Problem<P>,
    x: &DVector<f64>,
    count: usize,
) -> Result<Option<Evaluation>, OptimiseError>
where
    P: Operator<Param = DVector<f64>, Output = DVector<f64>>,
{
    let Ok(residuals) = problem.apply(x) else { return Ok(None) };
    expect_length("residuals", count, residuals.len())?;
    let cost = 0.5 * residuals.norm_squared();
    Ok(cost.is_finite().then_some(Evaluation { residuals, cost }))
}

/// The Jacobian at x, whole and reduced; `None` where it cannot be evaluated or is not finite.
fn linearise<P>(
    problem: &mut Problem<P>,
    x: &DVector<f64>,
    residuals: &DVector<f64>,
) -> Result<Option<(DMatrix<f64>, Reduced)>, OptimiseError>
where
    P: Jacobian<Param = DVector<f64>, Jacobian = DMatrix<f64>>,
{
    let Ok(jacobian) = problem.jacobian(x) else { return Ok(None) };
    expect_shape(&jacobian, residuals.len(), x.len())?;
    Ok(reduce(&jacobian, residuals).map(|reduced| (jacobian, reduced)))
}

fn expect_shape(jacobian: &DMatrix<f64>, rows: usize, columns: usize) -> Result<(), OptimiseError> {
    expect_length("rows of the Jacobian", rows, jacobian.nrows())?;
    expect_length("columns of the Jacobian", columns, jacobian.ncols())
}
