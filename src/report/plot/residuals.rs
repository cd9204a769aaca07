//! residuals.svg and residuals.png, of a fit and of a comparison: what a reader looks at before believing it.

use statrs::distribution::{Beta, ContinuousCDF, Normal};

use super::axis::{ends, is_drawable};
use super::{Axis, BAND, CUT_AXIS, Figure, INK, Label, OFF_THE_AXIS, Panel, Point, SPEED_AXIS};
use crate::compare::Comparison;
use crate::fit::{Fit, FittedFilm, Residual};
use crate::measurement::number::{count_of, plain};
use crate::report::terminal::{chi2_text, estimate, with_unit};
use crate::report::{noise_estimated, reduced_chi2, speed_unit, title};

/// Height of a row of panels, pixels.
const ROW: u32 = 400;

/// Name of the axis of standardized residuals.
const STANDARDIZED: &str = "(measured − predicted) / sd";

/// Returns the residuals of a fit below its title, estimates, χ², and what the reader must know first. Panels without data are left
/// out, with the reason.
#[must_use]
pub fn residuals(fit: &Fit) -> Figure {
    let observed = Observed::of(fit);
    let warnings = fit.warnings();
    let mut figure = Figure::new(title(fit));
    figure.lines = summary(fit);
    figure.warning = warnings.first().map(|first| match warnings.len() - 1 {
        0 => (*first).to_owned(),
        more => format!("(+{more} more) {first}"),
    });
    let mut panels = observed.against(3, &mut figure);
    panels.extend(observed.quantiles());
    panels.extend(super::others::budget(fit));
    // the last three side by side, so that none stands alone
    let three = if panels.len().is_multiple_of(2) {
        Vec::new()
    } else {
        panels.split_off(panels.len().saturating_sub(3))
    };
    figure.add_rows(ROW, 2, panels);
    figure.add_rows(ROW, three.len().max(1), three);
    figure
}

/// Returns the residuals of all labels of a comparison, each in its colour.
pub(crate) fn of_comparison(comparison: &Comparison) -> Figure {
    let mut observed = Observed { speed_axis: SPEED_AXIS.to_owned(), ..Observed::default() };
    observed.series.clone_from(&comparison.labels);
    for residual in &comparison.residuals {
        let shot = comparison.shot_name(residual);
        observed.add_residual(&shot, residual.label, f64::NAN, &residual.of_shot);
    }
    observed.thin();
    let mut figure = Figure::new("Residuals of the joint fit");
    let panels = observed.against(2, &mut figure);
    figure.add_rows(ROW, 2, panels);
    figure
}

fn summary(fit: &Fit) -> Vec<String> {
    let estimates = fit.estimates.iter().map(|one| {
        let value = with_unit(&estimate(fit, one), one.parameter.unit());
        let equal = if value.starts_with(['≥', '≤', '–']) { "" } else { "= " };
        format!("{} {equal}{value}", one.parameter.symbol())
    });
    let chi2 = match reduced_chi2(fit) {
        Some(reduced) => {
            let how = if noise_estimated(fit) { "; noise estimated from these residuals" } else { "" };
            let of_film = format!(" of {}", fit.counted().words());
            let of = if fit.frames.is_some() { of_film.as_str() } else { "" };
            let chi2 = plain(fit.chi2, 4);
            format!("χ²/dof{of} = {} (χ² = {chi2}, {} dof{how})", chi2_text(reduced), fit.dof)
        }
        None => "no degrees of freedom".to_owned(),
    };
    vec![
        estimates.collect::<Vec<_>>().join(",   "),
        format!("model {},   {},   {chi2}", fit.fidelity, count_of(fit.shots_used, "shot")),
    ]
}

/// A standardized residual.
#[derive(Clone, Copy, Debug)]
struct Value {
    series: usize,
    standardized: f64,
    /// Cut angle (degrees), speed, and number of the shot; NaN if unknown.
    against: [f64; 3],
    /// Whether it is among those drawn.
    is_drawn: bool,
}

/// All numbers of a fit or of a comparison, a label for each.
#[derive(Default)]
struct Observed {
    /// The name of each measured quantity, or of each label.
    series: Vec<String>,
    values: Vec<Value>,
    labels: Vec<Label>,
    /// How many are drawn, if they are too many.
    thinned: Option<String>,
    speed_axis: String,
}

