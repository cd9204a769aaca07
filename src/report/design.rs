//! A [`Design`] → text, design.json and a figure.

use std::path::Path;

use minijinja::context;
use minijinja::value::Serde;

use super::document::{self, DesignDocument};
use super::templates;
use super::write::Staged;
use super::{ReportError, plot};
use crate::design::Design;

/// Writes design.json and the figure of a design.
pub(crate) fn write(design: &Design, out: &Path) -> Result<(), ReportError> {
    let figure = plot::design(design);
    let text = document::text(&DesignDocument::new(design))?;
    Staged::new(out)?.figure("design", &figure)?.add("design.json", text)?.put()
}

/// Returns the text that `caromfit design` prints.
pub(crate) fn text(design: &Design) -> String {
    let document = Serde(DesignDocument::new(design));
    let values = context! { camera => Serde(design.expected.camera), ..document };
    templates::text(include_str!("templates/design.jinja"), values)
}
