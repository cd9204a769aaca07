//! fit.json: the whole fit but its residuals, for programs. SI and radians, except where a unit
//! stands beside the number. Numbers have the digits that mean something, see `digits`.

use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

use super::digits::{self, FEW, MANY};
use super::{FORMAT_VERSION, ReportError, diagnostics, pretty, reduced_chi2, unit_name, unit_of};
use crate::fit;
use crate::fit::causes::Explanation;
use crate::fit::{Estimate, Fit, FoundCamera, FoundCorrection, Noise, Refuted, Verdict};
use crate::measurement::dataset::ObjectBall;
use crate::measurement::parameter::Parameter;

/// fit.json as text, with a newline at its end. What is not finite becomes `null`.
pub fn render(fit: &Fit) -> Result<String, ReportError> {
    pretty(fit, &fit.dataset)
}

/// Several fits as a JSON array, with a newline at its end.
pub fn render_all(fits: &[Fit]) -> Result<String, ReportError> {
    pretty(fits, "all fits")
}

/// Whether two texts of fit.json hold the same result, whatever it took to find it.
#[must_use]
pub fn same_result(one: &str, other: &str) -> bool {
    let result = |line: &&str| !EFFORT.iter().any(|key| line.starts_with(key));
    one.lines().filter(result).eq(other.lines().filter(result))
}

/// How the lines of fit.json begin that tell what it took: the time, and steps, of which one more or less is a matter of roundings.
const EFFORT: [&str; 2] = ["  \"seconds\":", "  \"iterations\":"];

/// An estimate of one thing.
#[derive(Debug, Serialize)]
struct Estimated {
    estimate: f64,
    std_error: Option<f64>,
}

impl Estimated {
    fn new(value: f64, error: Option<f64>) -> Self {
        let rounded = error.map(|error| digits::relative(error, FEW));
        Self { estimate: digits::to_error(value, error), std_error: rounded }
    }
}

/// A cause, and what the parameters would be with it.
#[derive(Debug, Serialize)]
struct ExplanationEntry {
    cause: &'static str,
    estimate: f64,
    std_error: f64,
    delta_2logl: f64,
    adopted: bool,
    with_it: Ordered<Estimated>,
    /// Of the velocities, without it and with it; `None` where less than nothing seems to be left.
    reduced_chi2: Option<[Option<f64>; 2]>,
    sentence: String,
}

fn explanation(found: &Explanation) -> ExplanationEntry {
    let with_it = |(parameter, estimate, error): &(Parameter, f64, f64)| {
        let std_error = Some(digits::significant(*error, FEW));
        (parameter.name(), Estimated { std_error, ..Estimated::new(*estimate, Some(*error)) })
    };
    ExplanationEntry {
        cause: found.cause.name(),
        estimate: digits::to_error(found.estimate, Some(found.std_error)),
        std_error: digits::significant(found.std_error, FEW),
        delta_2logl: digits::decimal(found.delta_2logl),
        adopted: found.adopted,
        with_it: Ordered(found.with_it.iter().map(with_it).collect()),
        // below 0 where noise that the shots tell by themselves had grown by what is explained: no χ² is
        reduced_chi2: found
            .reduced_chi2
            .map(|both| both.map(|value| (value >= 0.0).then(|| digits::significant(value, MANY)))),
        sentence: found.sentence.clone(),
    }
}

/// As in fit.json.
impl Serialize for Fit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        document(self).serialize(serializer)
    }
}

fn document(fit: &Fit) -> Document<'_> {
    Document {
        dataset: &fit.dataset,
        group: fit.group.as_ref().map(|(column, label)| Group { column, label }),
        verdict: verdict(&fit.verdict()),
        cloth: fit.cloth.as_deref(),
        source: fit.source.as_deref(),
        ball: body(fit, 0),
        object: (fit.discs.is_some() || fit.object.is_some()).then(|| body(fit, 1)),
        mu_k: fit.sliding.map(|friction| Estimated::new(friction.value, friction.sd)),
        mu_r: fit.rolling.map(|friction| Estimated::new(friction.value, friction.sd)),
        version: env!("CARGO_PKG_VERSION"),
        format_version: FORMAT_VERSION,
        fidelity: fit.fidelity,
        method: fit.method_name(),
        effects: Ordered(fit.effects.clone()),
        warnings: &fit.warnings,
        notes: &fit.notes,
        parameters: Ordered(fit.estimates.iter().map(parameter).collect()),
        correlation: Correlation {
            order: fit.estimates.iter().map(|e| e.parameter.name()).collect(),
            matrix: correlation(fit),
        },
        counted: fit.counted().name(),
        chi2: digits::significant(fit.chi2, MANY),
        chi2_of_priors: digits::significant(fit.prior_chi2, FEW),
        dof: fit.dof,
        reduced_chi2: reduced_chi2(fit).map(|value| digits::significant(value, MANY)),
        refuted: fit.refuted.as_ref().map(refuted),
        film: fit.camera.as_ref().map(film),
        explanations: fit.explanations.iter().map(explanation).collect(),
        observations: fit.diagnostics.joint.as_ref().map_or(fit.residuals.len(), |joint| joint.observations),
        noise: fit.noise.iter().map(noise).collect(),
        diagnostics: diagnostics::entries(fit),
        shots_used: fit.shots_used,
        shots_rejected: with_reasons(&fit.shots_rejected),
        shots_doubtful: with_reasons(&fit.shots_doubtful),
        scatter: fit.scatter.filter(|scatter| scatter.is_estimated).map(|scatter| Scatter {
            e: digits::significant(scatter.restitution, FEW),
            impulse_ratio: digits::significant(scatter.impulse_ratio, FEW),
        }),
        converged: fit.converged,
        termination: &fit.termination,
        iterations: fit.iterations,
        seconds: digits::relative(fit.seconds, FEW),
    }
}

