//! residuals.csv and shots.csv of a fit, and tables as CSV.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{self, Write};

use indexmap::IndexSet;
use rayon::prelude::*;
use serde_json::{Map, Value, json};

use super::ascii;
use super::document::rounded;
use crate::compare::Comparison;
use crate::fit::{Fit, Residual};
use crate::measurement::dataset::Measured;
use crate::measurement::track::TrackedBall;

/// The columns of residuals.csv, a row per measured number that χ² counts
/// (`caromfit help results`).
pub const RESIDUALS: &str =
    "shot,observable,unit,measured,predicted,sd,standardized,cut_deg,speed_m_s,t_s,ball,model";

/// The first columns of shots.csv, a row per shot. Those of each observable follow, and of films of
/// balls what the fit estimates of each shot.
const SHOTS: &str = "shot,used,reason,cut_deg,speed_m_s,values,chi2,largest";

/// Number of shots whose rows are written at a time.
const AT_A_TIME: usize = 512;

/// Returns residuals.csv as text. A cell whose number is unknown is empty.
pub fn residuals(fit: &Fit) -> String {
    let mut bytes = Vec::new();
    // writing into a vector cannot fail
    _ = write_residuals(fit, &mut bytes);
    String::from_utf8(bytes).unwrap_or_default()
}

/// Writes residuals.csv row by row: of a film of balls every coordinate of every frame, else every
/// observable of every shot.
pub(super) fn write_residuals(fit: &Fit, to: &mut (dyn Write + Send)) -> io::Result<()> {
    writeln!(to, "{RESIDUALS}")?;
    let model = if fit.is_refuted() { "refuted" } else { "" };
    let Some(film) = &fit.frames else {
        return fit.residuals.iter().try_for_each(|own| to.write_all(row(own, model).as_bytes()));
    };
    let rows_of_shot = |i: usize| {
        let Some(motion) = film.solution.motion(i) else { return String::new() };
        let shot = quoted(&film.tracks[i].name);
        let [cut_deg, speed] = [motion.cut.to_degrees(), motion.speed].map(number);
        let mut text = String::new();
        for frame in film.solution.fitted_frames(i).into_iter().filter(|frame| frame.used) {
            let (ball, time) = (ball_name(frame.ball), number(frame.time));
            let of_frame = [frame.seen, frame.predicted, frame.sd, frame.standardized()];
            for (axis, name) in ["x", "y"].into_iter().enumerate() {
                let [measured, predicted, sd, standardized] = of_frame.map(|own| number(own[axis]));
                let short = &ball[..3];
                text += &format!(
                    "{shot},{short}_{name},m,{measured},{predicted},{sd},{standardized},{cut_deg},{speed},{time},{ball},{model}\n"
                );
            }
        }
        text
    };
    // not all frames may fit in memory
    for shots in (0..film.tracks.len()).collect::<Vec<_>>().chunks(AT_A_TIME) {
        let texts: Vec<String> = shots.par_iter().copied().map(rows_of_shot).collect();
        to.write_all(texts.concat().as_bytes())?;
    }
    Ok(())
}

fn ball_name(ball: TrackedBall) -> &'static str {
    match ball {
        TrackedBall::Cue => "cue",
        TrackedBall::Object => "object",
    }
}

/// Returns residuals.csv of a comparison: that of a fit, with the sample in front of each row (a
/// data set, or one label of a data set).
pub(super) fn of_comparison(comparison: &Comparison) -> String {
    let model = if comparison.is_refuted() { "refuted" } else { "" };
    let rows = comparison
        .residuals()
        .map(|(sample, residual)| format!("{},{}", quoted(&sample.title), row(residual, model)));
    std::iter::once(format!("sample,{RESIDUALS}\n")).chain(rows).collect()
}

fn row(residual: &Residual, model: &str) -> String {
    let (column, unit) = (residual.observable.column(), ascii(residual.observable.unit()));
    let values = [residual.measured, residual.predicted, residual.sd];
    let [measured, predicted, sd] = values.map(|si| si / residual.observable.unit_si());
    line(&[
        json!([residual.shot, column, unit, measured, predicted, sd, residual.standardized]),
        json!([residual.cut.to_degrees(), residual.speed, null, null, model]),
    ])
}

