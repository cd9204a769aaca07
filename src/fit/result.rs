//! The result of a fit: a value, which `report` renders, and access to it for programs.

use std::sync::Arc;

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    Bootstrap, Contour, Counted, Estimate, FittedFilm, FoundCamera, Goodness, Identifiability, Remark,
};
use crate::measurement::dataset::{Measured, ObjectBall};
use crate::measurement::loss::Loss;
use crate::measurement::number::{plain, with_unit};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::collision::{Effects, Fidelity};
use crate::physics::disc::Discs;
use crate::problem::{DiscImpact, Id, Solution, Status};

/// The result of one fit: a value, which `report` renders.
///
/// The feature `report` makes it `serde::Serialize`, as fit.json: `serde_json::to_string(&fit)`
/// has the keys that `caromfit schema fit` describes, with the digits that mean something.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fit {
    pub(crate) dataset: String,
    /// Column and label that was fitted by itself, if `[fit] by` asks for it.
    pub(crate) group: Option<(String, String)>,
    pub(crate) cloth: Option<String>,
    pub(crate) source: Option<String>,
    /// The cue ball.
    pub(crate) ball: Ball,
    /// The object ball, if it is stated that it differs from the cue ball.
    pub(crate) object: Option<ObjectBall>,
    /// Radii and masses of discs, if they are known.
    pub(crate) discs: Option<Discs>,
    /// The cloth's sliding friction μ_k, if footage determines it or dataset.toml states it.
    pub(crate) sliding: Option<Measured>,
    /// The cloth's rolling resistance μ_r, if footage determines it or dataset.toml states it.
    pub(crate) rolling: Option<Measured>,
    /// The name of the fidelity, as on the command line.
    pub(crate) fidelity: &'static str,
    /// The estimates, in the order of `Parameter::ALL`.
    pub(crate) estimates: Vec<Estimate>,
    /// The covariance of the estimates with parameters at bounds taken for free.
    pub(super) covariance: DMatrix<f64>,
    /// How the noise of each observable was known, in the order of first appearance.
    pub(crate) noise: Vec<Noise>,
    pub(crate) shots_rejected: Vec<Rejected>,
    /// Measurements of every shot of discs.
    pub(crate) disc_shots: Vec<DiscImpact>,
    /// Differences of shots of discs beyond the errors of their frames, a part of the errors, if
    /// there are enough shots to estimate them.
    pub(crate) scatter: Option<Scatter>,
    /// The camera of footage as it was fitted, and what else was found of the film.
    pub(crate) camera: Option<FoundCamera>,
    /// Whether the shots were filmed, and not measured as impacts or angles.
    pub(crate) footage: bool,
    /// The error budgets of μ, μ_s and e.
    pub(crate) budget: Vec<crate::problem::Budget>,
    /// Of films of balls the velocities after each impact, without the law of the impact.
    pub(crate) residuals: Vec<Residual>,
    /// The frames of a film of balls against the model.
    pub(crate) frames: Option<FittedFilm>,
    pub(crate) solution: Arc<Solution>,
    /// How long the fit took, s.
    pub(crate) seconds: f64,
    /// How far the fit can be trusted.
    pub(crate) diagnostics: Diagnostics,
    /// Everything that a reader should know, the most important first.
    pub(crate) remarks: Vec<Remark>,
}

impl Fit {
    /// Returns the label that was fitted by itself, if `[fit] by` asks for it.
    pub fn label(&self) -> Option<&str> {
        self.group.as_ref().map(|(_, label)| label.as_str())
    }

    /// Returns the estimates, in the order of [`Parameter::ALL`].
    pub fn estimates(&self) -> &[Estimate] {
        &self.estimates
    }

    /// Returns χ²: the sum of squared standardized residuals, priors included.
    pub fn chi2(&self) -> f64 {
        let of_numbers = || self.solution.chi2_of_data().0 + self.solution.prior_chi2();
        if self.discs.is_some() { self.diagnostics.goodness.chi2 } else { of_numbers() }
    }

    /// Returns −2 log L at the minimum up to a constant, greatest over noises that are not stated.
    pub fn minus_two_log(&self) -> f64 {
        self.solution.minus_two_log()
    }

    /// Returns the degrees of freedom: measured numbers less all unknowns that they determine.
    pub fn dof(&self) -> usize {
        if self.discs.is_some() { self.diagnostics.goodness.dof } else { self.solution.dof() }
    }

    /// Returns whether the search stopped at a minimum.
    pub fn converged(&self) -> bool {
        self.solution.converged
    }

