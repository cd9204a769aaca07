//! A picture of one shot: both tracks from above with the fitted paths, and what the fit leaves.

use plotters::prelude::*;

use super::axis::Axis;
use super::canvas::{Anchor, Canvas, GREY, INK, LARGE, SMALL, shortened};
use super::frame::{Frame, Rect};
use super::series::{color, marker};
use crate::impact::{Impact, Quantity, Scene};
use crate::report::ReportError;
use crate::track::{Sample, TrackShot};

const WIDTH: i32 = 1200;
const HEIGHT: i32 = 660;

/// Side of the square plan, pixels.
const PLAN: i32 = 540;

/// The picture of a shot as SVG: plan in centimetres, residuals in millimetres against time.
pub fn svg(shot: &TrackShot, impact: &Impact, scene: &Scene) -> Result<String, ReportError> {
    let mut text = String::new();
    let size = (WIDTH as u32, HEIGHT as u32);
    let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
    let drawn = draw(&area, shot, impact, scene);
    drop(area);
    match drawn {
        Ok(()) => Ok(text),
        Err(reason) => Err(ReportError::Draw { dataset: format!("shot {}", shot.name), reason }),
    }
}

fn draw<DB: DrawingBackend>(
    area: &DrawingArea<DB, plotters::coord::Shift>,
    shot: &TrackShot,
    impact: &Impact,
    scene: &Scene,
) -> Result<(), String> {
    let canvas = Canvas::new(area)?;
    let title = shortened(&format!("shot {}", shot.name), LARGE, WIDTH - 44);
    canvas.text(&title, (22, 32), Anchor::Left, LARGE, INK)?;
    canvas.text(&summary(impact), (22, 66), Anchor::Left, SMALL, GREY)?;

    let [from, to] = impact.window;
    let used = |sample: &&Sample| (from..=to).contains(&sample.t);
    let cm = |metres: f64| 100.0 * metres;
    let balls = [("cue ball", &shot.cue), ("object ball", &shot.object)];
    let motion = impact.motion(scene);
    let place = |ball: usize, t: f64| if ball == 0 { motion.cue(t) } else { motion.object(t) };

    // equal scales: the longer side decides
    let all = || balls.iter().flat_map(|(_, samples)| samples.iter().filter(used));
    let (mut x, mut y) =
        (Axis::around("x (cm)", all().map(|s| cm(s.x))), Axis::around("y (cm)", all().map(|s| cm(s.y))));
    let half = 0.5 * (x.high - x.low).max(y.high - y.low);
    for axis in [&mut x, &mut y] {
        let middle = 0.5 * (axis.low + axis.high);
        (axis.low, axis.high) = (middle - half, middle + half);
    }
    let plan = Rect { left: 10, top: 84, right: 10 + PLAN + 60, bottom: HEIGHT - 10 };
    let frame = Frame::new(
        &canvas,
        plan,
        "Seen from above",
        &["points: tracked; lines: fitted".to_string()],
        (x, y),
    )?;
    let steps = 200;
    for (ball, (_, samples)) in balls.iter().enumerate() {
        let path: Vec<(f64, f64)> = (0..=steps)
            .map(|step| {
                let [x, y] = place(ball, from + (to - from) * f64::from(step) / f64::from(steps));
                (cm(x), cm(y))
            })
            .collect();
        for sample in samples.iter().filter(used) {
            marker(&canvas, frame.at(cm(sample.x), cm(sample.y)), ball, 0.45)?;
        }
        frame.line(&path, color(ball), 2)?;
    }
    frame.axes()?;

    let time = impact.values[Quantity::Time as usize];
    let mut points = Vec::new();
    for (ball, (_, samples)) in balls.iter().enumerate() {
        for sample in samples.iter().filter(used) {
            let [x, y] = place(ball, sample.t);
            points.push((ball, 1e3 * (sample.t - time), 1e3 * (sample.x - x), 1e3 * (sample.y - y)));
        }
    }
    // wrong frames would squeeze the others: they stand at the edge
    let most = 6e3 * impact.position_sd;
    for (row, (name, pick)) in [("x residual (mm)", 0), ("y residual (mm)", 1)].into_iter().enumerate() {
        let value = |p: &(usize, f64, f64, f64)| if pick == 0 { p.2 } else { p.3 };
        let top = 84 + row as i32 * 285;
        let rect = Rect { left: PLAN + 90, top, right: WIDTH - 6, bottom: top + 285 };
        let axes = (
            Axis::around("time from the impact (ms)", points.iter().map(|p| p.1)),
            Axis::symmetric(name, points.iter().map(|p| value(p).clamp(-most, most)), 1e-6),
        );
        let title = if row == 0 { "Tracked less fitted" } else { "" };
        let frame = Frame::new(&canvas, rect, title, &[], axes)?;
        let (low, high) = (frame.x.low, frame.x.high);
        frame.line(&[(low, 0.0), (high, 0.0)], INK, 1)?;
        frame.line(&[(0.0, frame.y.low), (0.0, frame.y.high)], GREY, 1)?;
        for point in &points {
            marker(&canvas, frame.at(point.1, value(point)), point.0, 0.6)?;
        }
        frame.axes()?;
    }
    for (ball, (name, _)) in balls.iter().enumerate() {
        let x = WIDTH - 360 + 170 * ball as i32;
        marker(&canvas, (x, 66), ball, 1.0)?;
        canvas.text(name, (x + 14, 66), Anchor::Left, SMALL, INK)?;
    }
    Ok(())
}

fn summary(impact: &Impact) -> String {
    let v = |x: Quantity, y: Quantity| impact.values[x as usize].hypot(impact.values[y as usize]);
    format!(
        "cue ball {:.3} → {:.3} m/s, object ball {:.3} m/s, noise {:.3} mm, χ²/dof {:.2}, {} frames left out",
        v(Quantity::CueVxBefore, Quantity::CueVyBefore),
        v(Quantity::CueVxAfter, Quantity::CueVyAfter),
        v(Quantity::ObjVxAfter, Quantity::ObjVyAfter),
        1e3 * impact.position_sd,
        impact.reduced_chi2,
        impact.outliers,
    )
}
