//! Where the least minimum is looked for. Above some μ a shot's contact sticks and its outcome no longer follows μ, so that
//! χ² as a function of the friction has flat parts, kinks and several minima: a search that descends from one start sees
//! only the nearest. All values of the friction are therefore scanned first, with every other unknown roughly where χ² is
//! least, and the search descends from the local minima of the scan. It begins nowhere else: no result depends on the
//! initial values that a data set states.
//!
//! For a shot without topspin or draw sticking begins at μ = tan φ/(β_y(1 + e)); for the others it is found by bisection.

use super::search::{Effort, Search};
use super::settled::Settled;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::Plan;
use crate::likelihood::problem::are_filmed;
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
pub(crate) const RIVAL: f64 = 2.0;

/// Where a shot begins to stick is found to this part of μ.
const EDGE: f64 = 0.003;

/// The values of an unknown that are scanned: evenly spread in its logarithm between its bounds, the bounds themselves,
/// and `edges` where something sets in.
pub(crate) fn axis(setting: &Setting, least: f64, per_decade: f64, edges: &[f64]) -> Vec<f64> {
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

/// The axis of μ: its values, and where each shot begins to stick.
pub(crate) fn friction_axis<'a>(
    setting: &Setting,
    shots: impl Iterator<Item = (&'a Plan, &'a Model)>,
    at: &Values,
) -> Vec<f64> {
    let edges: Vec<f64> = shots.filter_map(|(plan, model)| sticks_from(setting, plan, model, at)).collect();
    axis(setting, LEAST_FRICTION, PER_DECADE, &edges)
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
pub(crate) fn promising<S>(minima: Vec<(S, f64)>, scale: f64) -> Vec<S> {
    let least = minima.first().map_or(f64::INFINITY, |(_, value)| *value);
    let near = minima.into_iter().filter(|(_, value)| *value <= least + MARGIN * scale.max(1.0));
    near.take(MOST).map(|(start, _)| start).collect()
}

/// Shots spread evenly among all, as many as a scan takes.
pub(crate) fn thinned(fitted: &[Fitted]) -> Vec<Fitted> {
    fitted.iter().step_by(fitted.len().div_ceil(SCANNED_SHOTS).max(1)).cloned().collect()
}

impl Search<'_> {
    /// Where the search for the least minimum begins, the most promising first, with what is minimised there; what is not
    /// free is at its initial value.
    pub(super) fn promising_starts(&self, free: &[Parameter]) -> Vec<(Values, f64)> {
        let scanned: Vec<Parameter> = FRICTION.into_iter().filter(|p| free.contains(p)).collect();
        if are_filmed(self.fitted) {
            // frames are too costly to be scanned: the velocities extracted from them say where the minima are
            let shots: Vec<Fitted> =
                self.fitted.iter().map(|shot| Fitted { film: None, ..shot.clone() }).collect();
            let settled = Settled::new(&Search { fitted: &shots, ..self.clone() });
            let starts = settled.map_or_else(|_| vec![self.initial], |settled| settled.starts_nearby());
            return starts.into_iter().map(|start| (start, 0.0)).collect();
        }
        if scanned.is_empty() {
            return vec![(self.initial, 0.0)];
        }
        let shots = thinned(self.fitted);
        let search = Search { fitted: &shots, ..self.clone() };
        let axes: Vec<Vec<f64>> = scanned.iter().map(|p| search.axis_of(*p, scanned.len())).collect();
        let minima = search.minima_on(free, &scanned, &axes);
        let rows: usize = shots.iter().map(|shot| shot.plan.rows().len()).sum();
        let scale = minima.first().map_or(1.0, |((_, cost), _)| 2.0 * cost / rows.max(1) as f64);
        let starts: Vec<Values> = promising(minima, scale).into_iter().map(|(values, _)| values).collect();
        match starts[..] {
            [] => vec![(self.initial, 0.0)],
            [only] => vec![(only, 0.0)],
            _ => self.screened(free, &starts),
        }
    }

    /// Starts after a short descent with all shots, the least first.
    fn screened(&self, free: &[Parameter], starts: &[Values]) -> Vec<(Values, f64)> {
        let screen = |start: &Values| {
            let search = Search { initial: *start, ..self.clone() };
            let Ok((minimum, groups)) = search.converge_with(free, Effort::SCREEN) else {
                return (*start, f64::INFINITY);
            };
            (minimum.values, search.objective(&minimum, &groups))
        };
        let mut found: Vec<(Values, f64)> = starts.iter().map(screen).collect();
        found.sort_by(|a, b| a.1.total_cmp(&b.1));
        found
    }

    /// The local minima on a grid of some of the free parameters, the others roughly where χ² is least: values, cost and
    /// objective.
    fn minima_on(
        &self,
        free: &[Parameter],
        scanned: &[Parameter],
        axes: &[Vec<f64>],
    ) -> Vec<((Values, f64), f64)> {
        let others: Vec<Parameter> = free.iter().copied().filter(|p| !scanned.contains(p)).collect();
        scan(axes, |values| {
            let mut initial = self.initial;
            for (parameter, value) in scanned.iter().zip(values) {
                initial[*parameter] = *value;
            }
            let search = Search { initial, ..self.clone() };
            let (minimum, groups) = search.converge_with(&others, Effort::ROUGH).ok()?;
            let objective = search.objective(&minimum, &groups);
            Some(((minimum.values, minimum.cost), objective))
        })
    }

    /// Whether there are few shots, all from states before the impact that are known exactly, as in a table of angles.
    fn is_few_exact(&self) -> bool {
        self.fitted.len() <= FEW && self.fitted.iter().all(|shot| !shot.plan.has_uncertain_inputs())
    }

    fn axis_of(&self, parameter: Parameter, of: usize) -> Vec<f64> {
        let setting = &self.settings[parameter];
        match parameter {
            Parameter::Mu if of == 1 && self.model.kappa > 0.0 && self.is_few_exact() => {
                axis(setting, LEAST_FRICTION, PER_DECADE_OF_FEW, &[])
            }
            Parameter::Mu if of == 1 => {
                friction_axis(setting, self.fitted.iter().map(|shot| (&shot.plan, self.model)), &self.initial)
            }
            Parameter::Kappa => axis(setting, LEAST_KAPPA, PER_DECADE_OF_SEVERAL, &[]),
            _ => axis(setting, LEAST_FRICTION, if of == 1 { PER_DECADE } else { PER_DECADE_OF_SEVERAL }, &[]),
        }
    }
}

