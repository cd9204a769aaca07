//! Where the least minimum is looked for. Above some μ a shot's contact sticks and its outcome no longer follows μ, so that
//! χ² as a function of the friction has flat parts, kinks and several minima: a search that descends from one start sees
//! only the nearest. All values of the friction are therefore scanned first, with every other unknown roughly where χ² is
//! least, and the search descends from the local minima of the scan. It begins nowhere else: no result depends on the
//! initial values that a data set states.
//!
//! For a shot without topspin or draw sticking begins at μ = tan φ/(β_y(1 + e)); for the others it is found by bisection.

use super::FitError;
use super::samples::Search;
use super::scan::sticks_from;
use super::settled::{LOWER, MARGIN, RIVAL, Settled, identify, told};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::{Sample, Unknown};
use crate::measurement::parameter::{Parameter, Setting};
use crate::measurement::values::Values;

/// What friction depends on, in the order of the axes of a scan.
const FRICTION: [Parameter; 4] = [Parameter::Kappa, Parameter::C, Parameter::B, Parameter::Mu];

/// So many local minima of the scan are descended from at most.
const MOST: usize = 5;

/// The kinks of single shots no longer matter among so many.
const MOST_WITH_KINKS: usize = 500;

/// Lower minima are looked for within this part of μ to either side at most.
const WIDEST: f64 = 0.2;

/// A minimum between kinks may lie beside a lower one: so often the next one is looked for.
const MOST_REFINEMENTS: usize = 4;

/// And the minimum at a kink is this near to where it is seen, relative.
const REACH: f64 = 0.01;

/// Of local minima and their objective, the least first, those that the least minimum may belong to. `scale` is χ²/dof
/// where that is above 1.
fn promising<S>(minima: Vec<(S, f64)>, scale: f64) -> Vec<S> {
    let least = minima.first().map_or(f64::INFINITY, |(_, value)| *value);
    let near = minima.into_iter().filter(|(_, value)| *value <= least + MARGIN * scale.max(1.0));
    near.take(MOST).map(|(start, _)| start).collect()
}

