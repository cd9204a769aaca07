//! report.html: one file that a lab attaches to its notebook. It needs no network and no other file; pictures of
//! shots are inside it.

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, context};
use serde::Serialize;
use serde_json::json;

use super::ReportError;
use super::content::{Block, Report};

const TEMPLATE: &str = include_str!("report.html.jinja");
const SCRIPT: &str = include_str!("report.js");

/// The whole report.
///
/// # Errors
/// A figure that cannot be drawn, or the template engine gave up.
pub fn render(report: &Report) -> Result<String, ReportError> {
    let mut report = report.clone();
    for block in report.sections.iter_mut().flat_map(|section| &mut section.blocks) {
        let Block::Figure(picture) = block else { continue };
        let (svg, spots) = picture.drawing.svg_with_spots()?;
        picture.svg = svg;
        if !spots.is_empty() {
            picture.spots = for_script(&json!({ "spots": spots, "labels": picture.drawing.labels }));
        }
    }
    let failed = |error: minijinja::Error| ReportError::Draw {
        dataset: report.title.clone(),
        reason: format!("report.html: {error}"),
    };
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_template("report.html", TEMPLATE).map_err(failed)?;
    let template = environment.get_template("report.html").map_err(failed)?;
    let version = env!("CARGO_PKG_VERSION");
    template.render(context! { report => Serde(&report), version, script => SCRIPT }).map_err(failed)
}

/// JSON that may stand inside a script element. Numbers and texts can always be written.
pub(super) fn for_script(data: &impl Serialize) -> String {
    serde_json::to_string(data).unwrap_or_default().replace("</", "<\\/")
}
