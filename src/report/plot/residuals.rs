//! residuals.svg and residuals.png, of a fit and of a comparison: what a reader looks at before believing it.

use statrs::distribution::{Beta, ContinuousCDF, Normal};

use super::axis::{ends, is_drawable};
use super::observed::{Observed, Value};
use super::{Axis, BAND, CUT_AXIS, Figure, INK, Mark, Panel, Point, Row, color};
use crate::compare::Comparison;
use crate::fit::Fit;
use crate::report::document::{self, BudgetPart};
use crate::report::number::{count_of, plain};
use crate::report::table::{chi2_text, estimate, with_unit};
use crate::report::{noise_estimated, reduced_chi2, symbol, title};

/// Height of a row of panels, pixels.
const ROW: u32 = 400;

/// Name of the axis of standardized residuals.
const STANDARDIZED: &str = "(measured − predicted) / sd";

/// Returns the residuals of a fit below its title, estimates, χ², and what the reader must know first. Panels without data are left
/// out, with the reason.
pub fn residuals(fit: &Fit) -> Figure {
    let observed = Observed::of(fit);
    let stopped = (!fit.converged).then(|| format!("Not converged: {}", fit.termination));
    let warnings: Vec<&str> = stopped.iter().map(String::as_str).chain(fit.warnings()).collect();
    let mut figure = Figure::new(title(fit));
    figure.lines = summary(fit);
    figure.warning = warnings.first().map(|first| match warnings.len() - 1 {
        0 => (*first).to_owned(),
        more => format!("(+{more} more) {first}"),
    });
    let mut panels = observed.against(&AGAINST, &mut figure);
    panels.extend(observed.groups().iter().map(|group| observed.measured(group)));
    panels.extend(observed.quantiles());
    panels.extend(budget(fit));
    while !panels.is_empty() {
        let columns = if panels.len() == 3 { 3 } else { panels.len().min(2) };
        figure.rows.push(Row { height: ROW, columns, panels: panels.drain(..columns).collect() });
    }
    figure
}

/// Returns the residuals of all labels of a comparison, each in its colour.
pub(crate) fn of_comparison(comparison: &Comparison) -> Figure {
    let mut figure = Figure::new("Residuals of the joint fit");
    let panels = Observed::of_comparison(comparison).against(&AGAINST[..2], &mut figure);
    figure.add_rows(ROW, 2, panels);
    figure
}

/// Returns the estimates, and the model with χ².
fn summary(fit: &Fit) -> Vec<String> {
    let estimates = fit.estimates.iter().map(|one| {
        let value = with_unit(&estimate(fit, one), one.parameter.unit(), " ");
        let equal = if value.starts_with(['≥', '≤', '–']) { "" } else { "= " };
        format!("{} {equal}{value}", one.parameter.symbol())
    });
    let chi2 = match reduced_chi2(fit) {
        Some(reduced) => {
            let how = if noise_estimated(fit) { "; noise estimated from these residuals" } else { "" };
            let counted = match fit.frames {
                Some(_) => format!(" of {}", fit.counted().words()),
                None => String::new(),
            };
            let chi2 = plain(fit.chi2, 4);
            format!("χ²/dof{counted} = {} (χ² = {chi2}, {} dof{how})", chi2_text(reduced), fit.dof)
        }
        None => "no degrees of freedom".to_owned(),
    };
    vec![
        estimates.collect::<Vec<_>>().join(",   "),
        format!("model {},   {},   {chi2}", fit.fidelity, count_of(fit.shots_used, "shot")),
    ]
}

/// What standardized residuals are drawn against.
struct Against {
    title: &'static str,
    axis: fn(&Observed) -> Axis,
    /// What a value without it lacks.
    unknown: &'static str,
    value: fn(&Value) -> f64,
}

