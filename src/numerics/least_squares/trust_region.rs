//! The loop: a trust-region method with the radius rule of MINPACK's LMDER (Moré 1978), as an
//! argmin solver. One iteration tries one step.
use argmin::core::{
    Error, IterState, Jacobian, KV, Operator, Problem, Solver, TerminationReason, TerminationStatus,
};
use nalgebra::{DMatrix, DVector};

use super::bounds::Bounds;
use super::linear_algebra::{Reduced, reduce};
use super::step::{Step, step};
use super::{OptimiseError, Options, Termination, expect_length};

/// First radius in units of ‖D x₀‖. With MINPACK's 100 the first step leaves the region where the
/// model depends on its parameters (BoxBOD from its first start); 0.1 to 10 solve all certified
/// problems.
const FIRST_RADIUS: f64 = 1.0;

/// Least share of the predicted reduction for which a step is accepted (MINPACK).
const ACCEPTED: f64 = 1e-4;

/// Share of the predicted reduction below which the radius shrinks (MINPACK).
const POOR: f64 = 0.25;

/// Share of the predicted reduction above which the radius grows to twice the step (MINPACK).
const GOOD: f64 = 0.75;

/// Factor of the radius after a step to a point at which the cost cannot be evaluated.
const SHRINK: f64 = 0.25;

/// Rounding of the cost in units of ε ‖r‖ (‖r‖ + ‖x‖_J), ‖x‖_J² = Σ ‖J_j‖² x_j²: that of the data
/// and parameters from which the residuals are computed, with a factor for the operations in
/// between.
const COST_ROUNDING: f64 = 4.0;

/// Share of the cost below which a reduction is lost in rounding even if the residuals are exact.
/// Smaller steps are full ones and judged by their length.
const SMALL_REDUCTION: f64 = 1e-14;

/// If a full step promises at most this many times the rounding while the radius allows only steps
/// below it, rounding has shrunk the radius, and full steps are tried. These are at most 30 times
/// (its root) as long as the refused ones.
const ROUNDING_GAP: f64 = 1e3;

/// If the radius allows only steps that promise less than this part of the reduction at which a
/// full step ends the search, the residuals are not smooth here.
const WORTHLESS: f64 = 0.01;

/// Factor by which each refinement must be shorter than the last. Gauss–Newton converges linearly
/// at worst; at the minimum the lengths are rounding and stop decreasing.
const CONTRACTION: f64 = 0.9;

/// Share of a parameter below which its change is rounding.
const SMALL_STEP: f64 = 4.0 * f64::EPSILON;

/// The state that argmin passes between iterations: x, J(x), r(x) and ½‖r‖².
pub type Iterate = IterState<DVector<f64>, (), DMatrix<f64>, (), DVector<f64>, f64>;

/// The solver and its memory.
pub struct TrustRegion<'a> {
    bounds: &'a Bounds,
    options: &'a Options,
    /// J and r at the current point; `None` before `init`.
    reduced: Option<Reduced>,
    /// Largest norm that each column of J has had. It never decreases, so that a parameter cannot
    /// run away while it has little effect.
    column_norms: DVector<f64>,
    /// Δ.
    radius: f64,
    /// Whether the radius is still the first guess.
    is_first: bool,
    /// Length of the last step if it was a refinement: a full step accepted for its length.
    refinement: Option<f64>,
    /// Whether the residuals could not be evaluated at the end of the last step.
    is_blocked: bool,
    termination: Option<Termination>,
}

impl<'a> TrustRegion<'a> {
    pub fn new(bounds: &'a Bounds, options: &'a Options) -> Self {
        Self {
            bounds,
            options,
            reduced: None,
            column_norms: DVector::zeros(0),
            radius: f64::INFINITY,
            is_first: true,
            refinement: None,
            is_blocked: false,
            termination: None,
        }
    }

    /// Returns why the solver stopped; `None` if argmin stopped it at the iteration limit.
    pub fn termination(&self) -> Option<Termination> {
        self.termination
    }

    /// Makes `reduced` the current linear model, at `x` with residuals of norm `norm`.
    fn accept(&mut self, reduced: Reduced, x: &DVector<f64>, norm: f64) {
        if self.column_norms.is_empty() {
            self.column_norms = DVector::zeros(x.len());
        }
        self.column_norms.zip_apply(&reduced.column_norms, |largest, norm| *largest = largest.max(norm));
        if norm <= COST_ROUNDING * f64::EPSILON * spread(&reduced, x) {
            self.termination = Some(Termination::ZeroResidual);
        }
        self.reduced = Some(reduced);
    }

    /// Returns the diagonal of D: the largest column norms, 1 for a column that was always zero.
    fn scale(&self) -> DVector<f64> {
        self.column_norms.map(|norm| if norm > 0.0 { norm } else { 1.0 })
    }

    /// Returns the next step, and whether it is a refinement: a full step, because reductions below
    /// `judgeable` are lost in rounding.
    fn propose(&self, x: &DVector<f64>, reduced: &Reduced, judgeable: f64) -> (Step, bool) {
        let scale = self.scale();
        let within = |radius: f64| step(x, reduced, &scale, radius, self.bounds);
        if self.refinement.is_some() {
            return (within(f64::INFINITY), true);
        }
        let limited = within(self.radius);
        if limited.predicted > judgeable {
            return (limited, false);
        }
        let full = if limited.is_limited { within(f64::INFINITY) } else { limited.clone() };
        if full.predicted <= ROUNDING_GAP * judgeable { (full, true) } else { (limited, false) }
    }

