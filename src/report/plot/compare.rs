//! Figures of a comparison: estimates with their intervals, and the residuals of all labels.

use super::axis::is_drawable;
use super::residuals::STANDARDIZED;
use super::{Axis, Figure, Label, Panel, Point, color};
use crate::compare::{Compared, Comparison, LabelResidual};
use crate::fit::Residual;
use crate::report::number::count_of;

/// Height of an estimate and of what stands about all of a quantity, pixels.
const LINE: u32 = 34;
const AROUND: u32 = 128;

/// Height of the panels of residuals, pixels.
const ROW: u32 = 460;

/// Returns the estimates of each quantity with their intervals, below each other.
pub(crate) fn forest(comparison: &Comparison) -> Figure {
    let mut figure = Figure::new(format!("Estimates and 95 % intervals by {}", comparison.told_by));
    let has_interval = |q: &&Compared| q.estimates.iter().any(|value| value.interval_95.is_some());
    for compared in comparison.quantities.iter().filter(has_interval) {
        let height = AROUND + LINE * u32::try_from(compared.estimates.len()).unwrap_or(1);
        figure.add_rows(height, 1, vec![estimates(comparison, compared)]);
    }
    if figure.rows.is_empty() {
        figure.lines.push("Nothing here has an interval.".to_owned());
    }
    figure
}

fn estimates(comparison: &Comparison, compared: &Compared) -> Panel {
    let symbol = compared.quantity.symbol();
    let name =
        |label: Option<usize>| label.map_or("all", |label| comparison.labels[label].as_str()).to_owned();
    let words = compared.estimates.iter().rev().map(|value| name(value.label)).collect();
    let about = if compared.shared { "one value for all" } else { "" };
    let x = Axis::new(format!("{symbol}, {}", compared.quantity.meaning()));
    let mut panel = Panel::new(symbol, about, x, Axis::of_words(words));
    for (row, value) in compared.estimates.iter().rev().enumerate() {
        let (y, series) = (row as f64, value.label.unwrap_or(0));
        if let Some([low, high]) = value.interval_95 {
            panel.line([[low, y], [high, y]], color(series), 3);
        }
        let opacity = if value.fitted { 1.0 } else { 0.35 };
        panel.points([Point { opacity, ..Point::new([value.value, y], series) }]);
    }
    panel
}

/// Returns the residuals of all labels, each in its colour.
pub(crate) fn residuals(comparison: &Comparison) -> Figure {
    let mut figure = Figure::new("Residuals of the joint fit");
    figure.series.clone_from(&comparison.labels);
    let label = |residual: &LabelResidual| {
        let Residual { observable, standardized, .. } = residual.of_shot;
        Label::new(&comparison.shot_name(residual), observable.label(), standardized)
    };
    figure.labels = comparison.residuals.iter().map(label).collect();
    let cut = |residual: &Residual| residual.cut.to_degrees();
    let speed = |residual: &Residual| residual.speed.unwrap_or(f64::NAN);
    let x_of: [&dyn Fn(&Residual) -> f64; 2] = [&cut, &speed];
    let axes = [("against cut angle", super::CUT_AXIS), ("against speed", super::SPEED_AXIS)];
    let mut panels = Vec::new();
    for ((title, axis), x) in axes.into_iter().zip(x_of) {
        let points: Vec<Point> = comparison
            .residuals
            .iter()
            .enumerate()
            .map(|(i, residual)| Point {
                opacity: 0.6,
                label: Some(i),
                ..Point::new([x(&residual.of_shot), residual.of_shot.standardized], residual.label)
            })
            .filter(|point| point.at.iter().all(|x| is_drawable(*x)))
            .collect();
        if points.is_empty() {
            figure.lines.push(format!("Not drawn {title}: unknown for every shot."));
            continue;
        }
        let outside = comparison.residuals.len() - points.len();
        let about =
            if outside > 0 { format!("; {} left out", count_of(outside, "point")) } else { String::new() };
        let about = format!("band: ±2 sd{about}");
        let mut panel = Panel::new(title, about, Axis::new(axis), Axis::symmetric(STANDARDIZED, 2.5));
        panel.two_sd();
        panel.points(points);
        panels.push(panel);
    }
    figure.add_rows(ROW, 2, panels);
    figure
}
