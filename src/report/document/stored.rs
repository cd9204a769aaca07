//! Fits read back from the disk, for [`crate::report::regression`] and [`crate::report::export`].

use std::fs;
use std::path::{Path, PathBuf};

use super::FitDocument;

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
pub fn read(path: &Path) -> Result<Vec<FitDocument>, StoredError> {
    let mut fits = Vec::new();
    gather(path, &mut fits)?;
    if fits.is_empty() { Err(StoredError::None { path: path.to_path_buf() }) } else { Ok(fits) }
}

fn gather(path: &Path, fits: &mut Vec<FitDocument>) -> Result<(), StoredError> {
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
