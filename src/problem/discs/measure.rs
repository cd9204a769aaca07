//! Measurements of each shot of discs without a law of friction.

use std::sync::Arc;

use super::block::{DiscBlock, Freedom, TOUCHING};
use super::impact::{DiscImpact, find_doubts};
use super::motion::{INPUTS, MOVING, locate};
use super::own::{self, CORE, LAW, LEAST_SHOTS};
use super::quantities::Quantity;
use crate::measurement::dataset::{Dataset, Measured};
use crate::problem::block::Block;
use crate::problem::descent::{Descent, descend};
use crate::problem::film::camera::{Camera, Point};
use crate::problem::film::dual::gradient;
use crate::problem::film::film_data::{Film, FilmError};
use crate::problem::film::outliers::{outlying, tail};
use crate::problem::frames::{PicturePaths, Sight};
use crate::problem::minimise::descend_with_noise;
use crate::problem::policy::Policy;
use crate::problem::problem::{Problem, State};
use crate::problem::solution::Solution;
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Id, Mode, SHARED, Shared};

/// Steps of a descent with frames that may change.
pub(super) const STEPS: usize = 10;

/// Rounds of leaving out shots, and of priors that the frames contradict.
pub(super) const ROUNDS: usize = 3;

/// Frames on either side of the impact that are used, one number after the other: paths are followed from the
/// impact on to a rail or a hand. The last one is for shots that are too few to show how decelerations
/// differ: in long paths they are less even.
const REACHES: [f64; 4] = [15.0, 30.0, 60.0, 120.0];

/// Smallest number of frames on either side that decelerations which are not even leave.
const LEAST_REACH: f64 = 7.0;

/// Frames about the impact that are left out if the discs still touch in them.
const MAX_TOUCHING: usize = 6;

/// Descends with the noise or spreads that residuals show, again from where a descent did not end at a
/// minimum.
pub(super) fn settle(mut problem: Problem, state: State) -> Result<Solution, FilmError> {
    let mut descent = descend_with_noise(&mut problem, state);
    for _ in 0..ROUNDS {
        if !descent.converged {
            descent = descend_with_noise(&mut problem, descent.end.state);
        }
    }
    solve(problem, descent)
}

/// Returns what is known where a descent ended.
pub(super) fn solve(problem: Problem, descent: Descent) -> Result<Solution, FilmError> {
    let covariance = Estimates::new(&problem, &descent.end).ok_or(FilmError::Undetermined)?;
    let shots = problem.discs().map_or(&[][..], |block| &block.shots);
    let names = vec![shots.iter().map(|shot| shot.name.clone()).collect()];
    Ok(Solution::new(problem, descent, covariance, names))
}

/// Returns a solution with what was found of the film.
pub(super) fn with_film(solution: Solution, film: Film<DiscBlock>) -> Solution {
    let Film { unit, findings, left_out, .. } = film;
    Solution { unit, middle: film.middle.into(), findings, left_out, ..solution }
}

/// The measurement of a film of discs without a law.
pub(crate) struct MeasuredDiscs {
    /// The minimum: camera, decelerations, and the motion of the discs.
    pub(crate) solution: Solution,
    /// The measurements of each shot.
    pub(crate) impacts: Vec<DiscImpact>,
}

/// Measures the shots of the films of a data set: e, J_t/J_n, spins and balance of momentum of each may
/// be any.
///
/// # Errors
/// See [`FilmError`].
pub(crate) fn measure_discs(dataset: &Dataset, policy: &Policy) -> Result<MeasuredDiscs, FilmError> {
    let mut film = Film::of_discs(dataset)?;
    let mut solution = measure(&film, policy)?;
    solution.problem.discs_mut().ok_or(FilmError::NoFilm)?.freedom = Freedom::Everything;
    loop {
        solution = settle(solution.problem, solution.at.state)?;
        let block = solution.problem.discs_mut().ok_or(FilmError::NoFilm)?;
        if !block.come_nearer(policy) {
            break;
        }
        block.choose_frames(&solution.at.state, None);
    }
    let mut impacts = list_impacts(&solution, &film, policy)?;
    impacts.retain(|impact| {
        let separation = || impact.find_separation(&film.block.discs, policy);
        let fault = impact.find_misfit().or_else(separation);
        film.left_out.extend(fault.iter().map(|fault| (impact.name.clone(), fault.to_string())));
        fault.is_none()
    });
    if impacts.is_empty() {
        return Err(FilmError::NoImpact(film.left_out));
    }
    find_doubts(&mut impacts, policy);
    Ok(MeasuredDiscs { solution: with_film(solution, film), impacts })
}

