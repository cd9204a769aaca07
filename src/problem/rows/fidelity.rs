//! Effects beyond those of the sliding contact: its compliance, and the balls' weight with all that
//! the cloth does during the impact.

use std::sync::Arc;

use rayon::prelude::*;

use super::block::RowsBlock;
use super::shot::RowShot;
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::physics::collision::FidelityChoice;
use crate::problem::descent::Descent;
use crate::problem::film::impact::Correction;
use crate::problem::findings::Finding;
use crate::problem::minimise::{descend_weighed, descend_with_noise};
use crate::problem::policy::Policy;
use crate::problem::problem::{Evaluation, Problem};
use crate::problem::unknowns::{Id, Own, Shared};

/// Adopts the effects that make the shots likelier by enough.
pub(super) fn choose_effects(
    problem: &mut Problem,
    descent: &mut Descent,
    fidelity: FidelityChoice,
    settings: &Settings,
    policy: &Policy,
) -> Vec<Finding> {
    let mut tried = Vec::new();
    let is_auto = fidelity == FidelityChoice::Auto;
    if is_auto && settings.compliance == Compliance::Auto && settings[Parameter::Kappa].initial > 0.0 {
        tried.extend(try_compliance(problem, descent, settings[Parameter::Kappa].initial, policy));
    }
    let is_corrected = problem.rows().is_some_and(|rows| rows.contact.is_corrected());
    // the integrated contact is none that is stated to be rigid
    if is_auto && settings.compliance != Compliance::Rigid || is_corrected {
        tried.extend(try_weight(problem, descent, !is_auto, policy));
    }
    tried
}

/// Tries a compliant contact if shots stick.
fn try_compliance(
    problem: &mut Problem,
    descent: &mut Descent,
    kappa: f64,
    policy: &Policy,
) -> Option<Finding> {
    let shots = descent.end.count_sticking();
    if shots == 0 {
        return None;
    }
    let mut compliant = problem.clone();
    compliant.unknown_mut(Id::Kappa).start = kappa;
    compliant.refresh_contact();
    let mut start = descent.end.state.clone();
    start.shared[Id::Kappa] = kappa;
    let with = descend_with_noise(&mut compliant, start);
    let kappa = with.end.state.shared[Id::Kappa];
    let (fall, adopted) = adopt((problem, descent), (compliant, with), policy.adopt);
    Some(Finding::Compliance { kappa, shots, fall, adopted })
}

/// Tries outcomes with the balls' weight.
fn try_weight(
    problem: &mut Problem,
    descent: &mut Descent,
    of_all: bool,
    policy: &Policy,
) -> Option<Finding> {
    let mut weighed = problem.clone();
    let with = descend_weighed(&mut weighed, descent.end.state.clone());
    let shots = weighed.samples[0].block.count_corrected();
    if shots == 0 {
        return None;
    }
    let least = if of_all { f64::NEG_INFINITY } else { policy.adopt };
    let (fall, adopted) = adopt((problem, descent), (weighed, with), least);
    (!of_all).then_some(Finding::Weight { shots, fall, adopted })
}

/// Adopts a refit if −2 log L falls by more than `least`; returns the fall, and whether it was.
fn adopt(
    (problem, descent): (&mut Problem, &mut Descent),
    (other, with): (Problem, Descent),
    least: f64,
) -> (f64, bool) {
    let fall = minus_two_log(problem, &descent.end) - minus_two_log(&other, &with.end);
    let adopted = fall > least;
    if adopted {
        (*problem, *descent) = (other, with);
    }
    (fall, adopted)
}

/// Returns −2 log L up to a constant, greatest over the noises that are not stated.
pub(super) fn minus_two_log(problem: &Problem, at: &Evaluation) -> f64 {
    let sums = at.noises(0);
    let Some(rows) = problem.rows() else { return at.cost };
    let of_noise = sums
        .iter()
        .zip(&rows.noises)
        .map(|(sum, noise)| sum.count * (sum.weighted * noise.sd * noise.sd / sum.count).ln() - sum.weighted);
    at.cost + of_noise.sum::<f64>()
}

impl RowsBlock {
    /// Gives the shots whose speed is known the difference of the outcome with the balls' weight as their
    /// offset.
    pub fn weigh(&mut self, own: &[Own], shared: &Shared) {
        let heavy = if self.contact.is_corrected() { self.contact } else { self.contact.with_weight() };
        let offset = |(shot, own): (&mut RowShot, &Own)| {
            let (cue, _) = shot.approach(own, shared);
            let offset = heavy.correct(&cue, shared).ok().filter(|_| shot.knows_speed);
            shot.offset = offset.unwrap_or_else(Correction::zeros);
        };
        Arc::make_mut(&mut self.shots).par_iter_mut().zip(own).for_each(offset);
    }
}
