//! Two balls on a cloth as a fit of their frames sees them.

use nalgebra::{DMatrix, DVector, Dyn, QR};
use num_dual::Dual64;

use super::path_fit::{Fitted, Freedom, HOPELESS, Paths, Tracked};
use super::unusable::{Bodies, Unusable};
use super::wrong_frames::ACCELERATION;
use crate::measurement::spin::Spin;
use crate::physics::cloth_motion::Number;
use crate::physics::collision::Coefficients;
use crate::trajectory::both_balls::{Motion, with_derivatives};
use crate::trajectory::frames::Frames;
use crate::trajectory::scene::{LiftPrior, Scene};
use crate::trajectory::shot_scene::{Lifted, ROLL_PRIOR, ShotScene};
use crate::trajectory::unknowns::{Unknowns, unknown};

/// The separation at the impact may differ from 2R by so many of its standard errors…
const GAP_ERRORS: f64 = 5.0;
/// …or by this part of 2R, the precision of a calibration and of a radius.
const GAP_PART: f64 = 0.01;

/// Part of the closing speed that a lift is always uncertain by.
const LEAST_LIFT: f64 = 1e-3;

/// Less than this part of the closing speed upwards is stun.
const LEAST_VERTICAL: f64 = 1e-6;

/// The lift that comes with an unknown spin follows it in so many rounds.
const ROLL_ROUNDS: usize = 3;

/// What became of a search that lost the collision.
pub(crate) const AWAY: &str = "the cue ball does not come towards the object ball";

/// |J_z| is at most this part of the closing speed: μ(1 + e)/2 with μ = 0.5.
const MOST_LIFT: f64 = 0.5;

/// The unknowns of a shot whose spin is known, and of one whose is not.
const KNOWN: usize = unknown::ROLL;
const UNKNOWN: usize = unknown::ROLLING;

/// The balls of a shot.
pub(crate) struct BallPaths<'a> {
    pub scene: &'a Scene,
    pub model: ShotScene,
}

pub(crate) type TrackedBalls<'a> = Tracked<'a, BallPaths<'a>, { unknown::COUNT }>;
pub(crate) type FittedBalls = Fitted<{ unknown::COUNT }>;

impl<'a> BallPaths<'a> {
    pub(crate) fn new(scene: &'a Scene, spin: Spin) -> Self {
        Self { scene, model: ShotScene::of(spin, scene) }
    }

    fn spin_is_unknown(&self) -> bool {
        self.model.spin == Spin::Unknown
    }

    /// Mean and standard deviation of [`unknown::LIFT`].
    fn lift_prior(&self, z: &Unknowns) -> (f64, f64) {
        let vertical = z[unknown::BEFORE] * self.model.vertical(z);
        let (mean, sd) = self.vertical_impulse(z, vertical);
        match (self.model.spin, self.scene.lift) {
            (Spin::Unknown, LiftPrior::Published(mean, sd)) => (mean, sd),
            // without vertical slip the friction's first direction says nothing: J_n μ
            (Spin::Unknown, LiftPrior::Model(_, Coefficients { mu, e, .. }, sd))
                if !(vertical > LEAST_VERTICAL * z[unknown::BEFORE]) =>
            {
                let mean = 0.5 * mu * (1.0 + e);
                (mean, (sd * mean).max(LEAST_LIFT))
            }
            (Spin::Unknown, _) => (mean / vertical, sd / vertical),
            _ => (mean, sd),
        }
    }

    /// Mean and standard deviation of |J_z|.
    fn vertical_impulse(&self, z: &Unknowns, vertical: f64) -> (f64, f64) {
        match self.scene.lift {
            LiftPrior::Published(mean, sd) => (mean * vertical, sd * vertical),
            LiftPrior::Model(model, coefficients, sd) => {
                let lifted = model
                    .collide(&self.model.cue(z), &coefficients)
                    .map_or(0.0, |outcome| outcome.cue.velocity.z.max(outcome.object.velocity.z));
                // never quite certain, however small
                (lifted, (sd * lifted).max(LEAST_LIFT * vertical))
            }
        }
    }
}

/// Where a ball is at a time.
fn place<T: Number>(motion: &Motion<T>) -> impl Fn(usize, f64) -> [T; 2] {
    |ball, time| if ball == 0 { motion.cue(time) } else { motion.object(time) }
}