/// Finds the outcome of each shot without a law, and which frames show it.
pub(super) fn measure(film: &Film<DiscBlock>, policy: &Policy) -> Result<Solution, FilmError> {
    let mut unknowns = film.unknowns.clone();
    for id in LAW {
        unknowns[id as usize].mode = Mode::Fixed;
    }
    unknowns[Id::Kappa as usize].start = 0.0;
    let mut state = State { own: vec![film.own.clone()], shared: Shared::starts(&unknowns) };
    let mut problem = Problem::of_one(Block::Discs(film.block.clone()), unknowns);
    let free = problem.free();
    let few = film.own.len() < LEAST_SHOTS;
    for reach in &REACHES[..if few { REACHES.len() } else { REACHES.len() - 1 }] {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        block.choose_frames(&state, Some(*reach));
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
        block.choose_frames(&state, None);
        state = descend(&problem, problem.evaluate(state), &free, STEPS).end.state;
    }
    let descent = descend_with_noise(&mut problem, state);
    solve(problem, descent)
}

impl DiscBlock {
    /// Uses the frames within this reach of the impacts, or that of each shot.
    fn choose_frames(&mut self, state: &State, reach: Option<f64>) {
        for (shot, own) in Arc::make_mut(&mut self.shots).iter_mut().zip(&state.own[0]) {
            shot.reach = reach.unwrap_or(shot.reach);
            shot.choose_frames(own[own::TIME]);
        }
    }

    /// Halves the reach of shots whose frames are off the paths: decelerations are even for a while only. In
    /// the end takes the largest whose frames are not significantly farther off than those next to the impact. Returns
    /// whether a reach has changed.
    fn come_nearer(&mut self, policy: &Policy) -> bool {
        let mut changed = false;
        for i in 0..self.shots.len() {
            let misfit = self.misfit(i);
            let shot = &mut Arc::make_mut(&mut self.shots)[i];
            let (last, Some(tried)) = (shot.reach, &mut shot.tried) else { continue };
            tried.push((last, misfit));
            if misfit < policy.misfit || last < 2.0 * LEAST_REACH {
                let is_near = |(_, farther): &&(f64, f64)| *farther <= policy.misfit * misfit;
                shot.reach = tried.iter().find(is_near).map_or(last, |(reach, _)| *reach);
                shot.tried = None;
            } else {
                shot.reach = (0.5 * last).floor();
            }
            changed |= shot.reach != last;
        }
        changed
    }

    /// Returns the variance of a coordinate of each disc of shot `i` about its path, the mean of those that are
    /// seen, m².
    fn variances(&self, i: usize) -> [f64; 2] {
        [0, 1].map(|disc| {
            let noises = self.noise_of(i)[2 * disc..].iter().take(2).enumerate();
            let seen = noises.filter(|(axis, _)| self.shots[i].flat != Some(*axis));
            let seen: Vec<f64> = seen.map(|(_, noise)| noise.sd.powi(2)).collect();
            seen.iter().sum::<f64>() / seen.len() as f64
        })
    }

    /// Returns the variance of the frames of shot `i` about the paths over that of their noise.
    fn misfit(&self, i: usize) -> f64 {
        let variances = self.variances(i).into_iter().zip(self.shots[i].position_sd);
        0.5 * variances.map(|(variance, sd)| variance / sd.powi(2)).sum::<f64>()
    }

    /// Drops frames that stand out, and those at the ends of tracks from where on a point is not on its path
    /// any more; returns how many.
    fn drop_frames(&mut self, state: &State, policy: &Policy) -> usize {
        let mut count = 0;
        for (i, own) in state.own[0].iter().enumerate() {
            let sights = self.sights(i, own, &state.shared);
            let shot = &mut Arc::make_mut(&mut self.shots)[i];
            for (track, sights) in shot.tracks.iter_mut().zip(sights) {
                let outlying = outlying(&sights, own[own::TIME], policy);
                let mut index = 0..;
                track.frames.retain(|_| index.next().is_some_and(|index| !outlying.contains(&index)));
                shot.outliers += outlying.len();
                count += outlying.len();
            }
        }
        count
    }

