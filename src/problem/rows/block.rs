//! The shots of a table as a block, and the prediction of their numbers.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use num_dual::DualNum;
use rayon::prelude::*;

use super::shot::{Deviations, INPUTS, Row, RowShot, SPEED, Unpredictable};
use crate::measurement::dataset::{Dataset, Measurement, Shot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::{Axis, Observable};
use crate::numerics::{EXACT, wrap};
use crate::physics::ball::BallState;
use crate::physics::collision::{Coefficients, Model, NotACollision};
use crate::physics::friction_law::Law;
use crate::problem::film::dual::{Dual, DualVector, constant, gradient, norm, with_gradient};
use crate::problem::film::impact::{Contact, Parting, Side};
use crate::problem::film::own::{MOVING, SCATTERED};
use crate::problem::loss::ShotLoss;
use crate::problem::sums::{Contribution, Variation};
use crate::problem::unknowns::{Mode, Own, PHYSICS, Shared, Unknown};

/// Steps until an unknown speed before the impact gives the measured one afterwards.
const STEPS: usize = 20;

/// Observables whose numbers have noise of one size.
#[derive(Clone, Debug)]
pub(crate) struct Pool {
    pub(crate) observables: Vec<Observable>,
    /// Noise of the rounding of the columns, SI or radians; 0 if they are not rounded.
    pub(crate) rounding: f64,
    /// Size so small that residuals vanish.
    pub(crate) exact: f64,
}

impl Pool {
    /// Returns the least size of the noise.
    pub fn least(&self) -> f64 {
        self.rounding.max(self.exact)
    }
}

/// Shots of a table.
#[derive(Clone)]
pub(crate) struct RowsBlock {
    pub(crate) shots: Arc<Vec<RowShot>>,
    pub(crate) contact: Contact,
    /// Number of shared unknowns that normal equations hold: the last that is not held, and those
    /// before it.
    pub(crate) width: usize,
    /// Noises of numbers whose errors are not stated: of each pool.
    pub(crate) variation: Variation,
    /// The observables of a unit, unless their noises differ.
    pub(crate) pools: Vec<Pool>,
    pub(crate) loss: Loss,
    /// The losses of shots of 0, 1, 2, … numbers.
    pub(crate) losses: Vec<ShotLoss>,
}

impl RowsBlock {
    /// Returns a block of shots with a loss, without noises.
    pub fn new(shots: Vec<RowShot>, contact: &Contact, unknowns: &[Unknown], loss: Loss) -> Self {
        let variation = Variation { noises: Vec::new(), is_stated: false, spreads: Vec::new() };
        let (shots, contact, pools, losses) = (Arc::new(shots), *contact, Vec::new(), Vec::new());
        let block = Self { shots, contact, width: 0, variation, pools, loss, losses };
        block.with_unknowns(unknowns).with_loss(loss)
    }

    /// Returns the same shots with the effects that the unknowns of the sample have.
    pub(crate) fn with_unknowns(self, unknowns: &[Unknown]) -> Self {
        let last = unknowns[..PHYSICS].iter().rposition(|unknown| unknown.mode != Mode::Fixed);
        Self { contact: self.contact.with(unknowns), width: last.map_or(0, |last| last + 1), ..self }
    }

    /// Returns the same shots with a loss.
    pub(crate) fn with_loss(mut self, loss: Loss) -> Self {
        let most = self.shots.iter().map(|shot| shot.rows.len()).max().unwrap_or(0);
        self.losses = (0..=most).map(|numbers| ShotLoss::new(loss, numbers)).collect();
        self.loss = loss;
        self
    }

    /// Returns the number of measured numbers after the impacts.
    pub(crate) fn count_numbers(&self) -> usize {
        self.shots.iter().map(|shot| shot.rows.len()).sum()
    }

    /// Gives the shots whose speed is known the difference of the outcome with the balls' weight as
    /// their offset.
    pub fn weigh(&mut self, own: &[Own], shared: &Shared) {
        let heavy = self.contact.with_weight();
        self.contact = heavy;
        let offset = |(shot, own): (&mut RowShot, &Own)| {
            let before = shot.differences(own, shared, &heavy).ok().filter(|_| shot.knows_speed);
            let offset = before.and_then(|before| heavy.correct(&before.approach.cue, shared));
            shot.offset = offset.map(Arc::new);
        };
        Arc::make_mut(&mut self.shots).par_iter_mut().zip(own).for_each(offset);
    }

    /// Returns the standard deviation of a number.
    fn sd(&self, row: &Row) -> f64 {
        row.noise.map_or(row.number.measured.sd.unwrap_or(0.0), |noise| self.variation.noises[noise].sd)
    }

    /// Returns the residuals of shot `i`, independent of each other and in units of their errors;
    /// those of inputs that count as numbers stand behind the others.
    pub(super) fn predict(&self, i: usize, own: &Own, shared: &Shared) -> Option<Residuals> {
        let shot = &self.shots[i];
        let mut residuals = shot.differences(own, shared, &self.contact).ok()?;
        for (residual, row) in residuals.rows.iter_mut().zip(&shot.rows) {
            *residual /= self.sd(row);
        }
        let noisy = shot.inputs.iter().enumerate().filter(|(_, input)| input.noise.is_some());
        residuals.rows.extend(noisy.map(|(place, input)| input_error(own, place) / self.sd(input)));
        Some(residuals)
    }

    /// Returns the sums of shot `i`.
    pub(crate) fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        let (shot, noises) = (&self.shots[i], self.variation.noises.len());
        let Some(predicted) = self.predict(i, own, shared) else {
            return Contribution::impossible(MOVING, self.width, noises);
        };
        let mut sums = Contribution::empty(MOVING, self.width, noises);
        sums.sums.sticks = predicted.sticks;
        for residual in &predicted.rows {
            sums.add_number(residual.re, &gradient(residual).as_slice()[..MOVING + self.width]);
        }
        for (place, prior) in shot.priors() {
            sums.add_prior((place, prior), own[place], &[]);
        }
        let loss = self.losses[shot.rows.len()];
        sums.weigh(loss, sums.sums.cost.sqrt());
        let weight = sums.sums.weight();
        for (residual, noise) in predicted.rows.iter().zip(shot.noises()) {
            if let Some(noise) = noise {
                sums.sums.noises[noise].weighted += weight * weight * residual.re.powi(2) / loss.consistency;
                sums.sums.noises[noise].count += 1.0;
            }
        }
        sums.or_impossible()
    }

    /// Returns the numbers of shot `i` less their prediction from its measured inputs.
    pub(crate) fn deviations(&self, i: usize, shared: &Shared) -> Option<Deviations> {
        let shot = &self.shots[i];
        let Residuals { rows, approach, .. } =
            shot.differences(&Own::zeros(MOVING), shared, &self.contact).ok()?;
        let sds = shot.inputs.map(|input| self.sd(&input));
        let by: Vec<_> = rows.iter().map(gradient).collect();
        let inputs = DMatrix::from_fn(rows.len(), INPUTS, |row, place| sds[place] * by[row][place]);
        let mut covariance = &inputs * inputs.transpose();
        for (i, row) in shot.rows.iter().enumerate() {
            covariance[(i, i)] += self.sd(row).powi(2);
        }
        let Approach { cut, speed, cue, cos, sin } = approach;
        let (cut, speed, spin) = (cut.re, speed.re, cue.spin);
        let topspin = spin[1].re * cut.cos() - spin[0].re * cut.sin();
        Some(Deviations {
            observables: shot.rows.iter().map(|row| row.number.observable).collect(),
            measured: shot.rows.iter().map(|row| row.number.measured.value).collect(),
            values: DVector::from_iterator(rows.len(), rows.iter().map(|row| -row.re)),
            covariance,
            by: DMatrix::from_fn(rows.len(), PHYSICS, |row, id| by[row][MOVING + id]),
            normal: [cos.re, sin.re],
            cut,
            speed: shot.knows_speed.then_some(speed),
            spins: [topspin / speed, spin[2].re / speed],
        })
    }
}

