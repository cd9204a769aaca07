//! The noise of the data and the spreads from shot to shot, by restricted maximum likelihood:
//! each estimate counts the unknowns that it was estimated beside (Patterson and Thompson 1971,
//! Biometrika 58, 545).

use std::ops::Range;

use super::eliminated::Eliminated;
use super::evaluation::{Evaluation, Reduced};
use super::problem::{Block, Problem, Sample};
use super::sums::{MIN_DOF, Noise, NoiseSums, Scattered, ShotSums};
use super::uncertainty::Estimates;

/// Largest part spent on unknowns by which a correlation is corrected, to first order: with 0.19 of
/// short films of discs (data/pucks-qualisys) slow noise took the place of their paths.
const MOST_SPENT: f64 = 0.1;

/// The noise has settled if its variance changes by less than this part and ρ by less than this.
const SETTLED: f64 = 0.01;

/// Changes of a spread in one step by which it has settled.
const SAME_SPREAD: Range<f64> = 0.85..1.15;

/// Sets noise and spreads to what the residuals at `at` show; returns whether they have settled.
pub(super) fn update(problem: &mut Problem, at: &Evaluation) -> bool {
    let Some(reduced) = at.reduced() else { return true };
    let Some(estimates) = Estimates::new(problem, at) else { return true };
    let sums: Vec<Vec<NoiseSums>> = (0..problem.samples.len()).map(|sample| at.noises(sample)).collect();
    let spent = count_spent(problem, at, (reduced, &estimates), &sums);
    let mut settled = true;
    for sample in 0..sums.len() {
        if problem.samples[sample].block.variation().is_estimated() {
            let rho = correlation(&sums[sample], &spent[sample]);
            let noise_of = problem.samples[sample].noise_of;
            let is_partner = |other: &usize| problem.samples[*other].noise_of == noise_of;
            let partners: Vec<usize> = (0..sums.len()).filter(is_partner).collect();
            let block = &mut problem.samples[sample].block;
            for which in 0..sums[sample].len() {
                let mut sum = NoiseSums::default();
                for other in &partners {
                    sum.add(&sums[*other][which]);
                }
                let dof = sum.count - partners.iter().map(|other| spent[*other][which]).sum::<f64>();
                let growth = sum.weighted / dof;
                if !(dof > MIN_DOF && growth > 0.0 && growth.is_finite()) {
                    continue;
                }
                let least = if let Block::Rows(rows) = &*block { rows.pools[which].least() } else { 0.0 };
                let noise = &mut block.variation_mut().noises[which];
                let sd = (noise.sd * growth.sqrt()).max(least);
                let changed = (sd / noise.sd).powi(2) - 1.0;
                settled &= changed.abs() < SETTLED && (rho - noise.rho).abs() < SETTLED;
                *noise = Noise { sd, rho };
            }
        }
        // in a comparison spreads stay: they are not to explain that data sets differ
        let spreads = if sums.len() == 1 { problem.samples[0].block.variation().spreads.len() } else { 0 };
        for which in 0..spreads {
            let new = estimate_spread(problem, at, (reduced, &estimates), sample, which);
            let old = &mut problem.samples[sample].block.variation_mut().spreads[which];
            settled &= SAME_SPREAD.contains(&(new / old.sd));
            old.sd = new;
        }
    }
    settled
}

/// Returns −2 log L up to a constant, greatest over the sizes of the noises that are estimated.
pub(super) fn minus_two_log(problem: &Problem, at: &Evaluation) -> f64 {
    let noise_term = |(sum, noise): (&NoiseSums, &Noise)| {
        let variance = sum.weighted * noise.sd * noise.sd / sum.count;
        sum.count * variance.ln() - sum.weighted + sum.ln_determinant
    };
    let sample_term = |(number, sample): (usize, &Sample)| {
        let variation = sample.block.variation();
        let noises = if variation.is_estimated() { &variation.noises[..] } else { &[] };
        let scattered = at.shots[number].iter().flat_map(|shot| &shot.scattered);
        let spread_terms = scattered.map(|number| 2.0 * variation.spreads[number.spread].sd.ln());
        at.noises(number).iter().zip(noises).map(noise_term).sum::<f64>() + spread_terms.sum::<f64>()
    };
    at.cost + problem.samples.iter().enumerate().map(sample_term).sum::<f64>()
}

