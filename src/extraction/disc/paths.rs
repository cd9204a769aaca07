//! Two discs as a fit of their centres' frames sees them: straight paths before the impact, along which they slow down evenly, and after
//! it straight on or together.

use nalgebra::{DMatrix, DVector, SMatrix};
use num_dual::DualSVec64;

use super::slowing::{OwnSlowing, Slowing};
use super::unknowns::{COUNT, DIRECTION, DISTANCE, PLACE, SIDES, SLOWING, TIME, Unknowns, slowing, velocity};
use super::{Outcome, stick};
use crate::extraction::path_fit::{Errors, FIRST, Fitted, Freedom, Paths, Tracked};
use crate::extraction::unusable::{Bodies, Unusable};
use crate::film::discs::Calibrated;
use crate::physics::cloth_motion::Number;
use crate::trajectory::frames::Frames;

/// Radii and calibration are known to this part: the distance at the impact has a prior so wide.
const RADII_PART: f64 = 0.01;
/// A distance that is further off, in standard deviations, is another one.
const SEPARATION: f64 = 5.0;

/// Discs that stick need more frames to begin with: they settle for some frames, in which the glue gives way: what
/// is left of that shifts the paths by less than the noise, but velocities of few frames by more than theirs.
const FIRST_SETTLING: usize = 30;

/// A disc slower than this part of the relative speed counts as at rest: its deceleration goes to 0 with its speed, whose direction is noise.
const AT_REST: f64 = 0.02;
/// Keeps the speed a smooth function of the velocity, as a part of that speed.
const SMOOTH: f64 = 1e-3;

/// Standard deviation of a line of centres that is an axis of the film, rad: far less than matters.
const KNOWN_DIRECTION: f64 = 1e-6;

/// Even next to the impact, this part of the distance is no collision.
const HOPELESS_PART: f64 = 0.02;

/// The place of a disc (0 or 1) at a time.
pub(super) fn place<T: Number>(outcome: Outcome, z: &[T; COUNT], disc: usize, time: f64) -> [T; 2] {
    let is_after = time >= z[TIME].re();
    if outcome == Outcome::Stick && is_after {
        return stick::place(z, disc, time);
    }
    let side = usize::from(is_after);
    let first = velocity(disc, side);
    let (sin, cos) = z[DIRECTION].sin_cos();
    let apart = z[DISTANCE] * disc as f64;
    let moving = slowed(z, (disc, side), -z[TIME] + time);
    [z[PLACE] + apart * cos + z[first] * moving, z[PLACE + 1] + apart * sin + z[first + 1] * moving]
}

/// Returns the time in which a disc with constant velocity would go as far as it does in the time `late` from the impact while it slows down,
/// until it stops.
fn slowed<T: Number>(z: &[T; COUNT], (disc, side): (usize, usize), late: T) -> T {
    let (first, slowing) = (velocity(disc, side), z[slowing(disc, side)]);
    let relative = [0, 1].map(|k| z[velocity(1, 0) + k] - z[velocity(0, 0) + k]);
    let square = |[x, y]: [T; 2]| x * x + y * y;
    let own = square([z[first], z[first + 1]]);
    let least = square(relative) * (AT_REST * AT_REST);
    if !(least.re() > 0.0) {
        return late;
    }
    // by which part of itself the velocity decreases in a unit of time
    let rate = slowing * (own + least * (SMOOTH * SMOOTH)).sqrt() / (own + least);
    let stops = late.re() * rate.re() > 1.0;
    let slows = if stops { rate.recip() } else { late };
    slows - rate * slows * slows * 0.5
}

/// The discs of a shot.
pub(super) struct DiscPaths {
    /// The distance at the impact that the radii say, m.
    pub expected: Option<f64>,
    /// Of discs that stick together: from when to when they settle.
    pub settling: Option<[f64; 2]>,
    pub slowing: Slowing,
    /// Whether one coordinate never changes, so that the line of centres is known.
    pub is_one_dimensional: bool,
}

pub(super) type TrackedDiscs<'a> = Tracked<'a, DiscPaths, COUNT>;
pub(super) type FittedDiscs = Fitted<COUNT>;

/// Unknowns with their covariance.
pub(super) struct Centres {
    pub unknowns: Unknowns,
    pub covariance: SMatrix<f64, COUNT, COUNT>,
    /// How the unknowns move in each way in which the camera, or what slows the discs down, may be off.
    pub by_camera: Vec<Unknowns>,
    /// What these frames alone determine of the decelerations; `None` if these were held.
    pub slowing: Option<OwnSlowing>,
}

impl DiscPaths {
    fn outcome(&self) -> Outcome {
        if self.settling.is_some() { Outcome::Stick } else { Outcome::Part }
    }
}

impl Paths<COUNT> for DiscPaths {
    const BODIES: Bodies = Bodies::Discs;
    const WOBBLES: bool = true;
    const ACCELERATION: f64 = 0.0;

    fn residuals(&self, frames: &Frames, z: &Unknowns) -> DVector<f64> {
        let z = (*z).into();
        frames.residuals(|disc, time| place(self.outcome(), &z, disc, time))
    }

    fn with_derivatives(&self, frames: &Frames, z: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        let z: [DualSVec64<COUNT>; COUNT] = std::array::from_fn(|i| DualSVec64::from_re(z[i]).derivative(i));
        frames.with_derivatives(COUNT, |disc, time| place(self.outcome(), &z, disc, time))
    }