impl Paths<{ unknown::COUNT }> for BallPaths<'_> {
    const BODIES: Bodies = Bodies::Balls;
    const WOBBLES: bool = false;
    const ACCELERATION: f64 = ACCELERATION;

    fn residuals(&self, frames: &Frames, z: &Unknowns) -> DVector<f64> {
        frames.residuals(place(&Motion::new(&self.model, &(*z).into())))
    }

    fn with_derivatives(&self, frames: &Frames, z: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        if self.spin_is_unknown() {
            let motion = with_derivatives::<UNKNOWN>(&self.model, z);
            frames.with_derivatives(unknown::COUNT, place(&motion))
        } else {
            let motion = with_derivatives::<KNOWN>(&self.model, z);
            frames.with_derivatives(unknown::COUNT, place(&motion))
        }
    }

    fn freedom(&self, near: &Unknowns) -> Result<Freedom<{ unknown::COUNT }>, Unusable> {
        let closing = near[unknown::BEFORE];
        if !(closing > 0.0 && near.iter().all(|unknown| unknown.is_finite())) {
            return Err(Unusable::NotConverged(AWAY.to_string()));
        }
        let (gap_sd, spin_is_unknown) = (self.scene.gap_sd, self.spin_is_unknown());
        let is_lifted = spin_is_unknown || self.model.lift(near) != Lifted::Neither;
        let free = (0..unknown::ROLLING).filter(|i| match *i {
            unknown::GAP => gap_sd > 0.0,
            unknown::ROLL => spin_is_unknown,
            unknown::LIFT => is_lifted,
            _ => true,
        });
        let mut start = *near;
        let mut priors = vec![(unknown::SLIDING, self.scene.cloth.sliding, self.scene.sliding_sd)];
        if spin_is_unknown {
            priors.push((unknown::ROLL, ROLL_PRIOR.0, ROLL_PRIOR.1));
        }
        if gap_sd > 0.0 {
            priors.push((unknown::GAP, 0.0, gap_sd));
        }
        start[unknown::LIFT] = 0.0;
        if is_lifted {
            let (mean, sd) = self.lift_prior(&start);
            priors.push((unknown::LIFT, mean, sd));
            start[unknown::LIFT] = mean;
        }
        let mut bounds = [f64::NEG_INFINITY, f64::INFINITY].map(Unknowns::repeat);
        bounds[0][unknown::LIFT] = 0.0;
        bounds[1][unknown::LIFT] = if spin_is_unknown { MOST_LIFT } else { MOST_LIFT * closing };
        bounds[0][unknown::SLIDING] = 0.0;
        bounds[1][unknown::SLIDING] = 1.0;
        Ok(Freedom { start, free: free.collect(), priors, bounds })
    }

    fn rounds(&self) -> usize {
        if self.spin_is_unknown() { ROLL_ROUNDS } else { 0 }
    }

    fn misfits(tracked: &TrackedBalls, fitted: &FittedBalls) -> Option<Unusable> {
        let misfit = tracked.misfit(fitted);
        Some(match tracked.separation(fitted) {
            Some((wrong, reduced)) if reduced * misfit / fitted.reduced() < HOPELESS => wrong,
            _ => tracked.bad_fit(fitted),
        })
    }
}

impl TrackedBalls<'_> {
    /// How far the separation at the impact would move from 2R if it were free, relative, with its
    /// standard error, and what χ² would fall by: one Gauss–Newton step.
    fn gap(&self, fitted: &FittedBalls) -> (f64, f64, f64) {
        let (_, full) = self.paths.with_derivatives(&self.frames(fitted), &fitted.z);
        let mut with_gap = fitted.jacobian.clone().insert_column(fitted.jacobian.ncols(), 0.0);
        let last = with_gap.ncols() - 1;
        if with_gap.nrows() <= last {
            // as many unknowns as numbers leave nothing that could tell it
            return (0.0, f64::INFINITY, 0.0);
        }
        with_gap.view_mut((0, last), (full.nrows(), 1)).copy_from(&full.column(unknown::GAP));
        let mut right = -&fitted.residuals;
        let qr = with_gap.qr();
        qr.q_tr_mul(&mut right);
        let corner = qr.r()[(last, last)];
        (right[last] / corner, 1.0 / corner.abs(), right[last].powi(2))
    }

    /// The separation at the impact, where it is not 2R though it should be; χ² is that of the fit with it free.
    pub(crate) fn separation(&self, fitted: &FittedBalls) -> Option<(Unusable, f64)> {
        if self.paths.scene.gap_sd > 0.0 {
            return None;
        }
        let (gap, error, explained) = self.gap(fitted);
        let reduced = fitted.reduced() - explained / fitted.dof.max(1) as f64;
        let error = error * if self.states_noise() { 1.0 } else { reduced.max(0.0).sqrt() };
        let expected = self.paths.scene.contact_distance();
        let wrong = Unusable::Separation {
            bodies: Bodies::Balls,
            measured: expected * (1.0 + gap),
            expected,
            error: expected * error,
        };
        (gap.abs() > GAP_ERRORS * error && gap.abs() > GAP_PART).then_some((wrong, reduced))
    }

    /// How the unknowns move with μ_r, and what the frames tell of it: how far from what was assumed they agree with it best, one
    /// Gauss–Newton step, and 1/variance.
    pub(crate) fn rolling(&self, fitted: &FittedBalls, qr: &QR<f64, Dyn, Dyn>) -> (Unknowns, f64, f64) {
        // the derivatives by μ_r, which a single shot is given
        let mut dual: [Dual64; unknown::COUNT] = std::array::from_fn(|i| Dual64::from_re(fitted.z[i]));
        dual[unknown::ROLLING] = dual[unknown::ROLLING].derivative();
        let motion = Motion::new(&self.paths.model, &dual);
        let by = |ball, time| place(&motion)(ball, time).map(|dual| dual.eps);
        let own = self.frames(fitted).over_sd(by);
        let mut of_rolling = DVector::zeros(fitted.jacobian.nrows());
        of_rolling.rows_mut(0, own.nrows()).copy_from(&own);
        let mut by = Unknowns::zeros();
        by[unknown::ROLLING] = 1.0;
        let (mut residuals, free) = (fitted.residuals.clone(), fitted.free.len());
        qr.q_tr_mul(&mut of_rolling);
        qr.q_tr_mul(&mut residuals);
        let own = of_rolling.rows(0, free).into_owned();
        let Some(moved) = qr.r().solve_upper_triangular(&own) else { return (by, 0.0, 0.0) };
        for (i, moved) in fitted.free.iter().zip(moved.iter()) {
            by[*i] = -moved;
        }
        // what the other unknowns cannot make up for
        let rest = fitted.jacobian.nrows() - free;
        let (left, residuals) = (of_rolling.rows(free, rest), residuals.rows(free, rest));
        let information = left.norm_squared();
        let step = if information > 0.0 { -left.dot(&residuals) / information } else { 0.0 };
        (by, step, information)
    }
}
