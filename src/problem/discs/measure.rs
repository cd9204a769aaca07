//! What was measured of each shot of discs, whatever the law of friction.

use std::sync::Arc;

use super::block::{DiscBlock, Freedom};
use super::first_guess::DiscFilm;
use super::frames::NOISES;
use super::impact::{DiscImpact, PicturePaths, find_doubts};
use super::outcome::input_covariance;
use super::own;
use super::priors::LEAST_SHOTS;
use super::stick::Stuck;
use crate::measurement::dataset::Dataset;
use crate::problem::block::Block;
use crate::problem::descent::{Descent, descend};
use crate::problem::film::camera::Camera;
use crate::problem::film::film_data::FilmError;
use crate::problem::film::frames::Whitened;
use crate::problem::film::outliers::{outlying, tail};
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

/// Frames about the impact that are left out, and those that are if the discs still touch in them.
const TOUCHING: usize = 1;
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

    pub fn shared(&self) -> &Shared {
        &self.descent.end.state.shared
    }

    pub fn own(&self) -> &[Own] {
        &self.descent.end.state.own[0]
    }

    /// Returns what is known there, without findings.
    pub fn solution(self, film: &DiscFilm) -> Result<Solution, FilmError> {
        let Self { problem, descent, .. } = self;
        let covariance = Estimates::new(&problem, &descent.end).ok_or(FilmError::Undetermined)?;
        Ok(Solution {
            unit: film.unit,
            middle: film.middle.into(),
            converged: descent.converged,
            at: descent.end,
            covariance,
            findings: Vec::new(),
            names: vec![film.names.clone()],
            left_out: film.left_out.clone(),
            misfit: f64::NAN,
            evaluations: descent.evaluations,
            problem,
        })
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

/// What became of the frames of a shot.
#[derive(Clone)]
pub(super) struct Frames {
    /// Number of frames of each point on either side of the impact that are used at most.
    reach: usize,
    /// Number of frames on either side of the impact that may be neither before nor after it.
    touching: usize,
    /// Number of frames that were left out as wrong.
    outliers: usize,
    /// Numbers of frames that were tried, with their misfit, the largest first.
    tried: Vec<(usize, f64)>,
    /// Whether the number of frames is the last one.
    is_settled: bool,
}

impl Frames {
    const FIRST: Self =
        Self { reach: 0, touching: TOUCHING, outliers: 0, tried: Vec::new(), is_settled: false };
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
    let (Reached { mut problem, mut descent, .. }, mut frames) = measure(&film, policy)?;
    problem.discs_mut().ok_or(FilmError::NoFilm)?.freedom = Freedom::Everything;
    loop {
        descent = settle(&mut problem, descent.end.state);
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        if !come_nearer(block, &film, &mut frames, policy) {
            break;
        }
        choose_frames(block, &descent.end.state, &frames);
    }
    let measured = Reached::new(problem, descent)?;
    let mut left_out = film.left_out.clone();
    let mut impacts = impacts(&film, &measured, (&frames, policy))?;
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

/// Halves the reach of shots whose frames are off the paths: decelerations are even for a while only. In
/// the end takes the largest whose frames are hardly farther off than those next to the impact. Returns
/// whether there are any.
fn come_nearer(block: &DiscBlock, film: &DiscFilm, frames: &mut [Frames], policy: &Policy) -> bool {
    let mut changed = false;
    for (i, frames) in frames.iter_mut().enumerate().filter(|(_, frames)| !frames.is_settled) {
        let misfit = misfit(block, film, i);
        frames.tried.push((frames.reach, misfit));
        frames.is_settled = misfit < policy.misfit || frames.reach < 2 * LEAST_REACH;
        let last = frames.reach;
        if frames.is_settled {
            let is_near = |(_, farther): &&(usize, f64)| *farther <= policy.misfit * misfit;
            frames.reach = frames.tried.iter().find(is_near).map_or(last, |(reach, _)| *reach);
        } else {
            frames.reach /= 2;
        }
        changed |= frames.reach != last;
    }
    changed
}

/// Returns the variance of the frames of shot `i` about the paths over that of their noise.
fn misfit(block: &DiscBlock, film: &DiscFilm, i: usize) -> f64 {
    let shot = &block.shots[i];
    let noises = [0, 1].map(|disc| shot.noise_of_path(disc));
    let all = noises.into_iter().flat_map(|first| [first, first + 1]);
    let seen = all.filter(|noise| shot.flat != Some(noise % 2));
    let expected = |noise: usize| film.position_sd[i][noise / 4][noise % 4 / 2];
    let ratio = |noise: usize| (block.noise[NOISES * i + noise].sd / expected(noise)).powi(2);
    let ratios: Vec<f64> = seen.map(ratio).collect();
    ratios.iter().sum::<f64>() / ratios.len() as f64
}

/// Finds the outcome of each shot whatever the law, and which frames show it.
pub(super) fn measure(film: &DiscFilm, policy: &Policy) -> Result<(Reached, Vec<Frames>), FilmError> {
    let mut unknowns = film.unknowns.clone();
    for id in [Id::Mu, Id::E, Id::FallB, Id::FallC, Id::Kappa, Id::ESlope] {
        unknowns[id as usize].mode = Mode::Fixed;
    }
    unknowns[Id::Kappa as usize].start = 0.0;
    let shared = Shared(unknowns.iter().map(|unknown| unknown.start).collect());
    let mut state = State { own: vec![film.own.clone()], shared };
    let mut problem = Problem::of_one(Block::Discs(film.block.clone()), unknowns);
    let free = problem.free();
    let mut frames = vec![Frames::FIRST; film.names.len()];
    let few = film.names.len() < LEAST_SHOTS;
    let reaches = if few { &REACHES[..] } else { &REACHES[..REACHES.len() - 1] };
    for reach in reaches.iter().copied() {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        for frames in &mut frames {
            frames.reach = reach;
        }
        choose_frames(block, &state, &frames);
        // frames beyond those that were fitted may be off the path
        if reach > REACHES[0] {
            drop_frames(block, &state, &mut frames, policy);
        }
        let descent = descend(&problem, problem.evaluate(state), &free, STEPS);
        state = descent.end.state;
    }
    state = descend_with_noise(&mut problem, state).end.state;
    for _ in 0..MAX_TOUCHING {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        let touch = find_touching(block, &state, &mut frames, policy);
        let dropped = drop_frames(block, &state, &mut frames, policy);
        if !touch && dropped == 0 {
            break;
        }
        choose_frames(block, &state, &frames);
        state = descend(&problem, problem.evaluate(state), &free, STEPS).end.state;
    }
    let descent = descend_with_noise(&mut problem, state);
    Ok((Reached::new(problem, descent)?, frames))
}

/// Descends, again from where a descent did not end at a minimum.
pub(super) fn settle(problem: &mut Problem, state: State) -> Descent {
    let mut descent = descend_with_noise(problem, state);
    for _ in 0..ROUNDS {
        if descent.converged {
            break;
        }
        let next = descend_with_noise(problem, descent.end.state);
        descent = Descent { evaluations: descent.evaluations + next.evaluations, ..next };
    }
    descent
}

fn choose_frames(block: &mut DiscBlock, state: &State, frames: &[Frames]) {
    for ((shot, own), frames) in Arc::make_mut(&mut block.shots).iter_mut().zip(&state.own[0]).zip(frames) {
        shot.choose_frames(own[own::TIME], frames.reach, frames.touching as f64);
    }
}

/// Drops frames that stand out, and those at the ends of tracks from where on a point is not on its path
/// any more; returns how many.
fn drop_frames(block: &mut DiscBlock, state: &State, frames_of: &mut [Frames], policy: &Policy) -> usize {
    let mut count = 0;
    let shared = &state.shared;
    for (i, own) in state.own[0].iter().enumerate() {
        let noise = &block.noise[NOISES * i..NOISES * (i + 1)];
        let found = block.shots[i].residuals(own, shared, &block.discs, noise);
        let shots = Arc::make_mut(&mut block.shots);
        for (track, frames) in shots[i].tracks.iter_mut().zip(found) {
            let outlying = outlying(&frames, own[own::TIME], policy);
            count += outlying.len();
            frames_of[i].outliers += outlying.len();
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
fn find_touching(block: &DiscBlock, state: &State, frames: &mut [Frames], policy: &Policy) -> bool {
    let mut changed = false;
    for (i, own) in state.own[0].iter().enumerate().filter(|(i, _)| block.shots[*i].settling.is_none()) {
        let shot = &block.shots[i];
        let noise = &block.noise[NOISES * i..NOISES * (i + 1)];
        let reach = (frames[i].touching as f64 + 1.0) / shot.fps;
        let residuals = shot.residuals(own, &state.shared, &block.discs, noise);
        let is_off = are_off(&residuals, own[own::TIME], reach, policy);
        if is_off && frames[i].touching < MAX_TOUCHING {
            frames[i].touching += 1;
            changed = true;
        }
    }
    changed
}

/// Returns whether the frames within `reach` seconds of an instant are off the paths.
fn are_off(residuals: &[Vec<Whitened>], instant: f64, reach: f64, policy: &Policy) -> bool {
    let near = residuals.iter().flatten().filter(|frame| (frame.time - instant).abs() <= reach);
    let squares: Vec<f64> = near.map(|frame| frame.square).collect();
    tail(squares.iter().sum(), 2.0 * squares.len() as f64) < policy.frame_tail
}

/// Returns the number of frames on either side of the impact of shot `i` that are off the paths: 0 if
/// those next to it were left out without need.
fn count_touching(block: &DiscBlock, state: &State, (i, frames): (usize, &Frames), policy: &Policy) -> usize {
    let own = &state.own[0][i];
    let mut next_to_it = block.shots[i].clone();
    next_to_it.choose_frames(own[own::TIME], 1, 0.0);
    let noise = &block.noise[NOISES * i..NOISES * (i + 1)];
    let residuals = next_to_it.residuals(own, &state.shared, &block.discs, noise);
    let is_needed = are_off(&residuals, own[own::TIME], TOUCHING as f64 / block.shots[i].fps, policy);
    if is_needed || frames.touching > TOUCHING { frames.touching } else { 0 }
}

/// Returns the table of what was measured.
pub(super) fn impacts(
    film: &DiscFilm,
    measured: &Reached,
    (frames, policy): (&[Frames], &Policy),
) -> Result<Vec<DiscImpact>, FilmError> {
    let Reached { problem, descent, .. } = measured;
    let at = &descent.end;
    let block = measured.block()?;
    let reduced = at.eliminate(problem, 0.0).ok_or(FilmError::Undetermined)?;
    let estimates = Estimates::of_reduced(problem, &at.state, &reduced).ok_or(FilmError::Undetermined)?;
    let camera = Camera::new(&at.state.shared);
    let of_shot = |i: usize| {
        let (shot, own) = (&block.shots[i], &at.state.own[0][i]);
        let paths = shot.follow(own, &at.state.shared, &block.discs)?;
        let known = shot.known(&paths.impact, &block.discs);
        let inputs = input_covariance((&reduced, &estimates), problem, (i, &at.shots[0][i].held));
        let stuck: Option<Stuck> = film.stuck[i];
        let noise = &block.noise[NOISES * i..NOISES * (i + 1)];
        let position_sd = |disc: usize| {
            let first = shot.noise_of_path(disc);
            match shot.flat {
                Some(flat) => noise[first + 1 - flat].sd,
                None => noise[first].sd.hypot(noise[first + 1].sd) / 2.0_f64.sqrt(),
            }
        };
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
            values: known.values(stuck.as_ref(), &inputs),
            position_sd: position_sd(0).max(position_sd(1)),
            misfit: misfit(block, film, i),
            frames: all().map(|(disc, side)| count(disc, side)),
            window: [times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max)],
            touching: count_touching(block, &at.state, (i, &frames[i]), policy),
            outliers: frames[i].outliers,
            radii: paths.impact.radii.map(|radius| radius.re),
            stuck,
            doubts: Vec::new(),
            paths: PicturePaths::new(&paths, own[own::TIME], camera.clone(), (film.unit, film.middle)),
        })
    };
    (0..block.shots.len()).map(of_shot).collect::<Option<Vec<_>>>().ok_or(FilmError::Undetermined)
}
