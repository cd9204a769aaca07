//! Numbers of shots less their predictions: residuals, and how they change with speed, cut, spin
//! and slip.

use indexmap::IndexSet;
use minijinja::value::Serde;
use minijinja::{Value as Values, context};
use nalgebra::DVector;
use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::Residual;
use super::film_words::words_of;
use crate::measurement::observable::{Axis, Observable};
use crate::problem::{Deviations, POLICY, ShiftScore, Slope, Solution};

/// A trend of residuals with something that the model should have taken care of.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Trend {
    /// The quantity of the residuals, in words.
    pub(crate) residuals_of: &'static str,
    /// The variable that the residuals change with.
    #[schemars(extend("enum" = [OF_BALLS[0].0, OF_BALLS[1].0, OF_BALLS[2].0, OF_BALLS[3].0, OF_DISCS[1].0]))]
    pub(crate) against: &'static str,
    /// Change of a residual, in its standard deviations, per unit of what it changes with.
    #[schemars(with = "Option<f64>")]
    pub(crate) slope_sd: f64,
    /// That unit.
    pub(crate) slope_per: &'static str,
    /// Probability of such a slope by chance.
    #[schemars(with = "Option<f64>")]
    pub(crate) p_value: f64,
    /// p_value corrected for all trends that were tested (Holm 1979).
    #[schemars(with = "Option<f64>")]
    pub(crate) p_corrected: f64,
    /// Whether p_corrected is below 0.05.
    pub(crate) significant: bool,
    /// The trend as a sentence, with what it may mean.
    pub(crate) words: String,
}

impl Trend {
    /// Returns whether it is beyond chance however many trends are looked for.
    pub(super) fn is_improbable(&self) -> bool {
        self.p_corrected < POLICY.improbable
    }
}

/// A variable with which residuals may change: its name, the unit of a slope's denominator, and its
/// value for a shot.
type Variable = (&'static str, &'static str, fn(&Deviations) -> f64);

/// Of balls the speed of the cue ball before the impact, the size of the cut angle, forward spin
/// over that of natural roll, and side spin Rω_z/U.
const OF_BALLS: [Variable; 4] = [
    ("speed", "m/s", speed),
    ("cut angle", "rad", |found| found.cut.abs()),
    ("forward spin", "natural roll", |found| found.spins[0]),
    ("side spin", "U/R", |found| found.spins[1]),
];

/// Of discs the closing speed, and the size of the slip over it.
const OF_DISCS: [Variable; 2] = [
    ("speed", "m/s", |found| speed(found) * found.cut.cos()),
    ("the slip over the closing speed", "closing speed", |found| found.cut.tan().abs()),
];

fn speed(found: &Deviations) -> f64 {
    found.speed.unwrap_or(f64::NAN)
}

/// Corrects probabilities for their number, step by step from the smallest.
///
/// - Holm, S. (1979). A simple sequentially rejective multiple test procedure. Scand. J. Stat. 6, 65–70.
pub(crate) fn holm<'a>(probabilities: impl IntoIterator<Item = &'a mut f64>) {
    let mut all: Vec<&mut f64> = probabilities.into_iter().collect();
    all.sort_by(|a, b| a.total_cmp(b));
    let (count, mut last) = (all.len(), 0.0_f64);
    for (rank, p) in all.into_iter().enumerate() {
        last = last.max((*p * (count - rank) as f64).min(1.0));
        *p = last;
    }
}

/// Returns how the deviations change with what the model should have taken care of, the most
/// significant trend first, corrected for their number; `chance` gives
/// the probability of a slope from the scores of its shots, if that is known.
pub(super) fn trends(
    solution: &Solution,
    shots: &[Option<Deviations>],
    chance: impl Fn(&Slope, &[Option<ShiftScore>]) -> Option<f64>,
) -> Vec<Trend> {
    let seen = observables(shots);
    let is_of_discs = seen.iter().any(|observable| Observable::DISCS.contains(observable));
    let variables: &[Variable] = if is_of_discs { &OF_DISCS } else { &OF_BALLS };
    let mut trends = Vec::new();
    for (residuals_of, part) in quantities(seen) {
        let scores = scores(solution, shots, part);
        for (against, slope_per, of) in variables {
            let values: Vec<f64> = shots.iter().map(|found| found.as_ref().map_or(f64::NAN, of)).collect();
            let Some(slope) = solution.slope_of(&values, &scores) else { continue };
            let Some(p_value) = chance(&slope, &scores) else { continue };
            trends.push(Trend {
                residuals_of,
                against,
                slope_sd: slope.value,
                slope_per,
                p_value,
                p_corrected: p_value,
                significant: false,
                words: String::new(),
            });
        }
    }
    trends.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    holm(trends.iter_mut().map(|trend| &mut trend.p_corrected));
    let count = trends.len();
    for trend in &mut trends {
        trend.significant = trend.p_corrected < POLICY.level;
        let slope = format!("{:+.2}", trend.slope_sd);
        trend.words = words_of("change", context! { count, slope, ..Values::from(Serde(&*trend)) });
    }
    trends
}

