//! A shot whose spin was found from its motion, as a fit of velocities needs it.
//!
//! The paths tell such a spin through the directions in which the cloth pulls, so that the velocities just after the impact
//! follow it along a curve: values and a covariance where the paths alone are fitted best say little of where the collision
//! model moves the shot to. They are therefore those of the frames linearised there: at the motion that obeys the model with
//! the coefficients that the shots gave, one step of Gauss and Newton's method leads to the values, and the normal matrix is
//! the inverse of their covariance. Where frames are linear in the unknowns both are the same.

use super::Impact;
use super::ball_paths::{BallPaths, TrackedBalls};
use crate::likelihood::frames::{OWN, Own};
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::physics::collision::Outcome;
use crate::trajectory::scene::{LiftPrior, Scene};
use crate::trajectory::shot_scene::ShotScene;
use crate::trajectory::unknowns::{Unknowns, unknown};

/// The values and covariance of a shot near where the collision model puts it, with the coefficients of the scene's lift.
/// `None` where the spin is known or the scene has no model: the impact is then as it was extracted.
#[must_use]
pub fn near_model(shot: &TrackShot, impact: &Impact, scene: &Scene) -> Option<Impact> {
    if impact.spin != Spin::Unknown {
        return None;
    }
    let own = impact.film(shot, scene, None).at_model(scene, &[])?.own;
    let z = path(&own, impact, scene)?;
    let tracked = TrackedBalls::new(shot, BallPaths::new(scene, impact.spin), impact.noise);
    let near = tracked.quantities(&tracked.linearised(&z, impact.window, &impact.wrong)?).ok()?.0;
    Some(Impact {
        values: near.values,
        covariance: near.covariance,
        lift_held: near.lift_held,
        rolling: near.rolling,
        ..impact.clone()
    })
}

/// The unknowns of the path that obeys the collision model, from those of the frames.
pub(crate) fn path(own: &Own, impact: &Impact, scene: &Scene) -> Option<Unknowns> {
    let LiftPrior::Model(model, coefficients, _) = scene.lift else { return None };
    let mut z = impact.unknowns;
    z.fixed_rows_mut::<OWN>(0).copy_from(&own.fixed_rows::<OWN>(0));
    z[unknown::ROLL] = own[OWN];
    z[unknown::SLIDING] = scene.cloth.sliding;
    z[unknown::ROLLING] = scene.cloth.rolling;
    let model_scene = ShotScene::of(impact.spin, scene);
    let Outcome { cue, object, .. } = model.collide(&model_scene.cue(&z), &coefficients).ok()?;
    for (first, ball) in [(unknown::CUE, cue), (unknown::BALL, object)] {
        (z[first], z[first + 1]) = (ball.velocity.x, ball.velocity.y);
    }
    let closing = z[unknown::BEFORE] * model_scene.vertical(&z);
    if closing > 0.0 {
        z[unknown::LIFT] = cue.velocity.z.max(object.velocity.z) / closing;
    }
    Some(z)
}
