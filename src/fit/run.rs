//! The fit itself: shots to plans, the model that they call for, the search for the minimum, and what is known there.

use std::time::Instant;

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::assemble::Finished;
use super::diagnostics::other_models;
use super::estimates::Estimates;
use super::model_choice::{ModelChoice, fitted_with};
use super::outlying::Odd;
use super::request::Request;
use super::samples::Search;
use super::settled::Settled;
use super::{Depth, Fit, FitError, Options, Refuted, check, discs, outlying_rows, starts};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::Sample;
use crate::measurement::dataset::Shot;
use crate::physics::collision::{Fidelity, FidelityChoice};

/// With more shots than this the profiles, the regions of pairs of parameters and the other models, some hundred fits,
/// would take longer than reading and extracting…
const MANY_SHOTS: usize = 20_000;
/// …and with so many the regions and other models, which are then parabolas to the eye.
const MANY_IN_REGIONS: usize = 5_000;

/// What a fit of so many shots can find out about itself in a time that is worth it.
fn affordable(depth: Depth, shots: usize) -> Depth {
    let most = match shots {
        many if many > MANY_SHOTS => Depth::Estimates,
        many if many > MANY_IN_REGIONS => Depth::Intervals,
        _ => Depth::Everything,
    };
    depth.min(most)
}

/// Fits some shots of a data set.
pub(super) fn fit_shots(request: &Request) -> Result<Fit, FitError> {
    let begun = Instant::now();
    // what no model describes is not worth more
    let lighter =
        Options { fidelity: FidelityChoice::Of(Fidelity::Full), depth: Depth::Estimates, ..*request.options };
    let is_light = request.options.fidelity == FidelityChoice::Auto && check::are_mixed_up(request.shots);
    let request = &if is_light { Request { options: &lighter, ..*request } } else { *request };
    let Request { dataset, options, .. } = *request;
    let named = |error| request.named(error);
    let (model, settings, initial) = fitted_with(dataset, options)?;
    let loss = options.loss.unwrap_or(dataset.loss);
    let stated = Search::of(Sample { loss, ..Sample::of(dataset, &[], (&model, &settings, initial)) });
    let (planned, shots_rejected) = request.planned(&stated)?;
    let depth = affordable(options.depth, planned.len());
    let of_discs = dataset.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_some());
    let choice = if of_discs {
        discs::choose(&planned, &stated, options.fidelity)
    } else {
        ModelChoice::of(planned, &stated, options)
    };
    let choice = choice.map_err(named)?;
    let mut velocities = stated.with(|_, sample| {
        (sample.fitted, sample.model, sample.settings) = (&choice.fitted, &choice.model, &choice.settings);
    });

    let mut settled = Settled::near_starts(&velocities, &choice.starts).map_err(named)?;
    if dataset.tracks.is_none() {
        let odd = outlying_rows::outlying(&settled).remove(0);
        if !odd.is_empty() {
            return without(request, &choice.fitted, &odd);
        }
        let unequal = velocities.unequal_noise(&settled.minimum, &settled.estimated).remove(0);
        if !unequal.is_empty() {
            velocities = velocities.with(|_, sample| sample.noise_apart.clone_from(&unequal));
            settled = Settled::near_starts(&velocities, &choice.starts).map_err(named)?;
        }
    }
    let search = &velocities;
    let (settled, starts) = starts::settle(search, settled, options);
    let refuted = !of_discs && is_refuted(&settled);
    // weights that hold the scatter of one model compare no other
    let compares = depth >= Depth::Everything && !of_discs && !refuted;
    let alternatives = || if compares { other_models::compare(search, &settled) } else { Vec::new() };
    let others = choice.rivals.clone().unwrap_or_else(|| settled.rivals());
    let of_estimates = if refuted { Depth::Estimates } else { depth };
    let (alternatives, estimates) =
        rayon::join(alternatives, || Estimates::of(&settled, (choice.scatter, &others), of_estimates));
    let finished = Finished::new(request, &choice, &settled, estimates);
    let mut fit = finished.fit(shots_rejected, starts, alternatives);
    finished.comment(&mut fit, depth);
    fit.seconds = begun.elapsed().as_secs_f64();
    Ok(fit)
}

/// Whether measured numbers whose noise is stated refute the model, so that its estimates have no errors.
fn is_refuted(settled: &Settled) -> bool {
    let Settled { search, free, minimum, estimated, .. } = settled;
    if search.is_filmed() || search.is_robust() || !estimated.is_empty() {
        return false;
    }
    let (chi2, dof) = (2.0 * minimum.cost, search.dof(free, minimum.parameters()).max(1) as f64);
    let p_value = ChiSquared::new(dof).map_or(1.0, |distribution| distribution.sf(chi2));
    Refuted::is(p_value, chi2 / dof)
}

/// The fit of the other shots, where some fit no collision that fits these: by their places among those that were fitted.
fn without(request: &Request, fitted: &[Fitted], odd: &[Odd]) -> Result<Fit, FitError> {
    let shots = request.shots;
    let is_odd = |i: &usize| odd.iter().any(|odd| fitted[odd.place].index == *i);
    let kept: Vec<usize> = (0..shots.len()).filter(|i| !is_odd(i)).collect();
    let kept_shots: Vec<&Shot> = kept.iter().map(|i| shots[*i]).collect();
    let rejected = odd.iter().map(|odd| {
        let shot = &shots[fitted[odd.place].index].name;
        (shot.clone(), odd.reason.clone())
    });
    let mut dataset = request.dataset.clone();
    dataset.left_out.extend(rejected);
    fit_shots(&Request { dataset: &dataset, shots: &kept_shots, ..*request })
}
