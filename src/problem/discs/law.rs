//! The law of friction that shots of discs share: several starts, a rigid contact and a compliant one.

use rayon::prelude::*;

use super::block::Freedom;
use super::impact::DiscImpact;
use super::measure::{ROUNDS, Reached, STEPS};
use super::motion::friction;
use super::quantities::Quantity;
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::problem::descent::descend;
use crate::problem::film::film_data::FilmError;
use crate::problem::findings::Finding;
use crate::problem::policy::Policy;
use crate::problem::problem::{Problem, State};
use crate::problem::solution::Solution;
use crate::problem::unknowns::{Id, Mode, Own, Shared, Unknown};

/// Rise of −2 log L at the ends of an interval of 95 %.
const RISE_95: f64 = 3.84;

/// Values of μ and κ between which descents begin. A stiffer contact is as good as rigid.
const MU_RANGE: [f64; 2] = [0.02, 2.0];
const MU_STEPS: usize = 24;
const KAPPAS: [f64; 8] = [0.15, 0.3, 0.6, 1.25, 2.0, 3.0, 4.5, 9.0];

/// Smallest κ of a compliant contact.
const LEAST_KAPPA: f64 = 0.1;

/// Descents, ln of the ratio of μ or κ between their starts, and square beyond which the residual of an
/// outlying shot counts no more.
const STARTS: usize = 4;
const APART: f64 = 0.4;
const MAX_SQUARE: f64 = 25.0;

/// Variance of J_t/J_n from shot to shot with which starts are compared.
const RATIO_VARIANCE: f64 = 4e-4;

/// χ² by which a start is less likely than the best at most.
const LESS_LIKELY: f64 = 60.0;

/// Shots that determine a compliance at least, twice its three unknowns: in 37 films each of 3, 5, 10 and
/// 17 of 20 shots of rigid pucks that scatter it was let in in 4, 2, 1 and 0.
const LEAST_SHOTS: usize = 6;

/// The shots that the law is fitted to.
pub(super) struct Shots<'a> {
    pub(crate) policy: &'a Policy,
    pub(crate) settings: Settings,
    /// The problem without a law.
    pub(crate) free: Reached,
    pub(crate) impacts: &'a [DiscImpact],
}

/// The likeliest fit, others that are nearly as likely, and what is to be said of the choice.
pub(super) struct Chosen {
    pub(crate) best: Reached,
    pub(crate) rivals: Vec<Rival>,
    pub(crate) finding: Option<Finding>,
}

