//! Measurements of each shot of discs without a law of friction.

use std::sync::Arc;

use super::block::{DiscBlock, Freedom, TOUCHING};
use super::impact::{DiscImpact, find_doubts};
use super::motion::{INPUTS, MOVING, locate};
use super::own::{self, CORE, LEAST_SHOTS};
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
use crate::problem::noise::minus_two_log;
use crate::problem::policy::Policy;
use crate::problem::problem::{Problem, State};
use crate::problem::solution::Solution;
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Id, Mode, Own, SHARED, Shared};

/// Steps of a descent with frames that may change.
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
    pub(crate) problem: Problem,
    pub(crate) descent: Descent,
    /// −2 log L up to a constant, with the own unknowns integrated.
    pub(crate) unlikely: f64,
}

impl Reached {
    /// Returns where a descent ended.
    pub fn new(problem: Problem, descent: Descent) -> Result<Self, FilmError> {
        let reduced = descent.end.eliminate(&problem, 0.0).ok_or(FilmError::Undetermined)?;
        let unlikely = minus_two_log(&problem, &descent.end) + reduced.own_ln_determinant;
        Ok(Self { problem, descent, unlikely })
    }

    /// Descends with the noise or spreads that residuals show, again from where a descent did not end at a
    /// minimum.
    pub(crate) fn settle(mut problem: Problem, state: State) -> Result<Self, FilmError> {
        let mut descent = descend_with_noise(&mut problem, state);
        for _ in 0..ROUNDS {
            if !descent.converged {
                descent = descend_with_noise(&mut problem, descent.end.state);
            }
        }
        Self::new(problem, descent)
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

    pub fn estimates(&self) -> Result<Estimates, FilmError> {
        Estimates::new(&self.problem, &self.descent.end).ok_or(FilmError::Undetermined)
    }

    /// Returns what is known there, with what was found on the way.
    pub fn solution(self, film: &Film<DiscBlock>) -> Result<Solution, FilmError> {
        let (covariance, names) = (self.estimates()?, vec![self.names()]);
        Ok(Solution {
            unit: film.unit,
            middle: film.middle.into(),
            findings: film.findings.clone(),
            left_out: film.left_out.clone(),
            ..Solution::new(self.problem, self.descent, covariance, names)
        })
    }
}

/// Measurements of films of discs without a law of friction.
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
    let mut measured = measure(&film, policy)?;
    measured.problem.discs_mut().ok_or(FilmError::NoFilm)?.freedom = Freedom::Everything;
    loop {
        measured = Reached::settle(measured.problem, measured.descent.end.state)?;
        let block = measured.problem.discs_mut().ok_or(FilmError::NoFilm)?;
        if !block.come_nearer(policy) {
            break;
        }
        block.choose_frames(&measured.descent.end.state, None);
    }
    let mut impacts = measured.impacts(&film, policy)?;
    impacts.retain(|impact| {
        let fault = impact.find_fault(&film.block.discs, policy);
        film.left_out.extend(fault.iter().map(|fault| (impact.name.clone(), fault.to_string())));
        fault.is_none()
    });
    if impacts.is_empty() {
        return Err(FilmError::NoImpact(film.left_out));
    }
    find_doubts(&mut impacts, policy);
    Ok(MeasuredDiscs { solution: measured.solution(&film)?, impacts })
}

