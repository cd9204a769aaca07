//! The section [fit] of a dataset.toml: settings of the parameters, the loss.

use schemars::JsonSchema;
use serde::Deserialize;

use super::toml_file::Source;
use crate::measurement::fault::Fault;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Compliance, Parameter, Prior, Setting, Settings};

#[derive(Default, Deserialize, JsonSchema)]
#[serde(default)]
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
#[schemars(extend("dependentRequired" = { "prior_mean": ["prior_sd"], "prior_sd": ["prior_mean"] }))]
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
        let mut settings = Settings { falls, e_falls: self.e_slope.is_some(), ..Settings::default() };
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
            if let Some(given) = given {
                settings[parameter] = given.check(parameter, source);
            }
        }
        settings.compliance = match &self.kappa {
            None => Compliance::Auto,
            Some(kappa) if kappa.fixed == Some(0.0) => Compliance::Rigid,
            Some(_) => Compliance::Stated,
        };
        settings
    }
}

impl SettingSection {
    fn check(&self, parameter: Parameter, source: &Source) -> Setting {
        let default = parameter.default_setting();
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
        let name = parameter.name();
        for fault in setting.faults(parameter) {
            let key = format!("fit.{}", fault.key);
            let written = Some(source.written(&key)).filter(|text| !text.is_empty());
            let value = written.unwrap_or(&fault.value).to_owned();
            // a default may contradict the stated value
            source.wrong(&format!("{key} fit.{name}.upper"), Fault { value, ..fault }.to_string());
        }
        if self.fixed.is_some() && prior.is_some() {
            let message =
                format!("{name}: fixed, so that its prior has no effect; expected only one of both");
            source.wrong(&format!("fit.{name}.prior_mean"), message);
        }
        setting
    }
}
