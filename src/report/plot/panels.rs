//! The panels: each answers one question about a fit.

use plotters::prelude::Color;
use statrs::distribution::{Beta, ContinuousCDF, Normal};

use super::axis::{Axis, drawable};
use super::frame::{Frame, Rect, message};
use super::picture::{BAND, INK, Picture};
use super::points::{Point, Points};
use super::series::color;
use crate::measurement::observable::Observable;

/// The name of the axis of standardized residuals.
pub(super) const STANDARDIZED: &str = "(measured − predicted) / sd";

/// Said where no observation has a standard deviation.
const NO_SD: &str = "No standard deviations: the residuals cannot be standardized.";

/// Observables that share a panel of measured against predicted.
#[derive(Clone, Debug)]
pub(super) struct Group {
    name: &'static str,
    unit: &'static str,
    /// Indices into [`Points::observables`].
    members: Vec<usize>,
}

/// One panel for each observable while these are few, else one for each unit.
pub(super) fn groups(observables: &[Observable]) -> Vec<Group> {
    const FEW: usize = 3;
    let mut groups: Vec<Group> = Vec::new();
    for (index, observable) in observables.iter().enumerate() {
        let unit = observable.unit();
        let shared = groups.iter_mut().find(|group| observables.len() > FEW && group.unit == unit);
        match shared {
            Some(group) => group.members.push(index),
            None => groups.push(Group { name: observable.label(), unit, members: vec![index] }),
        }
    }
    for group in groups.iter_mut().filter(|group| group.members.len() > 1) {
        group.name = match observables[group.members[0]] {
            Observable::CueVelocity(_) | Observable::ObjectVelocity(_) => "velocity",
            Observable::CueSpin(_) | Observable::ObjectSpin(_) => "spin",
            observable if observable.is_angle() => "angle",
            _ => "speed",
        };
    }
    groups
}

/// Are the predictions right at all? Measured against predicted, with the line where they are equal.
pub(super) fn measured(picture: &mut Picture, area: Rect, points: &Points, group: &Group) {
    let title = "Measured against predicted";
    let all = || points.all.iter().filter(|point| group.members.contains(&point.series));
    let seen: Vec<&Point> =
        all().filter(|point| drawable(point.measured) && drawable(point.predicted)).collect();
    if seen.is_empty() {
        return message(picture, area, title, "No observations.");
    }
    let unit = if group.unit.is_empty() { String::new() } else { format!(" ({})", group.unit) };
    let values: Vec<_> = seen.iter().map(|point| (point.measured, Some(point.sd))).collect();
    let axis = |what: &str| {
        let predicted = seen.iter().map(|point| point.predicted);
        Axis::around_bars(format!("{what} {}{unit}", group.name), &values, predicted)
    };
    let with_bars = seen.iter().any(|point| drawable(point.sd));
    let mut remarks = vec![if with_bars { "bars: ± sd" } else { "no sd known" }.to_owned()];
    remarks.extend(points.thinned.clone());
    remarks.extend(left_out(all().count() - seen.len(), "number too large to draw"));
    let mut frame = Frame::new(picture, area, title, &remarks, (axis("predicted"), axis("measured")));
    for point in seen.iter().filter(|point| point.drawn && drawable(point.sd)) {
        let bar = [point.measured - point.sd, point.measured + point.sd].map(|end| (point.predicted, end));
        frame.line(&bar, color(point.series).mix(0.8 * points.opacity()), 1);
    }
    for point in seen.iter().filter(|point| point.drawn) {
        frame.spot((point.predicted, point.measured), point.index, point.series, points.opacity());
    }
    frame.line(&[(frame.x.low, frame.x.low), (frame.x.high, frame.x.high)], INK, 1);
    frame.axes();
}

/// What standardized residuals are drawn against.
pub(super) struct Against {
    title: &'static str,
    pub(super) axis: &'static str,
    /// What a point without a value lacks.
    unknown: &'static str,
    value: fn(&Point) -> f64,
}

/// Does the model miss something that grows with the cut angle?
pub(super) const CUT: Against = Against {
    title: "Residuals against cut angle",
    axis: "cut angle φ (°)",
    unknown: "cut angle",
    value: |point| point.cut,
};

/// Does the model miss something that grows with speed?
pub(super) const SPEED: Against = Against {
    title: "Residuals against speed",
    axis: "cue-ball speed before impact (m/s)",
    unknown: "speed",
    value: |point| point.speed,
};

