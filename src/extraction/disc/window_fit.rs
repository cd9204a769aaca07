//! One least-squares fit of both discs' centres through the instant of impact, and the window that it is
//! valid in.

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector, SMatrix};

use super::lines::{LEAST, repeated};
use super::unknowns::{COUNT, DIRECTION, DISTANCE, PLACE, TIME, Unknowns, velocity};
use super::{Outcome, Unusable, stick};
use crate::extraction::frame_noise::noise_of;
use crate::film::discs::Calibrated;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::least_squares;
use crate::numerics::least_squares::{Constraints, Options, Termination};
use crate::numerics::median;
use crate::physics::disc::Discs;

/// A frame is wrong when a coordinate is this many standard deviations off, of those of its window…
const OUTLIER: f64 = 5.0;
/// …and fewer than this many in a row are.
const RUN: usize = 3;
const ROUNDS: usize = 6;

/// Radii and calibration are known to this part: the distance at the impact has a prior so wide.
const RADII_PART: f64 = 0.01;
/// A distance that is further off, in standard deviations, is another one.
const SEPARATION: f64 = 5.0;

/// Frames on either side: at first, at most, and by how much a window grows.
const FIRST: usize = 8;
/// Discs that stick settle for some frames, in which the glue gives way: what is left of that shifts the paths by less than the noise,
/// but velocities of few frames by more than theirs.
const FIRST_SETTLING: usize = 30;
const MOST: usize = 120;
const GROWTH: f64 = 1.4;
/// A window grows while the mean square of each disc's residuals on that side stays within this many of its
/// standard deviations, and this part, of that next to the impact.
const SPREADS: f64 = 3.0;
const SLACK: f64 = 0.3;
/// Even next to the impact, so much more than the noise, and this part of the distance, is no collision.
const HOPELESS: f64 = 10.0;
const HOPELESS_PART: f64 = 0.02;

/// So many frames on either side tell the noise.
const NOISE_FRAMES: f64 = 30.0;

const ORTHOGONALITY: f64 = 1e-6;
const MAX_ITERATIONS: u32 = 60;

/// The place of a disc (0 or 1) at a time.
pub(super) fn place(outcome: Outcome, z: &Unknowns, disc: usize, time: f64) -> [f64; 2] {
    if outcome == Outcome::Stick && time >= z[TIME] {
        return stick::place(z, disc, time);
    }
    let late = time - z[TIME];
    let first = velocity(disc, usize::from(late >= 0.0));
    let (sin, cos) = z[DIRECTION].sin_cos();
    let apart = if disc == 0 { 0.0 } else { z[DISTANCE] };
    [z[PLACE] + apart * cos + z[first] * late, z[PLACE + 1] + apart * sin + z[first + 1] * late]
}

/// A shot with all that its fits share.
pub(super) struct Tracked<'a> {
    shot: &'a TrackShot,
    /// Mean of the distance at the impact, m.
    expected: Option<f64>,
    /// Noise from second differences near the impact, m.
    noise: f64,
    /// Of discs that stick together: from when to when they settle.
    settling: Option<[f64; 2]>,
}

/// A fit of the frames between two times.
pub(super) struct Fitted {
    z: Unknowns,
    pub window: [f64; 2],
    wrong: [Vec<f64>; 2],
    chi2: f64,
    dof: usize,
    jacobian: DMatrix<f64>,
    failed: Option<String>,
}

/// Unknowns with their covariance.
pub(super) struct Centres {
    pub unknowns: Unknowns,
    pub covariance: SMatrix<f64, COUNT, COUNT>,
    /// How the unknowns move in each way in which the camera, or what slows the discs down, may be off.
    pub by_camera: Vec<Unknowns>,
    pub position_sd: f64,
    pub reduced_chi2: f64,
}

type Frame<'a> = (&'a Sample, [f64; 2]);

