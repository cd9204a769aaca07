//! Synthetic footage: both balls in every frame, through the impact.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use nalgebra::Rotation3;
use polars::prelude::{CsvWriter, PolarsResult, SerWriter};
use rand::Rng;

use super::{Camera, Maker, Played, SynthError, between};
use crate::io;
use crate::measurement::spin::Spin;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::cloth_motion::{Cloth, Path, contact_time};
use crate::physics::collision::{Coefficients, Model, NotACollision};
use crate::physics::contact_frame::CollisionFrame;

/// The true impact of a synthetic shot, in the table frame.
#[derive(Clone, Copy, Debug)]
pub struct TrueImpact {
    /// Instant of the impact, s.
    pub time: f64,
    /// Position of the object ball, m.
    pub object: [f64; 2],
    /// Direction of the line of centres, rad from the x axis.
    pub direction: f64,
    /// The cue ball just before the impact.
    pub cue_before: BallState,
    /// The cue ball just after the impact.
    pub cue_after: BallState,
    /// The object ball just after the impact.
    pub object_after: BallState,
}

/// The motion of both balls of a shot.
struct Course {
    truth: TrueImpact,
    balls: [Ball; 2],
    paths: [Path; 2],
    /// Side spins of each ball before and after the impact, rad/s.
    sides: [[f64; 2]; 2],
}

impl Course {
    /// Returns the motion of both balls from the cue ball just before the impact, collision frame,
    /// at an instant (s), a direction of the line of centres (rad) and an object ball's place (m).
    fn new(
        model: &Model,
        coefficients: &Coefficients,
        cloth: &Cloth,
        cue: &BallState,
        time: f64,
        direction: f64,
        object: [f64; 2],
    ) -> Result<Self, NotACollision> {
        let outcome = model.collide(cue, coefficients)?;
        let frame = CollisionFrame::from_direction(direction);
        let [cue_before, cue_after, object_after] = [cue, &outcome.cue, &outcome.object].map(|state| {
            BallState { velocity: frame.to_table(state.velocity), spin: frame.to_table(state.spin) }
        });
        let balls = [model.ball, model.object_ball()];
        // in the middle of the contact the balls are nearer than when they begin to touch
        let approach = cue.velocity.x * 0.5 * contact_time(Model::CONTACT_TIME, cue.velocity.x);
        let distance = balls[0].contact_distance(&balls[1]) - approach;
        let contact = [object[0] - distance * direction.cos(), object[1] - distance * direction.sin()];
        let rests = BallState::default();
        Ok(Self {
            paths: [
                Path::through([&cue_before, &cue_after], &balls[0], contact, time, cloth),
                Path::through([&rests, &object_after], &balls[1], object, time, cloth),
            ],
            sides: [[cue_before.spin.z, cue_after.spin.z], [0.0, object_after.spin.z]],
            truth: TrueImpact { time, object, direction, cue_before, cue_after, object_after },
            balls,
        })
    }

    /// Returns the centre of a ball at a time, s. While the balls touch, its velocity changes evenly by
    /// Δv, so that it is Δv(h − |t|)²/4h beside a path that turns at once, at a time t from the middle
    /// of a contact of 2h.
    fn centre(&self, ball: TrackedBall, t: f64) -> [f64; 2] {
        let TrueImpact { time, cue_before, cue_after, object_after, .. } = self.truth;
        let change = match ball {
            TrackedBall::Cue => cue_after.velocity - cue_before.velocity,
            TrackedBall::Object => object_after.velocity,
        };
        let half = 0.5 * contact_time(Model::CONTACT_TIME, change.xy().norm());
        let late = (half - (t - time).abs()).max(0.0);
        let beside = change * (late * late / (4.0 * half));
        let [x, y] = self.paths[ball as usize].position(t);
        [x + beside.x, y + beside.y]
    }

    /// Returns the position of a marker, and whether it is in sight: more than a tenth of the
    /// radius above the centre. At the impact it is at `place`, a unit vector from the centre.
    fn marker(&self, ball: TrackedBall, place: Vec3, t: f64) -> ([f64; 2], bool) {
        let (time, own, path) = (self.truth.time, &self.balls[ball as usize], &self.paths[ball as usize]);
        let side = self.sides[ball as usize][usize::from(t > time)];
        // the rotation in steps of 0.1 ms, each about the axis of its middle
        let steps = ((t - time).abs() / 1e-4).ceil().max(1.0);
        let step = (t - time) / steps;
        let mut at = place;
        for n in 0..steps as usize {
            let [x, y] = path.spin(time + (n as f64 + 0.5) * step, own.radius);
            at = Rotation3::new(Vec3::new(x, y, side) * step) * at;
        }
        let centre = self.centre(ball, t);
        ([centre[0] + own.radius * at.x, centre[1] + own.radius * at.y], at.z > 0.1)
    }
}

