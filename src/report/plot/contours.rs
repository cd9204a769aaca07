//! contours.svg and contours.png: which pairs of parameters the data allow together.

use plotters::prelude::RGBColor;

use super::axis::ends;
use super::{Axis, Figure, GREY, Panel, Point};
use crate::fit::{Contour, Fit};
use crate::report::title;

/// Height of a row of panels, pixels.
const ROW: u32 = 420;

/// Colours of the regions, the likeliest last.
const REGIONS: [RGBColor; 2] = [RGBColor(166, 206, 236), RGBColor(112, 170, 214)];

/// Part of a region by which its ellipse is drawn beyond it.
const BEYOND: f64 = 0.25;

/// Returns the regions of all pairs of free parameters.
pub fn figure(fit: &Fit) -> Figure {
    let contours = &fit.diagnostics.contours;
    let mut figure = Figure::new(format!("{}: pairs of parameters", title(fit)));
    figure.lines = vec![
        "Dark and light: the true pair lies there with 68 % and 95 % probability. Grey: the ellipses of the covariance.".to_owned(),
    ];
    figure.add_rows(ROW, contours.len().clamp(2, 3), contours.iter().map(panel).collect());
    figure
}

fn panel(contour: &Contour) -> Panel {
    let [first, second] = contour.parameters.map(|parameter| parameter.symbol());
    let [x, y] = contour.parameters.map(|parameter| match parameter.unit() {
        "" => Axis::new(parameter.symbol()),
        unit => Axis::new(format!("{} ({unit})", parameter.symbol())),
    });
    let mut panel = Panel::new(format!("{second} against {first}"), "", x, y);
    let mut levels: Vec<_> = contour.levels.iter().collect();
    levels.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    for (level, color) in levels.iter().zip(REGIONS) {
        panel.area(level.edge.iter().copied(), color);
    }
    let reach = [0, 1].map(|axis| {
        let values = levels.iter().flat_map(|level| &level.edge).map(|point| point[axis]);
        let [low, high] = ends(values);
        let room = BEYOND * (high - low);
        low - room..=high + room
    });
    let is_within = |point: &[f64; 2]| reach.iter().zip(point).all(|(range, value)| range.contains(value));
    for level in &levels {
        let closed: Vec<[f64; 2]> = level.ellipse.iter().chain(level.ellipse.first()).copied().collect();
        for part in closed.split(|point| !is_within(point)).filter(|part| part.len() > 1) {
            panel.line(part.iter().copied(), GREY, 1);
        }
    }
    panel.points([Point::new(contour.centre, 4)]);
    panel
}
