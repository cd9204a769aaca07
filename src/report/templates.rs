//! Reports as text and as pages. A template states once which sentences, tables and figures a
//! report has; the macros of `text.jinja` or `page.jinja` write them, so that both say the same.

use minijinja::value::Serde;
use minijinja::{AutoEscape, UndefinedBehavior, Value as Values, context};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::ReportError;
use crate::measurement::number::{interval, plain};
use crate::words::{self, symbol};

/// Returns a document as text.
pub(crate) fn text_of(report: &str, document: &impl Serialize) -> String {
    text(report, context! { document => Serde(document) })
}

/// Returns a report as text, without its pictures.
pub(super) fn text(report: &str, values: Values) -> String {
    // the templates are those of the program, which its tests render
    rendered(report, include_str!("templates/text.jinja"), AutoEscape::None, values)
        .unwrap_or_else(|error| error.to_string())
}

/// Returns a report as one file that a lab attaches to its notebook: it needs no network and no
/// other file.
pub(super) fn page(report: &str, values: Values) -> Result<String, ReportError> {
    let (version, script) = (env!("CARGO_PKG_VERSION"), include_str!("templates/report.js"));
    let values = context! { version, script, ..values };
    rendered(report, include_str!("templates/page.jinja"), AutoEscape::Html, values)
}

fn rendered(report: &str, macros: &str, escape: AutoEscape, values: Values) -> Result<String, ReportError> {
    // texts have no figures
    let mut environment = words::environment(UndefinedBehavior::Chainable)?;
    environment.set_auto_escape_callback(move |_| escape.clone());
    environment
        .add_filter("interval", |ends: Vec<f64>, error: Option<f64>| interval([ends[0], ends[1]], error));
    environment.add_filter("direction", |velocity: Vec<f64>| velocity[1].atan2(velocity[0]).to_degrees());
    environment.add_filter("signed", |value: f64, digits: usize| format!("{value:+.digits$}"));
    environment
        .add_filter("table", |rows: Values, columns: Values| Values::from(Serde(Table::of(rows, columns))));
    environment.add_filter("text_table", |rows: Values, columns: Values| Table::of(rows, columns).text("  "));
    let report = include_str!("templates/words.jinja").to_owned() + report;
    Ok(environment.render_str(&macros.replace("{{ content }}", &report), values)?)
}

/// Rows of as many cells as the head has.
#[derive(Serialize)]
pub(super) struct Table {
    head: Vec<String>,
    /// Whether a column holds numbers, which are aligned to the right.
    right: Vec<bool>,
    rows: Vec<Vec<String>>,
}

/// A column: its heading, and the place of its value in what a row stands for (a JSON pointer);
/// of rows that are cells the heading alone.
#[derive(Deserialize)]
#[serde(untagged)]
enum Column {
    Cells(String),
    Values(String, String),
}

impl Table {
    /// Returns a table whose columns of numbers, behind that of names, are aligned to the right.
    pub(super) fn new<T: Into<String>>(head: impl IntoIterator<Item = T>, rows: Vec<Vec<String>>) -> Self {
        let head: Vec<String> = head.into_iter().map(Into::into).collect();
        let is_number = |cell: &String| cell == "–" || cell.parse::<f64>().is_ok();
        let right = |column| column > 0 && rows.iter().filter_map(|row| row.get(column)).all(is_number);
        Self { right: (0..head.len()).map(right).collect(), head, rows }
    }

    /// Returns the table of a template.
    fn of(rows: Values, columns: Values) -> Self {
        let rows = serde_json::to_value(rows).unwrap_or_default();
        let columns = serde_json::to_value(columns).and_then(serde_json::from_value);
        let columns: Vec<Column> = columns.unwrap_or_default();
        let row = |row: &Value| {
            let cells = columns.iter().enumerate().map(|(place, column)| match column {
                Column::Cells(_) => row[place].as_str().map_or_else(|| cell(&row[place]), str::to_owned),
                Column::Values(_, pointer) => cell(row.pointer(pointer).unwrap_or(&Value::Null)),
            });
            cells.collect()
        };
        let rows = rows.as_array().into_iter().flatten().map(row).collect();
        let head = columns.into_iter().map(|(Column::Cells(head) | Column::Values(head, _))| head);
        Self::new(head, rows)
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

/// Returns JSON that may stand inside a script element. Numbers and texts can always be written.
pub(super) fn for_script(data: &impl Serialize) -> String {
    serde_json::to_string(data).unwrap_or_default().replace("</", "<\\/")
}
