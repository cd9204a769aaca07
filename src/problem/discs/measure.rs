//! Measurements of each shot of discs without a law of friction, and the frames that show it.

use std::sync::Arc;

use super::block::{DiscBlock, PointTrack, by_unknowns};
use super::first_guess::prepare_discs;
use super::impact::{DiscImpact, find_doubts};
use super::motion::{Dual, follow, locate};
use super::own::{self, LAW, LEAST_SHOTS};
use crate::measurement::dataset::{Dataset, Measured};
use crate::problem::false_shots::tail;
use crate::problem::film::camera::{Camera, Point};
use crate::problem::film::film_data::FilmError;
use crate::problem::film::outliers::{Near, find_lag, outlying};
use crate::problem::findings::Finding;
use crate::problem::frames::{PicturePaths, Sight};
use crate::problem::minimise::{Descent, descend, descend_with_noise};
use crate::problem::policy::{POLICY, STALL};
use crate::problem::problem::{Prepared, Problem, Record, State};
use crate::problem::solution::Solution;
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Mode, Own, Shared};

/// Rounds of leaving out shots, and of descents that did not end at a minimum.
pub(super) const ROUNDS: usize = 3;

/// Frames on either side of the impact that are used, one number after the other: paths are
/// followed from the impact on to a rail or a hand. The last one is for shots that are too few to
/// show how decelerations differ: in long paths they are less even.
const REACHES: [f64; 4] = [15.0, 30.0, 60.0, 120.0];

/// Smallest number of frames on either side that decelerations which are not even leave.
const LEAST_REACH: f64 = 7.0;

/// Frames on either side of the impact that are left out, in which discs may still touch. Others of
/// a longer contact stand out.
const LEFT_OUT: f64 = 1.0;

/// Rounds of leaving out frames that stand out.
const OUTLIER_ROUNDS: usize = 6;

/// Steps of a descent with frames that may change.
const STEPS: usize = 10;

/// Descends with the noise or spreads that residuals show, and again from the end of a descent if
/// that is not a minimum.
pub(super) fn settle(data: Prepared) -> Result<Solution, FilmError> {
    let Prepared { mut problem, start, record } = data;
    let mut descent = descend_with_noise(&mut problem, start);
    for _ in 0..ROUNDS {
        if !descent.converged {
            descent = descend_with_noise(&mut problem, descent.end.state);
        }
    }
    solve(problem, descent, record)
}

/// Returns the solution at the end of a descent.
pub(super) fn solve(problem: Problem, descent: Descent, record: Record) -> Result<Solution, FilmError> {
    let covariance = Estimates::new(&problem, &descent.end).ok_or(FilmError::Undetermined)?;
    Ok(Solution::new(problem, descent, covariance, record))
}

/// Measures the shots of the films of a data set that show an impact of its discs: e, J_t/J_n,
/// spins and balance of momentum of each may be any. Returns the minimum, with camera,
/// decelerations, and the motion of the discs, and the measurements of each shot.
///
/// # Errors
/// See [`FilmError`].
pub(crate) fn measure_discs(dataset: &Dataset) -> Result<(Solution, Vec<DiscImpact>), FilmError> {
    let Prepared { mut problem, start: mut state, record } = prepare_discs(dataset)?;
    problem.unknowns[..LAW].iter_mut().for_each(|unknown| unknown.mode = Mode::Fixed);
    let few = usize::from(state.own[0].len() < LEAST_SHOTS);
    let free = problem.free();
    for (i, reach) in REACHES[..REACHES.len() - 1 + few].iter().enumerate() {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        for shot in Arc::make_mut(&mut block.shots) {
            shot.reach = *reach;
        }
        block.choose_frames(&state, LEFT_OUT);
        // frames beyond those that were fitted may be off the path
        if i > 0 {
            block.drop_frames(&state);
        }
        state = descend(&problem, problem.evaluate(state), &free, (STEPS, STALL)).end.state;
    }
    state = descend_with_noise(&mut problem, state).end.state;
    for _ in 0..OUTLIER_ROUNDS {
        let block = problem.discs_mut().ok_or(FilmError::NoFilm)?;
        if !block.drop_frames(&state) {
            break;
        }
        block.choose_frames(&state, LEFT_OUT);
        state = descend(&problem, problem.evaluate(state), &free, (STEPS, STALL)).end.state;
    }
    let mut solution = settle(Prepared { problem, start: state, record })?;
    while let Some(block) = solution.problem.discs_mut()
        && block.come_nearer()
    {
        block.choose_frames(&solution.at.state, LEFT_OUT);
        solution = settle(solution.again())?;
    }
    let lag = solution.problem.discs().and_then(|block| block.lags(solution.state()));
    if let Some((lag, block)) = lag.zip(solution.problem.discs_mut()) {
        block.choose_frames(&solution.at.state, lag as f64 + LEFT_OUT);
        // with those next to the impacts
        solution.record.findings.push(Finding::Spoiled { before: lag + 1, after: lag + 1 });
        solution = settle(solution.again())?;
    }
    let mut impacts = list_impacts(&solution)?;
    let radii = solution.problem.discs().and_then(|block| block.discs.radii);
    impacts.retain(|impact| {
        let fault = impact.find_unusable(radii);
        let left_out = fault.iter().map(|fault| (impact.name.clone(), fault.to_string()));
        solution.record.left_out.extend(left_out);
        fault.is_none()
    });
    if impacts.is_empty() {
        return Err(FilmError::NoImpact(solution.record.left_out));
    }
    find_doubts(&mut impacts);
    Ok((solution, impacts))
}

