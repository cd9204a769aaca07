//! Conversion of the shots of a data set to a problem.

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::DVector;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::block::{Pool, RowsBlock};
use super::shot::{RowShot, RowsError};
use crate::measurement::dataset::{Dataset, Measurement, Shot};
use crate::measurement::observable::Observable;
use crate::numerics::EXACT;
use crate::problem::evaluation::{Evaluation, Reduced};
use crate::problem::film::dual::gradient;
use crate::problem::film::impact::Contact;
use crate::problem::film::own::MOVING;
use crate::problem::film::priors::list_contact;
use crate::problem::policy::{Choices, POLICY};
use crate::problem::problem::{Block, Prepared, Problem, Record, Sample, State};
use crate::problem::sums::{MIN_DOF, Noise, NoiseSums, Variation};
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Id, Mode, Own, Shared, Unknown};

/// Noise with which a search begins, as a part of the root mean square of the first residuals:
/// small, so that descents go on until they have found the minimum.
const FIRST_NOISE: f64 = 0.1;

/// Smallest noise, as a part of the first: residuals of exact numbers vanish.
const MIN_NOISE_PART: f64 = 1e-9;

/// First noise of numbers whose first residuals vanish, in their unit.
const UNKNOWN_NOISE: f64 = 1e-3;

/// Degrees of freedom of a variance from which on Bartlett's test holds.
const MIN_DOF_OF_BARTLETT: f64 = 3.0;

/// Returns the shots of a table as a problem.
///
/// # Errors
/// See [`RowsError`].
pub(crate) fn prepare_table(dataset: &Dataset, choices: &Choices) -> Result<Prepared, RowsError> {
    let settings = dataset.settings_of_balls();
    let mut unknowns = Unknown::list();
    list_contact(&mut unknowns, &settings);
    for unknown in unknowns.iter_mut().filter(|unknown| unknown.mode == Mode::Tested) {
        unknown.mode = Mode::Fixed;
    }
    // what an integrated fidelity differs by is an offset of each shot
    let contact = Contact::new(&choices.model(dataset), &unknowns);
    let usual = Shared::starts(&unknowns);
    let (mut rows, mut used) = (Vec::new(), Vec::new());
    let mut left_out = dataset.left_out.clone();
    for shot in &dataset.shots {
        let made = RowShot::new(shot, dataset, settings.falls || settings.e_falls).and_then(|made| {
            made.differences(&Own::zeros(MOVING), &usual, &contact)?;
            Ok(made)
        });
        match made {
            Ok(made) => {
                rows.push(made);
                used.push(shot);
            }
            Err(why) => left_out.push((shot.name.clone(), why.to_string())),
        }
    }
    if rows.is_empty() {
        return Err(RowsError::NoShot { left_out });
    }
    check_noise(&rows, &used)?;
    let loss = choices.loss.unwrap_or(dataset.loss);
    let mut block = RowsBlock::new(rows, &contact, &unknowns, loss);
    block.group_noises(|_| false);
    let names: Vec<String> = used.iter().map(|shot| shot.name.clone()).collect();
    // the measured inputs
    let start = State { own: vec![vec![Own::zeros(MOVING); names.len()]], shared: usual };
    let mut problem = Problem::of_one(Block::Rows(block), names, unknowns);
    let at = problem.evaluate(start.clone());
    let is_determined = |unknown: &&Unknown| {
        unknown.mode == Mode::Free && unknown.prior.is_none() && at.slopes_by(unknown.id as usize)
    };
    let unknowns: Vec<Id> = problem.unknowns.iter().filter(is_determined).map(|of| of.id).collect();
    let numbers = problem.rows().map_or(0, RowsBlock::count_numbers);
    if numbers < unknowns.len() {
        return Err(RowsError::TooFewNumbers { numbers, unknowns });
    }
    if let Some(rows) = problem.rows_mut() {
        rows.guess_noise(&at.noises(0));
    }
    let record = Record { findings: Vec::new(), left_out, unit: 1.0, middle: [0.0; 2] };
    Ok(Prepared { problem, start, record })
}

