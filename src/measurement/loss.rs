//! How much shots far from their predictions count.

use serde::Deserialize;

use crate::name::{by_name, worded};

worded! {
    /// How much a shot counts that lies far from its prediction.
    #[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
    #[non_exhaustive]
    #[serde(rename_all = "lowercase")]
    pub enum Loss {
        /// The square of the distance: least squares.
        #[default]
        Squares = "squares",
        /// The square of the distance up to some distance, and linear beyond it (Huber 1964).
        Huber = "huber",
        /// The logarithm of the distance far away, so that gross errors count little (Cauchy).
        Cauchy = "cauchy",
    }
    /// The name in dataset.toml and on the command line.
    pub fn name;
}

impl Loss {
    /// Returns the tuning constant: with k = 1 the estimate has 95 % of the efficiency of least
    /// squares on normal errors (Holland and Welsch 1977).
    pub(crate) fn tuning(self) -> f64 {
        match self {
            Self::Squares => f64::INFINITY,
            Self::Huber => 1.345,
            Self::Cauchy => 2.3849,
        }
    }
}

by_name!(Loss, "loss", ALL, name);