impl Shots<'_> {
    /// Fits a rigid contact and a compliant one, as far as they are possible, each from several starts.
    pub(crate) fn choose_law(&self) -> Result<Chosen, FilmError> {
        let stated = self.settings.compliance == Compliance::Stated;
        let shots = self.free.own().len();
        let is_auto = self.settings.compliance == Compliance::Auto && shots >= LEAST_SHOTS;
        let mut fits = if stated { Vec::new() } else { self.fit_law(false, None)? };
        let of_rigid = fits.first().map_or(f64::INFINITY, |best| best.unlikely);
        let mut finding = None;
        if stated || is_auto {
            let compliant = self.fit_law(true, fits.first())?;
            let best = compliant.first().map(|best| (best.shared()[Id::Kappa], of_rigid - best.unlikely));
            // beyond the equations that define the parameters only if the shots show it
            if let Some((kappa, fall)) = best.filter(|(_, fall)| *fall > self.policy.cause) {
                finding = is_auto.then_some(Finding::Compliance { kappa, shots, fall, adopted: true });
                fits = compliant;
            }
        }
        let mut ranked = fits.into_iter();
        let best = ranked.next().ok_or(FilmError::NoStart)?;
        let rival = |other: Reached| Rival {
            mu: other.shared()[Id::Mu],
            kappa: other.shared()[Id::Kappa],
            rise: other.unlikely - best.unlikely,
        };
        let rivals = ranked.map(rival).filter(|rival| rival.rise < self.policy.cause).collect();
        Ok(Chosen { best, rivals, finding })
    }

    /// Descends from the most promising values of μ and κ, first with the spreads before the frames are seen
    /// or those of a rival, then with spreads of their own; returns each minimum once, the likeliest first.
    /// Returns an empty list if with the spreads of the rival χ² is not low enough to be likelier: if it is lower by Δ
    /// for n numbers, −2 log L with their own spread is lower by −n ln(1 − Δ/n).
    fn fit_law(&self, compliant: bool, rival: Option<&Reached>) -> Result<Vec<Reached>, FilmError> {
        let mut problem = self.with_law(compliant)?;
        if let Some(rival) = rival {
            problem.discs_mut().ok_or(FilmError::NoFilm)?.spreads.clone_from(&rival.block()?.spreads);
        }
        let from = |[mu, kappa]: [f64; 2]| {
            let start = problem.evaluate(self.start(&problem, mu, kappa)?);
            Ok(descend(&problem, start, &problem.free(), STEPS).end)
        };
        let starts = self.promising(&problem).into_iter().map(from).collect::<Result<Vec<_>, FilmError>>()?;
        let least = starts.iter().map(|start| start.cost).fold(f64::INFINITY, f64::min);
        let shots = self.free.own().len() as f64;
        let needed = -shots * f64::exp_m1(-self.policy.cause / shots);
        if rival.is_some_and(|rival| least > rival.descent.end.cost - needed) {
            return Ok(Vec::new());
        }
        let mut fits: Vec<Reached> = Vec::new();
        let is_new = |shared: &Shared, fits: &[Reached]| {
            let differs = |id: Id, fit: &Reached| (shared[id] / fit.shared()[id]).ln().abs() > 0.5 * APART;
            fits.iter().all(|fit| differs(Id::Mu, fit) || differs(Id::Kappa, fit))
        };
        for start in starts.into_iter().filter(|start| start.cost <= least + LESS_LIKELY) {
            let end = descend(&problem, start, &problem.free(), ROUNDS * STEPS).end;
            if end.cost.is_finite() && is_new(&end.state.shared, &fits) {
                let fit = Reached::settle(problem.clone(), end.state)?;
                if is_new(fit.shared(), &fits) {
                    fits.push(fit);
                }
            }
        }
        fits.sort_by(|a, b| a.unlikely.total_cmp(&b.unlikely));
        Ok(fits)
    }

    /// Returns the problem of all shots with a law in common.
    fn with_law(&self, compliant: bool) -> Result<Problem, FilmError> {
        let mut problem = self.free.problem.clone();
        problem.discs_mut().ok_or(FilmError::NoFilm)?.freedom = Freedom::Law;
        let Settings { falls, e_falls, compliance, .. } = self.settings;
        for (parameter, takes_part) in [
            (Parameter::Mu, true),
            (Parameter::E, true),
            (Parameter::B, falls),
            (Parameter::C, falls),
            (Parameter::Kappa, compliant),
            (Parameter::ESlope, e_falls),
        ] {
            let setting = self.settings[parameter];
            let unknown = problem.unknown_mut(Id::from(parameter));
            let mut is_fixed = setting.fixed;
            if parameter == Parameter::Kappa {
                unknown.bounds[0] = unknown.bounds[0].max(LEAST_KAPPA);
                is_fixed &= compliance != Compliance::Auto;
            }
            unknown.mode = if takes_part && !is_fixed { Mode::Free } else { Mode::Fixed };
            unknown.start = if takes_part { setting.initial } else { 0.0 };
        }
        Ok(problem)
    }

    /// Returns μ and κ from which the measured J_t/J_n are likely, the likeliest first.
    fn promising(&self, problem: &Problem) -> Vec<[f64; 2]> {
        let inertia = problem.discs().map_or(0.5, |block| block.discs.inertia);
        let names = self.free.names();
        // closing speed, slip and e; J_t/J_n and its variance, with that from shot to shot
        let of_impact = |impact: &DiscImpact| {
            let value = |quantity: Quantity| impact.get(quantity).map(|measured| measured.value);
            let of = [Quantity::ClosingSpeed, Quantity::SlipBefore, Quantity::Restitution];
            let [closing, slip, e] = of.map(value);
            let ratio = impact.get(Quantity::ImpulseRatio)?;
            Some(([closing?, slip?, e?], [ratio.value, ratio.sd?.powi(2) + RATIO_VARIANCE]))
        };
        let used = self.impacts.iter().filter(|impact| names.contains(&impact.name));
        let points: Vec<([f64; 3], [f64; 2])> = used.filter_map(of_impact).collect();
        let (mu, kappa) = (problem.unknown(Id::Mu), problem.unknown(Id::Kappa));
        let [low, high] = [mu.bounds[0].max(MU_RANGE[0]), mu.bounds[1].min(MU_RANGE[1])];
        let step = |i: usize| low * (high / low).powf(i as f64 / (MU_STEPS - 1) as f64);
        let is_within = |value: &f64| (kappa.bounds[0]..=kappa.bounds[1]).contains(value);
        let of_unknown = |unknown: &Unknown, grid: Vec<f64>| {
            if unknown.mode == Mode::Free { grid } else { vec![unknown.start] }
        };
        let frictions = of_unknown(mu, (0..MU_STEPS).map(step).collect());
        let kappas = of_unknown(kappa, KAPPAS.into_iter().filter(is_within).collect());
        let pairs: Vec<[f64; 2]> =
            kappas.iter().flat_map(|kappa| frictions.iter().map(|mu| [*mu, *kappa])).collect();
        let unlikely = |[mu, kappa]: &[f64; 2]| {
            let square = |(state, [ratio, variance]): &([f64; 3], [f64; 2])| {
                let law = friction(*state, [*mu, 0.0, 1.0, *kappa], inertia);
                law.map_or(MAX_SQUARE, |(law, _)| ((ratio - law).powi(2) / variance).min(MAX_SQUARE))
            };
            points.iter().map(square).sum::<f64>()
        };
        let mut ranked: Vec<(f64, [f64; 2])> = pairs.par_iter().map(|pair| (unlikely(pair), *pair)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let most = ranked.first().map_or(0.0, |best| best.0 + LESS_LIKELY);
        let mut starts: Vec<[f64; 2]> = Vec::new();
        for (_, at) in ranked.into_iter().filter(|(square, _)| *square <= most) {
            let is_apart = |start: &[f64; 2]| (0..2).any(|i| (at[i] / start[i]).ln().abs() > APART);
            if starts.len() < STARTS && starts.iter().all(is_apart) {
                starts.push(at);
            }
        }
        starts
    }

    /// Returns the state in which each shot has the outcome that was measured and the law is this one.
    fn start(&self, problem: &Problem, mu: f64, kappa: f64) -> Result<State, FilmError> {
        let block = problem.discs().ok_or(FilmError::NoFilm)?;
        let mut state = self.free.descent.end.state.clone();
        let outcome =
            |(i, own): (usize, &Own)| Some(block.outcome(i, own, self.free.shared())?.map(|value| value.re));
        let outcomes: Vec<Option<[f64; 2]>> = self.free.own().iter().enumerate().map(outcome).collect();
        for id in [Id::FallB, Id::FallC, Id::ESlope] {
            state.shared[id] = problem.unknown(id).start;
        }
        let all: Vec<f64> = outcomes.iter().flatten().map(|[e, _]| *e).collect();
        let e = problem.unknown(Id::E);
        let mean = all.iter().sum::<f64>() / all.len() as f64;
        let mean = mean.clamp(e.bounds[0] + 1e-3, e.bounds[1] - 1e-3);
        state.shared[Id::E] = if e.mode == Mode::Free { mean } else { e.start };
        (state.shared[Id::Mu], state.shared[Id::Kappa]) = (mu, kappa);
        for (i, (own, outcome)) in state.own[0].iter_mut().zip(outcomes).enumerate() {
            if let Some(outcome) = outcome {
                block.set_outcome(i, own, &state.shared, outcome);
            }
        }
        Ok(state)
    }
}

impl Solution {
    /// Returns J_t/J_n on the second of two discs of a fit of discs that close and slip with these
    /// velocities, m/s.
    pub(crate) fn impulse_ratio(&self, [closing, slip]: [f64; 2]) -> Option<f64> {
        let inertia = self.problem.discs()?.discs.inertia;
        let e = self.value(Id::E) - self.value(Id::ESlope) * closing;
        let of_law = [Id::Mu, Id::FallB, Id::FallC, Id::Kappa].map(|id| self.value(id));
        friction([closing, slip, e], of_law, inertia).map(|(ratio, _)| ratio)
    }
}

/// Another minimum that is nearly as likely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rival {
    /// Friction between the discs there.
    pub(crate) mu: f64,
    /// Tangential compliance there.
    pub(crate) kappa: f64,
    /// Difference of −2 log L from that of the best minimum.
    pub(crate) rise: f64,
}

impl Rival {
    /// Returns whether it is as likely as the values of an interval of 95 %.
    #[must_use]
    pub(crate) fn is_within_95(&self) -> bool {
        self.rise < RISE_95
    }
}