    /// Returns why the search ends before `step` is tried. `norm` is ‖r‖, `rounding` that of the
    /// cost.
    fn reason_to_stop(
        &self,
        x: &DVector<f64>,
        (norm, rounding): (f64, f64),
        (step, refines): (&Step, bool),
    ) -> Option<Termination> {
        let orthogonality = self.options.orthogonality;
        let changes_nothing =
            step.trial.iter().zip(x.iter()).all(|(trial, x)| (trial - x).abs() <= SMALL_STEP * x.abs());
        // A bound that is met is met exactly, however small the step to it.
        let rests = !step.is_limited && self.bounds.activity(&step.trial) == self.bounds.activity(x);
        if rests && step.tangent <= orthogonality * norm {
            return Some(Termination::Orthogonal);
        }
        if rests && changes_nothing {
            return Some(Termination::SmallStep);
        }
        if self.refinement.is_some_and(|last| step.length > CONTRACTION * last) {
            return Some(Termination::SmallReduction);
        }
        let worthless = WORTHLESS * orthogonality.powi(2) * (0.5 * norm * norm);
        if !refines && (changes_nothing || step.predicted <= rounding.max(worthless)) {
            return Some(if self.is_blocked { Termination::NotFinite } else { Termination::Stalled });
        }
        None
    }

    /// Shrinks the radius after a step to a point where the residuals or J cannot be evaluated.
    fn block(&mut self, step: &Step) {
        self.is_blocked = true;
        self.is_first = false;
        self.refinement = None;
        self.radius = SHRINK * step.length;
    }

    /// Changes the radius after a step that reduced the cost by `reduction`.
    fn update_radius(&mut self, step: &Step, reduction: f64) {
        self.is_blocked = false;
        if self.is_first {
            self.radius = self.radius.min(step.length);
            self.is_first = false;
        }
        let share = reduction / step.predicted;
        if share <= POOR {
            // The minimum along s of the parabola through cost, slope and trial.
            let fraction = if reduction >= 0.0 {
                0.5
            } else {
                (0.5 * step.slope / (step.slope + reduction)).clamp(0.1, 0.5)
            };
            self.radius = fraction * self.radius.min(step.length / 0.1);
        } else if share >= GOOD || !step.is_limited {
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
        "trust region within bounds"
    }

    fn init(&mut self, problem: &mut Problem<P>, mut state: Iterate) -> Result<(Iterate, Option<KV>), Error> {
        let x = state.take_param().ok_or(OptimiseError::NoParameters)?;
        let residuals = problem.apply(&x).map_err(OptimiseError::Problem)?;
        if residuals.is_empty() {
            return Err(OptimiseError::NoResiduals.into());
        }
        let jacobian = problem.jacobian(&x).map_err(OptimiseError::Problem)?;
        expect_shape(&jacobian, residuals.len(), x.len())?;
        let cost = 0.5 * residuals.norm_squared();
        let reduced = reduce(&jacobian, &residuals).filter(|_| cost.is_finite());
        self.accept(reduced.ok_or(OptimiseError::NotFinite)?, &x, residuals.norm());
        let size = self.scale().component_mul(&x).norm();
        // x₀ = 0 has no size that limits the first step.
        self.radius = if size > 0.0 { FIRST_RADIUS * size } else { f64::INFINITY };
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
        let norm = residuals.norm();
        let rounding = COST_ROUNDING * f64::EPSILON * norm * (norm + spread(reduced, x));
        let judgeable = rounding.max(SMALL_REDUCTION * state.cost);
        let (step, refines) = self.propose(x, reduced, judgeable);
        self.termination = self.reason_to_stop(x, (norm, rounding), (&step, refines));
        if self.termination.is_some() {
            return Ok((state, None));
        }

        let Some(trial_residuals) = evaluate(problem, &step.trial, residuals.len())? else {
            self.block(&step);
            return Ok((state, None));
        };
        let cost = 0.5 * trial_residuals.norm_squared();
        let reduction = state.cost - cost;
        let least = if refines { -judgeable } else { ACCEPTED * step.predicted };
        if reduction < least {
            if refines {
                self.termination = Some(Termination::SmallReduction);
            }
            self.update_radius(&step, reduction);
            return Ok((state, None));
        }
        let Some((jacobian, reduced)) = linearise(problem, &step.trial, &trial_residuals)? else {
            self.block(&step);
            return Ok((state, None));
        };
        self.update_radius(&step, reduction);
        self.refinement = refines.then_some(step.length);
        self.accept(reduced, &step.trial, trial_residuals.norm());
        Ok((state.param(step.trial).residuals(trial_residuals).jacobian(jacobian).cost(cost), None))
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

/// Returns ‖x‖_J, the change of the residuals by a relative change of all parameters.
fn spread(reduced: &Reduced, x: &DVector<f64>) -> f64 {
    reduced.column_norms.component_mul(x).norm()
}

/// Returns the residuals at `x`; `None` if they cannot be evaluated or their squares overflow.
fn evaluate<P>(
    problem: &mut Problem<P>,
    x: &DVector<f64>,
    count: usize,
) -> Result<Option<DVector<f64>>, OptimiseError>
where
    P: Operator<Param = DVector<f64>, Output = DVector<f64>>,
{
    let Ok(residuals) = problem.apply(x) else { return Ok(None) };
    expect_length("residuals", count, residuals.len())?;
    Ok(residuals.norm_squared().is_finite().then_some(residuals))
}

/// Returns the Jacobian at `x`, whole and reduced; `None` if it cannot be evaluated or is not
/// finite.
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
