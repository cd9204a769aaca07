//! residuals.csv, shots.csv and frames.csv of a fit, and tables as CSV.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{self, Write};

use indexmap::{IndexMap, IndexSet};

use super::ascii;
use super::document::rounded;
use crate::compare::Comparison;
use crate::fit::{Fit, FittedFilm, Residual};
use crate::measurement::track::TrackedBall;
use crate::problem::{FittedFrame, OwnEstimate};

/// The columns of residuals.csv, a row per measured number that χ² counts
/// (`caromfit help results`).
pub const RESIDUALS: &str =
    "shot,observable,unit,measured,predicted,sd,standardized,cut_deg,speed_m_s,t_s,ball,model";

/// The columns of frames.csv of films of balls, a row per ball and frame that was fitted.
pub(crate) const FRAMES: &str =
    "shot,ball,t_s,x_m,y_m,x_predicted_m,y_predicted_m,x_sd_m,y_sd_m,x_standardized,y_standardized";

/// The first columns of shots.csv, a row per shot. Those of each observable follow, and of films of
/// balls what the fit estimates of each shot.
pub(crate) const SHOTS: &str = "shot,used,reason,cut_deg,speed_m_s,values,chi2,largest";

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
    let model = if fit.refuted.is_some() { "refuted" } else { "" };
    let Some(film) = &fit.frames else {
        return fit.residuals.iter().try_for_each(|own| to.write_all(row(own, model).as_bytes()));
    };
    film.write(to, |of_shot, text| {
        let shot = quoted(&of_shot.shot);
        let common = cells([of_shot.cut.to_degrees(), of_shot.speed]);
        for frame in of_shot.frames.iter().filter(|frame| frame.used) {
            let (prefix, ball) = names(frame);
            let standardized = frame.standardized();
            for (axis, name) in ["x", "y"].into_iter().enumerate() {
                let numbers = [frame.seen[axis], frame.predicted[axis], frame.sd[axis], standardized[axis]];
                let (numbers, time) = (cells(numbers), cell(frame.time));
                *text += &format!("{shot},{prefix}_{name},m,{numbers},{common},{time},{ball},{model}\n");
            }
        }
    })
}

/// Writes frames.csv shot by shot: there may be more frames than should be held in memory.
pub(super) fn write_frames(film: &FittedFilm, to: &mut (dyn Write + Send)) -> io::Result<()> {
    writeln!(to, "{FRAMES}")?;
    film.write(to, |of_shot, text| {
        let shot = quoted(&of_shot.shot);
        for frame in of_shot.frames.iter().filter(|frame| frame.used) {
            let [seen, predicted, sd] = [frame.seen, frame.predicted, frame.sd].map(cells);
            let (ball, time, standardized) = (names(frame).1, cell(frame.time), cells(frame.standardized()));
            *text += &format!("{shot},{ball},{time},{seen},{predicted},{sd},{standardized}\n");
        }
    })
}

/// Returns the beginning of the names of a ball's coordinates, and the name of the ball.
fn names(frame: &FittedFrame) -> (&'static str, &'static str) {
    match frame.ball {
        TrackedBall::Cue => ("cue", "cue"),
        TrackedBall::Object => ("obj", "object"),
    }
}

/// Returns residuals.csv of a comparison: that of a fit, with the sample in front of each row (a
/// data set, or one label of a data set).
pub(super) fn of_comparison(comparison: &Comparison) -> String {
    let model = if comparison.is_refuted() { "refuted" } else { "" };
    let rows = comparison.residuals.iter().map(|residual| {
        let sample = &comparison.samples[residual.sample].title;
        format!("{},{}", quoted(sample), row(&residual.of_shot, model))
    });
    std::iter::once(format!("sample,{RESIDUALS}\n")).chain(rows).collect()
}

fn row(residual: &Residual, model: &str) -> String {
    let unit_si = residual.observable.unit_si();
    format!(
        "{},{},{},{},{},{},,,{model}\n",
        quoted(&residual.shot),
        residual.observable.column(),
        ascii(residual.observable.unit()),
        cells([residual.measured, residual.predicted, residual.sd].map(|si| si / unit_si)),
        cell(residual.standardized),
        cells([residual.cut.to_degrees(), residual.speed.unwrap_or(f64::NAN)]),
    )
}

