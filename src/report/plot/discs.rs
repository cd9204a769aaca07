//! What was measured of discs: e against the closing speed, J_t/J_n against the slip, each with what was fitted.

use plotters::prelude::*;

use super::axis::Axis;
use super::canvas::{ALARM, BAND, Canvas, GREY, INK, SMALL};
use super::drawing::Area;
use super::frame::{Frame, Rect};
use super::{WIDTH, drawing, failed};
use crate::fit::{Fit, Status};
use crate::measurement::dataset::{DiscShot, Measured};
use crate::measurement::parameter::Parameter;
use crate::report::ReportError;

/// Of the picture, pixels.
const HEIGHT: i32 = 520;

/// What was fitted.
const FITTED: RGBColor = RGBColor(0, 114, 178);

/// The picture as SVG; `None` of balls, or where no shot has what it shows.
pub fn svg(fit: &Fit) -> Option<Result<String, ReportError>> {
    let parted = |shot: &&DiscShot| !shot.sticks && shot.closing_speed.is_some();
    let shots: Vec<&DiscShot> = fit.disc_shots.iter().filter(parted).collect();
    if shots.is_empty() {
        return None;
    }
    let drawn = drawing::svg((WIDTH, HEIGHT as u32), |area| draw(area, fit, &shots));
    Some(drawn.map(|(text, ())| text).map_err(|reason| failed(fit, reason)))
}

fn draw<DB: DrawingBackend>(area: &Area<DB>, fit: &Fit, shots: &[&DiscShot]) -> Result<(), String> {
    let canvas = Canvas::new(area)?;
    let half = WIDTH as i32 / 2;
    let bottom = HEIGHT - 8;
    restitution(&canvas, Rect { left: 6, top: 8, right: half, bottom }, fit, shots)?;
    friction(&canvas, Rect { left: half, top: 8, right: WIDTH as i32 - 6, bottom }, fit, shots)
}

/// Whether it was fitted.
fn is_used(fit: &Fit, shot: &DiscShot) -> bool {
    fit.residuals.iter().any(|residual| residual.shot == shot.name)
}

/// A shot with its own standard error.
fn point<DB: DrawingBackend>(
    frame: &Frame<DB>,
    x: f64,
    y: f64,
    sd: Option<f64>,
    used: bool,
) -> Result<(), String> {
    let color = if used { INK } else { ALARM };
    if let Some(sd) = sd {
        frame.line(&[(x, y - sd), (x, y + sd)], color, 1)?;
    }
    frame.canvas.circle(frame.at(x, y), 5, color.to_rgba())
}

fn remarks(fit: &Fit, shots: &[&DiscShot]) -> Vec<String> {
    let left_out = shots.iter().any(|shot| !is_used(fit, shot));
    let band = fit.scatter.is_some_and(|scatter| !scatter.is_none());
    let mut remarks = vec!["blue: the fit".to_owned()];
    remarks.extend(band.then(|| "band: scatter between shots".to_owned()));
    remarks.extend(left_out.then(|| "red: not fitted".to_owned()));
    remarks
}

/// The fit with a scatter above and below.
fn curve<DB: DrawingBackend>(frame: &Frame<DB>, points: &[(f64, f64)], scatter: f64) -> Result<(), String> {
    let above = points.iter().map(|(x, y)| frame.at(*x, y + scatter));
    let below = points.iter().rev().map(|(x, y)| frame.at(*x, y - scatter));
    if scatter > 0.0 {
        frame.canvas.polygon(above.chain(below).collect(), BAND.to_rgba())?;
    }
    frame.line(points, FITTED, 3)
}

