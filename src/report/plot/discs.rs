//! What was measured of discs: e against the closing speed, J_t/J_n against the slip, each with what was fitted.

use plotters::prelude::RGBColor;

use super::WIDTH;
use super::axis::Axis;
use super::frame::{Frame, Rect, message};
use super::picture::{ALARM, Anchor, BAND, GREY, INK, Picture, SMALL, width};
use crate::fit::{Fit, Status};
use crate::measurement::dataset::{DiscShot, Measured};
use crate::measurement::parameter::Parameter;

/// Of the picture, pixels.
const HEIGHT: i32 = 520;

/// What was fitted.
const FITTED: RGBColor = RGBColor(0, 114, 178);

/// The picture; `None` of balls, or where no shot has what it shows.
pub fn picture(fit: &Fit) -> Option<Picture> {
    let parted = |shot: &&DiscShot| !shot.sticks && shot.closing_speed.is_some();
    let shots: Vec<&DiscShot> = fit.disc_shots.iter().filter(parted).collect();
    if shots.is_empty() {
        return None;
    }
    let mut picture = Picture::new(&fit.dataset, WIDTH as i32, HEIGHT);
    let half = WIDTH as i32 / 2;
    let bottom = HEIGHT - 8;
    restitution(&mut picture, Rect { left: 6, top: 8, right: half, bottom }, fit, &shots);
    friction(&mut picture, Rect { left: half, top: 8, right: WIDTH as i32 - 6, bottom }, fit, &shots);
    Some(picture)
}

/// Whether it was fitted.
fn is_used(fit: &Fit, shot: &DiscShot) -> bool {
    fit.residuals.iter().any(|residual| residual.shot == shot.name)
}

/// Shots with their own standard errors: place, value, whether it was fitted.
fn points(frame: &mut Frame, shots: &[(f64, Measured, bool)]) {
    for (x, Measured { value: y, sd }, used) in shots {
        let color = if *used { INK } else { ALARM };
        if let Some(sd) = sd {
            frame.line(&[(*x, y - sd), (*x, y + sd)], color, 1);
        }
        frame.dot(*x, *y, 5, color);
    }
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
fn curve(frame: &mut Frame, points: &[(f64, f64)], scatter: f64) {
    if scatter > 0.0 {
        let above = points.iter().map(|(x, y)| (*x, y + scatter));
        let below = points.iter().rev().map(|(x, y)| (*x, y - scatter));
        frame.polygon(above.chain(below), BAND);
    }
    frame.line(points, FITTED, 3);
}

fn restitution(picture: &mut Picture, area: Rect, fit: &Fit, shots: &[&DiscShot]) {
    let measured: Vec<(f64, Measured, bool)> = shots
        .iter()
        .filter_map(|shot| Some((shot.closing_speed?.value, shot.restitution?, is_used(fit, shot))))
        .collect();
    let unit = if fit.discs.is_some_and(|discs| discs.in_seconds) { "m/s" } else { "m per frame" };
    let x = Axis::around(format!("closing speed ({unit})"), measured.iter().map(|p| p.0)).starting_at_zero();
    let fitted = |parameter| fit.get(parameter).filter(|found| found.status != Status::NotIdentified);
    let slope = fitted(Parameter::ESlope).map_or(0.0, |slope| slope.value);
    // e(v) = e₀ − e₁v
    let line = fitted(Parameter::E).map(|e| [x.low, x.high].map(|speed| (speed, e.value - slope * speed)));
    let scatter = fit.scatter.map_or(0.0, |scatter| scatter.restitution);
    let ends = line.iter().flatten().flat_map(|(_, e)| [e - scatter, e + scatter]);
    let values: Vec<_> = measured.iter().map(|(_, e, _)| (e.value, e.sd)).collect();
    let y = Axis::around_bars("e", &values, ends);
    let title = "e against the closing speed";
    let mut frame = Frame::new(picture, area, title, &remarks(fit, shots), (x, y));
    if let Some(line) = line {
        curve(&mut frame, &line, scatter);
    }
    points(&mut frame, &measured);
    frame.axes();
}

fn friction(picture: &mut Picture, area: Rect, fit: &Fit, shots: &[&DiscShot]) {
    let measured: Vec<(f64, Measured, bool)> = shots
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
    let slips = measured.iter().map(|p| p.0).chain(model.iter().map(|p| p.0));
    let x = Axis::around("slip before the impact / closing speed", slips).starting_at_zero();
    let ratios = model.iter().flat_map(|p| [p.1 - scatter, p.1 + scatter]);
    let y = Axis::around("J_t/J_n against the slip", measured.iter().map(|p| p.1.value).chain(ratios));
    let title = "Friction against the slip";
    if measured.is_empty() {
        return message(picture, area, title, "No rotation of the discs was seen.");
    }
    let mut frame = Frame::new(picture, area, title, &remarks(fit, shots), (x, y));
    if !model.is_empty() {
        curve(&mut frame, &model, scatter);
    }
    if let Some(found) = &fit.friction_curve {
        let high = frame.x.high;
        let sticks = found.sticks_below.min(high);
        let slides = found.slides_from.unwrap_or(high);
        for edge in [sticks, slides].into_iter().filter(|edge| (1e-9..high).contains(edge)) {
            frame.vertical(edge, GREY);
        }
        for (from, to, word) in
            [(0.0, sticks, "stick"), (sticks, slides, "micro-slip"), (slides, high, "slip")]
        {
            let [left, middle, right] = [from, 0.5 * (from + to), to].map(|slip| frame.at(slip, frame.y.low));
            if right.0 - left.0 > width(word, SMALL) {
                let at = (middle.0, middle.1 - 16);
                frame.picture.text(word, at, Anchor::Centre, SMALL, GREY);
            }
        }
    }
    points(&mut frame, &measured);
    frame.axes();
}
