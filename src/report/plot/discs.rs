//! What was measured of discs: e against the closing speed, J_t/J_n against the slip, each with what was fitted.

use super::{Axis, BAND, Figure, Label, Mark, Panel, Point, color};
use crate::fit::{Fit, Status};
use crate::measurement::dataset::Measured;
use crate::measurement::parameter::Parameter;
use crate::physics::disc::Discs;
use crate::problem::{DiscImpact, Quantity};

/// Height of the panels, pixels.
const ROW: u32 = 500;

/// Series of shots that were fitted, and of those that were not.
const SERIES: [(usize, &str); 2] = [(0, "shots"), (1, "shots that were not fitted")];

/// Returns the figure, which is empty of balls, and if no shot has what it shows.
pub fn figure(fit: &Fit) -> Figure {
    let has_parted = |shot: &&DiscImpact| shot.stuck.is_none() && shot.get(Quantity::ClosingSpeed).is_some();
    let shots: Vec<&DiscImpact> = fit.disc_shots.iter().filter(has_parted).collect();
    let mut figure = Figure::new("All impacts");
    figure.labels =
        shots.iter().map(|shot| Label { shot: shot.name.clone(), words: String::new() }).collect();
    let used: Vec<bool> =
        shots.iter().map(|shot| fit.residuals.iter().any(|r| r.shot == shot.name)).collect();
    let count = if used.contains(&false) { 2 } else { 1 };
    figure.series = SERIES.iter().take(count).map(|(_, name)| (*name).to_owned()).collect();
    let scatters = fit.scatter.is_some_and(|scatter| !scatter.is_none());
    let about = if scatters { "line: the fit; band: scatter between shots" } else { "line: the fit" };
    let panels = [restitution(fit, &shots, &used, about), friction(fit, &shots, &used, about)];
    let panels: Vec<Panel> = panels.into_iter().flatten().collect();
    if panels.len() == 1 {
        figure.lines.push("No rotation of the discs was seen.".to_owned());
    }
    figure.add_rows(ROW, 2, panels);
    figure
}

/// Returns the unit of speeds.
pub(super) fn speed_unit(discs: &Discs) -> &'static str {
    if discs.in_seconds { "m/s" } else { "m per frame" }
}

/// Returns the points of shots that have a place and a value.
fn points(
    shots: &[&DiscImpact],
    used: &[bool],
    at: impl Fn(&DiscImpact) -> Option<(f64, Measured)>,
) -> Vec<Point> {
    let point = |(label, (shot, used)): (usize, (&&DiscImpact, &bool))| {
        let (x, measured) = at(shot)?;
        let series = if *used { SERIES[0].0 } else { SERIES[1].0 };
        Some(Point { sd: measured.sd, label: Some(label), ..Point::new([x, measured.value], series) })
    };
    shots.iter().zip(used).enumerate().filter_map(point).collect()
}

/// Adds the fit with a scatter above and below.
fn add_curve(panel: &mut Panel, curve: &[[f64; 2]], scatter: f64) {
    if scatter > 0.0 {
        let above = curve.iter().map(|[x, y]| [*x, y + scatter]);
        let below = curve.iter().rev().map(|[x, y]| [*x, y - scatter]);
        panel.area(above.chain(below), BAND);
    }
    panel.line(curve.iter().copied(), color(5), 3);
}

fn restitution(fit: &Fit, shots: &[&DiscImpact], used: &[bool], about: &str) -> Option<Panel> {
    let points = points(shots, used, |shot| {
        Some((shot.get(Quantity::ClosingSpeed)?.value, shot.get(Quantity::Restitution)?))
    });
    if points.is_empty() {
        return None;
    }
    let unit = fit.discs.as_ref().map_or("m/s", speed_unit);
    let x = Axis::new(format!("closing speed ({unit})"));
    let mut panel = Panel::new("e against the closing speed", about, x, Axis::new("e"));
    let fitted = |parameter| fit.get(parameter).filter(|found| found.status != Status::NotIdentified);
    let slope = fitted(Parameter::ESlope).map_or(0.0, |slope| slope.value);
    if let Some(e) = fitted(Parameter::E) {
        let fastest = points.iter().map(|point| point.at[0]).fold(0.0, f64::max);
        // e(v) = e₀ − e₁v
        let line = [0.0, 1.05 * fastest].map(|speed| [speed, e.value - slope * speed]);
        add_curve(&mut panel, &line, fit.scatter.map_or(0.0, |scatter| scatter.restitution));
    }
    panel.points(points);
    Some(panel)
}

fn friction(fit: &Fit, shots: &[&DiscImpact], used: &[bool], about: &str) -> Option<Panel> {
    let points = points(shots, used, |shot| {
        let (slip, ratio) = (shot.get(Quantity::SlipRatio)?.value, shot.get(Quantity::ImpulseRatio)?);
        Some((slip.abs(), Measured { value: -slip.signum() * ratio.value, ..ratio }))
    });
    if points.is_empty() {
        return None;
    }
    let x = Axis::new("slip before the impact / closing speed");
    let mut panel = Panel::new("Friction against the slip", about, x, Axis::new("J_t/J_n against the slip"));
    if let Some(found) = &fit.friction_curve {
        let scatter = fit.scatter.map_or(0.0, |scatter| scatter.impulse_ratio);
        add_curve(&mut panel, &found.points, scatter);
        let end = found.points.iter().map(|point| point[0]).fold(0.0, f64::max);
        let lowest = found.points.iter().map(|point| point[1] - scatter).fold(f64::INFINITY, f64::min);
        let sticks = found.sticks_below.min(end);
        let slides = found.slides_from.unwrap_or(end).min(end);
        for (from, to, words) in
            [(0.0, sticks, "stick"), (sticks, slides, "micro-slip"), (slides, end, "slip")]
        {
            if to - from > 0.12 * end {
                panel.marks.push(Mark::Text { at: [0.5 * (from + to), lowest], words: words.to_owned() });
            }
            if (1e-9..end).contains(&to) {
                panel.marks.push(Mark::Vertical(to));
            }
        }
    }
    panel.points(points);
    Some(panel)
}