/// Returns −2 log L with the own unknowns integrated over, up to a constant.
pub(super) fn unlikely(problem: &Problem, at: &Evaluation) -> f64 {
    at.reduced().map_or(f64::INFINITY, |reduced| minus_two_log(problem, at) + reduced.own_ln_determinant)
}

fn count(sums: &[NoiseSums]) -> f64 {
    sums.iter().map(|sum| sum.count).sum()
}

/// Returns the part of each noise of each sample that its numbers spend on unknowns: of tables
/// their leverages; the noises of films spend equal parts.
fn count_spent(
    problem: &Problem,
    at: &Evaluation,
    (reduced, estimates): (&Reduced, &Estimates),
    sums: &[Vec<NoiseSums>],
) -> Vec<Vec<f64>> {
    let total: f64 = sums.iter().map(|sums| count(sums)).sum();
    let shared = estimates.count_data(problem) / total.max(1.0);
    let spent_by_sample = |(number, sample): (usize, &Sample)| match &sample.block {
        Block::Rows(rows) => rows.leverages(at, (reduced, estimates), (number, sample)),
        _ => {
            let part = count_own(&at.shots[number], &reduced.own[number]) / count(&sums[number]) + shared;
            sums[number].iter().map(|sum| sum.count * part).collect()
        }
    };
    problem.samples.iter().enumerate().map(spent_by_sample).collect()
}

/// Returns the correlation of the errors of neighbouring numbers from that of their residuals,
/// which is less, as unknowns follow slow errors: if a part p is spent on unknowns, it is ρ − p(1 + ρ)
/// to first order (Marriott and Pope 1954, Biometrika 41, 390).
fn correlation(sums: &[NoiseSums], spent: &[f64]) -> f64 {
    let mut all = NoiseSums::default();
    for sum in sums {
        all.add(sum);
    }
    let part = (spent.iter().sum::<f64>() / all.count).min(MOST_SPENT);
    let rho = (all.lagged / all.square + part) / (1.0 - part);
    if rho > 0.0 { rho.min(1.0 - SETTLED) } else { 0.0 }
}

/// Returns the number of own unknowns that the data determine: each counts by the part of its
/// information that is not its prior's.
fn count_own(shots: &[ShotSums], own: &[Eliminated]) -> f64 {
    let count_shot = |(shot, own): (&ShotSums, &Eliminated)| {
        let variances = own.factor.inverse().diagonal();
        let all = own.places.iter().zip(&variances);
        all.map(|(place, variance)| (1.0 - variance * shot.known[*place]).clamp(0.0, 1.0)).sum::<f64>()
    };
    shots.iter().zip(own).map(count_shot).sum()
}

/// Returns the likeliest spread from shot to shot by what the shots show at the present one: about
/// what they share, which takes its part of their squares. It is the least if all numbers may
/// scatter by another one instead.
fn estimate_spread(
    problem: &Problem,
    at: &Evaluation,
    (reduced, estimates): (&Reduced, &Estimates),
    sample: usize,
    which: usize,
) -> f64 {
    let spread = &problem.samples[sample].block.variation().spreads[which];
    let mut numbers: Vec<(usize, &Scattered)> = Vec::new();
    for (i, shot) in at.shots[sample].iter().enumerate() {
        let is_free = |number: &&Scattered| number.spread == which && !shot.held[number.place];
        numbers.extend(shot.scattered.iter().filter(is_free).map(|number| (i, number)));
    }
    if !numbers.is_empty() && !numbers.iter().any(|(_, number)| number.shows_spread) {
        return spread.least;
    }
    let part = |variance: f64| 1.0 - variance / (spread.sd * spread.sd);
    let (mut shown, mut count, mut dof) = (Vec::new(), 0.0, 0.0);
    for (i, number) in numbers.into_iter().filter(|(_, number)| number.shows_spread) {
        let variance = reduced.own[sample][i].variance(&number.by);
        shown.extend(spread.shown(number.value, variance));
        count += part(variance);
        dof += part(estimates.variance(reduced, (sample, i), &number.by));
    }
    let left = dof / count;
    for number in &mut shown {
        number.square /= left;
    }
    spread.likeliest(&shown, left)
}