impl<'a> Tracked<'a> {
    pub(super) fn new(
        shot: &'a TrackShot,
        discs: &Discs,
        guess: &Unknowns,
        settling: Option<[f64; 2]>,
    ) -> Self {
        let reach = NOISE_FRAMES / shot.fps;
        let near = [&shot.cue, &shot.object].map(|samples| {
            let [from, to] =
                [-reach, reach].map(|late| samples.partition_point(|s| s.t < guess[TIME] + late));
            &samples[from..to]
        });
        let expected = discs.radii.map(|[first, second]| first + second);
        Self {
            shot,
            expected,
            noise: noise_of(near, shot.resolution, (shot.fps, shot.correlation)),
            settling,
        }
    }

    fn outcome(&self) -> Outcome {
        if self.settling.is_some() { Outcome::Stick } else { Outcome::Part }
    }

    fn sd(&self) -> f64 {
        self.shot.position_sd.unwrap_or(self.noise)
    }

    fn frames(&self, [from, to]: [f64; 2], wrong: &[Vec<f64>; 2]) -> [Vec<Frame<'a>>; 2] {
        let of = |samples: &'a [Sample], wrong: &[f64]| {
            let [settles, settled] = self.settling.unwrap_or([f64::NAN; 2]);
            let settling = |t: f64| t > settles && t < settled;
            let used = samples.iter().filter(|s| (from..=to).contains(&s.t) && !wrong.contains(&s.t));
            let used = used.filter(|s| !settling(s.t));
            used.map(|s| (s, s.sd.unwrap_or([self.sd(); 2]))).collect()
        };
        [of(&self.shot.cue, &wrong[0]), of(&self.shot.object, &wrong[1])]
    }

    /// Fits the frames between two times, without those that are wrong alone.
    fn fit(&self, guess: &Unknowns, window: [f64; 2]) -> Result<Fitted, Unusable> {
        let all = self.frames(window, &[Vec::new(), Vec::new()]);
        let mut fitted: Option<Fitted> = None;
        for _ in 0..ROUNDS {
            let z = fitted.as_ref().map_or(guess, |fitted| &fitted.z);
            // the scatter by medians: wrong frames are not to hide each other
            let off = [0, 1].map(|disc| {
                all[disc].iter().map(|frame| worst(self.outcome(), z, disc, frame)).collect::<Vec<_>>()
            });
            let middle = median(off.iter().flatten().copied().collect());
            // the median of the larger of two absolute normal deviates is 1.05
            let most = OUTLIER * (middle / 1.05).max(1.0);
            let wrong = [0, 1].map(|disc| alone(&all[disc], &off[disc], most));
            if fitted.as_ref().is_some_and(|fitted| fitted.wrong == wrong) {
                break;
            }
            fitted = Some(self.fit_without(z, window, wrong)?);
        }
        fitted.ok_or(Unusable::NoCollision)
    }

    fn fit_without(
        &self,
        guess: &Unknowns,
        window: [f64; 2],
        wrong: [Vec<f64>; 2],
    ) -> Result<Fitted, Unusable> {
        let frames = self.frames(window, &wrong);
        for (disc, frames) in frames.iter().enumerate() {
            let after = frames.iter().filter(|(s, _)| s.t >= guess[TIME]).count();
            for (when, count) in [("before", frames.len() - after), ("after", after)] {
                if count < LEAST {
                    let disc = ["first", "second"][disc];
                    return Err(Unusable::TooFew { disc, when, frames: count });
                }
            }
        }
        let problem = || Problem { frames: &frames, expected: self.expected, outcome: self.outcome() };
        let none = DVector::from_element(COUNT, f64::INFINITY);
        let constraints = Constraints::bounds(-&none, none);
        let x = DVector::from_column_slice(guess.as_slice());
        let options = Options { orthogonality: ORTHOGONALITY, max_iterations: MAX_ITERATIONS };
        let solution = least_squares::minimise(problem(), &x, &constraints, &options)
            .map_err(|error| Unusable::NotConverged(error.to_string()))?;
        let rows = problem().rows();
        // where the impact itself crosses a frame, the residuals have a kink
        let converged = solution.termination.converged() || solution.termination == Termination::Stalled;
        Ok(Fitted {
            z: Unknowns::from_column_slice(solution.x.as_slice()),
            window,
            wrong,
            chi2: 2.0 * solution.cost,
            dof: rows.saturating_sub(COUNT),
            jacobian: solution.jacobian,
            failed: (!converged).then(|| solution.termination.to_string()),
        })
    }

    /// The widest window whose fit is as good as that next to the impact.
    pub(super) fn choose(&self, guess: &Unknowns) -> Result<Fitted, Unusable> {
        let frame = 1.0 / self.shot.fps;
        let window = |[before, after]: [usize; 2]| {
            let reach = |frames: usize| (frames as f64 + 0.5) * frame;
            let settled = self.settling.map_or(guess[TIME], |[_, settled]| settled);
            [guess[TIME] - reach(before), settled + reach(after)]
        };
        let first = if self.settling.is_some() { FIRST_SETTLING } else { FIRST };
        let mut best = self.fit(guess, window([first; 2]))?;
        let rms = best.reduced().sqrt() * self.sd();
        if best.reduced() > HOPELESS && rms > HOPELESS_PART * best.z[DISTANCE] {
            return Err(Unusable::BadFit { rms_mm: 1e3 * rms });
        }
        let next_to_impact = best.reduced().max(1.0);
        let mut sides = [first; 2];
        for side in [1, 0] {
            while sides[side] < MOST {
                let mut wider = sides;
                wider[side] = ((sides[side] as f64 * GROWTH) as usize).min(MOST);
                let Ok(next) = self.fit(&best.z, window(wider)) else { break };
                let good = |disc: usize| {
                    let residuals = self.residuals(&next, disc, side == 1);
                    let n = 2.0 * residuals.len() as f64;
                    let square = residuals.iter().flatten().map(|r| r * r).sum::<f64>() / n;
                    square < next_to_impact * (1.0 + SLACK + SPREADS * (2.0 / n).sqrt())
                };
                if next.failed.is_some() || !(good(0) && good(1)) {
                    break;
                }
                (best, sides) = (next, wider);
            }
        }
        Ok(best)
    }

    /// What a fit leaves of a disc before or after the impact, in standard deviations, in the order of time.
    fn residuals(&self, fitted: &Fitted, disc: usize, after: bool) -> Vec<[f64; 2]> {
        let frames = &self.frames(fitted.window, &fitted.wrong)[disc];
        let side = frames.iter().filter(|(s, _)| (s.t >= fitted.z[TIME]) == after);
        let left = side.map(|(s, sd)| {
            let [x, y] = place(self.outcome(), &fitted.z, disc, s.t);
            [(s.x - x) / sd[0], (s.y - y) / sd[1]]
        });
        left.collect()
    }

    /// [`repeated`] of all that a fit leaves.
    fn repeated(&self, fitted: &Fitted) -> f64 {
        let sides = [(0, false), (0, true), (1, false), (1, true)];
        let runs = sides.into_iter().flat_map(|(disc, after)| {
            let residuals = self.residuals(fitted, disc, after);
            [0, 1].map(|k| residuals.iter().map(|r| r[k]).collect())
        });
        repeated(&runs.collect::<Vec<Vec<f64>>>())
    }

    /// Unknowns and covariance of a fit that can be believed.
    /// `slowing_sd`: how far wrong it may be by how much the discs slow down, m/s².
    pub(super) fn checked(
        &self,
        fitted: &Fitted,
        (camera, slowing_sd): (Option<&Calibrated>, Option<f64>),
    ) -> Result<Centres, Unusable> {
        if let Some(reason) = &fitted.failed {
            return Err(Unusable::NotConverged(reason.clone()));
        }
        let stated = self.shot.position_sd.is_some()
            || self.shot.cue.iter().chain(&self.shot.object).all(|sample| sample.sd.is_some());
        // noise that is not stated is estimated from these residuals
        let factor = if stated { 1.0 } else { fitted.reduced() };
        let r = fitted.jacobian.clone().qr().r();
        let inverse = r
            .solve_upper_triangular(&DMatrix::identity(COUNT, COUNT))
            .ok_or_else(|| Unusable::NotConverged("its unknowns are not determined".to_string()))?;
        let inverse = &inverse * inverse.transpose();
        let by_camera = self.by_film(fitted, (camera, slowing_sd), &inverse);
        let covariance = factor * self.repeated(fitted) * inverse;
        let covariance = SMatrix::from_fn(|i, j| 0.5 * (covariance[(i, j)] + covariance[(j, i)]));
        if let Some(expected) = self.expected {
            let error = covariance[(DISTANCE, DISTANCE)].sqrt();
            let measured = fitted.z[DISTANCE];
            if (measured - expected).abs() > SEPARATION * error.hypot(RADII_PART * expected) {
                return Err(Unusable::Separation { measured, expected, error });
            }
        }
        // (sin, cos) of the line of centres
        let (n, g) = (fitted.z[DIRECTION].sin_cos(), velocity(1, 0));
        let closing = (fitted.z[g] - fitted.z[g - 2]) * n.1 + (fitted.z[g + 1] - fitted.z[g - 1]) * n.0;
        if closing >= 0.0 {
            return Err(Unusable::NoCollision);
        }
        Ok(Centres {
            unknowns: fitted.z,
            covariance,
            by_camera,
            position_sd: self.sd() * factor.sqrt(),
            reduced_chi2: fitted.reduced() * (self.sd() / self.noise).powi(2),
        })
    }
}

