//! Pictures of a comparison: the forest plot, and the residuals of all labels laid over each other.

use plotters::prelude::*;

use super::axis::{Axis, drawable};
use super::canvas::{Anchor, BAND, Canvas, GREY, INK, LARGE, SMALL, shortened};
use super::drawing::Area;
use super::frame::{Frame, Rect};
use super::series::{color, marker};
use super::{MARGIN, Spots, WIDTH, drawing};
use crate::compare::{Compared, Comparison, LabelResidual};
use crate::fit::Residual;
use crate::report::ReportError;
use crate::report::number::plain;

/// Height of one estimate in the forest plot, and of what stands about them, pixels.
const LINE: i32 = 34;
const AROUND: i32 = 128;

/// Height of the title and the legend, pixels.
const HEAD: i32 = 60;

/// Height of a residual panel, pixels.
const PANEL: i32 = 460;

/// forest.svg as text: each quantity's estimates with their intervals, below each other.
pub(crate) fn forest_svg(comparison: &Comparison) -> Result<String, ReportError> {
    let drawn = drawing::svg(size(forest_height(comparison)), |area| forest(comparison, area));
    drawn.map(|(text, ())| text).map_err(failed)
}

/// forest.png as bytes.
pub(crate) fn forest_png(comparison: &Comparison) -> Result<Vec<u8>, ReportError> {
    drawing::png(size(forest_height(comparison)), |area| forest(comparison, area)).map_err(failed)
}

/// residuals.svg as text, and where the points of the residuals are on it: x, y, index.
pub(crate) fn residuals_svg(comparison: &Comparison) -> Result<(String, Spots), ReportError> {
    drawing::svg(size(residuals_height(comparison)), |area| residuals(comparison, area)).map_err(failed)
}

/// residuals.png as bytes.
pub(crate) fn residuals_png(comparison: &Comparison) -> Result<Vec<u8>, ReportError> {
    drawing::png(size(residuals_height(comparison)), |area| residuals(comparison, area)).map_err(failed)
}

fn failed(reason: String) -> ReportError {
    ReportError::Draw { dataset: "the comparison".to_owned(), reason }
}

fn size(height: i32) -> (u32, u32) {
    (WIDTH, u32::try_from(height).unwrap_or(WIDTH))
}

fn residuals_height(comparison: &Comparison) -> i32 {
    HEAD + legend_rows(comparison) * 26 + PANEL
}

/// Where a residual stands along an axis.
type Place = fn(&Residual) -> f64;

/// Quantities with an interval to draw.
fn drawn(comparison: &Comparison) -> impl Iterator<Item = &Compared> {
    comparison.quantities.iter().filter(|q| q.estimates.iter().any(|value| value.interval_95.is_some()))
}

fn panel_height(compared: &Compared) -> i32 {
    AROUND + LINE * compared.estimates.len() as i32
}

fn forest_height(comparison: &Comparison) -> i32 {
    HEAD + drawn(comparison).map(panel_height).sum::<i32>().max(40)
}

fn forest<DB: DrawingBackend>(comparison: &Comparison, area: &Area<DB>) -> Result<(), String> {
    let canvas = Canvas::new(area)?;
    let title = format!("Estimates and 95 % intervals by {}", comparison.told_by);
    canvas.text(&title, (MARGIN, 34), Anchor::Left, LARGE, INK)?;
    let mut top = HEAD;
    for compared in drawn(comparison) {
        let bottom = top + panel_height(compared) - 8;
        let ends = compared.estimates.iter().flat_map(|value| {
            value.interval_95.into_iter().flatten().chain([value.value]).collect::<Vec<_>>()
        });
        let x =
            Axis::around(format!("{}, {}", compared.quantity.symbol(), compared.quantity.meaning()), ends);
        let count = compared.estimates.len() as f64;
        let y = Axis { name: String::new(), low: -0.5, high: count - 0.5, words: None, logarithmic: false };
        // names stand where the numbers of an axis would
        let left = 300;
        let area = Rect { left, top, right: WIDTH as i32, bottom };
        let remark = if compared.shared { vec!["one value for all".to_owned()] } else { Vec::new() };
        let frame = Frame::unlabelled(&canvas, area, compared.quantity.symbol(), &remark, (x, y))?;
        for (row, value) in compared.estimates.iter().enumerate() {
            let y = count - 1.0 - row as f64;
            let name = value.label.map_or("all", |label| comparison.labels[label].as_str());
            let (_, place) = frame.at(value.value, y);
            canvas.text(&shortened(name, SMALL, left - 30), (left + 18, place), Anchor::Right, SMALL, INK)?;
            if let Some([low, high]) = value.interval_95 {
                frame.line(&[(low, y), (high, y)], color(value.label.unwrap_or(0)), 3)?;
            }
            let opacity = if value.fitted { 1.0 } else { 0.35 };
            marker(&canvas, frame.at(value.value, y), value.label.unwrap_or(0), opacity)?;
        }
        frame.axes()?;
        top = bottom + 8;
    }
    if top == HEAD {
        canvas.text("Nothing here has an interval.", (MARGIN, HEAD), Anchor::Left, SMALL, GREY)?;
    }
    Ok(())
}

