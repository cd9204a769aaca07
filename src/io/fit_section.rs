//! The section [fit] of a dataset.toml: settings of the parameters, the loss.

use serde::Deserialize;
use toml::Spanned;

use super::error::did_you_mean;
use super::toml_file::{Source, bare};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Compliance, Parameter, Prior, Setting, SettingFault, Settings};

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [fit] mu_s = { fixed = 0.3 }")]
pub(crate) struct RawFit {
    mu: Option<RawSetting>,
    mu_s: Option<RawSetting>,
    e: Option<RawSetting>,
    mu_b: Option<Spanned<RawSetting>>,
    mu_c: Option<Spanned<RawSetting>>,
    kappa: Option<RawSetting>,
    e_slope: Option<RawSetting>,
    friction: Option<Friction>,
    pub by: Option<Spanned<String>>,
    loss: Option<Spanned<String>>,
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
    /// `kappa` follows from the Poisson's ratio of the balls' material.
    pub(crate) fn settings(&self, kappa: f64, source: &Source) -> Settings {
        let falls = self.friction == Some(Friction::Exponential);
        let mut settings = Settings { falls, ..Settings::default() };
        settings[Parameter::Kappa].initial = kappa;
        if let Some(raw) = &self.kappa {
            settings[Parameter::Kappa] = raw.check(Parameter::Kappa, source);
            let Setting { initial, fixed, .. } = settings[Parameter::Kappa];
            settings.compliance =
                if fixed && initial == 0.0 { Compliance::Rigid } else { Compliance::Stated };
        }
        if let Some(raw) = &self.e_slope {
            settings[Parameter::ESlope] = raw.check(Parameter::ESlope, source);
            settings.e_falls = true;
        }
        for (parameter, raw) in Parameter::COEFFICIENTS.into_iter().zip([&self.mu, &self.mu_s, &self.e]) {
            if let Some(raw) = raw {
                settings[parameter] = raw.check(parameter, source);
            }
        }
        for (parameter, raw) in [(Parameter::B, &self.mu_b), (Parameter::C, &self.mu_c)] {
            let Some(raw) = raw else { continue };
            settings[parameter] = raw.as_ref().check(parameter, source);
            if !settings.falls {
                let message = format!(
                    "{} stands in [fit], but friction is constant; expected friction = \"exponential\" with it",
                    parameter.name()
                );
                source.wrong(raw, message);
            }
        }
        settings
    }

    pub(crate) fn loss(&self, source: &Source) -> Loss {
        let Some(given) = &self.loss else { return Loss::default() };
        let (word, names) = (given.as_ref(), Loss::ALL.map(Loss::name));
        let found = Loss::ALL.into_iter().find(|loss| loss.name() == word);
        if found.is_none() {
            let (near, names) = (did_you_mean(word, names), names.join(", "));
            source.wrong(given, format!("loss is \"{word}\"{near}; expected one of {names}"));
        }
        found.unwrap_or_default()
    }
}

impl RawSetting {
    fn check(&self, parameter: Parameter, source: &Source) -> Setting {
        let name = parameter.name();
        // c is held only where nothing is said of it
        let default = Setting { fixed: false, ..parameter.default_setting() };
        let lower = bare(&self.lower).unwrap_or(default.lower);
        let upper = bare(&self.upper).unwrap_or(default.upper.max(lower));
        let prior = bare(&self.prior_mean).zip(bare(&self.prior_sd)).map(|(mean, sd)| Prior { mean, sd });
        let said = bare(&self.fixed).or(bare(&self.initial));
        let setting = Setting {
            initial: said.unwrap_or(default.initial.max(lower).min(upper)),
            lower,
            upper,
            fixed: self.fixed.is_some(),
            prior: prior.filter(|_| self.fixed.is_none()),
        };
        let faults = setting.faults(parameter);
        for SettingFault { key, value, rest } in &faults {
            let (lower, upper) = (self.lower.as_ref(), self.upper.as_ref());
            let spanned = match *key {
                "lower" => lower.or(upper),
                "upper" => upper,
                "fixed" => self.fixed.as_ref(),
                "initial" => self.initial.as_ref(),
                "prior_mean" => self.prior_mean.as_ref(),
                _ => self.prior_sd.as_ref(),
            };
            let of_default = format!("{value:?}");
            let written = spanned.filter(|s| *s.as_ref() == *value || value.is_nan());
            let written = written.map_or(of_default, |spanned| source.written(&spanned.span()).to_string());
            let near = matches!(*key, "initial" | "fixed")
                && upper.is_none()
                && rest.ends_with("its bounds")
                && parameter != Parameter::E;
            let hint =
                if near { format!(" (give {name}.upper to move the upper one)") } else { String::new() };
            let at = spanned.map_or(0..0, Spanned::span);
            source.wrong_at(&at, format!("{name}.{key} is {written}{rest}{hint}"));
        }
        if let (Some(_), Some(prior)) = (&self.fixed, self.prior_mean.as_ref().or(self.prior_sd.as_ref())) {
            let message =
                format!("{name} is fixed, so that its prior says nothing; expected only one of them");
            source.wrong(prior, message);
        }
        if let (Some(given), None) | (None, Some(given)) = (&self.prior_mean, &self.prior_sd) {
            source
                .wrong(given, format!("{name}: only one of prior_mean and prior_sd; expected both or none"));
        }
        if faults.is_empty() { setting } else { default }
    }
}