const BALLS: [TrackedBall; 2] = [TrackedBall::Cue, TrackedBall::Object];

/// Returns a unit vector to the upper quarter of a ball, for two numbers from 0 to 1.
fn on_top(height: f64, angle: f64) -> Vec3 {
    let (height, angle) = (between([0.5, 0.95], height), between([0.0, TAU], angle));
    let across = (1.0 - height * height).sqrt();
    Vec3::new(across * angle.cos(), across * angle.sin(), height)
}

impl Maker<'_> {
    /// Returns every shot as a camera sees it, and what it really was.
    pub(super) fn tracks(&mut self) -> Result<Vec<(TrackShot, TrueImpact)>, SynthError> {
        (0..self.spec.shots.count).map(|number| self.track(number)).collect()
    }

    fn track(&mut self, number: usize) -> Result<(TrackShot, TrueImpact), SynthError> {
        let camera = self.spec.camera;
        let sd = camera.position_sd_m;
        let cue = self.shot(number).cue;
        let direction = self.between([-PI, PI]);
        let object = [self.between(Camera::FIELD_M), self.between(Camera::FIELD_M)];
        let time = (camera.frames()[0] as f64 + self.rng.random::<f64>()) / camera.fps;
        let Self { model, coefficients, spec, .. } = self;
        let course = Course::new(model, coefficients, &spec.cloth, &cue, time, direction, object)?;
        let mut balls = [Vec::new(), Vec::new()];
        for t in camera.times() {
            for (ball, samples) in BALLS.into_iter().zip(&mut balls) {
                let [mut x, mut y] = course.centre(ball, t).map(|at| at + self.noise(sd));
                let is_missing = self.rng.random::<f64>() < camera.gaps;
                let is_wrong = self.rng.random::<f64>() < camera.outliers;
                let (dx, dy) = (self.between([-0.02, 0.02]), self.between([-0.02, 0.02]));
                if is_wrong {
                    (x, y) = (x + dx, y + dy);
                }
                if !is_missing {
                    samples.push(Sample::new(t, [x, y]));
                }
            }
        }
        let played = self.spec.shots.cue_spin[number % self.spec.shots.cue_spin.len()];
        let spin = match played {
            _ if camera.markers > 0 => Spin::Unknown,
            Played::Stun => Spin::Stun,
            Played::NaturalRoll => Spin::NaturalRoll,
            _ => Spin::Measured { spin: course.truth.cue_before.spin, sd: [None; 3] },
        };
        let mut shot = TrackShot::new((number + 1).to_string(), camera.fps, spin, balls);
        for ball in BALLS {
            for number in 0..camera.markers {
                let place = on_top(self.rng.random(), self.rng.random());
                let mut samples = Vec::new();
                for t in camera.times() {
                    let (at, is_in_sight) = course.marker(ball, place, t);
                    let sample = Sample::new(t, at.map(|at| at + self.noise(sd)));
                    samples.extend(is_in_sight.then_some(sample));
                }
                shot.markers.push(Marker { ball, name: format!("m{}", number + 1), samples });
            }
        }
        Ok((shot, course.truth))
    }
}

/// Returns the canonical long CSV, `shot,frame,ball,x,y`, with `point` if there are markers.
pub(super) fn long_csv(shots: &[(TrackShot, TrueImpact)]) -> PolarsResult<String> {
    let is_marked = shots.iter().any(|(shot, _)| !shot.markers.is_empty());
    let columns = ["shot", "frame", "ball", "point", "x", "y"];
    let columns = columns.into_iter().filter(|column| is_marked || *column != "point");
    let mut table = io::positions_of(shots.iter().map(|(shot, _)| shot))?.select(columns)?;
    let mut bytes = Vec::new();
    CsvWriter::new(&mut bytes).with_float_precision(Some(7)).finish(&mut table)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Returns `shots.csv`: the spin that was played.
pub(super) fn shots_csv(shots: &[(TrackShot, TrueImpact)]) -> String {
    let mut table = String::from("shot,cue_spin,omega_x,omega_y,omega_z\n");
    for (shot, _) in shots {
        let row = match shot.spin {
            Spin::Measured { spin, .. } => format!("measured,{},{},{}", spin.x, spin.y, spin.z),
            word => format!("{},,,", word.name()),
        };
        _ = writeln!(table, "{},{row}", shot.name);
    }
    table
}
