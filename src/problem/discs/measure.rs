//! What was measured of each shot of discs, whatever the law of friction.

use std::sync::Arc;

use super::block::{DiscBlock, Freedom};
use super::first_guess::DiscFilm;
use super::frames::{Centre, TOUCHING};
use super::impact::{DiscImpact, find_doubts};
use super::outcome::input_covariance;
use super::own;
use super::priors::LEAST_SHOTS;
use crate::measurement::dataset::Dataset;
use crate::problem::block::Block;
use crate::problem::descent::{Descent, descend};
use crate::problem::film::camera::Camera;
use crate::problem::film::film_data::FilmError;
use crate::problem::film::outliers::{outlying, tail};
use crate::problem::frames::{PicturePaths, Sight};
use crate::problem::minimise::descend_with_noise;
use crate::problem::policy::Policy;
use crate::problem::problem::{Evaluation, Problem, State};
use crate::problem::solution::Solution;
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Id, Mode, Own, Shared};

/// Steps of a descent with each of them.
pub(super) const STEPS: usize = 10;

/// Rounds of leaving out shots, and of priors that the frames contradict.
pub(super) const ROUNDS: usize = 3;

/// Frames of each point on either side of the impact that are used, one number after the other: paths
/// are followed from the impact on to a rail or a hand. The last one is for shots that are too few to
/// show how decelerations differ: in long paths they are less even.
const REACHES: [usize; 4] = [15, 30, 60, 120];

/// Smallest number of frames of each point on either side that decelerations which are not even leave.
const LEAST_REACH: usize = 7;

/// Frames about the impact that are left out if the discs still touch in them.
const MAX_TOUCHING: usize = 6;

/// A problem and where a descent ended.
pub(super) struct Reached {
    pub problem: Problem,
    pub descent: Descent,
    /// −2 log L with the own unknowns integrated.
    pub unlikely: f64,
}

impl Reached {
    pub fn new(problem: Problem, mut descent: Descent) -> Result<Self, FilmError> {
        // with the noise that the residuals have shown
        descent.end = problem.evaluate(descent.end.state);
        let unlikely = unlikely(&problem, &descent.end).ok_or(FilmError::Undetermined)?;
        Ok(Self { problem, descent, unlikely })
    }

    pub fn block(&self) -> Result<&DiscBlock, FilmError> {
        self.problem.discs().ok_or(FilmError::NoFilm)
    }

    pub fn names(&self) -> Vec<String> {
        let shots = self.problem.discs().map_or(&[][..], |block| &block.shots);
        shots.iter().map(|shot| shot.name.clone()).collect()
    }

    pub fn shared(&self) -> &Shared {
        &self.descent.end.state.shared
    }

    pub fn own(&self) -> &[Own] {
        &self.descent.end.state.own[0]
    }

    /// Returns what is known there, without findings.
    pub fn solution(self, film: &DiscFilm) -> Result<Solution, FilmError> {
        let names = vec![self.names()];
        let Self { problem, descent, .. } = self;
        let covariance = Estimates::new(&problem, &descent.end).ok_or(FilmError::Undetermined)?;
        Ok(Solution {
            unit: film.unit,
            middle: film.middle.into(),
            converged: descent.converged,
            at: descent.end,
            covariance,
            findings: Vec::new(),
            names,
            left_out: film.left_out.clone(),
            misfit: f64::NAN,
            evaluations: problem.count_evaluations(),
            problem,
        })
    }
}

/// Returns −2 log L with the own unknowns integrated.
fn unlikely(problem: &Problem, at: &Evaluation) -> Option<f64> {
    let block = problem.discs()?;
    let mut sum = at.cost + at.eliminate(problem, 0.0)?.own_ln_determinant;
    for (_, prior) in (0..block.shots.len()).flat_map(|i| block.own_priors(i)) {
        sum += prior.normal(&block.spreads).map_or(0.0, |normal| 2.0 * normal.sd.ln());
    }
    for (sums, noise) in at.noises(0).iter().zip(&block.noise) {
        sum += 2.0 * sums.count * noise.sd.ln() + sums.ln_determinant;
    }
    Some(sum)
}

