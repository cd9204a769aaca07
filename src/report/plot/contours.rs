//! contours.svg and contours.png: which pairs of parameters the data allow together.

use plotters::prelude::{Color, RGBColor};

use super::axis::Axis;
use super::frame::{Frame, Rect};
use super::picture::{GREY, INK, LARGE, Picture, SMALL, shortened, width};
use super::{MARGIN, WIDTH};
use crate::fit::{Contour, Fit, Level};
use crate::report::title;

/// Height of the panels and of what stands above them, pixels.
const PANEL: i32 = 430;
const HEAD: i32 = 116;

/// The regions' colours, the likeliest darkest.
const REGIONS: [RGBColor; 2] = [RGBColor(0, 114, 178), RGBColor(86, 180, 233)];

/// The regions of all pairs, three panels a row; `None` without a pair of free parameters.
pub fn picture(fit: &Fit) -> Option<Picture> {
    let contours = &fit.diagnostics.contours;
    let levels = &contours.first()?.levels;
    let rows = contours.len().div_ceil(3) as i32;
    let mut picture = Picture::new(&fit.dataset, WIDTH as i32, HEAD + PANEL * rows);
    let name = format!("{}: pairs of parameters", title(fit));
    picture.title(&shortened(&name, LARGE, WIDTH as i32 - 2 * MARGIN), 34);
    let mut x = MARGIN;
    for (level, color) in levels.iter().zip(REGIONS) {
        picture.rectangle([(x, 64), (x + 26, 80)], color.mix(0.55));
        let text = format!("{:.0} % region, by χ² least over the others", 100.0 * level.probability);
        picture.label(&text, (x + 34, 72), INK);
        x += 34 + width(&text, SMALL) + 30;
    }
    picture.line(vec![(x, 72), (x + 26, 72)], GREY, 1);
    picture.label("ellipse of the covariance", (x + 34, 72), INK);
    picture.label("A region holds the true pair with its probability.", (MARGIN, 98), GREY);
    let columns = contours.len().min(3);
    for (number, contour) in contours.iter().enumerate() {
        let top = HEAD + PANEL * (number / 3) as i32;
        panel(&mut picture, Rect::of_row(top, PANEL, number % 3, columns), contour);
    }
    Some(picture)
}

fn panel(picture: &mut Picture, area: Rect, contour: &Contour) {
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
    let mut frame = Frame::new(picture, area, &title, &[], (axis(&named[0], 0), axis(&named[1], 1)));
    for (level, color) in contour.levels.iter().zip(REGIONS).rev() {
        frame.polygon(level.edge.iter().map(|[x, y]| (*x, *y)), color.mix(0.55));
    }
    for Level { ellipse, .. } in &contour.levels {
        for pair in closed(ellipse).windows(2) {
            // what is beyond the panel is left out rather than bent along its edge
            let within = |[x, y]: &[f64; 2]| {
                (frame.x.low..=frame.x.high).contains(x) && (frame.y.low..=frame.y.high).contains(y)
            };
            if pair.iter().all(within) {
                frame.line(&[pair[0].into(), pair[1].into()], GREY, 1);
            }
        }
    }
    frame.dot(contour.centre[0], contour.centre[1], 4, INK);
    frame.axes();
}

fn closed(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    points.iter().chain(points.first()).copied().collect()
}