impl Search<'_> {
    /// Where the search for the least minimum begins, the most promising first, with what is minimised there; what is not
    /// free is at its initial value.
    pub(super) fn promising_starts(&self, free: &[Unknown]) -> Vec<(Vec<Values>, f64)> {
        if self.is_filmed() {
            // frames are too costly to be scanned: the velocities extracted from them say where the minima are
            let plain = |shot: &Fitted| Fitted { film: None, ..shot.clone() };
            let shots: Vec<Vec<Fitted>> =
                self.samples.iter().map(|sample| sample.fitted.iter().map(plain).collect()).collect();
            let settled = Settled::new(&self.with_shots(&shots));
            let starts = settled.map_or_else(|_| vec![self.initial()], |settled| settled.starts_nearby());
            return starts.into_iter().map(|start| (start, 0.0)).collect();
        }
        let starts = match self.frictions(free).as_slice() {
            [] => Vec::new(),
            [(scanned, _)] => self.scanned(free, scanned),
            several => vec![self.fitted_apart(free, several)],
        };
        match starts.as_slice() {
            [] => vec![(self.initial(), 0.0)],
            [only] => vec![(only.clone(), 0.0)],
            _ => self.screened(free, &starts),
        }
    }

    /// The free unknowns of the friction, those of one sample together: with places of the samples that have the same.
    fn frictions(&self, free: &[Unknown]) -> Vec<(Vec<Unknown>, Vec<usize>)> {
        let mut groups: Vec<(Vec<Unknown>, Vec<usize>)> = Vec::new();
        for (i, sample) in self.samples.iter().enumerate() {
            let of = |p: Parameter| free.iter().copied().find(|u| u.parameter == p && sample.has(*u));
            let own: Vec<Unknown> = FRICTION.into_iter().filter_map(of).collect();
            match groups.iter_mut().find(|(known, _)| *known == own) {
                Some((_, members)) => members.push(i),
                None if own.is_empty() => {}
                None => groups.push((own, vec![i])),
            }
        }
        groups
    }

    /// The local minima of a scan, by some of the shots, that the least minimum may belong to.
    fn scanned(&self, free: &[Unknown], scanned: &[Unknown]) -> Vec<Vec<Values>> {
        let shots = self.thinned();
        let search = self.with_shots(&shots);
        let axes: Vec<Vec<f64>> = scanned.iter().map(|u| search.axis_of(*u, scanned.len())).collect();
        let minima = search.minima_on(free, scanned, &axes);
        let rows = search.samples.iter().map(Sample::rows).sum::<usize>().max(1);
        let scale = minima.first().map_or(1.0, |((_, cost), _)| 2.0 * cost / rows as f64);
        promising(minima, scale).into_iter().map(|(values, _)| values).collect()
    }

    /// Where samples do not have all of the friction in common: that of each group where some of its shots, fitted alone, put it, or
    /// at another minimum of theirs.
    fn fitted_apart(&self, free: &[Unknown], groups: &[(Vec<Unknown>, Vec<usize>)]) -> Vec<Values> {
        let mut best = self.initial();
        let mut others: Vec<(&[Unknown], Vec<f64>)> = Vec::new();
        for (friction, members) in groups {
            let samples = members.iter().map(|i| self.samples[*i].clone()).collect();
            let part = Self { samples, ..self.clone() };
            let shots = part.thinned();
            let part = part.with_shots(&shots);
            let Ok(settled) = Settled::new(&part) else { continue };
            let of =
                |values: Vec<Values>| friction.iter().map(|u| part.value(&values, *u)).collect::<Vec<f64>>();
            let mut starts = settled.starts_nearby().into_iter().map(of);
            if let Some(first) = starts.next() {
                best = self.set_all(&best, friction, &first);
            }
            others.extend(starts.map(|other| (friction.as_slice(), other)));
        }
        if others.is_empty() {
            return best;
        }
        let mut least = self.screen(free, &best).1;
        for (friction, values) in others {
            let other = self.set_all(&best, friction, &values);
            let objective = self.screen(free, &other).1;
            // of two that fit alike that of the group alone stays
            if objective < least - LOWER {
                (best, least) = (other, objective);
            }
        }
        best
    }
}

impl<'a> Settled<'a> {
    /// Fits all that is free and that the data tell: the least minimum of those that the search finds from wherever a scan
    /// of the friction says that it may be.
    pub(crate) fn new(search: &Search<'a>) -> Result<Self, FitError> {
        let (search, free) = told(search)?;
        let starts = search.promising_starts(&free);
        Self::least_of_rivals(&search, &free, &starts)?.refined(&search, &free)
    }

    /// As [`Settled::new`], from these values, if there are any.
    pub(crate) fn near_starts(search: &Search<'a>, starts: &[Vec<Values>]) -> Result<Self, FitError> {
        if starts.is_empty() {
            return Self::new(search);
        }
        let (search, free) = told(search)?;
        Self::least_of(&search, &free, starts)?.refined(&search, &free)
    }

    /// With lower minima nearby, on the other side of kinks, looked for.
    fn refined(mut self, search: &Search<'a>, free: &[Unknown]) -> Result<Self, FitError> {
        for _ in 0..MOST_REFINEMENTS {
            let frictions = free.iter().filter(|unknown| unknown.parameter == Parameter::Mu);
            let Some(mut lower) = frictions.copied().find_map(|mu| self.lower(search, (free, mu))) else {
                break;
            };
            lower.others.push((self.minimum.values, self.objective));
            lower.others.append(&mut self.others);
            self = lower;
        }
        Ok(self)
    }

    /// A lower minimum on the other side of kinks in one friction.
    fn lower(&self, search: &Search<'a>, (free, mu): (&[Unknown], Unknown)) -> Option<Self> {
        let starts = self.lower_starts(search, (free, mu));
        let first = starts.first()?;
        let is_lower = |found: &Self| found.rank() < self.rank();
        let lower = Self::least_of(search, free, &starts).ok().filter(is_lower);
        lower.or_else(|| Self::at_kink(search, (free, mu), first).filter(is_lower))
    }