/// What was measured of films of discs, whatever the law of friction.
pub struct MeasuredDiscs {
    /// The minimum: camera, decelerations, and the motion of the discs.
    pub solution: Solution,
    /// What was measured of each shot.
    pub impacts: Vec<DiscImpact>,
}

/// Measures the shots of the films of a data set: e, J_t/J_n, spins and balance of momentum of each may
/// be any.
///
/// # Errors
/// See [`FilmError`].
pub fn measure_discs(dataset: &Dataset, policy: &Policy) -> Result<MeasuredDiscs, FilmError> {
    let film = DiscFilm::new(dataset)?;
    let Reached { mut problem, mut descent, .. } = measure(&film, policy)?;
    problem.discs_mut().ok_or(FilmError::NoFilm)?.freedom = Freedom::Everything;
    loop {
        descent = settle(&mut problem, descent.end.state);
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        if !block.come_nearer(policy) {
            break;
        }
        block.choose_frames(&descent.end.state);
    }
    let measured = Reached::new(problem, descent)?;
    let mut left_out = film.left_out.clone();
    let mut impacts = impacts(&film, &measured, policy)?;
    impacts.retain(|impact| {
        let fault = impact.find_fault(&film.block.discs, policy);
        left_out.extend(fault.iter().map(|fault| (impact.name.clone(), fault.to_string())));
        fault.is_none()
    });
    if impacts.is_empty() {
        return Err(FilmError::NoImpact(left_out));
    }
    find_doubts(&mut impacts, policy);
    let solution = Solution { left_out, findings: film.findings.clone(), ..measured.solution(&film)? };
    Ok(MeasuredDiscs { solution, impacts })
}

/// Finds the outcome of each shot whatever the law, and which frames show it.
pub(super) fn measure(film: &DiscFilm, policy: &Policy) -> Result<Reached, FilmError> {
    let mut unknowns = film.unknowns.clone();
    for id in [Id::Mu, Id::E, Id::FallB, Id::FallC, Id::Kappa, Id::ESlope] {
        unknowns[id as usize].mode = Mode::Fixed;
    }
    unknowns[Id::Kappa as usize].start = 0.0;
    let mut state = State { own: vec![film.own.clone()], shared: Shared::starts(&unknowns) };
    let mut problem = Problem::of_one(Block::Discs(film.block.clone()), unknowns);
    let free = problem.free();
    let few = film.own.len() < LEAST_SHOTS;
    let reaches = if few { &REACHES[..] } else { &REACHES[..REACHES.len() - 1] };
    for reach in reaches {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        for shot in Arc::make_mut(&mut block.shots) {
            shot.reach = *reach;
        }
        block.choose_frames(&state);
        // frames beyond those that were fitted may be off the path
        if *reach > REACHES[0] {
            block.drop_frames(&state, policy);
        }
        state = descend(&problem, problem.evaluate(state), &free, STEPS).end.state;
    }
    state = descend_with_noise(&mut problem, state).end.state;
    for _ in 0..MAX_TOUCHING {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        let touch = block.find_touching(&state, policy);
        if block.drop_frames(&state, policy) == 0 && !touch {
            break;
        }
        block.choose_frames(&state);
        state = descend(&problem, problem.evaluate(state), &free, STEPS).end.state;
    }
    let descent = descend_with_noise(&mut problem, state);
    Reached::new(problem, descent)
}

/// Descends, again from where a descent did not end at a minimum.
pub(super) fn settle(problem: &mut Problem, state: State) -> Descent {
    let mut descent = descend_with_noise(problem, state);
    for _ in 0..ROUNDS {
        if descent.converged {
            break;
        }
        descent = descend_with_noise(problem, descent.end.state);
    }
    descent
}