fn legend_rows(comparison: &Comparison) -> i32 {
    (comparison.labels.len() as i32 + 2) / 3
}

fn residuals<DB: DrawingBackend>(comparison: &Comparison, area: &Area<DB>) -> Result<Spots, String> {
    let canvas = Canvas::new(area)?;
    canvas.text("Residuals of the joint fit", (MARGIN, 34), Anchor::Left, LARGE, INK)?;
    let width = (WIDTH as i32 - 2 * MARGIN) / 3;
    for (label, name) in comparison.labels.iter().enumerate() {
        let (x, y) = (MARGIN + width * (label as i32 % 3), HEAD + 10 + 26 * (label as i32 / 3));
        marker(&canvas, (x + 6, y), label, 1.0)?;
        canvas.text(&shortened(name, SMALL, width - 30), (x + 20, y), Anchor::Left, SMALL, INK)?;
    }
    let top = HEAD + legend_rows(comparison) * 26;
    let mut spots = Vec::new();
    let panels: [(&str, &str, Place); 2] = [
        ("against cut angle", "cut angle φ (°)", |r| r.cut.to_degrees()),
        ("against speed", "cue-ball speed before impact (m/s)", |r| r.speed.unwrap_or(f64::NAN)),
    ];
    for (number, (title, name, of)) in panels.into_iter().enumerate() {
        let half = WIDTH as i32 / 2;
        let left = number as i32 * half;
        let area = Rect { left: left + 6, top, right: left + half - 6, bottom: top + PANEL - 8 };
        let seen: Vec<(usize, &LabelResidual)> = comparison
            .residuals
            .iter()
            .enumerate()
            .filter(|(_, r)| drawable(r.of_shot.standardized) && drawable(of(&r.of_shot)))
            .collect();
        if seen.is_empty() {
            super::frame::message(&canvas, area, title, "Unknown for every shot.")?;
            continue;
        }
        let x = Axis::around(name, seen.iter().map(|(_, r)| of(&r.of_shot)));
        let y = Axis::symmetric(
            "(measured − predicted) / sd",
            seen.iter().map(|(_, r)| r.of_shot.standardized),
            2.5,
        );
        let outside = comparison.residuals.len() - seen.len();
        let remarks = if outside > 0 {
            vec![format!("{} point(s) left out", plain(outside as f64, 6))]
        } else {
            Vec::new()
        };
        let frame = Frame::new(&canvas, area, title, &remarks, (x, y))?;
        let corners = [frame.at(frame.x.low, -2.0), frame.at(frame.x.high, 2.0)];
        canvas.rectangle(corners, BAND.mix(0.8))?;
        for (index, residual) in seen {
            let (x, y) = frame.at(of(&residual.of_shot), residual.of_shot.standardized);
            marker(&canvas, (x, y), residual.label, 0.6)?;
            spots.push((x, y, index));
        }
        frame.line(&[(frame.x.low, 0.0), (frame.x.high, 0.0)], INK, 1)?;
        frame.axes()?;
    }
    Ok(spots)
}
