//! residuals.svg and residuals.png: what a reader looks at before believing a fit.

use statrs::distribution::{Beta, ContinuousCDF, Normal};

use super::axis::{ends, is_drawable};
use super::observed::{Observed, Value};
use super::{Axis, BAND, Figure, INK, Panel, Point, Row, color};
use crate::fit::Fit;
use crate::report::document::{self, BudgetPart};
use crate::report::number::{count_of, plain};
use crate::report::table::{chi2_text, estimate, with_unit};
use crate::report::{noise_estimated, reduced_chi2, symbol, title};

/// Height of a row of panels, pixels.
const ROW: u32 = 400;

/// Name of the axis of standardized residuals.
pub(super) const STANDARDIZED: &str = "(measured − predicted) / sd";

/// Returns the residuals of a fit below its title, estimates, χ², and what the reader must know first. Panels without data are left
/// out, with the reason.
pub fn residuals(fit: &Fit) -> Figure {
    let observed = Observed::of(fit);
    let mut figure = Figure::new(title(fit));
    figure.lines = summary(fit);
    figure.warning = warning(fit);
    figure.series = observed.series.iter().map(|series| series.legend()).collect();
    figure.labels.clone_from(&observed.labels);
    let groups = observed.groups();
    let mut panels = Vec::new();
    for found in AGAINST.iter().map(|kind| observed.against(kind)) {
        match found {
            Ok(panel) => panels.push(panel),
            Err(reason) if figure.lines.contains(&reason) => {}
            Err(reason) => figure.lines.push(reason),
        }
    }
    panels.extend(groups.iter().map(|group| observed.measured(group)));
    panels.extend(observed.quantiles());
    panels.extend(budget(fit));
    while !panels.is_empty() {
        let columns = if panels.len() == 3 { 3 } else { panels.len().min(2) };
        figure.rows.push(Row { height: ROW, columns, panels: panels.drain(..columns).collect() });
    }
    figure
}

/// Returns the estimates, and the model with χ².
fn summary(fit: &Fit) -> Vec<String> {
    let estimates: Vec<String> = fit
        .estimates
        .iter()
        .map(|one| {
            let value = with_unit(&estimate(fit, one), one.parameter.unit(), " ");
            let equal = if value.starts_with(['≥', '≤']) { "" } else { "= " };
            format!("{} {equal}{value}", one.parameter.symbol())
        })
        .collect();
    let chi2 = match reduced_chi2(fit) {
        Some(chi2) => {
            let how = if noise_estimated(fit) { "; noise estimated from these residuals" } else { "" };
            let counted = match fit.frames {
                Some(_) => format!(" of {}", fit.counted().words()),
                None => String::new(),
            };
            let value = plain(fit.chi2, 4);
            format!("χ²/dof{counted} = {} (χ² = {value}, {} dof{how})", chi2_text(chi2), fit.dof)
        }
        None => "no degrees of freedom".to_owned(),
    };
    vec![
        estimates.join(",   "),
        format!("model {},   {},   {chi2}", fit.fidelity, count_of(fit.shots_used, "shot")),
    ]
}

/// Returns the first warning, and how many more there are.
fn warning(fit: &Fit) -> Option<String> {
    let stopped = (!fit.converged).then(|| format!("Not converged: {}", fit.termination));
    let mut warnings = stopped.iter().chain(&fit.warnings);
    let first = warnings.next()?;
    Some(match warnings.count() {
        0 => first.clone(),
        more => format!("(+{more} more) {first}"),
    })
}

impl Observed {
    /// Returns the opacity at which overlapping points can still be distinguished.
    fn opacity(&self) -> f64 {
        match self.values.len() {
            0..=60 => 0.85,
            61..=400 => 0.6,
            401..=1500 => 0.4,
            _ => 0.25,
        }
    }

