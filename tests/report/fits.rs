//! Fits built by hand, of the kinds that a report must cope with.

use std::sync::OnceLock;

use caromfit::fit::{About, Budget, Diagnostics, Goodness, Id, Intervals, Noise, Remark, Severity};

use crate::prelude::*;

pub const NAN: f64 = f64::NAN;

/// Fits have more fields from time to time, so that none can be made of nothing: one that was fitted, of which all is then set.
fn fitted() -> Fit {
    static FITTED: OnceLock<Fit> = OnceLock::new();
    let fit = FITTED.get_or_init(|| {
        let options = Options { depth: Depth::Estimates, ..options::of_fit() };
        let dataset = made(&spec(Kind::Angles, &[Played::Stun], 10, 1));
        fit::fit(&dataset, &options).unwrap().remove(0)
    });
    fit.clone()
}

fn estimate(parameter: Parameter, value: f64, std_error: f64) -> Estimate {
    let mut estimate = without_error(parameter, value, Status::Free);
    estimate.std_error = Some(std_error);
    estimate.interval_95 = Some([value - 1.96 * std_error, value + 1.96 * std_error]);
    estimate
}

fn without_error(parameter: Parameter, value: f64, status: Status) -> Estimate {
    let mut estimate = fitted().estimates[0];
    (estimate.parameter, estimate.value, estimate.status) = (parameter, value, status);
    (estimate.std_error, estimate.interval_95, estimate.std_error_at_bound) = (None, None, None);
    estimate.intervals = Intervals::default();
    estimate
}

/// What ten throws with stated noise give.
fn goodness() -> Goodness {
    let mut goodness = fitted().diagnostics.goodness.unwrap();
    (goodness.chi2, goodness.dof, goodness.noise_is_stated) = (7.0, 7, true);
    goodness.p_value = Some(0.428_88);
    goodness.noise = NoiseVerdict::Explains;
    goodness.noise_factor = Some(1.0);
    (goodness.trends, goodness.influence) = (Vec::new(), Vec::new());
    (goodness.normality, goodness.influential_from) = (None, None);
    goodness
}

/// Ten throws, and nothing to complain about.
pub fn normal() -> Fit {
    let throw = |i: i32| {
        let cut = f64::from(8 * i).to_radians();
        let predicted = (0.5 * f64::from(i)).to_radians();
        let sd = 0.1_f64.to_radians();
        let standardized = [0.3, -1.2, 0.7, 1.9, -0.4, 0.1, -0.8, 1.1, -2.1, 0.5][(i - 1) as usize];
        Residual {
            shot: i.to_string(),
            observable: Observable::Throw,
            measured: predicted + standardized * sd,
            predicted,
            sd,
            standardized,
            cut,
            speed: Some(0.5 * f64::from(i)),
        }
    };
    let mut fit = fitted();
    fit.dataset = "lab-a".into();
    fit.cloth = Some("Simonis 860".to_owned());
    fit.source = Some("measured by \"A\", 2026".to_owned());
    fit.fidelity = "full";
    fit.effects = vec![("friction", true), ("cloth", true), ("spin_loss", false)];
    fit.estimates = vec![
        estimate(Parameter::Mu, 0.101_37, 0.002_71),
        estimate(Parameter::MuS, 0.31, 0.046),
        estimate(Parameter::E, 0.941_2, 0.003_9),
    ];
    fit.correlation = DMatrix::from_row_slice(3, 3, &[1.0, -0.5, 0.25, -0.5, 1.0, 0.125, 0.25, 0.125, 1.0]);
    fit.chi2 = 7.0;
    fit.dof = 7;
    fit.noise = vec![Noise {
        observable: Observable::Throw,
        count: 10,
        rms: 0.11_f64.to_radians(),
        estimated_sd: None,
        rounding: None,
    }];
    fit.shots_used = 10;
    fit.residuals = (1..=10).map(throw).collect();
    fit.termination = "the cost no longer falls".into();
    fit.converged = true;
    fit.iterations = 9;
    fit.seconds = 0.0123;
    fit.diagnostics = Diagnostics::default();
    fit.diagnostics.goodness = Some(goodness());
    fit.remarks = Vec::new();
    fit.unknowns = Vec::new();
    fit.budget = vec![Budget { id: Id::Mu, shares: Vec::new(), noise: 0.0027_f64.powi(2) }];
    fit
}

