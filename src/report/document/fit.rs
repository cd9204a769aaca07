//! fit.json: a fit for programs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ByName, Made};
use crate::fit::Explanation;
use crate::fit::{Counted, Diagnostics, Rejected, Scatter, Status, Verdict};
use crate::measurement::dataset::{Measured, ObjectBall};
use crate::measurement::written::ByParameter;
use crate::physics::ball::Ball;

/// fit.json of caromfit
///
/// One fit: fit.json, and each element of the array that caromfit fit --json prints. Keys may be added; none is renamed or dropped.
/// Numbers are SI and radians except where a unit stands beside them; null stands for what is not known.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FitDocument {
    /// Name of the data set.
    pub dataset: String,
    /// The label that was fitted apart; null if the data set was fitted as a whole.
    pub group: Option<Group>,
    /// Whether the numbers can be used.
    #[serde(skip_deserializing)]
    pub verdict: Option<Verdict>,
    /// Label of the cloth.
    pub cloth: Option<String>,
    /// Who measured it, how and when.
    pub source: Option<String>,
    /// The cue ball, or the first of two discs.
    pub ball: Option<Body>,
    /// The second of two discs, or the object ball if it is stated to differ from the cue ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object: Option<Body>,
    /// Sliding friction of the cloth, dimensionless.
    pub mu_k: Option<Measured>,
    /// Rolling resistance of the cloth, dimensionless.
    pub mu_r: Option<Measured>,
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// Collision model.
    pub fidelity: String,
    /// joint: all frames of a film at once; direct: tables of impacts and angles.
    #[schemars(extend("enum" = ["joint", "direct"]))]
    pub method: String,
    /// Whether the model contains each effect, by its name.
    pub effects: ByName<bool>,
    /// What a reader must know, in sentences, the most important first.
    pub warnings: Vec<String>,
    /// What else a reader may want to know, in sentences.
    pub notes: Vec<String>,
    /// Estimates by the name of the parameter; mu_b and mu_c if the friction decreases with the slip, kappa if the contact is
    /// compliant, mass_ratio and radius_ratio (cue ball over object ball) if they were fitted, e_slope if the restitution
    /// decreases with the closing speed.
    #[schemars(with = "ByParameter<FittedParameter>")]
    pub parameters: ByName<FittedParameter>,
    /// Correlation of the errors of the parameters.
    pub correlation: Correlation,
    /// What chi2, dof, observations and residuals.csv count: angles (and speeds), velocities, coordinates of frames, or impulses of
    /// discs (e and J_t/J_n).
    #[schemars(extend("enum" = Counted::ALL.map(Counted::name)))]
    pub counted: String,
    /// Sum of the squared standardized residuals, priors included.
    pub chi2: Option<f64>,
    /// The part of chi2 that priors add.
    pub chi2_of_priors: Option<f64>,
    /// Degrees of freedom.
    pub dof: usize,
    /// chi2/dof.
    pub reduced_chi2: Option<f64>,
    /// How the data contradict the model; null if they do not.
    pub refuted: Option<Refuted>,
    /// Of films: the camera as it was fitted, and what else was found of the film. A correction of 0 (of scale and aspect 1)
    /// changes nothing.
    pub film: Option<ByName<FilmEntry>>,
    /// Every unknown that all shots share and that was free: of contact, balls, cloth, time and camera.
    pub unknowns: Vec<Unknown>,
    /// What makes up the standard errors of mu, mu_s and e, the largest part first; empty for those without one.
    #[schemars(with = "ByParameter<Vec<BudgetPart>>")]
    pub budget: ByName<Vec<BudgetPart>>,
    /// What explains residuals that the equations or the stated numbers leave, the best first.
    #[serde(skip_deserializing)]
    pub explanations: Vec<Explanation>,
    /// Number of measured values.
    pub observations: usize,
    /// How the noise of each observable is known.
    pub noise: Vec<Noise>,
    /// How far the fit can be trusted.
    #[serde(flatten, skip_deserializing)]
    pub diagnostics: Diagnostics,
    /// Number of shots that were fitted.
    pub shots_used: usize,
    /// Shots that were left out.
    pub shots_rejected: Vec<Rejected>,
    /// Of discs: standard deviations between shots beyond the errors of their frames, which the errors of the parameters include.
    #[serde(skip_serializing_if = "Option::is_none", skip_deserializing)]
    pub scatter: Option<Scatter>,
    /// Whether the search ended at a minimum.
    pub converged: bool,
    /// Why the search ended.
    pub termination: String,
    /// How many times the search computed all residuals.
    pub iterations: usize,
    /// Duration of the fit, s.
    pub seconds: f64,
}

/// A label whose shots were fitted apart.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Group {
    /// The column that `[fit] by` names.
    pub column: String,
    /// The value of that column.
    pub label: String,
}

/// A ball or a disc.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Body {
    /// Radius, m.
    pub radius_m: f64,
    /// Mass, kg; of discs null if it is not stated.
    pub mass_kg: Option<f64>,
    /// Moment of inertia over MR²: 0.4 for a uniform ball, 0.5 for a uniform disc.
    pub inertia: f64,
    /// Standard deviation of the stated radius, m, if it counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_m_sd: Option<f64>,
    /// Standard deviation of the stated mass, kg, if it counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass_kg_sd: Option<f64>,
}

