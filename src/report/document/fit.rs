//! fit.json: a fit for programs.

use serde::Deserialize;
use serde_json::{Number, Value, json};

use super::{ByName, Made, document, each, finite, named};
use crate::fit::{self, Counted, Diagnostics, Explanation, Fit, FoundCamera, Rejected, Scatter, Verdict};
use crate::measurement::dataset::{Measured, ObjectBall};
use crate::physics::ball::Ball;
use crate::physics::collision::Effects;
use crate::physics::disc::Discs;
use crate::problem::{self, Finding, Id, Severity, Status};
use crate::report::ascii;

/// Numbers that were found of a film, by their names.
pub(crate) type FilmEntry = ByName<Number>;

document! {
    /// fit.json of caromfit
    ///
    /// One fit: fit.json, and each element of the array that caromfit fit --json prints. Numbers
    /// are SI and radians except where a unit stands beside them; null stands for what is not
    /// known.
    #[derive(Default, Deserialize)]
    #[serde(default)]
    FitDocument(fit: &Fit) [made: Made, of Fit] {
        /// Name of the data set.
        dataset: String = fit.dataset.clone(),
        /// The label that was fitted separately; null if the data set was fitted as a whole.
        group: Option<Group> = fit.group.as_ref().map(Group::new),
        /// Whether the numbers can be used.
        #[serde(skip_deserializing)]
        verdict: Option<Verdict> = Some(fit.verdict()),
        /// Label of the cloth.
        cloth: Option<String> = fit.cloth.clone(),
        /// Who measured it, how and when.
        source: Option<String> = fit.source.clone(),
        /// The cue ball, or the first of two discs.
        ball: Option<Body> = Some(body(fit, 0)),
        /// The second of two discs, or the object ball if it is stated to differ from the cue ball.
        #[serde(skip_serializing_if = "Option::is_none")]
        object: Option<Body> = (fit.discs.is_some() || fit.object.is_some()).then(|| body(fit, 1)),
        /// Sliding friction of the cloth, dimensionless.
        mu_k: Option<Measured> = fit.sliding,
        /// Rolling resistance of the cloth, dimensionless.
        mu_r: Option<Measured> = fit.rolling,
        /// Collision model.
        fidelity: String = fit.fidelity.to_owned(),
        /// joint: all frames of a film at once; direct: tables of impacts and angles.
        #[schemars(extend("enum" = ["joint", "direct"]))]
        method: String = fit.method_name().to_owned(),
        /// Whether the model contains each effect, by its name.
        effects: ByName<bool> = {
            let is_on = |name: &str| fit.diagnostics.computed.iter().any(|own| own.effects.contains(&name));
            named(&Effects::NONE.list(), |(name, _)| (*name, is_on(name)))
        },
        /// Findings, the most important first.
        findings: Vec<Found> = each(&fit.remarks, Found::new),
        /// Estimates by the name of the parameter; mu_b and mu_c if the friction decreases with the
        /// slip, kappa if the contact is compliant, mass_ratio and radius_ratio (cue ball over
        /// object ball) if they were fitted, e_slope if the restitution decreases with the closing
        /// speed.
        parameters: ByName<FittedParameter> = named(&fit.estimates, |found| {
            (found.parameter.name(), FittedParameter::new(fit, found))
        }),
        /// Correlation of the errors of the parameters.
        correlation: Correlation = Correlation::new(fit),
        /// The numbers that chi2, dof, observations and residuals.csv count: angles (and speeds),
        /// velocities, coordinates of frames, or impulses of discs (e and J_t/J_n).
        #[schemars(extend("enum" = Counted::ALL.map(Counted::name)))]
        counted: String = fit.counted().name().to_owned(),
        /// Sum of the squared standardized residuals, priors included.
        chi2: Option<f64> = finite(fit.chi2()),
        /// Degrees of freedom.
        dof: usize = fit.dof(),
        /// chi2/dof.
        reduced_chi2: Option<f64> = (fit.dof() > 0).then(|| fit.chi2() / fit.dof() as f64).and_then(finite),
        /// The camera of a film as it was fitted, and other findings on the film. A correction of 0
        /// (of scale, aspect and object_scale 1) has no effect. estimate and std_error; of
        /// dropped_frames the number of shots with drops and of drops; of left_out_at_impacts the
        /// number of frames before and after each impact.
        film: Option<ByName<FilmEntry>> = fit.camera.as_ref().map(|camera| film(camera, &fit.solution.record.findings)),
        /// Every unknown that all shots share and that was free: of contact, balls, cloth, time and
        /// camera.
        unknowns: Vec<Unknown> = each(&fit.solution.estimates(), Unknown::new),
        /// The sources of the standard errors of mu, mu_s and e, the largest part first; empty for
        /// those without one.
        budget: ByName<Vec<BudgetPart>> = named(&fit.budget, |own| {
            (own.id.name(), each(&own.parts, |(name, error)| BudgetPart::new(name, *error)))
        }),
        /// Explanations of residuals that the equations or the stated numbers leave, the best
        /// first.
        #[serde(skip_deserializing)]
        explanations: Vec<Explanation> = fit.explanations(),
        /// Number of measured values.
        observations: usize = match &fit.frames {
            Some(film) => film.solution.chi2_of_data().1.round() as usize,
            None => fit.residuals.len(),
        },
        /// How the noise of each observable is known.
        noise: Vec<Noise> = each(&fit.noise, Noise::new),
        /// How far the fit can be trusted.
        #[serde(flatten, skip_deserializing)]
        diagnostics: Diagnostics = fit.diagnostics.clone(),
        /// Number of shots that were fitted.
        shots_used: usize = fit.shots_used(),
        /// Shots that were left out.
        shots_rejected: Vec<Rejected> = fit.shots_rejected.clone(),
        /// Standard deviations between shots of discs beyond the errors of their frames, which the
        /// errors of the parameters include.
        #[serde(skip_serializing_if = "Option::is_none", skip_deserializing)]
        scatter: Option<Scatter> = fit.scatter,
        /// Whether the search ended at a minimum.
        converged: bool = fit.converged(),
        /// Why the search ended.
        termination: String = fit.termination().to_owned(),
        /// How many times the search computed all residuals.
        iterations: usize = fit.solution.evaluations,
        /// Duration of the fit, s.
        seconds: f64 = fit.seconds,
    }

    /// A label whose shots were fitted separately.
    #[derive(PartialEq, Eq, Deserialize)]
    Group(group: &(String, String)) {
        /// The column that `[fit] by` names.
        column: String = group.0.clone(),
        /// The value of that column.
        label: String = group.1.clone(),
    }

    /// A ball or a disc.
    #[derive(Copy, Deserialize)]
    Body(ball: &Ball, sds: [Option<f64>; 2]) {
        /// Radius, m.
        radius_m: f64 = ball.radius,
        /// Mass, kg; of discs null if it is not stated.
        mass_kg: Option<f64> = Some(ball.mass),
        /// Moment of inertia over MR²: 0.4 for a uniform ball, 0.5 for a uniform disc.
        inertia: f64 = ball.inertia,
        /// Standard deviation of the stated radius, m, if it counts.
        #[serde(skip_serializing_if = "Option::is_none")]
        radius_m_sd: Option<f64> = sds[0].filter(|sd| *sd > 0.0),
        /// Standard deviation of the stated mass, kg, if it counts.
        #[serde(skip_serializing_if = "Option::is_none")]
        mass_kg_sd: Option<f64> = sds[1].filter(|sd| *sd > 0.0),
    }

    /// A parameter of the fit.
    #[derive(Deserialize)]
    FittedParameter(fit: &Fit, found: &fit::Estimate) {
        /// The meaning in words.
        #[serde(default)]
        meaning: String = found.parameter.meaning().to_owned(),
        /// Unit: 1 for a ratio, or s/m.
        #[serde(default)]
        unit: String = ascii(found.parameter.unit()).to_owned(),
        /// The best value, or the value at which the parameter was held.
        estimate: f64 = found.value,
        /// Standard error from the curvature of χ²; null if it was not fitted or ends at a bound.
        std_error: Option<f64> = found.std_error.and_then(finite),
        /// The 95 % interval to quote, within the bounds: lower and upper end.
        interval_95: Option<[f64; 2]> = interval(found.interval_95),
        /// How interval_95 was found: hessian or profile.
        interval_method: Option<String> = interval(found.interval_95).map(|_| {
            if found.is_profiled { "profile" } else { "hessian" }.to_owned()
        }),
        /// Standard error if the parameters that end at their bounds are truly there; null if it is
        /// the same.
        std_error_at_bound: Option<f64> = found.std_error_at_bound.and_then(finite),
        /// How far the data determine it.
        #[schemars(extend("enum" = Status::ALL.map(Status::name)))]
        status: String = found.status.name().to_owned(),
        /// Every value from the first, which is a bound, to the second fits equally; null if the
        /// estimate is a value.
        plateau: Option<[f64; 2]> = fit.plateau(found.parameter),
    }

    /// A correlation matrix.
    #[derive(Default, Deserialize)]
    Correlation(fit: &Fit) {
        /// Names of the parameters.
        order: Vec<String> = each(&fit.estimates, |found| found.parameter.name().to_owned()),
        /// Rows and columns in this order, −1 to 1; null if a parameter has no standard error.
        matrix: Vec<Vec<Option<f64>>> = {
            let (covariance, places) = (fit.covariance(), 0..fit.estimates.len());
            let scale = |i: usize, j: usize| (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            let row = |i: usize| places.clone().map(|j| finite(covariance[(i, j)] / scale(i, j))).collect();
            places.clone().map(row).collect()
        },
    }

    /// Something that a reader should know.
    #[derive(Deserialize)]
    Found(remark: &fit::Remark) {
        /// The kind of the finding.
        kind: String = remark.kind.clone(),
        /// info: good to know; doubt: the estimates may be off by more than their errors; unusable:
        /// they are meaningless.
        #[schemars(extend("enum" = ["info", "doubt", "unusable"]))]
        severity: String = match remark.severity {
            Severity::Note | Severity::Warning => "info",
            Severity::Doubtful => "doubt",
            Severity::Unusable => "unusable",
        }.to_owned(),
        /// The finding in words.
        sentence: String = remark.sentence.clone(),
        /// Its numbers, by their names.
        #[serde(flatten)]
        values: serde_json::Map<String, Value> = numbers(remark),
    }

    /// An unknown that all shots share.
    #[derive(Deserialize)]
    Unknown(found: &problem::Estimate) {
        /// mu, mu_s, e, mu_b, mu_c, kappa, e_slope, mass_ratio, radius_ratio; topspin over natural
        /// roll of balls that roll (roll) and slide (topspin); mu_k, mu_r, bounce, frame_rate,
        /// tilt_x, tilt_y; and the corrections of the camera.
        name: String = found.id.name().to_owned(),
        /// Its value, in the unit at the end of its name; without one a ratio, or lengths in m.
        estimate: Option<f64> = finite(found.value),
        /// Its standard error, same unit; null at a bound.
        std_error: Option<f64> = found.std_error.and_then(finite),
        /// Mean and standard deviation of what was known before the fit; null without a prior.
        prior: Option<[f64; 2]> = found.prior.map(|prior| [prior.mean, prior.sd]),
        /// Estimate less the prior's mean, over the prior's standard deviation; null without a
        /// prior.
        prior_pull: Option<f64> = found.prior.and_then(|prior| finite((found.value - prior.mean) / prior.sd)),
    }

    /// A part of a standard error: the squares of all add up to its square.
    #[derive(Deserialize)]
    BudgetPart(name: &str, error: f64) {
        /// Name of another unknown, as in unknowns; or noise: what remains if all others are known.
        source: String = name.to_owned(),
        /// Its part of the standard error, in the unit of the parameter.
        std_error: Option<f64> = finite(error),
    }

    /// The noise of one observable.
    #[derive(Deserialize)]
    Noise(noise: &fit::Noise) {
        /// Its column in the data files.
        observable: String = noise.observable.column().to_owned(),
        /// Unit of rms and estimated_sd: deg, m/s, rad/s, or 1 for a ratio.
        unit: String = ascii(noise.observable.unit()).to_owned(),
        /// Number of values.
        count: usize = noise.count,
        /// Root mean square of the residuals.
        rms: Option<f64> = finite(noise.rms / noise.observable.unit_si()),
        /// Standard deviation of the noise if it was estimated from the residuals.
        estimated_sd: Option<f64> = noise.estimated_sd.and_then(|sd| finite(sd / noise.observable.unit_si())),
    }
}

impl FitDocument {
    /// Returns why the numbers mean nothing, if the data contradict the model.
    pub(in crate::report) fn refuted(&self) -> Option<&Found> {
        self.findings.iter().find(|finding| finding.values.get("refutes") == Some(&Value::Bool(true)))
    }
}

/// Returns the numbers of a remark.
fn numbers(remark: &fit::Remark) -> serde_json::Map<String, Value> {
    let values = serde_json::to_value(&remark.values).unwrap_or_default();
    let entries = values.as_object().into_iter().flatten();
    let numbers = entries.filter(|(key, _)| !["kind", "beside"].contains(&key.as_str()));
    numbers.map(|(key, value)| (key.clone(), value.clone())).collect()
}

impl Body {
    /// Returns the cue ball or the object ball (0 or 1) with the standard deviations of what is
    /// stated of both.
    pub(in crate::report) fn of_balls(cue: &Ball, object: Option<&ObjectBall>, which: usize) -> Self {
        let ball = object.filter(|_| which == 1).map_or(cue, |object| &object.ball);
        let sds = |object: &ObjectBall| [Some(object.radius_sd), object.mass_sd].map(|sds| Some(sds?[which]));
        Self::new(ball, object.map_or([None; 2], sds))
    }
}

/// Returns the cue ball or the object ball, or one of two discs (0 or 1): of discs with the mass
/// only if it is stated.
pub(in crate::report) fn body(fit: &Fit, which: usize) -> Body {
    let Some(Discs { radii, masses, inertia, .. }) = fit.discs else {
        return Body::of_balls(&fit.ball, fit.object.as_ref(), which);
    };
    let half_distance = 0.5 * fit.solution.value(Id::ContactDistance);
    let (radius_m, mass_kg) = (radii.map_or(half_distance, |all| all[which]), masses.map(|all| all[which]));
    Body { radius_m, mass_kg, inertia, radius_m_sd: None, mass_kg_sd: None }
}

fn interval(ends: Option<[f64; 2]>) -> Option<[f64; 2]> {
    ends.filter(|ends| ends.iter().all(|end| end.is_finite()))
}

/// Returns the camera as it was fitted, and what else was found of a film.
fn film(found: &FoundCamera, findings: &[Finding]) -> ByName<FilmEntry> {
    let mut all = named(&found.corrections(), |(which, found)| (which.name(), numbers_of(json!(found))));
    let mut add = |name: &str, entry: Value| all.insert(name.to_owned(), numbers_of(entry));
    if let Some(rho) = found.noise_correlation() {
        add("noise_correlation", json!({ "estimate": rho }));
    }
    add("resolution_m", json!({ "estimate": found.resolution }));
    add("dropped_frames", json!({ "shots": 0, "drops": 0 }));
    for finding in findings {
        match finding {
            Finding::Drops { .. } => add("dropped_frames", json!(finding)),
            Finding::Spoiled { .. } => add("left_out_at_impacts", json!(finding)),
            _ => None,
        };
    }
    all
}

/// Returns the numbers of an object that are known.
fn numbers_of(object: Value) -> FilmEntry {
    let entries = object.as_object().into_iter().flatten();
    entries.filter_map(|(key, value)| Some((key.clone(), value.as_number()?.clone()))).collect()
}
