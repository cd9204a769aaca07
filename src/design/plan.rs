//! How many shots, and of which kinds.

use nalgebra::DMatrix;

use super::information::{Information, prior, root, std_errors};
use super::{Cell, Expected, OfKind};
use crate::design::optimal_design::fewest;
use crate::measurement::parameter::Parameter;

/// Beyond so many shots nothing is planned.
const MOST: u64 = 1_000_000_000;

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
    /// The number of all shots together.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.shots.iter().map(|(_, shots)| shots).sum()
    }
}

/// The largest variance over what is wanted; infinite where something wanted is not told.
fn excess(information: &Information, wanted: &[Option<f64>; 3]) -> f64 {
    let errors = std_errors(information);
    let of = |(error, wanted): (Option<f64>, f64)| error.map_or(f64::INFINITY, |e| (e / wanted).powi(2));
    errors.into_iter().zip(wanted).filter_map(|(e, w)| Some((e, (*w)?))).map(of).fold(0.0, f64::max)
}

/// Shots of one kind that reach all that is wanted; `None` if no number does, or nothing is wanted.
pub(super) fn needed(information: &Information, wanted: &[Option<f64>; 3]) -> Option<u64> {
    wanted.iter().flatten().next()?;
    let enough = |n: u64| excess(&(information * n as f64), wanted) <= 1.0;
    let mut high = 1;
    while !enough(high) {
        high *= 2;
        if high > MOST {
            return None;
        }
    }
    let mut low = high / 2;
    // at 0 there are no shots
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if enough(middle) { high = middle } else { low = middle }
    }
    Some(high)
}

/// For each wanted parameter, and for all of them that are told at all, of kinds and of cells.
pub(super) fn mixtures(expected: &Expected, kinds: &[OfKind], cells: &[Cell]) -> Vec<Mixture> {
    let of_kinds: Vec<Information> = kinds.iter().map(|kind| kind.information).collect();
    let of_cells: Vec<Information> = cells.iter().map(|cell| cell.information).collect();
    let mut found = Vec::new();
    for (informations, single) in [(of_kinds, false), (of_cells, true)] {
        let told = std_errors(&informations.iter().sum());
        let wanted: [Option<f64>; 3] =
            std::array::from_fn(|i| expected.wanted[i].filter(|_| told[i].is_some()));
        let each = Parameter::COEFFICIENTS.into_iter().map(|parameter| {
            let mut own = [None; 3];
            own[parameter as usize] = wanted[parameter as usize];
            (Some(parameter), own)
        });
        for (parameter, wanted) in each.chain([(None, wanted)]) {
            let Some((shots, std_errors)) = mixture(&informations, &wanted) else { continue };
            found.push(Mixture { parameter, of_cells: single, shots, std_errors });
        }
    }
    found
}

/// Shots of each, and the standard errors of all together.
type Counted = (Vec<(usize, u64)>, [Option<f64>; 3]);

/// The real-valued optimum, made whole: rounded down, then the most useful shot added until it suffices, then those
/// taken away that it can do without.
fn mixture(informations: &[Information], wanted: &[Option<f64>; 3]) -> Option<Counted> {
    let roots: Vec<DMatrix<f64>> = informations.iter().map(root).collect();
    let targets: Vec<(usize, f64)> =
        wanted.iter().enumerate().filter_map(|(i, wanted)| Some((i, (*wanted)?.powi(2)))).collect();
    let relaxed = fewest(&roots, &root(&prior()), &targets)?;
    let used: Vec<usize> = (0..relaxed.len()).filter(|k| relaxed[*k] > 0.0).collect();
    let mut counts: Vec<u64> = used.iter().map(|k| relaxed[*k].floor() as u64).collect();
    let with = |counts: &[u64]| {
        let each = used.iter().zip(counts);
        each.map(|(k, n)| informations[*k] * *n as f64).sum::<Information>()
    };
    if relaxed.iter().sum::<f64>() > MOST as f64 {
        return None;
    }
    // what is missing is at most one shot of each, and what the solver's tolerance is worth
    let mut spare = 2 * used.len() + (1e-4 * relaxed.iter().sum::<f64>()) as usize + 10;
    while excess(&with(&counts), wanted) > 1.0 {
        spare = spare.checked_sub(1)?;
        let after = |i: usize| {
            let mut more = counts.clone();
            more[i] += 1;
            let information = with(&more);
            let errors = std_errors(&information);
            let told = targets.iter().filter(|(j, _)| errors[*j].is_some()).count();
            (std::cmp::Reverse(told), excess(&information, wanted))
        };
        let better = |a: &usize, b: &usize| {
            let ((told_a, a), (told_b, b)) = (after(*a), after(*b));
            told_a.cmp(&told_b).then(a.total_cmp(&b))
        };
        // while nothing is told yet, the largest share first
        let share = |i: &usize| relaxed[used[*i]] - counts[*i] as f64;
        let best = if excess(&with(&counts), wanted).is_finite() {
            (0..used.len()).min_by(better)?
        } else {
            (0..used.len()).max_by(|a, b| share(a).total_cmp(&share(b)))?
        };
        counts[best] += 1;
    }
    for i in 0..counts.len() {
        while counts[i] > 0 {
            let mut fewer = counts.clone();
            fewer[i] -= 1;
            if excess(&with(&fewer), wanted) > 1.0 {
                break;
            }
            counts = fewer;
        }
    }
    let errors = std_errors(&with(&counts));
    let mut shots: Vec<(usize, u64)> = used.into_iter().zip(counts).filter(|(_, n)| *n > 0).collect();
    shots.sort_by_key(|(_, n)| std::cmp::Reverse(*n));
    Some((shots, errors))
}
