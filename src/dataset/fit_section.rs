//! The section [fit] of a dataset.toml: settings of the parameters, constraints between them, the loss.

use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use super::error::{Problems, did_you_mean};
use super::toml_file::Source;
use crate::loss::Loss;
use crate::parameters::{Parameter, Prior, Setting, Settings};
use crate::relation::Relation;

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [fit] mu_s = { fixed = 0.3 }")]
pub(super) struct RawFit {
    mu: Option<RawSetting>,
    mu_s: Option<RawSetting>,
    e: Option<RawSetting>,
    mu_b: Option<Spanned<RawSetting>>,
    mu_c: Option<Spanned<RawSetting>>,
    friction: Option<Friction>,
    pub by: Option<Spanned<String>>,
    loss: Option<Spanned<String>>,
    #[serde(default)]
    constraints: Vec<Spanned<String>>,
}

/// How the friction between the balls depends on their slip.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Friction {
    #[default]
    Constant,
    /// μ + b exp(−c v).
    Exponential,
}

#[derive(Default, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a table, as in { initial = 0.05, upper = 0.5 } or { fixed = 0.05 }"
)]
struct RawSetting {
    initial: Option<Spanned<f64>>,
    lower: Option<Spanned<f64>>,
    upper: Option<Spanned<f64>>,
    fixed: Option<Spanned<f64>>,
    prior_mean: Option<Spanned<f64>>,
    prior_sd: Option<Spanned<f64>>,
}

impl RawFit {
    /// Of each parameter.
    pub(super) fn settings(&self, source: &Source, problems: &mut Problems) -> Settings {
        let falls = self.friction == Some(Friction::Exponential);
        let mut settings = Settings { falls, ..Settings::default() };
        for (parameter, raw) in Parameter::COEFFICIENTS.into_iter().zip([&self.mu, &self.mu_s, &self.e]) {
            if let Some(raw) = raw {
                settings[parameter] = raw.check(parameter, source, problems);
            }
        }
        for (parameter, raw) in [(Parameter::B, &self.mu_b), (Parameter::C, &self.mu_c)] {
            let Some(raw) = raw else { continue };
            settings[parameter] = raw.as_ref().check(parameter, source, problems);
            if !settings.falls {
                let message = format!(
                    "{} stands in [fit], but friction is constant; expected friction = \"exponential\" with it",
                    parameter.name()
                );
                source.add(problems, &raw.span(), message);
            }
        }
        settings
    }

    pub(super) fn relations(&self, falls: bool, source: &Source, problems: &mut Problems) -> Vec<Relation> {
        let mut relations = Vec::new();
        for text in &self.constraints {
            match Relation::parse(text.as_ref()) {
                Ok(relation) => {
                    let of_law = [Parameter::B, Parameter::C];
                    let involved = of_law.into_iter().find(|p| relation.coefficients[*p as usize] != 0.0);
                    if let Some(parameter) = involved.filter(|_| !falls) {
                        let message = format!(
                            "the constraint \"{}\" has {}, but friction is constant; expected friction = \
                             \"exponential\" with it",
                            text.as_ref(),
                            parameter.name()
                        );
                        source.add(problems, &text.span(), message);
                    }
                    relations.push(relation);
                }
                Err(error) => {
                    let message = format!("the constraint \"{}\": {error}", text.as_ref());
                    source.add(problems, &text.span(), message);
                }
            }
        }
        relations
    }

    pub(super) fn loss(&self, source: &Source, problems: &mut Problems) -> Loss {
        let Some(word) = &self.loss else { return Loss::default() };
        let found = Loss::ALL.into_iter().find(|loss| loss.name() == word.as_ref());
        found.unwrap_or_else(|| {
            let near = did_you_mean(word.as_ref(), Loss::ALL.map(Loss::name));
            let names = Loss::ALL.map(Loss::name).join(", ");
            let message = format!("loss is \"{}\"{near}; expected one of {names}", word.as_ref());
            source.add(problems, &word.span(), message);
            Loss::default()
        })
    }
}

