//! The outcome of a collision → what is observed of it.

use nalgebra::{SMatrix, SVector, Vector3};

use super::INPUTS;
use super::start::Start;
use crate::measurement::observable::{Axis, Observable};
use crate::physics::ball::{Ball, BallState};
use crate::physics::collision::{Model, Outcome};
use crate::physics::contact_frame::cloth_slip;

/// A predicted observable and its derivatives by the outcome's twelve components and, where it
/// depends on them directly, the inputs.
pub(super) struct Seen {
    pub value: f64,
    pub by_outcome: SVector<f64, 12>,
    pub by_input: SVector<f64, INPUTS>,
}

/// Where each ball stands in [`Outcome::components`].
const CUE: usize = 0;
const OBJECT: usize = 6;

/// A horizontal velocity and its two rows by the outcome's components.
struct Horizontal {
    x: f64,
    y: f64,
    by_outcome: SMatrix<f64, 12, 2>,
}

impl Horizontal {
    /// Direction atan2(y, x) and its derivative.
    fn direction(&self) -> (f64, SVector<f64, 12>) {
        let square = self.x * self.x + self.y * self.y;
        let by =
            self.by_outcome.column(1) * (self.x / square) - self.by_outcome.column(0) * (self.y / square);
        (self.y.atan2(self.x), by)
    }

    fn speed(&self) -> (f64, SVector<f64, 12>) {
        let speed = self.x.hypot(self.y);
        let by = self.by_outcome.column(0) * (self.x / speed) + self.by_outcome.column(1) * (self.y / speed);
        (speed, by)
    }
}

pub(super) struct View<'a> {
    pub outcome: &'a Outcome,
    pub start: &'a Start,
    pub model: &'a Model,
}

impl View<'_> {
    /// Velocity just after the impact.
    fn after(&self, ball: usize) -> Horizontal {
        let velocity = self.ball(ball).velocity;
        let mut by_outcome = SMatrix::zeros();
        by_outcome[(ball, 0)] = 1.0;
        by_outcome[(ball + 1, 1)] = 1.0;
        Horizontal { x: velocity.x, y: velocity.y, by_outcome }
    }

    /// Velocity once the ball rolls: V − s ν/(1 + ν) with the cloth slip s just after the impact,
    /// whatever the sliding friction, and whether or not the ball flies first.
    fn rolling(&self, ball: usize) -> Horizontal {
        let state = self.ball(ball);
        let Ball { radius, inertia, .. } =
            if ball == CUE { self.model.ball } else { self.model.object_ball() };
        let share = inertia / (1.0 + inertia);
        let rolling = state.velocity - share * cloth_slip(state, radius);
        // s = (V_x − RΩ_y, V_y + RΩ_x)
        let mut by_outcome = SMatrix::zeros();
        by_outcome[(ball, 0)] = 1.0 - share;
        by_outcome[(ball + 4, 0)] = share * radius;
        by_outcome[(ball + 1, 1)] = 1.0 - share;
        by_outcome[(ball + 3, 1)] = -share * radius;
        Horizontal { x: rolling.x, y: rolling.y, by_outcome }
    }

    fn ball(&self, ball: usize) -> &BallState {
        if ball == CUE { &self.outcome.cue } else { &self.outcome.object }
    }

    pub fn observe(&self, observable: Observable) -> Seen {
        let side = self.start.side;
        let seen = |(value, by_outcome)| Seen { value, by_outcome, by_input: SVector::zeros() };
        // side·(outgoing − φ)
        let against_incoming = |(direction, by): (f64, SVector<f64, 12>)| Seen {
            value: wrap(side * (direction - self.start.cut)),
            by_outcome: side * by,
            by_input: -side * self.start.cut_by_inputs,
        };
        match observable {
            Observable::Throw => {
                let (direction, by) = self.after(OBJECT).direction();
                seen((side * direction, side * by))
            }
            Observable::CueTurn => against_incoming(self.after(CUE).direction()),
            Observable::CueTurnRolling => against_incoming(self.rolling(CUE).direction()),
            Observable::ObjectAngleRolling => {
                // side·(φ − outgoing)
                let seen = against_incoming(self.rolling(OBJECT).direction());
                Seen { value: -seen.value, by_outcome: -seen.by_outcome, by_input: -seen.by_input }
            }
            Observable::Separation => {
                let (cue, by_cue) = self.after(CUE).direction();
                let (object, by_object) = self.after(OBJECT).direction();
                let angle = wrap(cue - object);
                let sign = if angle < 0.0 { -1.0 } else { 1.0 };
                seen((sign * angle, sign * (by_cue - by_object)))
            }
            Observable::ObjectSpeed => seen(self.after(OBJECT).speed()),
            Observable::CueSpeed => seen(self.after(CUE).speed()),
            Observable::ObjectSpeedRolling => seen(self.rolling(OBJECT).speed()),
            Observable::CueSpeedRolling => seen(self.rolling(CUE).speed()),
            Observable::ObjectSpeedRatio => {
                let (speed, by) = self.after(OBJECT).speed();
                let before = self.start.speed;
                Seen {
                    value: speed / before,
                    by_outcome: by / before,
                    by_input: -speed / (before * before) * self.start.speed_by_inputs,
                }
            }
            Observable::Restitution => {
                let (closing, closing_by_inputs) = (self.start.cue.velocity.x, self.start.by_inputs.row(0));
                let parting = self.outcome.object.velocity.x - self.outcome.cue.velocity.x;
                let mut by_outcome = SVector::zeros();
                (by_outcome[OBJECT], by_outcome[CUE]) = (1.0 / closing, -1.0 / closing);
                let value = parting / closing;
                Seen { value, by_outcome, by_input: -value / closing * closing_by_inputs.transpose() }
            }
            // the object ball's velocity is its impulse
            Observable::ImpulseRatio => {
                let velocity = self.outcome.object.velocity;
                let ratio = velocity.y / velocity.x;
                let mut by_outcome = SVector::zeros();
                (by_outcome[OBJECT], by_outcome[OBJECT + 1]) = (-ratio / velocity.x, 1.0 / velocity.x);
                seen((ratio, by_outcome))
            }
            Observable::CueVelocity(axis) => self.component(CUE, axis),
            Observable::CueSpin(axis) => self.component(CUE + 3, axis),
            Observable::ObjectVelocity(axis) => self.component(OBJECT, axis),
            Observable::ObjectSpin(axis) => self.component(OBJECT + 3, axis),
        }
    }

    /// A component, in the table frame, of the vector that starts at `first` of the outcome's.
    fn component(&self, first: usize, axis: Axis) -> Seen {
        let frame = self.start.frame;
        let vector: Vector3<f64> = self.outcome.components().fixed_rows::<3>(first).into_owned();
        let table = frame.to_table(vector);
        let mut by_outcome = SVector::<f64, 12>::zeros();
        for along in 0..3 {
            by_outcome[first + along] = frame.to_table(Vector3::ith(along, 1.0))[axis.index()];
        }
        // turning the line of centres by dα turns the vector by dα
        let mut by_input = SVector::zeros();
        by_input[0] = [-table.y, table.x, 0.0][axis.index()];
        Seen { value: table[axis.index()], by_outcome, by_input }
    }
}

/// The same angle brought to (−π, π], rad.
#[must_use]
pub fn wrap(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

/// Predicted less measured; an angle's difference is brought to (−π, π].
#[must_use]
pub fn difference(observable: Observable, predicted: f64, measured: f64) -> f64 {
    let difference = predicted - measured;
    if observable.is_angle() { wrap(difference) } else { difference }
}
