//! A shot as it is fitted.

use std::sync::Arc;

use crate::likelihood::frames::Film;
use crate::likelihood::prediction::Plan;

/// A shot that is fitted: which of the data set's, and what of it is compared.
#[derive(Clone, Debug)]
pub struct Fitted {
    pub index: usize,
    pub plan: Plan,
    /// Its frames, where these are fitted and not what was extracted from them.
    pub film: Option<Arc<Film>>,
}

/// Fewer shots than this are not worth a second core.
pub(crate) const SHARE: usize = 512;
