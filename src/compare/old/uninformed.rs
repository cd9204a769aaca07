//! What each label says about each parameter, and the joint fit of what is determined.

use super::sample::Group;
use super::{CompareError, Reason};
use crate::fit::samples::Search;
use crate::fit::saturation::Plateau;
use crate::fit::settled::Settled;
use crate::likelihood::sample::{Sample, Unknown};
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;

/// What a label says about a parameter.
#[derive(Clone, PartialEq)]
pub(super) enum Says {
    Something,
    Held,
    Nothing(Reason),
}

/// A joint fit in which everything that is free is determined.
pub(super) struct Informed<'a> {
    pub settled: Settled<'a>,
    /// Which of the groups its samples are: those that tell nothing in the end are left out.
    pub places: Vec<usize>,
    /// Unknowns that are known only to lie beyond an edge.
    pub plateaus: Vec<(Unknown, Plateau)>,
}

/// Fits all that the samples determine. One that determines nothing, since all it has ends on a plateau, is left out and the rest
/// fitted again: what is fitted to nothing of it any more would only pass for noise.
pub(super) fn settle<'a>(
    search: &Search<'a>,
    starts: &[Vec<Values>],
    mut places: Vec<usize>,
) -> Result<Informed<'a>, CompareError> {
    let (mut search, mut starts) = (search.clone(), starts.to_vec());
    let mut plateaus = Vec::new();
    loop {
        let settled = Settled::near_starts(&search, &starts)?;
        plateaus.extend(settled.plateaus.iter().copied());
        let tells = |sample: &Sample| {
            let mut parameters = sample.settings.parameters();
            parameters.retain(|p| !p.is_of_balls());
            parameters.iter().any(|p| sample.is_free(*p))
                || parameters.iter().all(|p| sample.settings[*p].fixed)
        };
        let stays: Vec<bool> = settled.search.samples.iter().map(tells).collect();
        if stays.iter().all(|stays| *stays) {
            return Ok(Informed { settled, places, plateaus });
        }
        keep(&mut search.samples, &stays);
        keep(&mut places, &stays);
        for start in &mut starts {
            keep(start, &stays);
        }
        if search.samples.is_empty() {
            return Err(CompareError::TooFew(0));
        }
    }
}

fn keep<T>(all: &mut Vec<T>, stays: &[bool]) {
    let mut each = stays.iter();
    all.retain(|_| each.next().copied().unwrap_or(true));
}

impl Informed<'_> {
    /// What a label says about a parameter; `groups` and their samples as they were before the fit.
    pub(super) fn says(&self, groups: &[Group], before: &Search, label: usize, parameter: Parameter) -> Says {
        let own: Vec<usize> = (0..groups.len()).filter(|i| groups[*i].label == label).collect();
        if own.is_empty() {
            return Says::Nothing(Reason::NoShots);
        }
        let has: Vec<usize> = own.iter().copied().filter(|i| groups[*i].settings.has(parameter)).collect();
        if has.is_empty() {
            return Says::Nothing(Reason::Absent);
        }
        if has.iter().all(|i| groups[*i].settings[parameter].fixed) {
            return Says::Held;
        }
        let is_free = |sample: &Sample| sample.is_free(parameter);
        let last = self.places.iter().zip(&self.settled.search.samples);
        if last.into_iter().any(|(place, sample)| has.contains(place) && is_free(sample)) {
            return Says::Something;
        }
        let is_silent = |i: &usize| Search::silent(&before.samples[*i]).contains(&parameter);
        let why = match parameter {
            _ if has.iter().all(is_silent) => Reason::Independent,
            Parameter::Mu => Reason::Sticks,
            _ => Reason::Vanishes,
        };
        Says::Nothing(why)
    }

    /// The column that is a label's value of a parameter.
    pub(super) fn column(&self, groups: &[Group], label: usize, parameter: Parameter) -> Option<usize> {
        let own = self.places.iter().zip(&self.settled.search.samples);
        let mut own = own.filter(|(place, _)| groups[**place].label == label);
        own.find_map(|(_, sample)| {
            let has = |unknown: &Unknown| unknown.parameter == parameter && sample.has(*unknown);
            self.settled.free.iter().position(has)
        })
    }
}
