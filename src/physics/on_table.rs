//! A collision in the frame of the table, as a simulator has it.

use super::ball::BallState;
use super::collision::{Coefficients, Model, NotACollision, Outcome};
use super::contact_frame::CollisionFrame;

impl Model {
    /// The outcome of a collision as by [`Model::collide`], with the cue ball and the outcome in the frame of the table, z up.
    /// The line of centres leads from the cue ball to the object ball, which is at rest, and has any length, so that the difference of
    /// the two places serves.
    ///
    /// # Errors
    /// As [`Model::collide`]; also a line of centres without a direction.
    pub fn collide_on_table(
        &self,
        line_of_centres: [f64; 2],
        cue: &BallState,
        coefficients: &Coefficients,
    ) -> Result<Outcome, NotACollision> {
        let [nx, ny] = line_of_centres;
        let frame = CollisionFrame::from_normal(nx, ny).ok_or(NotACollision::NoDirection(nx, ny))?;
        let turned = |state: &BallState, turn: fn(CollisionFrame, _) -> _| BallState {
            velocity: turn(frame, state.velocity),
            spin: turn(frame, state.spin),
        };
        let outcome = self.collide(&turned(cue, CollisionFrame::to_collision), coefficients)?;
        Ok(Outcome {
            cue: turned(&outcome.cue, CollisionFrame::to_table),
            object: turned(&outcome.object, CollisionFrame::to_table),
            ..outcome
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::{Ball, Vec3};
    use crate::physics::collision::Fidelity;

    /// Two rotations of components of some 50.
    const ROUNDING: f64 = 1e-13;

    const COEFFICIENTS: Coefficients = Coefficients { mu: 0.05, mu_s: 0.3, e: 0.94 };

    #[test]
    fn a_table_that_is_turned_turns_what_comes_out() {
        let model = Model::new(Fidelity::Full, Ball::POOL);
        let cue = BallState { velocity: Vec3::new(1.7, 1.0, 0.0), spin: Vec3::new(-20.0, 50.0, 8.0) };
        let straight = model.collide(&cue, &COEFFICIENTS).unwrap();
        for direction in [0.3_f64, 2.0, -1.2] {
            let frame = CollisionFrame::from_direction(direction);
            let cue = BallState { velocity: frame.to_table(cue.velocity), spin: frame.to_table(cue.spin) };
            // of any length
            let line = [3.0 * direction.cos(), 3.0 * direction.sin()];
            let turned = model.collide_on_table(line, &cue, &COEFFICIENTS).unwrap();
            for (on_table, own) in [(turned.cue, straight.cue), (turned.object, straight.object)] {
                assert!((frame.to_collision(on_table.velocity) - own.velocity).amax() < ROUNDING);
                assert!((frame.to_collision(on_table.spin) - own.spin).amax() < 50.0 * ROUNDING);
            }
            assert_eq!(turned.regime, straight.regime);
        }
    }

    #[test]
    fn a_line_without_direction_is_no_collision() {
        let model = Model::new(Fidelity::Full, Ball::POOL);
        let cue = BallState::stun(Vec3::new(1.0, 0.0, 0.0));
        for line in [[0.0, 0.0], [f64::NAN, 1.0], [f64::INFINITY, 0.0]] {
            let error = model.collide_on_table(line, &cue, &COEFFICIENTS).unwrap_err();
            assert!(error.to_string().contains("has no direction"), "{error}");
        }
        let away = model.collide_on_table([-1.0, 0.0], &cue, &COEFFICIENTS);
        assert_eq!(away, Err(NotACollision::NotApproaching(-1.0)));
    }
}
