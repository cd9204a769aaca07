//! Something that a reader should know of a fit.

use crate::problem::{Finding, Severity};

/// Something to know of a fit.
#[derive(Clone, Debug)]
pub struct Remark {
    /// Its subject.
    pub about: About,
    /// How far it affects the trust in the fit.
    pub severity: Severity,
    /// Its sentence, for a reader.
    pub sentence: String,
}

/// The subject of a remark, as data.
#[derive(Clone, Debug)]
pub enum About {
    /// A finding of the search.
    Found(Finding),
    /// The kind of what follows from the results.
    Kind(&'static str),
}

impl Remark {
    pub(super) fn new(severity: Severity, kind: &'static str, sentence: String) -> Self {
        Self { about: About::Kind(kind), severity, sentence }
    }
}
