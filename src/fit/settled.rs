//! The fit of all that the data tell: what they do not is held, and the rest fitted again.

use std::cmp::Ordering::Equal;

use super::diagnostics::identifiability;
use super::global::{LOWER, MARGIN, RIVAL, SAME};
use super::noise::Group;
use super::saturation::Plateau;
use super::search::Search;
use super::uncertainty;
use super::uncertainty::Minimum;
use super::{FitError, Identifiability};
use crate::likelihood::fitted::Fitted;
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::values::Values;

/// A minimum between kinks may lie beside a lower one: so often the next one is looked for.
const MOST_REFINEMENTS: usize = 4;

/// And the minimum at a kink is this near to where it is seen, relative.
const REACH: f64 = 0.01;

/// A minimum at which everything that is still free is determined.
#[derive(Clone)]
pub(super) struct Settled<'a> {
    /// With what the data do not tell held.
    pub search: Search<'a>,
    pub free: Vec<Parameter>,
    pub minimum: Minimum,
    pub estimated: Vec<Group>,
    pub plateaus: Vec<Plateau>,
    pub identifiability: Option<Identifiability>,
    /// What was minimised.
    pub objective: f64,
    /// Other minima that were found, and what was minimised there.
    pub others: Vec<(Values, f64)>,
}

impl<'a> Settled<'a> {
    /// Fits all that is free and that the data tell: the least minimum of those that the search finds from wherever a scan
    /// of the friction says that it may be.
    pub(super) fn new(search: &Search<'a>) -> Result<Self, FitError> {
        let (search, free) = told(search)?;
        let starts = search.promising_starts(&free);
        Self::least_of_rivals(&search, &free, &starts)?.refined(&search, &free)
    }

    /// As [`Settled::new`], from these values, if there are any.
    pub(super) fn near_starts(search: &Search<'a>, starts: &[Values]) -> Result<Self, FitError> {
        if starts.is_empty() {
            return Self::new(search);
        }
        let (search, free) = told(search)?;
        Self::least_of(&search, &free, starts)?.refined(&search, &free)
    }

    /// With lower minima nearby, on the other side of kinks, looked for.
    fn refined(mut self, search: &Search<'a>, free: &[Parameter]) -> Result<Self, FitError> {
        for _ in 0..MOST_REFINEMENTS {
            let starts = self.lower_starts(search, free);
            let Some(first) = starts.first() else { break };
            let is_lower = |found: &Self| found.rank() < self.rank();
            let lower = Self::least_of(search, free, &starts).ok().filter(is_lower);
            let lower = lower.or_else(|| Self::at_kink(search, free, first).filter(is_lower));
            let Some(mut lower) = lower else { break };
            lower.others.push((self.minimum.values, self.objective));
            lower.others.append(&mut self.others);
            self = lower;
        }
        Ok(self)
    }

    /// The minimum at a kink near some values, if all is determined there.
    fn at_kink(search: &Search<'a>, free: &[Parameter], near: &Values) -> Option<Self> {
        // with more unknowns than the coefficients kinks lie across all of them
        if !free.iter().all(|p| Parameter::COEFFICIENTS.contains(p)) {
            return None;
        }
        let (minimum, estimated) = search.at_kink(free, near, REACH)?;
        if !minimum.determines_all() {
            return None;
        }
        let ties = minimum.ties(false);
        let silent = search.untold.clone();
        Some(Self {
            identifiability: identifiability::identify(&minimum.jacobian, &ties, free, &minimum.x, silent),
            objective: search.objective(&minimum, &estimated),
            search: search.clone(),
            free: free.to_vec(),
            plateaus: Vec::new(),
            others: Vec::new(),
            minimum,
            estimated,
        })
    }

    /// The least of the minima that searches from these values lead to.
    pub(super) fn from_starts(search: &Search<'a>, starts: &[Values]) -> Result<Self, FitError> {
        let (search, free) = told(search)?;
        Self::least_of(&search, &free, starts)
    }

