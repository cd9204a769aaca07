//! The fit of films of discs from beginning to end: what was measured of each shot whatever the law of
//! friction, then the law that all shots share.

use std::sync::Arc;

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::block::{Component, DiscBlock};
use super::first_guess::DiscFilm;
use super::frames::NOISES;
use super::motion::law_of;
use super::own;
use super::quantities::{DiscImpact, variance};
use super::stick::Stuck;
use crate::extraction::disc::Quantity;
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::problem::block::Block;
use crate::problem::descent::{Descent, descend};
use crate::problem::film::film_data::FilmError;
use crate::problem::film::outliers::outlying;
use crate::problem::findings::Finding;
use crate::problem::minimise::descend_with_noise;
use crate::problem::policy::Policy;
use crate::problem::problem::{Evaluation, Problem, State};
use crate::problem::solution::Solution;
use crate::problem::sums::OwnPrior;
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Id, Mode, Own, Shared, Unknown};

/// Frames of each point on either side of the impact that are used, one number after the other: paths
/// are followed from the impact on to a rail or a hand.
const REACHES: [usize; 3] = [15, 30, 60];

/// Steps of a descent with each of them.
const STEPS: usize = 10;

/// Frames about the impact that are left out, and those that are if the discs still touch in them.
const TOUCHING: usize = 1;
const MAX_TOUCHING: usize = 6;

/// Part of the distance of the centres by which the frames of a collision are off the paths at most.
const HOPELESS: f64 = 0.02;

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

/// χ² by which a start is less likely than the best at most.
const LESS_LIKELY: f64 = 60.0;

/// Shots that determine a compliance at least: it has three unknowns, and scatter.
const LEAST_SHOTS: usize = 3;

/// Rounds of leaving out shots, and of priors that the frames contradict.
const ROUNDS: usize = 3;

/// Rise of −2 log L at the ends of an interval of 95 %.
const RISE_95: f64 = 3.84;

/// Degrees of freedom of a normal distribution.
const NORMAL: f64 = 1e6;

/// Another minimum that is nearly as likely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rival {
    /// Friction between the discs there.
    pub mu: f64,
    /// Tangential compliance there.
    pub kappa: f64,
    /// By how much −2 log L is higher.
    pub rise: f64,
}

/// How much a quantity differs from shot to shot beyond the noise of the frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// The quantity.
    pub component: Component,
    /// Standard deviation.
    pub sd: f64,
    /// Fall of −2 log L with it; `None` of the outcome, which is never without.
    pub fall: Option<f64>,
}

/// The fit of films of discs.
#[derive(Clone)]
pub struct DiscFit {
    /// The minimum. Its first sample is of the shots that determine the law.
    pub solution: Solution,
    /// What was measured of each shot, whatever the law.
    pub impacts: Vec<DiscImpact>,
    /// What differs from shot to shot.
    pub scatter: Vec<Scatter>,
    /// Other minima that are nearly as likely.
    pub rivals: Vec<Rival>,
    /// Degrees of freedom of Student's t for intervals: scatter is known from these shots alone; of a
    /// single shot they are those of its frames.
    pub dof: f64,
}

impl DiscFit {
    /// Returns the interval of 95 % of an unknown, which holds that of each other minimum that is nearly
    /// as likely; `None` if it has no standard error.
    #[must_use]
    pub fn interval_95(&self, id: Id) -> Option<[f64; 2]> {
        let estimate = self.solution.get(id)?;
        let reach = StudentsT::new(0.0, 1.0, self.dof).ok()?.inverse_cdf(0.975) * estimate.std_error?;
        // what is positive is known to a factor
        let is_positive = matches!(id, Id::Mu | Id::Kappa);
        let ends = |value: f64| match is_positive {
            true => [-1.0, 1.0].map(|side| value * (side * reach / estimate.value).exp()),
            false => [value - reach, value + reach],
        };
        let near = self.rivals.iter().filter(|rival| rival.rise < RISE_95);
        let others = near.filter_map(|rival| match id {
            Id::Mu => Some(rival.mu),
            Id::Kappa => Some(rival.kappa),
            _ => None,
        });
        let all = others.chain([estimate.value]).map(ends);
        let hull = all.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])?;
        let [low, high] = self.solution.problem.unknown(id).bounds;
        Some([hull[0].max(low), hull[1].min(high)])
    }
}