/// The content of fit.json, in the order of its keys.
#[derive(Debug, Serialize)]
struct Document<'a> {
    dataset: &'a str,
    group: Option<Group<'a>>,
    verdict: Value,
    cloth: Option<&'a str>,
    source: Option<&'a str>,
    ball: BallEntry,
    /// Of discs the second one; of balls the object ball, where it is stated to differ from the cue ball.
    #[serde(skip_serializing_if = "Option::is_none")]
    object: Option<BallEntry>,
    mu_k: Option<Estimated>,
    mu_r: Option<Estimated>,
    version: &'static str,
    format_version: u32,
    fidelity: &'static str,
    method: &'static str,
    effects: Ordered<bool>,
    warnings: &'a [String],
    notes: &'a [String],
    parameters: Ordered<ParameterEntry>,
    correlation: Correlation,
    /// What chi2, dof, observations and residuals.csv count.
    counted: &'static str,
    chi2: f64,
    /// The part of chi2 that is no residual's.
    chi2_of_priors: f64,
    dof: usize,
    reduced_chi2: Option<f64>,
    /// `null` where the data do not refute the model.
    refuted: Option<RefutedEntry>,
    film: Option<Map<String, Value>>,
    /// What explains the residuals, the best first; empty where nothing is amiss.
    explanations: Vec<ExplanationEntry>,
    observations: usize,
    noise: Vec<NoiseEntry>,
    #[serde(flatten)]
    diagnostics: Map<String, Value>,
    shots_used: usize,
    shots_rejected: Vec<Rejected<'a>>,
    shots_doubtful: Vec<Rejected<'a>>,
    /// Of discs: standard deviations between shots, beyond the errors of their frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    scatter: Option<Scatter>,
    converged: bool,
    termination: &'a str,
    iterations: usize,
    seconds: f64,
}

/// As fit.json and compare.json have it.
pub(super) fn verdict(found: &Verdict) -> Value {
    json!({"grade": found.grade.name(), "sentence": found.sentence})
}

#[derive(Debug, Serialize)]
struct Group<'a> {
    column: &'a str,
    label: &'a str,
}

#[derive(Debug, Serialize)]
struct BallEntry {
    radius_m: f64,
    mass_kg: Option<f64>,
    inertia: f64,
    /// Of balls: the standard deviations of what is stated, where they count.
    #[serde(skip_serializing_if = "Option::is_none")]
    radius_m_sd: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mass_kg_sd: Option<f64>,
}

/// The cue ball or the object ball, or one of two discs (0 or 1); of discs the mass only where it is stated.
fn body(fit: &Fit, which: usize) -> BallEntry {
    let radii = fit.discs.and_then(|discs| discs.radii);
    let ball = fit.object.filter(|_| which == 1).map_or(fit.ball, |object| object.ball);
    let mass_kg = match fit.discs {
        Some(discs) => discs.masses.map(|masses| masses[which]),
        None => Some(ball.mass),
    };
    let sd = |of: fn(ObjectBall) -> [f64; 2]| {
        let sd = fit.object.map(|object| of(object)[which]).filter(|sd| *sd > 0.0);
        sd.map(|sd| digits::significant(sd, MANY))
    };
    BallEntry {
        radius_m: digits::significant(radii.map_or(ball.radius, |radii| radii[which]), MANY),
        mass_kg: mass_kg.map(|mass| digits::significant(mass, MANY)),
        inertia: digits::significant(ball.inertia, MANY),
        radius_m_sd: sd(|object| object.radius_sd),
        mass_kg_sd: sd(|object| object.mass_sd),
    }
}

/// Where the data refute the model.
#[derive(Debug, Serialize)]
struct RefutedEntry {
    reduced_chi2: f64,
    p_value: f64,
    sentence: String,
    /// No errors of the estimates: they would be if the model held.
    std_errors_if_model_held: Ordered<f64>,
    measured_e: Option<MeasuredEntry>,
}

/// The ratio of the normal velocities, which needs no model.
#[derive(Debug, Serialize)]
struct MeasuredEntry {
    estimate: f64,
    std_error: f64,
    scatter_between_shots: f64,
    shots: usize,
}

