//! Figures of discs, of pairs of parameters, of comparisons, of designs and of the accuracy of
//! collisions.

use plotters::prelude::RGBColor;

use super::axis::ends;
use super::{Axis, BAND, CUT_AXIS, Figure, Label, Panel, Point, Scale, color};
use crate::compare::{Compared, Comparison, Value};
use crate::design::{Design, speeds};
use crate::fit::{Contour, Fit, Status};
use crate::measurement::dataset::Measured;
use crate::measurement::number::plain;
use crate::measurement::parameter::{Parameter, Setting};
use crate::problem::Budget;
use crate::report::{sources, speed_unit, title};
use crate::studies::accuracy::{Includes, Row};
use crate::words::symbol;

/// Number of slips of a curve, enough to place its bends within a hundredth of its length.
const POINTS: usize = 120;
/// Length of a curve divided by the largest slip.
const CURVE_EXTENSION: f64 = 1.08;

/// Returns e of discs against the closing speed, and J_t/J_n against the slip, each with what was
/// fitted; an empty figure of balls, and if no shot has what it shows.
pub(in crate::report) fn discs(fit: &Fit) -> Figure {
    let mut figure = Figure::new("All impacts");
    figure.series = vec!["shots".to_owned()];
    let mut points = [Vec::new(), Vec::new()];
    for shot in fit.disc_shots.iter().filter(|shot| shot.stuck.is_none()) {
        let Some(closing) = shot.get("closing_speed") else { continue };
        let is_used = fit.residuals.iter().any(|residual| residual.shot == shot.name);
        if !is_used && figure.series.len() == 1 {
            figure.series.push("shots that were not fitted".to_owned());
        }
        let point = |x: f64, Measured { value, sd }: Measured| {
            let label = Some(figure.labels.len());
            Point { sd, label, ..Point::new([x, value], usize::from(!is_used)) }
        };
        points[0].extend(shot.get("e").map(|e| point(closing.value, e)));
        if let (Some(slip), Some(ratio)) = (shot.get("slip_ratio"), shot.get("impulse_ratio")) {
            let against_slip = Measured { value: -slip.value.signum() * ratio.value, ..ratio };
            points[1].push(point(slip.value.abs(), against_slip));
        }
        figure.labels.push(Label { shot: shot.name.clone(), words: String::new() });
    }
    let fitted = |parameter| fit.get(parameter).filter(|found| found.status != Status::NotIdentified);
    // e(v) = e₀ − e₁v
    let slope = fitted(Parameter::ESlope).map_or(0.0, |slope| slope.value);
    let [_, fastest] = ends(points[0].iter().map(|point| point.at[0]));
    let e_curve = fitted(Parameter::E);
    let e_curve =
        e_curve.map(|e| [0.0, 1.05 * fastest].map(|speed| [speed, e.value - slope * speed]).to_vec());
    let curves = [e_curve.unwrap_or_default(), friction_curve(fit)];
    let scatter = fit.scatter.unwrap_or_default();
    let speed = format!("closing speed ({})", fit.discs.as_ref().map_or("m/s", speed_unit));
    let meanings = [
        ("e against the closing speed", speed.as_str(), "e", scatter.e),
        (
            "Friction against the slip",
            "slip before the impact / closing speed",
            "J_t/J_n against the slip",
            scatter.impulse_ratio,
        ),
    ];
    let mut panels = Vec::new();
    for ((title, x, y, scatter), (points, curve)) in meanings.into_iter().zip(points.into_iter().zip(curves))
    {
        let mut panel = Panel::new(title, "line: the fit", Axis::new(x), Axis::new(y));
        if scatter > 0.0 {
            panel.about += "; band: scatter between shots";
            let below = curve.iter().rev().map(|[x, y]| [*x, y - scatter]);
            panel.area(curve.iter().map(|[x, y]| [*x, y + scatter]).chain(below), BAND);
        }
        panel.line(curve, color(5), 3);
        if !points.is_empty() {
            panel.points(points);
            panels.push(panel);
        }
    }
    figure.add_rows(500, 2, panels);
    figure
}