/// Fits the films of discs of a data set.
///
/// # Errors
/// See [`FilmError`].
pub fn fit_discs(dataset: &Dataset, policy: &Policy) -> Result<DiscFit, FilmError> {
    let mut film = DiscFilm::new(dataset)?;
    let (measured, touching) = measure(&mut film, policy)?;
    let impacts = impacts(&film, &measured, &touching)?;
    let is_far = |impact: &DiscImpact| {
        let distance = impact.get(Quantity::ContactDistance).map_or(0.0, |distance| distance.value.abs());
        let sd = impact.position_sd[0].max(impact.position_sd[1]);
        distance > 0.0 && impact.get(Quantity::ImpulseRatio).is_some() && sd > HOPELESS * distance
    };
    let mut left_out = film.left_out.clone();
    for impact in &impacts {
        let why = match impact.stuck {
            Some(_) => "the discs stick together",
            None if is_far(impact) => "its motion fits no single collision",
            None => continue,
        };
        left_out.push((impact.name.clone(), why.to_owned()));
    }
    let is_usable: Vec<bool> =
        impacts.iter().map(|impact| impact.stuck.is_none() && !is_far(impact)).collect();
    if !is_usable.contains(&true) {
        return Err(FilmError::NoImpact(left_out));
    }
    let mut run = Run {
        policy,
        settings: dataset.settings,
        free: measured,
        names: film.names.clone(),
        findings: Vec::new(),
        evaluations: 0,
    };
    run.keep(&is_usable);
    run.fit(&film, impacts, left_out)
}

/// A problem and where a descent ended.
struct Reached {
    problem: Problem,
    descent: Descent,
    /// −2 log L with the own unknowns integrated.
    unlikely: f64,
}

impl Reached {
    fn new(problem: Problem, mut descent: Descent) -> Result<Self, FilmError> {
        // with the noise that the residuals have shown
        descent.end = problem.evaluate(descent.end.state);
        let unlikely = unlikely(&problem, &descent.end).ok_or(FilmError::Undetermined)?;
        Ok(Self { problem, descent, unlikely })
    }

    fn block(&self) -> Result<&DiscBlock, FilmError> {
        self.problem.discs().ok_or(FilmError::NoFilm)
    }

    fn shared(&self) -> &Shared {
        &self.descent.end.state.shared
    }

    fn own(&self) -> &[Own] {
        &self.descent.end.state.own[0]
    }
}

/// Returns −2 log L with the own unknowns integrated.
fn unlikely(problem: &Problem, at: &Evaluation) -> Option<f64> {
    let block = problem.discs()?;
    let reduced = at.eliminate(problem, 0.0)?;
    let mut sum = at.cost + reduced.own_ln_determinant;
    for i in 0..block.shots.len() {
        for (_, prior) in block.own_priors(i) {
            sum += prior.normal(&block.spreads).map_or(0.0, |normal| 2.0 * normal.sd.ln());
        }
    }
    let noises = at.noises(0);
    let of_noise = noises
        .iter()
        .zip(&block.noise)
        .map(|(sum, noise)| 2.0 * sum.count * noise.sd.ln() + sum.ln_determinant);
    Some(sum + of_noise.sum::<f64>())
}

