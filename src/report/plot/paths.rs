//! A picture of a film: the paths of both balls in all shots, seen from above.

use plotters::prelude::*;

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, GREY, INK, LARGE, SMALL, shortened};
use super::drawing;
use super::drawing::Area;
use super::frame::{Frame, Rect};
use super::series::{color, marker};
use crate::extraction::{Impact, Quantity};
use crate::measurement::track::TrackShot;
use crate::report::ReportError;
use crate::trajectory::scene::Scene;

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
pub fn svg(
    name: &str,
    extracted: &[(TrackShot, Impact)],
    scene: &Scene,
) -> Result<Option<String>, ReportError> {
    if extracted.is_empty() {
        return Ok(None);
    }
    let each = extracted.len().div_ceil(MOST_SHOTS);
    let shots: Vec<Drawn> = extracted.iter().step_by(each).map(|shot| drawn(shot, scene)).collect();
    let all = || shots.iter().flat_map(|shot| shot.lines.iter().flatten());
    let x = Axis::around("x (cm)", all().map(|point| point.0));
    let y = Axis::around("y (cm)", all().map(|point| point.1));
    // equal scales: the height follows the width
    let wide = f64::from(WIDTH - 2 * EDGE - LABELS);
    let ratio = ((y.high - y.low) / (x.high - x.low)).min(HIGHEST);
    let height = HEAD + EDGE + LOWEST.max((wide * ratio) as i32 + LABELS);
    let failed = |reason| ReportError::Draw { dataset: name.to_owned(), reason };
    let counted = match shots.len() {
        all if all == extracted.len() => format!("{all} shots"),
        some => format!("{some} of {} shots", extracted.len()),
    };
    let size = (WIDTH as u32, height as u32);
    let title = (name, counted.as_str());
    let drawn = drawing::svg(size, |area| draw(area, title, height, &shots, (x, y)));
    drawn.map(|(text, ())| Some(text)).map_err(failed)
}

fn drawn((shot, impact): &(TrackShot, Impact), scene: &Scene) -> Drawn {
    let motion = impact.motion(scene);
    let place = |ball: usize, t: f64| if ball == 0 { motion.cue(t) } else { motion.object(t) };
    let cm = |[x, y]: [f64; 2]| (100.0 * x, 100.0 * y);
    let [from, to] = impact.window;
    let used = [&shot.cue, &shot.object].map(|samples| {
        let within = samples.iter().filter(|sample| (from..=to).contains(&sample.t));
        within.map(|sample| cm([sample.x, sample.y])).collect()
    });
    let lines = [0, 1].map(|ball| {
        let at = |step: u32| place(ball, from + (to - from) * f64::from(step) / f64::from(STEPS));
        (0..=STEPS).map(|step| cm(at(step))).collect()
    });
    let contact = [0, 1].map(|ball| cm(place(ball, impact.values[Quantity::Time as usize])));
    Drawn { points: used, lines, contact }
}

fn draw<DB: DrawingBackend>(
    area: &Area<DB>,
    (name, counted): (&str, &str),
    height: i32,
    shots: &[Drawn],
    (mut x, mut y): (Axis, Axis),
) -> Result<(), String> {
    let canvas = Canvas::new(area)?;
    canvas.text(&shortened(name, LARGE, WIDTH - 400), (22, 32), Anchor::Left, LARGE, INK)?;
    let words = format!(
        "{counted}, seen from above; points: tracked; lines: fitted; bars: line of centres at the impact"
    );
    canvas.text(&words, (22, 66), Anchor::Left, SMALL, GREY)?;
    for (ball, name) in ["cue ball", "object ball"].into_iter().enumerate() {
        let at = WIDTH - 330 + 160 * ball as i32;
        marker(&canvas, (at, 32), ball, 1.0)?;
        canvas.text(name, (at + 14, 32), Anchor::Left, SMALL, INK)?;
    }
    let rect = Rect { left: EDGE, top: HEAD, right: WIDTH - EDGE, bottom: height - EDGE };
    // the shorter side is widened until a centimetre is as long along either
    let (wide, high) = (f64::from(WIDTH - 2 * EDGE - LABELS), f64::from(height - HEAD - EDGE - LABELS));
    let scale = ((x.high - x.low) / wide).max((y.high - y.low) / high);
    for (axis, pixels) in [(&mut x, wide), (&mut y, high)] {
        let middle = 0.5 * (axis.low + axis.high);
        (axis.low, axis.high) = (middle - 0.5 * scale * pixels, middle + 0.5 * scale * pixels);
    }
    let frame = Frame::new(&canvas, rect, "", &[], (x, y))?;
    for shot in shots {
        for ball in [0, 1] {
            for (x, y) in &shot.points[ball] {
                let (px, py) = frame.at(*x, *y);
                canvas.circle((px, py), 2, color(ball).to_rgba())?;
            }
            frame.line(&shot.lines[ball], color(ball), 1)?;
        }
        frame.line(&shot.contact, INK, 2)?;
    }
    frame.axes()
}
