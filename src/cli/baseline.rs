//! `caromfit fit --baseline`: estimates that moved.

use std::path::{Path, PathBuf};

use caromfit::fit::Fit;
use caromfit::report::document::{self, FitDocument};
use caromfit::report::regression::{Moved, Tolerance};
use caromfit::report::{self, regression};

use super::Failure;

/// Stored fits, read before anything is written.
pub struct Baseline {
    path: PathBuf,
    stored: Vec<FitDocument>,
}

impl Baseline {
    pub fn read(path: &Path) -> Result<Self, Failure> {
        Ok(Self { path: path.to_path_buf(), stored: document::read(path)? })
    }

    /// Returns what moved by more than the tolerance, with the title of the fit.
    pub fn moved<'a>(
        &self,
        fits: impl Iterator<Item = &'a Fit>,
        tolerance: &Tolerance,
    ) -> Result<Vec<(String, Moved)>, Failure> {
        let mut all = Vec::new();
        for fit in fits {
            let title = report::title(fit);
            let Some(stored) = regression::find(fit, &self.stored) else {
                refuse!("{}: holds no fit of {title}; expected one to compare with", self.path.display());
            };
            let moved = regression::moved(fit, stored, tolerance);
            all.extend(moved.into_iter().map(|moved| (title.clone(), moved)));
        }
        Ok(all)
    }

    /// Returns whether it is in a folder, or contains it.
    pub fn is_in(&self, folder: &Path) -> bool {
        let (Ok(own), Ok(folder)) = (self.path.canonicalize(), folder.canonicalize()) else { return false };
        own.starts_with(&folder) || folder.starts_with(&own)
    }
}

/// The value of `--baseline-tolerance`.
pub fn tolerance(text: &str) -> Result<Tolerance, String> {
    Tolerance::of(super::number(text)?)
}

pub fn table(moved: &[(String, Moved)]) -> String {
    format!("the fit is no longer that of the baseline:\n{}", regression::table(moved).trim_end())
}