impl Tracked<'_> {
    /// (JᵀJ)⁻¹ Jᵀδ, δ by how much the frames move, in standard deviations, in each way in which the camera may be off, and with discs that
    /// slow down more. A centre that was computed from points moves as a centre that was seen: what bends their circle goes round with them.
    fn by_film(
        &self,
        fitted: &Fitted,
        (camera, slowing_sd): (Option<&Calibrated>, Option<f64>),
        inverse: &DMatrix<f64>,
    ) -> Vec<Unknowns> {
        /// Seconds: paths are smooth over far more.
        const STEP: f64 = 1e-7;
        let at = |disc: usize, time: f64| place(self.outcome(), &fitted.z, disc, time);
        let ways = camera.map_or(0, |camera| camera.ways.len()) + usize::from(slowing_sd.is_some());
        let mut right = vec![DVector::zeros(COUNT); ways];
        let mut row = 0;
        for (disc, frames) in self.frames(fitted.window, &fitted.wrong).iter().enumerate() {
            for (sample, sd) in frames {
                let (before, after) = (at(disc, sample.t - STEP), at(disc, sample.t + STEP));
                let velocity = [0, 1].map(|k| (after[k] - before[k]) / (2.0 * STEP));
                let of_camera =
                    camera.map_or_else(Vec::new, |camera| camera.moves(at(disc, sample.t), velocity));
                let late = sample.t - fitted.z[TIME];
                let speed = velocity[0].hypot(velocity[1]).max(f64::MIN_POSITIVE);
                let of_slowing = slowing_sd.map(|sd| velocity.map(|v| 0.5 * sd * late * late * v / speed));
                for (right, moves) in right.iter_mut().zip(of_camera.into_iter().chain(of_slowing)) {
                    for k in 0..2 {
                        *right += fitted.jacobian.row(row + k).transpose() * (moves[k] / sd[k]);
                    }
                }
                row += 2;
            }
        }
        right.iter().map(|right| Unknowns::from_column_slice((inverse * right).as_slice())).collect()
    }
}

