//! accuracy.svg and accuracy.png: error against time, both on logarithmic scales.

use super::{Axis, Figure, Mark, Panel, Point, color};
use crate::studies::accuracy::{Errors, Includes, Row};

/// Height of the panels, pixels.
const ROW: u32 = 520;

/// Errors below are roundings.
const LEAST: f64 = 1e-16;

/// Returns the errors of a row that are meant, if it has them.
pub(in crate::report) type Pick = fn(&Row) -> Option<Errors>;

/// Returns the name of a row.
pub(in crate::report) fn name(row: &Row) -> String {
    let compliant = if row.includes == Includes::Compliant { ", compliant" } else { "" };
    format!("{}{compliant}", row.fidelity.name())
}

/// Returns error against time of every way.
pub fn figure(rows: &[Row]) -> Figure {
    let mut figure = Figure::new("Accuracy against time (ode and contact: at tolerances from 10⁻² down)");
    for row in rows {
        let series = name(row);
        if !figure.series.contains(&series) {
            figure.series.push(series);
        }
    }
    let kinds: [(&str, Pick); 2] = [
        ("Numerical error: against the same equations, solved closely", |row| row.numerical),
        ("Model error: against contact, integrated closely", |row| Some(row.model)),
    ];
    let panels = kinds.map(|(title, pick)| panel(title, &figure.series, rows, pick));
    figure.add_rows(ROW, 2, panels.into());
    figure
}

fn panel(title: &str, series: &[String], rows: &[Row], pick: Pick) -> Panel {
    let x = Axis::logarithmic("time of a collision (µs)");
    let y = Axis::logarithmic("error of a velocity over U (95 % of the shots)");
    let mut panel = Panel::new(title, "", x, y);
    for (index, name) in series.iter().enumerate() {
        let own = rows.iter().filter(|row| self::name(row) == *name);
        let points: Vec<[f64; 2]> = own
            .filter_map(|row| {
                let error = pick(row)?.speed.p95;
                error.is_finite().then(|| [(1e6 * row.seconds).log10(), error.max(LEAST).log10()])
            })
            .collect();
        match points[..] {
            // how far its accuracy reaches
            [[_, y]] => panel.marks.push(Mark::Horizontal(y)),
            _ => panel.line(points.iter().copied(), color(index), 2),
        }
        panel.points(points.into_iter().map(|at| Point::new(at, index)));
    }
    panel
}