/// Gives the observables of a unit noises of their own if their variances differ by more than
/// by chance; returns whether one has changed.
pub(crate) fn split_noise(problem: &mut Problem, at: &Evaluation) -> bool {
    let mut split = problem.clone();
    let (Some(rows), Some(of_split)) = (problem.rows_mut(), split.rows_mut()) else { return false };
    of_split.group_noises(|_| true);
    // how far inputs err is not tested
    for input in Arc::make_mut(&mut of_split.shots).iter_mut().flat_map(|shot| &mut shot.inputs) {
        let estimated = input.noise.take().map(|noise| of_split.variation.noises[noise].sd);
        input.number.measured.sd = estimated.or(input.number.measured.sd);
    }
    let at = split.evaluate(at.state.clone());
    let Some(estimates) = Estimates::new(&split, &at) else { return false };
    let found = list_noises(&split, &at, &estimates);
    let is_unequal = |(pool, noise): &(&Pool, &Noise)| {
        // noise is at least what rounding hides
        let least = (pool.rounding / noise.sd).powi(2);
        let own = found.iter().filter(|found| pool.observables.contains(&found.pool.observables[0]));
        let own = own.map(|found| (found.square.max(found.dof * least), found.dof));
        let own: Vec<(f64, f64)> = own.filter(|(_, dof)| *dof >= MIN_DOF_OF_BARTLETT).collect();
        compare_variances(&own).is_some_and(|p| p < POLICY.improbable)
    };
    let unequal = rows.pools.iter().zip(&rows.variation.noises).filter(is_unequal);
    let unequal: Vec<Observable> = unequal.flat_map(|(pool, _)| pool.observables.clone()).collect();
    if unequal.is_empty() {
        return false;
    }
    rows.group_noises(|observable| unequal.contains(observable));
    for (pool, noise) in rows.pools.iter().zip(&mut rows.variation.noises) {
        let alone = |found: &&TableNoise| {
            found.dof >= MIN_DOF_OF_BARTLETT && found.pool.observables == pool.observables
        };
        let growth = found.iter().find(alone).map_or(1.0, |found| found.square / found.dof);
        noise.sd = (noise.sd * growth.sqrt()).max(pool.least());
    }
    rows.join_inputs();
    true
}

/// Checks that the errors of each column are stated everywhere or nowhere.
fn check_noise(rows: &[RowShot], shots: &[&Shot]) -> Result<(), RowsError> {
    let all = rows.iter().zip(shots).flat_map(|(made, shot)| made.rows.iter().map(move |row| (row, *shot)));
    let place = |shot: &Shot| format!("{}:{} (shot {})", shot.file.display(), shot.line, shot.name);
    // of each observable the first shot with a stated error, and without one
    let mut firsts: HashMap<Observable, [Option<&Shot>; 2]> = HashMap::new();
    for (row, shot) in all {
        let first = firsts.entry(row.number.observable).or_default();
        first[usize::from(row.noise.is_some())].get_or_insert(shot);
        if let [Some(with), Some(without)] = *first {
            let (with, without) = (place(with), place(without));
            return Err(RowsError::MixedNoise { column: row.number.observable.column(), with, without });
        }
    }
    Ok(())
}

impl RowsBlock {
    /// Sets the noises to a part of the first residuals.
    fn guess_noise(&mut self, sums: &[NoiseSums]) {
        for ((sum, pool), noise) in sums.iter().zip(&mut self.pools).zip(&mut self.variation.noises) {
            let rms = (sum.weighted / sum.count.max(1.0)).sqrt();
            let first = if rms > MIN_NOISE_PART && rms.is_finite() { rms } else { UNKNOWN_NOISE };
            pool.exact = MIN_NOISE_PART * first;
            noise.sd = pool.least().max(FIRST_NOISE * first);
        }
    }