impl DiscBlock {
    fn choose_frames(&mut self, state: &State) {
        for (shot, own) in Arc::make_mut(&mut self.shots).iter_mut().zip(&state.own[0]) {
            shot.choose_frames(own[own::TIME]);
        }
    }

    /// Halves the reach of shots whose frames are off the paths: decelerations are even for a while only. In
    /// the end takes the largest whose frames are hardly farther off than those next to the impact. Returns
    /// whether there are any.
    fn come_nearer(&mut self, policy: &Policy) -> bool {
        let mut changed = false;
        for i in 0..self.shots.len() {
            let misfit = self.misfit(i);
            let shot = &mut Arc::make_mut(&mut self.shots)[i];
            if shot.is_settled {
                continue;
            }
            let last = shot.reach;
            shot.tried.push((last, misfit));
            shot.is_settled = misfit < policy.misfit || last < 2 * LEAST_REACH;
            let is_near = |(_, farther): &&(usize, f64)| *farther <= policy.misfit * misfit;
            shot.reach = if shot.is_settled {
                shot.tried.iter().find(is_near).map_or(last, |(reach, _)| *reach)
            } else {
                last / 2
            };
            changed |= shot.reach != last;
        }
        changed
    }

    /// Returns the variance of the frames of shot `i` about the paths over that of their noise.
    fn misfit(&self, i: usize) -> f64 {
        let shot = &self.shots[i];
        let all =
            [0, 1].map(|disc| shot.noise_of_path(disc)).into_iter().flat_map(|first| [first, first + 1]);
        let seen = all.filter(|noise| shot.flat != Some(noise % 2));
        let expected = |noise: usize| shot.position_sd[noise / 4][noise % 4 / 2];
        let ratio = |noise: usize| (self.noise_of(i)[noise].sd / expected(noise)).powi(2);
        let ratios: Vec<f64> = seen.map(ratio).collect();
        ratios.iter().sum::<f64>() / ratios.len() as f64
    }

    /// Drops frames that stand out, and those at the ends of tracks from where on a point is not on its path
    /// any more; returns how many.
    fn drop_frames(&mut self, state: &State, policy: &Policy) -> usize {
        let mut count = 0;
        for (i, own) in state.own[0].iter().enumerate() {
            let found = self.sights(i, own, &state.shared);
            let shot = &mut Arc::make_mut(&mut self.shots)[i];
            for (track, frames) in shot.tracks.iter_mut().zip(found) {
                let outlying = outlying(&frames, own[own::TIME], policy);
                count += outlying.len();
                shot.outliers += outlying.len();
                let mut good =
                    frames.iter().map(|frame| frame.index).filter(|index| !outlying.contains(index));
                let first = good.next().unwrap_or(0);
                let last = good.next_back().unwrap_or(first);
                // what is beyond an end is no more on the path
                let is_cut = [frames.first(), frames.last()]
                    .map(|end| end.is_some_and(|end| outlying.contains(&end.index)));
                let mut indices = 0..;
                track.frames.retain(|_| {
                    let index = indices.next().unwrap_or(0);
                    let is_beyond = is_cut[0] && index < first || is_cut[1] && index > last;
                    !is_beyond && !outlying.contains(&index)
                });
            }
        }
        count
    }

    /// Counts one frame more as touching on either side of the impacts next to which frames are off the
    /// paths; returns whether there are any.
    fn find_touching(&mut self, state: &State, policy: &Policy) -> bool {
        let mut changed = false;
        for (i, own) in state.own[0].iter().enumerate() {
            if self.shots[i].stuck.is_some() || self.shots[i].touching == MAX_TOUCHING {
                continue;
            }
            let reach = (self.shots[i].touching as f64 + 1.0) / self.shots[i].fps;
            let is_off = are_off(&self.sights(i, own, &state.shared), own[own::TIME], reach, policy);
            if is_off {
                Arc::make_mut(&mut self.shots)[i].touching += 1;
                changed = true;
            }
        }
        changed
    }

