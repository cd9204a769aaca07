//! The figure of [`crate::studies::accuracy`].

use std::path::Path;

use super::write::Staged;
use super::{ReportError, plot};
use crate::studies::accuracy::Row;

/// Writes the figure of the study.
pub(crate) fn write(rows: &[Row], out: &Path) -> Result<(), ReportError> {
    Staged::new(out)?.figure("accuracy", &plot::accuracy(rows))?.put()
}
