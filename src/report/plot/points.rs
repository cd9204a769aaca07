//! What of a fit is drawn: its observations in the units of their columns, thinned out where there
//! are too many to see.

use crate::fit::Fit;
use crate::measurement::observable::Observable;

use super::axis::drawable;

/// More points than these are thinned out: they would hide each other, and an SVG grows with each.
const MOST_POINTS: usize = 2000;

/// Of the points left out by thinning, so many of the largest residuals are drawn nevertheless.
const EXTREMES: usize = 100;

/// One observation, angles in degrees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    /// Index of its residual.
    pub(super) index: usize,
    /// Index of its observable in [`Points::observables`].
    pub(super) series: usize,
    pub(super) measured: f64,
    pub(super) predicted: f64,
    pub(super) sd: f64,
    pub(super) standardized: f64,
    pub(super) cut: f64,
    /// NaN where it is unknown.
    pub(super) speed: f64,
    /// Whether it is among those drawn.
    pub(super) drawn: bool,
}

#[derive(Clone, Debug)]
pub(super) struct Points {
    /// In the order of first appearance.
    pub(super) observables: Vec<Observable>,
    pub(super) all: Vec<Point>,
    /// Said in each panel.
    pub(super) thinned: Option<String>,
}

impl Points {
    pub(super) fn of(fit: &Fit) -> Self {
        let mut observables: Vec<Observable> = Vec::new();
        let mut all: Vec<Point> = Vec::with_capacity(fit.residuals.len());
        for residual in &fit.residuals {
            let position = observables.iter().position(|observable| *observable == residual.observable);
            let series = position.unwrap_or_else(|| {
                observables.push(residual.observable);
                observables.len() - 1
            });
            let unit = residual.observable.unit_si();
            let [measured, predicted, sd] =
                [residual.measured, residual.predicted, residual.sd].map(|si| si / unit);
            all.push(Point {
                index: all.len(),
                series,
                measured,
                predicted,
                sd,
                standardized: residual.standardized,
                cut: residual.cut.to_degrees(),
                speed: residual.speed.unwrap_or(f64::NAN),
                drawn: true,
            });
        }
        let thinned = thin(&mut all, observables.len());
        Self { observables, all, thinned }
    }

    /// Each observable with the number of its observations.
    pub(super) fn legend(&self) -> impl Iterator<Item = String> {
        self.observables.iter().enumerate().map(|(series, observable)| {
            let count = self.all.iter().filter(|point| point.series == series).count();
            format!("{} ({count})", observable.label())
        })
    }

    /// Opacity at which overlapping points can still be told apart.
    pub(super) fn opacity(&self) -> f64 {
        match self.all.len() {
            0..=60 => 0.85,
            61..=400 => 0.6,
            401..=1500 => 0.4,
            _ => 0.25,
        }
    }
}

/// Keeps every n-th point of each observable, so that rows in a regular order lose none, and the
/// largest residuals.
fn thin(points: &mut [Point], observables: usize) -> Option<String> {
    let total = points.len();
    if total <= MOST_POINTS {
        return None;
    }
    let every = total.div_ceil(MOST_POINTS);
    let mut seen = vec![0_usize; observables];
    for point in points.iter_mut() {
        point.drawn = seen[point.series].is_multiple_of(every);
        seen[point.series] += 1;
    }
    let size = |point: &Point| {
        let size = point.standardized.abs();
        if drawable(size) { size } else { 0.0 }
    };
    let mut hidden: Vec<usize> = (0..total).filter(|&index| !points[index].drawn).collect();
    hidden.sort_by(|&a, &b| size(&points[b]).total_cmp(&size(&points[a])));
    for &index in hidden.iter().take(EXTREMES) {
        points[index].drawn = true;
    }
    let drawn = points.iter().filter(|point| point.drawn).count();
    Some(format!("{drawn} of {total} points drawn, outliers kept"))
}