fn restitution<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    area: Rect,
    fit: &Fit,
    shots: &[&DiscShot],
) -> Result<(), String> {
    let points: Vec<(f64, Measured, bool)> = shots
        .iter()
        .filter_map(|shot| Some((shot.closing_speed?.value, shot.restitution?, is_used(fit, shot))))
        .collect();
    let unit = if fit.discs.is_some_and(|discs| discs.in_seconds) { "m/s" } else { "m per frame" };
    let x = Axis::around(format!("closing speed ({unit})"), points.iter().map(|p| p.0)).starting_at_zero();
    let fitted = |parameter| fit.get(parameter).filter(|found| found.status != Status::NotIdentified);
    let slope = fitted(Parameter::ESlope).map_or(0.0, |slope| slope.value);
    // e(v) = e₀ − e₁v
    let line = fitted(Parameter::E).map(|e| [x.low, x.high].map(|speed| (speed, e.value - slope * speed)));
    let scatter = fit.scatter.map_or(0.0, |scatter| scatter.restitution);
    let ends = line.iter().flatten().flat_map(|(_, e)| [e - scatter, e + scatter]);
    let values: Vec<_> = points.iter().map(|(_, e, _)| (e.value, e.sd)).collect();
    let y = Axis::around_bars("e", &values, ends);
    let frame = Frame::new(canvas, area, "e against the closing speed", &remarks(fit, shots), (x, y))?;
    if let Some(line) = line {
        curve(&frame, &line, scatter)?;
    }
    for (speed, e, used) in points {
        point(&frame, speed, e.value, e.sd, used)?;
    }
    frame.axes()
}

fn friction<DB: DrawingBackend>(
    canvas: &Canvas<DB>,
    area: Rect,
    fit: &Fit,
    shots: &[&DiscShot],
) -> Result<(), String> {
    let points: Vec<(f64, Measured, bool)> = shots
        .iter()
        .filter_map(|shot| {
            let (slip, ratio) = (shot.slip_ratio?.value, shot.impulse_ratio?);
            let against = Measured { value: -slip.signum() * ratio.value, ..ratio };
            Some((slip.abs(), against, is_used(fit, shot)))
        })
        .collect();
    let model: Vec<(f64, f64)> =
        fit.friction_curve.iter().flat_map(|curve| &curve.points).map(|[x, y]| (*x, *y)).collect();
    let scatter = fit.scatter.map_or(0.0, |scatter| scatter.impulse_ratio);
    let slips = points.iter().map(|p| p.0).chain(model.iter().map(|p| p.0));
    let x = Axis::around("slip before the impact / closing speed", slips).starting_at_zero();
    let ratios = model.iter().flat_map(|p| [p.1 - scatter, p.1 + scatter]);
    let y = Axis::around("J_t/J_n against the slip", points.iter().map(|p| p.1.value).chain(ratios));
    let title = "Friction against the slip";
    if points.is_empty() {
        return super::frame::message(canvas, area, title, "No rotation of the discs was seen.");
    }
    let frame = Frame::new(canvas, area, title, &remarks(fit, shots), (x, y))?;
    if !model.is_empty() {
        curve(&frame, &model, scatter)?;
    }
    if let Some(found) = &fit.friction_curve {
        let high = frame.x.high;
        let sticks = found.sticks_below.min(high);
        let slides = found.slides_from.unwrap_or(high);
        for edge in [sticks, slides].into_iter().filter(|edge| (1e-9..high).contains(edge)) {
            frame.line(&[(edge, frame.y.low), (edge, frame.y.high)], GREY, 1)?;
        }
        for (from, to, word) in
            [(0.0, sticks, "stick"), (sticks, slides, "micro-slip"), (slides, high, "slip")]
        {
            let middle = frame.at(0.5 * (from + to), frame.y.low);
            let wide = frame.at(to, frame.y.low).0 - frame.at(from, frame.y.low).0;
            if wide > super::canvas::width(word, SMALL) {
                canvas.text(word, (middle.0, middle.1 - 16), super::Anchor::Centre, SMALL, GREY)?;
            }
        }
    }
    for (slip, ratio, used) in points {
        point(&frame, slip, ratio.value, ratio.sd, used)?;
    }
    frame.axes()
}
