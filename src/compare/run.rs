//! What every shot is computed with, the fit of all together, and a test of each parameter.

use super::camera;
use super::joint_fit::FitOfAll;
use super::sample::{Apart, Gathered, Group};
use super::sliding::Known;
use super::{COMPARED, CompareError, Comparison, Footage, Options, SampleSummary};
use super::{choice, discs};
use crate::fit::Method;
use crate::fit::fidelity_choice::Chosen;
use crate::fit::frames::filmed;
use crate::fit::outlying::Odd;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::frames::shared_unknowns;

/// What shots are computed with, the joint fit, and a test of each parameter.
pub(super) const STAGES: usize = 2 + COMPARED.len();

/// Fits what is to be shared shared, the rest apart, and tests every parameter. The second of the result: μ_k of the data sets,
/// where their frames were fitted.
pub(super) fn run(
    gathered: &mut Gathered,
    footage: &[Footage],
    apart: &Apart,
    (options, method): (&Options, Method),
    stage: &dyn Fn(&str),
) -> Result<(Comparison, Option<Known>), CompareError> {
    let Gathered { labels, groups, shots, summaries, .. } = gathered;
    check_noise(groups, shots)?;
    stage("what each shot calls for");
    let choose = if discs::are_all(shots) { discs::choose } else { choice::choose };
    let Chosen { starts, notes, gives_way } = choose(groups, shots, apart, options)?;
    stage("fitting all together");
    let finish = |fit: &FitOfAll, notes: Vec<String>| {
        fit.informed.check_room(fit.groups, labels.len())?;
        let comparison = fit.compared(labels, (options, method), stage)?;
        let notes = notes.into_iter().chain(camera::sentence(fit)).collect();
        Ok((Comparison { gives_way: gives_way.is_some(), notes, ..comparison }, fit.sliding()))
    };
    let joint = method == Method::Joint;
    let films = if joint { Some(with_frames(groups, shots, footage)?) } else { None };
    let odd = {
        let fit = FitOfAll::new(groups, (shots, films.as_deref()), apart, &starts)?;
        let odd = fit.odd();
        if odd.iter().all(Vec::is_empty) {
            return finish(&fit, notes);
        }
        odd
    };
    for ((group, shots), odd) in groups.iter().zip(&mut *shots).zip(odd) {
        leave_out(group, shots, &odd, &mut summaries[group.number]);
    }
    let films = with_frames(groups, shots, footage)?;
    finish(&FitOfAll::new(groups, (shots, Some(&films)), apart, &starts)?, notes)
}

/// The shots of each group with their frames, whose film unknowns the group then has.
fn with_frames(
    groups: &mut [Group],
    shots: &[Vec<Fitted>],
    footage: &[Footage],
) -> Result<Vec<Vec<Fitted>>, CompareError> {
    let mut all = Vec::new();
    for (group, shots) in groups.iter_mut().zip(shots) {
        let missing = || CompareError::NotFilmed(group.dataset.name.clone());
        let footage = footage.get(group.dataset_number).ok_or_else(missing)?;
        all.push(filmed(shots, &footage.films).ok_or_else(missing)?);
        group.unknowns = shared_unknowns::of_fit(footage.unknowns.unknowns());
        group.camera.clone_from(&footage.camera);
        let cloth = [group.dataset.sliding, group.dataset.rolling];
        for (unknown, known) in group.unknowns.iter_mut().zip(cloth) {
            unknown.start = known.map_or(unknown.start, |known| known.value);
        }
    }
    Ok(all)
}

fn leave_out(group: &Group, shots: &mut Vec<Fitted>, odd: &[Odd], summary: &mut SampleSummary) {
    for odd in odd {
        let name = &group.dataset.shots[shots[odd.place].index].name;
        summary.shots_rejected.push(odd.rejected(name));
    }
    summary.shots_used -= odd.len();
    let mut place = 0;
    shots.retain(|_| {
        place += 1;
        odd.iter().all(|odd| odd.place + 1 != place)
    });
}

fn check_noise(groups: &[Group], shots: &[Vec<Fitted>]) -> Result<(), CompareError> {
    let mut seen = Vec::new();
    for (group, shots) in groups.iter().zip(shots) {
        for row in shots.iter().flat_map(|shot| shot.plan.rows()) {
            let (key, has) = ((group.dataset_number, row.observable), row.measured.sd.is_some());
            match seen.iter().find(|(known, _)| *known == key) {
                Some((_, other)) if *other != has => {
                    return Err(CompareError::MixedNoise {
                        label: group.title.clone(),
                        column: row.observable.column(),
                    });
                }
                Some(_) => {}
                None => seen.push((key, has)),
            }
        }
    }
    Ok(())
}
