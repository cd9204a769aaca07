//! Fits read back from the disk, for [`crate::report::regression`] and [`crate::report::export`].

use std::fs;
use std::path::{Path, PathBuf};

use super::FitDocument;

/// Why stored fits cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("{}{reason}", path.display())]
pub struct StoredError {
    /// The file or folder.
    pub path: PathBuf,
    /// The line and column if there is one, what is wrong, and what was expected.
    pub reason: String,
}

/// Reads a fit.json, an array of them (as `caromfit fit --json` prints it), or all below a folder.
///
/// # Errors
/// What cannot be read or is no fit.json, with line and column.
pub fn read(path: &Path) -> Result<Vec<FitDocument>, StoredError> {
    let mut fits = Vec::new();
    gather(path, &mut fits)?;
    if fits.is_empty() {
        let reason = ": holds no fit.json; expected one, or a folder that caromfit fit wrote".to_owned();
        return Err(StoredError { path: path.to_path_buf(), reason });
    }
    Ok(fits)
}

fn gather(path: &Path, fits: &mut Vec<FitDocument>) -> Result<(), StoredError> {
    let wrong = |reason: String| StoredError { path: path.to_path_buf(), reason };
    let failed = |error: std::io::Error| wrong(format!(": cannot be read: {error}"));
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
    let found = if text.trim_start().starts_with('[') {
        serde_json::from_str(&text)
    } else {
        serde_json::from_str(&text).map(|fit| vec![fit])
    };
    fits.append(&mut found.map_err(|error| {
        let (line, column) = (error.line(), error.column());
        wrong(format!(":{line}: column {column}: {error}; expected a fit.json that caromfit fit wrote"))
    })?);
    Ok(())
}
