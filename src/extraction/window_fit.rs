//! One least-squares fit of a shot's frames between two times.

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector, Dyn, QR};

use super::{Impact, Unusable, initial_guess};
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::numerics::least_squares;
use crate::numerics::least_squares::{Constraints, Options};
use crate::physics::collision::Coefficients;
use crate::trajectory::frames::{Frame, Frames};
use crate::trajectory::scene::{LiftPrior, Scene};
use crate::trajectory::shot_scene::{Lifted, ROLL_PRIOR, ShotScene};
use crate::trajectory::unknowns::{Unknowns, unknown};

/// A frame is wrong when a coordinate is this many standard deviations off…
const OUTLIER: f64 = 5.0;
/// …and fewer than this many in a row are: more is a motion that the model does not know.
const RUN: usize = 3;
/// Rounds of leaving out wrong frames.
const ROUNDS: usize = 4;

/// The separation at the impact may differ from 2R by so many of its standard errors…
const GAP_ERRORS: f64 = 5.0;
/// …or by this part of 2R, the precision of a calibration and of a radius.
const GAP_PART: f64 = 0.01;

/// Part of the closing speed that a lift is always uncertain by.
const LEAST_LIFT: f64 = 1e-3;

/// Less than this part of the closing speed upwards is stun.
const LEAST_VERTICAL: f64 = 1e-6;

/// A fit stops within some hundredths of a standard error of the minimum.
const ORTHOGONALITY: f64 = 3e-3;
const MAX_ITERATIONS: u32 = 100;

/// The lift that comes with an unknown spin follows it in so many rounds.
const ROLL_ROUNDS: usize = 3;

/// What became of a search that lost the collision.
pub(crate) const AWAY: &str = "the cue ball does not come towards the object ball";

/// |J_z| is at most this part of the closing speed: μ(1 + e)/2 with μ = 0.5.
const MOST_LIFT: f64 = 0.5;

/// A shot with all that its fits share.
pub(crate) struct Tracked<'a> {
    pub shot: &'a TrackShot,
    pub scene: &'a Scene,
    pub model: ShotScene,
    /// Noise from second differences, m.
    pub noise: f64,
    /// Instants of the cue ball's and the object ball's frames that fit none of their neighbours.
    pub alone: [Vec<f64>; 2],
    /// What stands for the noise where the track gives none: stated, else from second differences.
    pub sd: f64,
    /// All frames of the shot.
    all: Frames<'a>,
}

/// A fit of the frames between two times.
pub(crate) struct Fitted {
    pub z: Unknowns,
    /// First and last instant, s.
    pub window: [f64; 2],
    /// Instants of the frames left out as wrong, of the cue ball and of the object ball.
    pub wrong: [Vec<f64>; 2],
    pub chi2: f64,
    pub dof: usize,
    pub converged: bool,
    pub termination: String,
    /// The unknowns that it changed, and the derivatives by them.
    pub free: Vec<usize>,
    pub jacobian: DMatrix<f64>,
    residuals: DVector<f64>,
    pub lift: Lifted,
    /// The prior of the lift, where the collision model gave it.
    pub lift_held: Option<(f64, f64)>,
    /// Of the cue ball before and after the impact, of the object ball after it.
    pub frames: [usize; 3],
}

impl Fitted {
    pub(crate) fn reduced(&self) -> f64 {
        self.chi2 / self.dof.max(1) as f64
    }
}

impl<'a> Tracked<'a> {
    pub(crate) fn new(shot: &'a TrackShot, scene: &'a Scene, noise: f64, spin: Spin) -> Self {
        let model = ShotScene::of(spin, scene);
        let alone = [&shot.cue, &shot.object].map(|samples| initial_guess::alone(samples, noise));
        let sd = shot.position_sd.unwrap_or(noise);
        Self { shot, scene, model, noise, alone, sd, all: Frames::of(shot, sd, noise) }
    }