    /// Returns the number of frames on either side of the impact of shot `i` that are off the paths: 0 if
    /// those next to it were left out without need.
    fn count_touching(&self, i: usize, state: &State, policy: &Policy) -> usize {
        let (shot, own) = (&self.shots[i], &state.own[0][i]);
        let mut next_to_it = shot.clone();
        (next_to_it.reach, next_to_it.touching) = (1, 0);
        next_to_it.choose_frames(own[own::TIME]);
        let sights = next_to_it.sights(own, &state.shared, &self.discs, self.noise_of(i));
        let is_needed = are_off(&sights, own[own::TIME], TOUCHING as f64 / shot.fps, policy);
        if is_needed || shot.touching > TOUCHING { shot.touching } else { 0 }
    }
}

/// Returns whether the frames within `reach` seconds of an instant are off the paths.
fn are_off<const R: usize>(sights: &[Vec<Sight<R>>], instant: f64, reach: f64, policy: &Policy) -> bool {
    let near = sights.iter().flatten().filter(|frame| (frame.time - instant).abs() <= reach);
    let squares: Vec<f64> = near.map(Sight::square).collect();
    tail(squares.iter().sum(), 2.0 * squares.len() as f64) < policy.frame_tail
}

/// Returns the table of what was measured.
pub(super) fn impacts(
    film: &DiscFilm,
    measured: &Reached,
    policy: &Policy,
) -> Result<Vec<DiscImpact>, FilmError> {
    let (problem, at) = (&measured.problem, &measured.descent.end);
    let block = measured.block()?;
    let reduced = at.eliminate(problem, 0.0).ok_or(FilmError::Undetermined)?;
    let estimates = Estimates::of_reduced(problem, &at.state, &reduced).ok_or(FilmError::Undetermined)?;
    let of_shot = |i: usize| {
        let (shot, own) = (&block.shots[i], &at.state.own[0][i]);
        let paths = shot.follow(own, &at.state.shared, &block.discs)?;
        let known = shot.known(&paths.impact, &block.discs);
        let inputs = input_covariance(&estimates.shot_covariance(&reduced, (0, i), &at.shots[0][i].held));
        let position_sd = |disc: usize| {
            let first = shot.noise_of_path(disc);
            let [x, y] = [first, first + 1].map(|noise| block.noise_of(i)[noise].sd);
            shot.flat.map_or(x.hypot(y) / 2.0_f64.sqrt(), |flat| [y, x][flat])
        };
        let used = |disc: usize, side: bool| {
            let tracks = shot.tracks.iter().filter(|track| track.disc == disc);
            let frames = tracks.flat_map(|track| &track.frames).filter(|frame| frame.used);
            let mut times: Vec<f64> =
                frames.map(|frame| frame.time).filter(|time| (*time > own[own::TIME]) == side).collect();
            times.sort_by(f64::total_cmp);
            times.dedup();
            times
        };
        let all = [used(0, false), used(0, true), used(1, false), used(1, true)];
        let times = || all.iter().flatten().copied();
        Some(DiscImpact {
            name: shot.name.clone(),
            values: known.values(shot.stuck.as_ref(), &inputs),
            position_sd: position_sd(0).max(position_sd(1)),
            misfit: block.misfit(i),
            frames: all.each_ref().map(Vec::len),
            window: [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)],
            touching: block.count_touching(i, &at.state, policy),
            outliers: shot.outliers,
            radii: paths.impact.radii.map(|radius| radius.re),
            stuck: shot.stuck,
            doubts: Vec::new(),
            paths: PicturePaths::new(
                paths.pieces.each_ref().map(|sides| &sides[..]),
                |at, late| (Centre::on(at, late).place, 0.0),
                own[own::TIME],
                Camera::new(&at.state.shared),
            ),
            film: (film.unit, film.middle),
        })
    };
    (0..block.shots.len()).map(of_shot).collect::<Option<Vec<_>>>().ok_or(FilmError::Undetermined)
}
