//! The content of a report, as a value: made once and rendered as text and as HTML, so that they
//! cannot disagree.

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, context};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::plot::Figure;
use super::{ReportError, symbol};
use crate::fit::Verdict;
use crate::measurement::number::plain;

/// A report: of a fit, or of a comparison.
#[derive(Clone, Serialize)]
pub(super) struct Report {
    pub(super) title: String,
    pub(super) verdict: Verdict,
    /// Sentences that must not be overlooked, the most important first.
    pub(super) warnings: Vec<String>,
    /// The data and the fit: names and texts; those without a text are not shown.
    pub(super) facts: Vec<(&'static str, String)>,
    /// The sections in the order in which they are read; those without content are not shown.
    pub(super) sections: Vec<Section>,
}

/// The content under one heading.
#[derive(Clone, Serialize)]
pub(super) struct Section {
    title: String,
    /// The meaning of its numbers; empty if the heading states it.
    about: String,
    blocks: Vec<Block>,
    /// Whether it is a detail, which pages show on request only.
    folded: bool,
}

impl Section {
    /// Returns a section of the parts that are not empty.
    pub(super) fn new(
        title: impl Into<String>,
        about: impl Into<String>,
        blocks: impl IntoIterator<Item = Block>,
    ) -> Self {
        let holds = |block: &Block| match block {
            Block::Lines(lines) => !lines.is_empty(),
            Block::Table(table) => !table.rows.is_empty(),
            Block::Shots(shots) => !shots.is_empty(),
            Block::Figure(picture) => !picture.drawing.rows.is_empty(),
            Block::Tracks(_) => true,
        };
        let blocks = blocks.into_iter().filter(holds).collect();
        Self { title: title.into(), about: about.into(), blocks, folded: false }
    }

    pub(super) fn folded(self) -> Self {
        Self { folded: true, ..self }
    }
}

/// A part of a section. Pictures, paths and single shots are not in texts.
#[derive(Clone, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Block {
    /// Sentences, each a line.
    Lines(Vec<String>),
    Table(Table),
    Figure(Picture),
    /// The paths of the shots of a film as JSON, for pages that can draw them instead of the
    /// picture before.
    Tracks(String),
    Shots(Vec<Shot>),
}

impl Block {
    pub(super) fn figure(alt: &str, drawing: Figure) -> Self {
        Self::Figure(Picture { alt: alt.to_owned(), drawing })
    }
}

/// A picture with a description in words.
#[derive(Clone, Serialize)]
pub(super) struct Picture {
    alt: String,
    #[serde(serialize_with = "drawn")]
    drawing: Figure,
}

/// Writes a figure as SVG, with its measured points as JSON.
fn drawn<S: Serializer>(figure: &Figure, serializer: S) -> Result<S::Ok, S::Error> {
    let (svg, spots) = figure.svg().map_err(serde::ser::Error::custom)?;
    let spots = (!spots.is_empty()).then(|| for_script(&json!({ "spots": spots, "labels": figure.labels })));
    json!({ "svg": svg, "spots": spots }).serialize(serializer)
}

/// One shot's measured values against the model.
#[derive(Clone, Serialize)]
pub(super) struct Shot {
    /// A key that is unique in the report, by which pictures refer to it.
    pub(super) id: String,
    pub(super) name: String,
    pub(super) table: Table,
    /// Its place in the data.
    pub(super) place: usize,
    /// Its largest standardized residual, by absolute value, and the sum of the squares of all.
    pub(super) largest: f64,
    pub(super) chi2: f64,
}

/// Rows of as many cells as the head has.
#[derive(Clone, Serialize)]
pub(super) struct Table {
    head: Vec<String>,
    /// Whether a column holds numbers, which are aligned to the right.
    right: Vec<bool>,
    rows: Vec<Vec<String>>,
    /// The page that the first cell of each row leads to; empty without any.
    pub(super) links: Vec<String>,
}

