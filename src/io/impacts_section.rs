//! `[impacts]` of dataset.toml: with what impacts were extracted from tracks.

use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::toml_file::Source;
use crate::measurement::dataset::{Measured, Shared};
use crate::measurement::valid::{NOT_NEGATIVE, POSITIVE};

/// With what impacts were extracted from tracks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Extraction {
    /// The table of joint errors.
    pub covariance: Option<PathBuf>,
    /// μ_k of the cloth with its standard deviation, where the impacts depend on it.
    pub sliding: Option<Measured>,
    /// Its μ_r likewise.
    pub rolling: Option<Measured>,
    /// Relative standard error that the lifts share.
    pub lift_sd: Option<f64>,
}

impl Extraction {
    /// What the shots share.
    pub(crate) fn shared(&self) -> Vec<Shared> {
        let is_shared = |shared: &Shared| match shared {
            Shared::Sliding => self.sliding.is_some(),
            Shared::Lift => self.lift_sd.is_some(),
            Shared::Rolling => self.rolling.is_some(),
            Shared::Camera(_) => false,
        };
        Shared::ALL.into_iter().filter(is_shared).collect()
    }
}

#[derive(Default, Deserialize)]
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
    pub(crate) fn check(&self, source: &Source) -> Extraction {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let both = [("mu_k", self.mu_k, self.mu_k_sd), ("mu_r", self.mu_r, self.mu_r_sd)];
        let [sliding, rolling] = both.map(|(name, value, sd)| {
            let [key, sd_key] = [format!("impacts.{name}"), format!("impacts.{name}_sd")];
            if value.is_some() != sd.is_some() {
                let message = format!("only one of {name} and {name}_sd in [impacts]; expected both or none");
                source.wrong_of_first(&[&key, &sd_key], message);
            }
            let sd = source.number(&sd_key, sd, POSITIVE);
            source.number(&key, value, NOT_NEGATIVE).map(|value| Measured { value, sd })
        });
        Extraction {
            covariance: self.covariance.as_ref().map(|name| folder.join(name)),
            sliding,
            rolling,
            lift_sd: source.number("impacts.lift_sd", self.lift_sd, POSITIVE),
        }
    }
}