impl DiscBlock {
    /// Uses the frames of each shot within its reach that are so many frames from the impact or
    /// more.
    fn choose_frames(&mut self, state: &State, nearest: f64) {
        for (shot, own) in Arc::make_mut(&mut self.shots).iter_mut().zip(&state.own[0]) {
            let [from, to] = shot.stuck.map_or([own[own::TIME]; 2], |stuck| stuck.settling);
            for frame in shot.tracks.iter_mut().flat_map(|track| &mut track.frames) {
                let away = (from - frame.time).max(frame.time - to) * shot.fps;
                frame.used = (nearest..=shot.reach).contains(&away);
            }
        }
    }

    /// Halves the reach of shots whose frames are off the paths: decelerations are even for a while
    /// only. In the end takes the largest whose frames are not significantly farther off than those
    /// next to the impact. Returns whether a reach has changed.
    fn come_nearer(&mut self) -> bool {
        let misfits: Vec<f64> = (0..self.shots.len()).map(|i| self.misfit(i)).collect();
        let mut changed = false;
        for (shot, misfit) in Arc::make_mut(&mut self.shots).iter_mut().zip(misfits) {
            let (last, Some(tried)) = (shot.reach, &mut shot.tried) else { continue };
            tried.push((last, misfit));
            if misfit < POLICY.misfit || last < 2.0 * LEAST_REACH {
                let is_near = |(_, farther): &&(f64, f64)| *farther <= POLICY.misfit * misfit;
                shot.reach = tried.iter().find(is_near).map_or(last, |(reach, _)| *reach);
                shot.tried = None;
            } else {
                shot.reach = (0.5 * last).floor();
            }
            changed |= shot.reach != last;
        }
        changed
    }

    /// Returns the variance of a coordinate of each disc of shot `i` about its path, the mean of
    /// those that are seen, m².
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

    /// Drops frames that stand out, and the ends of tracks at which a point has left its path;
    /// returns whether it drops any.
    fn drop_frames(&mut self, state: &State) -> bool {
        let mut changed = false;
        for (i, own) in state.own[0].iter().enumerate() {
            let Some((_, sights)) = self.sights(i, own, &state.shared) else { continue };
            let shot = &mut Arc::make_mut(&mut self.shots)[i];
            for (track, sights) in shot.tracks.iter_mut().zip(sights) {
                let outlying = outlying(&sights, own[own::TIME]);
                let mut index = 0..;
                track.frames.retain(|_| index.next().is_some_and(|index| !outlying.contains(&index)));
                shot.outliers += outlying.len();
                changed |= !outlying.is_empty();
            }
        }
        changed
    }

