//! What every shot of a comparison is computed with.

use super::sample::{Apart, Group, search};
use super::{CompareError, Options};
use crate::fit::fidelity_choice;
use crate::fit::fidelity_choice::Chosen;
use crate::likelihood::fitted::Fitted;

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
    let mut chosen = fidelity_choice::choose(options.fidelity, shots, &search(groups, &bare, apart), &[])?;
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
    Ok(chosen)
}