const AGAINST: [Against; 3] = [
    Against {
        title: "Residuals against cut angle",
        axis: |_| Axis::new(CUT_AXIS),
        unknown: "cut angle",
        value: |value| value.cut,
    },
    Against {
        title: "Residuals against speed",
        axis: |observed| Axis::new(observed.speed_axis.as_str()),
        unknown: "speed",
        value: |value| value.speed,
    },
    Against {
        title: "Residuals in the order of the shots",
        axis: |_| Axis { is_whole: true, ..Axis::new("number of the shot") },
        unknown: "order",
        value: |value| value.order,
    },
];

/// The remark about points that are not in a panel.
fn left_out(count: usize, why: &str) -> Option<String> {
    (count > 0).then(|| format!("{} left out: {why}", count_of(count, "point")))
}

impl Observed {
    /// Returns the remarks on a panel, with the number of points drawn if not all are.
    fn about<const N: usize>(&self, first: &str, others: [Option<String>; N]) -> String {
        let all = [Some(first.to_owned()), self.thinned.clone()].into_iter().chain(others);
        all.flatten().collect::<Vec<_>>().join("; ")
    }

    /// Returns the points of those values that are drawn, at an opacity at which overlapping ones can still be distinguished.
    fn points<'a>(&self, values: impl Iterator<Item = (&'a Value, [f64; 2])>) -> Mark {
        let opacity = match self.values.len() {
            0..=60 => 0.85,
            61..=400 => 0.6,
            401..=1500 => 0.4,
            _ => 0.25,
        };
        let drawn = values.filter(|(value, _)| value.is_drawn);
        let points = drawn.map(|(value, at)| Point {
            opacity,
            label: Some(value.label),
            ..Point::new(at, value.series)
        });
        Mark::Points(points.collect())
    }

    /// Returns the values that have a standardized residual.
    fn standardized(&self) -> Vec<&Value> {
        self.values.iter().filter(|value| is_drawable(value.standardized)).collect()
    }

    /// Returns a panel of standardized residuals against each quantity that is known and differs; says in the figure, to which it adds
    /// series and labels, why others are left out.
    fn against(&self, kinds: &[Against], figure: &mut Figure) -> Vec<Panel> {
        figure.series = self.series.iter().map(|series| series.legend.clone()).collect();
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
        if self.labels.iter().all(|label| label.shot == self.labels[0].shot) {
            figure.lines.push("There is one shot: its residuals are drawn against nothing.".to_owned());
            return Vec::new();
        }
        let mut panels = Vec::new();
        for kind in kinds {
            let seen: Vec<(&Value, [f64; 2])> = standardized
                .iter()
                .map(|value| (*value, [(kind.value)(value), value.standardized]))
                .filter(|(_, at)| is_drawable(at[0]))
                .collect();
            let [least, most] = ends(seen.iter().map(|(_, at)| at[0]));
            match seen.len() {
                0 => figure.lines.push(format!("The {} is not known for any observation.", kind.unknown)),
                2.. if least == most => {
                    figure.lines.push(format!("The {} is the same for all observations.", kind.unknown));
                }
                _ => panels.push(self.residuals(kind, &seen, standardized.len())),
            }
        }
        panels
    }

    /// Returns a panel of some of the standardized residuals against a quantity.
    fn residuals(&self, kind: &Against, seen: &[(&Value, [f64; 2])], standardized: usize) -> Panel {
        // residuals of different quantities may go opposite ways: their mean would hide it
        let is_one = self.series.len() == 1;
        let means = if is_one { means(seen.iter().map(|(_, at)| *at).collect()) } else { Vec::new() };
        let about = self.about(
            if means.is_empty() { "band: ±2 sd" } else { "band: ±2 sd; black: local mean ± its error" },
            [
                left_out(self.values.len() - standardized, "no sd"),
                left_out(standardized - seen.len(), &format!("no {}", kind.unknown)),
            ],
        );
        let mut panel = Panel::new(kind.title, about, (kind.axis)(self), Axis::symmetric(STANDARDIZED, 3.2));
        panel.marks.extend([Mark::Strip([-2.0, 2.0]), Mark::Horizontal(0.0)]);
        panel.marks.push(self.points(seen.iter().copied()));
        for bar in means {
            panel.line(bar, INK, 3);
        }
        panel
    }

    /// Returns the series that share a panel of measured against predicted: each by itself while they are few, else those of a unit.
    fn groups(&self) -> Vec<Vec<usize>> {
        const FEW: usize = 3;
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (index, series) in self.series.iter().enumerate() {
            let is_shared = |group: &&mut Vec<usize>| {
                self.series.len() > FEW && self.series[group[0]].unit == series.unit
            };
            match groups.iter_mut().find(is_shared) {
                Some(group) => group.push(index),
                None => groups.push(vec![index]),
            }
        }
        groups
    }

    /// Returns measured against predicted values, with the line on which they are equal.
    fn measured(&self, group: &[usize]) -> Panel {
        let first = &self.series[group[0]];
        let name = if group.len() > 1 { first.kind } else { &first.name };
        let axis = |what: &str| match first.unit {
            "" => Axis::new(format!("{what} {name}")),
            unit => Axis::new(format!("{what} {name} ({unit})")),
        };
        let own: Vec<&Value> = self.values.iter().filter(|value| group.contains(&value.series)).collect();
        let place = |value: &Value| [value.predicted, value.measured];
        let has_place = |value: &&&Value| place(value).into_iter().all(is_drawable);
        let seen: Vec<&Value> = own.iter().filter(has_place).copied().collect();
        let longest = longest_bar(&seen);
        let about = self.about(
            if longest.is_some() { "bars: ± sd" } else { "no sd known" },
            [left_out(own.len() - seen.len(), "number too large to draw")],
        );
        let mut panel = Panel::new("Measured against predicted", about, axis("predicted"), axis("measured"));
        let mut points = self.points(seen.iter().map(|value| (*value, place(value))));
        if let Mark::Points(points) = &mut points {
            let drawn = seen.iter().filter(|value| value.is_drawn);
            for (point, value) in points.iter_mut().zip(drawn) {
                point.sd = longest.map(|longest| value.sd.min(longest));
            }
        }
        // as long on either axis as all bars
        let bars = seen.iter().map(|value| (value, longest.map_or(0.0, |longest| value.sd.min(longest))));
        let [low, high] = ends(bars.flat_map(|(value, sd)| {
            let sd = if is_drawable(sd) { sd } else { 0.0 };
            [value.predicted, value.measured - sd, value.measured + sd]
        }));
        panel.line([[low, low], [high, high]], INK, 1);
        panel.marks.push(points);
        panel
    }

    /// Returns the sorted residuals against the quantiles of a normal distribution, with the band that holds 95 % of samples at each
    /// place.
    fn quantiles(&self) -> Option<Panel> {
        let mut sorted = self.standardized();
        sorted.sort_by(|a, b| a.standardized.total_cmp(&b.standardized));
        let n = sorted.len();
        let quantile = |i: usize| Normal::standard().inverse_cdf((i as f64 + 0.5) / n as f64);
        let end = quantile(n.checked_sub(1)?).max(1.0);
        let mut panel = Panel::new(
            "Are the residuals normal?",
            self.about("line: normal; band: 95 % of samples", [left_out(self.values.len() - n, "no sd")]),
            Axis::symmetric("quantile of the normal distribution", 1.5),
            Axis::symmetric(STANDARDIZED, 2.5),
        );
        panel.area(band(n, quantile), BAND);
        panel.line([[-end, -end], [end, end]], INK, 1);
        let places = sorted.iter().enumerate().map(|(i, value)| (*value, [quantile(i), value.standardized]));
        panel.marks.push(self.points(places));
        Some(panel)
    }
}

