//! report.html: one file that a lab attaches to its notebook. It needs no network and no other file; pictures of
//! shots are inside it.

use std::collections::HashMap;

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, context};
use serde::Serialize;

use super::ReportError;
use super::content::{Block, Report};

const TEMPLATE: &str = include_str!("report.html.jinja");
const SCRIPT: &str = include_str!("report.js");

/// The whole report.
///
/// # Errors
/// A figure that cannot be drawn, or the template engine gave up.
pub fn render(report: &Report) -> Result<String, ReportError> {
    let report = drawn(report)?;
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

/// The measured points of a figure, for the script of a page.
#[derive(Serialize)]
struct Spots<'a> {
    /// Pixels from the left and from the top, and the index of the label.
    spots: Vec<(i32, i32, usize)>,
    /// The key of the shot, and what the point stands for.
    labels: Vec<(&'a str, String)>,
}

/// The report with its figures drawn, whose points lead to the shots.
fn drawn(report: &Report) -> Result<Report, ReportError> {
    let blocks = report.sections.iter().flat_map(|section| &section.blocks);
    let shots = blocks.flat_map(|block| if let Block::Shots(shots) = block { shots.as_slice() } else { &[] });
    let ids: HashMap<&str, &str> = shots.map(|shot| (shot.name.as_str(), shot.id.as_str())).collect();
    let mut report = report.clone();
    for block in report.sections.iter_mut().flat_map(|section| &mut section.blocks) {
        let Block::Figure(figure) = block else { continue };
        let (svg, spots) = figure.drawing.svg_with_spots()?;
        figure.svg = svg;
        if spots.is_empty() {
            continue;
        }
        let labels = figure.drawing.labels.iter().map(|label| {
            let id = ids.get(label.shot.as_str()).copied().unwrap_or_default();
            (id, format!("shot {}: {}", label.shot, label.words))
        });
        let spots = spots.iter().map(|spot| (spot.x, spot.y, spot.label)).collect();
        figure.spots = for_script(&Spots { spots, labels: labels.collect() });
    }
    Ok(report)
}

/// JSON that may stand inside a script element. Numbers and texts can always be written.
pub(super) fn for_script(data: &impl Serialize) -> String {
    serde_json::to_string(data).unwrap_or_default().replace("</", "<\\/")
}
