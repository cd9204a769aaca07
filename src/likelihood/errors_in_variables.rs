//! What a shot's inputs truly were, as far as all its measurements tell: errors in variables.
//!
//! The state before the impact is measured with errors, as are the observations. With ξ the true inputs, x and y what was
//! measured and Σ the covariance of their errors, a shot's part of χ² is
//!
//! min over ξ of (ξ − x, f(ξ) − y) Σ⁻¹ (ξ − x, f(ξ) − y)ᵀ
//!
//! so that a fit minimises over the parameters and every shot's own ξ (orthogonal distance regression). The minimum over ξ
//! is found by Gauss and Newton's method, a step that does not lower the sum being halved. At ξ̂, with G = ∂f/∂ξ there,
//! the minimum is dᵀC⁻¹d with d = f(ξ̂) + G(x − ξ̂) − y and C = [G, −1] Σ [G, −1]ᵀ, and its derivative by the parameters
//! that of d at fixed ξ̂ and G. Taken at x instead of ξ̂, d and ∂f/∂θ would err together, and bias the fit.
//!
//! - Fuller, W. A. (1987). Measurement Error Models. Wiley. Section 3.2.
//! - Boggs, P. T., Byrd, R. H. and Schnabel, R. B. (1987). A stable and efficient algorithm for nonlinear orthogonal
//!   distance regression. SIAM J. Sci. Stat. Comput. 8, 1052–1078.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::prediction::{INPUTS, MAX_OBSERVABLES, Plan, Prediction, difference};
use crate::measurement::dataset::Joint;
use crate::physics::collision::{Coefficients, Model};

/// Errors of a shot's inputs in units in which they are independent and of variance 1.
pub type Units = SVector<f64, INPUTS>;

type ByUnits = SMatrix<f64, MAX_OBSERVABLES, INPUTS>;
type Observed = SVector<f64, MAX_OBSERVABLES>;

/// Inputs rest when a step is shorter than this, in standard errors: it moves parameters by a hundredth of it in theirs.
const AT_REST: f64 = 1e-6;

/// Steps for one shot; those that are left are taken when the parameters have moved.
const MAX_STEPS: usize = 20;

/// A step is halved so often before it is taken to end at a kink, as one is that is still longer than this after all steps.
const MAX_HALVINGS: usize = 12;
const UNSETTLED: f64 = 1e-2;

/// Inputs whose best place is a kink are taken this part of the last step before it, so that what follows is that of one
/// side, also when the parameters move a little.
const BEFORE_KINK: f64 = 0.5;

/// The spin's place among the inputs, and where else it is looked for, in standard errors.
const SPIN: usize = 3;
const ELSEWHERE: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];

/// Spins that err by less than this part of the natural roll's, as those that markers show, leave one minimum.
const LARGE: f64 = 0.01;

/// A sum that rises by this part of itself, or of 1, is rounding.
const ROUNDING: f64 = 1e-13;

/// A variance of which less than this part is left, given the inputs before it, follows from these.
const DEPENDENT: f64 = 1e-12;

/// Errors that inputs and observations have together: inputs err by F t, observations by A t and a rest of their own,
/// with t independent and of variance 1. Partial Cholesky factor of the joint covariance.
#[derive(Clone, Debug)]
pub struct Together {
    factor: SMatrix<f64, INPUTS, INPUTS>,
    carried: DMatrix<f64>,
    /// L⁻¹ of the rest's covariance.
    rest: DMatrix<f64>,
}

impl Together {
    /// `None` where an observation's errors leave nothing of its own.
    #[must_use]
    pub fn new(joint: &Joint) -> Option<Self> {
        let sigma = &joint.covariance;
        let all = sigma.nrows();
        let mut l = DMatrix::zeros(all, Joint::BEFORE);
        for column in 0..Joint::BEFORE {
            let own = l.row(column).norm_squared();
            let pivot: f64 = sigma[(column, column)] - own;
            if !(pivot > DEPENDENT * sigma[(column, column)]) {
                continue;
            }
            for row in column..all {
                let known = l.row(row).dot(&l.row(column));
                l[(row, column)] = (sigma[(row, column)] - known) / pivot.sqrt();
            }
        }
        let carried = l.rows(Joint::BEFORE, all - Joint::BEFORE).into_owned();
        let after = sigma.view((Joint::BEFORE, Joint::BEFORE), (carried.nrows(), carried.nrows()));
        let rest: DMatrix<f64> = after - &carried * carried.transpose();
        let rest = rest.cholesky()?.l();
        let rest = rest.solve_lower_triangular(&DMatrix::identity(rest.nrows(), rest.nrows()))?;
        Some(Self { factor: l.fixed_view::<INPUTS, INPUTS>(0, 0).into_owned(), carried, rest })
    }
}

/// A shot's errors at some standard deviations of its observations.
pub struct Errors<'a> {
    plan: &'a Plan,
    sds: Observed,
}

impl<'a> Errors<'a> {
    /// `sd` tells the standard deviation of a row's observation.
    pub fn new(plan: &'a Plan, sd: impl Fn(usize) -> f64) -> Self {
        let count = plan.rows().len();
        Self { plan, sds: Observed::from_fn(|row, _| if row < count { sd(row) } else { 1.0 }) }
    }

