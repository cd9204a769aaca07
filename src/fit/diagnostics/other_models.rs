//! Other models on the same data: is what the fit assumes needed, and is it enough?
//!
//! Noise that the data do not state is estimated by maximum likelihood for each model anew and counts as
//! a parameter.
//!
//! - Akaike, H. (1974), IEEE Trans. Autom. Control 19, 716–723; Schwarz, G. (1978), Ann. Stat. 6, 461–464.
//! - Self, S. G. and Liang, K.-Y. (1987), J. Am. Stat. Assoc. 82, 605–610: a likelihood ratio at a bound.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::fit::FitError;
use crate::fit::samples::Search;
use crate::fit::settled::Settled;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::Sample;
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::values::Values;
use crate::physics::collision::{Fidelity, Model};
use crate::physics::friction_law::Law;

/// Another model fitted to the data of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// How it differs from the fit; the fit itself comes first.
    pub name: &'static str,
    /// Why it could not be fitted, where it could not.
    pub failed: Option<String>,
    /// The estimates of all parameters that it has.
    pub values: Vec<(Parameter, f64)>,
    /// How many parameters and standard deviations were estimated.
    pub parameters: usize,
    /// Akaike's criterion less that of the fit: negative speaks for this model.
    pub delta_aic: f64,
    /// Schwarz's criterion (BIC) less that of the fit: negative speaks for this model.
    pub delta_bic: f64,
    /// The test of one model against the other, where one of the two is the other with a parameter held.
    pub likelihood_ratio: Option<LikelihoodRatio>,
}

/// A test of two models by the ratio of their likelihoods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LikelihoodRatio {
    /// Twice the logarithm of the ratio of likelihoods.
    pub statistic: f64,
    /// The probability of a larger one if the smaller model is right.
    pub p_value: f64,
}

/// What differs from the fit.
#[derive(Clone)]
struct Change {
    name: &'static str,
    fidelity: Fidelity,
    law: Law,
    /// Whether it is that of every shot, in the place of what was chosen for each.
    everywhere: bool,
    settings: Settings,
    /// 1 where the change is one more parameter, −1 where one less, 0 where neither contains the other.
    nested: i32,
}

