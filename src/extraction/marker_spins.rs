//! What the markers on the balls tell of their spins.

use nalgebra::SMatrix;

use super::marker_rotation;
use super::marker_rotation::{Carrier, Rotation, Spot};
use super::{Impact, PathErrors, Rotations};
use crate::measurement::spin::Spin;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};
use crate::physics::ball::Ball;
use crate::trajectory::both_balls;
use crate::trajectory::scene::Scene;
use crate::trajectory::shot_scene::ShotScene;
use crate::trajectory::unknowns::unknown;

/// Frames that straddle the impact show neither spin: this part of a frame is left out on both sides.
const CLEAR: f64 = 0.01;

/// A rough spin is this wrong, relative.
const ROUGH: f64 = 0.05;

fn markers_of(shot: &TrackShot, ball: TrackedBall) -> impl Iterator<Item = &Marker> {
    shot.markers.iter().filter(move |marker| marker.ball == ball)
}

/// The cue ball's spin before the impact, roughly, from positions as tracked; as played where there are no
/// markers that tell it.
pub(crate) fn rough(shot: &TrackShot, ball: &Ball, impact: f64, noise: f64) -> Spin {
    let before = [f64::NEG_INFINITY, impact - 0.5 / shot.fps];
    let centre = |t: f64| shot.cue.iter().find(|sample| sample.t == t).map(|s: &Sample| [s.x, s.y]);
    let spots: Vec<Spot> = markers_of(shot, TrackedBall::Cue)
        .map(|marker| Spot::new(&marker.samples, before, impact, ball.radius, noise, centre))
        .collect();
    marker_rotation::rough(&spots)
        .map_or(shot.spin, |spin| Spin::Measured { spin, sd: [Some(ROUGH * spin.norm()); 3] })
}

/// The cue ball's spin before the impact: what its markers show, else as played.
pub(crate) fn before(shot: &TrackShot, rotations: &Rotations) -> Spin {
    let measured = |rotation: Rotation| Spin::Measured {
        spin: rotation.spin,
        sd: [0, 1, 2].map(|axis| Some(rotation.covariance[(axis, axis)].sqrt())),
    };
    rotations.cue_before.map_or(shot.spin, measured)
}

/// The angular velocities that the markers show, with the fitted motion of the balls' centres and its errors.
pub(crate) fn measure(shot: &TrackShot, impact: &Impact, errors: &PathErrors, scene: &Scene) -> Rotations {
    let known = ShotScene::of(impact.spin, scene);
    let motion = both_balls::with_derivatives::<{ unknown::COUNT }>(&known, &impact.unknowns);
    let plain = both_balls::Motion::new(&known, &impact.unknowns.into());
    let time = impact.unknowns[unknown::TIME];
    let of = |ball: TrackedBall, [from, to]: [f64; 2]| {
        let centre = |t: f64| match ball {
            TrackedBall::Cue => motion.cue(time + t),
            TrackedBall::Object => motion.object(time + t),
        };
        let body = if ball == TrackedBall::Cue { &scene.ball } else { &scene.object };
        let radius = body.radius;
        let change = |t: f64| motion.spin_change(ball, time + t, body);
        let plain_change = |t: f64| plain.spin_change(ball, time + t, body);
        let seen_at = |t: f64| {
            Some(match ball {
                TrackedBall::Cue => plain.cue(t),
                TrackedBall::Object => plain.object(t),
            })
        };
        let spots: Vec<Spot> = markers_of(shot, ball)
            .map(|marker| Spot::new(&marker.samples, [from, to], time, radius, impact.position_sd, seen_at))
            .collect();
        let known = |marker: &Marker| marker.samples.iter().all(|sample| sample.sd.is_some());
        let stated = shot.position_sd.is_some() || markers_of(shot, ball).all(known);
        marker_rotation::measure(
            &spots,
            &Carrier { centre: &centre, change: &change, plain_change: &plain_change, radius },
            stated,
        )
    };
    let clear = CLEAR / shot.fps;
    let [from, to] = impact.window;
    let sides = [
        of(TrackedBall::Cue, [from, time - clear]),
        of(TrackedBall::Cue, [time + clear, to]),
        of(TrackedBall::Object, [time + clear, to]),
    ];
    let mut rotations = Rotations::default();
    // ω = ω(z): covariances with each other and with the path come from those of z
    let mut by = SMatrix::<f64, 9, { unknown::COUNT }>::zeros();
    for (side, measured) in sides.iter().enumerate() {
        if let Some(measured) = measured {
            by.fixed_rows_mut::<3>(3 * side).copy_from(&measured.by_unknowns);
        }
    }
    rotations.covariance = by * errors.unknowns * by.transpose();
    rotations.by_rolling = by * errors.by_rolling;
    rotations.with_path = by * errors.unknowns * errors.quantities.transpose();
    for (side, measured) in sides.into_iter().enumerate() {
        let Some(measured) = measured else { continue };
        let mut block = rotations.covariance.fixed_view_mut::<3, 3>(3 * side, 3 * side);
        block += measured.own;
        let rotation =
            Rotation { spin: measured.spin, covariance: block.into_owned(), positions: measured.positions };
        let places = [&mut rotations.cue_before, &mut rotations.cue_after, &mut rotations.object_after];
        *places[side] = Some(rotation);
    }
    rotations
}