/// Returns shots.csv as text. A cell whose number is unknown is empty.
pub fn shots(fit: &Fit) -> String {
    let estimates: HashMap<_, _> = fit.frames.iter().flat_map(|film| film.solution.own_estimates()).collect();
    let mut rows = Vec::new();
    for own in fit.residuals.chunk_by(|one, next| one.shot == next.shot) {
        let Residual { shot, cut, speed, .. } = &own[0];
        let standardized = || own.iter().map(|residual| residual.standardized);
        let largest = |most: f64, z: f64| if z.abs() > most.abs() { z } else { most };
        let mut row = row_of(json!({
            "shot": shot,
            "used": true,
            "cut_deg": cut.to_degrees(),
            "speed_m_s": speed,
            "values": own.len(),
            "chi2": standardized().map(|z| z * z).sum::<f64>(),
            "largest": standardized().fold(0.0, largest),
        }));
        for residual in own {
            let (name, unit_si) = (residual.observable.column(), residual.observable.unit_si());
            row.insert(name.to_owned(), (residual.measured / unit_si).into());
            row.insert(format!("{name}_sd"), (residual.sd / unit_si).into());
            row.insert(format!("{name}_predicted"), (residual.predicted / unit_si).into());
        }
        for (column, Measured { value, sd }) in estimates.get(shot.as_str()).into_iter().flatten() {
            row.insert((*column).to_owned(), (*value).into());
            let sd = sd.filter(|_| !fit.is_refuted());
            row.insert(format!("{column}_sd"), sd.into());
        }
        rows.push(row);
    }
    rows.extend(
        fit.shots_rejected.iter().map(|rejected| {
            row_of(json!({ "shot": rejected.shot, "used": false, "reason": rejected.reason }))
        }),
    );
    table(SHOTS, &rows)
}

/// The cells of a row by the names of their columns; null for what is not known.
pub(super) type Row = Map<String, Value>;

/// Returns the cells of an object.
pub(super) fn row_of(object: Value) -> Row {
    if let Value::Object(cells) = object { cells } else { Row::new() }
}

/// Returns a table with these columns, and those that rows have besides, in the order in which they
/// first have them.
pub(super) fn table(columns: &str, rows: &[Row]) -> String {
    let known = columns.split(',').filter(|column| !column.is_empty());
    let columns: IndexSet<&str> = known.chain(rows.iter().flat_map(Row::keys).map(String::as_str)).collect();
    let row = |row: &Row| {
        let cells = columns.iter().map(|column| row.get(*column).cloned().unwrap_or_default());
        line(&[cells.collect()])
    };
    line(&[json!(columns)]) + &rows.iter().map(row).collect::<String>()
}

/// Returns a line of lists of cells.
fn line(lists: &[Value]) -> String {
    let cells = lists.iter().filter_map(Value::as_array).flatten();
    cells.map(cell).collect::<Vec<_>>().join(",") + "\n"
}

/// Returns a cell: very small and very large numbers with an exponent, nothing for null.
fn cell(value: &Value) -> Cow<'_, str> {
    match value {
        Value::Null => "".into(),
        Value::String(text) => quoted(text),
        Value::Number(value) if value.is_f64() => value.as_f64().map_or_else(String::new, number).into(),
        other => other.to_string().into(),
    }
}

/// Returns the cell of a number, empty if it is not known.
fn number(value: f64) -> String {
    let mut text = format!("{:?}", rounded(value));
    if !value.is_finite() {
        text.clear();
    } else if text.ends_with(".0") {
        text.truncate(text.len() - 2);
    }
    text
}

/// Returns a text as RFC 4180 wants it.
fn quoted(text: &str) -> Cow<'_, str> {
    let is_special = |c: char| matches!(c, ',' | '"' | '\n' | '\r' | '#');
    if text.contains(is_special) || text.trim() != text {
        return format!("\"{}\"", text.replace('"', "\"\"")).into();
    }
    text.into()
}