    /// Where a search begins whose shots are computed a little differently, or are frames from which these velocities were
    /// extracted: at the minimum first and at others that may become the least, a parameter on a plateau also below it.
    pub(super) fn starts_nearby(&self) -> Vec<Values> {
        /// Of the value at which the plateau begins: where the shots that stick last still slide.
        const BELOW: f64 = 0.9;
        let best = self.minimum.values;
        let mut starts = vec![best];
        for Plateau { parameter, edge, bound } in &self.plateaus {
            if bound > edge {
                starts.push(best.with(*parameter, BELOW * edge));
            }
        }
        let near = |(_, objective): &&(Values, f64)| *objective <= self.objective + MARGIN * self.scale();
        for (values, _) in self.others.iter().filter(near) {
            if starts.iter().all(|known| differs(known, values)) {
                starts.push(*values);
            }
        }
        starts
    }

    /// The standard error of a parameter as the curvature has it, of noise as it is; 0 where there is none.
    pub(super) fn error_of(&self, parameter: Parameter) -> f64 {
        let Some(column) = self.free.iter().position(|p| *p == parameter) else { return 0.0 };
        let columns: Vec<usize> = (0..self.minimum.jacobian.ncols()).collect();
        let covariance = uncertainty::covariance(&self.minimum.jacobian, &columns, &self.minimum.ties(false));
        covariance.map_or(0.0, |c| (c[(column, column)] * self.scale()).sqrt())
    }

    /// Other minima that a 95 % confidence region would reach, and how much higher what is minimised is there.
    pub(super) fn rivals(&self) -> Vec<(Values, f64)> {
        /// The 95 % quantile of χ² with one degree of freedom.
        const REGION: f64 = 3.84;
        let higher = |objective: f64| objective - self.objective;
        let above = self.others.iter().map(|(values, objective)| match higher(*objective) {
            rounding if rounding.abs() < self.same() => (*values, 0.0),
            higher => (*values, higher),
        });
        above.filter(|(_, higher)| (0.0..REGION * self.scale()).contains(higher)).collect()
    }

    /// χ²/dof where that is above 1.
    pub(super) fn scale(&self) -> f64 {
        let dof = observations(self.search.fitted).saturating_sub(self.minimum.room()).max(1);
        (2.0 * self.minimum.cost / dof as f64).max(1.0)
    }

    /// The least of the minima found from screened starts, the least first: from those that others may end below, if
    /// frames are fitted from all.
    fn least_of_rivals(
        search: &Search<'a>,
        free: &[Parameter],
        starts: &[(Values, f64)],
    ) -> Result<Self, FitError> {
        let least = starts.first().map_or(0.0, |(_, objective)| *objective);
        let mut found: Option<Self> = None;
        let mut others = Vec::new();
        let mut error = None;
        for (start, objective) in starts {
            let margin = RIVAL * found.as_ref().map_or(1.0, Self::scale);
            if found.is_some() && *objective > least + margin {
                others.push((*start, *objective));
                continue;
            }
            match Self::least_of(search, free, &[*start]) {
                Ok(settled) => match &found {
                    Some(best) if !settled.precedes(best) => {
                        others.push((settled.minimum.values, settled.objective));
                    }
                    _ => {
                        let before = found.replace(settled);
                        others.extend(before.map(|before| (before.minimum.values, before.objective)));
                    }
                },
                Err(failed) => error = error.or(Some(failed)),
            }
        }
        found.map(|best| Self { others, ..best }).ok_or(error.unwrap_or(FitError::NoWeights))
    }

    /// The least first, and those that did not converge last.
    fn rank(&self) -> (bool, f64) {
        (!self.minimum.converged, self.objective)
    }

    /// Whether this is the minimum to be taken of two: the lower one, and of two that are as low, as where a contact that gives
    /// way throws as far at a small μ as at a large one, that of the lesser friction.
    fn precedes(&self, other: &Self) -> bool {
        let ((failed, objective), (other_failed, others)) = (self.rank(), other.rank());
        match failed == other_failed {
            false => other_failed,
            true if (objective - others).abs() < self.same() => {
                self.minimum.values[Parameter::Mu] < other.minimum.values[Parameter::Mu]
            }
            true => objective < others,
        }
    }

    /// By how much what is minimised may differ between minima that are as low. Where as many numbers as unknowns are met exactly
    /// it is all rounding.
    fn same(&self) -> f64 {
        let is_exact = observations(self.search.fitted) <= self.minimum.room();
        if is_exact { RIVAL } else { LOWER * self.scale() }
    }

