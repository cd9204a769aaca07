//! The law of friction that shots of discs share.

use rayon::prelude::*;

use super::block::Freedom;
use super::impact::DiscImpact;
use super::measure::{ROUNDS, Reached, STEPS, settle};
use super::motion::law_of;
use super::quantities::Quantity;
use super::run::{Rival, Run};
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::problem::descent::{Descent, descend};
use crate::problem::film::film_data::FilmError;
use crate::problem::findings::Finding;
use crate::problem::problem::{Problem, State};
use crate::problem::unknowns::{Id, Mode, Own, Shared, Unknown};

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

impl Run<'_> {
    /// Fits a rigid contact and a compliant one, as far as they are possible, each from several starts;
    /// returns the likeliest fit and the others that are nearly as likely.
    pub(super) fn choose_law(&mut self, impacts: &[DiscImpact]) -> Result<(Reached, Vec<Rival>), FilmError> {
        let Settings { compliance, .. } = self.settings;
        let is_auto = compliance == Compliance::Auto && self.free.own().len() >= LEAST_SHOTS;
        let (mut rigid, mut compliant) = (Vec::new(), Vec::new());
        if compliance != Compliance::Stated {
            rigid = self.descend_from(false, impacts)?;
        }
        if compliance == Compliance::Stated || is_auto {
            compliant = self.descend_from(true, impacts)?;
        }
        let costs = rigid.iter().chain(&compliant).map(|(_, descent)| descent.end.cost);
        let most = costs.fold(f64::INFINITY, f64::min) + LESS_LIKELY;
        for starts in [&mut rigid, &mut compliant] {
            starts.retain(|(_, descent)| descent.end.cost <= most);
        }
        let mut fits = self.settle_all(rigid, None)?;
        let compliant = self.settle_all(compliant, fits.first())?;
        let of_rigid = fits.first().map_or(f64::INFINITY, |best| best.unlikely);
        // beyond the equations that define the parameters only if the shots show it
        if let Some(best) = compliant.first()
            && best.unlikely < of_rigid - self.policy.cause
        {
            let (kappa, fall) = (best.shared()[Id::Kappa], of_rigid - best.unlikely);
            let shots = self.free.own().len();
            self.findings.extend(is_auto.then_some(Finding::Compliance {
                kappa,
                shots,
                fall,
                adopted: true,
            }));
            fits = compliant;
        }
        let mut ranked = fits.into_iter();
        let best = ranked.next().ok_or(FilmError::NoStart)?;
        let rival = |other: Reached| Rival {
            mu: other.shared()[Id::Mu],
            kappa: other.shared()[Id::Kappa],
            rise: other.unlikely - best.unlikely,
        };
        let rivals = ranked.map(rival).filter(|rival| rival.rise < self.policy.cause).collect();
        Ok((best, rivals))
    }

    /// Descends from the most promising values of μ and κ with the spreads before the frames are seen.
    fn descend_from(
        &self,
        compliant: bool,
        impacts: &[DiscImpact],
    ) -> Result<Vec<(Problem, Descent)>, FilmError> {
        let problem = self.with_law(compliant)?;
        let descend = |[mu, kappa]: [f64; 2]| {
            let from = problem.evaluate(self.start(&problem, mu, kappa)?);
            Ok((problem.clone(), descend(&problem, from, &problem.free(), STEPS)))
        };
        self.promising(&problem, impacts).into_iter().map(descend).collect()
    }

    /// Descends to minima with spreads of their own, and returns each once, the likeliest first. Returns
    /// none if with the spreads of a rival χ² is not low enough to be likelier: if it is lower by Δ for n
    /// numbers, −2 log L with their own spread is lower by −n ln(1 − Δ/n).
    fn settle_all(
        &self,
        mut starts: Vec<(Problem, Descent)>,
        rival: Option<&Reached>,
    ) -> Result<Vec<Reached>, FilmError> {
        if let Some(rival) = rival {
            for (problem, descent) in &mut starts {
                let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
                block.spreads.clone_from(&rival.block()?.spreads);
                let from = problem.evaluate(descent.end.state.clone());
                *descent = descend(problem, from, &problem.free(), STEPS);
            }
            let shots = self.free.own().len() as f64;
            let needed = -shots * f64::exp_m1(-self.policy.cause / shots);
            let least = starts.iter().map(|start| start.1.end.cost).fold(f64::INFINITY, f64::min);
            if least > rival.descent.end.cost - needed {
                return Ok(Vec::new());
            }
        }
        let mut fits: Vec<Reached> = Vec::new();
        for (mut problem, mut descent) in starts {
            for _ in 0..ROUNDS {
                if !descent.converged {
                    descent = descend(&problem, descent.end, &problem.free(), STEPS);
                }
            }
            let is_new = |shared: &Shared, fits: &[Reached]| {
                let differs =
                    |id: Id, fit: &Reached| (shared[id] / fit.shared()[id]).ln().abs() > 0.5 * APART;
                fits.iter().all(|fit| differs(Id::Mu, fit) || differs(Id::Kappa, fit))
            };
            if descent.end.cost.is_finite() && is_new(&descent.end.state.shared, &fits) {
                let descent = settle(&mut problem, descent.end.state);
                let fit = Reached::new(problem, descent)?;
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
        let of_law = |parameter: &Parameter| !parameter.is_of_balls() && *parameter != Parameter::MuS;
        for parameter in Parameter::ALL.into_iter().filter(of_law) {
            let id = Id::from(parameter);
            let takes_part = match id {
                Id::FallB | Id::FallC => falls,
                Id::ESlope => e_falls,
                Id::Kappa => compliant,
                _ => true,
            };
            let is_fixed =
                self.settings[parameter].fixed && !(id == Id::Kappa && compliance == Compliance::Auto);
            let unknown = problem.unknown_mut(id);
            unknown.mode = if takes_part && !is_fixed { Mode::Free } else { Mode::Fixed };
            unknown.start = if takes_part { self.settings[parameter].initial } else { 0.0 };
            if id == Id::Kappa {
                unknown.bounds[0] = unknown.bounds[0].max(LEAST_KAPPA);
            }
        }
        Ok(problem)
    }

    /// Returns μ and κ from which the measured J_t/J_n are likely, the likeliest first.
    fn promising(&self, problem: &Problem, impacts: &[DiscImpact]) -> Vec<[f64; 2]> {
        let inertia = self.free.problem.discs().map_or(0.5, |block| block.discs.inertia);
        let names = self.free.names();
        // closing speed, slip and e; J_t/J_n and its variance, with that from shot to shot
        let of_impact = |impact: &DiscImpact| {
            let value = |quantity: Quantity| impact.get(quantity).map(|measured| measured.value);
            let of = [Quantity::ClosingSpeed, Quantity::SlipBefore, Quantity::Restitution];
            let [closing, slip, e] = of.map(value);
            let ratio = impact.get(Quantity::ImpulseRatio)?;
            Some(([closing?, slip?, e?], [ratio.value, ratio.sd?.powi(2) + RATIO_VARIANCE]))
        };
        let used = impacts.iter().filter(|impact| names.contains(&impact.name));
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
                let law = law_of(*state, *mu, *kappa, inertia)?;
                Some(((ratio - law).powi(2) / variance).min(MAX_SQUARE))
            };
            points.iter().map(|point| square(point).unwrap_or(MAX_SQUARE)).sum::<f64>()
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
        let outcome = |(i, own): (usize, &Own)| block.outcome(i, own, self.free.shared());
        let outcomes: Vec<Option<[f64; 2]>> = self.free.own().iter().enumerate().map(outcome).collect();
        for id in [Id::FallB, Id::FallC, Id::ESlope] {
            state.shared[id] = problem.unknown(id).start;
        }
        let (sum, count) = outcomes.iter().flatten().fold((0.0, 0.0), |(sum, n), [e, _]| (sum + e, n + 1.0));
        let e = problem.unknown(Id::E);
        let [low, high] = e.bounds;
        let mean = (sum / count).clamp(low + 1e-3, high - 1e-3);
        state.shared[Id::E] = if e.mode == Mode::Free { mean } else { e.start };
        (state.shared[Id::Mu], state.shared[Id::Kappa]) = (mu, kappa);
        let State { own, shared } = &mut state;
        for (i, (own, outcome)) in own[0].iter_mut().zip(outcomes).enumerate() {
            if let Some(outcome) = outcome {
                block.set_outcome(i, own, shared, outcome);
            }
        }
        Ok(state)
    }
}