    /// Gives the numbers without stated errors one noise for each unit, or of split observables one
    /// for each, as large as their noise was.
    fn group_noises(&mut self, is_split: impl Fn(&Observable) -> bool) {
        let (pools, noises) = (std::mem::take(&mut self.pools), std::mem::take(&mut self.variation.noises));
        let mut readings: Vec<Vec<f64>> = Vec::new();
        for row in Arc::make_mut(&mut self.shots).iter_mut().flat_map(|shot| &mut shot.rows) {
            let (Measurement { observable, measured }, Some(before)) = (row.number, row.noise) else {
                continue;
            };
            let is_of = |pool: &Pool| {
                let is_own = pool.observables.contains(&observable);
                is_own || !is_split(&observable) && pool.observables[0].unit() == observable.unit()
            };
            let which = self.pools.iter().position(is_of).unwrap_or(self.pools.len());
            if which == self.pools.len() {
                let exact = pools.get(before).map_or(0.0, |pool| pool.exact);
                self.pools.push(Pool { observables: Vec::new(), rounding: 0.0, exact });
                self.variation
                    .noises
                    .push(noises.get(before).copied().unwrap_or(Noise { sd: 1.0, rho: 0.0 }));
                readings.push(Vec::new());
            }
            if !self.pools[which].observables.contains(&observable) {
                self.pools[which].observables.push(observable);
            }
            readings[which].push(measured.value / observable.unit_si());
            row.noise = Some(which);
        }
        for (pool, readings) in self.pools.iter_mut().zip(readings) {
            // of numbers spread evenly over a step
            let step = find_step(&readings).unwrap_or(0.0) * pool.observables[0].unit_si();
            pool.rounding = step / 12.0_f64.sqrt();
        }
        self.join_inputs();
    }

    /// Gives the inputs without stated errors the least noise of their unit.
    fn join_inputs(&mut self) {
        let Self { shots, pools, variation: Variation { noises, .. }, .. } = self;
        let least = |unit: &str| {
            let alike = (0..pools.len()).filter(|which| pools[*which].observables[0].unit() == unit);
            alike.min_by(|a, b| noises[*a].sd.total_cmp(&noises[*b].sd))
        };
        for input in Arc::make_mut(shots).iter_mut().flat_map(|shot| &mut shot.inputs) {
            let Measurement { observable, measured } = input.number;
            input.noise = if measured.sd.is_none() { least(observable.unit()) } else { None };
        }
    }
}

/// Returns the probability that variances differ as much by chance, from their sums of squares and
/// degrees of freedom (Bartlett 1937).
fn compare_variances(variances: &[(f64, f64)]) -> Option<f64> {
    let groups = variances.len() as f64;
    let (square, dof) = variances.iter().fold((0.0, 0.0), |sum, own| (sum.0 + own.0, sum.1 + own.1));
    let logs: f64 = variances.iter().map(|(square, dof)| dof * (square / dof).ln()).sum();
    let inverse: f64 = variances.iter().map(|(_, dof)| dof.recip()).sum();
    let correction = 1.0 + (inverse - dof.recip()) / (3.0 * (groups - 1.0));
    let statistic = (dof * (square / dof).ln() - logs) / correction;
    let chi2 = ChiSquared::new(groups - 1.0).ok().filter(|_| !statistic.is_nan())?;
    Some(chi2.sf(statistic.min(f64::MAX)))
}

/// Returns the step of readings: 1 or 5 units of the last decimal that any has; `None` if they have
/// more than 6 decimals, so that the step is less than any noise, or if all are zeros.
fn find_step(readings: &[f64]) -> Option<f64> {
    if readings.iter().all(|value| *value == 0.0) {
        return None;
    }
    let is_multiple = |value: &f64, step: f64| {
        let count = value / step;
        (count - count.round()).abs() <= EXACT * count.abs().max(1.0)
    };
    let steps = (0..=6).map(|decimals| 10_f64.powi(-decimals)).flat_map(|last| [last, 0.5 * last]);
    steps.into_iter().find(|step| readings.iter().all(|value| is_multiple(value, *step)))
}

