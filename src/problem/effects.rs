//! Effects beyond the closed form of a rigid contact, adopted if they make the data likelier by
//! enough: a contact that is compliant along its surface, and weight and cloth during the contact.

use super::evaluation::Evaluation;
use super::findings::Finding;
use super::minimise::{Descent, ENOUGH_SHOTS, FAR, Thinned, descend, descend_with_noise, thin};
use super::policy::{COMPARED_STEPS, POLICY, ROUGH};
use super::problem::{Problem, State};
use super::unknowns::{Id, Mode};
use crate::measurement::parameter::Compliance;
use crate::physics::collision::Model;

/// Adopts a compliant contact, and outcomes with weight and cloth, if they make the data likelier
/// by enough; effects of a fidelity that is not chosen automatically anyway.
pub(super) fn choose_effects(
    problem: &mut Problem,
    descent: &mut Descent,
    (is_auto, compliance): (bool, Compliance),
) -> Vec<Finding> {
    let mut findings = Vec::new();
    if is_auto && compliance == Compliance::Auto {
        findings.extend(comply(problem, descent));
    }
    let is_refuted = matches!(findings[..], [Finding::Compliance { fall, .. }] if fall < -POLICY.adopt);
    // the integrated contact is compliant, which one that is stated or seen to be rigid is not
    if is_auto && compliance != Compliance::Rigid && !is_refuted || problem.is_weighed() {
        let least = if is_auto { POLICY.adopt } else { f64::NEG_INFINITY };
        let weigh = |problem: &mut Problem, state: &mut State| problem.weigh(state);
        let Tried { shots, fall, adopted } = adopt(problem, descent, weigh, least);
        findings.extend((is_auto && shots > 0).then_some(Finding::Weight { shots, fall, adopted }));
    }
    findings
}

/// Adopts a contact that is compliant along its surface, with the κ of phenolic resin, if it makes
/// the data likelier by enough; `None` if no contact sticks, or κ is stated or free.
pub(crate) fn comply(problem: &mut Problem, descent: &mut Descent) -> Option<Finding> {
    let is_rigid = |column: &usize| {
        let kappa = &problem.unknowns[*column];
        kappa.mode == Mode::Fixed && kappa.start == 0.0
    };
    let rigid: Vec<usize> = problem.columns_of(Id::Kappa).into_iter().filter(is_rigid).collect();
    let shots = descent.end.count_sticking();
    if rigid.is_empty() || shots == 0 {
        return None;
    }
    let give_way = |problem: &mut Problem, state: &mut State| {
        for column in &rigid {
            (problem.unknowns[*column].start, state.shared.0[*column]) = (Model::KAPPA, Model::KAPPA);
        }
        problem.refresh_contact();
    };
    let Tried { fall, adopted, .. } = adopt(problem, descent, give_way, POLICY.adopt);
    Some(Finding::Compliance { kappa: Model::KAPPA, shots, fall, adopted })
}

/// A refit with an effect.
struct Tried {
    /// Number of shots with weight and cloth.
    shots: usize,
    /// Decrease of χ² at the noise before.
    fall: f64,
    adopted: bool,
}

/// Refits with an effect, which `add` adds to a problem and its state, and adopts it if χ²
/// decreases by more than `least`. An effect that makes some of the shots of a large table less
/// likely is not computed for all.
fn adopt(
    problem: &mut Problem,
    descent: &mut Descent,
    add: impl Fn(&mut Problem, &mut State),
    least: f64,
) -> Tried {
    let attempt = |problem: &Problem, from: &Evaluation| {
        let (mut other, mut state) = (problem.clone(), from.state.clone());
        add(&mut other, &mut state);
        let free = other.free();
        let mut with = descend(&other, other.evaluate(state), &free, (COMPARED_STEPS, FAR));
        if with.end.cost - from.cost < FAR {
            with = descend(&other, with.end, &free, (COMPARED_STEPS, ROUGH));
        }
        let shots: usize = other.samples.iter().map(|sample| sample.block.count_corrected()).sum();
        let fall = from.cost - with.end.cost;
        (other, with, Tried { shots, fall, adopted: fall > least })
    };
    let Thinned { problem: some, state, factor } = thin(problem, &descent.end.state, ENOUGH_SHOTS);
    if problem.rows().is_some() && factor > 1.0 && least.is_finite() {
        let (_, _, Tried { shots, fall, .. }) = attempt(&some, &some.descend(state).end);
        if fall < 0.0 {
            let shots = (factor * shots as f64).round() as usize;
            return Tried { shots, fall: factor * fall, adopted: false };
        }
    }
    let (other, with, tried) = attempt(problem, &descent.end);
    if tried.adopted {
        *problem = other;
        if problem.is_weighed() {
            problem.weigh(&with.end.state);
        }
        *descent = descend_with_noise(problem, with.end.state);
    }
    tried
}
