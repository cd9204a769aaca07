//! What a fit gives: a value, which `report` renders.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::check::Finding;
use super::{
    Alternative, Bootstrap, Contour, Estimate, FittedFilm, FoundCamera, FrictionCurve, Goodness,
    Identifiability, Profile, Refuted,
};
use crate::measurement::dataset::{Measured, ObjectBall};
use crate::measurement::loss::Loss;
use crate::measurement::number::plain;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::collision::{Effects, Fidelity, FidelityChoice};
use crate::physics::disc::Discs;
use crate::problem::{DiscImpact, Solution};

/// The result of one fit: a value, which `report` renders.
///
/// With the feature `report` it is `serde::Serialize`, as fit.json: `serde_json::to_string(&fit)` has the keys that `caromfit schema fit`
/// describes, with the digits that mean something.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Fit {
    /// Name of the data set.
    pub dataset: String,
    /// The label that was fitted apart, where `[fit] by` asks for it: (column, label).
    pub group: Option<(String, String)>,
    /// The file that the data set was read from.
    pub path: PathBuf,
    /// Which cloth it was measured on.
    pub cloth: Option<String>,
    /// Who measured it, how and when.
    pub source: Option<String>,
    /// The cue ball; of discs, the disc that stands for both.
    pub ball: Ball,
    /// The object ball, where it is stated that it differs from the cue ball; `None` of discs, too.
    pub object: Option<ObjectBall>,
    /// Of discs: their own radii and masses, where they are known.
    pub discs: Option<Discs>,
    /// The cloth's sliding friction μ_k, where footage determines it or dataset.toml states it.
    pub sliding: Option<Measured>,
    /// The cloth's rolling resistance μ_r, where footage determines it or dataset.toml states it.
    pub rolling: Option<Measured>,
    /// The name of the fidelity, as on the command line.
    pub fidelity: &'static str,
    /// The name of each effect, and whether the model contains it.
    pub effects: Vec<(&'static str, bool)>,
    /// The estimates of the parameters that the fit has, in the order of [`Parameter::ALL`].
    pub estimates: Vec<Estimate>,
    /// The correlation matrix, with a row and a column for each of the estimates; NaN for those without a standard
    /// error.
    pub correlation: DMatrix<f64>,
    /// χ²: the sum of squared standardized residuals of what [`Fit::counted`] names, priors included.
    pub chi2: f64,
    /// The part of χ² that priors, and errors that all shots share, add.
    pub prior_chi2: f64,
    /// Degrees of freedom: measured numbers less all unknowns that they determine, those of single shots included.
    pub dof: usize,
    /// How the noise of each observable was known, in the order of first appearance.
    pub noise: Vec<Noise>,
    /// How many shots were fitted.
    pub shots_used: usize,
    /// The shots that were left out, with the reasons.
    pub shots_rejected: Vec<Rejected>,
    /// Of discs: what was measured of every shot.
    pub disc_shots: Vec<DiscImpact>,
    /// Of discs: by how much shots differ beyond the errors of their frames. It is part of the errors.
    pub scatter: Option<Scatter>,
    /// Of discs: the friction that was fitted as a function of the slip, where the shots determine it.
    pub friction_curve: Option<FrictionCurve>,
    /// Of footage: the camera as it was fitted, and what else was found of the film.
    pub camera: Option<FoundCamera>,
    /// Where the data contradict the model, how; no estimate has an error then.
    pub refuted: Option<Refuted>,
    /// Whether the shots were filmed, and not measured as impacts or angles.
    pub footage: bool,
    /// What is wrong or worth saying.
    pub findings: Vec<crate::problem::Finding>,
    /// The estimates of all that the shots share.
    pub unknowns: Vec<crate::problem::Estimate>,
    /// The error budgets of μ, μ_s and e.
    pub budget: Vec<crate::problem::Budget>,
    /// What explains residuals that the equations or the stated numbers leave, the best first; the estimates
    /// include it.
    pub explanations: Vec<Explanation>,
    /// The observations of [`Fit::tested`] one by one; of films of balls the velocities after each impact, as
    /// its frames show them without the law of the impact.
    pub residuals: Vec<Residual>,
    /// Of a film of balls: its frames against the model.
    pub frames: Option<FittedFilm>,
    /// The minimum.
    pub(crate) solution: Arc<Solution>,
    /// Why the optimiser stopped, in words.
    pub termination: String,
    /// Whether it stopped at a minimum.
    pub converged: bool,
    /// How many times the search computed all residuals.
    pub iterations: usize,
    /// How long the fit took, s.
    pub seconds: f64,
    /// How far the fit can be trusted.
    pub diagnostics: Diagnostics,
    /// What a reader must know, in sentences, the most important first.
    pub warnings: Vec<String>,
    /// What else a reader may want to know, in sentences.
    pub notes: Vec<String>,
}

