//! The studies of [`crate::studies::accuracy`] and [`crate::studies::bias`] as tables and as a
//! figure.

use std::path::Path;

use minijinja::value::Serde;

use super::document::AccuracyDocument;
use super::templates::{self, ACCURACY};
use super::write::Staged;
use super::{ReportError, plot};
use crate::studies::accuracy::Row;

/// Returns tables for the terminal: errors against time, and the bias of fits.
pub(crate) fn table(document: &AccuracyDocument) -> String {
    templates::text(ACCURACY, Serde(document).into())
}

/// Writes the figure of the study.
pub(crate) fn write(rows: &[Row], out: &Path) -> Result<(), ReportError> {
    Staged::new(out)?.figure("accuracy", &plot::accuracy(rows))?.put()
}