    /// By how much inputs differ that are `t` from those that were measured.
    #[must_use]
    pub fn moved(plan: &Plan, t: &Units) -> SVector<f64, INPUTS> {
        match plan.together() {
            Some(together) => together.factor * t,
            None => plan.variance_in().map(f64::sqrt).component_mul(t),
        }
    }

    /// What is left of the observations over their standard errors, where inputs err by `t` and differences are d.
    fn left(&self, d: &Observed, t: &Units) -> Observed {
        let count = self.plan.rows().len();
        let Some(Together { carried, rest, .. }) = self.plan.together() else {
            return d.component_div(&self.sds);
        };
        let mut own = *d;
        for row in 0..count {
            own[row] -= (0..INPUTS).map(|k| carried[(row, k)] * t[k]).sum::<f64>();
        }
        Observed::from_fn(
            |row, _| {
                if row < count { (0..=row).map(|k| rest[(row, k)] * own[k]).sum() } else { 0.0 }
            },
        )
    }

    /// How that changes with t.
    fn slope(&self, by_inputs: &ByUnits) -> ByUnits {
        let count = self.plan.rows().len();
        let mut slope = ByUnits::zeros();
        match self.plan.together() {
            None => {
                let sds = self.plan.variance_in().map(f64::sqrt);
                for row in 0..count {
                    for k in 0..INPUTS {
                        slope[(row, k)] = by_inputs[(row, k)] * sds[k] / self.sds[row];
                    }
                }
            }
            Some(Together { factor, carried, rest }) => {
                let by = by_inputs * factor;
                for row in 0..count {
                    for k in 0..INPUTS {
                        let own = (0..=row).map(|j| rest[(row, j)] * (by[(j, k)] - carried[(j, k)]));
                        slope[(row, k)] = own.sum();
                    }
                }
            }
        }
        slope
    }
}

/// A shot's inputs as they are estimated, and what is predicted from them.
struct Point {
    t: Units,
    prediction: Prediction,
    left: Observed,
    chi2: f64,
}

/// Inputs that were estimated.
#[derive(Clone, Copy, Debug)]
pub struct Estimated {
    pub t: Units,
    /// The shot's part of χ².
    pub chi2: f64,
    /// The best place is a kink: where the contact begins to stick, or the cue ball's topspin to press the object ball into
    /// the cloth. They are on one side of it.
    pub at_kink: bool,
}

/// Where the inputs of a shot are looked for besides where they were: a spin that the motion told may err so much that the sum
/// has several minima. `rolling`: the spin of natural roll, rad/s.
pub fn elsewhere(plan: &Plan, rolling: f64) -> impl Iterator<Item = Units> {
    let errs = move |k: usize| {
        plan.together().is_some_and(|together| together.factor.column(k).amax() > LARGE * rolling)
    };
    let spins = (SPIN..INPUTS).filter(move |k| errs(*k));
    spins.flat_map(|k| ELSEWHERE.map(|by| Units::from_fn(|i, _| if i == k { by } else { 0.0 })))
}

/// The inputs that agree best with a shot's measurements at some coefficients, from those of `start`, and what is predicted
/// of them. `shared` adds to
/// the differences what the errors do that all shots share.
#[must_use]
pub fn estimate(
    errors: &Errors,
    (model, coefficients): (&Model, &Coefficients),
    start: &Units,
    shared: impl Fn(&Prediction, usize) -> f64,
) -> Option<(Estimated, Prediction)> {
    let plan = errors.plan;
    let at = |t: Units| {
        let prediction = plan.predict_moved(&Errors::moved(plan, &t), model, coefficients).ok()?;
        let mut d = Observed::zeros();
        for (row, measurement) in plan.rows().iter().enumerate() {
            let own = difference(measurement.observable, prediction.values[row], measurement.measured.value);
            d[row] = own + shared(&prediction, row);
        }
        let left = errors.left(&d, &t);
        let chi2 = t.norm_squared() + left.norm_squared();
        chi2.is_finite().then_some(Point { t, prediction, left, chi2 })
    };
    let mut now = at(*start).or_else(|| at(Units::zeros()))?;
    let settled = |now: Point| Some((Estimated { t: now.t, chi2: now.chi2, at_kink: false }, now.prediction));
    for number in 0.. {
        // min |t|² + |left + slope (t − now)|²
        let slope = errors.slope(&now.prediction.by_inputs);
        let normal = SMatrix::<f64, INPUTS, INPUTS>::identity() + slope.tr_mul(&slope);
        let step = normal.cholesky()?.solve(&slope.tr_mul(&(slope * now.t - now.left))) - now.t;
        let size = step.amax();
        if size < AT_REST {
            return settled(now);
        }
        let mut part = 1.0;
        let limit = now.chi2 + ROUNDING * (1.0 + now.chi2);
        let halvings = if number < MAX_STEPS { MAX_HALVINGS } else { 0 };
        let next = (0..halvings).find_map(|_| {
            let next = at(now.t + part * step).filter(|next| next.chi2 <= limit);
            part *= 0.5;
            next
        });
        match next {
            Some(next) => now = next,
            None if size < UNSETTLED => return settled(now),
            None => {
                let before = at(now.t - BEFORE_KINK * step).unwrap_or(now);
                return Some((
                    Estimated { t: before.t, chi2: before.chi2, at_kink: true },
                    before.prediction,
                ));
            }
        }
    }
    None
}
