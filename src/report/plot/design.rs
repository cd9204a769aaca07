//! design.svg and design.png: standard errors against the cut angle, one row of panels for each parameter, one
//! column for each speed.

use super::axis::Axis;
use super::frame::{Frame, Rect, message};
use super::picture::{GREY, Picture, SMALL, shortened};
use super::series::{Legend, color};
use super::{MARGIN, WIDTH};
use crate::design::{Cell, Design};
use crate::measurement::parameter::Parameter;
use crate::report::number::plain;

/// Height of a row of panels, pixels.
const PANEL: i32 = 380;
const HEAD: i32 = 88;

/// Standard errors this many times the least of a parameter tell nothing worth drawing.
const WORST: f64 = 1e3;

/// Kinds of shots stand beside each other by this part of the axis.
const ASIDE: f64 = 0.025;

/// At most so many speeds are drawn.
const COLUMNS: usize = 3;

/// Standard errors against the cut angle, of all cells.
pub fn picture(design: &Design) -> Picture {
    let kinds = &design.expected.kinds;
    let speeds: Vec<Vec<f64>> = (0..kinds.len()).map(|kind| design.speeds(kind)).collect();
    let columns = speeds.iter().map(Vec::len).max().unwrap_or(1).clamp(1, COLUMNS);
    let told = |p: &Parameter| design.cells.iter().any(|cell| cell.std_errors[*p as usize].is_some());
    let rows: Vec<Parameter> = Parameter::COEFFICIENTS.into_iter().filter(told).collect();
    let names = kinds
        .iter()
        .map(|kind| shortened(&format!("{} ({} shots)", kind.name, kind.shots), SMALL, WIDTH as i32 / 2));
    let legend = Legend::new(names, WIDTH as i32 - 2 * MARGIN - 28);
    let head = HEAD + legend.height() + 6;
    let mut picture = Picture::new("the design", WIDTH as i32, head + PANEL * rows.len().max(1) as i32);
    picture.title("Standard errors that shots of one cut angle and speed give", 34);
    let remark = "Without a point: such shots by themselves do not tell it. Kinds stand a little side by side, so that equal errors are seen.";
    picture.label(remark, (MARGIN, 66), GREY);
    legend.draw(&mut picture, (MARGIN, HEAD - 5), 1.0);
    for (parameter, top) in rows.iter().zip((head..).step_by(PANEL as usize)) {
        for column in 0..columns {
            let of_kinds: Vec<Option<f64>> = speeds.iter().map(|own| own.get(column).copied()).collect();
            panel(&mut picture, Rect::of_row(top, PANEL, column, columns), design, *parameter, &of_kinds);
        }
    }
    if rows.is_empty() {
        let text = "No shot at a single cut angle and speed tells a parameter by itself.";
        message(&mut picture, Rect::of_row(head, PANEL, 0, 1), "Nothing to draw", text);
    }
    picture
}

/// The standard errors of a parameter, of each kind at one speed, if it has so many.
fn panel(picture: &mut Picture, rect: Rect, design: &Design, parameter: Parameter, speeds: &[Option<f64>]) {
    let (cells, symbol) = (&design.cells, parameter.symbol());
    let all = cells.iter().filter_map(|cell| cell.std_errors[parameter as usize]);
    let most = WORST * all.fold(f64::INFINITY, f64::min);
    let told =
        |cell: &Cell| cell.std_errors[parameter as usize].filter(|error| *error > 0.0 && *error <= most);
    let mut names: Vec<f64> = speeds.iter().flatten().copied().collect();
    names.sort_by(f64::total_cmp);
    names.dedup();
    let title = match names[..] {
        [] => String::new(),
        [one] => format!("{symbol}, {} m/s", plain(one, 3)),
        [least, .., most] => format!("{symbol}, {} to {} m/s", plain(least, 3), plain(most, 3)),
    };
    let x = Axis::around("cut angle φ (°)", cells.iter().map(|cell| cell.cut_deg));
    let y = Axis::logarithmic(format!("standard error of {symbol}"), cells.iter().filter_map(told));
    let mut frame = Frame::new(picture, rect, &title, &[], (x, y));
    // equal errors of several kinds would hide each other: they stand side by side
    let step = ASIDE * (frame.x.high - frame.x.low);
    for (kind, speed) in speeds.iter().enumerate() {
        let aside = (kind as f64 - 0.5 * (speeds.len() as f64 - 1.0)) * step;
        let own = cells.iter().filter(|cell| cell.kind == kind && Some(cell.speed_m_s) == *speed);
        let points: Vec<Option<(f64, f64)>> =
            own.map(|cell| told(cell).map(|error| (cell.cut_deg + aside, error.log10()))).collect();
        // a gap where it is not told
        for pair in points.windows(2) {
            if let [Some(a), Some(b)] = pair {
                frame.line(&[*a, *b], color(kind), 2);
            }
        }
        for place in points.into_iter().flatten() {
            frame.marker(place, kind, 1.0);
        }
    }
    frame.axes();
}