/// The fit, then the other models.
pub(in crate::fit) fn compare(search: &Search, settled: &Settled) -> Vec<Alternative> {
    let mut alternatives: Vec<Alternative> = Vec::new();
    let mut of_fit = None;
    for change in changes(search, settled) {
        let found = fitted(search, &change, settled);
        let found = match (found, of_fit) {
            (Ok(found), _) => found,
            (Err(_), None) => return Vec::new(),
            (Err(error), Some(_)) => {
                alternatives.push(Alternative {
                    name: change.name,
                    failed: Some(error.to_string()),
                    values: change.settings.parameters().iter().map(|p| (*p, f64::NAN)).collect(),
                    parameters: 0,
                    delta_aic: f64::NAN,
                    delta_bic: f64::NAN,
                    likelihood_ratio: None,
                });
                continue;
            }
        };
        let base: (f64, usize) = *of_fit.get_or_insert((found.minus_two_log, found.parameters));
        let n = search.observations() as f64;
        let (rise, more) = (found.minus_two_log - base.0, found.parameters as f64 - base.1 as f64);
        let likelihood_ratio = (change.nested != 0).then(|| {
            let statistic = (-f64::from(change.nested) * rise).max(0.0);
            LikelihoodRatio { statistic, p_value: at_bound(statistic) }
        });
        alternatives.push(Alternative {
            name: change.name,
            failed: None,
            values: found.values,
            parameters: found.parameters,
            delta_aic: rise + 2.0 * more,
            delta_bic: rise + n.ln() * more,
            likelihood_ratio,
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

fn changes(search: &Search, settled: &Settled) -> Vec<Change> {
    let sample = search.first();
    let &Model { fidelity, law, .. } = sample.model;
    let settings = *sample.settings;
    let fit = Change { name: "as fitted", fidelity, law, everywhere: false, settings, nested: 0 };
    let corrected = search.shots().any(|shot| shot.plan.is_corrected());
    let others: &[Fidelity] = match fidelity {
        Fidelity::Full if corrected => &[Fidelity::Full, Fidelity::Linear],
        Fidelity::Full => &[Fidelity::Linear],
        _ => &[Fidelity::Full],
    };
    let mut changes = vec![fit.clone()];
    for other in others {
        changes.push(Change { name: other.name(), fidelity: *other, everywhere: true, ..fit.clone() });
    }
    if !fidelity.effects().friction {
        return changes;
    }
    changes.extend(other_law(search, settled, &fit));
    if search.shots().any(|shot| shot.plan.has_topspin()) {
        let own = settings[Parameter::MuS];
        let mut changed = settings;
        if own.fixed && own.initial == 0.0 {
            changed[Parameter::MuS] = Parameter::MuS.default_setting();
            changes.push(Change { name: "with friction of the cloth", settings: changed, nested: 1, ..fit });
        } else {
            let setting = &mut changed[Parameter::MuS];
            (setting.initial, setting.lower, setting.fixed, setting.prior) = (0.0, 0.0, true, None);
            let told = is_free(settled, Parameter::MuS) && own.prior.is_none();
            let nested = if told { -1 } else { 0 };
            changes.push(Change { name: "without friction of the cloth", settings: changed, nested, ..fit });
        }
    }
    changes
}

/// A friction that falls with the slip in the place of a constant one, or the other way round.
fn other_law(search: &Search, settled: &Settled, fit: &Change) -> Option<Change> {
    let mut settings = fit.settings;
    if fit.law != Law::Constant {
        settings.falls = false;
        let [b, c] = [Parameter::B, Parameter::C].map(|p| fit.settings[p]);
        // without b nothing depends on c: the ratio then has no known distribution
        let told = fit.settings.falls && is_free(settled, Parameter::B) && c.fixed;
        let nested = if told && b.lower == 0.0 && b.prior.is_none() { -1 } else { 0 };
        return Some(Change {
            name: "constant friction",
            law: Law::Constant,
            settings,
            nested,
            ..fit.clone()
        });
    }
    // of frames only where they do not fit (`causes`), and without a speed nothing is known of the slip
    if search.is_filmed() || !search.shots().all(|shot| shot.plan.knows_speed()) {
        return None;
    }
    settings.falls = true;
    for parameter in [Parameter::B, Parameter::C] {
        settings[parameter] = parameter.default_setting();
    }
    let (b, c) = (settings[Parameter::B].initial, settings[Parameter::C].initial);
    let law = Law::Exponential { b, c };
    Some(Change { name: "friction falling with the slip", law, settings, nested: 1, ..fit.clone() })
}

/// Whether a parameter is free and determined.
fn is_free(settled: &Settled, parameter: Parameter) -> bool {
    settled.free.iter().any(|unknown| unknown.parameter == parameter)
}

struct Found {
    values: Vec<(Parameter, f64)>,
    minus_two_log: f64,
    parameters: usize,
}

fn fitted(search: &Search, change: &Change, fit: &Settled) -> Result<Found, FitError> {
    let sample = search.first();
    let model = Model { fidelity: change.fidelity, law: change.law, ..*sample.model };
    let plain: Vec<Fitted>;
    let fitted = if change.everywhere {
        plain = search.shots().map(|shot| Fitted { plan: shot.plan.plain(), ..shot.clone() }).collect();
        &plain
    } else {
        sample.fitted
    };
    let mut sample = Sample { fitted, model: &model, settings: &change.settings, ..sample.clone() };
    for parameter in change.settings.parameters().iter().copied().filter(|p| change.settings[*p].fixed) {
        sample.initial[parameter] = change.settings[parameter].initial;
    }
    let initial = sample.initial;
    let search = Search::of(sample).likeliest();
    // another law of friction may have its minimum elsewhere; the other changes are small
    let of_fit = fit.search.first();
    let settled = if change.law == of_fit.model.law {
        let mut start = *fit.minimum.first();
        for parameter in Parameter::COEFFICIENTS.into_iter().filter(|p| of_fit.settings[*p].fixed) {
            start[parameter] = initial[parameter];
        }
        Settled::from_starts(&search, &[vec![start]])
    } else if search.shots().any(|shot| shot.plan.has_uncertain_inputs()) {
        // what the inputs truly were makes χ² even, and a scan slow
        Settled::from_starts(&search, &frictions_like(fit.minimum.first(), &initial, change.law))
    } else {
        Settled::new(&search)
    }?;
    Ok(Found {
        values: change.settings.parameters().iter().map(|p| (*p, settled.minimum.first()[*p])).collect(),
        minus_two_log: settled.search.minus_two_log_likelihood(&settled.minimum, &settled.estimated),
        parameters: settled.minimum.parameters() + settled.estimated.len(),
    })
}

/// Values of the friction under another law: constant, that of the fit at slips from slow to fast; falling, as large where
/// the balls slip at a usual speed.
fn frictions_like(fit: &Values, initial: &Values, law: Law) -> Vec<Vec<Values>> {
    /// m/s
    const USUAL_SLIP: f64 = 1.0;
    /// How much of the friction there falls with the slip.
    const PARTS: [f64; 3] = [0.1, 0.5, 0.9];
    let start = |part: f64| {
        let mut start = *fit;
        if law == Law::Constant {
            start[Parameter::Mu] += part * fit[Parameter::B];
        } else {
            start[Parameter::C] = initial[Parameter::C];
            start[Parameter::B] = part * fit[Parameter::Mu] * (start[Parameter::C] * USUAL_SLIP).exp();
            start[Parameter::Mu] *= 1.0 - part;
        }
        vec![start]
    };
    PARTS.iter().map(|part| start(*part)).collect()
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