/// What the balls tell of their camera.
fn film(found: &FoundCamera) -> Map<String, Value> {
    let entry = |name: &str, value: f64, std_error: f64, adopted: bool| {
        let Estimated { estimate, std_error } = Estimated::new(value, Some(std_error));
        (name.to_owned(), json!({"estimate": estimate, "std_error": std_error, "adopted": adopted}))
    };
    let correction = |c: &FoundCorrection| entry(c.which.name(), c.value, c.std_error, c.adopted);
    let mut film: Map<String, Value> = found.corrections.iter().map(correction).collect();
    film.extend(found.noise_correlation.map(|n| entry("noise_correlation", n.value, n.std_error, n.adopted)));
    let [shots, drops] = found.drops;
    film.extend([
        ("resolution_m".to_owned(), json!({"estimate": digits::significant(found.resolution, FEW)})),
        ("dropped_frames".to_owned(), json!({"shots": shots, "drops": drops})),
    ]);
    film
}

fn refuted(found: &Refuted) -> RefutedEntry {
    let errors = found
        .if_model_held
        .iter()
        .map(|(parameter, error)| (parameter.name(), digits::relative(*error, FEW)));
    RefutedEntry {
        reduced_chi2: digits::significant(found.reduced_chi2, MANY),
        p_value: digits::probability(found.p_value),
        sentence: found.sentence(),
        std_errors_if_model_held: Ordered(errors.collect()),
        measured_e: found.restitution.map(|measured| MeasuredEntry {
            estimate: digits::to_error(measured.value, Some(measured.std_error)),
            std_error: digits::relative(measured.std_error, FEW),
            scatter_between_shots: digits::relative(measured.scatter, FEW),
            shots: measured.shots,
        }),
    }
}

#[derive(Debug, Serialize)]
struct ParameterEntry {
    meaning: &'static str,
    /// `1` for a ratio.
    unit: &'static str,
    estimate: f64,
    std_error: Option<f64>,
    interval_95: Option<[f64; 2]>,
    interval_method: Option<&'static str>,
    interval_95_hessian: Option<[f64; 2]>,
    interval_95_profile: Option<[f64; 2]>,
    std_error_at_bound: Option<f64>,
    status: &'static str,
}

#[derive(Debug, Serialize)]
struct Correlation {
    order: Vec<&'static str>,
    matrix: Vec<Vec<f64>>,
}

/// In the unit of the observable's column.
#[derive(Debug, Serialize)]
struct NoiseEntry {
    observable: &'static str,
    unit: &'static str,
    count: usize,
    rms: f64,
    estimated_sd: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Scatter {
    e: f64,
    impulse_ratio: f64,
}

#[derive(Debug, Serialize)]
struct Rejected<'a> {
    shot: &'a str,
    reason: &'a str,
}

fn with_reasons(shots: &[fit::Rejected]) -> Vec<Rejected<'_>> {
    shots.iter().map(|shot| Rejected { shot: &shot.shot, reason: &shot.reason }).collect()
}

/// An object whose keys keep their order.
#[derive(Debug)]
struct Ordered<T>(Vec<(&'static str, T)>);

impl<T: Serialize> Serialize for Ordered<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

fn parameter(estimate: &Estimate) -> (&'static str, ParameterEntry) {
    let error = estimate.std_error.or(estimate.std_error_at_bound);
    let finite = |interval: [f64; 2]| {
        interval.iter().all(|end| end.is_finite()).then(|| interval.map(|end| digits::end(end, error)))
    };
    let entry = ParameterEntry {
        meaning: estimate.parameter.meaning(),
        unit: unit_of(estimate.parameter),
        estimate: digits::to_error(estimate.value, error),
        std_error: estimate.std_error.map(|error| digits::relative(error, FEW)),
        interval_95: estimate.interval_95.and_then(finite),
        interval_method: estimate
            .interval_95
            .and_then(finite)
            .map(|_| if estimate.is_profiled() { "profile" } else { "hessian" }),
        interval_95_hessian: estimate.intervals.hessian.and_then(finite),
        interval_95_profile: estimate.intervals.profile.and_then(finite),
        std_error_at_bound: estimate.std_error_at_bound.map(|error| digits::relative(error, FEW)),
        status: estimate.status.name(),
    };
    (estimate.parameter.name(), entry)
}

/// NaN, and with it `null`, where a parameter has no standard error.
fn correlation(fit: &Fit) -> Vec<Vec<f64>> {
    fit.correlation.row_iter().map(|row| row.iter().map(|value| digits::decimal(*value)).collect()).collect()
}

fn noise(noise: &Noise) -> NoiseEntry {
    let unit_si = noise.observable.unit_si();
    NoiseEntry {
        observable: noise.observable.column(),
        unit: unit_name(noise.observable),
        count: noise.count,
        rms: digits::significant(noise.rms / unit_si, FEW),
        estimated_sd: noise.estimated_sd.map(|sd| digits::significant(sd / unit_si, FEW)),
    }
}
