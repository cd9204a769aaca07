//! residuals.svg and residuals.png, of a fit and of a comparison: what a reader looks at before
//! believing it.

use indexmap::IndexMap;
use rayon::prelude::*;
use statrs::distribution::{Beta, ContinuousCDF, Normal};

use super::axis::{ends, is_drawable};
use super::others::budget;
use super::{ALARM, Axis, BAND, CUT_AXIS, Figure, GREY, INK, Label, Panel, Point, Scale};
use crate::compare::Comparison;
use crate::fit::{Fit, FittedFilm, Residual};
use crate::measurement::number::{count_of, with_unit};
use crate::report::terminal::estimate;
use crate::report::{chi2_words, sources, speed_unit, title};

/// Names of axes.
const STANDARDIZED: &str = "(measured − predicted) / sd";
const SPEED_AXIS: &str = "cue-ball speed before impact (m/s)";

/// Returns the residuals of a fit below its title, estimates, χ², and what the reader must know
/// first.
pub(in crate::report) fn residuals(fit: &Fit) -> Figure {
    let observed = fit.frames.as_ref().map_or_else(|| Observed::of_table(fit), Observed::of_film);
    let speed_axis = fit.discs.map_or(SPEED_AXIS.to_owned(), |discs| {
        format!("speed of the first disc before impact ({})", speed_unit(&discs))
    });
    let mut panels = observed.against(&speed_axis);
    panels.extend(observed.quantiles());
    let is_noise_alone = fit.budget.iter().flat_map(sources).all(|(source, _)| source == "noise");
    if !is_noise_alone || panels.is_empty() && !fit.budget.is_empty() {
        panels.push(budget(&fit.budget));
    }
    let estimates = fit.estimates.iter().map(|one| {
        let value = with_unit(&estimate(fit, one), one.parameter.unit());
        let equal = if value.starts_with(['≥', '≤', '–']) { "" } else { "= " };
        format!("{} {equal}{value}", one.parameter.symbol())
    });
    let estimates = estimates.collect::<Vec<_>>().join(",   ");
    let shots = count_of(fit.shots_used(), "shot");
    let model = format!("model {},   {shots},   {}", fit.fidelity, chi2_words(fit));
    let mut figure = observed.figure(title(fit), panels);
    figure.lines.splice(0..0, [(estimates, GREY), (model, GREY)]);
    let warnings = fit.warnings();
    let more = if warnings.len() > 1 { format!("(+{} more) ", warnings.len() - 1) } else { String::new() };
    figure.lines.extend(warnings.first().map(|first| (format!("{more}{first}"), ALARM)));
    figure
}

/// Returns the residuals of all labels of a comparison, each in its colour.
pub(in crate::report) fn of_comparison(comparison: &Comparison) -> Figure {
    let mut observed = Observed::new(comparison.labels.iter());
    for (sample, residual) in comparison.residuals() {
        let shot = format!("{}, {}", sample.title, residual.shot);
        observed.add_residual(&sample.label, &shot, f64::NAN, residual);
    }
    let panels = observed.against(SPEED_AXIS);
    observed.figure("Residuals of the joint fit".to_owned(), panels)
}

/// A standardized residual.
struct Value {
    series: usize,
    standardized: f64,
    /// Cut angle (degrees), speed, and number of the shot; NaN if unknown.
    against: [f64; 3],
    label: Label,
}

/// All numbers of a fit or of a comparison.
struct Observed {
    /// The name of each measured quantity, or of each label, and how many values it has.
    series: IndexMap<String, usize>,
    values: Vec<Value>,
}

/// Names of the velocities after the impact in the frame of the collision.
const IN_COLLISION_FRAME: [&str; 4] = [
    "cue ball along the line of centres",
    "cue ball across it",
    "object ball along it",
    "object ball across it",
];

impl Observed {
    fn new(series: impl Iterator<Item = impl ToString>) -> Self {
        Self { series: series.map(|name| (name.to_string(), 0)).collect(), values: Vec::new() }
    }

    /// Returns the velocities after each impact of a film, in the frame of the collision.
    fn of_film(film: &FittedFilm) -> Self {
        let (names, solution) = (film.solution.names(), &film.solution);
        let offsets = |i: usize| solution.problem.contribute(solution.state(), (0, i)).offsets();
        let of_shot = |i: usize| Some((i, solution.motion(i)?, offsets(i)?));
        let shots: Vec<_> = (0..names.len()).into_par_iter().filter_map(of_shot).collect();
        let mut observed = Self::new(IN_COLLISION_FRAME.iter());
        for (i, motion, offsets) in shots {
            let against = [motion.cut.to_degrees(), motion.speed, i as f64 + 1.0];
            for (k, name) in IN_COLLISION_FRAME.into_iter().enumerate() {
                let standardized = offsets.values[k] / offsets.covariance[(k, k)].sqrt();
                observed.add(name, &names[i], name, standardized, against);
            }
        }
        observed
    }

    fn of_table(fit: &Fit) -> Self {
        let mut observed = Self::new(std::iter::empty::<&str>());
        for (i, of_shot) in fit.residuals.chunk_by(|one, next| one.shot == next.shot).enumerate() {
            for residual in of_shot {
                observed.add_residual(residual.observable.label(), &residual.shot, i as f64 + 1.0, residual);
            }
        }
        observed
    }

    fn add_residual(&mut self, series: &str, shot: &str, order: f64, residual: &Residual) {
        let against = [residual.cut.to_degrees(), residual.speed.unwrap_or(f64::NAN), order];
        self.add(series, shot, residual.observable.label(), residual.standardized, against);
    }

    /// Adds a residual that has a standard deviation.
    fn add(&mut self, series: &str, shot: &str, quantity: &str, standardized: f64, against: [f64; 3]) {
        let entry = self.series.entry(series.to_owned());
        let series = entry.index();
        let count = entry.or_insert(0);
        if is_drawable(standardized) {
            *count += 1;
            let words = format!("{quantity}, {standardized:+.2} standard deviations");
            let label = Label { shot: shot.to_owned(), words };
            self.values.push(Value { series, standardized, against, label });
        }
    }

    fn figure(self, title: String, panels: Vec<Panel>) -> Figure {
        let mut figure = Figure::new(title);
        if self.values.is_empty() {
            figure.say("No residual has a standard deviation.");
        }
        figure.series = self.series.iter().map(|(name, count)| format!("{name} ({count})")).collect();
        figure.labels = self.values.into_iter().map(|value| value.label).collect();
        figure.add_rows(400, 3, panels);
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
        let point = |(i, at)| Point { opacity, label: Some(i), ..Point::new(at, self.values[i].series) };
        panel.points(places.into_iter().map(point));
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
        let x = Axis::with("quantile of the normal distribution", Scale::Symmetric(1.5));
        let y = Axis::with(STANDARDIZED, Scale::Symmetric(2.5));
        let about = "line: normal; band: 95 % of samples";
        let mut panel = Panel::new("Are the residuals normal?", about, x, y);
        panel.area(low.chain(high), BAND);
        panel.line([[-end, -end], [end, end]], INK, 1);
        let at = |(place, i): (usize, &usize)| (*i, [quantile(place), self.values[*i].standardized]);
        self.draw(&mut panel, sorted.iter().enumerate().map(at).collect());
        Some(panel)
    }
}