/// The cue ball before the impact in the collision frame, and the direction of this frame.
struct Approach {
    pub(crate) cue: Side,
    /// Direction of the line of centres on the table; (1, 0) of angles.
    pub(crate) cos: Dual,
    pub(crate) sin: Dual,
    /// Cut angle, rad, and speed, m/s.
    pub(crate) cut: Dual,
    pub(crate) speed: Dual,
}

impl Approach {
    /// Returns what is measured of the balls after the impact, rad, m/s or rad/s; angles are
    /// counted from the side of the measured cut angle, which is 1 or −1.
    fn observe(&self, observable: Observable, Parting { balls, radii, .. }: &Parting, side: f64) -> Dual {
        let [cue, object] = balls.each_ref().map(|ball| ball.velocity);
        let rolling = |ball: usize| roll(&balls[ball]);
        let against_incoming = |velocity: &DualVector| turn(&((direction(velocity) - self.cut) * side));
        let on_table = |[x, y, z]: [Dual; 3], axis: Axis| match axis {
            Axis::X => x * self.cos - y * self.sin,
            Axis::Y => x * self.sin + y * self.cos,
            Axis::Z => z,
        };
        let velocity = |ball: usize| [balls[ball].velocity.x, balls[ball].velocity.y, balls[ball].rise];
        let spin = |ball: usize| balls[ball].spin.map(|spin| spin / radii[ball]);
        match observable {
            Observable::Throw => direction(&object) * side,
            Observable::CueTurn => against_incoming(&cue),
            Observable::CueTurnRolling => against_incoming(&rolling(0)),
            Observable::ObjectAngleRolling => -against_incoming(&rolling(1)),
            Observable::Separation => {
                let angle = turn(&(direction(&cue) - direction(&object)));
                if angle.re < 0.0 { -angle } else { angle }
            }
            Observable::ObjectSpeed => norm(&object),
            Observable::CueSpeed => norm(&cue),
            Observable::ObjectSpeedRolling => norm(&rolling(1)),
            Observable::CueSpeedRolling => norm(&rolling(0)),
            Observable::ObjectSpeedRatio => norm(&object) / self.speed,
            Observable::CueVelocity(axis) => on_table(velocity(0), axis),
            Observable::CueSpin(axis) => on_table(spin(0), axis),
            Observable::ObjectVelocity(axis) => on_table(velocity(1), axis),
            Observable::ObjectSpin(axis) => on_table(spin(1), axis),
            // of discs, which are another kind of data
            Observable::Restitution | Observable::ImpulseRatio => constant(f64::NAN),
        }
    }
}

