//! The fit of all that the data tell: what they do not is held, and the rest fitted again.

use std::cmp::Ordering::Equal;

use super::diagnostics::identifiability;
use super::minimum::Minimum;
use super::noise::Group;
use super::samples::Search;
use super::saturation::Plateau;
use super::scan::SAME;
use super::{FitError, Identifiability};
use crate::likelihood::sample::Unknown;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;

/// A minimum of a scan may become the least if its objective is above the least of the scan by at most this (in units of χ²/dof where
/// that is above 1): the scan is rough, and takes some of the shots only.
pub(super) const MARGIN: f64 = 30.0;

/// An objective that is lower by less is the same: a thirtieth of a standard error.
pub(super) const LOWER: f64 = 1e-3;

/// Of starts after a short descent, those whose objective is within this of the least (in units of χ²/dof where that is
/// above 1) may still end lower than it.
pub(super) const RIVAL: f64 = 2.0;

/// A minimum at which everything that is still free is determined.
#[derive(Clone)]
pub(crate) struct Settled<'a> {
    /// With what the data do not tell held.
    pub search: Search<'a>,
    pub free: Vec<Unknown>,
    pub minimum: Minimum,
    pub estimated: Vec<Group>,
    pub plateaus: Vec<(Unknown, Plateau)>,
    pub identifiability: Option<Identifiability>,
    /// What was minimised.
    pub objective: f64,
    /// Other minima that were found, and what was minimised there.
    pub others: Vec<(Vec<Values>, f64)>,
}

impl<'a> Settled<'a> {
    /// The least of the minima that searches from these values lead to.
    pub(super) fn from_starts(search: &Search<'a>, starts: &[Vec<Values>]) -> Result<Self, FitError> {
        let (search, free) = told(search)?;
        Self::least_of(&search, &free, starts)
    }

    /// Where a search begins whose shots are computed a little differently, or are frames from which these velocities were
    /// extracted: at the minimum first and at others that may become the least, a parameter on a plateau also below it.
    pub(crate) fn starts_nearby(&self) -> Vec<Vec<Values>> {
        /// Of the value at which the plateau begins: where the shots that stick last still slide.
        const BELOW: f64 = 0.9;
        let best = &self.minimum.values;
        let mut starts = vec![best.clone()];
        for (unknown, Plateau { edge, bound, .. }) in &self.plateaus {
            if bound > edge {
                let mut below = best.clone();
                for (sample, values) in self.search.samples.iter().zip(&mut below) {
                    if sample.numbers[unknown.parameter as usize] == unknown.number {
                        values[unknown.parameter] = BELOW * edge;
                    }
                }
                starts.push(below);
            }
        }
        let near =
            |(_, objective): &&(Vec<Values>, f64)| *objective <= self.objective + MARGIN * self.scale();
        for (values, _) in self.others.iter().filter(near) {
            if starts.iter().all(|known| differs(known, values)) {
                starts.push(values.clone());
            }
        }
        starts
    }

    /// The standard error of an unknown as the curvature has it, of noise as it is; 0 where there is none.
    pub(super) fn error_of(&self, unknown: Unknown) -> f64 {
        let Some(column) = self.free.iter().position(|known| *known == unknown) else { return 0.0 };
        let covariance = self.minimum.covariance();
        covariance.map_or(0.0, |c| (c[(column, column)] * self.scale()).sqrt())
    }

    /// Other minima of a fit of one sample that a 95 % confidence region would reach, and how much higher what is minimised is there.
    pub(super) fn rivals(&self) -> Vec<(Values, f64)> {
        /// The 95 % quantile of χ² with one degree of freedom.
        const REGION: f64 = 3.84;
        let higher = |objective: f64| objective - self.objective;
        let above = self.others.iter().map(|(values, objective)| match higher(*objective) {
            rounding if rounding.abs() < self.same() => (values[0], 0.0),
            higher => (values[0], higher),
        });
        above.filter(|(_, higher)| (0.0..REGION * self.scale()).contains(higher)).collect()
    }

    /// χ²/dof where that is above 1.
    pub(crate) fn scale(&self) -> f64 {
        let dof = self.search.observations().saturating_sub(self.minimum.parameters()).max(1);
        (2.0 * self.minimum.cost / dof as f64).max(1.0)
    }

    /// The least first, and those that did not converge last.
    pub(super) fn rank(&self) -> (bool, f64) {
        (!self.minimum.converged, self.objective)
    }

    /// Whether this is the minimum to be taken of two: the lower one, and of two that are as low, as where a contact that gives
    /// way throws as far at a small μ as at a large one, that of the lesser friction.
    pub(super) fn precedes(&self, other: &Self) -> bool {
        let ((failed, objective), (other_failed, others)) = (self.rank(), other.rank());
        match failed == other_failed {
            false => other_failed,
            true if (objective - others).abs() < self.same() => {
                let friction =
                    |settled: &Self| settled.minimum.values.iter().map(|v| v[Parameter::Mu]).sum::<f64>();
                friction(self) < friction(other)
            }
            true => objective < others,
        }
    }

    /// By how much what is minimised may differ between minima that are as low. Where as many numbers as unknowns are met exactly
    /// it is all rounding.
    fn same(&self) -> f64 {
        let is_exact = self.search.observations() <= self.minimum.parameters();
        if is_exact { RIVAL } else { LOWER * self.scale() }
    }