/// Finds the outcome of each shot whatever the law; returns the number of frames, too, in which the
/// discs of each shot touch.
fn measure(film: &mut DiscFilm, policy: &Policy) -> Result<(Reached, Vec<usize>), FilmError> {
    let mut unknowns = film.unknowns.clone();
    for id in [Id::Mu, Id::E, Id::FallB, Id::FallC, Id::Kappa, Id::ESlope] {
        unknowns[id as usize].mode = Mode::Fixed;
    }
    unknowns[Id::Kappa as usize].start = 0.0;
    let shared = Shared(unknowns.iter().map(|unknown| unknown.start).collect());
    let mut state = State { own: vec![film.own.clone()], shared };
    let mut problem = Problem::of_one(Block::Discs(film.block.clone()), unknowns);
    let free = problem.free();
    let mut touching = vec![TOUCHING; film.names.len()];
    for reach in REACHES {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        choose_frames(block, &state, reach, &touching);
        // frames beyond those that were fitted may be off the path
        if reach > REACHES[0] {
            drop_frames(block, &state, policy);
        }
        let descent = descend(&problem, problem.evaluate(state), &free, STEPS);
        state = descent.end.state;
    }
    state = descend_with_noise(&mut problem, state).end.state;
    for _ in 0..MAX_TOUCHING {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        let touch = find_touching(block, &state, &mut touching, policy);
        let dropped = drop_frames(block, &state, policy);
        if !touch && dropped == 0 {
            break;
        }
        choose_frames(block, &state, REACHES[REACHES.len() - 1], &touching);
        state = descend(&problem, problem.evaluate(state), &free, STEPS).end.state;
    }
    let descent = descend_with_noise(&mut problem, state);
    Ok((Reached::new(problem, descent)?, touching))
}

fn choose_frames(block: &mut DiscBlock, state: &State, reach: usize, touching: &[usize]) {
    for ((shot, own), touching) in Arc::make_mut(&mut block.shots).iter_mut().zip(&state.own[0]).zip(touching)
    {
        shot.choose_frames(own[own::TIME], reach, *touching as f64);
    }
}

/// Drops frames that stand out, and those at the ends of tracks from where on a point is not on its path
/// any more; returns how many.
fn drop_frames(block: &mut DiscBlock, state: &State, policy: &Policy) -> usize {
    let mut count = 0;
    let shared = &state.shared;
    for (i, own) in state.own[0].iter().enumerate() {
        let noise = &block.noise[NOISES * i..NOISES * (i + 1)];
        let found = block.shots[i].residuals(own, shared, &block.discs, noise);
        let shots = Arc::make_mut(&mut block.shots);
        for (track, frames) in shots[i].tracks.iter_mut().zip(found) {
            let outlying = outlying(&frames, own[own::TIME], policy);
            count += outlying.len();
            let used = frames.iter().map(|frame| frame.index);
            let good: Vec<usize> = used.filter(|index| !outlying.contains(index)).collect();
            // what is beyond an end is no more on the path
            let is_cut = [frames.first(), frames.last()]
                .map(|end| end.is_some_and(|end| outlying.contains(&end.index)));
            let [first, last] = [good.first(), good.last()].map(|end| end.copied().unwrap_or(0));
            let mut index = 0;
            track.frames.retain(|_| {
                let is_beyond = is_cut[0] && index < first || is_cut[1] && index > last;
                let keep = !is_beyond && !outlying.contains(&index);
                index += 1;
                keep
            });
        }
    }
    count
}

/// Counts one frame more as touching on either side of the impacts next to which frames are off the
/// paths; returns whether there are any.
fn find_touching(block: &DiscBlock, state: &State, touching: &mut [usize], policy: &Policy) -> bool {
    let mut changed = false;
    for (i, own) in state.own[0].iter().enumerate().filter(|(i, _)| block.shots[*i].settling.is_none()) {
        let shot = &block.shots[i];
        let noise = &block.noise[NOISES * i..NOISES * (i + 1)];
        let reach = (touching[i] as f64 + 1.0) / shot.fps;
        let residuals = shot.residuals(own, &state.shared, &block.discs, noise);
        let near = residuals.iter().flatten().filter(|frame| (frame.time - own[own::TIME]).abs() <= reach);
        let squares: Vec<f64> = near.map(|frame| frame.square).collect();
        let tail =
            ChiSquared::new(2.0 * squares.len() as f64).map_or(1.0, |chi2| chi2.sf(squares.iter().sum()));
        if tail < policy.frame_tail && touching[i] < MAX_TOUCHING {
            touching[i] += 1;
            changed = true;
        }
    }
    changed
}

