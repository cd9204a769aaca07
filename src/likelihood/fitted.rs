//! A shot as it is fitted.

use std::sync::Arc;

use crate::likelihood::frames::{Film, ROWS};
use crate::likelihood::prediction::Plan;

/// A shot that is fitted: which of the data set's, and what of it is compared.
#[derive(Clone, Debug)]
pub struct Fitted {
    pub index: usize,
    pub plan: Plan,
    /// Its frames, where these are fitted and not what was extracted from them.
    pub film: Option<Arc<Film>>,
}

impl Fitted {
    /// How many residuals it has.
    pub fn rows(&self) -> usize {
        if self.film.is_some() { ROWS } else { self.plan.rows().len() }
    }

    /// Whether it may have side spin that nobody saw.
    pub fn has_side_spin(&self) -> bool {
        self.film.as_ref().map_or(self.plan.side_sd() > 0.0, |film| film.has_side_spin())
    }

    /// The part of its χ² that is there whatever the collision: of the frames' noise.
    pub fn least_chi2(&self) -> f64 {
        self.film.as_ref().map_or(0.0, |film| film.least_chi2)
    }
}

/// Fewer shots than this are not worth a second core.
pub(crate) const SHARE: usize = 512;