/// Finds the outcome of each shot whatever the law, and which frames show it.
pub(super) fn measure(film: &Film<DiscBlock>, policy: &Policy) -> Result<Reached, FilmError> {
    let mut unknowns = film.unknowns.clone();
    for id in [Id::Mu, Id::E, Id::FallB, Id::FallC, Id::Kappa, Id::ESlope] {
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
    Reached::new(problem, descent)
}

impl DiscBlock {
    /// Uses the frames nearest to the impacts, within this reach, or that of each shot.
    fn choose_frames(&mut self, state: &State, reach: Option<usize>) {
        for (shot, own) in Arc::make_mut(&mut self.shots).iter_mut().zip(&state.own[0]) {
            shot.reach = reach.unwrap_or(shot.reach);
            shot.choose_frames(own[own::TIME]);
        }
    }

    /// Halves the reach of shots whose frames are off the paths: decelerations are even for a while only. In
    /// the end takes the largest whose frames are hardly farther off than those next to the impact. Returns
    /// whether a reach has changed.
    fn come_nearer(&mut self, policy: &Policy) -> bool {
        let mut changed = false;
        for i in 0..self.shots.len() {
            let misfit = self.misfit(i);
            let shot = &mut Arc::make_mut(&mut self.shots)[i];
            let (last, Some(tried)) = (shot.reach, &mut shot.tried) else { continue };
            tried.push((last, misfit));
            if misfit < policy.misfit || last < 2 * LEAST_REACH {
                let is_near = |(_, farther): &&(usize, f64)| *farther <= policy.misfit * misfit;
                shot.reach = tried.iter().find(is_near).map_or(last, |(reach, _)| *reach);
                shot.tried = None;
            } else {
                shot.reach = last / 2;
            }
            changed |= shot.reach != last;
        }
        changed
    }

    /// Returns the variance of the frames of shot `i` about the paths over that of their noise.
    pub(crate) fn misfit(&self, i: usize) -> f64 {
        let shot = &self.shots[i];
        let first = [0, 1].map(|disc| shot.noise_of_path(disc));
        let all = first.into_iter().flat_map(|first| [first, first + 1]);
        let seen = all.filter(|noise| shot.flat != Some(noise % 2));
        let expected = |noise: usize| shot.position_sd[noise / 4][noise % 4 / 2];
        let ratio = |noise: usize| (self.noise_of(i)[noise].sd / expected(noise)).powi(2);
        let ratios: Vec<f64> = seen.map(ratio).collect();
        ratios.iter().sum::<f64>() / ratios.len() as f64
    }

    /// Drops frames that stand out, and those at the ends of tracks from where on a point is not on its path
    /// any more; returns how many stand out.
    fn drop_frames(&mut self, state: &State, policy: &Policy) -> usize {
        let mut count = 0;
        for (i, own) in state.own[0].iter().enumerate() {
            let sights = self.sights(i, own, &state.shared);
            let shot = &mut Arc::make_mut(&mut self.shots)[i];
            for (track, sights) in shot.tracks.iter_mut().zip(sights) {
                let outlying = outlying(&sights, own[own::TIME], policy);
                count += outlying.len();
                shot.outliers += outlying.len();
                let is_off =
                    |sight: Option<&Sight<_>>| sight.is_some_and(|end| outlying.contains(&end.index));
                let is_cut = [is_off(sights.first()), is_off(sights.last())];
                let good: Vec<usize> =
                    sights.iter().map(|sight| sight.index).filter(|i| !outlying.contains(i)).collect();
                let first = good.first().copied().unwrap_or(0);
                let last = good.last().copied().unwrap_or(first);
                let mut indices = 0..;
                track.frames.retain(|_| {
                    let index = indices.next().unwrap_or(0);
                    // what is beyond an end is no more on the path
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

    /// Returns the number of frames on either side of the impact of shot `i` that are off the paths: 0 if
    /// those next to it were left out without need.
    pub(crate) fn count_touching(&self, i: usize, state: &State, policy: &Policy) -> usize {
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

impl Reached {
    /// Returns the table of what was measured.
    pub fn impacts(&self, film: &Film<DiscBlock>, policy: &Policy) -> Result<Vec<DiscImpact>, FilmError> {
        let (block, end) = (self.block()?, &self.descent.end);
        let reduced = end.eliminate(&self.problem, 0.0).ok_or(FilmError::Undetermined)?;
        let estimates =
            Estimates::of_reduced(&self.problem, &end.state, &reduced).ok_or(FilmError::Undetermined)?;
        let of_shot = |i: usize| {
            let (shot, own) = (&block.shots[i], &end.state.own[0][i]);
            let paths = shot.follow(own, &end.state.shared, &block.discs)?;
            // the covariance of the inputs of the motion
            let all = estimates.shot_covariance(&reduced, (0, i), &end.shots[0][i].held);
            let shared = all.nrows() - SHARED;
            let moving = MOVING.iter().map(|id| shared + *id as usize);
            let places: Vec<usize> = (0..CORE).chain(moving).collect();
            let inputs = all
                .select_rows(&places)
                .select_columns(&places)
                .fixed_view::<INPUTS, INPUTS>(0, 0)
                .clone_owned();
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
            let position_sd = [0, 1].map(|disc| {
                let first = shot.noise_of_path(disc);
                let [x, y] = [first, first + 1].map(|noise| block.noise_of(i)[noise].sd);
                shot.flat.map_or(x.hypot(y) / 2.0_f64.sqrt(), |flat| [y, x][flat])
            });
            let used = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[disc, side]| {
                let tracks = shot.tracks.iter().filter(|track| track.disc == disc);
                let frames = tracks.flat_map(|track| &track.frames).filter(|frame| frame.used);
                let times = frames.map(|frame| frame.time);
                let mut times: Vec<f64> =
                    times.filter(|time| usize::from(*time > own[own::TIME]) == side).collect();
                times.sort_by(f64::total_cmp);
                times.dedup();
                times
            });
            let times = || used.iter().flatten().copied();
            Some(DiscImpact {
                name: shot.name.clone(),
                values,
                position_sd: position_sd[0].max(position_sd[1]),
                misfit: block.misfit(i),
                frames: used.each_ref().map(Vec::len),
                window: [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)],
                touching: block.count_touching(i, &end.state, policy),
                outliers: shot.outliers,
                radii: paths.radii.map(|radius| radius.re),
                stuck: shot.stuck,
                doubts: Vec::new(),
                paths: PicturePaths::new(
                    paths.pieces.each_ref().map(|sides| &sides[..]),
                    |at, late| {
                        (at.try_into().map_or(Point::zeros(), |at| locate::<f64>(at, late, None)), 0.0)
                    },
                    own[own::TIME],
                    Camera::new(&end.state.shared),
                ),
                film: (film.unit, film.middle),
            })
        };
        (0..block.shots.len()).map(of_shot).collect::<Option<Vec<_>>>().ok_or(FilmError::Undetermined)
    }
}
