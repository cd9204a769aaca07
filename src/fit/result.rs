//! What a fit gives: a value, which `report` renders.

use std::path::PathBuf;

use nalgebra::DMatrix;

use super::causes::Explanation;
use super::check::Finding;
use super::{
    Alternative, Bootstrap, Contour, Estimate, FittedFrames, FoundCamera, FrictionCurve, Goodness,
    Identifiability, Method, Plateau, Refuted, Robust, Scatter, SharedKind, Starts,
};
use crate::measurement::dataset::{DiscShot, Measured};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::physics::ball::Ball;
use crate::physics::collision::{Effects, Fidelity};
use crate::physics::disc::Discs;

/// The result of one fit: a value, which `report` renders.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Name of the data set.
    pub dataset: String,
    /// The label that was fitted apart, where `[fit] by` asks for it: (column, label).
    pub group: Option<(String, String)>,
    pub path: PathBuf,
    pub cloth: Option<String>,
    pub source: Option<String>,
    pub ball: Ball,
    /// Of discs: their own radii and masses, where they are known.
    pub discs: Option<Discs>,
    /// The cloth's sliding friction μ_k, where footage or dataset.toml tells it.
    pub sliding: Option<Measured>,
    /// Its rolling resistance μ_r, likewise.
    pub rolling: Option<Measured>,
    /// Name of the collision model, as on the command line.
    pub fidelity: &'static str,
    pub method: Method,
    /// Which effects the model contains.
    pub effects: Vec<(&'static str, bool)>,
    /// Of the parameters that the fit has, in the order of [`Parameter::ALL`].
    pub estimates: Vec<Estimate>,
    /// Of the parameters that have a standard error; NaN elsewhere. A row and a column for each of the estimates.
    pub correlation: DMatrix<f64>,
    /// Sum of squared standardized residuals of what [`Fit::counted`] says, priors included.
    pub chi2: f64,
    /// What priors, and errors that all shots share, add to it.
    pub prior_chi2: f64,
    /// Measured numbers and priors less fitted parameters (and, in a joint fit, unknowns of the shots' own).
    pub dof: usize,
    /// How the noise of each observable was known, in the order of first appearance.
    pub noise: Vec<Noise>,
    pub shots_used: usize,
    pub shots_rejected: Vec<Rejected>,
    /// Shots that were used, though something about them is wrong; with what it is.
    pub shots_doubtful: Vec<Rejected>,
    /// Of discs: what was measured of every shot.
    pub disc_shots: Vec<DiscShot>,
    /// Of discs: by how much shots differ beyond the errors of their frames, which is part of their errors.
    pub scatter: Option<Scatter>,
    /// Of discs: the friction that was fitted, where the shots determine it.
    pub friction_curve: Option<FrictionCurve>,
    /// Of footage: the camera by which the films were corrected.
    pub camera: Option<FoundCamera>,
    /// Where the data refute the model: then no estimate has an error.
    pub refuted: Option<Refuted>,
    /// Whether the shots were filmed, rather than measured as impacts or angles.
    pub footage: bool,
    /// What explains residuals that the model leaves, and what was corrected of the film; the best first.
    pub explanations: Vec<Explanation>,
    /// One row per observation of [`Fit::tested`]: in a joint fit of the velocities that were extracted from each shot.
    pub residuals: Vec<Residual>,
    /// Of a joint fit: its frames.
    pub frames: Option<FittedFrames>,
    /// Why the optimiser stopped, in words.
    pub termination: String,
    /// Whether it stopped at a minimum.
    pub converged: bool,
    pub iterations: usize,
    pub seconds: f64,
    pub diagnostics: Diagnostics,
    /// What the reader must know: sentences, the most important first.
    pub warnings: Vec<String>,
    /// What the reader may want to know.
    pub notes: Vec<String>,
}

impl Fit {
    /// Spins were found from the paths alone, whose errors a fit of velocities cannot carry over.
    pub fn warn_of_spins_from_paths(&mut self) {
        self.diagnostics.spins_from_paths = true;
        self.warnings.insert(
            0,
            "Spins were found from the paths alone. Where they are not natural roll, their errors are larger than a fit of \
             velocities is told: estimates may err by more than they state. Tell the spins ([cue_spin], markers), or fit all frames with \
             --method joint."
                .to_owned(),
        );
    }
}

