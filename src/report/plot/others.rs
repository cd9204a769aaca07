//! Figures of discs, of pairs of parameters, of comparisons, of designs and of the accuracy of collisions.

use plotters::prelude::RGBColor;

use super::axis::ends;
use super::{Axis, BAND, CUT_AXIS, Figure, Label, Panel, Point, Scale, color};
use crate::compare::{Compared, Comparison};
use crate::design::{Cell, Design, speeds};
use crate::fit::{Contour, Fit, Status};
use crate::measurement::dataset::Measured;
use crate::measurement::number::plain;
use crate::measurement::parameter::Parameter;
use crate::problem::{DiscImpact, Quantity};
use crate::report::{budgets, speed_unit, symbol, title};
use crate::studies::accuracy::{Errors, Includes, Row};

/// Returns e of discs against the closing speed, and J_t/J_n against the slip, each with what was fitted; an empty figure of balls, and
/// if no shot has what it shows.
pub(in crate::report) fn discs(fit: &Fit) -> Figure {
    let has_parted = |shot: &&DiscImpact| shot.stuck.is_none() && shot.get(Quantity::ClosingSpeed).is_some();
    let shots: Vec<&DiscImpact> = fit.disc_shots.iter().filter(has_parted).collect();
    let is_used = |shot: &DiscImpact| fit.residuals.iter().any(|residual| residual.shot == shot.name);
    let mut figure = Figure::new("All impacts");
    let label = |shot: &&DiscImpact| Label { shot: shot.name.clone(), words: String::new() };
    figure.labels = shots.iter().map(label).collect();
    figure.series = vec!["shots".to_owned()];
    if !shots.iter().all(|shot| is_used(shot)) {
        figure.series.push("shots that were not fitted".to_owned());
    }
    let points = |at: fn(&DiscImpact) -> Option<(f64, Measured)>| -> Vec<Point> {
        let point = |(label, shot): (usize, &&DiscImpact)| {
            let (x, Measured { value, sd }) = at(shot)?;
            Some(Point { sd, label: Some(label), ..Point::new([x, value], usize::from(!is_used(shot))) })
        };
        shots.iter().enumerate().filter_map(point).collect()
    };
    let restitutions =
        points(|shot| Some((shot.get(Quantity::ClosingSpeed)?.value, shot.get(Quantity::Restitution)?)));
    let frictions = points(|shot| {
        let (slip, ratio) = (shot.get(Quantity::SlipRatio)?.value, shot.get(Quantity::ImpulseRatio)?);
        Some((slip.abs(), Measured { value: -slip.signum() * ratio.value, ..ratio }))
    });
    let fitted = |parameter| fit.get(parameter).filter(|found| found.status != Status::NotIdentified);
    let slope = fitted(Parameter::ESlope).map_or(0.0, |slope| slope.value);
    let [_, fastest] = ends(restitutions.iter().map(|point| point.at[0]));
    // e(v) = e₀ − e₁v
    let of_e = |e: f64| [0.0, 1.05 * fastest].map(|speed| [speed, e - slope * speed]).to_vec();
    let of_e = fitted(Parameter::E).map_or(Vec::new(), |found| of_e(found.value));
    let scatter = fit.scatter.unwrap_or_default();
    let panel = |title: &str, [x, y]: [&str; 2], points: Vec<Point>, curve: &[[f64; 2]], scatter: f64| {
        let about =
            if scatter > 0.0 { "line: the fit; band: scatter between shots" } else { "line: the fit" };
        let mut panel = Panel::new(title, about, Axis::new(x), Axis::new(y));
        if scatter > 0.0 {
            let below = curve.iter().rev().map(|[x, y]| [*x, y - scatter]);
            panel.area(curve.iter().map(|[x, y]| [*x, y + scatter]).chain(below), BAND);
        }
        panel.line(curve.iter().copied(), color(5), 3);
        (!points.is_empty()).then(|| {
            panel.points(points);
            panel
        })
    };
    let speed = format!("closing speed ({})", fit.discs.as_ref().map_or("m/s", speed_unit));
    let slip = ["slip before the impact / closing speed", "J_t/J_n against the slip"];
    let panels = [
        panel("e against the closing speed", [&speed, "e"], restitutions, &of_e, scatter.restitution),
        panel("Friction against the slip", slip, frictions, &fit.friction_curve, scatter.impulse_ratio),
    ];
    figure.add_rows(500, 2, panels.into_iter().flatten().collect());
    figure
}