    /// The minimum at a kink near some values, if all is determined there.
    fn at_kink(search: &Search<'a>, (free, mu): (&[Unknown], Unknown), near: &[Values]) -> Option<Self> {
        // with other unknowns of the contact kinks lie across all of them
        let is_smooth = |p: Parameter| Parameter::COEFFICIENTS.contains(&p) || p.is_of_balls();
        if !free.iter().all(|unknown| is_smooth(unknown.parameter)) {
            return None;
        }
        let (minimum, estimated) = search.at_kink((free, mu), near, REACH)?;
        if !minimum.determines_all() {
            return None;
        }
        Some(Self {
            identifiability: identify(search, free, &minimum),
            objective: search.objective(&minimum, &estimated),
            search: search.clone(),
            free: free.to_vec(),
            plateaus: Vec::new(),
            others: Vec::new(),
            minimum,
            estimated,
        })
    }

    /// The least of the minima found from screened starts, the least first: from those that others may end below, if
    /// frames are fitted from all.
    fn least_of_rivals(
        search: &Search<'a>,
        free: &[Unknown],
        starts: &[(Vec<Values>, f64)],
    ) -> Result<Self, FitError> {
        let least = starts.first().map_or(0.0, |(_, objective)| *objective);
        let mut found: Option<Self> = None;
        let mut others = Vec::new();
        let mut error = None;
        for (start, objective) in starts {
            let margin = RIVAL * found.as_ref().map_or(1.0, Self::scale);
            if found.is_some() && *objective > least + margin {
                others.push((start.clone(), *objective));
                continue;
            }
            match Self::least_of(search, free, std::slice::from_ref(start)) {
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

    /// Where, near a minimum, there are lower ones on the other side of kinks: by a fine scan of one μ.
    pub(super) fn lower_starts(
        &self,
        search: &Search,
        (free, mu): (&[Unknown], Unknown),
    ) -> Vec<Vec<Values>> {
        /// As far to either side, in standard errors, and in so many steps.
        const REACH: f64 = 4.0;
        const STEPS: usize = 12;
        if search.is_filmed() || search.count() > MOST_WITH_KINKS {
            return Vec::new();
        }
        let mut at = self.minimum.values.clone();
        let value = search.value(&at, mu);
        let plateau = self.plateaus.iter().find(|(unknown, _)| *unknown == mu);
        let (centre, reach) = match plateau {
            Some((_, plateau)) => (plateau.edge, WIDEST * plateau.edge),
            None => (value, REACH * self.error_of(mu).min(WIDEST * value / REACH)),
        };
        at = search.set(&at, mu, centre);
        let setting = search.setting(mu);
        let (lower, upper) = ((centre - reach).max(setting.lower), (centre + reach).min(setting.upper));
        // without a kink there is one minimum
        let around = Setting { lower, upper, ..setting };
        let has_kink = |i: usize| {
            let sample = &search.samples[i];
            sample.fitted.iter().any(|shot| sticks_from(&around, &shot.plan, sample.model, &at[i]).is_some())
        };
        if !search.members(mu).any(has_kink) {
            return Vec::new();
        }
        let step = (upper - lower) / (2 * STEPS) as f64;
        let axis: Vec<f64> = (0..=2 * STEPS).map(|i| lower + i as f64 * step).collect();
        let search = search.from(&at);
        // where μ is held estimated noise is smaller, so that what is seen is compared with the same at the minimum
        let here = search.minima_on(free, &[mu], &[vec![centre]]);
        let Some((_, here)) = here.first() else { return Vec::new() };
        let minima = search.minima_on(free, &[mu], &[axis]);
        let lower = minima.into_iter().filter(|(_, objective)| *objective < here - LOWER);
        lower.take(MOST).map(|((values, _), _)| values).collect()
    }
}
