//! Samples of discs, whose shots scatter by more than the noise of their frames: the errors of each sample's shots include its own scatter,
//! as in a fit of that sample alone.

use super::sample::{Apart, Group, search};
use super::{CompareError, Options};
use crate::fit::discs;
use crate::fit::fidelity_choice::Chosen;
use crate::fit::model_choice::ModelChoice;
use crate::likelihood::fitted::Fitted;
use crate::measurement::number::plain;
use crate::measurement::parameter::{Compliance, Parameter};
use crate::measurement::values::Values;

/// Whether all samples are of discs.
pub(super) fn are_all(shots: &[Vec<Fitted>]) -> bool {
    shots.iter().flatten().all(|shot| shot.plan.is_of_discs())
}

/// What every shot is computed with, with its sample's scatter in its errors. Where one sample calls for a contact that gives way, all
/// have one.
///
/// # Errors
/// A sample that cannot be fitted alone.
pub(super) fn choose(
    groups: &mut [Group],
    shots: &mut [Vec<Fitted>],
    apart: &Apart,
    options: &Options,
) -> Result<Chosen, CompareError> {
    let mut alone: Vec<ModelChoice> =
        groups.iter().zip(&*shots).map(|own| alone(own, apart, options)).collect::<Result<_, _>>()?;
    let gives_way = alone.iter().filter_map(|chosen| chosen.gives_way).reduce(f64::max);
    if gives_way.is_some() {
        // those that do not call for it by themselves have it, too, with κ free as those have it
        for ((chosen, group), shots) in alone.iter_mut().zip(&mut *groups).zip(&*shots) {
            if chosen.gives_way.is_none() && group.settings.compliance == Compliance::Auto {
                group.give_way();
                group.settings[Parameter::Kappa].fixed = false;
                *chosen = self::alone((group, shots), apart, options)?;
            }
        }
    }
    let (mut starts, mut notes): (Vec<Vec<Values>>, Vec<String>) = Default::default();
    if gives_way.is_some() {
        notes.push(
            "The contact gives way along its surface: the shots of at least one sample call for it."
                .to_owned(),
        );
    }
    let own: Vec<Values> = alone
        .iter()
        .zip(&*groups)
        .map(|(one, group)| one.starts.first().map_or(group.initial, |start| start[0]))
        .collect();
    starts.push(own.clone());
    starts.extend(own.iter().map(|values| vec![*values; own.len()]));
    for ((chosen, group), shots) in alone.into_iter().zip(groups).zip(shots) {
        let scatter = chosen.scatter.filter(|scatter| !scatter.is_none());
        group.scatters = scatter.is_some();
        if let Some(scatter) = scatter {
            notes.push(format!(
                "{}: beyond the errors of their frames shots scatter by {} in e and {} in J_t/J_n, which the errors include.",
                group.title,
                plain(scatter.restitution, 2),
                plain(scatter.impulse_ratio, 2)
            ));
        }
        notes.extend(chosen.notes.into_iter().map(|note| format!("{}: {note}", group.title)));
        (group.model, group.settings, *shots) = (chosen.model, chosen.settings, chosen.fitted);
    }
    Ok(Chosen { starts, gives_way, notes })
}

/// What a sample is fitted with by itself.
fn alone(
    (group, shots): (&Group, &Vec<Fitted>),
    apart: &Apart,
    options: &Options,
) -> Result<ModelChoice, CompareError> {
    let none = [Vec::new()];
    let search = search(std::slice::from_ref(group), &none, apart);
    Ok(discs::choose(shots, &search, options.fidelity)?)
}