pub(super) fn against(picture: &mut Picture, area: Rect, points: &Points, kind: &Against) {
    let standardized: Vec<&Point> = points.all.iter().filter(|point| drawable(point.standardized)).collect();
    let value = |point: &Point| (kind.value)(point);
    let seen: Vec<&Point> = standardized.iter().copied().filter(|point| drawable(value(point))).collect();
    if points.all.is_empty() {
        return message(picture, area, kind.title, "No observations.");
    }
    if standardized.is_empty() {
        return message(picture, area, kind.title, NO_SD);
    }
    if seen.is_empty() {
        let text = format!("The {} is not known for any observation.", kind.unknown);
        return message(picture, area, kind.title, &text);
    }
    let x = Axis::around(kind.axis, seen.iter().map(|point| value(point))).starting_at_zero();
    let y = Axis::symmetric(STANDARDIZED, seen.iter().map(|point| point.standardized), 3.2);
    // The residuals of different observables may go opposite ways: their mean would hide it.
    let means = match points.observables.len() {
        1 => means(seen.iter().map(|point| (value(point), point.standardized)).collect()),
        _ => Vec::new(),
    };
    let mut remarks = vec!["band: ±2 sd".to_owned()];
    if !means.is_empty() {
        remarks.push("black: local mean ± its error".to_owned());
    }
    remarks.extend(points.thinned.clone());
    remarks.extend(left_out(points.all.len() - standardized.len(), "no sd"));
    remarks.extend(left_out(standardized.len() - seen.len(), &format!("no {}", kind.unknown)));
    let mut frame = Frame::new(picture, area, kind.title, &remarks, (x, y));
    frame.two_sd();
    for point in seen.iter().filter(|point| point.drawn) {
        frame.spot((value(point), point.standardized), point.index, point.series, points.opacity());
    }
    frame.horizontal(0.0, INK);
    for mean in &means {
        frame.line(&[(mean.x, mean.y - mean.error), (mean.x, mean.y + mean.error)], INK, 2);
        let (x, y) = frame.at(mean.x, mean.y);
        frame.picture.rectangle([(x - 5, y - 1), (x + 5, y + 1)], INK);
    }
    frame.axes();
}

/// The mean residual of neighbouring points.
struct Mean {
    x: f64,
    y: f64,
    /// Standard error of `y`.
    error: f64,
}

/// Means of a dozen groups of neighbours, where there are so many points that the eye no longer
/// averages them.
fn means(mut points: Vec<(f64, f64)>) -> Vec<Mean> {
    const MANY: usize = 200;
    const GROUPS: usize = 12;
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let spread = points.first().zip(points.last()).is_some_and(|(first, last)| last.0 > first.0);
    if points.len() < MANY || !spread {
        return Vec::new();
    }
    let mean = |group: &[(f64, f64)]| {
        let n = group.len() as f64;
        let x = group.iter().map(|(x, _)| x).sum::<f64>() / n;
        let y = group.iter().map(|(_, y)| y).sum::<f64>() / n;
        let variance = group.iter().map(|(_, other)| (other - y).powi(2)).sum::<f64>() / (n - 1.0);
        Mean { x, y, error: (variance / n).sqrt() }
    };
    points.chunks(points.len().div_ceil(GROUPS)).filter(|group| group.len() > 1).map(mean).collect()
}

/// Are the errors what their standard deviations say, and normal? The sorted residuals against the
/// quantiles of a normal distribution, with the band that holds 95 % of samples at each place.
pub(super) fn quantiles(picture: &mut Picture, area: Rect, points: &Points) {
    let title = "Are the residuals normal?";
    let mut sorted: Vec<&Point> = points.all.iter().filter(|point| drawable(point.standardized)).collect();
    if sorted.is_empty() {
        let text = if points.all.is_empty() { "No observations." } else { NO_SD };
        return message(picture, area, title, text);
    }
    sorted.sort_by(|a, b| a.standardized.total_cmp(&b.standardized));
    let n = sorted.len();
    let quantile = |i: usize| Normal::standard().inverse_cdf((i as f64 + 0.5) / n as f64);
    let ends = [quantile(0), quantile(n - 1)];
    let x = Axis::symmetric("quantile of the normal distribution", ends, 1.5);
    let residuals = sorted.iter().map(|point| point.standardized);
    let y = Axis::symmetric(STANDARDIZED, residuals.chain(ends), 2.5);
    let mut remarks = vec!["line: normal; band: 95 % of samples".to_owned()];
    remarks.extend(points.thinned.clone());
    remarks.extend(left_out(points.all.len() - n, "no sd"));
    let mut frame = Frame::new(picture, area, title, &remarks, (x, y));
    let outline = band(n);
    if outline.len() > 2 {
        frame.polygon(outline, BAND);
    }
    for (i, point) in sorted.iter().enumerate().filter(|(_, point)| point.drawn) {
        frame.spot((quantile(i), point.standardized), point.index, point.series, points.opacity());
    }
    let end = frame.x.high.min(frame.y.high);
    frame.line(&[(-end, -end), (end, end)], INK, 1);
    frame.axes();
}

/// The outline of the band: the i-th smallest of n uniform numbers has the distribution
/// Beta(i, n + 1 − i). At some 60 places, evenly spaced along the axis.
fn band(n: usize) -> Vec<(f64, f64)> {
    const PLACES: usize = 60;
    let normal = Normal::standard();
    let extreme = normal.inverse_cdf(0.5 / n as f64);
    let place = |k: usize| {
        let z = extreme * (1.0 - 2.0 * k as f64 / PLACES as f64);
        ((normal.cdf(z) * n as f64) as usize).min(n - 1)
    };
    let mut indices: Vec<usize> = (0..=PLACES).map(place).collect();
    indices.dedup();
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for i in indices {
        let Ok(beta) = Beta::new((i + 1) as f64, (n - i) as f64) else { continue };
        let x = normal.inverse_cdf((i as f64 + 0.5) / n as f64);
        low.push((x, normal.inverse_cdf(beta.inverse_cdf(0.025))));
        high.push((x, normal.inverse_cdf(beta.inverse_cdf(0.975))));
    }
    high.reverse();
    low.extend(high);
    low
}

/// The remark about points that are not in a panel.
fn left_out(count: usize, why: &str) -> Option<String> {
    match count {
        0 => None,
        1 => Some(format!("1 point left out: {why}")),
        _ => Some(format!("{count} points left out: {why}")),
    }
}