/// Returns points of J_t/J_n of a fit against the slip over the closing speed, from 0 on, at a
/// typical closing speed; empty if the shots do not determine the friction.
fn friction_curve(fit: &Fit) -> Vec<[f64; 2]> {
    let is_determined = fit.get(Parameter::Mu).is_some_and(|mu| mu.status != Status::NotIdentified);
    let all = |quantity| fit.disc_shots.iter().filter_map(move |shot| shot.get(quantity));
    let largest = all("slip_ratio").map(|slip| slip.value.abs()).fold(0.0, f64::max);
    let closing =
        all("closing_speed").map(|speed| speed.value).sum::<f64>() / fit.disc_shots.len().max(1) as f64;
    let against = |slip: f64| Some([slip, -fit.solution.impulse_ratio([closing, slip * closing])?[0]]);
    let points = (0..=POINTS).map(|i| against(CURVE_EXTENSION * largest * i as f64 / POINTS as f64));
    points.collect::<Option<Vec<_>>>().filter(|_| is_determined && largest > 0.0).unwrap_or_default()
}

/// Returns what makes up the variances of μ, μ_s and e, as bars.
pub(super) fn budget(budgets: &[Budget]) -> Panel {
    /// Number of sources that are shown of a parameter.
    const SOURCES: usize = 4;
    let mut bars: Vec<(String, f64, usize)> = Vec::new();
    for (series, found) in budgets.iter().enumerate() {
        let (name, whole) = (symbol(found.id.name()), found.std_error());
        bars.extend(
            sources(found).into_iter().take(SOURCES).map(|(source, error)| {
                (format!("{name}: {source}"), 100.0 * (error / whole).powi(2), series)
            }),
        );
    }
    bars.reverse();
    let words = Axis::with("", Scale::Words(bars.iter().map(|(words, ..)| words.clone()).collect()));
    let about = "what it would take away to know each source exactly";
    let mut panel = Panel::new("Error budget", about, Axis::new("part of the variance (%)"), words);
    for (row, (_, end, series)) in bars.iter().enumerate() {
        panel.rectangle([0.0, *end], [-0.35, 0.35].map(|half| row as f64 + half), color(*series));
    }
    panel
}

/// Returns the regions of all pairs of free parameters.
pub(in crate::report) fn contours(fit: &Fit) -> Figure {
    let mut figure = Figure::new(format!("{}: pairs of parameters", title(fit)));
    figure.say("Dark and light: the true pair lies there with 68 % and 95 % probability.");
    figure.add_rows(420, 3, fit.diagnostics.contours.iter().map(contour).collect());
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
        let label = |value: &Value| value.label.clone().unwrap_or("all".to_owned());
        let words = compared.estimates.iter().rev().map(label).collect();
        let about = if compared.shared { "one value for all" } else { "" };
        let symbol = compared.parameter.symbol();
        let x = Axis::new(format!("{symbol}, {}", compared.parameter.meaning()));
        let mut panel = Panel::new(symbol, about, x, Axis::with("", Scale::Words(words)));
        for (row, value) in compared.estimates.iter().rev().enumerate() {
            let series = comparison.labels.iter().position(|label| Some(label) == value.label.as_ref());
            let (y, series) = (row as f64, series.unwrap_or(0));
            panel.line(value.interval_95.into_iter().flatten().map(|end| [end, y]), color(series), 3);
            let opacity = if value.fitted { 1.0 } else { 0.35 };
            panel.points([Point { opacity, ..Point::new([value.estimate, y], series) }]);
        }
        figure.add_rows(128 + 34 * compared.estimates.len() as u32, 1, vec![panel]);
    }
    figure
}

