//! Fits read back from the disk: fit.json as `caromfit fit` writes it, for [`crate::report::regression`] and
//! [`crate::report::export`].

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

/// What of a fit.json is used again. SI units.
#[derive(Clone, Debug, Deserialize)]
pub struct StoredFit {
    pub dataset: String,
    /// The label that was fitted apart.
    pub group: Option<StoredGroup>,
    /// Missing from files of the first versions.
    pub ball: Option<StoredBall>,
    /// The second of two discs.
    pub object: Option<StoredBall>,
    /// Where the data refute the model, why; its estimates are then without errors.
    pub refuted: Option<StoredRefuted>,
    /// The cloth's sliding friction, where footage told it.
    pub mu_k: Option<StoredEstimate>,
    pub fidelity: String,
    /// By name: mu, mu_s, e; where friction falls with the slip also mu_b and mu_c.
    pub parameters: BTreeMap<String, StoredParameter>,
    pub chi2: Option<f64>,
    pub dof: usize,
    pub shots_used: usize,
    #[serde(default)]
    pub warnings: Vec<String>,
}

#[derive(Clone, Debug, Deserialize)]
pub struct StoredRefuted {
    pub sentence: String,
    /// The restitution that was measured without the model, where it was.
    pub measured_e: Option<StoredEstimate>,
}

#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
pub struct StoredGroup {
    pub column: String,
    pub label: String,
}

#[derive(Clone, Copy, Debug, Deserialize)]
pub struct StoredBall {
    pub radius_m: f64,
    /// `None`: discs whose masses are not stated.
    pub mass_kg: Option<f64>,
    pub inertia: f64,
}

#[derive(Clone, Copy, Debug, Deserialize)]
pub struct StoredEstimate {
    pub estimate: f64,
    pub std_error: Option<f64>,
}

#[derive(Clone, Debug, Deserialize)]
pub struct StoredParameter {
    pub estimate: f64,
    pub std_error: Option<f64>,
    pub interval_95: Option<[f64; 2]>,
    pub status: String,
}

/// Why stored fits cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum StoredError {
    #[error("{}: cannot be read: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{}:{}: column {}: {source}; expected a fit.json that caromfit fit wrote", path.display(), source.line(), source.column())]
    Json { path: PathBuf, source: serde_json::Error },
    #[error("{}: holds no fit.json; expected one, or a folder that caromfit fit wrote", path.display())]
    None { path: PathBuf },
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
