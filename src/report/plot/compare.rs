//! Pictures of a comparison: the forest plot, and the residuals of all labels laid over each other.

use super::axis::{Axis, drawable};
use super::frame::{Frame, Rect, message};
use super::panels::{CUT, SPEED, STANDARDIZED};
use super::picture::{Anchor, GREY, INK, Picture, SMALL, shortened};
use super::series::{ROW, color, marker};
use super::{MARGIN, WIDTH};
use crate::compare::{Compared, Comparison, LabelResidual};
use crate::fit::Residual;
use crate::report::number::count_of;

/// What both pictures are of.
const OF: &str = "the comparison";

/// Height of one estimate in the forest plot, and of what stands about them, pixels.
const LINE: i32 = 34;
const AROUND: i32 = 128;

/// Height of the title and the legend, pixels.
const HEAD: i32 = 60;

/// Height of a residual panel, pixels.
const PANEL: i32 = 460;

/// Where a residual stands along an axis.
type Place = fn(&Residual) -> f64;

fn panel_height(compared: &Compared) -> i32 {
    AROUND + LINE * compared.estimates.len() as i32
}

/// Each quantity's estimates with their intervals, below each other.
pub(crate) fn forest(comparison: &Comparison) -> Picture {
    let has_interval = |q: &&Compared| q.estimates.iter().any(|value| value.interval_95.is_some());
    let drawn: Vec<&Compared> = comparison.quantities.iter().filter(has_interval).collect();
    let height = drawn.iter().map(|compared| panel_height(compared)).sum::<i32>().max(40);
    let mut picture = Picture::new(OF, WIDTH as i32, HEAD + height);
    picture.title(&format!("Estimates and 95 % intervals by {}", comparison.told_by), 34);
    let mut top = HEAD;
    for compared in drawn {
        let bottom = top + panel_height(compared) - 8;
        let ends = compared.estimates.iter().flat_map(|value| {
            value.interval_95.into_iter().flatten().chain([value.value]).collect::<Vec<_>>()
        });
        let symbol = compared.quantity.symbol();
        let x = Axis::around(format!("{symbol}, {}", compared.quantity.meaning()), ends);
        let count = compared.estimates.len() as f64;
        let y = Axis::between("", -0.5, count - 0.5);
        // names stand where the numbers of an axis would
        let left = 300;
        let area = Rect { left, top, right: WIDTH as i32, bottom };
        let remark = if compared.shared { vec!["one value for all".to_owned()] } else { Vec::new() };
        let mut frame = Frame::unlabelled(&mut picture, area, symbol, &remark, (x, y));
        for (row, value) in compared.estimates.iter().enumerate() {
            let y = count - 1.0 - row as f64;
            let name = value.label.map_or("all", |label| comparison.labels[label].as_str());
            let at = (left + 18, frame.at(value.value, y).1);
            frame.picture.text(&shortened(name, SMALL, left - 30), at, Anchor::Right, SMALL, INK);
            let series = value.label.unwrap_or(0);
            if let Some([low, high]) = value.interval_95 {
                frame.line(&[(low, y), (high, y)], color(series), 3);
            }
            frame.marker((value.value, y), series, if value.fitted { 1.0 } else { 0.35 });
        }
        frame.axes();
        top = bottom + 8;
    }
    if top == HEAD {
        picture.label("Nothing here has an interval.", (MARGIN, HEAD), GREY);
    }
    picture
}

/// The residuals of all labels, each in its colour.
pub(crate) fn residuals(comparison: &Comparison) -> Picture {
    let top = HEAD + comparison.labels.len().div_ceil(3) as i32 * ROW;
    let mut picture = Picture::new(OF, WIDTH as i32, top + PANEL);
    picture.title("Residuals of the joint fit", 34);
    let width = (WIDTH as i32 - 2 * MARGIN) / 3;
    for (label, name) in comparison.labels.iter().enumerate() {
        let (x, y) = (MARGIN + width * (label as i32 % 3), HEAD + 10 + ROW * (label as i32 / 3));
        marker(&mut picture, (x + 6, y), label, 1.0);
        picture.label(&shortened(name, SMALL, width - 30), (x + 20, y), INK);
    }
    let panels: [(&str, &str, Place); 2] = [
        ("against cut angle", CUT.axis, |r| r.cut.to_degrees()),
        ("against speed", SPEED.axis, |r| r.speed.unwrap_or(f64::NAN)),
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
            message(&mut picture, area, title, "Unknown for every shot.");
            continue;
        }
        let x = Axis::around(name, seen.iter().map(|(_, r)| of(&r.of_shot)));
        let y = Axis::symmetric(STANDARDIZED, seen.iter().map(|(_, r)| r.of_shot.standardized), 2.5);
        let outside = comparison.residuals.len() - seen.len();
        let remark = (outside > 0).then(|| format!("{} left out", count_of(outside, "point")));
        let remarks: Vec<String> = remark.into_iter().collect();
        let mut frame = Frame::new(&mut picture, area, title, &remarks, (x, y));
        frame.two_sd();
        for (index, residual) in seen {
            let place = (of(&residual.of_shot), residual.of_shot.standardized);
            frame.spot(place, index, residual.label, 0.6);
        }
        frame.horizontal(0.0, INK);
        frame.axes();
    }
    picture
}
