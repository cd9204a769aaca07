//! Why there is no comparison.

use crate::fit::FitError;
use crate::measurement::number::count_of;

/// Why data sets cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// Fewer than two samples have usable shots; with their number.
    #[error(
        "{} with usable shots; expected two or more to compare: data sets, or labels of one whose [fit] by names \
         a column",
        count_of(*_0, "sample")
    )]
    TooFew(usize),
    /// A quantity, whose name is given, was asked to be both shared and per data set.
    #[error("{0} is both shared and per data set; expected one of them")]
    Both(&'static str),
    /// No data set has the parameter whose name is given.
    #[error(
        "{0}: no data set has it; a friction that falls (friction under [fit]) has mu_b and mu_c, a contact that gives way kappa, an e that falls e_slope"
    )]
    NoSuchParameter(&'static str),
    /// Data sets, of which one is named, were to share a camera, and it is no film of balls.
    #[error(
        "{0}: camera names that of another data set, too; expected it of films of balls, whose shots calibrate their camera"
    )]
    NoCamera(String),
    /// The films of two data sets differ too much to be by one camera.
    #[error(
        "{first} and {other}: lengths in their films differ by a factor of {factor:.2}, but camera has the same label in both; expected it of one camera that was not moved"
    )]
    OtherCamera {
        /// The first data set.
        first: String,
        /// The other.
        other: String,
        /// Of lengths in the films.
        factor: f64,
    },
    /// Data sets of one `balls` label state different balls.
    #[error(
        "{first} and {other}: both have balls = \"{label}\", but [ball] or [object] differ; expected the same in both"
    )]
    OtherBalls {
        /// The label.
        label: String,
        /// The first data set.
        first: String,
        /// The other.
        other: String,
    },
    /// A data set is wrong, as [`Dataset::faults`](crate::measurement::dataset::Dataset::faults) states it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid {
        /// The name of the data set.
        dataset: String,
        /// The faults, in sentences.
        faults: Vec<String>,
    },
    /// The fit of a data set failed.
    #[error(transparent)]
    Fit(#[from] FitError),
}

impl CompareError {
    /// Whether the input was wrong, rather than that it could not be compared.
    pub fn is_bad_input(&self) -> bool {
        !matches!(self, Self::Fit(error) if !error.is_bad_input())
    }
}
