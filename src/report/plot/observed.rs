//! The numbers of a fit that are drawn: of films the velocities after each impact in the frame of the collision, else what was measured,
//! in the units of their columns.

use super::Label;
use super::axis::is_drawable;
use crate::fit::{Fit, FittedFilm};
use crate::measurement::observable::Observable;

/// A measured quantity.
#[derive(Clone, Debug)]
pub(super) struct Series {
    /// Its name, that of several in one panel, and their unit.
    pub(super) name: String,
    pub(super) kind: &'static str,
    pub(super) unit: &'static str,
    pub(super) count: usize,
}

impl Series {
    fn of(observable: Observable) -> Self {
        let kind = match observable {
            Observable::CueVelocity(_) | Observable::ObjectVelocity(_) => "velocity",
            Observable::CueSpin(_) | Observable::ObjectSpin(_) => "spin",
            observable if observable.is_angle() => "angle",
            _ => "speed",
        };
        Self { name: observable.label().to_owned(), kind, unit: observable.unit(), count: 0 }
    }

    pub(super) fn legend(&self) -> String {
        format!("{} ({})", self.name, self.count)
    }
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

/// All numbers of a fit.
pub(super) struct Observed {
    pub(super) series: Vec<Series>,
    pub(super) values: Vec<Value>,
    pub(super) labels: Vec<Label>,
    /// How many are drawn, if they are too many.
    pub(super) thinned: Option<String>,
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
        let mut observed = Self { series: Vec::new(), values: Vec::new(), labels: Vec::new(), thinned: None };
        match &fit.frames {
            Some(film) => observed.add_film(film),
            None => observed.add_table(fit),
        }
        for value in &observed.values {
            observed.series[value.series].count += 1;
        }
        observed.thinned = thin(&mut observed.values, observed.series.len());
        observed
    }

    /// Adds the velocities after each impact of a film, in the frame of the collision.
    fn add_film(&mut self, film: &FittedFilm) {
        self.series = IN_COLLISION_FRAME
            .map(|name| Series { name: name.to_owned(), kind: "velocity", unit: "m/s", count: 0 })
            .to_vec();
        for (i, shot) in film.names().into_iter().enumerate() {
            let (Some(motion), Some(offsets)) = (film.solution.motion(i), film.solution.offsets(0, i)) else {
                continue;
            };
            for (series, name) in IN_COLLISION_FRAME.into_iter().enumerate() {
                let (off, sd) = (offsets.values[series], offsets.covariance[(series, series)].sqrt());
                let value = Value {
                    series,
                    label: 0,
                    measured: motion.after[series] + off,
                    predicted: motion.after[series],
                    sd,
                    standardized: off / sd,
                    cut: motion.cut.to_degrees(),
                    speed: motion.speed,
                    order: i as f64 + 1.0,
                    is_drawn: true,
                };
                self.add(shot, name, value);
            }
        }
    }

    fn add_table(&mut self, fit: &Fit) {
        let mut observables: Vec<Observable> = Vec::new();
        let mut order = 0.0;
        let mut last = "";
        for residual in &fit.residuals {
            let observable = residual.observable;
            let known = observables.iter().position(|known| *known == observable);
            let series = known.unwrap_or_else(|| {
                observables.push(observable);
                self.series.push(Series::of(observable));
                observables.len() - 1
            });
            order += f64::from(u8::from(residual.shot != last));
            last = &residual.shot;
            let [measured, predicted, sd] =
                [residual.measured, residual.predicted, residual.sd].map(|si| si / observable.unit_si());
            let value = Value {
                series,
                label: 0,
                measured,
                predicted,
                sd,
                standardized: residual.standardized,
                cut: residual.cut.to_degrees(),
                speed: residual.speed.unwrap_or(f64::NAN),
                order,
                is_drawn: true,
            };
            self.add(&residual.shot, observable.label(), value);
        }
    }

    fn add(&mut self, shot: &str, name: &str, value: Value) {
        self.values.push(Value { label: self.labels.len(), ..value });
        self.labels.push(Label::new(shot, name, value.standardized));
    }
}

/// Keeps every n-th value of each series, so that rows in a regular order lose none, and the largest residuals; returns what was done.
fn thin(values: &mut [Value], series: usize) -> Option<String> {
    /// More points would hide each other, and an SVG grows with each.
    const MOST: usize = 2000;
    /// Of the points left out, how many of the largest residuals are drawn nevertheless.
    const EXTREMES: usize = 100;
    let total = values.len();
    if total <= MOST {
        return None;
    }
    let every = total.div_ceil(MOST);
    let mut seen = vec![0_usize; series];
    for value in values.iter_mut() {
        value.is_drawn = seen[value.series].is_multiple_of(every);
        seen[value.series] += 1;
    }
    let size =
        |value: &Value| Some(value.standardized.abs()).filter(|size| is_drawable(*size)).unwrap_or(0.0);
    let mut hidden: Vec<&mut Value> = values.iter_mut().filter(|value| !value.is_drawn).collect();
    hidden.sort_by(|a, b| size(b).total_cmp(&size(a)));
    hidden.into_iter().take(EXTREMES).for_each(|value| value.is_drawn = true);
    let drawn = values.iter().filter(|value| value.is_drawn).count();
    Some(format!("{drawn} of {total} points drawn, outliers kept"))
}