    /// Returns why the search stopped.
    pub(crate) fn termination(&self) -> &'static str {
        if self.converged() { "χ² has settled" } else { "too many steps" }
    }

    /// Returns the number of shots that were fitted.
    pub fn shots_used(&self) -> usize {
        self.solution.names().len()
    }

    /// Returns the shots that were left out, with the reasons.
    pub fn shots_rejected(&self) -> &[Rejected] {
        &self.shots_rejected
    }

    /// Returns whether the data contradict the model: no estimate has an error then.
    pub fn is_refuted(&self) -> bool {
        self.solution.is_refuted()
    }

    /// Returns the standard error of a parameter as if the model held.
    pub fn std_error_if_model_held(&self, parameter: Parameter) -> Option<f64> {
        let stated = self.get(parameter).and_then(|estimate| estimate.std_error);
        stated.or_else(|| self.solution.get(Id::from(parameter))?.std_error)
    }

    /// Returns the camera of footage as it was fitted.
    pub fn camera(&self) -> Option<&FoundCamera> {
        self.camera.as_ref()
    }

    /// Returns the estimate of a parameter, if the fit has it.
    pub fn get(&self, parameter: Parameter) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.parameter == parameter)
    }

    /// The friction between the balls μ.
    pub fn mu(&self) -> Option<&Estimate> {
        self.get(Parameter::Mu)
    }

    /// The friction of the cloth on the object ball during the impact, μ_s.
    pub fn mu_s(&self) -> Option<&Estimate> {
        self.get(Parameter::MuS)
    }

    /// The coefficient of restitution between the balls, e.
    pub fn e(&self) -> Option<&Estimate> {
        self.get(Parameter::E)
    }

    /// The estimates of what happens at the contact: all but the ratios of the balls.
    pub(super) fn of_contact(&self) -> impl Iterator<Item = &Estimate> {
        self.estimates.iter().filter(|estimate| !estimate.parameter.is_of_balls())
    }

    /// Returns the range, from the estimate to a bound, of values on which χ² does not depend.
    pub(crate) fn plateau(&self, parameter: Parameter) -> Option<[f64; 2]> {
        let estimate = self.get(parameter)?;
        let is_known = !self.is_refuted() && !self.noise.iter().any(Noise::is_unknown);
        let is_flat = estimate.status == Status::Free && estimate.std_error.is_none() && is_known;
        is_flat.then(|| [estimate.value, self.solution.problem.unknown(Id::from(parameter)).bounds[1]])
    }

    /// Returns the covariance of [`Fit::estimates`], NaN for those without a standard error.
    pub fn covariance(&self) -> DMatrix<f64> {
        let has_error = |i: usize| self.estimates[i].std_error.is_some();
        let count = self.estimates.len();
        DMatrix::from_fn(count, count, |i, j| {
            if has_error(i) && has_error(j) { self.covariance[(i, j)] } else { f64::NAN }
        })
    }

    /// The kind of the numbers that `chi2`, `dof` and [`super::Goodness`] count.
    pub(crate) fn counted(&self) -> Counted {
        self.diagnostics.goodness.counted
    }

    /// Returns how the data were fitted: all frames at once, or measured impacts and angles
    /// directly.
    pub fn method_name(&self) -> &'static str {
        if self.solution.is_film() { "joint" } else { "direct" }
    }
}

/// How far a fit can be trusted.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub(crate) struct Diagnostics {
    /// How many shots were computed at which fidelity.
    pub(crate) computed: Vec<Computed>,
    /// Which combinations of parameters the data determine.
    pub(crate) identifiability: Option<Identifiability>,
    /// Tests of the residuals.
    pub(crate) goodness: Goodness,
    /// Shots that count less under a robust loss.
    pub(crate) robust: Option<Robust>,
    /// Intervals from resampled shots (--bootstrap).
    pub(crate) bootstrap: Option<Bootstrap>,
    /// Confidence regions of pairs of parameters.
    pub(crate) contours: Vec<Contour>,
}

/// Shots that were computed with the same fidelity and effects.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub(crate) struct Computed {
    /// elastic, inelastic, linear, full, ode or contact.
    pub(crate) fidelity: Fidelity,
    /// Names of the effects that were on.
    pub(crate) effects: Vec<&'static str>,
    /// Number of shots.
    pub(crate) shots: usize,
}

