//! Other models on the same data: is what the fit assumes needed, and is it enough?
//!
//! Noise that the data do not state is estimated by maximum likelihood for each model anew and counts as
//! a parameter.
//!
//! - Akaike, H. (1974), IEEE Trans. Autom. Control 19, 716–723; Schwarz, G. (1978), Ann. Stat. 6, 461–464.
//! - Self, S. G. and Liang, K.-Y. (1987), J. Am. Stat. Assoc. 82, 605–610: a likelihood ratio at a bound.

use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::fit::error::Request;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::written;
use crate::physics::collision::{Fidelity, FidelityChoice};
use crate::problem::{Deviations, Id, Policy, RowsChoices, RowsFit, fit_rows};

/// Another model on the same data.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Alternative {
    /// The difference in words; the fit itself comes first.
    #[serde(rename = "model")]
    pub name: &'static str,
    /// Why it could not be fitted; null if it was.
    pub failed: Option<String>,
    /// Its estimates by parameter, in its unit; empty if the data contradict the fit.
    #[serde(serialize_with = "written::by_parameter")]
    #[schemars(with = "std::collections::BTreeMap<String, Option<f64>>")]
    pub values: Vec<(Parameter, f64)>,
    /// Number of parameters and noises that were estimated.
    #[serde(rename = "fitted_parameters")]
    pub parameters: usize,
    /// Akaike's criterion of this model less that of the fit: negative favours this model.
    #[schemars(with = "Option<f64>")]
    pub delta_aic: f64,
    /// Bayesian criterion (Schwarz) of this model less that of the fit: negative favours this model.
    #[schemars(with = "Option<f64>")]
    pub delta_bic: f64,
    /// Test of the simpler of two models if one contains the other.
    pub likelihood_ratio: Option<LikelihoodRatio>,
}

/// A likelihood-ratio test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct LikelihoodRatio {
    /// By how much −2 log L of the larger model is lower.
    #[schemars(with = "Option<f64>")]
    pub statistic: f64,
    /// Probability of a larger statistic if the simpler model is right.
    #[schemars(with = "Option<f64>")]
    pub p_value: f64,
}

/// The difference from the fit.
#[derive(Clone)]
struct Change {
    name: &'static str,
    fidelity: FidelityChoice,
    settings: Settings,
    /// 1 where the change is one more parameter, −1 where one less, 0 where neither contains the other.
    nested: i32,
}

/// Fits other models to the shots of a fit; returns the fit, then these.
pub(in crate::fit) fn compare(
    request: Request,
    fit: &RowsFit,
    shots: &[Option<Deviations>],
) -> Vec<Alternative> {
    let settings = request.dataset.settings_of_balls();
    let numbers: usize = shots.iter().flatten().map(|shot| shot.values.len()).sum();
    let (here, count) = fit.solution.minus_two_log();
    let fitted = |name, found: &RowsFit, settings: &Settings, nested: i32| {
        let (there, parameters) = found.solution.minus_two_log();
        let (rise, more) = (there - here, parameters as f64 - count as f64);
        let statistic = (-f64::from(nested) * rise).max(0.0);
        let ratio = LikelihoodRatio { statistic, p_value: at_bound(statistic) };
        let has = Parameter::ALL.into_iter().filter(|p| settings.has(*p));
        Alternative {
            name,
            failed: None,
            values: has.map(|p| (p, found.solution.value(Id::from(p)))).collect(),
            parameters,
            delta_aic: rise + 2.0 * more,
            delta_bic: rise + (numbers as f64).ln() * more,
            likelihood_ratio: (nested != 0).then_some(ratio),
        }
    };
    let failed = |name, reason: String| Alternative {
        name,
        failed: Some(reason),
        values: Vec::new(),
        parameters: 0,
        delta_aic: f64::NAN,
        delta_bic: f64::NAN,
        likelihood_ratio: None,
    };
    let mut alternatives = vec![fitted("as fitted", fit, &settings, 0)];
    // all models are fitted to the shots of the fit, also those that one of them does not describe
    let policy = Policy { shot_tail: 0.0, ..Policy::default() };
    let is_fitted = |shot: &&Shot| fit.solution.names[0].contains(&shot.name);
    let used: Vec<&Shot> = request.dataset.shots.iter().filter(is_fitted).collect();
    for Change { name, fidelity, settings, nested } in changes(request, fit, &settings, shots) {
        let dataset = Dataset { settings, ..request.dataset.clone() };
        let (loss, near) = (request.options.loss, Some(fit.solution.value(Id::Mu)));
        let choices = RowsChoices { fidelity, loss, without_profiles: true, near };
        alternatives.push(match fit_rows(&dataset, &used, &choices, &policy) {
            Ok(found) if found.solution.names == fit.solution.names => {
                fitted(name, &found, &dataset.settings_of_balls(), nested)
            }
            Ok(_) => failed(name, "it leaves other shots out".to_owned()),
            Err(error) => failed(name, error.to_string()),
        });
    }
    alternatives
}

