//! χ² over values of some unknowns, the others roughly where it is least: which values are looked at, and the minima among them.

use super::effort::Effort;
use super::samples::Search;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::Plan;
use crate::likelihood::sample::{Sample, Unknown};
use crate::measurement::parameter::{Parameter, Setting};
use crate::measurement::values::Values;
use crate::numerics::least_squares::scan;
use crate::physics::collision::{Model, Regime};

/// Values of κ that are scanned: less hardly gives way, and the outcome changes evenly with its logarithm.
const LEAST_KAPPA: f64 = 0.3;

/// Scanned in the place of a smaller lower bound: the stiffer the contact, the longer it takes to compute, as 1/√κ. A descent from here
/// goes on to the bound.
const STIFF_KAPPA: f64 = 0.03;

/// A smaller μ throws a ball by less than a hundredth of a degree: between it and the lower bound nothing is told apart.
const LEAST_FRICTION: f64 = 2e-4;

/// Values in every factor of ten, where one unknown is scanned or two are, and where more are. With two values, 40 impacts of κ = 1.26 ended
/// at κ = 7, of a χ² higher by 90. Where states before the impact are known exactly it is no cure:
/// there minima are narrower than either, and more values led a comparison of stun angles with κ = 2.5 to 4.6, where two are right.
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
pub(super) fn sticks_from(setting: &Setting, plan: &Plan, model: &Model, at: &Values) -> Option<f64> {
    // a contact that gives way goes over from sliding to sticking smoothly
    if model.kappa > 0.0 {
        return None;
    }
    let model = at.model(model);
    let sticks = |mu: f64| {
        let coefficients = at.with(Parameter::Mu, mu).coefficients();
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

fn has_uncertain_inputs(sample: &Sample) -> bool {
    sample.fitted.iter().any(|shot| shot.plan.has_uncertain_inputs())
}

impl Search<'_> {
    /// Some of the shots, spread evenly, as many as a scan takes.
    pub(super) fn thinned(&self) -> Vec<Vec<Fitted>> {
        let step = self.count().div_ceil(SCANNED_SHOTS).max(1);
        let some = |sample: &Sample| sample.fitted.iter().step_by(step).cloned().collect();
        self.samples.iter().map(some).collect()
    }

    pub(super) fn set_all(&self, values: &[Values], unknowns: &[Unknown], to: &[f64]) -> Vec<Values> {
        let set = |values: Vec<Values>, (unknown, to): (&Unknown, &f64)| self.set(&values, *unknown, *to);
        unknowns.iter().zip(to).fold(values.to_vec(), set)
    }

    /// A start after a short descent with all shots.
    pub(super) fn screen(&self, free: &[Unknown], start: &[Values]) -> (Vec<Values>, f64) {
        let search = self.from(start);
        let Ok((minimum, groups)) = search.converge_with(free, Effort::SCREEN) else {
            return (start.to_vec(), f64::INFINITY);
        };
        let objective = search.objective(&minimum, &groups);
        (minimum.values, objective)
    }

    /// Starts after a short descent, the least first.
    pub(super) fn screened(&self, free: &[Unknown], starts: &[Vec<Values>]) -> Vec<(Vec<Values>, f64)> {
        let mut found: Vec<(Vec<Values>, f64)> =
            starts.iter().map(|start| self.screen(free, start)).collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        found
    }

    /// The local minima on a grid of some of the free unknowns, the others roughly where χ² is least: values, cost and
    /// objective.
    pub(super) fn minima_on(
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

    pub(super) fn axis_of(&self, unknown: Unknown, of: usize) -> Vec<f64> {
        let setting = &self.setting(unknown);
        let own = || self.members(unknown).map(|i| &self.samples[i]);
        let gives_way = || own().all(|sample| sample.model.kappa > 0.0);
        let is_fine = of == 1 || of == 2 && own().any(has_uncertain_inputs);
        let per_decade = if is_fine { PER_DECADE } else { PER_DECADE_OF_SEVERAL };
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
            Parameter::Kappa => {
                let lower = setting.lower.max(STIFF_KAPPA).min(setting.upper);
                axis(&Setting { lower, ..*setting }, LEAST_KAPPA, per_decade, &[])
            }
            _ => axis(setting, LEAST_FRICTION, per_decade, &[]),
        }
    }
}
