//! residuals.svg and residuals.png, of a fit and of a comparison: what a reader looks at before
//! believing it.

use statrs::distribution::{Beta, ContinuousCDF, Normal};

use super::axis::{ends, is_drawable};
use super::others::budget;
use super::{ALARM, Axis, BAND, CUT_AXIS, Figure, GREY, INK, Label, Panel, Point, SPEED_AXIS, Scale};
use crate::compare::Comparison;
use crate::fit::{Fit, FittedFilm, Residual};
use crate::measurement::number::count_of;
use crate::report::terminal::{estimate, with_unit};
use crate::report::{budgets, chi2_words, speed_unit, title};

/// Height of a row of panels, pixels.
const ROW: u32 = 400;

/// Name of the axis of standardized residuals.
const STANDARDIZED: &str = "(measured − predicted) / sd";

/// Returns the residuals of a fit below its title, estimates, χ², and what the reader must know
/// first.
pub(in crate::report) fn residuals(fit: &Fit) -> Figure {
    let mut observed = Observed::default();
    match &fit.frames {
        Some(film) => observed.add_film(film),
        None => observed.add_table(fit),
    }
    let speed_axis = fit.discs.map_or(SPEED_AXIS.to_owned(), |discs| {
        format!("speed of the first disc before impact ({})", speed_unit(&discs))
    });
    let mut panels = observed.against(&speed_axis);
    panels.extend(observed.quantiles());
    let budgets = budgets(fit);
    let is_noise_alone = budgets.iter().flat_map(|found| &found.parts).all(|(source, _)| source == "noise");
    if !is_noise_alone || panels.is_empty() && !budgets.is_empty() {
        panels.push(budget(&budgets));
    }
    let mut figure = observed.figure(title(fit), panels);
    figure.lines.splice(0..0, summary(fit).map(|line| (line, GREY)));
    let warnings = fit.warnings();
    figure.lines.extend(warnings.first().map(|first| {
        let more =
            if warnings.len() > 1 { format!("(+{} more) ", warnings.len() - 1) } else { String::new() };
        (format!("{more}{first}"), ALARM)
    }));
    figure
}

/// Returns the residuals of all labels of a comparison, each in its colour.
pub(in crate::report) fn of_comparison(comparison: &Comparison) -> Figure {
    let mut observed = Observed { series: comparison.labels.clone(), ..Observed::default() };
    for residual in &comparison.residuals {
        let shot = comparison.shot_name(residual);
        observed.add_residual(&shot, residual.label, f64::NAN, &residual.of_shot);
    }
    observed.figure("Residuals of the joint fit".to_owned(), observed.against(SPEED_AXIS))
}

fn summary(fit: &Fit) -> [String; 2] {
    let estimates = fit.estimates.iter().map(|one| {
        let value = with_unit(&estimate(fit, one), one.parameter.unit());
        let equal = if value.starts_with(['≥', '≤', '–']) { "" } else { "= " };
        format!("{} {equal}{value}", one.parameter.symbol())
    });
    [
        estimates.collect::<Vec<_>>().join(",   "),
        format!("model {},   {},   {}", fit.fidelity, count_of(fit.shots_used, "shot"), chi2_words(fit)),
    ]
}

/// A standardized residual.
#[derive(Clone, Copy, Debug)]
struct Value {
    series: usize,
    standardized: f64,
    /// Cut angle (degrees), speed, and number of the shot; NaN if unknown.
    against: [f64; 3],
}

/// All numbers of a fit or of a comparison, a label for each.
#[derive(Default)]
struct Observed {
    /// The name of each measured quantity, or of each label.
    series: Vec<String>,
    values: Vec<Value>,
    labels: Vec<Label>,
}

/// Names of the velocities after the impact in the frame of the collision.
const IN_COLLISION_FRAME: [&str; 4] = [
    "cue ball along the line of centres",
    "cue ball across it",
    "object ball along it",
    "object ball across it",
];

impl Observed {
    /// Adds the velocities after each impact of a film, in the frame of the collision.
    fn add_film(&mut self, film: &FittedFilm) {
        self.series = IN_COLLISION_FRAME.map(str::to_owned).to_vec();
        for (i, shot) in film.names().into_iter().enumerate() {
            let (Some(motion), Some(offsets)) = (film.solution.motion(i), film.solution.offsets(0, i)) else {
                continue;
            };
            let against = [motion.cut.to_degrees(), motion.speed, i as f64 + 1.0];
            for (series, name) in IN_COLLISION_FRAME.into_iter().enumerate() {
                let (off, sd) = (offsets.values[series], offsets.covariance[(series, series)].sqrt());
                self.add(shot, name, Value { series, standardized: off / sd, against });
            }
        }
    }

    fn add_table(&mut self, fit: &Fit) {
        let shots = fit.residuals.chunk_by(|one, next| one.shot == next.shot);
        for (i, residual) in shots.enumerate().flat_map(|(i, own)| own.iter().map(move |one| (i, one))) {
            let name = residual.observable.label();
            let series = self.series.iter().position(|known| known == name).unwrap_or_else(|| {
                self.series.push(name.to_owned());
                self.series.len() - 1
            });
            self.add_residual(&residual.shot, series, i as f64 + 1.0, residual);
        }
    }