/// Returns the velocity of a ball once it rolls: V − s ν/(1 + ν) with its slip s on the cloth,
/// whether or not it flies first.
fn roll(ball: &Side) -> DualVector {
    ball.velocity - ball.slip() * constant(ball.inertia / (1.0 + ball.inertia))
}

/// Returns the error of an input.
fn input_error(own: &Own, place: usize) -> Dual {
    constant(own[place]).derivative(place)
}

fn direction(v: &DualVector) -> Dual {
    v.y.atan2(v.x)
}

/// Returns the same angle within (−π, π].
fn turn(angle: &Dual) -> Dual {
    *angle + (wrap(angle.re) - angle.re)
}

/// Residuals of a shot.
pub(super) struct Residuals {
    /// Predicted numbers less the measured ones.
    pub(crate) rows: Vec<Dual>,
    pub(crate) sticks: bool,
    approach: Approach,
}

impl RowShot {
    /// Returns the cue ball before the impact.
    fn approach(&self, [first, second, third, w_x, w_y, w_z]: [Dual; INPUTS]) -> Approach {
        let (sin, cos) = if self.is_cut { (constant(0.0), constant(1.0)) } else { first.sin_cos() };
        let turn = |x: Dual, y: Dual| DualVector::new(x * cos + y * sin, y * cos - x * sin);
        let velocity = if self.is_cut {
            DualVector::new(second * first.cos(), second * first.sin())
        } else {
            turn(second, third)
        };
        let w = turn(w_x, w_y);
        // ω = (−U_y, U_x, 0)/R of natural roll
        let spin = [
            w.x * self.radius - velocity.y * self.roll,
            w.y * self.radius + velocity.x * self.roll,
            w_z * self.radius,
        ];
        Approach {
            cue: Side { velocity, rise: constant(0.0), spin, inertia: self.inertia },
            cos,
            sin,
            cut: if self.is_cut { first } else { direction(&velocity) },
            speed: if self.is_cut { second } else { norm(&velocity) },
        }
    }