    fn point(&self, value: &Value, at: [f64; 2]) -> Point {
        Point { opacity: self.opacity(), label: Some(value.label), ..Point::new(at, value.series) }
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
        let unit = if first.unit.is_empty() { String::new() } else { format!(" ({})", first.unit) };
        let axis = |what: &str| Axis::new(format!("{what} {name}{unit}"));
        let own = || self.values.iter().filter(|value| group.contains(&value.series));
        let seen: Vec<&Value> =
            own().filter(|value| is_drawable(value.measured) && is_drawable(value.predicted)).collect();
        let longest = longest_bar(&seen);
        let bars = if longest.is_some() { "bars: ± sd" } else { "no sd known" };
        let about = [
            Some(bars.to_owned()),
            self.thinned.clone(),
            left_out(own().count() - seen.len(), "number too large to draw"),
        ];
        let mut panel =
            Panel::new("Measured against predicted", joined(&about), axis("predicted"), axis("measured"));
        let both = seen.iter().flat_map(|value| [value.measured, value.predicted]);
        let [low, high] = ends(both);
        panel.line([[low, low], [high, high]], INK, 1);
        let point = |value: &&&Value| Point {
            sd: longest.map(|longest| value.sd.min(longest)),
            ..self.point(value, [value.predicted, value.measured])
        };
        panel.points(seen.iter().filter(|value| value.is_drawn).map(|value| point(&value)));
        panel
    }

    /// Returns standardized residuals against a quantity, or why there are none.
    fn against(&self, kind: &Against) -> Result<Panel, String> {
        if self.values.is_empty() {
            return Err("No observations.".to_owned());
        }
        let standardized: Vec<&Value> =
            self.values.iter().filter(|value| is_drawable(value.standardized)).collect();
        if standardized.is_empty() {
            return Err("No standard deviations: the residuals cannot be standardized.".to_owned());
        }
        let x = |value: &Value| (kind.value)(value);
        let seen: Vec<&Value> = standardized.iter().copied().filter(|value| is_drawable(x(value))).collect();
        if seen.is_empty() {
            return Err(format!("The {} is not known for any observation.", kind.unknown));
        }
        if seen.iter().all(|value| x(value) == x(seen[0])) && seen.len() > 1 {
            return Err(format!("The {} is the same for all observations.", kind.unknown));
        }
        // residuals of different quantities may go opposite ways: their mean would hide it
        let means = if self.series.len() == 1 {
            means(seen.iter().map(|value| [x(value), value.standardized]).collect())
        } else {
            Vec::new()
        };
        let about = [
            Some("band: ±2 sd".to_owned()),
            (!means.is_empty()).then(|| "black: local mean ± its error".to_owned()),
            self.thinned.clone(),
            left_out(self.values.len() - standardized.len(), "no sd"),
            left_out(standardized.len() - seen.len(), &format!("no {}", kind.unknown)),
        ];
        let mut panel =
            Panel::new(kind.title, joined(&about), Axis::new(kind.axis), Axis::symmetric(STANDARDIZED, 3.2));
        panel.two_sd();
        let drawn = seen.iter().filter(|value| value.is_drawn);
        let points = drawn.map(|value| self.point(value, [x(value), value.standardized]));
        panel.points(points);
        for [x, y, error] in means {
            panel.line([[x, y - error], [x, y + error]], INK, 3);
        }
        Ok(panel)
    }

    /// Returns the sorted residuals against the quantiles of a normal distribution, with the band that holds 95 % of samples at each
    /// place.
    fn quantiles(&self) -> Option<Panel> {
        let mut sorted: Vec<&Value> =
            self.values.iter().filter(|value| is_drawable(value.standardized)).collect();
        if sorted.is_empty() {
            return None;
        }
        sorted.sort_by(|a, b| a.standardized.total_cmp(&b.standardized));
        let n = sorted.len();
        let about = [
            Some("line: normal; band: 95 % of samples".to_owned()),
            self.thinned.clone(),
            left_out(self.values.len() - n, "no sd"),
        ];
        let mut panel = Panel::new(
            "Are the residuals normal?",
            joined(&about),
            Axis::symmetric("quantile of the normal distribution", 1.5),
            Axis::symmetric(STANDARDIZED, 2.5),
        );
        let band = band(n);
        if band.len() > 2 {
            panel.area(band, BAND);
        }
        let quantile = |i: usize| Normal::standard().inverse_cdf((i as f64 + 0.5) / n as f64);
        let end = quantile(n - 1).max(1.0);
        panel.line([[-end, -end], [end, end]], INK, 1);
        let drawn = sorted.iter().enumerate().filter(|(_, value)| value.is_drawn);
        let points = drawn.map(|(i, value)| self.point(value, [quantile(i), value.standardized]));
        panel.points(points);
        Some(panel)
    }
}

/// What standardized residuals are drawn against.
struct Against {
    title: &'static str,
    axis: &'static str,
    /// What a value without it lacks.
    unknown: &'static str,
    value: fn(&Value) -> f64,
}

