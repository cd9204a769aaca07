//! Where the least minimum is looked for. Above some μ a shot's contact sticks and its outcome no longer follows μ, so that
//! χ² as a function of the friction has flat parts, kinks and several minima: a search that descends from one start sees
//! only the nearest. All values of the friction are therefore scanned first, with every other unknown roughly where χ² is
//! least, and the search descends from the local minima of the scan. It begins nowhere else: no result depends on the
//! initial values that a data set states.
//!
//! For a shot without topspin or draw sticking begins at μ = tan φ/(β_y(1 + e)); for the others it is found by bisection.

use super::samples::Search;
use super::search::Effort;
use super::settled::Settled;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::Plan;
use crate::likelihood::sample::{Sample, Unknown};
use crate::measurement::parameter::{Parameter, Setting};
use crate::measurement::values::Values;
use crate::numerics::least_squares::scan;
use crate::physics::collision::{Model, Regime};

/// What friction depends on, in the order of the axes of a scan.
const FRICTION: [Parameter; 4] = [Parameter::Kappa, Parameter::C, Parameter::B, Parameter::Mu];

/// Values of κ that are scanned: less hardly gives way, and the outcome changes evenly with its logarithm.
const LEAST_KAPPA: f64 = 0.3;

/// A smaller μ throws a ball by less than a hundredth of a degree: between it and the lower bound nothing is told apart.
const LEAST_FRICTION: f64 = 2e-4;

/// Values in every factor of ten, where one unknown is scanned, and where several are.
const PER_DECADE: f64 = 6.0;
const PER_DECADE_OF_SEVERAL: f64 = 2.0;

/// A contact that gives way throws as far at a small μ as at a large one: few shots then have minima on both sides of the largest
/// throw, and close to it close to each other.
const PER_DECADE_OF_FEW: f64 = 24.0;
const FEW: usize = 5;

/// Values that differ by less than this part are one.
pub(super) const SAME: f64 = 0.03;

/// So many shots, spread evenly, tell in which region the least minimum is.
const SCANNED_SHOTS: usize = 30;

/// So many local minima of the scan are descended from…
const MOST: usize = 5;
/// …if their objective is above the least of the scan by at most this (in units of χ²/dof where that is above 1): the
/// scan is rough, and takes some of the shots only.
pub(super) const MARGIN: f64 = 30.0;

/// The kinks of single shots no longer matter among so many.
const MOST_WITH_KINKS: usize = 500;

/// Lower minima are looked for within this part of μ to either side at most.
const WIDEST: f64 = 0.2;

/// An objective that is lower by less is the same: a thirtieth of a standard error.
pub(super) const LOWER: f64 = 1e-3;

/// Of starts after a short descent, those whose objective is within this of the least (in units of χ²/dof where that is
/// above 1) may still end lower than it.
pub(super) const RIVAL: f64 = 2.0;

/// Where a shot begins to stick is found to this part of μ.
const EDGE: f64 = 0.003;

/// The values of an unknown that are scanned: evenly spread in its logarithm between its bounds, the bounds themselves,
/// and `edges` where something sets in.
fn axis(setting: &Setting, least: f64, per_decade: f64, edges: &[f64]) -> Vec<f64> {
    let Setting { lower, upper, .. } = *setting;
    let from = lower.max(least);
    if from >= upper {
        return if lower < upper { vec![lower, upper] } else { vec![lower] };
    }
    let steps = ((upper / from).log10() * per_decade).ceil().max(1.0);
    let even = (0..steps as usize).map(|i| from * (upper / from).powf(i as f64 / steps));
    let mut inner: Vec<f64> = even.chain(edges.iter().copied()).collect();
    inner.sort_by(f64::total_cmp);
    let mut values = vec![lower];
    for value in inner.into_iter().filter(|value| *value < upper * (1.0 - SAME)) {
        if values.last().is_some_and(|last| value > last + SAME * value) {
            values.push(value);
        }
    }
    values.push(upper);
    values
}