/// Returns what makes up the variances of μ, μ_s and e, as bars; `None` if that is noise alone.
pub(super) fn budget(fit: &Fit) -> Option<Panel> {
    /// Number of sources that are shown of a parameter.
    const SOURCES: usize = 4;
    let budgets = budgets(fit);
    let mut bars: Vec<(String, f64, usize)> = Vec::new();
    for (series, found) in budgets.iter().enumerate() {
        let of = symbol(found.of.name());
        bars.extend(found.parts.iter().take(SOURCES).map(|(source, error)| {
            (format!("{of}: {source}"), 100.0 * (error / found.std_error).powi(2), series)
        }));
    }
    let is_noise_alone = budgets.iter().flat_map(|found| &found.parts).all(|(source, _)| source == "noise");
    bars.reverse();
    let words = Axis::with("", Scale::Words(bars.iter().map(|(words, ..)| words.clone()).collect()));
    let about = "what it would take away to know each source exactly";
    let mut panel = Panel::new("Error budget", about, Axis::new("part of the variance (%)"), words);
    for (row, (_, end, series)) in bars.iter().enumerate() {
        panel.rectangle([0.0, *end], [-0.35, 0.35].map(|half| row as f64 + half), color(*series));
    }
    (!is_noise_alone).then_some(panel)
}

/// Returns the regions of all pairs of free parameters.
pub(in crate::report) fn contours(fit: &Fit) -> Figure {
    let contours = &fit.diagnostics.contours;
    let mut figure = Figure::new(format!("{}: pairs of parameters", title(fit)));
    figure.lines =
        vec!["Dark and light: the true pair lies there with 68 % and 95 % probability.".to_owned()];
    figure.add_rows(420, 3, contours.iter().map(contour).collect());
    figure
}

fn contour(contour: &Contour) -> Panel {
    /// Colours of the regions, the likeliest last.
    const REGIONS: [RGBColor; 2] = [RGBColor(166, 206, 236), RGBColor(112, 170, 214)];
    let [first, second] = contour.parameters.map(Parameter::symbol);
    let [x, y] = contour.parameters.map(|parameter| match parameter.unit() {
        "" => Axis::new(parameter.symbol()),
        unit => Axis::new(format!("{} ({unit})", parameter.symbol())),
    });
    let mut panel = Panel::new(format!("{second} against {first}"), "", x, y);
    let mut levels: Vec<_> = contour.levels.iter().collect();
    levels.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    for (level, color) in levels.iter().zip(REGIONS) {
        panel.area(level.edge.iter().copied(), color);
    }
    panel.points([Point::new(contour.centre, 4)]);
    panel
}

/// Returns the estimates of each quantity of a comparison with their intervals, below each other.
pub(in crate::report) fn forest(comparison: &Comparison) -> Figure {
    let mut figure = Figure::new(format!("Estimates and 95 % intervals by {}", comparison.told_by));
    let has_interval = |q: &&Compared| q.estimates.iter().any(|value| value.interval_95.is_some());
    for compared in comparison.quantities.iter().filter(has_interval) {
        let values = || compared.estimates.iter().rev();
        let label = |label: Option<usize>| label.map_or("all".to_owned(), |i| comparison.labels[i].clone());
        let words = Axis::with("", Scale::Words(values().map(|value| label(value.label)).collect()));
        let about = if compared.shared { "one value for all" } else { "" };
        let symbol = compared.quantity.symbol();
        let x = Axis::new(format!("{symbol}, {}", compared.quantity.meaning()));
        let mut panel = Panel::new(symbol, about, x, words);
        for (row, value) in values().enumerate() {
            let (y, series) = (row as f64, value.label.unwrap_or(0));
            let interval = value.interval_95.map(|ends| ends.map(|end| [end, y]));
            panel.line(interval.into_iter().flatten(), color(series), 3);
            let opacity = if value.fitted { 1.0 } else { 0.35 };
            panel.points([Point { opacity, ..Point::new([value.estimate, y], series) }]);
        }
        let lines = u32::try_from(compared.estimates.len()).unwrap_or(1);
        figure.add_rows(128 + 34 * lines, 1, vec![panel]);
    }
    figure
}

