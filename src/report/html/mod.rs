//! report.html: one file that a lab attaches to its notebook. It needs no network and no other file; pictures of
//! shots are inside it. This file knows what such a page is made of; `fit` and `comparison` fill it.

mod comparison;
mod fit;

use std::collections::HashMap;

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

pub use comparison::of_comparison;
pub use fit::{of_fit, worth_drawing};

use super::{ReportError, number};
use crate::fit::Residual;

const TEMPLATE: &str = include_str!("report.html.jinja");

/// The picture of a shot's track: its name and the SVG.
pub type ShotPicture = (String, String);

/// More pictures than these would make the file too large to open on a phone; those that matter most stay.
pub const MOST_PICTURES: usize = 60;

/// What a point on a picture is.
#[derive(Serialize)]
struct Spot {
    x: i32,
    y: i32,
    /// Of the place in this file that tells more of its shot.
    target: Option<String>,
    text: String,
}

#[derive(Serialize)]
struct Picture {
    title: String,
    svg: String,
    alt: String,
}

#[derive(Serialize)]
struct Shot {
    id: String,
    name: String,
    svg: Option<String>,
    rows: Vec<[String; 5]>,
    largest: f64,
}

#[derive(Serialize)]
struct Section {
    title: String,
    /// What stands in brackets behind the title.
    about: String,
    /// Where all lines are rows of a table, the first its head; else `lines`.
    rows: Vec<Vec<String>>,
    lines: Vec<String>,
}

impl Section {
    /// A block of the text report.
    fn new(title: &str, lines: Vec<String>) -> Self {
        let (title, about) = title.split_once(" (").unwrap_or((title, ""));
        // columns of the text stand at least two spaces apart
        let cells = |line: &String| -> Vec<String> {
            line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).map(String::from).collect()
        };
        let rows: Vec<Vec<String>> = lines.iter().map(cells).collect();
        let (title, about) = (title.to_owned(), about.trim_end_matches(')').to_owned());
        if rows.len() > 1 && rows.iter().all(|row| row.len() > 1) {
            Self { title, about, rows, lines: Vec::new() }
        } else {
            Self { title, about, rows: Vec::new(), lines }
        }
    }
}

/// What the template shows.
#[derive(Serialize)]
struct Page {
    title: String,
    warnings: Vec<String>,
    notes: Vec<String>,
    facts: Vec<(&'static str, String)>,
    head: Vec<String>,
    parameters: Vec<Vec<String>>,
    pictures: Vec<Picture>,
    rejected: Vec<[String; 2]>,
    sections: Vec<Section>,
    shots: Vec<Shot>,
    version: &'static str,
}

fn render(page: &Page) -> Result<String, ReportError> {
    let failed = |error: minijinja::Error| ReportError::Draw {
        dataset: page.title.clone(),
        reason: format!("report.html: {error}"),
    };
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_template("report.html", TEMPLATE).map_err(failed)?;
    let template = environment.get_template("report.html").map_err(failed)?;
    template.render(Serde(page)).map_err(failed)
}

/// Facts that there are.
fn present<const N: usize>(facts: [(&'static str, String); N]) -> Vec<(&'static str, String)> {
    facts.into_iter().filter(|(_, text)| !text.is_empty()).collect()
}

/// The shots that are listed in a report, those with the largest residuals first: each residual with the name of its
/// shot.
fn shot_list<'a>(
    residuals: impl Iterator<Item = (String, &'a Residual)>,
    pictures: &[ShotPicture],
) -> Vec<Shot> {
    let mut shots: Vec<Shot> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for (name, residual) in residuals {
        let unit_si = residual.observable.unit_si();
        let row = [
            format!("{} {}", residual.observable.label(), residual.observable.unit()),
            number::plain(residual.measured / unit_si, 5),
            number::plain(residual.predicted / unit_si, 5),
            number::plain(residual.sd / unit_si, 2),
            format!("{:+.2}", residual.standardized),
        ];
        let size = if residual.standardized.is_finite() { residual.standardized.abs() } else { 0.0 };
        if let Some(shot) = known.get(&name).and_then(|index| shots.get_mut(*index)) {
            shot.rows.push(row);
            shot.largest = shot.largest.max(size);
        } else {
            let id = format!("shot-{}", shots.len() + 1);
            known.insert(name.clone(), shots.len());
            shots.push(Shot { id, name, svg: None, rows: vec![row], largest: size });
        }
    }
    shots.sort_by(|a, b| b.largest.total_cmp(&a.largest));
    shots.truncate(10 * MOST_PICTURES);
    for shot in shots.iter_mut().take(MOST_PICTURES) {
        shot.svg = pictures.iter().find(|(name, _)| *name == shot.name).map(|(_, svg)| svg.clone());
    }
    shots
}

/// What each point on a picture says of its residual, and where it leads; `of` tells a residual's shot and itself.
fn spots<'a>(
    points: &[(i32, i32, usize)],
    shots: &[Shot],
    of: impl Fn(usize) -> Option<(String, &'a Residual)>,
) -> Vec<Spot> {
    let spot = |&(x, y, index): &(i32, i32, usize)| {
        let (name, residual) = of(index)?;
        let text = format!(
            "shot {name}: {}, {:+.2} standard deviations",
            residual.observable.label(),
            residual.standardized
        );
        let target = shots.iter().find(|shot| shot.name == name).map(|shot| shot.id.clone());
        Some(Spot { x, y, target, text })
    };
    points.iter().filter_map(spot).collect()
}

/// A picture with a place over each point that names its shot when the pointer is there.
fn with_spots(svg: &str, spots: &[Spot]) -> String {
    let Some((picture, _)) = svg.rsplit_once("</svg>") else { return svg.to_owned() };
    let mut text = picture.to_owned();
    for Spot { x, y, target, text: words } in spots {
        let place = format!(
            "<circle class=\"spot\" cx=\"{x}\" cy=\"{y}\" r=\"8\"><title>{}</title></circle>",
            escaped(words)
        );
        match target {
            Some(id) => text.push_str(&format!("<a href=\"#{id}\">{place}</a>\n")),
            None => text.push_str(&format!("{place}\n")),
        }
    }
    text + "</svg>"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
