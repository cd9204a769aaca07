//! Several starts, on request: whether they all end in the same minimum.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::Options;
use super::samples::Search;
use super::settled::Settled;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;

/// Minima that are nearer to each other than this part of the bounds' distance are the same.
const SAME: f64 = 1e-6;

/// The minima that several starts ended in.
#[derive(Clone, Debug, PartialEq)]
pub struct Starts {
    /// How many starts there were.
    pub count: usize,
    /// The seed of the random numbers.
    pub seed: u64,
    /// How many starts ended in no minimum.
    pub failed: usize,
    /// The minima, the best first.
    pub minima: Vec<FoundMinimum>,
}

/// A minimum that some of the starts found.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundMinimum {
    /// The values of all parameters that the fit has.
    pub values: Vec<(Parameter, f64)>,
    /// What is minimised, χ² or, where noise is estimated, −2 log L, less that of the best minimum.
    pub above_best: f64,
    /// How many starts ended in it.
    pub starts: usize,
}

impl Starts {
    /// Whether every start ended in the one minimum.
    #[must_use]
    pub fn agree(&self) -> bool {
        self.failed == 0 && self.minima.len() == 1
    }
}

/// The best minimum of that which the scan led to and those near starts that are spread evenly at random between the
/// bounds, as many in all as asked for.
pub(super) fn settle<'a>(
    search: &Search<'a>,
    first: Settled<'a>,
    options: &Options,
) -> (Settled<'a>, Option<Starts>) {
    if options.starts <= 1 {
        return (first, None);
    }
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let starts: Vec<Vec<Values>> = (1..options.starts)
        .map(|_| {
            first.free.iter().fold(search.initial(), |start, unknown| {
                let setting = search.setting(*unknown);
                let part = rng.random::<f64>();
                search.set(&start, *unknown, setting.lower + part * (setting.upper - setting.lower))
            })
        })
        .collect();
    let others: Vec<Option<Settled>> = starts
        .into_par_iter()
        .map(|start| Settled::from_starts(search, &[start]).ok().filter(|settled| settled.minimum.converged))
        .collect();
    let mut failed = others.iter().filter(|other| other.is_none()).count();
    failed += usize::from(!first.minimum.converged);
    let mut all: Vec<Settled> = std::iter::once(first).chain(others.into_iter().flatten()).collect();
    all.sort_by(|a, b| a.rank().partial_cmp(&b.rank()).unwrap_or(std::cmp::Ordering::Equal));
    let mut minima: Vec<FoundMinimum> = Vec::new();
    let best = all[0].objective;
    for settled in all.iter().filter(|settled| settled.minimum.converged) {
        let settings = search.first().settings;
        let values: Vec<_> =
            settings.parameters().iter().map(|p| (*p, settled.minimum.first()[*p])).collect();
        let width = |p: Parameter| settings[p].upper - settings[p].lower;
        let far = |known: &FoundMinimum| {
            let both = values.iter().zip(&known.values);
            let differences =
                both.map(|((p, value), (_, known))| (value - known).abs() / width(*p).max(SAME));
            differences.fold(0.0, f64::max)
        };
        match minima.iter_mut().find(|known| far(known) <= SAME) {
            Some(known) => known.starts += 1,
            None => minima.push(FoundMinimum { values, above_best: settled.objective - best, starts: 1 }),
        }
    }
    let starts = Starts { count: options.starts, seed: options.seed, failed, minima };
    (all.swap_remove(0), Some(starts))
}
