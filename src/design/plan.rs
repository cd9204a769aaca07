//! How many shots, and of which kinds.

use nalgebra::DMatrix;

use super::information::{Information, prior, root, std_errors};
use super::optimal_design::fewest;
use super::{Cell, Expected, OfKind};
use crate::measurement::parameter::Parameter;

/// Largest number of shots of a plan.
const MAX_SHOTS: u64 = 1_000_000_000;

/// The fewest shots that reach wanted standard errors.
#[derive(Clone, Debug)]
pub struct Mixture {
    /// The parameter whose standard error they reach; `None` for all that is wanted.
    pub parameter: Option<Parameter>,
    /// Whether they are of single cut angles and speeds, and not of kinds over their whole ranges.
    pub of_cells: bool,
    /// The index of each kind or cell, with its number of shots, the most first.
    pub shots: Vec<(usize, u64)>,
    /// The standard errors of μ, μ_s and e that they give.
    pub std_errors: [Option<f64>; 3],
}

impl Mixture {
    /// Returns the number of all shots together.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.shots.iter().map(|(_, shots)| shots).sum()
    }
}

/// Returns the largest variance over what is wanted; infinite if something wanted is not determined.
fn excess(information: &Information, wanted: &[Option<f64>; 3]) -> f64 {
    let both = std_errors(information).into_iter().zip(wanted);
    let variances =
        both.filter_map(|(error, wanted)| Some((error.unwrap_or(f64::INFINITY) / (*wanted)?).powi(2)));
    variances.fold(0.0, f64::max)
}

/// Returns the number of shots of one kind that reach all that is wanted; `None` if no number does, or nothing is wanted.
pub(super) fn needed(information: &Information, wanted: &[Option<f64>; 3]) -> Option<u64> {
    wanted.iter().flatten().next()?;
    let is_enough = |n: u64| excess(&(information * n as f64), wanted) <= 1.0;
    let mut high = 1;
    while !is_enough(high) {
        high *= 2;
        if high > MAX_SHOTS {
            return None;
        }
    }
    let mut low = high / 2;
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if is_enough(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// Returns the mixtures for each wanted parameter, and for all of them that are determined at all, of kinds and of cells.
pub(super) fn mixtures(expected: &Expected, kinds: &[OfKind], cells: &[Cell]) -> Vec<Mixture> {
    let of_kinds: Vec<Information> = kinds.iter().map(|kind| kind.information).collect();
    let of_cells: Vec<Information> = cells.iter().map(|cell| cell.information).collect();
    let mut found = Vec::new();
    for (informations, of_cells) in [(of_kinds, false), (of_cells, true)] {
        let errors = std_errors(&informations.iter().sum());
        for parameter in Parameter::COEFFICIENTS.map(Some).into_iter().chain([None]) {
            let is_meant = |i: usize| errors[i].is_some() && parameter.is_none_or(|p| p as usize == i);
            let wanted = std::array::from_fn(|i| expected.wanted[i].filter(|_| is_meant(i)));
            if let Some(shots) = fewest_shots(&informations, &wanted) {
                let std_errors = std_errors(&sum(&informations, &shots));
                found.push(Mixture { parameter, of_cells, shots, std_errors });
            }
        }
    }
    found
}

/// Returns the information of numbers of shots.
fn sum(informations: &[Information], shots: &[(usize, u64)]) -> Information {
    shots.iter().map(|(index, n)| informations[*index] * *n as f64).sum()
}

/// Returns the index and the number of shots of each that is used, the most first: the real-valued optimum, rounded down, with
/// the most useful shot added until they suffice, and without those that are then not needed.
fn fewest_shots(informations: &[Information], wanted: &[Option<f64>; 3]) -> Option<Vec<(usize, u64)>> {
    let roots: Vec<DMatrix<f64>> = informations.iter().map(root).collect();
    let targets = wanted.iter().enumerate().filter_map(|(i, wanted)| Some((i, (*wanted)?.powi(2))));
    let relaxed = fewest(&roots, &root(&prior()), &targets.collect::<Vec<_>>())?;
    let total: f64 = relaxed.iter().sum();
    if total > MAX_SHOTS as f64 {
        return None;
    }
    let used = relaxed.iter().enumerate().filter(|(_, n)| **n > 0.0);
    let mut shots: Vec<(usize, u64)> = used.map(|(index, n)| (index, n.floor() as u64)).collect();
    let excess = |shots: &[(usize, u64)]| excess(&sum(informations, shots), wanted);
    // at most one shot of each is missing, and the tolerance of the solver
    let mut spare = 2 * shots.len() + (1e-4 * total) as usize + 10;
    while excess(&shots) > 1.0 {
        spare = spare.checked_sub(1)?;
        let with_one_more = |i: usize| {
            let mut more = shots.clone();
            more[i].1 += 1;
            excess(&more)
        };
        // while something is not determined, the largest missing share first
        let share = |i: usize| relaxed[shots[i].0] - shots[i].1 as f64;
        let best = if excess(&shots).is_finite() {
            (0..shots.len()).min_by(|a, b| with_one_more(*a).total_cmp(&with_one_more(*b)))?
        } else {
            (0..shots.len()).max_by(|a, b| share(*a).total_cmp(&share(*b)))?
        };
        shots[best].1 += 1;
    }
    for i in 0..shots.len() {
        while shots[i].1 > 0 {
            shots[i].1 -= 1;
            if excess(&shots) > 1.0 {
                shots[i].1 += 1;
                break;
            }
        }
    }
    shots.retain(|(_, n)| *n > 0);
    shots.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    Some(shots)
}
