//! Fits read back from the disk: fit.json as `caromfit fit` writes it, for [`crate::report::regression`] and
//! [`crate::report::export`].

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

/// The part of a fit.json that is read back, in SI units.
#[derive(Clone, Debug, Deserialize)]
pub struct StoredFit {
    /// The name of the data set.
    pub dataset: String,
    /// The label whose shots were fitted apart, where there is one (`[fit] by`).
    pub group: Option<StoredGroup>,
    /// The cue ball, or the first of two discs; files of the first versions lack it.
    pub ball: Option<StoredBall>,
    /// The second of two discs, or the object ball where it was stated to differ from the cue ball.
    pub object: Option<StoredBall>,
    /// Where the data contradict the model, the reason; the estimates then have no errors.
    pub refuted: Option<StoredRefuted>,
    /// The cloth's sliding friction μ_k, where footage determined it.
    pub mu_k: Option<StoredEstimate>,
    /// The name of the fidelity, as [`Fidelity::name`](crate::physics::collision::Fidelity::name) gives it.
    pub fidelity: String,
    /// The parameters by their names in dataset.toml: mu, mu_s and e, and those that the fit had besides.
    pub parameters: BTreeMap<String, StoredParameter>,
    /// χ² of the fit; `None` where the file has none.
    pub chi2: Option<f64>,
    /// Degrees of freedom.
    pub dof: usize,
    /// How many shots were fitted.
    pub shots_used: usize,
    /// Warnings, in sentences.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// Why data contradict the model.
#[derive(Clone, Debug, Deserialize)]
pub struct StoredRefuted {
    /// The reason, as a sentence.
    pub sentence: String,
    /// The restitution e that was measured without the model, where it was.
    pub measured_e: Option<StoredEstimate>,
}

/// A label whose shots were fitted apart.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
pub struct StoredGroup {
    /// The column of the labels.
    pub column: String,
    /// The label.
    pub label: String,
}

/// A ball or a disc.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct StoredBall {
    /// Its radius, m.
    pub radius_m: f64,
    /// Its mass, kg; `None` for discs whose masses are not stated.
    pub mass_kg: Option<f64>,
    /// Its moment of inertia over MR², ν.
    pub inertia: f64,
    /// The standard deviation of its radius, m, where one was stated.
    #[serde(default)]
    pub radius_m_sd: Option<f64>,
    /// The standard deviation of its mass, kg, where one was stated.
    #[serde(default)]
    pub mass_kg_sd: Option<f64>,
}

/// A number that was estimated.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct StoredEstimate {
    /// The estimate.
    pub estimate: f64,
    /// Its standard error, where it has one.
    pub std_error: Option<f64>,
}

/// A parameter of a fit.
#[derive(Clone, Debug, Deserialize)]
pub struct StoredParameter {
    /// The estimate, or the value that the parameter was held at.
    pub estimate: f64,
    /// Its standard error; `None` for one that is fixed or not identified.
    pub std_error: Option<f64>,
    /// The lower and upper end of the interval of 95 % confidence.
    pub interval_95: Option<[f64; 2]>,
    /// `free`, `fixed`, `at-lower-bound`, `at-upper-bound` or `not-identified`.
    pub status: String,
    /// Where every value from the first to the second fits equally: the edge, which is a bound of the parameter, and the other end.
    #[serde(default)]
    pub plateau: Option<[f64; 2]>,
}

/// Why the estimate of a parameter is not a value but a bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OnlyBound {
    /// All values from this one on fit equally.
    AtLeast(f64),
    /// All values up to this one fit equally.
    AtMost(f64),
    /// The fit ended at the lower end of the range that the parameter may have.
    LowerEnd(f64),
    /// The fit ended at the upper end of that range.
    UpperEnd(f64),
}

impl StoredParameter {
    /// The bound that stands in the place of an estimate; `None` if the estimate is a value.
    #[must_use]
    pub fn only_bound(&self) -> Option<OnlyBound> {
        match (self.plateau, self.status.as_str()) {
            (Some([edge, end]), "free") if end >= edge => Some(OnlyBound::AtLeast(edge)),
            (Some([edge, _]), "free") => Some(OnlyBound::AtMost(edge)),
            (_, "at-lower-bound") => Some(OnlyBound::LowerEnd(self.estimate)),
            (_, "at-upper-bound") => Some(OnlyBound::UpperEnd(self.estimate)),
            _ => None,
        }
    }
}

/// Why stored fits cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoredError {
    /// A file or folder cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Why it cannot be read.
        source: std::io::Error,
    },
    /// A file is no fit.json.
    #[error("{}:{}: column {}: {source}; expected a fit.json that caromfit fit wrote", path.display(), source.line(), source.column())]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and in which line and column.
        source: serde_json::Error,
    },
    /// There is no fit.json at or below the path.
    #[error("{}: holds no fit.json; expected one, or a folder that caromfit fit wrote", path.display())]
    None {
        /// The path.
        path: PathBuf,
    },
}

/// Reads a fit.json, an array of them (as `caromfit fit --json` prints it), or all below a folder.
///
/// # Errors
/// What cannot be read or is no fit.json, with line and column.
pub fn read(path: &Path) -> Result<Vec<StoredFit>, StoredError> {
    let mut fits = Vec::new();
    gather(path, &mut fits)?;
    if fits.is_empty() { Err(StoredError::None { path: path.to_path_buf() }) } else { Ok(fits) }
}

fn gather(path: &Path, fits: &mut Vec<StoredFit>) -> Result<(), StoredError> {
    let failed = |source| StoredError::Read { path: path.to_path_buf(), source };
    if path.is_dir() {
        let own = path.join("fit.json");
        if own.is_file() {
            return gather(&own, fits);
        }
        let entries: Result<Vec<_>, _> = fs::read_dir(path).map_err(failed)?.collect();
        let mut folders: Vec<PathBuf> = entries.map_err(failed)?.iter().map(fs::DirEntry::path).collect();
        folders.retain(|folder| folder.is_dir());
        folders.sort();
        return folders.iter().try_for_each(|folder| gather(folder, fits));
    }
    let text = fs::read_to_string(path).map_err(failed)?;
    let json = |source| StoredError::Json { path: path.to_path_buf(), source };
    if text.trim_start().starts_with('[') {
        fits.append(&mut serde_json::from_str(&text).map_err(json)?);
    } else {
        fits.push(serde_json::from_str(&text).map_err(json)?);
    }
    Ok(())
}