    fn freedom(&self, near: &Unknowns) -> Result<Freedom<COUNT>, Unusable> {
        let distance = self.expected.map(|expected| (DISTANCE, expected, RADII_PART * expected));
        let [part, sd] = stick::PART;
        let of_second = self.settling.map(|_| (stick::OF_SECOND, part, sd));
        let Slowing { mean, shot_sd, .. } = self.slowing;
        let slows = shot_sd > 0.0;
        let of_sides = (SLOWING..COUNT).filter(|_| slows).map(|i| (i, mean, shot_sd));
        let mut start = *near;
        if !slows {
            start.rows_mut(SLOWING, SIDES).fill(mean);
        }
        let is_held = |i: usize| match i {
            SLOWING..COUNT => !slows,
            _ => i == DIRECTION && self.is_one_dimensional,
        };
        Ok(Freedom {
            start,
            free: (0..COUNT).filter(|i| !is_held(*i)).collect(),
            priors: distance.into_iter().chain(of_second).chain(of_sides).collect(),
            bounds: [f64::NEG_INFINITY, f64::INFINITY].map(Unknowns::repeat),
        })
    }

    fn settled(&self, impact: f64) -> f64 {
        self.settling.map_or(impact, |[_, settled]| settled)
    }

    fn first_frames(&self) -> usize {
        if self.settling.is_some() { FIRST_SETTLING } else { FIRST }
    }

    fn misfits(tracked: &TrackedDiscs, fitted: &FittedDiscs) -> Option<Unusable> {
        let bad = tracked.bad_fit(fitted);
        let far = HOPELESS_PART * fitted.z[DISTANCE];
        (fitted.reduced().sqrt() * tracked.sd > far).then_some(bad)
    }
}

impl TrackedDiscs<'_> {
    /// Unknowns and covariance of a fit that can be believed.
    ///
    /// # Errors
    /// Why it cannot.
    pub(super) fn centres(
        &self,
        fitted: &FittedDiscs,
        camera: Option<&Calibrated>,
    ) -> Result<Centres, Unusable> {
        fitted.converged()?;
        let Errors { inverse, factor, .. } = self.errors(fitted)?;
        let mut of_all = SMatrix::<f64, COUNT, COUNT>::zeros();
        for (row, i) in fitted.free.iter().enumerate() {
            for (column, j) in fitted.free.iter().enumerate() {
                of_all[(*i, *j)] = inverse[(row, column)];
            }
        }
        let by_camera = self.by_film(fitted, camera, &inverse);
        let slowing = self.paths.slowing.of_shot(
            fitted.z.fixed_rows::<SIDES>(SLOWING).into_owned(),
            of_all.fixed_view::<SIDES, SIDES>(SLOWING, SLOWING).into_owned(),
            factor,
        );
        let mut covariance = of_all * factor;
        if self.paths.is_one_dimensional {
            covariance[(DIRECTION, DIRECTION)] = KNOWN_DIRECTION * KNOWN_DIRECTION;
        }
        if let Some(expected) = self.paths.expected {
            let error = f64::sqrt(covariance[(DISTANCE, DISTANCE)]);
            let measured = fitted.z[DISTANCE];
            if (measured - expected).abs() > SEPARATION * error.hypot(RADII_PART * expected) {
                return Err(Unusable::Separation { bodies: Bodies::Discs, measured, expected, error });
            }
        }
        // (sin, cos) of the line of centres
        let (n, g) = (fitted.z[DIRECTION].sin_cos(), velocity(1, 0));
        let closing = (fitted.z[g] - fitted.z[g - 2]) * n.1 + (fitted.z[g + 1] - fitted.z[g - 1]) * n.0;
        if closing >= 0.0 {
            return Err(Unusable::NoCollision(Bodies::Discs));
        }
        Ok(Centres { unknowns: fitted.z, covariance, by_camera, slowing })
    }

    /// (JᵀJ)⁻¹ Jᵀδ, δ by how much the frames move, in standard deviations, in each way in which the camera may be off, and with discs that
    /// slow down more. A centre that was computed from points moves as a centre that was seen: what bends their circle goes round with them.
    fn by_film(
        &self,
        fitted: &FittedDiscs,
        camera: Option<&Calibrated>,
        inverse: &DMatrix<f64>,
    ) -> Vec<Unknowns> {
        /// Seconds: paths are smooth over far more.
        const STEP: f64 = 1e-7;
        let z = fitted.z.into();
        let at = |disc: usize, time: f64| place(self.paths.outcome(), &z, disc, time);
        let velocity = |disc: usize, time: f64| {
            let (before, after) = (at(disc, time - STEP), at(disc, time + STEP));
            [0, 1].map(|k| (after[k] - before[k]) / (2.0 * STEP))
        };
        let frames = self.frames(fitted);
        let unknowns = |moves: DVector<f64>| {
            let right = fitted.jacobian.rows(0, moves.len()).tr_mul(&moves);
            let step = inverse * right;
            let mut unknowns = Unknowns::zeros();
            fitted.free.iter().zip(step.iter()).for_each(|(i, step)| unknowns[*i] = *step);
            unknowns
        };
        let of_camera =
            camera.into_iter().flat_map(|camera| (0..camera.ways.len()).map(move |way| (camera, way)));
        let of_camera = of_camera.map(|(camera, way)| {
            frames.over_sd(|disc, time| camera.moves(at(disc, time), velocity(disc, time))[way])
        });
        let of_slowing = (self.paths.slowing.shared_sd > 0.0).then(|| {
            let (_, by) = self.paths.with_derivatives(&frames, &fitted.z);
            by.columns(SLOWING, SIDES).column_sum() * self.paths.slowing.shared_sd
        });
        of_camera.chain(of_slowing).map(unknowns).collect()
    }
}