/// A label of a group where one parameter is fixed, one left alone, one at its bound.
pub fn restricted() -> Fit {
    let mut fit = normal();
    fit.group = Some(("chalk".to_owned(), "fresh, blue".to_owned()));
    fit.estimates = vec![
        without_error(Parameter::Mu, 0.0, Status::AtLowerBound),
        without_error(Parameter::MuS, 0.3, Status::NotIdentified),
        without_error(Parameter::E, 0.94, Status::Fixed),
    ];
    fit.estimates[0].interval_95 = Some([0.0, 0.012_87]);
    fit.correlation = DMatrix::from_element(3, 3, NAN);
    fit.noise[0].estimated_sd = Some(0.1_f64.to_radians());
    fit.diagnostics.goodness = None;
    fit.budget = Vec::new();
    fit.shots_rejected = vec![Rejected { shot: "7".to_owned(), reason: "no impact found".to_owned() }];
    fit.remarks = vec![Remark {
        about: About::Kind("undetermined"),
        severity: Severity::Warning,
        sentence: "μ_s is not identified: no shot has follow or draw.".to_owned(),
    }];
    fit
}

/// As many parameters as observations: no standard deviations.
pub fn exact() -> Fit {
    let mut fit = normal();
    fit.dataset = "one-shot".into();
    fit.residuals.truncate(1);
    fit.residuals[0].sd = NAN;
    fit.residuals[0].standardized = NAN;
    fit.residuals[0].speed = None;
    fit.residuals[0].shot = "a \"quoted\", shot".into();
    fit.estimates = vec![
        without_error(Parameter::Mu, 0.095_1, Status::Free),
        without_error(Parameter::MuS, 0.3, Status::Fixed),
        without_error(Parameter::E, 0.94, Status::Fixed),
    ];
    fit.correlation = DMatrix::from_element(3, 3, NAN);
    fit.chi2 = NAN;
    fit.dof = 0;
    fit.noise[0].count = 1;
    fit.noise[0].estimated_sd = Some(NAN);
    fit.shots_used = 1;
    fit.converged = false;
    fit
}

/// Nothing was measured.
pub fn empty() -> Fit {
    let mut fit = normal();
    (fit.residuals, fit.noise) = (Vec::new(), Vec::new());
    (fit.shots_used, fit.dof, fit.chi2) = (0, 0, 0.0);
    fit
}

/// Synthetic shots of which several quantities were measured, with normal errors.
pub fn synthetic(name: &str, observables: &[Observable], shots: usize, seed: u64) -> Fit {
    // The sum of twelve uniform numbers is nearly normal, of variance 1.
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal_deviate = move || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 1);
    let mut fit = normal();
    fit.dataset = name.into();
    fit.residuals.clear();
    for shot in 0..shots {
        let cut = rng.random_range(0.0..75.0_f64).to_radians();
        let speed = rng.random_range(0.5..4.0_f64);
        for &observable in observables {
            let (predicted, sd) = match observable {
                Observable::Throw => (4.5_f64.to_radians() * (2.0 * cut).sin(), 0.25_f64.to_radians()),
                Observable::Separation => (90.0_f64.to_radians() - 0.3 * cut, 0.5_f64.to_radians()),
                Observable::ObjectSpeedRatio => (0.97 * cut.cos(), 0.01),
                Observable::CueSpin(_) | Observable::ObjectSpin(_) => (30.0 * speed * cut.cos() - 10.0, 4.0),
                _ => (speed * cut.cos(), 0.02 * speed),
            };
            let standardized: f64 = normal_deviate();
            fit.residuals.push(Residual {
                shot: (shot + 1).to_string(),
                observable,
                measured: predicted + standardized * sd,
                predicted,
                sd,
                standardized,
                cut,
                speed: Some(speed),
            });
        }
    }
    fit.diagnostics.goodness.as_mut().unwrap().counted = fit.tested();
    fit.shots_used = shots;
    fit.dof = fit.residuals.len().saturating_sub(3);
    fit.chi2 = fit.residuals.iter().map(|residual| residual.standardized.powi(2)).sum();
    fit
}