/// How far a fit can be trusted.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Diagnostics {
    /// How many shots were computed at which fidelity and with which effects on.
    pub computed: Vec<Computed>,
    /// What the data determine of the free parameters; `None` where none is free.
    pub identifiability: Option<Identifiability>,
    /// How well model and noise describe the residuals; `None` where nothing was fitted.
    pub goodness: Option<Goodness>,
    /// How a robust loss weighted the shots, where one was asked for.
    pub robust: Option<Robust>,
    /// What a bootstrap over the shots found, where it was asked for.
    pub bootstrap: Option<Bootstrap>,
    /// The confidence regions of all pairs of free parameters, with [`Depth::Everything`](super::Depth::Everything).
    pub contours: Vec<Contour>,
    /// Of tables: how χ² rises as a free parameter moves, with [`Depth::Everything`](super::Depth::Everything).
    pub profiles: Vec<Profile>,
    /// Of tables: the fit and other models compared, with [`Depth::Everything`](super::Depth::Everything).
    pub alternatives: Vec<Alternative>,
    /// Of a film of balls: the smallest standard errors that its frames allow.
    pub bound: Option<Bound>,
    /// Of a film of balls: what was found besides the parameters.
    pub joint: Option<JointFit>,
    /// Whether values outside the intervals fit nearly as well.
    pub has_rival: bool,
    /// What is suspicious about the shots, or about the cloth as their paths show it.
    pub suspicious: Vec<Finding>,
}

/// Shots that were computed with the same fidelity and effects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Computed {
    /// The fidelity.
    pub fidelity: Fidelity,
    /// The effects that are on.
    pub effects: Effects,
    /// How many shots were computed so.
    pub shots: usize,
}

impl Computed {
    /// Returns how the shots of each sample of a fit were computed, those of equal effects together.
    pub(crate) fn of(solution: &Solution, choice: FidelityChoice) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for (sample, shots) in solution.problem.samples.iter().zip(&solution.at.shots) {
            let corrected = sample.block.count_corrected();
            let parts = match choice {
                FidelityChoice::Of(fidelity) => vec![(fidelity, shots.len())],
                FidelityChoice::Auto => {
                    vec![(Fidelity::Full, shots.len() - corrected), (Fidelity::Contact, corrected)]
                }
            };
            for (fidelity, shots) in parts.into_iter().filter(|(_, shots)| *shots > 0) {
                let effects = Effects { compliance: sample.block.is_compliant(), ..fidelity.effects() };
                match all.iter_mut().find(|known| (known.fidelity, known.effects) == (fidelity, effects)) {
                    Some(known) => known.shots += shots,
                    None => all.push(Self { fidelity, effects, shots }),
                }
            }
        }
        all
    }

    /// Returns each effect, and whether some shots were computed with it.
    pub(crate) fn effects(all: &[Self]) -> Vec<(&'static str, bool)> {
        let is_on =
            |(effect, _)| (effect, all.iter().any(|own| own.effects.list().contains(&(effect, true))));
        Effects::NONE.list().into_iter().map(is_on).collect()
    }
}

/// A cause of residuals that the equations or the stated numbers leave, with the value that explains them best.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The name of the cause in fit.json.
    pub cause: &'static str,
    /// The value of the cause, in its own unit.
    pub estimate: f64,
    /// The standard error of that value.
    pub std_error: f64,
    /// Change of −2 log L with it, below 0; of a prior that the data contradict the square of the conflict in
    /// standard deviations, with a minus.
    pub delta_2logl: f64,
    /// Whether the estimates include it.
    pub adopted: bool,
    /// The explanation as a sentence.
    pub sentence: String,
}

