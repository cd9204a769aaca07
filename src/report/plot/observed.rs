//! The numbers that are drawn: of films the velocities after each impact in the frame of the collision, else what was measured, in the
//! units of their columns.

use super::axis::is_drawable;
use super::discs::speed_unit;
use super::{Label, SPEED_AXIS};
use crate::compare::Comparison;
use crate::fit::{Fit, FittedFilm, Residual};
use crate::measurement::observable::Observable;

/// A measured quantity, or all numbers of a label.
#[derive(Clone, Debug, Default)]
pub(super) struct Series {
    pub(super) name: String,
    /// The name of several in one panel, and their unit.
    pub(super) kind: &'static str,
    pub(super) unit: &'static str,
    pub(super) legend: String,
}

/// One number against its prediction, angles in degrees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Value {
    pub(super) series: usize,
    pub(super) label: usize,
    pub(super) measured: f64,
    pub(super) predicted: f64,
    pub(super) sd: f64,
    pub(super) standardized: f64,
    /// Degrees.
    pub(super) cut: f64,
    /// NaN if it is unknown.
    pub(super) speed: f64,
    /// The number of the shot.
    pub(super) order: f64,
    /// Whether it is among those drawn.
    pub(super) is_drawn: bool,
}

/// All numbers of a fit or of a comparison.
#[derive(Default)]
pub(super) struct Observed {
    pub(super) series: Vec<Series>,
    pub(super) values: Vec<Value>,
    pub(super) labels: Vec<Label>,
    /// How many are drawn, if they are too many.
    pub(super) thinned: Option<String>,
    /// Name of the axis of speeds.
    pub(super) speed_axis: String,
}

/// Names of the velocities after the impact in the frame of the collision.
const IN_COLLISION_FRAME: [&str; 4] = [
    "cue ball along the line of centres",
    "cue ball across it",
    "object ball along it",
    "object ball across it",
];

impl Observed {
    /// Returns all numbers of a fit.
    pub(super) fn of(fit: &Fit) -> Self {
        let mut observed = Self { speed_axis: SPEED_AXIS.to_owned(), ..Self::default() };
        if let Some(discs) = fit.discs {
            observed.speed_axis = format!("speed of the first disc before impact ({})", speed_unit(&discs));
        }
        match &fit.frames {
            Some(film) => observed.add_film(film),
            None => observed.add_table(fit),
        }
        for (i, series) in observed.series.iter_mut().enumerate() {
            let count = observed.values.iter().filter(|value| value.series == i).count();
            series.legend = format!("{} ({count})", series.name);
        }
        observed.thinned()
    }

    /// Returns all numbers of a comparison, those of each label as a series.
    pub(super) fn of_comparison(comparison: &Comparison) -> Self {
        let mut observed = Self { speed_axis: SPEED_AXIS.to_owned(), ..Self::default() };
        let series = |label: &String| Series { legend: label.clone(), ..Series::default() };
        observed.series = comparison.labels.iter().map(series).collect();
        for residual in &comparison.residuals {
            observed.add(&comparison.shot_name(residual), residual.label, 0, &residual.of_shot);
        }
        observed.thinned()
    }

    /// Adds the velocities after each impact of a film, in the frame of the collision.
    fn add_film(&mut self, film: &FittedFilm) {
        let series =
            |name: &str| Series { name: name.to_owned(), kind: "velocity", unit: "m/s", ..Series::default() };
        self.series = IN_COLLISION_FRAME.map(series).to_vec();
        for (i, shot) in film.names().into_iter().enumerate() {
            let (Some(motion), Some(offsets)) = (film.solution.motion(i), film.solution.offsets(0, i)) else {
                continue;
            };
            for (series, name) in IN_COLLISION_FRAME.into_iter().enumerate() {
                let (off, sd) = (offsets.values[series], offsets.covariance[(series, series)].sqrt());
                self.values.push(Value {
                    series,
                    label: self.labels.len(),
                    measured: motion.after[series] + off,
                    predicted: motion.after[series],
                    sd,
                    standardized: off / sd,
                    cut: motion.cut.to_degrees(),
                    speed: motion.speed,
                    order: i as f64 + 1.0,
                    is_drawn: true,
                });
                self.labels.push(Label::new(shot, name, off / sd));
            }
        }
    }

    /// Adds what was measured, each observable as a series.
    fn add_table(&mut self, fit: &Fit) {
        let mut observables: Vec<Observable> = Vec::new();
        let shots = fit.residuals.chunk_by(|one, next| one.shot == next.shot);
        for (i, residual) in shots.enumerate().flat_map(|(i, own)| own.iter().map(move |one| (i, one))) {
            let observable = residual.observable;
            let known = observables.iter().position(|known| *known == observable);
            let series = known.unwrap_or(observables.len());
            if known.is_none() {
                observables.push(observable);
                self.series.push(Series {
                    name: observable.label().to_owned(),
                    kind: match observable {
                        Observable::CueVelocity(_) | Observable::ObjectVelocity(_) => "velocity",
                        Observable::CueSpin(_) | Observable::ObjectSpin(_) => "spin",
                        observable if observable.is_angle() => "angle",
                        _ => "speed",
                    },
                    unit: observable.unit(),
                    ..Series::default()
                });
            }
            self.add(&residual.shot, series, i, residual);
        }
    }

    /// Adds a residual of the shot that comes after `before` others.
    fn add(&mut self, shot: &str, series: usize, before: usize, residual: &Residual) {
        let observable = residual.observable;
        let [measured, predicted, sd] =
            [residual.measured, residual.predicted, residual.sd].map(|si| si / observable.unit_si());
        self.values.push(Value {
            series,
            label: self.labels.len(),
            measured,
            predicted,
            sd,
            standardized: residual.standardized,
            cut: residual.cut.to_degrees(),
            speed: residual.speed.unwrap_or(f64::NAN),
            order: before as f64 + 1.0,
            is_drawn: true,
        });
        self.labels.push(Label::new(shot, observable.label(), residual.standardized));
    }

    /// Keeps every n-th value of each series, so that rows in a regular order lose none, and the largest residuals.
    fn thinned(mut self) -> Self {
        /// More points would hide each other, and an SVG grows with each.
        const MOST: usize = 2000;
        /// Of the points left out, how many of the largest residuals are drawn nevertheless.
        const EXTREMES: usize = 100;
        let total = self.values.len();
        if total <= MOST {
            return self;
        }
        let every = total.div_ceil(MOST);
        let mut seen = vec![0_usize; self.series.len()];
        for value in &mut self.values {
            value.is_drawn = seen[value.series].is_multiple_of(every);
            seen[value.series] += 1;
        }
        let size =
            |value: &Value| if is_drawable(value.standardized) { value.standardized.abs() } else { 0.0 };
        let mut hidden: Vec<&mut Value> = self.values.iter_mut().filter(|value| !value.is_drawn).collect();
        hidden.sort_by(|a, b| size(b).total_cmp(&size(a)));
        hidden.into_iter().take(EXTREMES).for_each(|value| value.is_drawn = true);
        let drawn = self.values.iter().filter(|value| value.is_drawn).count();
        self.thinned = Some(format!("{drawn} of {total} points drawn, outliers kept"));
        self
    }
}