    /// The least of the minima found from some starts. One that did not converge stands behind those that did; an error
    /// is one only if all fail.
    pub(super) fn least_of(
        search: &Search<'a>,
        free: &[Unknown],
        starts: &[Vec<Values>],
    ) -> Result<Self, FitError> {
        let mut found: Vec<Self> = Vec::new();
        let mut error = None;
        for start in starts {
            let initial = free.iter().fold(search.initial(), |initial, unknown| {
                search.set(&initial, *unknown, search.value(start, *unknown))
            });
            match Self::near(&search.from(&initial), free.to_vec()) {
                Ok(settled) => found.push(settled),
                Err(failed) => error = error.or(Some(failed)),
            }
        }
        found.sort_by(|a, b| a.rank().partial_cmp(&b.rank()).unwrap_or(Equal));
        let first =
            (1..found.len()).fold(0, |best, i| if found[i].precedes(&found[best]) { i } else { best });
        if !found.is_empty() {
            found.swap(0, first);
        }
        let others: Vec<(Vec<Values>, f64)> =
            found.iter().skip(1).map(|other| (other.minimum.values.clone(), other.objective)).collect();
        let best = found.into_iter().next();
        best.map(|best| Self { others, ..best }).ok_or(error.unwrap_or(FitError::NoWeights))
    }

    /// The minimum near the initial values of a search.
    fn near(search: &Search<'a>, mut free: Vec<Unknown>) -> Result<Self, FitError> {
        let all = search;
        let mut search = search.clone();
        let mut identifiability = None;
        let mut plateaus: Vec<(Unknown, Plateau)> = Vec::new();
        loop {
            let (minimum, estimated) = search.converge(&free)?;
            let Some(null) = minimum.undetermined() else {
                identifiability = identifiability.or_else(|| identify(all, &free, &minimum));
                for (unknown, plateau) in &mut plateaus {
                    if let Some(anew) = all.plateau(*unknown, &minimum) {
                        *plateau = anew;
                    }
                }
                let objective = search.objective(&minimum, &estimated);
                let others = Vec::new();
                return Ok(Self {
                    search,
                    free,
                    minimum,
                    estimated,
                    plateaus,
                    identifiability,
                    objective,
                    others,
                });
            };
            // what the data do not determine is left where the search ended, or well inside its plateau, where the weights are
            // those of one side, and the rest fitted again
            let lost: Vec<Unknown> =
                null.iter().filter_map(|(column, _)| free.get(*column).copied()).collect();
            let mut held = search.initial();
            for unknown in &lost {
                held = search.set(&held, *unknown, search.value(&minimum.values, *unknown));
            }
            match lost[..] {
                [unknown] => match search.plateau(unknown, &minimum) {
                    Some(plateau) => {
                        held = search.set(&held, unknown, 0.5 * (plateau.edge + plateau.bound));
                        plateaus.push((unknown, plateau));
                    }
                    // nothing depends on it anywhere
                    None => {
                        for i in search.members(unknown) {
                            let parameter = unknown.parameter;
                            held[i][parameter] = search.samples[i].settings[parameter].initial;
                        }
                    }
                },
                _ => identifiability = identify(all, &free, &minimum),
            }
            search = search.from(&held).with(|_, sample| {
                let own: Vec<Parameter> =
                    lost.iter().filter(|unknown| sample.has(**unknown)).map(|u| u.parameter).collect();
                sample.undetermined.extend(own);
            });
            free.retain(|unknown| !lost.contains(unknown));
        }
    }
}

/// What the data of one sample determine.
pub(super) fn identify(search: &Search, free: &[Unknown], minimum: &Minimum) -> Option<Identifiability> {
    let [sample] = search.samples.as_slice() else { return None };
    // ratios of the balls, which have priors, count among what the shots share
    let (of_balls, own): (Vec<usize>, Vec<usize>) =
        (0..free.len()).partition(|column| free[*column].parameter.is_of_balls());
    let parameters: Vec<Parameter> = own.iter().map(|column| free[*column].parameter).collect();
    let columns: Vec<usize> = own.into_iter().chain(of_balls).chain(free.len()..minimum.x.len()).collect();
    let jacobian = minimum.jacobian.select_columns(&columns);
    let x = minimum.x.select_rows(&columns);
    identifiability::identify(&jacobian, &parameters, &x, sample.undetermined.clone())
}

/// The search with what no observation depends on held at its initial value, and what is left free.
pub(super) fn told<'a>(search: &Search<'a>) -> Result<(Search<'a>, Vec<Unknown>), FitError> {
    let search = search.with(|_, sample| {
        sample.undetermined = Search::silent(sample);
        for parameter in &sample.undetermined {
            sample.initial[*parameter] = sample.settings[*parameter].initial;
        }
    });
    let free = search.free();
    // noise that lasts leaves a film fewer numbers of their own, but a collision ties as many
    let tied: usize = search.shots().map(|shot| shot.plan.rows().len()).sum();
    let observations = search.observations().max(tied);
    if observations + search.priors(&free) < free.len() {
        return Err(FitError::TooFewObservations {
            dataset: String::new(),
            observations,
            parameters: free.iter().map(|u| u.parameter.name()).collect::<Vec<_>>().join(", "),
        });
    }
    Ok((search, free))
}

/// Whether the friction differs by more than neighbouring points of a scan do.
pub(super) fn differs(a: &[Values], b: &[Values]) -> bool {
    let of = |a: &Values, b: &Values| {
        [Parameter::Mu, Parameter::B, Parameter::C, Parameter::Kappa]
            .into_iter()
            .any(|p| (a[p] - b[p]).abs() > SAME * a[p].abs().max(b[p].abs()))
    };
    a.iter().zip(b).any(|(a, b)| of(a, b))
}