    /// Returns the number of used frames after the impacts by which the tracker lags, if it does.
    fn lags(&self, state: &State) -> Option<usize> {
        let mut white = self.clone();
        white.variation.noises.iter_mut().for_each(|noise| noise.rho = 0.0);
        let along = |(i, own): (usize, &Own)| {
            let (motion, sights) = white.sights(i, own, &state.shared)?;
            let mut near = Near::default();
            for (PointTrack { disc, .. }, sights) in self.shots[i].tracks.iter().zip(sights) {
                let [before, after] = motion.velocities[*disc];
                let frames: Vec<_> = sights.iter().map(|sight| (sight.time, sight.residuals())).collect();
                near.add(&frames, (after - before).map(|v| v.re), own[own::TIME])?;
            }
            Some(near)
        };
        find_lag(&state.own[0].iter().enumerate().filter_map(along).collect::<Vec<_>>())
    }

    /// Returns whether frames of shot `i` next to the impact, in which the discs then still touch,
    /// are off the paths.
    fn touches(&self, i: usize, own: &Own, shared: &Shared) -> bool {
        let Some((_, sights)) = self.sights(i, own, shared) else { return false };
        let is_near = |frame: &&Sight<_>| (frame.time - own[own::TIME]).abs() * self.shots[i].fps <= LEFT_OUT;
        let squares: Vec<f64> = sights.iter().flatten().filter(is_near).map(Sight::square).collect();
        tail(squares.iter().sum(), 2.0 * squares.len() as f64) < POLICY.frame_tail
    }
}

/// Returns the table of what was measured.
fn list_impacts(solution: &Solution) -> Result<Vec<DiscImpact>, FilmError> {
    let (block, end) = (solution.problem.discs().ok_or(FilmError::NoFilm)?, &solution.at);
    let reduced = end.reduced().ok_or(FilmError::Undetermined)?;
    let mut with_all = block.clone();
    with_all.choose_frames(&end.state, 0.0);
    let impact = |i: usize| {
        let (shot, own) = (&block.shots[i], &end.state.own[0][i]);
        let motion = follow(shot.stuck.is_some(), own, &end.state.shared, &block.discs)?;
        let measure = |(column, quantity): (&'static str, Option<Dual>)| {
            let measured = |quantity: Dual| {
                let by = by_unknowns(&quantity, own.len());
                let is_stated = column == "mass_ratio" && block.discs.masses.is_some();
                let sd = (!is_stated).then(|| solution.covariance.variance(reduced, (0, i), &by).sqrt());
                Measured { value: quantity.re, sd }
            };
            let restitution = shot.stuck.map(|stuck| stuck.restitution).filter(|_| column == "e");
            (column, restitution.or_else(|| quantity.map(measured)))
        };
        let values = motion.quantities(shot, &block.discs).into_iter().map(measure).collect();
        let used = |track: &PointTrack| -> Vec<(usize, f64)> {
            track.frames.iter().filter(|frame| frame.used).map(|frame| (track.disc, frame.time)).collect()
        };
        let mut times: Vec<(usize, f64)> = shot.tracks.iter().flat_map(used).collect();
        times.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        times.dedup();
        let ends = [f64::min, f64::max].map(|of| times.iter().map(|(_, time)| *time).reduce(of));
        Some(DiscImpact {
            name: solution.names()[i].clone(),
            values,
            position_sd: block.variances(i).into_iter().fold(0.0, f64::max).sqrt(),
            misfit: block.misfit(i),
            frames: times.len(),
            window: [ends[0]?, ends[1]?],
            touches: shot.stuck.is_none() && with_all.touches(i, own, &end.state.shared),
            outliers: shot.outliers,
            radii: motion.radii.map(|radius| radius.re),
            stuck: shot.stuck,
            doubts: Vec::new(),
            paths: PicturePaths::new(
                motion.pieces.each_ref().map(|sides| &sides[..]),
                |at, late| (at.try_into().map_or(Point::zeros(), |at| locate::<f64>(at, late, None)), 0.0),
                own[own::TIME],
                Camera::new(&end.state.shared),
                block.shots[i].fps,
            ),
            film: (solution.record.unit, solution.record.middle.into()),
        })
    };
    let impacts = (0..block.shots.len()).map(impact).collect::<Option<Vec<_>>>();
    impacts.ok_or(FilmError::Undetermined)
}
