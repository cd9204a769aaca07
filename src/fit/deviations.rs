//! Numbers of shots less their predictions: residuals, and how they change with speed, cut, spin
//! and slip.

use nalgebra::DVector;

use super::trends::ranked;
use super::{Residual, Trend, Variable};
use crate::measurement::observable::{Axis, Observable};
use crate::problem::{self, Deviations, ShiftScore, Solution};

/// Returns how the deviations change with what the model should have taken care of; `chance` gives
/// the probability of a slope from the scores of its shots, if that is known.
pub(super) fn trends(
    solution: &Solution,
    shots: &[Option<Deviations>],
    chance: impl Fn(&problem::Slope, &[Option<ShiftScore>]) -> Option<f64>,
) -> Vec<Trend> {
    let seen = observables(shots);
    let mut variables = Vec::new();
    let mut add = |variable, of: &dyn Fn(&Deviations) -> f64| {
        let values = shots.iter().map(|found| found.as_ref().map_or(f64::NAN, of));
        variables.push((variable, values.collect::<Vec<f64>>()));
    };
    let speed = |found: &Deviations| found.speed.unwrap_or(f64::NAN);
    if seen.iter().any(|observable| Observable::DISCS.contains(observable)) {
        add(Variable::Speed, &|found| speed(found) * found.cut.cos());
        add(Variable::Slip, &|found| found.cut.tan().abs());
    } else {
        add(Variable::Speed, &speed);
        add(Variable::Cut, &|found| found.cut.abs());
        add(Variable::Roll, &|found| found.spins[0]);
        add(Variable::Side, &|found| found.spins[1]);
    }
    let mut trends = Vec::new();
    for (quantity, of) in quantities(&seen) {
        let scores = scores(solution, shots, of);
        for (variable, values) in &variables {
            let Some(slope) = solution.slope_of(values, &scores) else { continue };
            let Some(p_value) = chance(&slope, &scores) else { continue };
            trends.push(Trend::new(quantity, *variable, slope.value, p_value));
        }
    }
    ranked(trends)
}

/// Returns the score of a shift of each shot along a direction.
fn scores(solution: &Solution, shots: &[Option<Deviations>], of: TrendOf) -> Vec<Option<ShiftScore>> {
    let columns = solution.own_columns();
    // the frames of a film count by their weights already
    let weights = if solution.is_film() { Vec::new() } else { solution.weights() };
    let score = |(i, one): (usize, &Option<Deviations>)| {
        let one = one.as_ref()?;
        let direction = of.direction(one);
        let square = direction.norm_squared();
        let unit = &direction * (direction.dot(&(&one.covariance * &direction)).sqrt() / square);
        let weight = weights.get(i).copied().unwrap_or(1.0);
        let weighted = one.covariance.clone().cholesky()?.solve(&unit) * weight;
        let by = one.by.tr_mul(&weighted);
        let beside = columns.iter().map(|(_, id)| by.get(*id as usize).copied().unwrap_or(0.0));
        (square > 0.0).then(|| ShiftScore {
            square: unit.dot(&weighted),
            along: -one.values.dot(&weighted),
            beside: DVector::from_iterator(columns.len(), beside),
        })
    };
    shots.iter().enumerate().map(score).collect()
}

/// Returns a row for each number of a table or of discs, and each velocity after the impact of a
/// film, against its prediction; numbers whose noise is not known have no standard deviation.
pub(crate) fn residuals(
    names: &[String],
    shots: &[Option<Deviations>],
    is_known: impl Fn(Observable) -> bool,
) -> Vec<Residual> {
    let mut all = Vec::new();
    for (name, found) in names.iter().zip(shots) {
        let Some(Deviations { observables, measured, values, covariance, cut, speed, .. }) = found else {
            continue;
        };
        for (i, observable) in observables.iter().enumerate() {
            let sd = if is_known(*observable) { covariance[(i, i)].sqrt() } else { f64::NAN };
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
fn observables(shots: &[Option<Deviations>]) -> Vec<Observable> {
    let mut seen = Vec::new();
    for observable in shots.iter().flatten().flat_map(|found| &found.observables) {
        if !seen.contains(observable) {
            seen.push(*observable);
        }
    }
    seen
}

/// A quantity of a shot that may have a trend.
#[derive(Clone, Copy)]
enum TrendOf {
    /// Velocity of one ball along or across the line of centres.
    Velocity {
        of: fn(Axis) -> Observable,
        across: bool,
    },
    Number(Observable),
}

impl TrendOf {
    /// Returns its direction among the numbers of a shot; friction is against the slip and has the
    /// sign of the cut angle.
    fn direction(self, found: &Deviations) -> DVector<f64> {
        let ([cos, sin], side) = (found.normal, if found.cut < 0.0 { -1.0 } else { 1.0 });
        let part = |observable: &Observable| match self {
            Self::Velocity { of, across } => {
                let axes = if across { [-side * sin, side * cos] } else { [cos, sin] };
                let axis = [Axis::X, Axis::Y].into_iter().position(|axis| of(axis) == *observable);
                axis.map_or(0.0, |axis| axes[axis])
            }
            Self::Number(which) if *observable != which => 0.0,
            Self::Number(Observable::ImpulseRatio) => -found.cut.signum(),
            Self::Number(_) => 1.0,
        };
        DVector::from_iterator(found.observables.len(), found.observables.iter().map(part))
    }
}

/// Returns what may have trends: of impacts the velocities along and across the line of centres, of
/// angles and discs every observable.
fn quantities(seen: &[Observable]) -> Vec<(&'static str, TrendOf)> {
    if !seen.iter().any(|observable| Observable::IMPACTS.contains(observable)) {
        return seen.iter().map(|observable| (observable.label(), TrendOf::Number(*observable))).collect();
    }
    let velocity = |of: fn(Axis) -> Observable, across: bool| TrendOf::Velocity { of, across };
    let (cue, object) = (Observable::CueVelocity, Observable::ObjectVelocity);
    vec![
        ("throw", velocity(object, true)),
        ("object-ball velocity along the line of centres", velocity(object, false)),
        ("cue-ball velocity along the line of centres", velocity(cue, false)),
        ("cue-ball velocity across the line of centres", velocity(cue, true)),
    ]
}

/// Returns the deviations of a shot in units of their errors, independent of each other.
pub(super) fn whiten(found: &Deviations) -> Vec<f64> {
    let factor = found.covariance.clone().cholesky();
    let white = factor.and_then(|factor| factor.l().solve_lower_triangular(&found.values));
    white.map_or_else(Vec::new, |white| white.iter().copied().collect())
}