/// Returns the table of what was measured.
fn impacts(film: &DiscFilm, measured: &Reached, touching: &[usize]) -> Result<Vec<DiscImpact>, FilmError> {
    let Reached { problem, descent, .. } = measured;
    let at = &descent.end;
    let block = measured.block()?;
    let reduced = at.eliminate(problem, 0.0).ok_or(FilmError::Undetermined)?;
    let estimates = Estimates::of_reduced(problem, &at.state, &reduced).ok_or(FilmError::Undetermined)?;
    let of_shot = |i: usize| {
        let (shot, own) = (&block.shots[i], &at.state.own[0][i]);
        let paths = shot.follow(own, &at.state.shared, &block.discs)?;
        let known = shot.known(&paths.impact, &block.discs);
        let variance = |by: &_| variance((&reduced, &estimates), problem, (i, &at.shots[0][i].held), by);
        let stuck: Option<Stuck> = film.stuck[i];
        let noise = &block.noise[NOISES * i..NOISES * (i + 1)];
        let ratios = noise.iter().map(|noise| (noise.sd / film.position_sd[i]).powi(2));
        let used = |disc: usize, side: bool| {
            let frames =
                shot.tracks.iter().filter(move |track| track.disc == disc).flat_map(|track| &track.frames);
            frames
                .filter(move |frame| frame.used && (frame.time > own[own::TIME]) == side)
                .map(|frame| frame.time)
        };
        let count = |disc: usize, side: bool| {
            let mut times: Vec<f64> = used(disc, side).collect();
            times.sort_by(f64::total_cmp);
            times.dedup();
            times.len()
        };
        let all = || [(0, false), (0, true), (1, false), (1, true)];
        let times = || all().into_iter().flat_map(|(disc, side)| used(disc, side));
        Some(DiscImpact {
            name: film.names[i].clone(),
            values: known.values(stuck.as_ref(), variance),
            position_sd: [0, 1].map(|disc| noise[2 * disc].sd.hypot(noise[2 * disc + 1].sd) / 2.0_f64.sqrt()),
            misfit: ratios.fold(0.0, f64::max),
            frames: all().map(|(disc, side)| count(disc, side)),
            window: [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)],
            touching: touching[i],
            stuck,
        })
    };
    (0..block.shots.len()).map(of_shot).collect::<Option<Vec<_>>>().ok_or(FilmError::Undetermined)
}

struct Run<'a> {
    policy: &'a Policy,
    settings: Settings,
    /// The problem without a law.
    free: Reached,
    names: Vec<String>,
    findings: Vec<Finding>,
    evaluations: usize,
}