/// The probability of a statistic as large, where the smaller model holds a parameter at its bound 0: half the time the
/// larger model leaves it there, too, and the statistic is 0; else it is that of χ² with one degree of freedom.
fn at_bound(statistic: f64) -> f64 {
    /// −2 log L of two searches for the same minimum.
    const NOTHING: f64 = 1e-6;
    if statistic <= NOTHING {
        return 1.0;
    }
    0.5 * ChiSquared::new(1.0).map_or(f64::NAN, |d| d.sf(statistic))
}

/// Returns the models that a fit is compared with.
fn changes(request: Request, fit: &RowsFit, own: &Settings, shots: &[Option<Deviations>]) -> Vec<Change> {
    let full = FidelityChoice::Of(Fidelity::Full);
    let fidelity = request.options.fidelity;
    let is_full = matches!(fidelity, FidelityChoice::Auto | FidelityChoice::Of(Fidelity::Full));
    let other = |fidelity: Fidelity| Change {
        name: fidelity.name(),
        fidelity: FidelityChoice::Of(fidelity),
        settings: request.dataset.settings,
        nested: 0,
    };
    let adopts = fit.solution.findings.iter().any(|finding| finding.adoption() == Some(true));
    let mut all = Vec::new();
    if adopts || !is_full {
        all.push(other(Fidelity::Full));
    }
    if is_full {
        all.push(other(Fidelity::Linear));
    }
    if !fidelity.first().effects().friction {
        return all;
    }
    let is_told = |parameter: Parameter| {
        let setting = &own[parameter];
        !setting.fixed && setting.prior.is_none() && fit.solution.is_informed(Id::from(parameter))
    };
    // effects that were adopted stay
    let base = Change { fidelity: if is_full && !adopts { full } else { fidelity }, ..other(Fidelity::Full) };
    let mut law = base.clone();
    law.settings.falls = !own.falls;
    if own.falls {
        // without b nothing depends on c: the ratio then has no known distribution
        let has_one = is_told(Parameter::B) && own[Parameter::C].fixed && own[Parameter::B].lower == 0.0;
        all.push(Change { name: "constant friction", nested: -i32::from(has_one), ..law });
    } else if shots.iter().flatten().all(|shot| shot.speed.is_some()) {
        for parameter in [Parameter::B, Parameter::C] {
            law.settings[parameter] = parameter.default_setting();
        }
        all.push(Change { name: "friction falling with the slip", nested: 1, ..law });
    }
    if shots.iter().flatten().any(|shot| shot.spins[0] > 0.0) {
        let mut cloth = base;
        let setting = &mut cloth.settings[Parameter::MuS];
        if own[Parameter::MuS].fixed && own[Parameter::MuS].initial == 0.0 {
            *setting = Parameter::MuS.default_setting();
            all.push(Change { name: "with friction of the cloth", nested: 1, ..cloth });
        } else {
            (setting.initial, setting.lower, setting.fixed, setting.prior) = (0.0, 0.0, true, None);
            let nested = -i32::from(is_told(Parameter::MuS));
            all.push(Change { name: "without friction of the cloth", nested, ..cloth });
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_statistic_of_0_is_no_evidence() {
        assert_eq!((at_bound(0.0), at_bound(1e-9)), (1.0, 1.0));
        // half of the 5 % quantile's tail, 3.841 459
        assert!((at_bound(3.841_459) - 0.025).abs() < 1e-7);
    }
}