impl Table {
    /// Returns a table whose columns of numbers, behind that of names, are aligned to the right.
    pub(super) fn new<T: Into<String>>(
        head: impl IntoIterator<Item = T>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Self {
        let head: Vec<String> = head.into_iter().map(Into::into).collect();
        let rows: Vec<Vec<String>> = rows.into_iter().collect();
        let is_number = |cell: &String| cell == "–" || cell.parse::<f64>().is_ok();
        let right =
            |column| column > 0 && rows.iter().filter_map(|row: &Vec<String>| row.get(column)).all(is_number);
        Self { right: (0..head.len()).map(right).collect(), head, rows, links: Vec::new() }
    }

    /// Returns a table of values as JSON has them: a row for each, and in each column the value at
    /// a place (a JSON pointer).
    pub(super) fn of(rows: impl IntoIterator<Item = impl Serialize>, columns: &[(&str, &str)]) -> Block {
        let row = |value| {
            let value = serde_json::to_value(value).unwrap_or_default();
            columns.iter().map(|(_, place)| cell(value.pointer(place).unwrap_or(&Value::Null))).collect()
        };
        Block::Table(Self::new(columns.iter().map(|(head, _)| *head), rows.into_iter().map(row)))
    }

    /// Returns the table as text: columns padded to the widest cell and two spaces between. A head
    /// without words is left out.
    pub(super) fn text(&self, indent: &str) -> String {
        let has_head = self.head.iter().any(|cell| !cell.is_empty());
        let rows: Vec<&Vec<String>> = has_head.then_some(&self.head).into_iter().chain(&self.rows).collect();
        let width = |column: usize| {
            let cells = rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.head.len()).map(width).collect();
        let mut text = String::new();
        for row in rows {
            let mut line = indent.to_owned();
            for ((cell, width), is_right) in row.iter().zip(&widths).zip(&self.right) {
                line += &if *is_right { format!("{cell:>width$}  ") } else { format!("{cell:<width$}  ") };
            }
            text += line.trim_end();
            text.push('\n');
        }
        text
    }
}

/// Returns a value as people read it: numbers to three digits, and the symbols of parameters.
fn cell(value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::Bool(is_so) => if *is_so { "yes" } else { "no" }.to_owned(),
        Value::Number(number) if number.is_f64() => plain(number.as_f64().unwrap_or(f64::NAN), 3),
        Value::Number(number) => number.to_string(),
        Value::String(text) => symbol(text).to_owned(),
        // the ends of a range
        Value::Array(values) => {
            let mut ends: Vec<String> = values.iter().map(cell).collect();
            ends.dedup();
            ends.join(" to ")
        }
        // shifts in standard errors
        Value::Object(entries) => {
            let shift = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
            let entry = |(name, value): (&String, &Value)| format!("{} {:+.2}", symbol(name), shift(value));
            entries.iter().map(entry).collect::<Vec<_>>().join(", ")
        }
    }
}

/// Returns a report as text, without its pictures.
pub(super) fn text(report: &Report) -> String {
    let verdict = &report.verdict;
    let mut text = format!("{}\nVerdict: {}. {}\n", report.title, verdict.grade.name(), verdict.sentence);
    for (name, fact) in report.facts.iter().filter(|(_, fact)| !fact.is_empty()) {
        text += &format!("  {name}: {fact}\n");
    }
    text += if report.warnings.is_empty() { "" } else { "\n" };
    text.extend(report.warnings.iter().map(|warning| format!("Warning: {warning}\n")));
    text + &sections(&report.sections)
}

/// Returns sections as text, each after an empty line; those without text are left out.
pub(super) fn sections(sections: &[Section]) -> String {
    let mut text = String::new();
    for section in sections {
        let body = section.blocks.iter().map(|block| match block {
            Block::Lines(lines) => lines.iter().map(|line| format!("  {line}\n")).collect(),
            Block::Table(own) => own.text("  "),
            Block::Figure(_) | Block::Tracks(_) | Block::Shots(_) => String::new(),
        });
        let body: String = body.collect();
        if !body.is_empty() {
            let about =
                if section.about.is_empty() { String::new() } else { format!(" ({})", section.about) };
            text += &format!("\n{}{about}\n{body}", section.title);
        }
    }
    text
}

/// Returns a report as one file that a lab attaches to its notebook: it needs no network and no
/// other file.
pub(super) fn html(report: &Report) -> Result<String, ReportError> {
    let failed = |error: minijinja::Error| ReportError::of_drawing(&report.title, error);
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_template("report.html", include_str!("report.html.jinja")).map_err(failed)?;
    let template = environment.get_template("report.html").map_err(failed)?;
    let (version, script) = (env!("CARGO_PKG_VERSION"), include_str!("report.js"));
    template.render(context! { report => Serde(report), version, script }).map_err(failed)
}

/// Returns JSON that may stand inside a script element. Numbers and texts can always be written.
pub(super) fn for_script(data: &impl Serialize) -> String {
    serde_json::to_string(data).unwrap_or_default().replace("</", "<\\/")
}
