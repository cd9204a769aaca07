//! Data set + settings → [`Fit`]: estimates, uncertainties, residuals, and what to think of them.

pub(crate) mod analysis;
mod calibration;
mod camera;
pub mod causes;
pub mod check;
pub(crate) mod constraints;
mod counted;
pub mod diagnostics;
mod disc_curve;
mod doubts;
mod estimate;
pub(crate) mod fidelity_choice;
pub mod footage;
pub(crate) mod frames;
pub(crate) mod global;
pub mod intervals;
pub(crate) mod noise;
mod nonsmooth;
pub(crate) mod robust;
pub(crate) mod rows;
pub(crate) mod run;
pub(crate) mod samples;
pub(crate) mod saturation;
mod scatter;
pub(crate) mod search;
pub(crate) mod settled;
pub(crate) mod slice;
mod starts;
pub(crate) mod uncertainty;
mod verdict;
pub(crate) mod warnings;

pub use crate::likelihood::frames::shared_unknowns::Kind as SharedKind;
pub use analysis::{Analysis, Prepared, analyse};
pub use calibration::calibrated;
pub use camera::{FoundCamera, FoundCorrection};
pub use counted::Counted;
pub use diagnostics::goodness::{Goodness, NoiseVerdict, Normality};
pub use diagnostics::identifiability::{Combination, Identifiability};
pub use diagnostics::influence::Influence;
pub use diagnostics::other_models::{Alternative, LikelihoodRatio};
pub use diagnostics::refuted::mean as mean_of_shots;
pub use diagnostics::refuted::{MeasuredRestitution, Refuted};
pub use diagnostics::trends::{Trend, Variable};
pub use disc_curve::FrictionCurve;
pub use estimate::{Estimate, Intervals, Status};
pub use frames::{FittedFrames, OfShot};
pub use intervals::bootstrap::{Bootstrap, Resampled};
pub use intervals::confidence_region::{Contour, LEVELS, Level};
pub use robust::{DOWN_WEIGHTED, Robust};
pub use saturation::Plateau;
pub use scatter::Scatter;
pub use starts::{FoundMinimum, Starts};
pub use verdict::{Grade, Verdict};

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::DMatrix;

use crate::film::camera::Correction;
use crate::likelihood::frames::Film;
use crate::likelihood::frames::shared_unknowns::SharedUnknown;
use crate::measurement::dataset::{Dataset, DiscShot, Measured, Shot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Parameter, Setting, Settings};
use crate::measurement::values::Values;
use crate::numerics::least_squares::OptimiseError;
use crate::physics::ball::Ball;
use crate::physics::collision::{Effects, Fidelity, Model};
use crate::physics::disc::Discs;

/// Choices of a fit that are not part of the data set.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub fidelity: Fidelity,
    /// Whether each shot takes the cheapest fidelity that keeps within a tenth of its standard errors, at
    /// the start of the fit, instead.
    pub auto: bool,
    /// What is simulated, as far as the fidelity can.
    pub effects: Option<Effects>,
    /// How the friction between the balls falls with the slip.
    pub falling: Falling,
    /// Of the fidelities that integrate.
    pub tolerance: f64,
    pub method: Method,
    /// Where the search begins, in the place of a scan of all values of the friction: what an earlier fit of the same shots gave.
    pub near: Option<Values>,
    /// What is free in a joint fit besides.
    pub film: FilmUnknowns,
    pub depth: Depth,
    /// Whether causes of the residuals are looked for although the noise explains them; else [`Depth::Everything`] looks for them where it
    /// does not.
    pub explain: bool,
    /// In the place of the data set's.
    pub loss: Option<Loss>,
    /// How many starts; those after the first are spread at random between the bounds.
    pub starts: usize,
    /// How many samples of shots are drawn anew and fitted for intervals of the bootstrap.
    pub bootstrap: usize,
    /// Of everything random.
    pub seed: u64,
}

/// How the friction between the balls falls with their slip v: μ(v) = a + b exp(−c v), its a fitted as μ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Falling {
    /// As `[fit] friction` of the data set says.
    #[default]
    AsStated,
    /// With these b and c, in s/m.
    Held { b: f64, c: f64 },
    /// b and c are parameters of the fit, with the settings of the data set.
    Fitted,
}

impl Falling {
    /// The settings of a data set with this in the place of what they say of b and c.
    #[must_use]
    pub fn applied(self, mut settings: Settings) -> Settings {
        settings.falls |= self != Self::AsStated;
        if let Self::Held { b, c } = self {
            settings[Parameter::B] = Setting::held(b);
            settings[Parameter::C] = Setting::held(c);
        }
        settings
    }
}

/// How footage is fitted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Velocities are extracted from the frames of each shot, then the parameters fitted to these.
    #[default]
    TwoStage,
    /// The parameters are fitted to all frames of all shots, together with what each shot has of its own.
    Joint,
}

impl Method {
    pub const ALL: [Self; 2] = [Self::TwoStage, Self::Joint];

    /// As on the command line and in fit.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TwoStage => "two-stage",
            Self::Joint => "joint",
        }
    }
}

/// What a joint fit of frames finds besides the parameters, μ_k and μ_r.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilmUnknowns {
    /// The cloth's bounce e_t.
    pub bounce: bool,
    /// For each correction of the camera that is free: where what is known of it beforehand lies from where the camera is. The films
    /// must have been made with that camera.
    pub corrections: [Option<f64>; Correction::COUNT],
}

impl FilmUnknowns {
    pub(crate) fn unknowns(&self) -> impl Iterator<Item = SharedUnknown> {
        let bounce = self.bounce.then(|| SharedUnknown::usual(SharedKind::Bounce, 0.0));
        let corrections = Correction::ALL.into_iter().zip(self.corrections);
        let corrections = corrections
            .filter_map(|(which, known)| Some(SharedUnknown::usual(SharedKind::Camera(which), known?)));
        bounce.into_iter().chain(corrections)
    }
}