impl RawSetting {
    fn check(&self, parameter: Parameter, source: &Source, problems: &mut Problems) -> Setting {
        let name = parameter.name();
        // c is held only where nothing is said of it
        let mut setting = Setting { fixed: false, ..parameter.default_setting() };
        let widest = match parameter {
            Parameter::E => 1.0,
            _ => f64::INFINITY,
        };
        let allowed = if widest == 1.0 { "0 to 1" } else { "0 or more" };
        let mut value = |key: &str, value: &Option<Spanned<f64>>, range: bool| -> Option<f64> {
            let spanned = value.as_ref()?;
            let number = *spanned.as_ref();
            let good = number.is_finite() && (!range || (0.0..=widest).contains(&number));
            if !good {
                let expected = if range { allowed } else { "a finite number" };
                source.add(
                    problems,
                    &spanned.span(),
                    format!("{name}.{key} is {}; expected {expected}", source.written(&spanned.span())),
                );
            }
            good.then_some(number)
        };
        let (lower, upper) = (value("lower", &self.lower, true), value("upper", &self.upper, true));
        let (initial, fixed) = (value("initial", &self.initial, true), value("fixed", &self.fixed, true));
        let (mean, sd) =
            (value("prior_mean", &self.prior_mean, false), value("prior_sd", &self.prior_sd, false));
        setting.lower = lower.unwrap_or(setting.lower);
        setting.upper = upper.unwrap_or(setting.upper.max(setting.lower));
        let span = |value: &Option<Spanned<f64>>| value.as_ref().map(Spanned::span);
        let mut wrong = |at: Option<Range<usize>>, message: String| {
            source.add(problems, &at.unwrap_or(0..0), message);
        };
        let Setting { lower, upper, .. } = setting;
        if lower > upper {
            let at = span(&self.lower).or(span(&self.upper));
            wrong(
                at,
                format!("{name}.lower is {lower:?}, above {name}.upper, {upper:?}; expected lower ≤ upper"),
            );
            return setting;
        }
        let bounds = format!(
            "{lower:?} to {upper:?}, its bounds{}",
            if self.upper.is_none() && widest > upper {
                format!(" (give {name}.upper to move the upper one)")
            } else {
                String::new()
            }
        );
        setting.initial = setting.initial.clamp(lower, upper);
        if let Some(initial) = initial {
            setting.initial = initial;
            if !(lower..=upper).contains(&initial) {
                let message = format!("{name}.initial is {initial:?}; expected {bounds}");
                wrong(span(&self.initial), message);
            }
        }
        if let Some(fixed) = fixed {
            setting.initial = fixed;
            setting.fixed = true;
            if !(lower..=upper).contains(&fixed) {
                let message = format!("{name}.fixed is {fixed:?}; expected {bounds}");
                wrong(span(&self.fixed), message);
            }
        }
        if let (Some(_), Some(prior)) = (&self.fixed, self.prior_mean.as_ref().or(self.prior_sd.as_ref())) {
            let message =
                format!("{name} is fixed, so that its prior says nothing; expected only one of them");
            wrong(Some(prior.span()), message);
        }
        match (&self.prior_mean, &self.prior_sd) {
            (Some(given), None) | (None, Some(given)) => {
                wrong(
                    Some(given.span()),
                    format!("{name}: only one of prior_mean and prior_sd; expected both or none"),
                );
            }
            (Some(_), Some(spanned)) => {
                if sd.is_some_and(|sd| sd <= 0.0) {
                    let text = source.written(&spanned.span());
                    let message = format!("{name}.prior_sd is {text}; expected more than 0");
                    wrong(Some(spanned.span()), message);
                } else if let (Some(mean), Some(sd)) = (mean, sd) {
                    setting.prior = Some(Prior { mean, sd });
                }
            }
            (None, None) => {}
        }
        setting
    }
}
