//! `--fidelity auto` for all data sets together: what each shot is computed with, as a single fit chooses it.

use rayon::prelude::*;

use super::joint::Weights;
use super::uninformed::{Says, Settled, settle};
use super::{CompareError, Sample};
use crate::fit::fidelity_choice::{EVIDENCE, OTHERWISE, PART, ROUNDS, SAMPLE, WEIGHT, left_out};
use crate::measurement::parameter::Parameter;
use crate::physics::collision::Coefficients;

/// What is compared, as [`settle`] takes it.
#[derive(Clone, Copy)]
pub(super) struct Question {
    pub labels: usize,
    pub apart: [bool; 3],
}

/// Each shot takes the cheapest fidelity that keeps within [`PART`] of its standard errors, where the joint fit ends. What
/// calls for `contact` is computed as `full` with a correction, if the shots of all data sets together speak for it; else
/// what it would have given is returned, in words.
pub(super) fn choose(samples: &mut [Sample], question: Question) -> Result<Option<String>, CompareError> {
    let mut some = thinned(samples);
    let usual = some.iter().map(|sample| sample.usual()).collect::<Vec<_>>();
    take_cheapest(&mut some, &usual);
    let start = fit(&some, question)?.coefficients;
    take_cheapest(&mut some, &start);
    let closed = fit(&some, question)?;
    let mut at = closed.coefficients.clone();
    let mut refused = None;
    if some.iter().flat_map(|sample| &sample.fitted).any(|shot| shot.plan.is_corrected()) {
        let corrected = correct(&mut some, at.clone(), question)?;
        let of =
            |settled: &Settled| settled.solved.minus_two_log_likelihood(&settled.samples, &settled.layout);
        let higher = of(&corrected) - of(&closed);
        if higher > -EVIDENCE {
            refused = Some(refusal(higher, &corrected, &closed));
        } else {
            at.clone_from(&corrected.coefficients);
        }
    }
    take_cheapest(samples, &at);
    if refused.is_some() {
        for sample in samples {
            let model = sample.model;
            sample.fitted.par_iter_mut().for_each(|shot| shot.plan.settle_for_closed(&model));
        }
    } else {
        take_corrections(samples, &at);
    }
    Ok(refused)
}

/// All shots at the integrated fidelity of the model, as `full` with corrections.
pub(super) fn integrate(samples: &mut [Sample], question: Question) -> Result<(), CompareError> {
    for sample in &mut *samples {
        let model = sample.model;
        sample.fitted.iter_mut().for_each(|shot| shot.plan.fix(&model));
    }
    let mut some = thinned(samples);
    let start = fit(&some, question)?.coefficients;
    let corrected = correct(&mut some, start, question)?;
    take_corrections(samples, &corrected.coefficients);
    Ok(())
}

/// Some of the shots of every sample, spread evenly.
fn thinned(samples: &[Sample]) -> Vec<Sample> {
    let all: usize = samples.iter().map(|sample| sample.fitted.len()).sum();
    let step = all.div_ceil(SAMPLE).max(1);
    let some = |sample: &Sample| Sample {
        fitted: sample.fitted.iter().step_by(step).cloned().collect(),
        ..sample.clone()
    };
    samples.iter().map(some).collect()
}

fn fit(samples: &[Sample], Question { labels, apart }: Question) -> Result<Settled, CompareError> {
    settle(samples, labels, apart, Weights::Likeliest)
}

fn take_cheapest(samples: &mut [Sample], at: &[Coefficients]) {
    for (sample, at) in samples.iter_mut().zip(at) {
        let (model, on_cloth) = (sample.model, sample.on_cloth);
        sample.fitted.par_iter_mut().for_each(|shot| {
            // what cannot be predicted there is told of where the fit ends
            _ = shot.plan.choose(&model, at, PART, OTHERWISE);
            // weight and contact time have no part in a shot without a speed
            if !(on_cloth && shot.plan.knows_speed()) {
                shot.plan.settle_for_closed(&model);
            }
        });
    }
}

fn take_corrections(samples: &mut [Sample], at: &[Coefficients]) {
    for (sample, at) in samples.iter_mut().zip(at) {
        let model = sample.model;
        sample.fitted.par_iter_mut().for_each(|shot| {
            if shot.plan.correct(&model, at).is_err() {
                shot.plan.settle_for_closed(&model);
            }
        });
    }
}

/// Corrects and fits in turn.
fn correct(
    samples: &mut [Sample],
    mut at: Vec<Coefficients>,
    question: Question,
) -> Result<Settled, CompareError> {
    for _ in 1..ROUNDS {
        take_corrections(samples, &at);
        at = fit(samples, question)?.coefficients;
    }
    take_corrections(samples, &at);
    fit(samples, question)
}

/// What is not told without `contact` is hardly told with it, and not quoted.
fn refusal(higher: f64, with: &Settled, without: &Settled) -> String {
    let mut found: Vec<String> = Vec::new();
    for parameter in Parameter::COEFFICIENTS {
        let mut seen = Vec::new();
        for (sample, columns) in with.samples.iter().zip(&with.layout.columns) {
            let is_told = without.says[parameter as usize][sample.label] == Says::Something;
            let column = columns[parameter as usize].filter(|column| is_told && !seen.contains(column));
            let Some(column) = column else { continue };
            seen.push(column);
            found.push(format!("{} = {:.4} ({})", parameter.symbol(), with.solved.x[column], sample.title));
        }
        // one for all
        if let ([_], Some(last)) = (seen.as_slice(), found.last_mut()) {
            last.truncate(last.rfind(" (").unwrap_or(last.len()));
        }
    }
    left_out(WEIGHT, higher, "all data sets together do", &found)
}