/// How far a fit can be trusted.
#[derive(Clone, Debug, Default)]
pub struct Diagnostics {
    /// How many shots were computed at which fidelity and with which effects on.
    pub computed: Vec<Computed>,
    /// `None` where nothing was fitted.
    pub identifiability: Option<Identifiability>,
    pub goodness: Option<Goodness>,
    /// Where a robust loss was asked for.
    pub robust: Option<Robust>,
    /// The constraints between parameters, and whether they hold with equality.
    pub relations: Vec<(String, bool)>,
    /// Where several starts were asked for.
    pub starts: Option<Starts>,
    /// Where it was asked for.
    pub bootstrap: Option<Bootstrap>,
    /// Of all pairs of free parameters, with [`Depth::Everything`].
    pub contours: Vec<Contour>,
    /// The fit and other models, with [`Depth::Everything`].
    pub alternatives: Vec<Alternative>,
    /// Of footage: what its frames could tell at best.
    pub bound: Option<Bound>,
    /// Of a joint fit of frames.
    pub joint: Option<JointFit>,
    /// Parameters that are known only to lie between two values, all of which fit equally.
    pub plateaus: Vec<Plateau>,
    /// χ² of a minimum lower than the one that is given.
    pub lower_minimum: Option<f64>,
    /// Whether values outside the intervals fit nearly as well.
    pub has_rival: bool,
    /// What is suspicious about the shots, or about the cloth as their paths show it.
    pub suspicious: Vec<Finding>,
    /// Whether spins were found from the paths alone, whose errors a fit of velocities does not know.
    pub spins_from_paths: bool,
}

/// Shots that were computed alike.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Computed {
    pub fidelity: Fidelity,
    pub effects: Effects,
    pub shots: usize,
}

/// What a joint fit of frames found besides the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFit {
    /// The cloth's sliding friction μ_k and rolling resistance μ_r, with standard errors.
    pub sliding: (f64, f64),
    pub rolling: (f64, f64),
    /// What else all shots share, with standard errors: a correction of the camera as what is left to correct.
    pub others: Vec<(SharedKind, (f64, f64))>,
    /// Their covariance.
    pub others_covariance: DMatrix<f64>,
    /// Probability of a larger χ² of the frames were model and noise right; `None` where the noise was estimated from the
    /// same frames.
    pub p_value: Option<f64>,
    /// Coordinates (and components of spins that markers show) that were fitted.
    pub observations: usize,
    /// Unknowns that the shots have of their own.
    pub unknowns: usize,
}

/// The Cramér–Rao bound of the frames' positions with μ_k and μ_r of the cloth free.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// The least standard errors that a fit without bias can have.
    pub std_errors: Vec<(Parameter, f64)>,
    /// Shots it was reckoned from; it holds for all.
    pub shots: usize,
}

/// The noise of one observable.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    pub observable: Observable,
    pub count: usize,
    /// Root mean square of the raw residuals, SI and radians.
    pub rms: f64,
    /// `Some`: the data give no standard deviation, this one (SI and radians) was estimated from
    /// the residuals. `None`: the data give standard deviations.
    pub estimated_sd: Option<f64>,
}

/// A shot that was not used, or is doubtful, and why.
#[derive(Clone, Debug)]
pub struct Rejected {
    pub shot: String,
    pub reason: String,
}

/// One observation after the fit, SI and radians.
#[derive(Clone, Debug)]
pub struct Residual {
    pub shot: String,
    pub observable: Observable,
    pub measured: f64,
    pub predicted: f64,
    /// Standard deviation of the observation, with what the uncertain state before the impact
    /// adds. NaN where none can be stated (estimated from the residuals, without a degree of freedom).
    pub sd: f64,
    /// (measured − predicted) / sd.
    pub standardized: f64,
    /// Cut angle φ of the shot, radians.
    pub cut: f64,
    /// Cue ball's speed before the impact, m/s; `None` where it is unknown and does not matter.
    pub speed: Option<f64>,
}