/// Returns the standard errors of all cells of a design against the cut angle: a row for each
/// parameter, a column for each speed.
pub(in crate::report) fn design(design: &Design) -> Figure {
    /// Largest number of speeds that are drawn.
    const COLUMNS: usize = 3;
    let kinds = &design.expected.kinds;
    let mut figure = Figure::new("Standard errors that shots of one cut angle and speed give");
    figure.series = kinds.iter().map(|kind| format!("{} ({} shots)", kind.name, kind.shots)).collect();
    let speeds: Vec<Vec<f64>> = kinds.iter().map(|kind| speeds(kind.speed_m_s)).collect();
    for parameter in Parameter::COEFFICIENTS {
        let panels = (0..COLUMNS).map(|column| {
            let speeds_of_kinds: Vec<Option<f64>> =
                speeds.iter().map(|speeds| speeds.get(column).copied()).collect();
            errors(design, parameter, &speeds_of_kinds)
        });
        figure.add_rows(380, COLUMNS, panels.filter(|panel| !panel.marks.is_empty()).collect());
    }
    figure.say(if figure.rows.is_empty() {
        "No shot at a single cut angle and speed determines a parameter by itself."
    } else {
        "Without a point: such shots by themselves do not determine it."
    });
    figure
}

/// Returns the standard errors of a parameter that each kind gives at its own speed.
fn errors(design: &Design, parameter: Parameter, speeds: &[Option<f64>]) -> Panel {
    let symbol = parameter.symbol();
    let Setting { lower, upper, .. } = parameter.default_setting();
    let [slowest, fastest] = ends(speeds.iter().flatten().copied());
    let [from, to] = [slowest, fastest].map(|speed| plain(speed, 3));
    let range = if slowest < fastest { format!("{from} to {to}") } else { from };
    let y = Axis::with(format!("standard error of {symbol}"), Scale::Logarithmic);
    let mut panel = Panel::new(format!("{symbol}, {range} m/s"), "", Axis::new(CUT_AXIS), y);
    for (kind, speed) in speeds.iter().enumerate() {
        let cells = design.cells.iter().filter(|cell| cell.kind == kind && Some(cell.speed_m_s) == *speed);
        let places: Vec<Option<[f64; 2]>> = cells
            .map(|cell| {
                let error = cell.std_errors[parameter as usize];
                // what errs by more than its range is not determined
                let error = error.filter(|error| *error > 0.0 && *error <= upper - lower)?;
                Some([cell.cut_deg, error.log10()])
            })
            .collect();
        // a gap if it is not determined
        for part in places.split(Option::is_none).filter(|part| !part.is_empty()) {
            panel.curve(&part.iter().flatten().copied().collect::<Vec<_>>(), kind);
        }
    }
    panel
}

/// Returns the name of a way to compute collisions.
fn way_name(row: &Row) -> String {
    let compliant = if row.includes == Includes::Compliant { ", compliant" } else { "" };
    format!("{}{compliant}", row.fidelity.name())
}

/// Returns error against time of every way to compute collisions, both on logarithmic scales.
pub(in crate::report) fn accuracy(rows: &[Row]) -> Figure {
    let mut figure = Figure::new("Accuracy against time (ode and contact: at tolerances from 10⁻² down)");
    figure.series = rows.iter().map(way_name).collect();
    figure.series.dedup();
    let titles = [
        "Numerical error: against the same equations, solved closely",
        "Model error: against contact, integrated closely",
    ];
    let panels = [0, 1].map(|kind| {
        let errors = |row: &Row| if kind == 0 { row.numerical } else { Some(row.model) };
        let x = Axis::with("time of a collision (µs)", Scale::Logarithmic);
        let y = Axis::with("error of a velocity over U (95 % of the shots)", Scale::Logarithmic);
        let mut panel = Panel::new(titles[kind], "", x, y);
        for (index, rows) in rows.chunk_by(|one, next| way_name(one) == way_name(next)).enumerate() {
            let places = rows.iter().filter_map(|row| {
                let error = errors(row)?.speed.p95;
                error.is_finite().then(|| [(1e6 * row.seconds).log10(), error.max(f64::EPSILON).log10()])
            });
            let places: Vec<[f64; 2]> = places.collect();
            // how far its accuracy reaches
            if let [[_, y]] = places[..] {
                panel.horizontal(y);
            }
            panel.curve(&places, index);
        }
        panel
    });
    figure.add_rows(520, 2, panels.into());
    figure
}