/// Returns how long bars are drawn at most, so that a few that are much longer do not shrink the data to a dot; `None` without any.
fn longest_bar(values: &[&Value]) -> Option<f64> {
    /// Times the median of the bars, and part of the range of the values.
    const TIMES: f64 = 3.0;
    const PART: f64 = 0.35;
    let mut sds: Vec<f64> = values.iter().map(|value| value.sd).filter(|sd| is_drawable(*sd)).collect();
    sds.sort_by(f64::total_cmp);
    let [low, high] = ends(values.iter().map(|value| value.measured));
    Some((TIMES * sds.get(sds.len() / 2)?).max(PART * (high - low)))
}

/// Returns means of a dozen groups of neighbours ± their standard errors, as bars, if there are so many points that the eye no longer
/// averages them.
fn means(mut points: Vec<[f64; 2]>) -> Vec<[[f64; 2]; 2]> {
    const MANY: usize = 200;
    const GROUPS: usize = 12;
    if points.len() < MANY {
        return Vec::new();
    }
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mean = |group: &[[f64; 2]]| {
        let n = group.len() as f64;
        let [x, y] = [0, 1].map(|i| group.iter().map(|point| point[i]).sum::<f64>() / n);
        let variance = group.iter().map(|point| (point[1] - y).powi(2)).sum::<f64>() / (n - 1.0);
        let error = (variance / n).sqrt();
        [[x, y - error], [x, y + error]]
    };
    points.chunks(points.len().div_ceil(GROUPS)).filter(|group| group.len() > 1).map(mean).collect()
}

