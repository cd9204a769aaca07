//! Effects beyond those of the sliding contact: its compliance, and the balls' weight with all that
//! the cloth does during the impact.

use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::physics::collision::FidelityChoice;
use crate::problem::descent::Descent;
use crate::problem::findings::Finding;
use crate::problem::minimise::{descend_weighed, descend_with_noise};
use crate::problem::noise::minus_two_log;
use crate::problem::policy::Policy;
use crate::problem::problem::Problem;
use crate::problem::unknowns::Id;

/// Adopts the effects that make the shots likelier by enough: a compliant contact if shots stick, and
/// outcomes with the balls' weight. A fidelity that was asked for is adopted anyway.
pub(super) fn choose_effects(
    problem: &mut Problem,
    descent: &mut Descent,
    fidelity: FidelityChoice,
    settings: &Settings,
    policy: &Policy,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    let (is_auto, kappa) = (fidelity == FidelityChoice::Auto, settings[Parameter::Kappa].initial);
    let shots = descent.end.count_sticking();
    if is_auto && settings.compliance == Compliance::Auto && kappa > 0.0 && shots > 0 {
        let (mut compliant, mut start) = (problem.clone(), descent.end.state.clone());
        (compliant.unknown_mut(Id::Kappa).start, start.shared[Id::Kappa]) = (kappa, kappa);
        compliant.refresh_contact();
        let with = descend_with_noise(&mut compliant, start);
        let kappa = with.end.state.shared[Id::Kappa];
        let (fall, adopted) = adopt((problem, descent), (compliant, with), policy.adopt);
        findings.push(Finding::Compliance { kappa, shots, fall, adopted });
    }
    let is_corrected = problem.rows().is_some_and(|rows| rows.contact.is_corrected());
    // the integrated contact is not that of a contact that is stated to be rigid
    if is_auto && settings.compliance != Compliance::Rigid || is_corrected {
        let mut weighed = problem.clone();
        let with = descend_weighed(&mut weighed, descent.end.state.clone());
        let shots = weighed.samples[0].block.count_corrected();
        if shots > 0 {
            let least = if is_auto { policy.adopt } else { f64::NEG_INFINITY };
            let (fall, adopted) = adopt((problem, descent), (weighed, with), least);
            findings.extend(is_auto.then_some(Finding::Weight { shots, fall, adopted }));
        }
    }
    findings
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