/// Noise over its least value at which residuals vanish.
const VANISHES: f64 = 1.0 + 1e-6;

/// Noise of the numbers of a table whose errors are not stated.
#[derive(Clone, Debug)]
pub(crate) struct TableNoise {
    pub(crate) pool: Pool,
    /// Standard deviation, SI or radians.
    pub(crate) sd: f64,
    /// Sum of their squared residuals over the variance.
    pub(crate) square: f64,
    /// Numbers less what they spend on unknowns.
    pub(crate) dof: f64,
    /// Whether residuals or a rounding show its size.
    pub(crate) is_known: bool,
}

/// Returns what is known of the noises that were estimated.
pub(super) fn list_noises(problem: &Problem, at: &Evaluation, estimates: &Estimates) -> Vec<TableNoise> {
    let (Some(rows), Some(reduced)) = (problem.rows(), at.reduced()) else { return Vec::new() };
    let spent = rows.leverages(at, (reduced, estimates), (0, &problem.samples[0]));
    let sums = at.noises(0);
    let noise = |(which, pool): (usize, &Pool)| {
        let (NoiseSums { count, weighted, .. }, sd) = (sums[which], rows.variation.noises[which].sd);
        let dof = count - spent[which];
        TableNoise {
            pool: pool.clone(),
            sd,
            square: weighted,
            dof,
            is_known: dof >= MIN_DOF && (pool.rounding > 0.0 || sd > VANISHES * pool.least()),
        }
    };
    rows.pools.iter().enumerate().map(noise).collect()
}

impl RowsBlock {
    /// Returns the part of each noise that its numbers spend on unknowns: the sum of their
    /// leverages.
    pub(crate) fn leverages(
        &self,
        at: &Evaluation,
        (reduced, estimates): (&Reduced, &Estimates),
        (number, sample): (usize, &Sample),
    ) -> Vec<f64> {
        let mut sums = vec![0.0; self.variation.noises.len()];
        if sums.is_empty() {
            return sums;
        }
        let shared = sample.gather(&at.state.shared);
        for (i, own) in at.state.own[number].iter().enumerate() {
            let Some(predicted) = self.predict(i, own, &shared) else { continue };
            let weight = at.shots[number][i].weight();
            for (residual, noise) in predicted.rows.iter().zip(self.shots[i].noises()) {
                let Some(noise) = noise else { continue };
                let by = DVector::from_column_slice(gradient(residual).as_slice());
                let variance = estimates.variance(reduced, (number, i), &by);
                sums[noise] += weight * variance;
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::{compare_variances, find_step};

    /// Three variances of 10, 20 and 30 degrees of freedom; the statistic by hand: 4.0166/1.0278 =
    /// 3.908.
    #[test]
    fn variances_are_compared() {
        let p = compare_variances(&[(10.0, 10.0), (40.0, 20.0), (90.0, 30.0)]).unwrap();
        assert!((p - (-3.908_f64 / 2.0).exp()).abs() < 1e-4, "{p}");
        assert_eq!(compare_variances(&[(10.0, 10.0)]), None);
        assert_eq!(compare_variances(&[(0.0, 10.0), (0.0, 10.0)]), None);
    }

    #[test]
    fn readings_have_the_step_of_their_last_decimal() {
        for (readings, expected) in [
            (&[3.0, 3.0, 3.0][..], Some(1.0)),
            (&[2.5, 2.5, 2.5], Some(0.5)),
            (&[0.0, -0.25, 0.5], Some(0.05)),
            (&[0.0, 0.0], None),
        ] {
            assert_eq!(find_step(readings), expected, "{readings:?}");
        }
    }
}
