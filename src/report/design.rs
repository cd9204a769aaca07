//! A [`Design`] → text, design.json and a figure.

use std::path::Path;

use minijinja::context;
use minijinja::value::Serde;

use super::document::{self, DesignDocument};
use super::templates::{self, DESIGN};
use super::write::Staged;
use super::{ReportError, plot, two_balls};
use crate::design::Design;

/// Writes design.json and the figure of a design.
pub(crate) fn write(design: &Design, out: &Path) -> Result<(), ReportError> {
    let figure = plot::design(design);
    let text = document::text(&DesignDocument::new(design))?;
    Staged::new(out)?.figure("design", &figure)?.add("design.json", text)?.put()
}

/// Returns the text that `caromfit design` prints.
pub(crate) fn text(design: &Design) -> String {
    let document = DesignDocument::new(design);
    let balls = document.object.as_ref().map(|object| two_balls(&document.ball, object));
    templates::text(DESIGN, context! { balls, camera => Serde(design.expected.camera), ..Serde(document) })
}
