//! The measured state before the impact → the cue ball in the collision frame, and how it follows from the inputs.

use nalgebra::{SMatrix, SVector, Vector3};

use super::{Contact, INPUTS};
use crate::measurement::dataset::{Before, Measurement};
use crate::measurement::spin::Spin;
use crate::physics::ball::BallState;
use crate::physics::collision::Regime;
use crate::physics::contact_frame::CollisionFrame;

/// The measured state before the impact.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub before: Before,
    pub spin: Spin,
    /// The speed afterwards from which the speed before is solved.
    pub solved_from: Option<Measurement>,
    /// The sign of the cut angle that was measured, which angles are counted from.
    pub side: f64,
    /// Topspin besides that of a stun or natural-roll shot, over the natural roll's.
    pub topspin: f64,
}

impl State {
    /// With its inputs moved by so much, in the order of [`INPUTS`].
    pub fn moved(mut self, by: &SVector<f64, INPUTS>) -> Self {
        match &mut self.before {
            Before::Impact { normal: [x, y], velocity } => {
                let (sin, cos) = by[0].sin_cos();
                (x.value, y.value) = (x.value * cos - y.value * sin, x.value * sin + y.value * cos);
                velocity[0].value += by[1];
                velocity[1].value += by[2];
            }
            Before::Angle { cut, speed } => {
                cut.value += by[0];
                if let Some(speed) = speed {
                    speed.value += by[1];
                } else if let Some(known) = &mut self.solved_from {
                    known.measured.value += by[1];
                }
            }
        }
        if let Spin::Measured { spin, .. } = &mut self.spin {
            *spin += Vector3::new(by[3], by[4], by[5]);
        }
        self
    }
}

/// The cue ball before the impact in the collision frame, and how it follows from the inputs.
pub(super) struct Start {
    pub cue: BallState,
    pub frame: CollisionFrame,
    pub cut: f64,
    /// As [`State::side`].
    pub side: f64,
    pub speed: f64,
    /// (U_x, U_y, ω_x, ω_y, ω_z) by inputs.
    pub by_inputs: SMatrix<f64, 5, INPUTS>,
    /// Cut angle and speed by inputs.
    pub cut_by_inputs: SVector<f64, INPUTS>,
    pub speed_by_inputs: SVector<f64, INPUTS>,
}

impl Start {
    pub fn new(state: &State, speed: f64, radius: f64) -> Self {
        let State { before, spin, side, topspin, .. } = state;
        let mut by_inputs = SMatrix::<f64, 5, INPUTS>::zeros();
        let mut cut_by_inputs = SVector::zeros();
        let mut speed_by_inputs = SVector::zeros();
        let mut cue = BallState::default();
        let (frame, cut) = match *before {
            Before::Angle { cut, .. } => {
                let (sin, cos) = cut.value.sin_cos();
                cue.velocity = Vector3::new(speed * cos, speed * sin, 0.0);
                by_inputs[(0, 0)] = -speed * sin;
                by_inputs[(1, 0)] = speed * cos;
                by_inputs[(0, 1)] = cos;
                by_inputs[(1, 1)] = sin;
                cut_by_inputs[0] = 1.0;
                speed_by_inputs[1] = 1.0;
                (CollisionFrame::from_unit(1.0, 0.0), cut.value)
            }
            Before::Impact { normal, velocity } => {
                let [nx, ny] = normal.map(|m| m.value);
                let frame = CollisionFrame::from_unit(nx, ny);
                let u = Vector3::new(velocity[0].value, velocity[1].value, 0.0);
                cue.velocity = frame.to_collision(u);
                // turning the line of centres by dα turns the vector by −dα
                by_inputs[(0, 0)] = cue.velocity.y;
                by_inputs[(1, 0)] = -cue.velocity.x;
                by_inputs[(0, 1)] = nx;
                by_inputs[(0, 2)] = ny;
                by_inputs[(1, 1)] = -ny;
                by_inputs[(1, 2)] = nx;
                // φ = atan2(U_y, U_x), U = |U|
                let speed_2 = speed * speed;
                cut_by_inputs[0] = -1.0;
                cut_by_inputs[1] = -u.y / speed_2;
                cut_by_inputs[2] = u.x / speed_2;
                speed_by_inputs[1] = u.x / speed;
                speed_by_inputs[2] = u.y / speed;
                (frame, cue.velocity.y.atan2(cue.velocity.x))
            }
        };
        match *spin {
            Spin::Unknown => {}
            Spin::Stun if *topspin == 0.0 => {}
            Spin::Stun | Spin::NaturalRoll => {
                let part = topspin + if *spin == Spin::NaturalRoll { 1.0 } else { 0.0 };
                cue = BallState::natural_roll(cue.velocity, radius);
                cue.spin *= part;
                // ω = (−U_y, U_x, 0)/R of natural roll
                let (x, y) = (by_inputs.row(0).into_owned(), by_inputs.row(1).into_owned());
                by_inputs.set_row(2, &(-y * part / radius));
                by_inputs.set_row(3, &(x * part / radius));
            }
            Spin::Measured { spin, .. } => {
                cue.spin = frame.to_collision(spin);
                if matches!(before, Before::Impact { .. }) {
                    by_inputs[(2, 0)] = cue.spin.y;
                    by_inputs[(3, 0)] = -cue.spin.x;
                }
                for axis in 0..3 {
                    let turned = frame.to_collision(Vector3::ith(axis, 1.0));
                    by_inputs.fixed_view_mut::<3, 1>(2, 3 + axis).copy_from(&turned);
                }
            }
        }
        Self { cue, frame, cut, side: *side, speed, by_inputs, cut_by_inputs, speed_by_inputs }
    }

    /// How the balls touch; `regime` as the collision ends.
    pub fn contact(&self, radius: f64, regime: Regime) -> Contact {
        let BallState { velocity, spin } = self.cue;
        // v_y0 = −U_y − Rω_z, v_z0 = Rω_y, k = U_x
        let (k, v_y, v_z) = (velocity.x, -velocity.y - radius * spin.z, radius * spin.y);
        let by = |row: usize| self.by_inputs.row(row).transpose();
        let (by_k, by_y, by_z) = (by(0) / k, -by(1) - radius * by(4), radius * by(3));
        let square = v_y * v_y + v_z * v_z;
        Contact {
            side: [v_z > 0.0, regime == Regime::Stick],
            vertical: v_z / k,
            log_slip: 0.5 * square.ln() - k.ln(),
            vertical_by_inputs: (by_z - v_z * by_k) / k,
            log_slip_by_inputs: (v_y * by_y + v_z * by_z) / square - by_k,
        }
    }
}
