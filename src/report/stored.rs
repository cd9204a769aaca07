//! Stored fits, and what moved since: for regression tests of simulators, of data that are kept,
//! and of this program.

use std::fs;
use std::path::{Path, PathBuf};

use glob::Pattern;

use super::document::FitDocument;
use super::templates::Table;
use super::title;
use crate::fit::Fit;

/// Why stored fits cannot be read or compared with: file or folder, line and column if there is
/// one, what is wrong, and what was expected.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct StoredError(String);

/// Largest change of an estimate that counts as the same, in standard errors, of which the larger
/// one counts; χ² in its own standard deviation √(2·dof). Far below what matters in practice, far
/// above the roundings of another machine.
const SAME_ERRORS: f64 = 0.01;

/// A result that changed: data set, what, before, now, and by how many standard errors.
pub(crate) type Moved = [String; 5];

/// Fits read back from the disk.
pub struct Stored {
    path: PathBuf,
    pub(crate) fits: Vec<FitDocument>,
}

impl Stored {
    /// Reads a fit.json, an array of fits (as `caromfit fit --json` prints it), or all below a
    /// folder.
    ///
    /// # Errors
    /// A text that cannot be read or is not a fit.json, with line and column.
    pub fn read(path: &Path) -> Result<Self, StoredError> {
        let pattern = format!("{}/**/fit.json", Pattern::escape(&path.to_string_lossy()));
        let files: Vec<PathBuf> = if path.is_dir() {
            glob::glob(&pattern).into_iter().flatten().flatten().collect()
        } else {
            vec![path.to_path_buf()]
        };
        let mut fits = Vec::new();
        for file in &files {
            fits.extend(read(file).map_err(|wrong| StoredError(format!("{}:{wrong}", file.display())))?);
        }
        if fits.is_empty() {
            let expected = "holds no fit.json; expected one, or a folder that caromfit fit wrote";
            return Err(StoredError(format!("{}: {expected}", path.display())));
        }
        Ok(Self { path: path.to_path_buf(), fits })
    }

    /// Returns what differs from the stored fit of the same data set and label by more than a
    /// hundredth of a standard error, in the order of the parameters, then χ² and the rest.
    ///
    /// # Errors
    /// A fit that does not exist.
    pub fn moved(&self, fit: &Fit) -> Result<Vec<Moved>, StoredError> {
        /// Tolerance of an estimate without a standard error, as a fraction of the estimate.
        const RELATIVE: f64 = 1e-6;
        let now = FitDocument::new(fit);
        let title = title(fit);
        let is_same = |own: &&FitDocument| own.dataset == now.dataset && own.group == now.group;
        let before = self.fits.iter().find(is_same).ok_or_else(|| {
            let path = self.path.display();
            StoredError(format!("{path}: holds no fit of {title}; expected one to compare with"))
        })?;
        let mut all = Vec::new();
        let mut add = |what: &str, before: &dyn ToString, now: &dyn ToString, by: Option<f64>| {
            let [before, now] = [before, now].map(ToString::to_string);
            let by = by.map_or("–".to_owned(), |by| format!("{by:+.3} standard errors"));
            if before != now {
                all.push([title.clone(), what.to_owned(), before, now, by]);
            }
        };
        add("fidelity", &before.fidelity, &now.fidelity, None);
        for (name, now) in &now.parameters {
            let Some(before) = before.parameters.get(name) else {
                add(name, &"missing", &now.estimate, None);
                continue;
            };
            add(&format!("{name} status"), &before.status, &now.status, None);
            let [old, new] = [before, now].map(|own| own.std_error.unwrap_or(0.0));
            let (change, error) = (now.estimate - before.estimate, old.max(new));
            let largest = before.estimate.abs().max(now.estimate.abs());
            let tolerance = if error > 0.0 { SAME_ERRORS * error } else { RELATIVE * largest };
            if change.abs() > tolerance {
                add(name, &before.estimate, &now.estimate, (error > 0.0).then(|| change / error));
            }
            // an interval that widens is a change even if the estimate stays
            if (new - old).abs() > SAME_ERRORS * old {
                add(&format!("{name} std_error"), &old, &new, None);
            }
        }
        let chi2 = [before, &now].map(|fit| fit.chi2.unwrap_or(f64::NAN));
        let change = (chi2[1] - chi2[0]) / (2.0 * now.dof.max(1) as f64).sqrt();
        if chi2[0].is_finite() != chi2[1].is_finite() || change.abs() > SAME_ERRORS {
            add("chi2", &chi2[0], &chi2[1], Some(change));
        }
        add("dof", &before.dof, &now.dof, None);
        add("shots_used", &before.shots_used, &now.shots_used, None);
        Ok(all)
    }
}

/// Returns the fits of a file; else what is wrong with it, behind the colon after its name.
fn read(file: &Path) -> Result<Vec<FitDocument>, String> {
    let text = fs::read_to_string(file).map_err(|error| format!(" cannot be read: {error}"))?;
    let is_list = text.trim_start().starts_with('[');
    let fits =
        if is_list { serde_json::from_str(&text) } else { serde_json::from_str(&text).map(|fit| vec![fit]) };
    fits.map_err(|error| {
        let (line, column) = (error.line(), error.column());
        format!("{line}: column {column}: {error}; expected a fit.json that caromfit fit wrote")
    })
}

/// Returns what moved as text.
pub(crate) fn table(moved: &[Moved]) -> String {
    let rows = moved.iter().map(|row| row.to_vec()).collect();
    Table::new(["data set", "what", "baseline", "now", "moved by"], rows).text("  ")
}