const AGAINST: [Against; 3] = [
    Against {
        title: "Residuals against cut angle",
        axis: super::CUT_AXIS,
        unknown: "cut angle",
        value: |value| value.cut,
    },
    Against {
        title: "Residuals against speed",
        axis: super::SPEED_AXIS,
        unknown: "speed",
        value: |value| value.speed,
    },
    Against {
        title: "Residuals in the order of the shots",
        axis: "number of the shot",
        unknown: "order",
        value: |value| value.order,
    },
];

/// Returns how long bars are drawn at most, so that a few that are much longer do not shrink the data to a dot; `None` without any.
fn longest_bar(values: &[&Value]) -> Option<f64> {
    /// Times the median of the bars, and part of the range of the values.
    const TIMES: f64 = 3.0;
    const PART: f64 = 0.35;
    let mut sds: Vec<f64> = values.iter().map(|value| value.sd).filter(|sd| is_drawable(*sd)).collect();
    sds.sort_by(f64::total_cmp);
    let median = sds.get(sds.len() / 2)?;
    let [low, high] = ends(values.iter().map(|value| value.measured));
    Some((TIMES * median).max(PART * (high - low)))
}

/// Returns means of a dozen groups of neighbours with their standard errors (x, y, error), if there are so many points that the eye no
/// longer averages them.
fn means(mut points: Vec<[f64; 2]>) -> Vec<[f64; 3]> {
    const MANY: usize = 200;
    const GROUPS: usize = 12;
    points.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let has_spread = points.first().zip(points.last()).is_some_and(|(first, last)| last[0] > first[0]);
    if points.len() < MANY || !has_spread {
        return Vec::new();
    }
    let mean = |group: &[[f64; 2]]| {
        let n = group.len() as f64;
        let [x, y] = [0, 1].map(|i| group.iter().map(|point| point[i]).sum::<f64>() / n);
        let variance = group.iter().map(|point| (point[1] - y).powi(2)).sum::<f64>() / (n - 1.0);
        [x, y, (variance / n).sqrt()]
    };
    points.chunks(points.len().div_ceil(GROUPS)).filter(|group| group.len() > 1).map(mean).collect()
}

/// Returns the outline of the band at some 60 places: the i-th smallest of n uniform numbers has the distribution
/// Beta(i, n + 1 − i).
fn band(n: usize) -> Vec<[f64; 2]> {
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
        low.push([x, normal.inverse_cdf(beta.inverse_cdf(0.025))]);
        high.push([x, normal.inverse_cdf(beta.inverse_cdf(0.975))]);
    }
    low.into_iter().chain(high.into_iter().rev()).collect()
}

/// Returns what makes up the variances of μ, μ_s and e, as bars.
fn budget(fit: &Fit) -> Option<Panel> {
    /// Sources that are shown of a parameter, and the smallest part of the variance that is.
    const SOURCES: usize = 4;
    const LEAST: f64 = 0.01;
    let mut bars: Vec<(String, f64, usize)> = Vec::new();
    for (series, found) in fit.budget.iter().enumerate() {
        let parts = document::budget(found);
        let variance = |part: &BudgetPart| part.std_error.unwrap_or(0.0).powi(2);
        let total: f64 = parts.iter().map(variance).sum();
        for part in parts.iter().take(SOURCES).filter(|part| variance(part) >= LEAST * total) {
            let words = format!("{}: {}", symbol(found.id), part.source.replace('_', " "));
            bars.push((words, variance(part) / total, series));
        }
    }
    if bars.is_empty() {
        return None;
    }
    let words = bars.iter().rev().map(|(words, ..)| words.clone()).collect();
    let about = "what it would take away to know each source exactly";
    let mut panel =
        Panel::new("Error budget", about, Axis::new("part of the variance (%)"), Axis::of_words(words));
    for (row, (_, part, series)) in bars.iter().rev().enumerate() {
        let (y, end) = (row as f64, 100.0 * part);
        panel.area([[0.0, y - 0.35], [end, y - 0.35], [end, y + 0.35], [0.0, y + 0.35]], color(*series));
    }
    Some(panel)
}

/// Returns the remark about points that are not in a panel.
fn left_out(count: usize, why: &str) -> Option<String> {
    (count > 0).then(|| format!("{} left out: {why}", count_of(count, "point")))
}

fn joined(remarks: &[Option<String>]) -> String {
    remarks.iter().flatten().map(String::as_str).collect::<Vec<_>>().join("; ")
}