impl Run<'_> {
    /// Keeps the shots for which `keep` is true.
    fn keep(&mut self, keep: &[bool]) {
        let mut state = self.free.descent.end.state.clone();
        self.free.problem.retain(0, &mut state, keep);
        self.free.descent.end = self.free.problem.evaluate(state);
        let mut keep = keep.iter();
        self.names.retain(|_| keep.next().copied().unwrap_or(true));
    }

    /// Fits the law that all shots share, leaving out shots that do not follow it.
    fn fit(
        mut self,
        film: &DiscFilm,
        impacts: Vec<DiscImpact>,
        left_out: Vec<(String, String)>,
    ) -> Result<DiscFit, FilmError> {
        let (mut best, mut rivals) = self.choose_law(&impacts)?;
        for _ in 0..ROUNDS {
            let keep = self.judge_shots(&best)?;
            if keep.iter().all(|keep| *keep) {
                break;
            }
            let lost = self.names.iter().zip(&keep).filter(|(_, keep)| !**keep).map(|(name, _)| name.clone());
            let lost = lost.collect();
            self.findings.push(Finding::LostShots { names: lost });
            self.keep(&keep);
            (best, rivals) = self.choose_law(&impacts)?;
        }
        self.resolve_conflicts(&mut best)?;
        let Reached { problem, descent, unlikely } = best;
        let estimates = Estimates::new(&problem, &descent.end).ok_or(FilmError::Undetermined)?;
        self.find_undetermined(&problem, &descent.end.state.shared, &estimates);
        let scatter = self.scatter(&problem, &descent.end, unlikely);
        let block = problem.discs().ok_or(FilmError::NoFilm)?;
        let dof = if block.shots.len() > 1 { block.shots.len() as f64 - 1.0 } else { NORMAL };
        // if the shots determine no friction, any other is as likely
        rivals.retain(|_| estimates.sd(Id::Mu as usize).is_some());
        if !descent.converged {
            self.findings.push(Finding::NotConverged);
        }
        let misfit = impacts.iter().map(|impact| impact.misfit).fold(0.0, f64::max);
        let solution = Solution {
            unit: film.unit,
            middle: film.middle.into(),
            converged: descent.converged,
            at: descent.end,
            covariance: estimates,
            findings: self.findings,
            names: vec![self.names],
            left_out,
            misfit,
            evaluations: self.evaluations,
            problem,
        };
        Ok(DiscFit { solution, impacts, scatter, rivals, dof })
    }

    /// Fits a rigid contact and a compliant one, as far as they are possible, each from several starts;
    /// returns the likeliest fit and the others that are nearly as likely.
    fn choose_law(&mut self, impacts: &[DiscImpact]) -> Result<(Reached, Vec<Rival>), FilmError> {
        let Settings { compliance, .. } = self.settings;
        let mut fits = Vec::new();
        if compliance != Compliance::Stated {
            fits.extend(self.descend_from(false, impacts)?);
        }
        let rigid = fits.iter().map(|fit: &Reached| fit.unlikely).fold(f64::INFINITY, f64::min);
        let informative = self.names.len() >= LEAST_SHOTS;
        if compliance == Compliance::Stated || compliance == Compliance::Auto && informative {
            let compliant = self.descend_from(true, impacts)?;
            let least = compliant.iter().map(|fit| fit.unlikely).fold(f64::INFINITY, f64::min);
            // beyond the equations that define the parameters only if the shots show it
            if least < rigid - self.policy.cause {
                fits = compliant;
            }
        }
        fits.sort_by(|a, b| a.unlikely.total_cmp(&b.unlikely));
        let mut rivals: Vec<Rival> = Vec::new();
        let mut ranked = fits.into_iter();
        let best = ranked.next().ok_or(FilmError::NoStart)?;
        let place = |fit: &Reached| [fit.shared()[Id::Mu], fit.shared()[Id::Kappa]];
        let differs = |a: [f64; 2], b: [f64; 2]| (0..2).any(|i| (a[i] / b[i]).ln().abs() > 0.5 * APART);
        for other in ranked.filter(|other| other.unlikely < best.unlikely + self.policy.cause) {
            let at = place(&other);
            let is_new = rivals.iter().all(|known| differs(at, [known.mu, known.kappa]));
            if is_new && differs(at, place(&best)) {
                rivals.push(Rival { mu: at[0], kappa: at[1], rise: other.unlikely - best.unlikely });
            }
        }
        Ok((best, rivals))
    }

    /// Descends from the most promising values of μ and κ.
    fn descend_from(&mut self, compliant: bool, impacts: &[DiscImpact]) -> Result<Vec<Reached>, FilmError> {
        let problem = self.with_law(compliant)?;
        let kappa = problem.unknown(Id::Kappa);
        let kappas = match kappa.mode {
            Mode::Free => {
                KAPPAS.iter().copied().filter(|k| (kappa.bounds[0]..=kappa.bounds[1]).contains(k)).collect()
            }
            _ => vec![kappa.start],
        };
        let mut fits = Vec::new();
        for [mu, kappa] in self.promising(problem.unknown(Id::Mu), &kappas, impacts) {
            let mut problem = problem.clone();
            let state = self.start(&problem, mu, kappa)?;
            let descent = descend_with_noise(&mut problem, state);
            self.evaluations += descent.evaluations;
            if descent.end.cost.is_finite() {
                fits.push(Reached::new(problem, descent)?);
            }
        }
        Ok(fits)
    }

    /// Returns the problem of all shots with a law in common.
    fn with_law(&self, compliant: bool) -> Result<Problem, FilmError> {
        let mut problem = self.free.problem.clone();
        problem.discs_mut().ok_or(FilmError::NoFilm)?.is_free = false;
        let Settings { falls, e_falls, compliance, .. } = self.settings;
        let parameters = [
            (Id::Mu, Parameter::Mu),
            (Id::E, Parameter::E),
            (Id::FallB, Parameter::B),
            (Id::FallC, Parameter::C),
            (Id::Kappa, Parameter::Kappa),
            (Id::ESlope, Parameter::ESlope),
        ];
        for (id, parameter) in parameters {
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
    fn promising(&self, mu: &Unknown, kappas: &[f64], impacts: &[DiscImpact]) -> Vec<[f64; 2]> {
        struct Point {
            state: [f64; 3],
            ratio: f64,
            variance: f64,
        }
        let inertia = self.free.problem.discs().map_or(0.5, |block| block.discs.inertia);
        let of_impact = |impact: &DiscImpact| {
            let value = |quantity: Quantity| impact.get(quantity).map(|measured| measured.value);
            impact.get(Quantity::SlipBefore)?;
            let ratio = impact.get(Quantity::ImpulseRatio)?;
            Some(Point {
                state: [
                    value(Quantity::ClosingSpeed)?,
                    value(Quantity::SlipBefore)?,
                    value(Quantity::Restitution)?,
                ],
                ratio: ratio.value,
                variance: ratio.sd?.powi(2) + 4e-4,
            })
        };
        let used = impacts.iter().filter(|impact| self.names.contains(&impact.name));
        let points: Vec<Point> = used.filter_map(of_impact).collect();
        let [low, high] = [mu.bounds[0].max(MU_RANGE[0]), mu.bounds[1].min(MU_RANGE[1])];
        let frictions: Vec<f64> = match mu.mode {
            Mode::Free => {
                (0..MU_STEPS).map(|i| low * (high / low).powf(i as f64 / (MU_STEPS - 1) as f64)).collect()
            }
            _ => vec![mu.start],
        };
        let pairs: Vec<[f64; 2]> =
            kappas.iter().flat_map(|kappa| frictions.iter().map(|mu| [*mu, *kappa])).collect();
        let unlikely = |[mu, kappa]: &[f64; 2]| {
            let square = |point: &Point| {
                let law = law_of(point.state, *mu, *kappa, inertia)?;
                Some(((point.ratio - law).powi(2) / point.variance).min(MAX_SQUARE))
            };
            points.iter().map(|point| square(point).unwrap_or(MAX_SQUARE)).sum::<f64>()
        };
        let mut ranked: Vec<(f64, [f64; 2])> = pairs.par_iter().map(|pair| (unlikely(pair), *pair)).collect();
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let least = ranked.first().map_or(0.0, |best| best.0);
        ranked.retain(|(square, _)| *square <= least + LESS_LIKELY);
        let mut starts: Vec<[f64; 2]> = Vec::new();
        for (_, at) in ranked {
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
        let before = &self.free.descent.end.state;
        let outcomes: Vec<Option<[f64; 2]>> = self
            .free
            .own()
            .iter()
            .enumerate()
            .map(|(i, own)| block.outcome(i, own, &before.shared))
            .collect();
        let mut state = before.clone();
        for id in [Id::FallB, Id::FallC, Id::ESlope] {
            state.shared[id] = problem.unknown(id).start;
        }
        let e = problem.unknown(Id::E);
        let mean =
            outcomes.iter().flatten().map(|[e, _]| e).sum::<f64>() / outcomes.iter().flatten().count() as f64;
        state.shared[Id::E] =
            if e.mode == Mode::Free { mean.clamp(e.bounds[0] + 1e-3, e.bounds[1] - 1e-3) } else { e.start };
        (state.shared[Id::Mu], state.shared[Id::Kappa]) = (mu, kappa);
        let State { own, shared } = &mut state;
        for (i, (own, outcome)) in own[0].iter_mut().zip(outcomes).enumerate() {
            if let Some(outcome) = outcome {
                block.set_outcome(i, own, shared, outcome);
            }
        }
        Ok(state)
    }

    /// Returns whether each shot is kept: its e and J_t/J_n, momentum, spins and distance differ from
    /// those of the others by no more than chance makes them.
    fn judge_shots(&self, fit: &Reached) -> Result<Vec<bool>, FilmError> {
        let block = fit.block()?;
        let at = &fit.descent.end;
        let reduced = at.eliminate(&fit.problem, 0.0).ok_or(FilmError::Undetermined)?;
        let probability = |i: usize| {
            let own = &reduced.own[0][i].covariance;
            let squares = block.own_priors(i).into_iter().filter_map(|(place, prior)| {
                let OwnPrior::Spread(which) = prior else { return None };
                let sd = block.spreads[which].sd;
                let expected = sd * sd - own[(place, place)];
                // what the frames do not show says nothing
                (expected > 1e-3 * sd * sd).then(|| fit.own()[i][place].powi(2) / expected)
            });
            let squares: Vec<f64> = squares.collect();
            let largest = squares.iter().copied().fold(0.0, f64::max);
            squares.len() as f64 * ChiSquared::new(1.0).map_or(1.0, |chi2| chi2.sf(largest))
        };
        let keep: Vec<bool> =
            (0..block.shots.len()).map(|i| probability(i) > self.policy.shot_tail).collect();
        let lost = keep.iter().filter(|keep| !**keep).count();
        let too_many = lost as f64 > self.policy.max_lost * keep.len() as f64;
        Ok(if too_many { vec![true; keep.len()] } else { keep })
    }

    /// Leaves out priors that the frames contradict, the worst first.
    fn resolve_conflicts(&mut self, fit: &mut Reached) -> Result<(), FilmError> {
        for _ in 0..ROUNDS {
            let estimates = Estimates::new(&fit.problem, &fit.descent.end).ok_or(FilmError::Undetermined)?;
            let conflicts = estimates.conflicts(&fit.problem, &fit.descent.end);
            let worst = conflicts.into_iter().max_by(|a, b| a.size.abs().total_cmp(&b.size.abs()));
            let Some(worst) = worst.filter(|worst| worst.size.abs() > self.policy.conflict) else { break };
            let unknown = fit.problem.unknown_mut(worst.id);
            let stated = unknown.prior.take().map_or(unknown.start, |prior| prior.mean);
            self.findings.push(Finding::Conflict {
                id: worst.id,
                stated,
                estimate: worst.estimate,
                sd: worst.sd,
                size: worst.size,
            });
            let mut problem = fit.problem.clone();
            let descent = descend_with_noise(&mut problem, fit.descent.end.state.clone());
            self.evaluations += descent.evaluations;
            *fit = Reached::new(problem, descent)?;
        }
        Ok(())
    }

    fn find_undetermined(&mut self, problem: &Problem, shared: &Shared, estimates: &Estimates) {
        for id in [Id::Mu, Id::E, Id::Kappa] {
            let (unknown, value) = (problem.unknown(id), shared[id]);
            if unknown.mode != Mode::Free || estimates.sd(id as usize).is_some() {
                continue;
            }
            self.findings.push(if unknown.bounds.contains(&value) {
                Finding::AtBound { id, bound: value }
            } else {
                Finding::Undetermined { id, sd: f64::INFINITY }
            });
        }
    }

    /// Returns how much shots differ, and how much likelier that makes them.
    fn scatter(&mut self, problem: &Problem, at: &Evaluation, likeliest: f64) -> Vec<Scatter> {
        let spreads = problem.discs().map(|block| block.spreads.clone()).unwrap_or_default();
        let mut scatter = Vec::new();
        for (which, (component, spread)) in Component::ALL.into_iter().zip(spreads).enumerate() {
            let is_of_outcome = matches!(component, Component::Restitution | Component::Ratio);
            let mut without = problem.clone();
            let fall = match without.discs_mut() {
                _ if is_of_outcome => None,
                Some(block) if spread.sd > spread.least => {
                    block.spreads[which].sd = spread.least;
                    let from = without.evaluate(at.state.clone());
                    let descent = descend(&without, from, &without.free(), STEPS);
                    self.evaluations += descent.evaluations;
                    unlikely(&without, &descent.end).map(|unlikely| unlikely - likeliest)
                }
                _ => Some(0.0),
            };
            scatter.push(Scatter { component, sd: spread.sd, fall });
        }
        scatter
    }
}
