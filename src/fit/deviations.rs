//! Numbers of shots less their predictions: residuals, and how they change with speed, cut and spin.

use nalgebra::DVector;

use super::diagnostics::trends::{Slope, ranked};
use super::{Residual, Trend, Variable};
use crate::measurement::observable::{Axis, Observable};
use crate::problem::{self, Deviations, ShiftScore, Solution};

/// Returns how the deviations change with what the model should have taken care of; `chance` gives the probability of
/// a slope, if that is known.
pub(super) fn trends(
    solution: &Solution,
    shots: &[Option<Deviations>],
    chance: impl Fn(&problem::Slope) -> Option<f64>,
) -> Vec<Trend> {
    let variable = |of: &dyn Fn(&Deviations) -> f64| -> Vec<f64> {
        shots.iter().map(|found| found.as_ref().map_or(f64::NAN, of)).collect()
    };
    let variables = [
        (Variable::Speed, variable(&|found| found.speed.unwrap_or(f64::NAN))),
        (Variable::Cut, variable(&|found| found.cut.abs())),
        (Variable::Roll, variable(&|found| found.spins[0])),
        (Variable::Side, variable(&|found| found.spins[1])),
    ];
    let mut slopes = Vec::new();
    for (quantity, direction) in quantities(shots) {
        let scores = scores(solution, shots, &direction);
        for (variable, values) in &variables {
            let Some(slope) = solution.slope_of(values, &scores) else { continue };
            let Some(p_value) = chance(&slope) else { continue };
            slopes.push(Slope { quantity, variable: *variable, value: slope.value, p_value });
        }
    }
    ranked(slopes)
}

/// Returns the score of a shift of each shot along a direction.
fn scores(
    solution: &Solution,
    shots: &[Option<Deviations>],
    direction: &Direction,
) -> Vec<Option<ShiftScore>> {
    let columns = solution.own_columns();
    // the frames of a film count by their weights already
    let weights = if solution.is_film() { Vec::new() } else { solution.weights() };
    let score = |(i, one): (usize, &Option<Deviations>)| {
        let one = one.as_ref()?;
        let direction = direction(one);
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

/// Returns a row for each number of a table, and each velocity after the impact of a film, against its prediction;
/// numbers whose noise is not known have no standard deviation.
pub(crate) fn residuals(
    names: &[String],
    shots: &[Option<Deviations>],
    is_known: impl Fn(Observable) -> bool,
) -> Vec<Residual> {
    let of_shot = |(name, found): (&String, &Option<Deviations>)| {
        let Some(found) = found else { return Vec::new() };
        let row = |i: usize| {
            let observable = found.observables[i];
            let sd = if is_known(observable) { found.covariance[(i, i)].sqrt() } else { f64::NAN };
            Residual {
                shot: name.clone(),
                observable,
                measured: found.measured[i],
                predicted: found.measured[i] - found.values[i],
                sd,
                standardized: found.values[i] / sd,
                cut: found.cut,
                speed: found.speed,
            }
        };
        (0..found.observables.len()).map(row).collect()
    };
    names.iter().zip(shots).flat_map(of_shot).collect()
}

/// Direction of a quantity among the numbers of a shot.
type Direction = Box<dyn Fn(&Deviations) -> DVector<f64> + Sync>;

/// Returns what may have trends: of impacts the velocities along and across the line of centres, of
/// angles every observable.
fn quantities(shots: &[Option<Deviations>]) -> Vec<(&'static str, Direction)> {
    let velocity = |of: fn(Axis) -> Observable, across: bool| -> Direction {
        Box::new(move |found| {
            let [cos, sin] = found.normal;
            // friction has the sign of the cut angle
            let side = if found.cut < 0.0 { -1.0 } else { 1.0 };
            let axes = if across { [-side * sin, side * cos] } else { [cos, sin] };
            let part = |observable: &Observable| {
                let axis = [Axis::X, Axis::Y].into_iter().position(|axis| of(axis) == *observable);
                axis.map_or(0.0, |axis| axes[axis])
            };
            DVector::from_iterator(found.observables.len(), found.observables.iter().map(part))
        })
    };
    let mut seen: Vec<Observable> = Vec::new();
    for observable in shots.iter().flatten().flat_map(|found| &found.observables) {
        if !seen.contains(observable) {
            seen.push(*observable);
        }
    }
    if seen.iter().any(|observable| Observable::IMPACTS.contains(observable)) {
        return vec![
            ("throw", velocity(Observable::ObjectVelocity, true)),
            ("object-ball velocity along the line of centres", velocity(Observable::ObjectVelocity, false)),
            ("cue-ball velocity along the line of centres", velocity(Observable::CueVelocity, false)),
            ("cue-ball velocity across the line of centres", velocity(Observable::CueVelocity, true)),
        ];
    }
    let only = |which: Observable| -> Direction {
        Box::new(move |found| {
            let part = |observable: &Observable| if *observable == which { 1.0 } else { 0.0 };
            DVector::from_iterator(found.observables.len(), found.observables.iter().map(part))
        })
    };
    seen.into_iter().map(|observable| (observable.label(), only(observable))).collect()
}

/// Returns the deviations of a shot in units of their errors, independent of each other.
pub(super) fn whiten(found: &Deviations) -> Vec<f64> {
    let factor = found.covariance.clone().cholesky();
    let white = factor.and_then(|factor| factor.l().solve_lower_triangular(&found.values));
    white.map_or_else(Vec::new, |white| white.iter().copied().collect())
}
