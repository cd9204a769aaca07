//! What every shot is computed with, the fit of all together, and a test of each parameter.

use super::balls;
use super::joint_fit::FitOfAll;
use super::sample::{Apart, Gathered, Group};
use super::sliding::Known;
use super::{CompareError, Comparison, Finding, Options, SampleSummary, note};
use super::{choice, discs};
use crate::fit::Method;
use crate::fit::fidelity_choice::Chosen;
use crate::fit::outlying::Odd;
use crate::likelihood::fitted::Fitted;

/// What came of a comparison.
pub(super) struct Compared {
    pub comparison: Comparison,
    /// χ² and degrees of freedom of what is tested.
    pub tested: (f64, usize),
    /// μ_k of the data sets, where their frames were fitted.
    pub sliding: Option<Known>,
    /// What limits the differences, if the model holds: a sentence.
    pub limit: Option<String>,
}

/// Fits what is to be shared shared, the rest apart, and tests every parameter.
pub(super) fn run(
    gathered: &mut Gathered,
    apart: &Apart,
    (options, method): (&Options, Method),
    stage: &dyn Fn(&str),
) -> Result<Compared, CompareError> {
    let Gathered { labels, groups, shots, summaries, .. } = gathered;
    check_noise(groups, shots)?;
    stage("what each shot calls for");
    let choose = if discs::are_all(shots) { discs::choose } else { choice::choose };
    let Chosen { starts, notes, gives_way } = choose(groups, shots, apart, options)?;
    stage("fitting all together");
    let finish = |fit: &FitOfAll, notes: Vec<String>| {
        let comparison = fit.compared(labels, (options, method), stage)?;
        let mut comparison = comparison;
        comparison.findings.extend(gives_way.map(|fall| Finding::Compliance { fall }));
        comparison.findings.extend(notes.into_iter().map(note));
        let (tested, limit) = (fit.goodness(), balls::sentence(fit));
        Ok(Compared { comparison, tested, sliding: fit.sliding(), limit })
    };
    let odd = {
        let fit = FitOfAll::new(groups, shots, apart, &starts)?;
        let odd = fit.odd();
        if odd.iter().all(Vec::is_empty) {
            return finish(&fit, notes);
        }
        odd
    };
    for ((group, shots), odd) in groups.iter().zip(&mut *shots).zip(odd) {
        leave_out(group, shots, &odd, &mut summaries[group.number]);
    }
    finish(&FitOfAll::new(groups, shots, apart, &starts)?, notes)
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
