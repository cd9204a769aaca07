//! What every shot of a comparison is computed with.

use super::sample::{Apart, Group, search};
use super::{CompareError, Options};
use crate::fit::fidelity_choice;
use crate::likelihood::fitted::Fitted;
use crate::measurement::values::Values;
use crate::physics::collision::FidelityChoice;

/// What every shot is computed with.
pub(super) struct Chosen {
    /// Where a search then begins.
    pub starts: Vec<Vec<Values>>,
    pub notes: Vec<String>,
    /// Whether the contact gives way, as the data call for it.
    pub gives_way: bool,
    /// Whether the errors include what shots scatter by beyond their own.
    pub scatters: bool,
}

/// As the data sets state, or as all together call for it.
///
/// # Errors
/// A search that leads nowhere.
pub(super) fn choose(
    groups: &mut [Group],
    shots: &mut [Vec<Fitted>],
    apart: &Apart,
    options: &Options,
) -> Result<Chosen, CompareError> {
    let bare = vec![Vec::new(); shots.len()];
    let search = search(groups, &bare, apart);
    if let FidelityChoice::Of(fidelity) = options.fidelity {
        let starts =
            if fidelity.is_integrated() { fidelity_choice::integrate(shots, &search)? } else { Vec::new() };
        return Ok(Chosen { starts, notes: Vec::new(), gives_way: false, scatters: false });
    }
    let mut chosen = fidelity_choice::choose(shots, &search, &[])?;
    drop(search);
    if let Some(lower) = chosen.gives_way {
        for (group, shots) in groups.iter_mut().zip(&*shots) {
            if shots.iter().all(|shot| !shot.plan.is_of_discs()) {
                group.give_way();
            }
        }
        chosen.notes.push(format!(
            "The contact between the balls gives way along its surface: with it −2 log L is lower by {lower:.1}. To state it, set kappa \
             under [fit] of each data set."
        ));
    }
    Ok(Chosen {
        starts: chosen.starts,
        notes: chosen.notes,
        gives_way: chosen.gives_way.is_some(),
        scatters: false,
    })
}