    /// Fits the frames between two instants, without those that stand out alone.
    pub(crate) fn fit(&self, start: &Unknowns, window: [f64; 2]) -> Result<Fitted, Unusable> {
        let [from, to] = window;
        let mut wrong = self.alone.clone();
        let mut z = *start;
        let all = self.all.between(from, to, [&[], &[]]);
        for round in 0.. {
            let frames = self.without(window, &wrong);
            let fitted = self.fit_frames(&z, &frames, window)?;
            z = fitted.z;
            let residuals = all.residuals_only(&self.model, &z);
            let (of_cue, of_object) = residuals.as_slice().split_at(2 * all.cue.len());
            let far = OUTLIER * (self.noise / self.sd).max(1.0);
            let now = [outliers(&all.cue, of_cue, far), outliers(&all.object, of_object, far)];
            let same = now.iter().zip(&wrong).all(|(now, before)| now.iter().all(|t| before.contains(t)))
                && (all.count() - frames.count()) / 2 == now.iter().map(Vec::len).sum::<usize>();
            let unsettled = self.model.spin == Spin::Unknown && round < ROLL_ROUNDS;
            if (same && !unsettled) || round == ROUNDS {
                let inside =
                    |wrong: Vec<f64>| wrong.into_iter().filter(|t| (from..=to).contains(t)).collect();
                return Ok(Fitted { wrong: wrong.map(inside), ..fitted });
            }
            wrong = now;
        }
        Err(Unusable::NoCollision)
    }

    /// What is free and what is known beforehand, of unknowns near `start`.
    fn freedom(&self, start: &Unknowns) -> Freedom {
        let lift = self.model.lift(start);
        let mut start = *start;
        let gap_sd = self.scene.gap_sd;
        let mut free: Vec<usize> =
            (0..unknown::ROLLING).filter(|i| *i != unknown::GAP || gap_sd > 0.0).collect();
        let spin_is_unknown = self.model.spin == Spin::Unknown;
        free.retain(|i| *i != unknown::ROLL || spin_is_unknown);
        if lift == Lifted::Neither && !spin_is_unknown {
            start[unknown::LIFT] = 0.0;
            free.retain(|i| *i != unknown::LIFT);
        }
        let mut priors = vec![(unknown::SLIDING, self.scene.cloth.sliding, self.scene.sliding_sd)];
        if spin_is_unknown {
            priors.push((unknown::ROLL, ROLL_PRIOR.0, ROLL_PRIOR.1));
        }
        if gap_sd > 0.0 {
            priors.push((unknown::GAP, 0.0, gap_sd));
        }
        let mut lift_held = None;
        if lift != Lifted::Neither || spin_is_unknown {
            let (mean, sd) = self.lift_prior(&start);
            lift_held = matches!(self.scene.lift, LiftPrior::Model(..)).then_some((mean, sd));
            priors.push((unknown::LIFT, mean, sd));
            start[unknown::LIFT] = mean;
        }
        Freedom { start, free, priors, lift, lift_held }
    }