impl Body {
    /// Returns the cue ball or the object ball (0 or 1) with the standard deviations of what is stated of both if they count.
    pub(super) fn new(ball: &Ball, stated: Option<&ObjectBall>, which: usize) -> Self {
        let sd = |of: [f64; 2]| Some(of[which]).filter(|sd| *sd > 0.0);
        Self {
            radius_m: ball.radius,
            mass_kg: Some(ball.mass),
            inertia: ball.inertia,
            radius_m_sd: stated.and_then(|object| sd(object.radius_sd)),
            mass_kg_sd: stated.and_then(|object| sd(object.mass_sd?)),
        }
    }
}

/// A parameter of the fit.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct FittedParameter {
    /// The meaning in words.
    #[serde(default)]
    pub meaning: String,
    /// Unit: 1 for a ratio, or s/m.
    #[serde(default)]
    pub unit: String,
    /// The best value, or the value at which the parameter was held.
    pub estimate: f64,
    /// Standard error from the curvature of χ²; null if it was not fitted or ends at a bound.
    pub std_error: Option<f64>,
    /// The 95 % interval to quote, within the bounds: lower and upper end.
    pub interval_95: Option<[f64; 2]>,
    /// How interval_95 was found: hessian or profile.
    pub interval_method: Option<String>,
    /// The 95 % interval from the curvature of χ².
    pub interval_95_hessian: Option<[f64; 2]>,
    /// The 95 % interval from the profile of χ², which need not be symmetric.
    pub interval_95_profile: Option<[f64; 2]>,
    /// Standard error if the parameters that end at their bounds are truly there; null if it is the same.
    pub std_error_at_bound: Option<f64>,
    /// How far the data determine it.
    #[schemars(extend("enum" = Status::ALL.map(Status::name)))]
    pub status: String,
    /// Every value from the first, which is a bound, to the second fits equally; null if the estimate is a value.
    pub plateau: Option<[f64; 2]>,
}

/// A correlation matrix.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Correlation {
    /// Names of the parameters.
    pub order: Vec<String>,
    /// Rows and columns in this order, −1 to 1; null if a parameter has no standard error.
    pub matrix: Vec<Vec<Option<f64>>>,
}

/// How the data contradict the model.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Refuted {
    /// χ² over degrees of freedom.
    pub reduced_chi2: Option<f64>,
    /// Probability of a larger χ² if the model is right.
    pub p_value: Option<f64>,
    /// What contradicts the model.
    pub sentence: String,
    /// Standard errors that would hold if the model did, by parameter.
    #[serde(default)]
    #[schemars(with = "ByParameter<f64>")]
    pub std_errors_if_model_held: ByName<f64>,
    /// Restitution as the ratio of the normal velocities, which needs no model; null if it was not measured.
    pub measured_e: Option<MeasuredE>,
}

/// A restitution that was measured without the model.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
pub struct MeasuredE {
    /// Mean over the shots.
    pub estimate: f64,
    /// Its standard error.
    pub std_error: Option<f64>,
    /// Standard deviation between shots.
    #[serde(default)]
    pub scatter_between_shots: f64,
    /// Number of shots that have it.
    #[serde(default)]
    pub shots: usize,
}

/// A number that was found of a film.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct FilmEntry {
    /// Its value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<f64>,
    /// Its standard error, same unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_error: Option<f64>,
    /// Of dropped_frames: number of shots in which frames were dropped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shots: Option<usize>,
    /// Of dropped_frames: number of drops.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drops: Option<usize>,
    /// Of left_out_at_impacts: number of frames before each impact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before: Option<usize>,
    /// Of left_out_at_impacts: number of frames after each impact.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub after: Option<usize>,
}

/// An unknown that all shots share.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Unknown {
    /// mu, mu_s, e, mu_b, mu_c, kappa, e_slope, mass_ratio, radius_ratio; topspin over natural roll of balls that roll (roll) and
    /// slide (topspin); mu_k, mu_r, bounce, frame_rate, tilt_x, tilt_y; and the corrections of the camera.
    pub name: String,
    /// Its value, in the unit at the end of its name; without one a ratio, or lengths in m.
    pub estimate: Option<f64>,
    /// Its standard error, same unit; null at a bound.
    pub std_error: Option<f64>,
    /// Mean and standard deviation of what was known before the fit; null without a prior.
    pub prior: Option<[f64; 2]>,
    /// Estimate less the prior's mean, over the prior's standard deviation; null without a prior.
    pub prior_pull: Option<f64>,
}

/// A part of a standard error: the squares of all add up to its square.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct BudgetPart {
    /// Name of another unknown, as in unknowns; or noise: what remains if all others are known.
    pub source: String,
    /// Its part of the standard error, in the unit of the parameter.
    pub std_error: Option<f64>,
}

/// The noise of one observable.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Noise {
    /// Its column in the data files.
    pub observable: String,
    /// Unit of rms and estimated_sd: deg, m/s, rad/s, or 1 for a ratio.
    pub unit: String,
    /// Number of values.
    pub count: usize,
    /// Root mean square of the residuals.
    pub rms: Option<f64>,
    /// Standard deviation of the noise if it was estimated from the residuals.
    pub estimated_sd: Option<f64>,
}