impl Fitted {
    fn reduced(&self) -> f64 {
        self.chi2 / self.dof.max(1) as f64
    }

    pub(super) fn outliers(&self) -> usize {
        self.wrong.iter().map(Vec::len).sum()
    }

    /// The first disc before and after, the second before and after.
    pub(super) fn frames(&self, tracked: &Tracked) -> [usize; 4] {
        let frames = tracked.frames(self.window, &self.wrong);
        let count = |disc: usize, after: bool| {
            frames[disc].iter().filter(|(s, _)| (s.t >= self.z[TIME]) == after).count()
        };
        [count(0, false), count(0, true), count(1, false), count(1, true)]
    }
}

/// The larger residual of a frame's coordinates, in standard deviations.
fn worst(outcome: Outcome, z: &Unknowns, disc: usize, (sample, sd): &Frame) -> f64 {
    let [x, y] = place(outcome, z, disc, sample.t);
    ((sample.x - x) / sd[0]).abs().max(((sample.y - y) / sd[1]).abs())
}

/// Instants of the frames that are far off, alone or nearly so.
fn alone(frames: &[Frame], off: &[f64], most: f64) -> Vec<f64> {
    let mut found = Vec::new();
    let mut i = 0;
    while i < off.len() {
        let run = off[i..].iter().take_while(|off| **off > most).count();
        if (1..RUN).contains(&run) {
            found.extend(frames[i..i + run].iter().map(|(sample, _)| sample.t));
        }
        i += run.max(1);
    }
    found
}

