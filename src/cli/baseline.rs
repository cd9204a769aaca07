//! `caromfit fit --baseline`: what moved since.

use std::path::{Path, PathBuf};

use caromfit::fit::Fit;
use caromfit::report::document::{self, FitDocument};
use caromfit::report::regression::Moved;
use caromfit::report::{self, regression};

use super::Failure;

/// Stored fits, read before anything is written.
pub struct Baseline {
    path: PathBuf,
    stored: Vec<FitDocument>,
}

impl Baseline {
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let stored = document::read(path)?;
        Ok(Self { path: path.to_path_buf(), stored })
    }

    /// What moved by more than the tolerance, with the title of the fit.
    pub fn moved<'a>(
        &self,
        fits: impl Iterator<Item = &'a Fit>,
        tolerance: f64,
    ) -> Result<Vec<(String, Moved)>, Failure> {
        let mut all = Vec::new();
        for fit in fits {
            let title = report::title(fit);
            let Some(stored) = regression::find(fit, &self.stored) else {
                return Err(Failure::input(format!(
                    "{}: holds no fit of {title}; expected one to compare with",
                    self.path.display()
                )));
            };
            let moved = regression::moved(fit, stored, tolerance);
            all.extend(moved.into_iter().map(|moved| (title.clone(), moved)));
        }
        Ok(all)
    }

    /// Whether it lies in a folder, or holds it.
    pub fn is_in(&self, folder: &Path) -> bool {
        let (Ok(own), Ok(folder)) = (self.path.canonicalize(), folder.canonicalize()) else { return false };
        own.starts_with(&folder) || folder.starts_with(&own)
    }
}

/// The value of `--baseline-tolerance`: with NaN everything would count as moved, with infinity nothing.
pub fn tolerance(text: &str) -> Result<f64, String> {
    let number: f64 = text.trim().parse().map_err(|_| format!("\"{text}\" is not a number"))?;
    if number.is_finite() && number >= 0.0 {
        return Ok(number);
    }
    Err(format!("{number} is no number of standard errors; expected a finite number, 0 or more"))
}

pub fn table(moved: &[(String, Moved)]) -> String {
    format!("the fit is no longer that of the baseline:\n{}", regression::table(moved).trim_end())
}
