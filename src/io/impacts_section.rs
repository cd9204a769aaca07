//! `[impacts]` of dataset.toml: the settings with which impacts were extracted from tracks.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;

use super::toml_file::Source;
use crate::measurement::dataset::{Dataset, Measured};
use crate::measurement::valid::{NOT_NEGATIVE, POSITIVE};

#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "a table, as in [impacts] covariance = \"covariance.csv\"")]
pub(crate) struct ImpactsSection {
    covariance: Option<String>,
    mu_k: Option<f64>,
    mu_k_sd: Option<f64>,
    mu_r: Option<f64>,
    mu_r_sd: Option<f64>,
    lift_sd: Option<f64>,
}

impl ImpactsSection {
    /// Adds these settings to a data set; returns the path of the table of joint errors.
    pub(crate) fn check(&self, dataset: &mut Dataset, source: &Source) -> Option<PathBuf> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let both = [("mu_k", self.mu_k, self.mu_k_sd), ("mu_r", self.mu_r, self.mu_r_sd)];
        [dataset.sliding, dataset.rolling] = both.map(|(name, value, sd)| {
            let [key, sd_key] = [format!("impacts.{name}"), format!("impacts.{name}_sd")];
            if value.is_some() != sd.is_some() {
                let message = format!("only one of {name} and {name}_sd in [impacts]; expected both or none");
                source.wrong_of_first(&[&key, &sd_key], message);
            }
            let sd = source.number(&sd_key, sd, POSITIVE);
            source.number(&key, value, NOT_NEGATIVE).map(|value| Measured { value, sd })
        });
        dataset.lift_sd = source.number("impacts.lift_sd", self.lift_sd, POSITIVE);
        self.covariance.as_ref().map(|name| folder.join(name))
    }
}