/// What the fit of a film of balls found besides the parameters.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct JointFit {
    /// What all shots share.
    pub shared: Vec<crate::problem::Estimate>,
    /// The probability of a larger χ² of the frames if model and noise were right; `None` where the noise was
    /// estimated from the same frames.
    pub p_value: Option<f64>,
    /// How many coordinates, and components of spins that markers show, were fitted.
    pub observations: usize,
    /// How many unknowns the shots have of their own, all together.
    pub unknowns: usize,
}

/// The Cramér–Rao bound of the frames with all nuisance unknowns free.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// The smallest standard errors that an unbiased fit of the frames can have.
    pub std_errors: Vec<(Parameter, f64)>,
    /// How many shots it was computed from; it holds for all shots.
    pub shots: usize,
}

/// Shots of a weight below this are listed in the report.
pub const DOWN_WEIGHTED: f64 = 0.5;

/// How a robust loss weighted the shots.
#[derive(Clone, Debug, PartialEq)]
pub struct Robust {
    /// The loss.
    pub loss: Loss,
    /// The name and the weight of each shot whose weight is below 1, the smallest first.
    pub weights: Vec<(String, f64)>,
}

/// By how much shots of discs scatter: standard deviations between shots, beyond the errors of their frames; 0 where they show none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scatter {
    /// The standard deviation of e.
    pub restitution: f64,
    /// The standard deviation of J_t/J_n, besides what follows from that of e.
    pub impulse_ratio: f64,
    /// Whether there are enough shots to estimate it.
    pub is_estimated: bool,
}

impl Scatter {
    /// Whether the errors of the frames alone explain the residuals, so that χ² tests the model.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.restitution == 0.0 && self.impulse_ratio == 0.0
    }
}

/// The noise of one observable.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    /// The observable.
    pub observable: Observable,
    /// How many shots have it.
    pub count: usize,
    /// Root mean square of the raw residuals, SI and radians.
    pub rms: f64,
    /// The standard deviation that was estimated from the residuals, SI and radians, where the data give none; `None`
    /// where they do.
    pub estimated_sd: Option<f64>,
    /// The standard deviation of the rounding of the readings, SI and radians, where it stands for the noise, since the residuals are
    /// smaller.
    pub rounding: Option<f64>,
}

impl Noise {
    /// Returns whether it was to be estimated, and nothing shows its size.
    pub(super) fn is_unknown(&self) -> bool {
        self.estimated_sd.is_some_and(f64::is_nan)
    }

    /// A standard deviation to so many digits, with the unit of its column.
    pub(super) fn in_words(&self, sd: f64, digits: usize) -> String {
        let (number, unit) = (plain(sd / self.observable.unit_si(), digits), self.observable.unit());
        let gap = if matches!(unit, "" | "°") { "" } else { " " };
        format!("{number}{gap}{unit}")
    }
}

/// A shot that was not used, and why.
#[derive(Clone, Debug)]
pub struct Rejected {
    /// The name of the shot.
    pub shot: String,
    /// The reason.
    pub reason: String,
}

/// One observation after the fit, SI and radians.
#[derive(Clone, Debug)]
pub struct Residual {
    /// The name of the shot.
    pub shot: String,
    /// What was measured.
    pub observable: Observable,
    /// The measured value.
    pub measured: f64,
    /// The value that the model predicts.
    pub predicted: f64,
    /// The standard deviation of the observation, with what the uncertain state before the impact adds; NaN where
    /// none can be stated, as with noise that is estimated from the residuals without a degree of freedom.
    pub sd: f64,
    /// (measured − predicted) / sd.
    pub standardized: f64,
    /// Cut angle φ of the shot, radians.
    pub cut: f64,
    /// Cue ball's speed before the impact, m/s; `None` where it is unknown and does not matter.
    pub speed: Option<f64>,
}