/// The frames of the shots of a data set, in their order, for those that have them.
pub type Films = [Option<Arc<Film>>];

/// How much a fit finds out about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Depth {
    /// Estimates, errors from the curvature of χ², and tests of the residuals.
    Estimates,
    /// Also the profiles of χ² for the intervals, which takes some ten times as long.
    Intervals,
    /// Also confidence regions of pairs of parameters, and other models: some hundred times as long.
    Everything,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fidelity: Fidelity::Full,
            auto: false,
            effects: None,
            falling: Falling::AsStated,
            tolerance: Model::TOLERANCE,
            method: Method::default(),
            near: None,
            film: FilmUnknowns::default(),
            depth: Depth::Intervals,
            explain: false,
            loss: None,
            starts: 1,
            bootstrap: 0,
            seed: 0,
        }
    }
}

/// Why there is no fit. What a fit ran into numerically is not an error but stands in [`Fit`].
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    #[error("{dataset}: no shot can be used{}", first_reason(.shots_rejected))]
    NoUsableShot { dataset: String, shots_rejected: Vec<Rejected> },
    #[error(
        "{dataset}: {observations} observation(s) for the free parameters {parameters}; expected at least as \
         many observations as parameters: add shots, or fix parameters under [fit]"
    )]
    TooFewObservations { dataset: String, observations: usize, parameters: String },
    #[error(
        "{dataset}: {column} has a standard deviation in {} (shot {}), but none in {} (shot {}); give all or none",
        .with.0, .with.1, .without.0, .without.1
    )]
    MixedNoise {
        dataset: String,
        column: &'static str,
        /// Place (file:line) and shot that has one, and that has none.
        with: Box<(String, String)>,
        without: Box<(String, String)>,
    },
    #[error("the observations cannot be weighted: a covariance is not positive definite")]
    NoWeights,
    /// What is wrong with the data set, as [`Dataset::faults`] says it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid { dataset: String, faults: Vec<String> },
    #[error(
        "{0}: its impacts have not been extracted from the tracks; call footage::with_impacts before fitting it"
    )]
    NotExtracted(String),
    #[error("{0}: a joint fit needs the frames of every shot, as data sets of kind \"tracks\" have them")]
    NotFilmed(String),
    #[error(
        "{0}: a joint fit takes least squares; leave out the robust loss, or fit with --method two-stage"
    )]
    JointLoss(String),
    #[error(
        "{dataset}: kappa stands in [fit], but with the fidelity {fidelity} a contact is rigid along its surface; expected the fidelity \
         auto, ode or contact with it"
    )]
    Rigid { dataset: String, fidelity: &'static str },
    #[error("{0}")]
    Relations(String),
    #[error(transparent)]
    Optimise(#[from] OptimiseError),
}

impl FitError {
    /// Whether the input was wrong, rather than that it could not be fitted.
    #[must_use]
    pub fn is_bad_input(&self) -> bool {
        matches!(
            self,
            Self::TooFewObservations { .. }
                | Self::MixedNoise { .. }
                | Self::Relations(_)
                | Self::Invalid { .. }
                | Self::NotExtracted(_)
                | Self::NotFilmed(_)
                | Self::JointLoss(_)
                | Self::Rigid { .. }
        )
    }
}

fn first_reason(rejected: &[Rejected]) -> String {
    rejected.first().map_or(String::new(), |r| format!(": shot {}: {}", r.shot, r.reason))
}

/// Fits a data set: one fit, or one for each label of the column that `[fit] by` names, in the
/// order in which the labels first appear.
///
/// # Errors
/// See [`FitError`]; the first label that fails ends it.
pub fn fit(dataset: &Dataset, options: &Options) -> Result<Vec<Fit>, FitError> {
    fit_watched(dataset, &[], options, &|| {})
}

/// As [`fit`], with the frames of the shots: fitted themselves by [`Method::Joint`], else for the bound of what
/// they could tell. `done` is called after each sample of the bootstrap, from any thread.
///
/// # Errors
/// See [`FitError`]; the first label that fails ends it.
pub fn fit_watched(
    dataset: &Dataset,
    films: &Films,
    options: &Options,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Fit>, FitError> {
    if dataset.awaits_extraction() {
        return Err(FitError::NotExtracted(dataset.name.clone()));
    }
    let faults = dataset.faults();
    if !faults.is_empty() {
        return Err(FitError::Invalid { dataset: dataset.name.clone(), faults });
    }
    let Some(column) = &dataset.by else {
        let shots: Vec<&Shot> = dataset.shots.iter().collect();
        return Ok(vec![run::fit_shots(dataset, &shots, films, None, options, done)?]);
    };
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for (index, shot) in dataset.shots.iter().enumerate() {
        let label = shot.labels.get(column).cloned().unwrap_or_default();
        match groups.iter_mut().find(|(known, _)| *known == label) {
            Some((_, shots)) => shots.push(index),
            None => groups.push((label, vec![index])),
        }
    }
    let fit = |(label, indices): (String, Vec<usize>)| {
        let shots: Vec<&Shot> = indices.iter().map(|i| &dataset.shots[*i]).collect();
        let films: Vec<_> = indices.iter().map(|i| films.get(*i).cloned().flatten()).collect();
        run::fit_shots(dataset, &shots, &films, Some((column.clone(), label)), options, done)
    };
    groups.into_iter().map(fit).collect()
}

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
    pub explanations: Vec<causes::Explanation>,
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
    pub suspicious: Vec<check::Finding>,
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
