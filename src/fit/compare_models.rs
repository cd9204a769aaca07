//! Other models on the same data: is what the fit assumes needed, and is it enough?
//!
//! Noise that the data do not state is estimated by maximum likelihood for each model anew and counts as
//! a parameter.
//!
//! - Akaike, H. (1974), IEEE Trans. Autom. Control 19, 716–723; Schwarz, G. (1978), Ann. Stat. 6, 461–464.
//! - Self, S. G. and Liang, K.-Y. (1987), J. Am. Stat. Assoc. 82, 605–610: a likelihood ratio at a bound.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::FitError;
use super::run::{Settled, observations};
use super::search::Search;
use crate::collision::{Fidelity, Model};
use crate::parameters::{Parameter, Settings};
use crate::residuals::{Fitted, parameter_mut};

/// One model on the data of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// What is different from the fit, which comes first.
    pub name: &'static str,
    /// Why it could not be fitted.
    pub failed: Option<String>,
    /// Estimates, in the order of [`Parameter::ALL`].
    pub values: [f64; Parameter::ALL.len()],
    /// Fitted parameters and estimated standard deviations.
    pub parameters: usize,
    /// Akaike's and Schwarz's criterion less that of the fit: negative speaks for this model.
    pub delta_aic: f64,
    pub delta_bic: f64,
    /// Where one of the two models is the other with a parameter held.
    pub likelihood_ratio: Option<LikelihoodRatio>,
}

/// Twice the logarithm of the ratio of likelihoods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LikelihoodRatio {
    pub statistic: f64,
    /// Probability of a larger one if the smaller model is right.
    pub p_value: f64,
}

/// What differs from the fit.
struct Change {
    name: &'static str,
    fidelity: Fidelity,
    /// Whether it is that of every shot, in the place of what was chosen for each.
    everywhere: bool,
    settings: Settings,
    /// 1 where the change is one more parameter, −1 where one less, 0 where neither contains the other.
    nested: i32,
}

/// The fit, then the other models.
pub(super) fn compare(search: &Search, settled: &Settled) -> Vec<Alternative> {
    let mut alternatives: Vec<Alternative> = Vec::new();
    let mut of_fit = None;
    for change in changes(search, settled) {
        let found = fitted(search, &change);
        let found = match (found, of_fit) {
            (Ok(found), _) => found,
            (Err(_), None) => return Vec::new(),
            (Err(error), Some(_)) => {
                alternatives.push(Alternative {
                    name: change.name,
                    failed: Some(error.to_string()),
                    values: [f64::NAN; Parameter::ALL.len()],
                    parameters: 0,
                    delta_aic: f64::NAN,
                    delta_bic: f64::NAN,
                    likelihood_ratio: None,
                });
                continue;
            }
        };
        let base: (f64, usize) = *of_fit.get_or_insert((found.minus_two_log, found.parameters));
        let n = observations(search.fitted) as f64;
        let (rise, more) = (found.minus_two_log - base.0, found.parameters as f64 - base.1 as f64);
        let likelihood_ratio = (change.nested != 0).then(|| {
            let statistic = (-f64::from(change.nested) * rise).max(0.0);
            let tail = ChiSquared::new(1.0).map_or(f64::NAN, |d| d.sf(statistic));
            // the parameter is held at its bound 0: half the time it would stay there by itself
            LikelihoodRatio { statistic, p_value: 0.5 * tail }
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

fn changes(search: &Search, settled: &Settled) -> Vec<Change> {
    let fidelity = search.model.fidelity;
    let settings = *search.settings;
    let fit = Change { name: "as fitted", fidelity, everywhere: false, settings, nested: 0 };
    let corrected = search.fitted.iter().any(|shot| shot.plan.is_corrected());
    let others: &[Fidelity] = match fidelity {
        Fidelity::Full if corrected => &[Fidelity::Full, Fidelity::Linear],
        Fidelity::Full => &[Fidelity::Linear],
        _ => &[Fidelity::Full],
    };
    let other = |fidelity: &Fidelity| Change {
        name: fidelity.name(),
        fidelity: *fidelity,
        everywhere: true,
        settings,
        nested: 0,
    };
    let mut changes: Vec<Change> = std::iter::once(fit).chain(others.iter().map(other)).collect();
    let frictional = fidelity.effects().friction;
    let topspin = search.fitted.iter().any(|shot| shot.plan.has_topspin());
    if frictional && topspin {
        let own = settings[Parameter::MuS];
        let mut changed = settings;
        if own.fixed && own.initial == 0.0 {
            changed[Parameter::MuS] = Parameter::MuS.default_setting();
            changes.push(Change {
                name: "with friction of the cloth",
                fidelity,
                everywhere: false,
                settings: changed,
                nested: 1,
            });
        } else {
            let setting = &mut changed[Parameter::MuS];
            (setting.initial, setting.lower, setting.fixed, setting.prior) = (0.0, 0.0, true, None);
            let told = settled.free.contains(&Parameter::MuS) && own.prior.is_none();
            let nested = if told { -1 } else { 0 };
            changes.push(Change {
                name: "without friction of the cloth",
                fidelity,
                everywhere: false,
                settings: changed,
                nested,
            });
        }
    }
    changes
}

struct Found {
    values: [f64; Parameter::ALL.len()],
    minus_two_log: f64,
    parameters: usize,
}

fn fitted(search: &Search, change: &Change) -> Result<Found, FitError> {
    let model = Model { fidelity: change.fidelity, ..*search.model };
    let plain: Vec<Fitted>;
    let shots = if change.everywhere {
        plain = search.fitted.iter().map(|shot| Fitted { plan: shot.plan.plain(), ..shot.clone() }).collect();
        &plain
    } else {
        search.fitted
    };
    let mut search = Search {
        fitted: shots,
        model: &model,
        settings: &change.settings,
        maximum_likelihood: true,
        ..search.clone()
    };
    for parameter in Parameter::ALL.into_iter().filter(|p| change.settings[*p].fixed) {
        *parameter_mut(&mut search.initial, parameter) = change.settings[parameter].initial;
    }
    let settled = Settled::new(&search)?;
    Ok(Found {
        values: Parameter::ALL.map(|p| *parameter_mut(&mut settled.minimum.coefficients.clone(), p)),
        minus_two_log: settled.search.minus_two_log_likelihood(&settled.minimum, &settled.estimated),
        parameters: settled.minimum.room() + settled.estimated.len(),
    })
}
