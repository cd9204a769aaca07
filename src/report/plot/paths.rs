//! A picture of a film: the paths of both balls in all shots, seen from above.

use super::axis::Axis;
use super::frame::{Frame, Rect};
use super::picture::{GREY, INK, LARGE, Picture, shortened};
use super::series::{color, two_balls};
use super::track::{cm, instants, window};
use crate::fit::FittedFilm;
use crate::problem::Impact;
use crate::report::ReportError;

const WIDTH: i32 = 900;
/// Above the plan, and between it and the edges.
const HEAD: i32 = 84;
const EDGE: i32 = 10;
/// What names and numbers of the axes take of the plan.
const LABELS: i32 = 90;

/// The plan is at least so high, and at most so many times as high as wide.
const LOWEST: i32 = 300;
const HIGHEST: f64 = 0.85;

/// More shots than these would only cover each other; they are spread over all.
const MOST_SHOTS: usize = 60;

/// Points of a fitted path.
const STEPS: u32 = 60;

/// One shot, in centimetres.
struct Drawn {
    /// Tracked, of either ball.
    points: [Vec<(f64, f64)>; 2],
    /// Fitted, of either ball.
    lines: [Vec<(f64, f64)>; 2],
    contact: [(f64, f64); 2],
}

/// The picture as SVG; `None` where nothing was extracted.
pub fn svg(name: &str, film: &FittedFilm) -> Result<Option<String>, ReportError> {
    let names = film.names();
    let each = names.len().div_ceil(MOST_SHOTS).max(1);
    let shots: Vec<Drawn> =
        names.iter().step_by(each).filter_map(|name| film.impact(name)).map(|own| drawn(&own)).collect();
    if shots.is_empty() {
        return Ok(None);
    }
    let all = || shots.iter().flat_map(|shot| shot.lines.iter().flatten());
    let mut x = Axis::around("x (cm)", all().map(|point| point.0));
    let mut y = Axis::around("y (cm)", all().map(|point| point.1));
    // equal scales: the height follows the width
    let wide = f64::from(WIDTH - 2 * EDGE - LABELS);
    let ratio = ((y.high - y.low) / (x.high - x.low)).min(HIGHEST);
    let height = HEAD + EDGE + LOWEST.max((wide * ratio) as i32 + LABELS);
    let mut picture = Picture::new(name, WIDTH, height);
    picture.title(&shortened(name, LARGE, WIDTH - 400), 32);
    let counted = match shots.len() {
        all if all == names.len() => format!("{all} shots"),
        some => format!("{some} of {} shots", names.len()),
    };
    let words = "seen from above; points: tracked; lines: fitted; bars: line of centres at the impact";
    picture.label(&format!("{counted}, {words}"), (22, 66), GREY);
    two_balls(&mut picture, ["cue ball", "object ball"], [WIDTH - 330, WIDTH - 170]);
    let rect = Rect { left: EDGE, top: HEAD, right: WIDTH - EDGE, bottom: height - EDGE };
    // the shorter side is widened until a centimetre is as long along either
    let high = f64::from(height - HEAD - EDGE - LABELS);
    let scale = ((x.high - x.low) / wide).max((y.high - y.low) / high);
    x.widen(scale * wide);
    y.widen(scale * high);
    let mut frame = Frame::new(&mut picture, rect, "", &[], (x, y));
    for shot in shots {
        for ball in [0, 1] {
            for (x, y) in &shot.points[ball] {
                frame.dot(*x, *y, 2, color(ball));
            }
            frame.line(&shot.lines[ball], color(ball), 1);
        }
        frame.line(&shot.contact, INK, 2);
    }
    frame.axes();
    picture.svg().map(Some)
}

fn drawn(impact: &Impact) -> Drawn {
    let place = |ball: usize, t: f64| cm(impact.paths.place(ball, t));
    Drawn {
        points: impact.seen.each_ref().map(|seen| seen.iter().map(|(_, place)| cm(*place)).collect()),
        lines: [0, 1].map(|ball| instants(window(&impact.seen), STEPS).map(|t| place(ball, t)).collect()),
        contact: [0, 1].map(|ball| place(ball, impact.time)),
    }
}