    fn fit_frames(&self, start: &Unknowns, frames: &Frames, window: [f64; 2]) -> Result<Fitted, Unusable> {
        let Freedom { start, free, priors, lift, lift_held } = self.freedom(start);
        let spin_is_unknown = self.model.spin == Spin::Unknown;
        let closing = start[unknown::BEFORE];
        if !(closing > 0.0 && start.iter().all(|unknown| unknown.is_finite())) {
            return Err(Unusable::NotConverged(AWAY.to_string()));
        }
        let bound = |low: bool| {
            let limit = |i: &usize| match (*i, low) {
                (unknown::LIFT | unknown::SLIDING, true) => 0.0,
                (unknown::LIFT, false) if spin_is_unknown => MOST_LIFT,
                (unknown::LIFT, false) => MOST_LIFT * closing,
                (unknown::SLIDING, false) => 1.0,
                (_, true) => f64::NEG_INFINITY,
                (_, false) => f64::INFINITY,
            };
            DVector::from_iterator(free.len(), free.iter().map(limit))
        };
        let constraints = Constraints::bounds(bound(true), bound(false));
        let x = DVector::from_iterator(free.len(), free.iter().map(|i| start[*i]));
        let x = x.zip_zip_map(&constraints.lower, &constraints.upper, |x, low, high| x.clamp(low, high));
        let problem = || Problem { frames, scene: &self.model, start, free: &free, priors: &priors };
        let options = Options { orthogonality: ORTHOGONALITY, max_iterations: MAX_ITERATIONS };
        // where a landing or the impact itself crosses a frame, the residuals have a kink
        let (solution, converged) = least_squares::minimise_rough(problem, &x, &constraints, &options)
            .map_err(|error| Unusable::NotConverged(error.to_string()))?;
        let z = problem().unknowns(&solution.x);
        let dof = (frames.independent() + priors.len()).saturating_sub(free.len());
        let count = |frames: &[Frame], after: bool| {
            frames.iter().filter(|frame| (frame.sample.t >= z[unknown::TIME]) == after).count()
        };
        Ok(Fitted {
            z,
            residuals: solution.residuals,
            window,
            wrong: Default::default(),
            chi2: 2.0 * solution.cost,
            dof,
            converged,
            termination: solution.termination.to_string(),
            free,
            jacobian: solution.jacobian,
            lift,
            lift_held,
            frames: [count(&frames.cue, false), count(&frames.cue, true), count(&frames.object, true)],
        })
    }

