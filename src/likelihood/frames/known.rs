//! The frames of a shot as they are fitted: from an extraction, or of a shot that is known.

use nalgebra::{Matrix3, SVector, Vector3};

use super::moments::Moments;
use super::{EXACT, Film, Frame, OWN, Own, SPIN, Seen};
use crate::film::camera::Camera;
use crate::measurement::spin::Spin;
use crate::measurement::track::{Sample, TrackShot};
use crate::physics::ball::Vec3;
use crate::trajectory::both_balls::Motion;
use crate::trajectory::frames::{self, Frames};
use crate::trajectory::scene::Scene;
use crate::trajectory::shot_scene::ShotScene;
use crate::trajectory::unknowns::{Unknowns, unknown};

/// A shot as it is known to have been: table frame, the velocity of the cue ball in the collision frame.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    pub time: f64,
    /// Where the object ball lies, m.
    pub object: [f64; 2],
    /// Direction of the line of centres, rad.
    pub direction: f64,
    /// Cue ball's velocity just before the impact, m/s.
    pub velocity: [f64; 2],
    /// Its spin as whoever fits the shot knows it.
    pub spin: Spin,
    /// Its topspin over the natural roll's, where [`Spin::Unknown`].
    pub roll: f64,
    /// Spins after the impact of the cue ball and the object ball, rad/s, each with the standard deviation to which
    /// markers show its components.
    pub after: Option<[(Vec3, f64); 2]>,
}

/// What an extraction found of a shot.
pub(crate) struct Extracted<'a> {
    /// First and last instant used, s.
    pub window: [f64; 2],
    /// Standard deviation of a coordinate, m, and what it is over that which the frames were weighted by.
    pub position_sd: f64,
    pub scale: f64,
    /// χ² of the frames, whatever the collision.
    pub chi2: f64,
    /// Noise from second differences, m.
    pub noise: f64,
    /// Instants of the frames left out as wrong, of the cue ball and of the object ball.
    pub wrong: &'a [Vec<f64>; 2],
    pub unknowns: &'a Unknowns,
    pub spin: Spin,
    /// Where the collision model puts the own unknowns, where that is known.
    pub at_model: Option<Own>,
    /// Angular velocities just after the impact (rad/s) that markers show, of the cue ball and of the object ball, with their
    /// covariance.
    pub spins_after: [Option<(Vector3<f64>, Matrix3<f64>)>; 2],
}

impl Film {
    /// The frames that an extraction used; with `camera`, also how they follow its corrections.
    pub(crate) fn new(shot: &TrackShot, impact: &Extracted, scene: &Scene, camera: Option<&Camera>) -> Self {
        let common = impact.position_sd / impact.scale;
        let wrong = impact.wrong.each_ref().map(Vec::as_slice);
        let used = Frames::of(shot, common, impact.noise, true).between(impact.window, wrong);
        let independent = used.independent();
        let frames = |frames: Vec<frames::Frame>| {
            let frame = |frame: frames::Frame| Frame {
                t: frame.sample.t,
                position: [frame.sample.x, frame.sample.y],
                weight: frame.sd.map(|sd| 1.0 / (sd * impact.scale)),
            };
            frames.into_iter().map(frame).collect()
        };
        let z = impact.unknowns;
        let mut start = SVector::<f64, { OWN + SPIN }>::zeros();
        // the first unknowns are the same ones
        start.fixed_rows_mut::<OWN>(0).copy_from(&z.fixed_rows::<OWN>(0));
        let spin = start_spin(&mut start, impact.spin, z[unknown::ROLL]);
        let start = impact.at_model.unwrap_or(start);
        let seen = impact.spins_after.map(|spin| {
            let (spin, covariance) = spin?;
            Some(Seen { spin, whitening: covariance.cholesky()?.l().try_inverse()? })
        });
        let shot_scene = ShotScene::of(impact.spin, scene);
        let motion = Motion::new(&shot_scene, &(*z).into());
        let moments = |used, ball: usize| {
            let height = |time: f64| motion.heights(time)[ball];
            Moments::new(frames(used), start[0], camera.map(|camera| (camera, &height as _)))
        };
        let [cue, object] = used.of;
        Self {
            cue: moments(cue, 0),
            object: moments(object, 1),
            independent,
            scene: shot_scene,
            start,
            others: Vec::new(),
            spin,
            seen,
            states_noise: shot.states_noise(),
            position_sd: impact.position_sd,
            least_chi2: impact.chi2,
        }
    }

    /// All frames of a shot whose positions state their standard deviations, and that is known, so that its own
    /// unknowns start where they are. Positions without one weigh nothing.
    pub(crate) fn known(shot: &TrackShot, known: &Known, scene: &Scene) -> Self {
        let frames = |samples: &[Sample]| {
            let frame = |s: &Sample| Frame {
                t: s.t,
                position: [s.x, s.y],
                weight: s.sd.map_or([0.0; 2], |sd| sd.map(f64::recip)),
            };
            samples.iter().map(frame).collect()
        };
        let Known { time, object: [x, y], direction, velocity: [along, across], spin, roll, after } = *known;
        let mut start = SVector::<f64, { OWN + SPIN }>::zeros();
        start.as_mut_slice()[..OWN].copy_from_slice(&[time, x, y, direction, along, across]);
        let measured = start_spin(&mut start, spin, roll);
        let seen = after.map_or([None; 2], |spins| {
            spins.map(|(spin, sd)| Some(Seen { spin, whitening: Matrix3::from_diagonal_element(sd.recip()) }))
        });
        Self {
            cue: Moments::new(frames(&shot.cue), time, None),
            object: Moments::new(frames(&shot.object), time, None),
            independent: 2 * (shot.cue.len() + shot.object.len()),
            scene: ShotScene::of(spin, scene),
            start,
            others: Vec::new(),
            spin: measured,
            seen,
            states_noise: true,
            position_sd: 0.0,
            least_chi2: 0.0,
        }
    }
}

/// Puts a spin that is an unknown where the search starts; its mean and standard deviation, where it is measured.
fn start_spin(start: &mut SVector<f64, { OWN + SPIN }>, spin: Spin, roll: f64) -> Option<(Vec3, Vec3)> {
    match spin {
        Spin::Measured { spin, sd } if sd.iter().any(Option::is_some) => {
            start.fixed_rows_mut::<SPIN>(OWN).copy_from(&spin);
            Some((spin, Vec3::from(sd.map(|sd| sd.unwrap_or(0.0).max(EXACT)))))
        }
        Spin::Unknown => {
            start[OWN] = roll;
            None
        }
        _ => None,
    }
}