/// Returns shots.csv as text. A cell whose number is unknown is empty.
pub fn shots(fit: &Fit) -> String {
    let estimates: HashMap<&str, Vec<OwnEstimate>> =
        fit.frames.iter().flat_map(FittedFilm::estimates).collect();
    let mut rows = Vec::new();
    for own in fit.residuals.chunk_by(|one, next| one.shot == next.shot) {
        let standardized = || own.iter().map(|residual| residual.standardized);
        let largest = |most: f64, z: f64| if z.abs() > most.abs() { z } else { most };
        let mut row = row_of([("shot", own[0].shot.clone()), ("used", "true".to_owned())]);
        let mut add = |column: &str, value: f64| row.insert(column.to_owned(), cell(value));
        add("cut_deg", own[0].cut.to_degrees());
        add("speed_m_s", own[0].speed.unwrap_or(f64::NAN));
        add("values", own.len() as f64);
        add("chi2", standardized().map(|z| z * z).sum());
        add("largest", standardized().fold(0.0, largest));
        for residual in own {
            let (name, unit_si) = (residual.observable.column(), residual.observable.unit_si());
            add(name, residual.measured / unit_si);
            add(&format!("{name}_sd"), residual.sd / unit_si);
            add(&format!("{name}_predicted"), residual.predicted / unit_si);
        }
        for estimate in estimates.get(own[0].shot.as_str()).into_iter().flatten() {
            add(estimate.column, estimate.value);
            let sd = if fit.refuted.is_some() { f64::NAN } else { estimate.sd };
            add(&format!("{}_sd", estimate.column), sd);
        }
        rows.push(row);
    }
    rows.extend(fit.shots_rejected.iter().map(|rejected| {
        let (shot, reason) = (rejected.shot.clone(), rejected.reason.clone());
        row_of([("shot", shot), ("used", "false".to_owned()), ("reason", reason)])
    }));
    table(SHOTS, &rows)
}

/// The cells of a row by the names of their columns.
pub(super) type Row = IndexMap<String, String>;

/// Returns a row with the given cells.
pub(super) fn row_of<const N: usize>(cells: [(&str, String); N]) -> Row {
    cells.map(|(column, cell)| (column.to_owned(), cell)).into_iter().collect()
}

/// Returns a table with these columns, and those that rows have besides, in the order in which they
/// first have them.
pub(super) fn table(columns: &str, rows: &[Row]) -> String {
    let known = columns.split(',').filter(|column| !column.is_empty());
    let columns: IndexSet<&str> = known.chain(rows.iter().flat_map(Row::keys).map(String::as_str)).collect();
    let line = |cells: Vec<Cow<str>>| cells.join(",") + "\n";
    let head = line(columns.iter().map(|column| quoted(column)).collect());
    let cell = |row: &Row, column: &str| row.get(column).map_or(String::new(), |cell| quoted(cell).into());
    let row = |row: &Row| line(columns.iter().map(|column| cell(row, column).into()).collect());
    head + &rows.iter().map(row).collect::<String>()
}

/// Returns a cell as RFC 4180 wants it.
fn quoted(cell: &str) -> Cow<'_, str> {
    let special = |c: char| matches!(c, ',' | '"' | '\n' | '\r' | '#');
    if cell.contains(special) || cell.trim() != cell {
        Cow::Owned(format!("\"{}\"", cell.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(cell)
    }
}

/// Returns the cell of a number, which is empty if it is not finite: very small and very large
/// numbers with an exponent.
fn cell(value: f64) -> String {
    if value.is_finite() {
        format!("{:?}", rounded(value)).trim_end_matches(".0").to_owned()
    } else {
        String::new()
    }
}

/// Returns the cells of numbers, with commas between.
fn cells<const N: usize>(values: [f64; N]) -> String {
    values.map(cell).join(",")
}