impl Computed {
    /// Returns how the shots were computed, those of equal effects together.
    pub(crate) fn of(solution: &Solution, choice: Option<Fidelity>) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for (sample, shots) in solution.problem.samples.iter().zip(solution.at.shots.iter()) {
            let (corrected, contact) = (sample.block.count_corrected(), sample.block.contact());
            let shared = sample.gather(&solution.at.state.shared);
            let is_compliant = contact.map_or(shared[Id::Kappa] > 0.0, |contact| contact.is_compliant());
            // discs are computed in closed form
            let parts = match choice.filter(|_| contact.is_some()) {
                Some(fidelity) => vec![(fidelity, shots.len())],
                None => {
                    vec![(Fidelity::Full, shots.len() - corrected), (Fidelity::Contact, corrected)]
                }
            };
            for (fidelity, shots) in parts.into_iter().filter(|(_, shots)| *shots > 0) {
                let mut effects = Effects { compliance: is_compliant, ..fidelity.effects() };
                effects.falling_friction &= shared[Id::FallB] != 0.0;
                let effects = effects.list().into_iter().filter_map(|(name, is_on)| is_on.then_some(name));
                let effects: Vec<_> = effects.collect();
                match all.iter_mut().find(|known| (known.fidelity, &known.effects) == (fidelity, &effects)) {
                    Some(known) => known.shots += shots,
                    None => all.push(Self { fidelity, effects, shots }),
                }
            }
        }
        all
    }
}

/// A cause of residuals.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Explanation {
    /// cue-spin, mass-ratio, compliance, falling-friction, falling-restitution, frame-rate, radius,
    /// tilt, late-ball, near-balls, aside, contact-time, scale, aspect, shear, perspective, lens, rolling-shutter or parallax.
    pub(crate) cause: &'static str,
    /// The value that explains the residuals best, as the true frame rate over the stated one; of
    /// cue-spin the median topspin over natural roll.
    #[schemars(with = "Option<f64>")]
    pub(crate) estimate: f64,
    /// Its standard error, same unit.
    #[schemars(with = "Option<f64>")]
    pub(crate) std_error: f64,
    /// Change of −2 log L with it, below 0; of a contradicted prior minus the square of the
    /// conflict in standard deviations.
    #[schemars(with = "Option<f64>")]
    pub(crate) delta_2logl: f64,
    /// Whether the estimates include it.
    pub(crate) adopted: bool,
    /// The explanation for a reader, with what to do.
    pub(crate) sentence: String,
}

/// Shots that count less under a robust loss.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Robust {
    /// huber or cauchy.
    pub(crate) loss: Loss,
    /// Distance from which on an observation counts less, in standard deviations.
    #[schemars(with = "Option<f64>")]
    pub(crate) tuning_constant: f64,
    /// How the errors were found.
    pub(crate) covariance: &'static str,
    /// The shots that count less, the least first.
    pub(crate) weights_below_1: Vec<Weight>,
}

/// The weight of a shot.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Weight {
    /// Name of the shot.
    pub(crate) shot: String,
    /// Its weight, 0 to 1.
    pub(crate) weight: f64,
}

/// Standard deviations between shots of discs, beyond the errors of their frames; 0 if they show no
/// scatter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Scatter {
    /// Scatter of the restitution, dimensionless.
    pub(crate) e: f64,
    /// Scatter of J_t/J_n, dimensionless, besides what follows from that of the restitution.
    pub(crate) impulse_ratio: f64,
}

/// The noise of one observable.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    pub(crate) observable: Observable,
    /// How many shots have it.
    pub(crate) count: usize,
    /// Root mean square of the raw residuals, SI and radians.
    pub(crate) rms: f64,
    /// Standard deviation from the residuals, SI and radians; `None` if the data state it.
    pub(crate) estimated_sd: Option<f64>,
    /// Standard deviation of rounded readings, SI and radians, if the residuals are smaller.
    pub(crate) rounding: Option<f64>,
}

impl Noise {
    /// Returns whether it was to be estimated, and the data do not show its size.
    pub(super) fn is_unknown(&self) -> bool {
        self.estimated_sd.is_some_and(f64::is_nan)
    }

    /// Returns a standard deviation to a number of digits, with the unit of its column.
    pub(super) fn in_words(&self, sd: f64, digits: usize) -> String {
        with_unit(&plain(sd / self.observable.unit_si(), digits), self.observable.unit())
    }
}

/// A shot that was not used, and why.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Rejected {
    /// Name of the shot.
    pub shot: String,
    /// The reason.
    pub reason: String,
}

/// One observation after the fit, SI and radians.
#[derive(Clone, Debug)]
pub(crate) struct Residual {
    pub(crate) shot: String,
    pub(crate) observable: Observable,
    pub(crate) measured: f64,
    pub(crate) predicted: f64,
    /// Standard deviation of the number, the uncertain state before the impact included; NaN if the
    /// noise is not known.
    pub(crate) sd: f64,
    /// (measured − predicted) / sd.
    pub(crate) standardized: f64,
    /// Cut angle φ of the shot, radians.
    pub(crate) cut: f64,
    /// Cue ball's speed before the impact, m/s; `None` if it is unknown and does not matter.
    pub(crate) speed: Option<f64>,
}