    /// Returns the balls before and after the impact; a speed before it that is not measured is the
    /// one that the measured speed afterwards follows from.
    fn strike(
        &self,
        own: &Own,
        collide: impl Fn(&Side) -> Result<Parting, NotACollision>,
    ) -> Result<(Approach, Parting), NotACollision> {
        let input = |place: usize| {
            let Row { number: Measurement { measured, .. }, noise } = self.inputs[place];
            let exact = constant(measured.value);
            let is_exact = noise.is_none() && measured.sd.unwrap_or(0.0) == 0.0;
            if is_exact { exact } else { exact + input_error(own, place) }
        };
        let mut inputs: [Dual; INPUTS] = std::array::from_fn(input);
        if let Some(observable) = self.speed_after {
            let measured = inputs[SPEED];
            let mut speed = measured.re;
            for _ in 0..STEPS {
                inputs[SPEED] = constant(speed).derivative(SPEED);
                let approach = self.approach(inputs);
                let after = approach.observe(observable, &collide(&approach.cue)?, self.side);
                // a step of Newton's method gives the derivatives by the other inputs
                let mut by_others = gradient(&after);
                let slope = std::mem::take(&mut by_others[SPEED]);
                inputs[SPEED] = constant(speed);
                if slope != 0.0 {
                    inputs[SPEED] += (measured - with_gradient(after.re, &by_others)) / slope;
                }
                // speeds afterwards are nearly in proportion to the one before
                let part = measured.re / after.re;
                if (part - 1.0).abs() <= EXACT {
                    break;
                }
                speed *= part;
            }
        }
        let approach = self.approach(inputs);
        let after = collide(&approach.cue)?;
        Ok((approach, after))
    }

    /// Returns the predicted numbers less the measured ones.
    pub(super) fn differences(
        &self,
        own: &Own,
        shared: &Shared,
        contact: &Contact,
    ) -> Result<Residuals, NotACollision> {
        let offsets = [0.0; SCATTERED.len()];
        let correction = self.offset.as_deref();
        let (approach, after) = self.strike(own, |cue| contact.collide(cue, shared, &offsets, correction))?;
        let difference = |row: &Row| {
            let Measurement { observable, measured } = row.number;
            let off = approach.observe(observable, &after, self.side) - measured.value;
            if observable.is_angle() { turn(&off) } else { off }
        };
        let rows = self.rows.iter().map(difference).collect();
        Ok(Residuals { rows, sticks: after.sticks, approach })
    }
}

/// The numbers of a shot as a model has them.
#[derive(Clone, Debug)]
pub struct Prediction {
    /// The cue ball before the impact in the collision frame.
    pub(crate) cue: BallState,
    /// The observables of the shot; a speed that determines an unknown one before is not among them.
    pub observables: Vec<Observable>,
    /// Predicted numbers, SI and radians.
    pub values: Vec<f64>,
}

/// Predicts the numbers of a shot from its measured inputs.
///
/// # Errors
/// A shot whose inputs are not all known, or that is not a collision.
pub fn predict(shot: &Shot, model: &Model, coefficients: &Coefficients) -> Result<Prediction, Unpredictable> {
    let bare = Dataset::new("", model.ball, Vec::new());
    let made = RowShot::new(shot, &bare, model.law != Law::Constant || model.e_slope.is_some())?;
    let radii = [model.ball.radius, model.object_ball().radius];
    let (approach, after) = made.strike(&Own::zeros(MOVING), |cue| {
        let after = model.collide(&cue.state(radii[0]), coefficients)?.components();
        Ok(Parting::new(|i| constant(after[i]), &radii.map(constant), made.inertia))
    })?;
    let value = |row: &Row| approach.observe(row.number.observable, &after, made.side).re;
    Ok(Prediction {
        cue: approach.cue.state(radii[0]),
        observables: made.rows.iter().map(|row| row.number.observable).collect(),
        values: made.rows.iter().map(value).collect(),
    })
}