    /// The least of the minima found from some starts. One that did not converge stands behind those that did; an error
    /// is one only if all fail.
    fn least_of(search: &Search<'a>, free: &[Parameter], starts: &[Values]) -> Result<Self, FitError> {
        let mut found: Vec<Self> = Vec::new();
        let mut error = None;
        for start in starts {
            let mut initial = search.initial;
            for parameter in free {
                initial[*parameter] = start[*parameter];
            }
            match Self::near(&Search { initial, ..search.clone() }, free.to_vec()) {
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
        let others: Vec<(Values, f64)> =
            found.iter().skip(1).map(|other| (other.minimum.values, other.objective)).collect();
        let best = found.into_iter().next();
        best.map(|best| Self { others, ..best }).ok_or(error.unwrap_or(FitError::NoWeights))
    }

    /// The minimum near the initial values of a search.
    fn near(search: &Search<'a>, mut free: Vec<Parameter>) -> Result<Self, FitError> {
        let mut search = search.clone();
        let silent = search.untold.clone();
        let mut identifiability = None;
        let mut plateaus: Vec<Plateau> = Vec::new();
        loop {
            let (minimum, estimated) = search.converge(&free)?;
            let ties = minimum.ties(false);
            let identify =
                || identifiability::identify(&minimum.jacobian, &ties, &free, &minimum.x, silent.clone());
            let Some(null) = minimum.undetermined() else {
                identifiability = identifiability.or_else(identify);
                for plateau in &mut plateaus {
                    if let Some(anew) = search.plateau(plateau.parameter, &minimum) {
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
            // what the data do not tell is left where the search ended, or well inside its plateau, where the weights are
            // those of one side, and the rest fitted again
            let lost: Vec<Parameter> =
                null.iter().filter_map(|(column, _)| free.get(*column).copied()).collect();
            for parameter in &lost {
                search.initial[*parameter] = minimum.values[*parameter];
            }
            match lost[..] {
                [parameter] => match search.plateau(parameter, &minimum) {
                    Some(plateau) => {
                        search.initial[parameter] = 0.5 * (plateau.edge + plateau.bound);
                        plateaus.push(plateau);
                    }
                    // nothing depends on it anywhere
                    None => search.initial[parameter] = search.settings[parameter].initial,
                },
                _ => identifiability = identify(),
            }
            search.untold.extend(&lost);
            free.retain(|p| !lost.contains(p));
        }
    }
}

/// The search with what no observation depends on held at its initial value, and what is left free.
pub(super) fn told<'a>(search: &Search<'a>) -> Result<(Search<'a>, Vec<Parameter>), FitError> {
    let mut search = search.clone();
    let settings = search.settings;
    search.untold = search.silent();
    for parameter in &search.untold {
        search.initial[*parameter] = settings[*parameter].initial;
    }
    let is_free = |p: &Parameter| !settings[*p].fixed && !search.untold.contains(p);
    let free: Vec<Parameter> = settings.parameters().into_iter().filter(is_free).collect();
    let observations = observations(search.fitted);
    if observations + priors(settings, &free) < free.len() {
        return Err(FitError::TooFewObservations {
            dataset: String::new(),
            observations,
            parameters: free.iter().map(|p| p.name()).collect::<Vec<_>>().join(", "),
        });
    }
    Ok((search, free))
}

/// Whether the friction differs by more than neighbouring points of a scan do.
pub(super) fn differs(a: &Values, b: &Values) -> bool {
    [Parameter::Mu, Parameter::B, Parameter::C, Parameter::Kappa]
        .into_iter()
        .any(|p| (a[p] - b[p]).abs() > SAME * a[p].abs().max(b[p].abs()))
}

/// Numbers that are fitted, less the unknowns of each shot where its frames are.
pub(super) fn observations(fitted: &[Fitted]) -> usize {
    let of = |shot: &Fitted| match &shot.film {
        Some(film) => film.observations().saturating_sub(film.unknowns()),
        None => shot.plan.rows().len(),
    };
    fitted.iter().map(of).sum()
}

/// How many of the free parameters have a prior.
pub(super) fn priors(settings: &Settings, free: &[Parameter]) -> usize {
    free.iter().filter(|p| settings[**p].prior.is_some()).count()
}