    fn add_residual(&mut self, shot: &str, series: usize, order: f64, residual: &Residual) {
        let Residual { observable, standardized, cut, speed, .. } = *residual;
        let against = [cut.to_degrees(), speed.unwrap_or(f64::NAN), order];
        self.add(shot, observable.label(), Value { series, standardized, against });
    }

    /// Adds a residual that has a standard deviation.
    fn add(&mut self, shot: &str, quantity: &str, value: Value) {
        if !is_drawable(value.standardized) {
            return;
        }
        let words = format!("{quantity}, {:+.2} standard deviations", value.standardized);
        self.labels.push(Label { shot: shot.to_owned(), words });
        self.values.push(value);
    }

    fn figure(&self, title: String, panels: Vec<Panel>) -> Figure {
        let count = |series: usize| self.values.iter().filter(|value| value.series == series).count();
        let names = self.series.iter().enumerate();
        let mut figure = Figure::new(title);
        figure.series = names.map(|(i, name)| format!("{name} ({})", count(i))).collect();
        figure.labels.clone_from(&self.labels);
        if self.values.is_empty() {
            figure.say("No residual has a standard deviation.");
        }
        figure.add_rows(ROW, 3, panels);
        figure
    }

    /// Adds values at these places to a panel: of very many every n-th row, and the large
    /// residuals.
    fn draw(&self, panel: &mut Panel, mut places: Vec<(usize, [f64; 2])>) {
        /// More points would hide each other, and an SVG grows with each.
        const MOST: usize = 2000;
        let (every, rows) = (places.len().div_ceil(MOST).max(1), self.series.len().max(1));
        places.retain(|(i, _)| (i / rows).is_multiple_of(every) || self.values[*i].standardized.abs() > 3.0);
        if places.len() < self.values.len() {
            panel.about += &format!("; {} of {} points", places.len(), self.values.len());
        }
        // at which overlapping points can still be distinguished
        let opacity = (8.0 / (places.len() as f64).sqrt()).clamp(0.25, 0.85);
        panel.points(places.into_iter().map(|(i, at)| Point {
            opacity,
            label: Some(i),
            ..Point::new(at, self.values[i].series)
        }));
    }

    /// Returns a panel of standardized residuals against each quantity that is known and differs.
    fn against(&self, speed_axis: &str) -> Vec<Panel> {
        let kinds = [
            ("against cut angle", Axis::new(CUT_AXIS)),
            ("against speed", Axis::new(speed_axis)),
            ("in the order of the shots", Axis::with("number of the shot", Scale::Whole)),
        ];
        let mut panels = Vec::new();
        for (kind, (words, x)) in kinds.into_iter().enumerate() {
            let places =
                self.values.iter().map(|value| [value.against[kind], value.standardized]).enumerate();
            let places: Vec<_> = places.filter(|(_, at)| is_drawable(at[0])).collect();
            let [least, most] = ends(places.iter().map(|(_, at)| at[0]));
            if least >= most {
                continue;
            }
            let y = Axis::with(STANDARDIZED, Scale::Symmetric(3.2));
            let mut panel = Panel::new(format!("Residuals {words}"), "band: ±2 sd", x, y);
            panel.rectangle([f64::NEG_INFINITY, f64::INFINITY], [-2.0, 2.0], BAND);
            panel.horizontal(0.0);
            self.draw(&mut panel, places);
            panels.push(panel);
        }
        panels
    }

    /// Returns the sorted residuals, of which there are at least three, against the quantiles of a
    /// normal distribution, with the band that holds 95 % of samples at each place.
    fn quantiles(&self) -> Option<Panel> {
        /// Number of corners of either side of the band.
        const PLACES: usize = 60;
        let mut sorted: Vec<usize> = (0..self.values.len()).collect();
        sorted.sort_by(|a, b| self.values[*a].standardized.total_cmp(&self.values[*b].standardized));
        let n = Some(sorted.len()).filter(|n| *n >= 3)?;
        let normal = Normal::standard();
        let quantile = |i: usize| normal.inverse_cdf((i as f64 + 0.5) / n as f64);
        let end = quantile(n - 1).max(1.0);
        // even in quantiles, since the ends matter
        let even = (0..=PLACES).map(|k| end * (2.0 * k as f64 / PLACES as f64 - 1.0));
        let mut places: Vec<usize> = even.map(|z| ((normal.cdf(z) * n as f64) as usize).min(n - 1)).collect();
        places.dedup();
        // the i-th smallest of n uniform numbers has the distribution Beta(i, n + 1 − i)
        let edge = |i: usize, p: f64| {
            let beta = Beta::new((i + 1) as f64, (n - i) as f64).ok()?;
            Some([quantile(i), normal.inverse_cdf(beta.inverse_cdf(p))])
        };
        let low = places.iter().filter_map(|i| edge(*i, 0.025));
        let high = places.iter().rev().filter_map(|i| edge(*i, 0.975));
        let mut panel = Panel::new(
            "Are the residuals normal?",
            "line: normal; band: 95 % of samples",
            Axis::with("quantile of the normal distribution", Scale::Symmetric(1.5)),
            Axis::with(STANDARDIZED, Scale::Symmetric(2.5)),
        );
        panel.area(low.chain(high), BAND);
        panel.line([[-end, -end], [end, end]], INK, 1);
        let at = |(place, i): (usize, &usize)| (*i, [quantile(place), self.values[*i].standardized]);
        self.draw(&mut panel, sorted.iter().enumerate().map(at).collect());
        Some(panel)
    }
}