/// Names of the velocities after the impact in the frame of the collision.
const IN_COLLISION_FRAME: [&str; 4] = [
    "cue ball along the line of centres",
    "cue ball across it",
    "object ball along it",
    "object ball across it",
];

/// The axes that standardized residuals are drawn against: the quantity, and what stands in the title.
const AGAINST: [(&str, &str); 3] =
    [("cut angle", "against cut angle"), ("speed", "against speed"), ("order", "in the order of the shots")];

impl Observed {
    fn of(fit: &Fit) -> Self {
        let speed_axis = match fit.discs {
            Some(discs) => format!("speed of the first disc before impact ({})", speed_unit(&discs)),
            None => SPEED_AXIS.to_owned(),
        };
        let mut observed = Self { speed_axis, ..Self::default() };
        match &fit.frames {
            Some(film) => observed.add_film(film),
            None => observed.add_table(fit),
        }
        observed.thin();
        observed
    }

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
                self.add(shot, name, Value { series, standardized: off / sd, against, is_drawn: true });
            }
        }
    }

    fn add_table(&mut self, fit: &Fit) {
        let shots = fit.residuals.chunk_by(|one, next| one.shot == next.shot);
        for (i, residual) in shots.enumerate().flat_map(|(i, own)| own.iter().map(move |one| (i, one))) {
            let name = residual.observable.label();
            let series = self.series.iter().position(|known| known == name).unwrap_or(self.series.len());
            if series == self.series.len() {
                self.series.push(name.to_owned());
            }
            self.add_residual(&residual.shot, series, i as f64 + 1.0, residual);
        }
    }

    fn add_residual(&mut self, shot: &str, series: usize, order: f64, residual: &Residual) {
        let Residual { observable, standardized, cut, speed, .. } = *residual;
        let against = [cut.to_degrees(), speed.unwrap_or(f64::NAN), order];
        self.add(shot, observable.label(), Value { series, standardized, against, is_drawn: true });
    }

    fn add(&mut self, shot: &str, quantity: &str, value: Value) {
        let words = format!("{quantity}, {:+.2} standard deviations", value.standardized);
        self.labels.push(Label { shot: shot.to_owned(), words });
        self.values.push(value);
    }

    /// Draws every n-th value of each series, so that rows in a regular order lose none, and the largest residuals.
    fn thin(&mut self) {
        /// More points would hide each other, and an SVG grows with each.
        const MOST: usize = 2000;
        /// Of the points left out, how many of the largest residuals are drawn nevertheless.
        const EXTREMES: usize = 100;
        let total = self.values.len();
        if total <= MOST {
            return;
        }
        let every = total.div_ceil(MOST);
        let mut seen = vec![0_usize; self.series.len()];
        for value in &mut self.values {
            value.is_drawn = seen[value.series].is_multiple_of(every);
            seen[value.series] += 1;
        }
        let mut hidden: Vec<&mut Value> = self.values.iter_mut().filter(|value| !value.is_drawn).collect();
        let size = |z: f64| if is_drawable(z) { z.abs() } else { 0.0 };
        hidden.sort_by(|a, b| size(b.standardized).total_cmp(&size(a.standardized)));
        hidden.into_iter().take(EXTREMES).for_each(|value| value.is_drawn = true);
        let drawn = self.values.iter().filter(|value| value.is_drawn).count();
        self.thinned = Some(format!("{drawn} of {total} points drawn, outliers kept"));
    }

    /// Returns the remarks on a panel, with how many points are drawn, and how many are left out for which reason.
    fn about(&self, first: &str, left_out: &[(usize, String)]) -> String {
        let left_out = left_out.iter().filter(|(count, _)| *count > 0);
        let left_out = left_out.map(|(count, why)| format!("{} left out: {why}", count_of(*count, "point")));
        let all = [first.to_owned()].into_iter().chain(self.thinned.clone()).chain(left_out);
        all.collect::<Vec<_>>().join("; ")
    }

    /// Returns the points of those values that are drawn, at an opacity at which overlapping ones can still be distinguished.
    fn points(&self, places: &[(usize, [f64; 2])]) -> Vec<Point> {
        let opacity = match self.values.len() {
            0..=60 => 0.85,
            61..=400 => 0.6,
            401..=1500 => 0.4,
            _ => 0.25,
        };
        let drawn = places.iter().filter(|(value, _)| self.values[*value].is_drawn);
        let point = |(value, at): &(usize, [f64; 2])| Point {
            opacity,
            label: Some(*value),
            ..Point::new(*at, self.values[*value].series)
        };
        drawn.map(point).collect()
    }

    fn standardized(&self) -> Vec<usize> {
        (0..self.values.len()).filter(|i| is_drawable(self.values[*i].standardized)).collect()
    }

    /// Returns a panel of standardized residuals against each quantity that is known and differs; says in the figure, to which it adds
    /// series and labels, why others are left out.
    fn against(&self, kinds: usize, figure: &mut Figure) -> Vec<Panel> {
        let count = |series: usize| self.values.iter().filter(|value| value.series == series).count();
        let names = self.series.iter().enumerate();
        figure.series = names.map(|(i, name)| format!("{name} ({})", count(i))).collect();
        figure.labels.clone_from(&self.labels);
        let standardized = self.standardized();
        if standardized.is_empty() {
            let why = if self.values.is_empty() {
                "No observations."
            } else {
                "No standard deviations: the residuals cannot be standardized."
            };
            figure.lines.push(why.to_owned());
            return Vec::new();
        }
        let mut panels = Vec::new();
        for (kind, (quantity, words)) in AGAINST.into_iter().enumerate().take(kinds) {
            let places = standardized.iter().map(|i| (*i, &self.values[*i]));
            let places = places.map(|(i, value)| (i, [value.against[kind], value.standardized]));
            let seen: Vec<(usize, [f64; 2])> = places.filter(|(_, at)| is_drawable(at[0])).collect();
            let [least, most] = ends(seen.iter().map(|(_, at)| at[0]));
            if seen.is_empty() {
                figure.lines.push(format!("The {quantity} is not known for any observation."));
                continue;
            }
            if least == most {
                figure.lines.push(format!("The {quantity} is the same for all observations."));
                continue;
            }
            let x = match kind {
                0 => Axis::new(CUT_AXIS),
                1 => Axis::new(self.speed_axis.as_str()),
                _ => Axis { is_whole: true, ..Axis::new("number of the shot") },
            };
            let left_out = [
                (self.values.len() - standardized.len(), "no sd".to_owned()),
                (standardized.len() - seen.len(), format!("no {quantity}")),
            ];
            let about = self.about("band: ±2 sd", &left_out);
            let y = Axis::symmetric(STANDARDIZED, 3.2);
            let mut panel = Panel::new(format!("Residuals {words}"), about, x, y);
            panel.area(
                [[-OFF_THE_AXIS, -2.0], [OFF_THE_AXIS, -2.0], [OFF_THE_AXIS, 2.0], [-OFF_THE_AXIS, 2.0]],
                BAND,
            );
            panel.horizontal(0.0, INK);
            panel.points(self.points(&seen));
            panels.push(panel);
        }
        panels
    }

    /// Returns the sorted residuals against the quantiles of a normal distribution, with the band that holds 95 % of samples at each
    /// place.
    fn quantiles(&self) -> Option<Panel> {
        /// Number of corners of either side of the band.
        const PLACES: usize = 60;
        let mut sorted = self.standardized();
        sorted.sort_by(|a, b| self.values[*a].standardized.total_cmp(&self.values[*b].standardized));
        let n = sorted.len();
        let normal = Normal::standard();
        let quantile = |i: usize| normal.inverse_cdf((i as f64 + 0.5) / n as f64);
        let end = quantile(n.checked_sub(1)?).max(1.0);
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
            self.about("line: normal; band: 95 % of samples", &[(self.values.len() - n, "no sd".to_owned())]),
            Axis::symmetric("quantile of the normal distribution", 1.5),
            Axis::symmetric(STANDARDIZED, 2.5),
        );
        panel.area(low.chain(high), BAND);
        panel.line([[-end, -end], [end, end]], INK, 1);
        let at = |(i, value): (usize, &usize)| (*value, [quantile(i), self.values[*value].standardized]);
        panel.points(self.points(&sorted.iter().enumerate().map(at).collect::<Vec<_>>()));
        Some(panel)
    }
}