impl Settled<'_> {
    /// Where, near a minimum, there are lower ones on the other side of kinks: by a fine scan of μ.
    pub(super) fn lower_starts(&self, search: &Search, free: &[Parameter]) -> Vec<Values> {
        /// As far to either side, in standard errors, and in so many steps.
        const REACH: f64 = 4.0;
        const STEPS: usize = 12;
        if !free.contains(&Parameter::Mu)
            || are_filmed(search.fitted)
            || search.fitted.len() > MOST_WITH_KINKS
        {
            return Vec::new();
        }
        let mut at = self.minimum.values;
        let plateau = self.plateaus.iter().find(|plateau| plateau.parameter == Parameter::Mu);
        let reach = match plateau {
            Some(plateau) => {
                at[Parameter::Mu] = plateau.edge;
                WIDEST * plateau.edge
            }
            None => REACH * self.error_of(Parameter::Mu).min(WIDEST * at[Parameter::Mu] / REACH),
        };
        let setting = &search.settings[Parameter::Mu];
        let (lower, upper) =
            ((at[Parameter::Mu] - reach).max(setting.lower), (at[Parameter::Mu] + reach).min(setting.upper));
        // without a kink there is one minimum
        let around = Setting { lower, upper, ..*setting };
        let has_kink = |shot: &Fitted| sticks_from(&around, &shot.plan, search.model, &at).is_some();
        if !search.fitted.iter().any(has_kink) {
            return Vec::new();
        }
        let step = (upper - lower) / (2 * STEPS) as f64;
        let axis: Vec<f64> = (0..=2 * STEPS).map(|i| lower + i as f64 * step).collect();
        let search = Search { initial: at, ..search.clone() };
        // where μ is held estimated noise is smaller, so that what is seen is compared with the same at the minimum
        let here = search.minima_on(free, &[Parameter::Mu], &[vec![at[Parameter::Mu]]]);
        let Some((_, here)) = here.first() else { return Vec::new() };
        let minima = search.minima_on(free, &[Parameter::Mu], &[axis]);
        let lower = minima.into_iter().filter(|(_, objective)| *objective < here - LOWER);
        lower.take(MOST).map(|((values, _), _)| values).collect()
    }
}
