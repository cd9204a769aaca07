//! Fits of shots that are drawn anew, with replacement, from those of a fit (Efron 1987).

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::descent::descend;
use super::problem::{Problem, State};
use super::solution::Solution;
use super::uncertainty::Estimates;
use super::unknowns::Id;

/// Evaluations of a descent, typical are 4.
const MAX_STEPS: usize = 40;

impl Solution {
    /// Returns the values of these unknowns in a fit of shots of the only sample that are drawn anew,
    /// at the same noise; `number` is the stream of the random numbers. `None` if it does not end at a
    /// minimum that determines all of them.
    pub(crate) fn resampled(&self, ids: &[Id], (seed, number): (u64, u64)) -> Option<Vec<f64>> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let own = self.state().own.first()?;
        let drawn: Vec<usize> = (0..own.len()).map(|_| random.random_range(0..own.len())).collect();
        let mut problem: Problem = self.problem.clone();
        problem.samples[0].block.take(&drawn);
        let own = vec![drawn.iter().map(|i| own[*i].clone()).collect()];
        let state = State { own, shared: self.state().shared.clone() };
        let descent = descend(&problem, problem.evaluate(state), &problem.free(), MAX_STEPS);
        let estimates = Estimates::new(&problem, &descent.end)?;
        let determined = ids.iter().all(|id| estimates.position(*id as usize).is_some());
        let values = ids.iter().map(|id| descent.end.state.shared[*id]).collect();
        (descent.converged && determined).then_some(values)
    }
}
