//! `[impacts]` of dataset.toml: with what impacts were extracted from tracks.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use super::toml_file::{Condition, POSITIVE, Source};
use crate::measurement::dataset::{Measured, Shared};

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

const NOT_NEGATIVE: Condition = (|x| x >= 0.0, "0 or more");

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table, as in [impacts] covariance = \"covariance.csv\"")]
pub(crate) struct RawImpacts {
    covariance: Option<Spanned<String>>,
    mu_k: Option<Spanned<f64>>,
    mu_k_sd: Option<Spanned<f64>>,
    mu_r: Option<Spanned<f64>>,
    mu_r_sd: Option<Spanned<f64>>,
    lift_sd: Option<Spanned<f64>>,
}

impl RawImpacts {
    pub(crate) fn check(&self, source: &Source) -> Extraction {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let number = |key: &str, given: &Spanned<f64>, condition: Condition| {
            source.number(Some(given), &format!("impacts.{key}"), 0.0, condition)
        };
        let mut alone = Vec::new();
        let lift_sd = self.lift_sd.as_ref().map(|sd| number("lift_sd", sd, POSITIVE));
        let both = [("mu_k", &self.mu_k, &self.mu_k_sd), ("mu_r", &self.mu_r, &self.mu_r_sd)];
        let [sliding, rolling] = both.map(|(key, value, sd)| match (value, sd) {
            (Some(value), Some(sd)) => {
                let sd = number(&format!("{key}_sd"), sd, POSITIVE);
                Some(Measured { value: number(key, value, NOT_NEGATIVE), sd: Some(sd) })
            }
            (Some(given), None) | (None, Some(given)) => {
                alone.push((given.span(), key));
                None
            }
            (None, None) => None,
        });
        for (span, key) in alone {
            let message = format!("only one of {key} and {key}_sd in [impacts]; expected both or none");
            source.wrong_at(&span, message);
        }
        let covariance = self.covariance.as_ref().map(|name| folder.join(name.as_ref()));
        Extraction { covariance, sliding, rolling, lift_sd }
    }
}