/// Returns the outline of the band at some 60 places: the i-th smallest of n uniform numbers has the distribution
/// Beta(i, n + 1 − i).
fn band(n: usize, quantile: impl Fn(usize) -> f64) -> Vec<[f64; 2]> {
    const PLACES: usize = 60;
    let normal = Normal::standard();
    let extreme = normal.inverse_cdf(0.5 / n as f64);
    let mut indices: Vec<usize> = (0..=PLACES)
        .map(|k| extreme * (1.0 - 2.0 * k as f64 / PLACES as f64))
        .map(|z| ((normal.cdf(z) * n as f64) as usize).min(n - 1))
        .collect();
    indices.dedup();
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for i in indices {
        let Ok(beta) = Beta::new((i + 1) as f64, (n - i) as f64) else { continue };
        low.push([quantile(i), normal.inverse_cdf(beta.inverse_cdf(0.025))]);
        high.push([quantile(i), normal.inverse_cdf(beta.inverse_cdf(0.975))]);
    }
    low.into_iter().chain(high.into_iter().rev()).collect()
}

/// Returns what makes up the variances of μ, μ_s and e, as bars; `None` if that is noise alone.
fn budget(fit: &Fit) -> Option<Panel> {
    /// Sources that are shown of a parameter, and the smallest part of the variance that is.
    const SOURCES: usize = 4;
    const LEAST: f64 = 0.01;
    let mut bars: Vec<(String, f64, usize)> = Vec::new();
    let mut is_noise_alone = true;
    for (series, found) in fit.budget.iter().enumerate() {
        let parts = document::budget(found);
        let variance = |part: &BudgetPart| part.std_error.unwrap_or(0.0).powi(2);
        let total: f64 = parts.iter().map(variance).sum();
        for part in parts.iter().take(SOURCES).filter(|part| variance(part) >= LEAST * total) {
            is_noise_alone &= part.source == "noise";
            let words = format!("{}: {}", symbol(found.id.name()), symbol(&part.source));
            bars.push((words, 100.0 * variance(part) / total, series));
        }
    }
    bars.reverse();
    let words: Vec<String> = bars.iter().map(|(words, ..)| words.clone()).collect();
    let about = "what it would take away to know each source exactly";
    let mut panel =
        Panel::new("Error budget", about, Axis::new("part of the variance (%)"), Axis::of_words(words));
    for (row, (_, end, series)) in bars.iter().enumerate() {
        let [low, high] = [-0.35, 0.35].map(|half| row as f64 + half);
        panel.area([[0.0, low], [*end, low], [*end, high], [0.0, high]], color(*series));
    }
    (!is_noise_alone).then_some(panel)
}
