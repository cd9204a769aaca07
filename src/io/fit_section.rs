//! The section [fit] of a dataset.toml: settings of the parameters, the loss.

use schemars::JsonSchema;
use serde::Deserialize;

use super::toml_file::Source;
use crate::measurement::fault::Fault;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Compliance, Parameter, Prior, Setting, Settings};

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table, as in [fit] mu_s = { fixed = 0.3 }")]
pub(crate) struct FitSection {
    mu: Option<SettingSection>,
    mu_s: Option<SettingSection>,
    e: Option<SettingSection>,
    mu_b: Option<SettingSection>,
    mu_c: Option<SettingSection>,
    kappa: Option<SettingSection>,
    e_slope: Option<SettingSection>,
    friction: Friction,
    pub(crate) by: Option<String>,
    pub(crate) loss: Loss,
}

/// How the friction between the balls depends on their slip.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum Friction {
    #[default]
    Constant,
    /// μ + b exp(−c v).
    Exponential,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(
    deny_unknown_fields,
    expecting = "a table, as in { initial = 0.05, upper = 0.5 } or { fixed = 0.05 }"
)]
struct SettingSection {
    initial: Option<f64>,
    lower: Option<f64>,
    upper: Option<f64>,
    fixed: Option<f64>,
    prior_mean: Option<f64>,
    prior_sd: Option<f64>,
}

impl FitSection {
    /// Returns the setting of each parameter; `kappa` follows from the Poisson's ratio of the
    /// balls' material.
    pub(crate) fn settings(&self, kappa: f64, source: &Source) -> Settings {
        let falls = self.friction == Friction::Exponential;
        let mut settings = Settings { falls, ..Settings::default() };
        settings[Parameter::Kappa].initial = kappa;
        for (parameter, given) in [
            (Parameter::Mu, &self.mu),
            (Parameter::MuS, &self.mu_s),
            (Parameter::E, &self.e),
            (Parameter::B, &self.mu_b),
            (Parameter::C, &self.mu_c),
            (Parameter::Kappa, &self.kappa),
            (Parameter::ESlope, &self.e_slope),
        ] {
            let Some(given) = given else { continue };
            settings[parameter] = given.check(parameter, source);
            if matches!(parameter, Parameter::B | Parameter::C) && !settings.falls {
                let name = parameter.name();
                let message = format!(
                    "{name} stands in [fit], but friction is constant; expected friction = \"exponential\" with it"
                );
                source.wrong(&format!("fit.{name}"), message);
            }
        }
        if self.kappa.is_some() {
            let Setting { initial, fixed, .. } = settings[Parameter::Kappa];
            settings.compliance =
                if fixed && initial == 0.0 { Compliance::Rigid } else { Compliance::Stated };
        }
        settings.e_falls = self.e_slope.is_some();
        settings
    }
}

impl SettingSection {
    fn check(&self, parameter: Parameter, source: &Source) -> Setting {
        let name = parameter.name();
        // c is held by default only
        let default = Setting { fixed: false, ..parameter.default_setting() };
        let lower = self.lower.unwrap_or(default.lower);
        let upper = self.upper.unwrap_or(default.upper.max(lower));
        let prior = self.prior_mean.zip(self.prior_sd).map(|(mean, sd)| Prior { mean, sd });
        let setting = Setting {
            initial: self.fixed.or(self.initial).unwrap_or(default.initial.max(lower).min(upper)),
            lower,
            upper,
            fixed: self.fixed.is_some(),
            prior: prior.filter(|_| self.fixed.is_none()),
        };
        let key = |key: &str| format!("fit.{name}.{key}");
        for fault in setting.faults(parameter) {
            let own = format!("fit.{}", fault.key);
            let value = source.written(&own).map_or_else(|| fault.value.clone(), str::to_owned);
            // a default may contradict the stated value
            let keys = [own.as_str(), &key("upper"), &format!("fit.{name}")];
            source.wrong_of_first(&keys, Fault { value, ..fault }.to_string());
        }
        let of_prior = [self.prior_mean, self.prior_sd].iter().flatten().count();
        let message = match (self.fixed, of_prior) {
            (_, 0) | (None, 2) => None,
            (None, _) => Some("only one of prior_mean and prior_sd; expected both or none"),
            (Some(_), _) => Some("fixed, so that its prior has no effect; expected only one of both"),
        };
        if let Some(message) = message {
            source.wrong_of_first(&[&key("prior_mean"), &key("prior_sd")], format!("{name}: {message}"));
        }
        setting
    }
}