    /// Counts one frame more as touching on either side of the impacts next to which frames are off the
    /// paths; returns whether there are any.
    fn find_touching(&mut self, state: &State, policy: &Policy) -> bool {
        let mut changed = false;
        for (i, own) in state.own[0].iter().enumerate() {
            let shot = &self.shots[i];
            let reach = (shot.touching as f64 + 1.0) / shot.fps;
            let may_touch = shot.stuck.is_none() && shot.touching < MAX_TOUCHING;
            if may_touch && are_off(&self.sights(i, own, &state.shared), own[own::TIME], reach, policy) {
                Arc::make_mut(&mut self.shots)[i].touching += 1;
                changed = true;
            }
        }
        changed
    }
}

/// Returns whether the frames within `reach` seconds of an instant are off the paths.
fn are_off<const R: usize>(sights: &[Vec<Sight<R>>], instant: f64, reach: f64, policy: &Policy) -> bool {
    let near = sights.iter().flatten().filter(|frame| (frame.time - instant).abs() <= reach);
    let squares: Vec<f64> = near.map(Sight::square).collect();
    tail(squares.iter().sum(), 2.0 * squares.len() as f64) < policy.frame_tail
}

/// Returns the table of what was measured.
pub(super) fn list_impacts(
    solution: &Solution,
    film: &Film<DiscBlock>,
    policy: &Policy,
) -> Result<Vec<DiscImpact>, FilmError> {
    let (block, end) = (solution.problem.discs().ok_or(FilmError::NoFilm)?, &solution.at);
    let reduced = end.eliminate(&solution.problem, 0.0).ok_or(FilmError::Undetermined)?;
    // the frames next to the impacts
    let mut near = block.clone();
    for shot in Arc::make_mut(&mut near.shots) {
        shot.touching = 0;
    }
    near.choose_frames(&end.state, Some(TOUCHING as f64));
    let of_shot = |i: usize| {
        let (shot, own) = (&block.shots[i], &end.state.own[0][i]);
        let paths = shot.follow(own, &end.state.shared, &block.discs)?;
        // the covariance of the inputs of the motion
        let all = solution.covariance.shot_covariance(&reduced, (0, i), &end.shots[0][i].held);
        let shared = all.nrows() - SHARED;
        let moving = MOVING.iter().map(|id| shared + *id as usize);
        let places: Vec<usize> = (0..CORE).chain(moving).collect();
        let inputs = all.select_rows(&places).select_columns(&places);
        let inputs = inputs.fixed_view::<INPUTS, INPUTS>(0, 0);
        let mut values = paths.quantities(shot, &block.discs).map(|quantity| {
            let (value, by) = (quantity?.re, gradient(&quantity?));
            Some(Measured { value, sd: Some(by.dot(&(inputs * by)).max(0.0).sqrt()) })
        });
        if let (Some(ratio), Some(_)) = (&mut values[Quantity::MassRatio as usize], block.discs.masses) {
            // stated, not measured
            ratio.sd = None;
        }
        if let Some(stuck) = &shot.stuck {
            values[Quantity::Restitution as usize] = Some(stuck.restitution);
        }
        let times = [0, 1].map(|disc| {
            let frames = shot.tracks.iter().filter(|track| track.disc == disc).flat_map(|t| &t.frames);
            let used = frames.filter(|frame| frame.used).map(|frame| frame.time);
            let mut times: Vec<f64> = used.collect();
            times.sort_by(f64::total_cmp);
            times.dedup();
            times
        });
        // left out with need
        let next_to_it = near.sights(i, own, &end.state.shared);
        let is_touching = are_off(&next_to_it, own[own::TIME], TOUCHING as f64 / shot.fps, policy);
        let ends = || times.iter().flatten().copied();
        Some(DiscImpact {
            name: shot.name.clone(),
            values,
            position_sd: block.variances(i).into_iter().fold(0.0, f64::max).sqrt(),
            misfit: block.misfit(i),
            frames: ends().count(),
            window: [ends().fold(f64::INFINITY, f64::min), ends().fold(f64::NEG_INFINITY, f64::max)],
            touching: if is_touching || shot.touching > TOUCHING { shot.touching } else { 0 },
            outliers: shot.outliers,
            radii: paths.radii.map(|radius| radius.re),
            stuck: shot.stuck,
            doubts: Vec::new(),
            paths: PicturePaths::new(
                paths.pieces.each_ref().map(|sides| &sides[..]),
                |at, late| (at.try_into().map_or(Point::zeros(), |at| locate::<f64>(at, late, None)), 0.0),
                own[own::TIME],
                Camera::new(&end.state.shared),
            ),
            film: (film.unit, film.middle),
        })
    };
    let impacts = (0..block.shots.len()).map(of_shot).collect::<Option<Vec<_>>>();
    impacts.ok_or(FilmError::Undetermined)
}