/// Returns the score of a shift of each shot along the direction in which observables have a part.
fn scores(
    solution: &Solution,
    shots: &[Option<Deviations>],
    part: impl Fn(&Deviations, Observable) -> f64,
) -> Vec<Option<ShiftScore>> {
    let ids = solution.determined();
    // the frames of a film count by their weights already
    let weights = if solution.is_film() { Vec::new() } else { solution.weights() };
    let score = |(i, one): (usize, &Option<Deviations>)| {
        let one = one.as_ref()?;
        let parts = one.observables.iter().map(|observable| part(one, *observable));
        let direction = DVector::from_iterator(one.observables.len(), parts);
        let square = direction.norm_squared();
        let unit = &direction * (direction.dot(&(&one.covariance * &direction)).sqrt() / square);
        let weight = weights.get(i).copied().unwrap_or(1.0);
        let weighted = one.covariance.clone().cholesky()?.solve(&unit) * weight;
        let by = one.by.tr_mul(&weighted);
        let beside = ids.iter().map(|id| by.get(*id as usize).copied().unwrap_or(0.0));
        (square > 0.0).then(|| ShiftScore {
            square: unit.dot(&weighted),
            along: -one.values.dot(&weighted),
            beside: DVector::from_iterator(ids.len(), beside),
        })
    };
    shots.iter().enumerate().map(score).collect()
}

/// Returns each number, or velocity after the impact of a film, against its prediction.
pub(crate) fn residuals(names: &[String], shots: &[Option<Deviations>]) -> Vec<Residual> {
    let mut all = Vec::new();
    for (name, found) in names.iter().zip(shots) {
        let Some(Deviations { observables, measured, values, covariance, cut, speed, .. }) = found else {
            continue;
        };
        for (i, observable) in observables.iter().enumerate() {
            let sd = covariance[(i, i)].sqrt();
            all.push(Residual {
                shot: name.clone(),
                observable: *observable,
                measured: measured[i],
                predicted: measured[i] - values[i],
                sd,
                standardized: values[i] / sd,
                cut: *cut,
                speed: *speed,
            });
        }
    }
    all
}

/// Returns what was measured of the shots, in the order of its first appearance.
pub(super) fn observables(shots: &[Option<Deviations>]) -> IndexSet<Observable> {
    shots.iter().flatten().flat_map(|found| found.observables.iter().copied()).collect()
}

/// A quantity that may have a trend: its name, and the part that an observable of a shot has in it.
type Quantity = (&'static str, Box<dyn Fn(&Deviations, Observable) -> f64>);

/// Velocities after an impact by their names, with their components: of a ball along or, if that is
/// true, across the line of centres.
const VELOCITIES: [(&str, [Observable; 2], bool); 4] = [
    ("throw", OBJECT, true),
    ("object-ball velocity along the line of centres", OBJECT, false),
    ("cue-ball velocity along the line of centres", CUE, false),
    ("cue-ball velocity across the line of centres", CUE, true),
];
const CUE: [Observable; 2] = [Observable::CueVelocity(Axis::X), Observable::CueVelocity(Axis::Y)];
const OBJECT: [Observable; 2] = [Observable::ObjectVelocity(Axis::X), Observable::ObjectVelocity(Axis::Y)];

/// Returns what may have trends: of impacts the velocities along and across the line of centres, of
/// angles and discs every observable.
fn quantities(seen: IndexSet<Observable>) -> Vec<Quantity> {
    let velocity = |(name, components, is_across): (_, [Observable; 2], bool)| -> Quantity {
        let part = move |found: &Deviations, observable: Observable| {
            let ([cos, sin], side) = (found.normal, if found.cut < 0.0 { -1.0 } else { 1.0 });
            let parts = if is_across { [-side * sin, side * cos] } else { [cos, sin] };
            components.iter().position(|own| *own == observable).map_or(0.0, |place| parts[place])
        };
        (name, Box::new(part))
    };
    let number = |which: Observable| -> Quantity {
        let part = move |found: &Deviations, observable: Observable| match observable {
            _ if observable != which => 0.0,
            // friction is against the slip
            Observable::ImpulseRatio => -found.cut.signum(),
            _ => 1.0,
        };
        (which.label(), Box::new(part))
    };
    if seen.iter().any(|observable| Observable::IMPACTS.contains(observable)) {
        return VELOCITIES.into_iter().map(velocity).collect();
    }
    seen.into_iter().map(number).collect()
}

/// Returns the probability of a slope by chance if the noise of its numbers is estimated from them;
/// `all` is the sum of their squares beside a level, with these degrees of freedom beside the slope.
pub(super) fn chance(slope: &Slope, all: f64, dof: f64) -> Option<f64> {
    let square = slope.t * slope.t;
    let t = (square * dof / (all - square).max(f64::MIN_POSITIVE)).sqrt();
    Some(2.0 * StudentsT::new(0.0, 1.0, dof).ok()?.sf(t.min(f64::MAX)))
}

/// Returns the deviations of a shot in units of their errors, independent of each other.
pub(super) fn whiten(found: &Deviations) -> Vec<f64> {
    let factor = found.covariance.clone().cholesky();
    let white = factor.and_then(|factor| factor.l().solve_lower_triangular(&found.values));
    white.map_or_else(Vec::new, |white| white.iter().copied().collect())
}

#[cfg(test)]
mod tests {
    /// Four tests: 0.01·4, 0.02·3, then 0.03·2 is at least 0.06, 0.5.
    #[test]
    fn holm_steps_down() {
        let mut p = [0.02, 0.5, 0.01, 0.03];
        super::holm(&mut p);
        for (p, expected) in p.iter().zip([0.06, 0.5, 0.04, 0.06]) {
            assert!((p - expected).abs() < 1e-15, "{p}");
        }
    }
}