/// The μ at which a shot begins to stick; `None` where it sticks, or slides, at both bounds, or nothing sets in there.
fn sticks_from(setting: &Setting, plan: &Plan, model: &Model, at: &Values) -> Option<f64> {
    // a contact that gives way goes over from sliding to sticking smoothly
    if model.kappa > 0.0 {
        return None;
    }
    let model = at.model(model);
    let sticks = |mu: f64| {
        let coefficients = at.with(Parameter::Mu, mu).coefficients;
        Some(plan.regime(&model, &coefficients).ok()? == Regime::Stick)
    };
    let (mut slides, mut stuck) = (setting.lower.max(LEAST_FRICTION), setting.upper);
    if slides >= stuck || sticks(slides)? || !sticks(stuck)? {
        return None;
    }
    let steps = ((stuck / slides).ln() / EDGE).log2().ceil().max(0.0);
    for _ in 0..steps as usize {
        let middle = (slides * stuck).sqrt();
        if sticks(middle)? { stuck = middle } else { slides = middle }
    }
    Some(stuck)
}

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

    /// Some of the shots, spread evenly, as many as a scan takes.
    fn thinned(&self) -> Vec<Vec<Fitted>> {
        let step = self.count().div_ceil(SCANNED_SHOTS).max(1);
        let some = |sample: &Sample| sample.fitted.iter().step_by(step).cloned().collect();
        self.samples.iter().map(some).collect()
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

    fn set_all(&self, values: &[Values], unknowns: &[Unknown], to: &[f64]) -> Vec<Values> {
        let set = |values: Vec<Values>, (unknown, to): (&Unknown, &f64)| self.set(&values, *unknown, *to);
        unknowns.iter().zip(to).fold(values.to_vec(), set)
    }

    /// A start after a short descent with all shots.
    fn screen(&self, free: &[Unknown], start: &[Values]) -> (Vec<Values>, f64) {
        let search = self.from(start);
        let Ok((minimum, groups)) = search.converge_with(free, Effort::SCREEN) else {
            return (start.to_vec(), f64::INFINITY);
        };
        let objective = search.objective(&minimum, &groups);
        (minimum.values, objective)
    }

    /// Starts after a short descent, the least first.
    fn screened(&self, free: &[Unknown], starts: &[Vec<Values>]) -> Vec<(Vec<Values>, f64)> {
        let mut found: Vec<(Vec<Values>, f64)> =
            starts.iter().map(|start| self.screen(free, start)).collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        found
    }

    /// The local minima on a grid of some of the free unknowns, the others roughly where χ² is least: values, cost and
    /// objective.
    fn minima_on(
        &self,
        free: &[Unknown],
        scanned: &[Unknown],
        axes: &[Vec<f64>],
    ) -> Vec<((Vec<Values>, f64), f64)> {
        let others: Vec<Unknown> = free.iter().copied().filter(|u| !scanned.contains(u)).collect();
        let initial = self.initial();
        scan(axes, |values| {
            let search = self.from(&self.set_all(&initial, scanned, values));
            let (minimum, groups) = search.converge_with(&others, Effort::ROUGH).ok()?;
            let objective = search.objective(&minimum, &groups);
            Some(((minimum.values, minimum.cost), objective))
        })
    }

    /// Whether there are few shots, all from states before the impact that are known exactly, as in a table of angles.
    fn is_few_exact(&self) -> bool {
        self.count() <= FEW && self.shots().all(|shot| !shot.plan.has_uncertain_inputs())
    }

    fn axis_of(&self, unknown: Unknown, of: usize) -> Vec<f64> {
        let setting = &self.setting(unknown);
        let own = || self.members(unknown).map(|i| &self.samples[i]);
        let gives_way = || own().all(|sample| sample.model.kappa > 0.0);
        match unknown.parameter {
            Parameter::Mu if of == 1 && gives_way() && self.is_few_exact() => {
                axis(setting, LEAST_FRICTION, PER_DECADE_OF_FEW, &[])
            }
            Parameter::Mu if of == 1 => {
                let edges: Vec<f64> = own()
                    .flat_map(|sample| sample.fitted.iter().map(move |shot| (sample, shot)))
                    .filter_map(|(sample, shot)| {
                        sticks_from(setting, &shot.plan, sample.model, &sample.initial)
                    })
                    .collect();
                axis(setting, LEAST_FRICTION, PER_DECADE, &edges)
            }
            Parameter::Kappa => axis(setting, LEAST_KAPPA, PER_DECADE_OF_SEVERAL, &[]),
            _ => axis(setting, LEAST_FRICTION, if of == 1 { PER_DECADE } else { PER_DECADE_OF_SEVERAL }, &[]),
        }
    }
}

impl Settled<'_> {
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
