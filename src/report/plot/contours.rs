//! contours.svg and contours.png: which pairs of parameters the data allow together.

use plotters::prelude::*;

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, GREY, INK, LARGE, SMALL, shortened};
use super::drawing::Area;
use super::frame::{Frame, Rect};
use super::{MARGIN, WIDTH, drawing, failed};
use crate::fit::{Contour, Fit, Level};
use crate::report::{ReportError, title};

/// Height of the panels and of what stands above them, pixels.
const PANEL: i32 = 430;
const HEAD: i32 = 116;

/// The regions' colours, the likeliest darkest.
const REGIONS: [RGBColor; 2] = [RGBColor(0, 114, 178), RGBColor(86, 180, 233)];

/// contours.svg as text; `None` without a pair of free parameters.
pub fn svg(fit: &Fit) -> Option<Result<String, ReportError>> {
    let contours = drawn(fit)?;
    let done = drawing::svg(size(contours), |area| draw(area, fit, contours));
    Some(done.map(|(text, ())| text).map_err(|reason| failed(fit, reason)))
}

/// contours.png as bytes; `None` without a pair of free parameters.
pub fn png(fit: &Fit) -> Option<Result<Vec<u8>, ReportError>> {
    let contours = drawn(fit)?;
    let done = drawing::png(size(contours), |area| draw(area, fit, contours));
    Some(done.map_err(|reason| failed(fit, reason)))
}

fn drawn(fit: &Fit) -> Option<&[Contour]> {
    let contours = &fit.diagnostics.contours[..];
    (!contours.is_empty()).then_some(contours)
}

/// Three panels a row.
fn size(contours: &[Contour]) -> (u32, u32) {
    let rows = contours.len().div_ceil(3) as i32;
    (WIDTH, u32::try_from(HEAD + PANEL * rows).unwrap_or(WIDTH))
}

fn draw<DB: DrawingBackend>(area: &Area<DB>, fit: &Fit, contours: &[Contour]) -> Result<(), String> {
    let canvas = Canvas::new(area)?;
    let width = WIDTH as i32 - 2 * MARGIN;
    let name = format!("{}: pairs of parameters", title(fit));
    canvas.text(&shortened(&name, LARGE, width), (MARGIN, 34), Anchor::Left, LARGE, INK)?;
    let mut x = MARGIN;
    let probabilities = contours[0].levels.iter().map(|level| 100.0 * level.probability);
    for (probability, color) in probabilities.zip(REGIONS) {
        canvas.rectangle([(x, 64), (x + 26, 80)], color.mix(0.55))?;
        let text = format!("{probability:.0} % region, by χ² least over the others");
        canvas.text(&text, (x + 34, 72), Anchor::Left, SMALL, INK)?;
        x += 34 + super::canvas::width(&text, SMALL) + 30;
    }
    canvas.line(vec![(x, 72), (x + 26, 72)], GREY.to_rgba(), 1)?;
    canvas.text("ellipse of the covariance", (x + 34, 72), Anchor::Left, SMALL, INK)?;
    canvas.text(
        "A region holds the true pair with its probability.",
        (MARGIN, 98),
        Anchor::Left,
        SMALL,
        GREY,
    )?;
    let columns = contours.len().min(3);
    for (number, contour) in contours.iter().enumerate() {
        let (row, column) = ((number / 3) as i32, number % 3);
        let left = |column: usize| 6 + (WIDTH as i32 - 12) * column as i32 / columns as i32;
        let top = HEAD + PANEL * row;
        panel(
            &canvas,
            Rect { left: left(column), top, right: left(column + 1), bottom: top + PANEL - 8 },
            contour,
        )?;
    }
    Ok(())
}

fn panel<DB: DrawingBackend>(canvas: &Canvas<DB>, area: Rect, contour: &Contour) -> Result<(), String> {
    let [first, second] = contour.parameters.map(|parameter| parameter.symbol());
    let named = contour.parameters.map(|p| match p.unit() {
        "" => p.symbol().to_owned(),
        unit => format!("{} ({unit})", p.symbol()),
    });
    // the ellipses may run beyond the bounds, but not far beyond what is allowed
    let reach = |axis: usize| {
        let edges = contour.levels.iter().flat_map(|level| &level.edge).map(move |p| p[axis]);
        edges.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let axis = |name: &str, which: usize| {
        let (low, high) = reach(which);
        let room = 0.25 * (high - low);
        let ellipses = contour.levels.iter().flat_map(|level| &level.ellipse);
        let ellipses = ellipses.map(|p| p[which].clamp(low - room, high + room));
        Axis::around(name, ellipses.chain([low, high]))
    };
    let title = format!("{second} against {first}");
    let frame = Frame::new(canvas, area, &title, &[], (axis(&named[0], 0), axis(&named[1], 1)))?;
    for (level, color) in contour.levels.iter().zip(REGIONS).rev() {
        let edge: Vec<_> = level.edge.iter().map(|[x, y]| frame.at(*x, *y)).collect();
        canvas.polygon(edge, color.mix(0.55))?;
    }
    for Level { ellipse, .. } in &contour.levels {
        for pair in closed(ellipse).windows(2) {
            // what is beyond the panel is left out rather than bent along its edge
            let within = |[x, y]: &[f64; 2]| {
                (frame.x.low..=frame.x.high).contains(x) && (frame.y.low..=frame.y.high).contains(y)
            };
            if pair.iter().all(within) {
                frame.line(&[pair[0].into(), pair[1].into()], GREY, 1)?;
            }
        }
    }
    canvas.circle(frame.at(contour.centre[0], contour.centre[1]), 4, INK.to_rgba())?;
    frame.axes()
}

fn closed(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    points.iter().chain(points.first()).copied().collect()
}