/// Returns the standard errors of all cells of a design against the cut angle: a row for each parameter, a column for each speed.
pub(in crate::report) fn design(design: &Design) -> Figure {
    /// Largest number of speeds that are drawn.
    const COLUMNS: usize = 3;
    let kinds = &design.expected.kinds;
    let mut figure = Figure::new("Standard errors that shots of one cut angle and speed give");
    figure.lines = vec!["Without a point: such shots by themselves do not determine it.".to_owned()];
    figure.series = kinds.iter().map(|kind| format!("{} ({} shots)", kind.name, kind.shots)).collect();
    let speeds: Vec<Vec<f64>> = kinds.iter().map(|kind| speeds(kind.speed_m_s)).collect();
    let columns = speeds.iter().map(Vec::len).max().unwrap_or(1).clamp(1, COLUMNS);
    for parameter in Parameter::COEFFICIENTS {
        let row = (0..columns).filter_map(|column| {
            let own: Vec<Option<f64>> = speeds.iter().map(|speeds| speeds.get(column).copied()).collect();
            errors(design, parameter, &own)
        });
        figure.add_rows(380, columns, row.collect());
    }
    if figure.rows.is_empty() {
        let line = "No shot at a single cut angle and speed determines a parameter by itself.";
        figure.lines = vec![line.to_owned()];
    }
    figure
}

/// Returns the standard errors of a parameter of each kind at its own speed; `None` if no kind determines it.
fn errors(design: &Design, parameter: Parameter, speeds: &[Option<f64>]) -> Option<Panel> {
    /// Largest standard errors that are drawn, times the smallest of the parameter.
    const WORST: f64 = 1e3;
    let symbol = parameter.symbol();
    let own = |cell: &Cell| cell.std_errors[parameter as usize].filter(|error| *error > 0.0);
    let [least, _] = ends(design.cells.iter().filter_map(own));
    let place = |cell: &Cell| {
        let error = own(cell).filter(|error| *error <= WORST * least)?;
        Some([cell.cut_deg, error.log10()])
    };
    let [slowest, fastest] = ends(speeds.iter().flatten().copied());
    let [from, to] = [slowest, fastest].map(|speed| plain(speed, 3));
    let range = if slowest < fastest { format!("{from} to {to}") } else { from };
    let y = Axis::with(format!("standard error of {symbol}"), Scale::Logarithmic);
    let mut panel = Panel::new(format!("{symbol}, {range} m/s"), "", Axis::new(CUT_AXIS), y);
    for (kind, speed) in speeds.iter().enumerate() {
        let cells = design.cells.iter().filter(|cell| cell.kind == kind && Some(cell.speed_m_s) == *speed);
        let places: Vec<Option<[f64; 2]>> = cells.map(place).collect();
        // a gap where it is not determined
        for part in places.split(Option::is_none).filter(|part| !part.is_empty()) {
            panel.line(part.iter().flatten().copied(), color(kind), 2);
            panel.points(part.iter().flatten().map(|at| Point::new(*at, kind)));
        }
    }
    (!panel.marks.is_empty()).then_some(panel)
}

/// Returns the errors of a row that are meant, if it has them.
pub(in crate::report) type Pick = fn(&Row) -> Option<Errors>;

/// Returns the name of a way to compute collisions.
pub(in crate::report) fn way_name(row: &Row) -> String {
    let compliant = if row.includes == Includes::Compliant { ", compliant" } else { "" };
    format!("{}{compliant}", row.fidelity.name())
}

/// Returns error against time of every way to compute collisions, both on logarithmic scales.
pub(in crate::report) fn accuracy(rows: &[Row]) -> Figure {
    /// Errors below are roundings.
    const LEAST_DRAWN: f64 = 1e-16;
    let mut figure = Figure::new("Accuracy against time (ode and contact: at tolerances from 10⁻² down)");
    for name in rows.iter().map(way_name) {
        if !figure.series.contains(&name) {
            figure.series.push(name);
        }
    }
    let kinds: [(&str, Pick); 2] = [
        ("Numerical error: against the same equations, solved closely", |row| row.numerical),
        ("Model error: against contact, integrated closely", |row| Some(row.model)),
    ];
    let panels = kinds.map(|(title, pick)| {
        let x = Axis::with("time of a collision (µs)", Scale::Logarithmic);
        let y = Axis::with("error of a velocity over U (95 % of the shots)", Scale::Logarithmic);
        let mut panel = Panel::new(title, "", x, y);
        for (index, name) in figure.series.iter().enumerate() {
            let place = |row: &Row| {
                let error = pick(row)?.speed.p95;
                error.is_finite().then(|| [(1e6 * row.seconds).log10(), error.max(LEAST_DRAWN).log10()])
            };
            let places: Vec<[f64; 2]> =
                rows.iter().filter(|row| way_name(row) == *name).filter_map(place).collect();
            match places[..] {
                // how far its accuracy reaches
                [[_, y]] => panel.horizontal(y),
                _ => panel.line(places.iter().copied(), color(index), 2),
            }
            panel.points(places.into_iter().map(|at| Point::new(at, index)));
        }
        panel
    });
    figure.add_rows(520, 2, panels.into());
    figure
}