    /// One step of Gauss and Newton's method from `near`, over the frames that `impact` used; its errors are those of the
    /// motion there.
    pub(crate) fn linearised(&self, near: &Unknowns, impact: &Impact) -> Option<Impact> {
        let frames = self.without(impact.window, &impact.wrong);
        let Freedom { free, priors, lift, lift_held, .. } = self.freedom(near);
        let problem =
            Problem { frames: &frames, scene: &self.model, start: *near, free: &free, priors: &priors };
        let x = DVector::from_iterator(free.len(), free.iter().map(|i| near[*i]));
        let (residuals, jacobian) = (problem.apply(&x).ok()?, problem.jacobian(&x).ok()?);
        let qr = jacobian.clone().qr();
        let mut right = residuals.clone();
        qr.q_tr_mul(&mut right);
        let step = -qr.r().solve_upper_triangular(&right.rows(0, free.len()))?;
        let residuals = residuals + &jacobian * &step;
        let z = problem.unknowns(&(x + step));
        let dof = (frames.independent() + priors.len()).saturating_sub(free.len());
        let fitted = Fitted {
            z,
            window: impact.window,
            wrong: impact.wrong.clone(),
            chi2: residuals.norm_squared(),
            dof,
            converged: true,
            termination: String::new(),
            free,
            jacobian,
            residuals,
            lift,
            lift_held,
            frames: impact.frames,
        };
        Some(self.quantities(&fitted).ok()?.0)
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

    /// How far the separation at the impact would move from 2R if it were free, relative, with its
    /// standard error, and what χ² would fall by: one Gauss–Newton step.
    fn gap(&self, fitted: &Fitted) -> (f64, f64, f64) {
        let (_, full) = self.frames(fitted).residuals(&self.model, &fitted.z);
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

    /// How the unknowns move with μ_r, and what the frames tell of it: how far from what was assumed they agree with it best, one
    /// Gauss–Newton step, and 1/variance.
    pub(crate) fn rolling(&self, fitted: &Fitted, qr: &QR<f64, Dyn, Dyn>) -> (Unknowns, f64, f64) {
        let own = self.frames(fitted).by_rolling(&self.model, &fitted.z);
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

    /// The separation at the impact, where it is not 2R though it should be; χ² is that of the fit with it free.
    pub(crate) fn separation(&self, fitted: &Fitted) -> Option<(Unusable, f64)> {
        if self.scene.gap_sd > 0.0 {
            return None;
        }
        let (gap, error, explained) = self.gap(fitted);
        let reduced = fitted.reduced() - explained / fitted.dof.max(1) as f64;
        let error = error * if self.states_noise() { 1.0 } else { reduced.max(0.0).sqrt() };
        let expected = self.scene.contact_distance();
        let wrong =
            Unusable::Separation { measured: expected * (1.0 + gap), expected, error: expected * error };
        (gap.abs() > GAP_ERRORS * error && gap.abs() > GAP_PART).then_some((wrong, reduced))
    }

    /// χ² per degree of freedom with the noise that second differences show, where more was not stated: what the
    /// motion is judged by.
    pub(crate) fn misfit(&self, fitted: &Fitted) -> f64 {
        fitted.reduced() * (self.sd / self.noise).powi(2).min(1.0)
    }

    pub(crate) fn states_noise(&self) -> bool {
        let mut samples = self.shot.cue.iter().chain(&self.shot.object);
        self.shot.position_sd.is_some() || samples.all(|sample| sample.sd.is_some())
    }

    /// The frames that a fit used.
    pub(crate) fn frames(&self, fitted: &Fitted) -> Frames<'a> {
        self.without(fitted.window, &fitted.wrong)
    }

    /// The frames between two instants but for those that are wrong.
    fn without(&self, [from, to]: [f64; 2], wrong: &[Vec<f64>; 2]) -> Frames<'a> {
        self.all.between(from, to, wrong.each_ref().map(Vec::as_slice))
    }
}

/// What a fit may change.
struct Freedom {
    start: Unknowns,
    free: Vec<usize>,
    /// Unknown, mean, standard deviation.
    priors: Vec<(usize, f64, f64)>,
    lift: Lifted,
    lift_held: Option<(f64, f64)>,
}

/// Instants of the frames that are far off, alone or nearly so.
fn outliers(frames: &[Frame], residuals: &[f64], far: f64) -> Vec<f64> {
    let wrong: Vec<bool> = residuals.chunks(2).map(|xy| xy.iter().any(|r| r.abs() > far)).collect();
    let mut found = Vec::new();
    let mut i = 0;
    while i < wrong.len() {
        let run = wrong[i..].iter().take_while(|wrong| **wrong).count();
        if (1..RUN).contains(&run) {
            found.extend(frames[i..i + run].iter().map(|frame| frame.sample.t));
        }
        i += run.max(1);
    }
    found
}

/// The least-squares problem in the free unknowns.
struct Problem<'a> {
    frames: &'a Frames<'a>,
    scene: &'a ShotScene,
    start: Unknowns,
    free: &'a [usize],
    /// Unknown, mean, standard deviation.
    priors: &'a [(usize, f64, f64)],
}

impl Problem<'_> {
    fn unknowns(&self, x: &DVector<f64>) -> Unknowns {
        let mut z = self.start;
        for (i, value) in self.free.iter().zip(x.iter()) {
            z[*i] = *value;
        }
        z
    }
}

impl Operator for Problem<'_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        let z = self.unknowns(x);
        let residuals = self.frames.residuals_only(self.scene, &z);
        let priors = self.priors.iter().map(|(i, mean, sd)| (z[*i] - mean) / sd);
        let all = residuals.iter().copied().chain(priors);
        Ok(DVector::from_iterator(residuals.len() + self.priors.len(), all))
    }
}

impl Jacobian for Problem<'_> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        let (residuals, full) = self.frames.residuals(self.scene, &self.unknowns(x));
        let mut jacobian = DMatrix::zeros(residuals.len() + self.priors.len(), self.free.len());
        for (column, i) in self.free.iter().enumerate() {
            jacobian.view_mut((0, column), (full.nrows(), 1)).copy_from(&full.column(*i));
            for (row, (prior, _, sd)) in self.priors.iter().enumerate() {
                if prior == i {
                    jacobian[(residuals.len() + row, column)] = 1.0 / sd;
                }
            }
        }
        Ok(jacobian)
    }
}
