//! residuals.csv: one row per measured number that χ² counts, in the unit of its column.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{self, Write};

use super::document::rounded;
use super::unit_name;
use crate::compare::Comparison;
use crate::fit::{Fit, Residual};
use crate::measurement::track::TrackedBall;
use crate::problem::FittedFrame;

/// The columns: `measured`, `predicted` and `sd` are in `unit`, `cut_deg` in degrees, `speed_m_s`
/// in m/s, `standardized` has none. `model` is `refuted` where the data rule the model out, else empty. `t_s` (s) and `ball`
/// (cue or object) are those of a frame's coordinate; other observables leave them empty.
pub const HEADER: &str =
    "shot,observable,unit,measured,predicted,sd,standardized,cut_deg,speed_m_s,t_s,ball,model";

/// residuals.csv as text. A cell whose number is unknown is empty.
#[must_use]
pub fn render(fit: &Fit) -> String {
    let mut bytes = Vec::new();
    // Writing into a vector cannot fail.
    let _ = write(fit, &mut bytes);
    String::from_utf8(bytes).unwrap_or_default()
}

/// Writes residuals.csv row by row: of a film of balls every coordinate of every frame, else every observable of every shot.
///
/// # Errors
/// Those of `to`.
pub fn write(fit: &Fit, to: &mut (dyn Write + Send)) -> io::Result<()> {
    writeln!(to, "{HEADER}")?;
    let model = if fit.refuted.is_some() { "refuted" } else { "" };
    match &fit.frames {
        Some(frames) => frames.write(to, |of_shot, text| {
            let shot = quoted(&of_shot.shot);
            let [cut, speed] = [of_shot.cut.to_degrees(), of_shot.speed].map(cell);
            let common = format!("{cut},{speed}");
            let used = of_shot.frames.iter().filter(|frame| frame.used);
            used.for_each(|own| frame(text, &shot, own, [&common, model]));
        }),
        None => fit.residuals.iter().try_for_each(|residual| to.write_all(row(residual, model).as_bytes())),
    }
}

/// residuals.csv of a comparison: that of a fit with the sample before each row, a data set or a label of one.
pub(super) fn of_comparison(comparison: &Comparison) -> String {
    let model = if comparison.is_refuted() { "refuted" } else { "" };
    let rows = comparison.residuals.iter().map(|residual| {
        let sample = &comparison.samples[residual.sample].title;
        format!("{},{}", quoted(sample), row(&residual.of_shot, model))
    });
    std::iter::once(format!("sample,{HEADER}\n")).chain(rows).collect()
}

fn row(residual: &Residual, model: &str) -> String {
    let unit_si = residual.observable.unit_si();
    format!(
        "{},{},{},{},{},{},,,{model}\n",
        quoted(&residual.shot),
        residual.observable.column(),
        unit_name(residual.observable),
        [residual.measured, residual.predicted, residual.sd].map(|si| cell(si / unit_si)).join(","),
        cell(residual.standardized),
        [residual.cut.to_degrees(), residual.speed.unwrap_or(f64::NAN)].map(cell).join(","),
    )
}

/// There may be millions of these: no cell is a text of its own.
fn frame(text: &mut String, shot: &str, own: &FittedFrame, [common, model]: [&str; 2]) {
    let (prefix, ball) = match own.ball {
        TrackedBall::Cue => ("cue", "cue"),
        TrackedBall::Object => ("obj", "object"),
    };
    let standardized = own.standardized();
    for (axis, name) in ["x", "y"].into_iter().enumerate() {
        push(text, [shot, ",", prefix, "_", name, ",m"]);
        for value in [own.seen[axis], own.predicted[axis], own.sd[axis], standardized[axis]] {
            push_number(text, value);
        }
        push(text, [",", common]);
        push_number(text, own.time);
        push(text, [",", ball, ",", model, "\n"]);
    }
}

/// A table whose rows name their cells: columns stand in the order in which rows first have them.
#[derive(Default)]
pub(super) struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Returns a table that has columns, with commas between, and no rows.
    pub(super) fn new(columns: &str) -> Self {
        Self { columns: columns.split(',').map(str::to_owned).collect(), rows: Vec::new() }
    }

    /// Begins a row, whose cells are empty.
    pub(super) fn begin(&mut self) {
        self.rows.push(Vec::new());
    }

    /// Adds a cell to the row.
    pub(super) fn add(&mut self, column: &str, cell: impl Into<String>) {
        let place = self.columns.iter().position(|known| known == column).unwrap_or_else(|| {
            self.columns.push(column.to_owned());
            self.columns.len() - 1
        });
        if let Some(row) = self.rows.last_mut() {
            row.resize(row.len().max(place + 1), String::new());
            row[place] = cell.into();
        }
    }

    /// Adds the cell of a number, which is empty if it is unknown.
    pub(super) fn add_number(&mut self, column: &str, value: f64) {
        let mut cell = String::new();
        push_value(&mut cell, value);
        self.add(column, cell);
    }

    /// Returns the table as text.
    pub(super) fn text(&self) -> String {
        let line = |row: &Vec<String>| {
            let cell = |i: usize| row.get(i).map_or("".into(), |cell| quoted(cell));
            (0..self.columns.len()).map(cell).collect::<Vec<_>>().join(",") + "\n"
        };
        std::iter::once(&self.columns).chain(&self.rows).map(line).collect()
    }
}

/// A cell as RFC 4180 wants it.
pub(super) fn quoted(cell: &str) -> Cow<'_, str> {
    let special = |c: char| matches!(c, ',' | '"' | '\n' | '\r' | '#');
    if cell.contains(special) || cell.trim() != cell {
        Cow::Owned(format!("\"{}\"", cell.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(cell)
    }
}

/// Empty where it is no number.
pub(super) fn cell(value: f64) -> String {
    let mut text = String::new();
    push_value(&mut text, value);
    text
}

/// Parts of a line, one after the other.
pub(super) fn push<const N: usize>(text: &mut String, parts: [&str; N]) {
    for part in parts {
        text.push_str(part);
    }
}

/// A comma and a number, which is empty where it is none.
pub(super) fn push_number(text: &mut String, value: f64) {
    text.push(',');
    push_value(text, value);
}

fn push_value(text: &mut String, value: f64) {
    /// Numbers from here to there are short without an exponent.
    const PLAIN: std::ops::Range<f64> = 1e-6..1e15;
    let number = rounded(value);
    // writing into a string cannot fail
    _ = match number.abs() {
        size if size == 0.0 || PLAIN.contains(&size) => write!(text, "{number}"),
        size if size.is_finite() => write!(text, "{number:e}"),
        _ => Ok(()),
    };
}