/// The least-squares problem.
struct Problem<'a> {
    frames: &'a [Vec<Frame<'a>>; 2],
    expected: Option<f64>,
    outcome: Outcome,
}

impl Problem<'_> {
    /// Two a frame, and the priors.
    fn rows(&self) -> usize {
        let priors = usize::from(self.expected.is_some()) + usize::from(self.outcome == Outcome::Stick);
        2 * (self.frames[0].len() + self.frames[1].len()) + priors
    }

    fn evaluate(&self, x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let z = Unknowns::from_column_slice(x.as_slice());
        let rows = self.rows();
        let (mut residuals, mut jacobian) = (DVector::zeros(rows), DMatrix::zeros(rows, COUNT));
        let (sin, cos) = z[DIRECTION].sin_cos();
        let mut row = 0;
        for (disc, frames) in self.frames.iter().enumerate() {
            for (sample, sd) in frames {
                let late = sample.t - z[TIME];
                let first = velocity(disc, usize::from(late >= 0.0));
                let predicted = place(self.outcome, &z, disc, sample.t);
                let stuck = (self.outcome == Outcome::Stick && late >= 0.0)
                    .then(|| stick::derivatives(&z, disc, sample.t));
                for (k, measured) in [sample.x, sample.y].into_iter().enumerate() {
                    residuals[row] = (predicted[k] - measured) / sd[k];
                    if let Some(derivatives) = &stuck {
                        jacobian.row_mut(row).copy_from(&(derivatives[k].transpose() / sd[k]));
                        row += 1;
                        continue;
                    }
                    jacobian[(row, TIME)] = -z[first + k] / sd[k];
                    jacobian[(row, PLACE + k)] = 1.0 / sd[k];
                    jacobian[(row, first + k)] = late / sd[k];
                    if disc == 1 {
                        jacobian[(row, DISTANCE)] = [cos, sin][k] / sd[k];
                        jacobian[(row, DIRECTION)] = z[DISTANCE] * [-sin, cos][k] / sd[k];
                    }
                    row += 1;
                }
            }
        }
        if let Some(expected) = self.expected {
            let sd = RADII_PART * expected;
            residuals[row] = (z[DISTANCE] - expected) / sd;
            jacobian[(row, DISTANCE)] = 1.0 / sd;
            row += 1;
        }
        if self.outcome == Outcome::Stick {
            let [part, sd] = stick::PART;
            residuals[row] = (z[stick::OF_SECOND] - part) / sd;
            jacobian[(row, stick::OF_SECOND)] = 1.0 / sd;
        }
        (residuals, jacobian)
    }
}

impl Operator for Problem<'_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        Ok(self.evaluate(x).0)
    }
}

impl Jacobian for Problem<'_> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        Ok(self.evaluate(x).1)
    }
}
