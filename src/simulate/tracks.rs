//! Synthetic footage: both balls in every frame, through the impact.

use std::fmt::Write as _;

use rand::Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BadSpec, Maker, Played};
use crate::extraction::turn;
use crate::measurement::spin::Spin;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::cloth_motion::{Cloth, Launch, Path};
use crate::physics::collision::{Coefficients, Model, NotACollision};
use crate::physics::contact_frame::{CollisionFrame, cloth_slip};

/// The camera of a synthetic data set of kind `tracks`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Frames per second.
    pub fps: f64,
    /// Standard deviation of every coordinate, m.
    pub position_sd_m: f64,
    /// How long each shot is filmed before the impact, ms.
    pub before_ms: f64,
    /// How long each shot is filmed after the impact, ms.
    pub after_ms: f64,
    /// The fraction of the positions that are missing, 0 to 1.
    pub gaps: f64,
    /// The fraction of the positions that are wrong, by up to 20 mm.
    pub outliers: f64,
    /// How many points on each ball are marked, at random places; they are seen while on its upper side.
    pub markers: usize,
}

impl Default for Camera {
    fn default() -> Self {
        Self {
            fps: 1000.0,
            position_sd_m: 1e-4,
            before_ms: 40.0,
            after_ms: 40.0,
            gaps: 0.0,
            outliers: 0.0,
            markers: 0,
        }
    }
}

/// The cloth of a synthetic data set of kind `tracks`.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ClothSpec {
    /// Sliding friction μ_k, dimensionless.
    pub mu_k: f64,
    /// Rolling resistance μ_r, dimensionless.
    pub mu_r: f64,
    /// Restitution e_t of a ball that falls on the bed of the table, dimensionless.
    pub bounce: f64,
}

impl Default for ClothSpec {
    fn default() -> Self {
        let Cloth { sliding, rolling, bounce } = Cloth::default();
        Self { mu_k: sliding, mu_r: rolling, bounce }
    }
}

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

/// A shot's motion, before a camera looks at it.
struct Course {
    truth: TrueImpact,
    cue_before: Path<f64>,
    cue_after: Path<f64>,
    object_after: Path<f64>,
}

impl Course {
    /// From the cue ball just before the impact (collision frame), and when, where and which way the balls meet.
    fn new(
        model: &Model,
        coefficients: &Coefficients,
        cloth: &Cloth<f64>,
        cue: &BallState,
        (time, direction, object): (f64, f64, [f64; 2]),
    ) -> Result<Self, NotACollision> {
        let outcome = model.collide(cue, coefficients)?;
        let frame = CollisionFrame::from_direction(direction);
        let table = |state: &BallState| BallState {
            velocity: frame.to_table(state.velocity),
            spin: frame.to_table(state.spin),
        };
        let truth = TrueImpact {
            time,
            object,
            direction,
            cue_before: table(cue),
            cue_after: table(&outcome.cue),
            object_after: table(&outcome.object),
        };
        let (first, second) = (model.ball, model.object_ball());
        let apart = first.contact_distance(&second);
        let contact = [object[0] - apart * direction.cos(), object[1] - apart * direction.sin()];
        let launch = |ball: Ball, position, state: &BallState| {
            let slip = cloth_slip(state, ball.radius);
            Launch {
                time,
                position,
                velocity: [state.velocity.x, state.velocity.y],
                slip: [slip.x, slip.y],
                up: state.velocity.z,
                inertia: ball.inertia,
            }
        };
        Ok(Self {
            cue_before: Path::before(&launch(first, contact, &truth.cue_before), cloth),
            cue_after: Path::after(&launch(first, contact, &truth.cue_after), cloth),
            object_after: Path::after(&launch(second, object, &truth.object_after), cloth),
            truth,
        })
    }

    /// The centres of the cue ball and of the object ball at a time.
    fn centres(&self, t: f64) -> [[f64; 2]; 2] {
        if t < self.truth.time {
            [self.cue_before.position(t), self.truth.object]
        } else {
            [self.cue_after.position(t), self.object_after.position(t)]
        }
    }

    /// A marker that is at `place` at the impact, in every frame: instant, position, whether it is in sight.
    fn marker(
        &self,
        camera: &Camera,
        properties: &Ball,
        ball: TrackedBall,
        place: Vec3,
    ) -> Vec<(f64, [f64; 2], bool)> {
        let [before, after] = camera.frames();
        let TrueImpact { time, cue_before, cue_after, object_after, .. } = &self.truth;
        let position = |n: usize| {
            let t = n as f64 / camera.fps;
            let first = n <= before;
            let (path, spin) = match (ball, first) {
                (TrackedBall::Cue, true) => (Some(&self.cue_before), cue_before.spin),
                (TrackedBall::Cue, false) => (Some(&self.cue_after), cue_after.spin),
                (TrackedBall::Object, true) => (None, Vec3::zeros()),
                (TrackedBall::Object, false) => (Some(&self.object_after), object_after.spin),
            };
            let change = |t: f64| {
                let [x, y] = path.map_or([0.0; 2], |path| path.spin_change(t, properties));
                Vec3::new(x, y, 0.0)
            };
            let at = turned_until(place, spin, *time, t, &change);
            let centre = path.map_or(self.truth.object, |path| path.position(t));
            let seen = [0, 1].map(|i| centre[i] + properties.radius * at[i]);
            (t, seen, at.z > LEAST_HEIGHT)
        };
        (0..=before + after).map(position).collect()
    }
}

impl Camera {
    /// Where impacts lie, along x and y, m.
    pub(crate) const FIELD_M: [f64; 2] = [0.3, 1.0];

    /// How many frames it takes before and after the impact.
    pub(crate) fn frames(&self) -> [usize; 2] {
        [self.before_ms, self.after_ms].map(|ms| (1e-3 * ms * self.fps).round() as usize)
    }
}

impl From<ClothSpec> for Cloth<f64> {
    fn from(ClothSpec { mu_k: sliding, mu_r: rolling, bounce }: ClothSpec) -> Self {
        Self { sliding, rolling, bounce }
    }
}

/// The frames of one shot without noise or gaps, and what it really was. The cue ball just before the
/// impact is given in the collision frame, which here is the table's; the impact comes a part `phase` of a frame after the
/// last frame before it, with markers at these places on the cue ball and on the object ball (unit vectors from the
/// ball's centre).
///
/// # Errors
/// The shot is no collision.
pub fn noise_free(
    model: &Model,
    coefficients: &Coefficients,
    (camera, cloth): (&Camera, &ClothSpec),
    cue: &BallState,
    (phase, places): (f64, &[Vec<Vec3>; 2]),
) -> Result<(TrackShot, TrueImpact), NotACollision> {
    let [before, after] = camera.frames();
    let time = (before as f64 + phase) / camera.fps;
    let course = Course::new(model, coefficients, &Cloth::from(*cloth), cue, (time, 0.0, [0.5; 2]))?;
    let sample = |t: f64, [x, y]: [f64; 2]| Sample { t, x, y, sd: Some([camera.position_sd_m; 2]) };
    let times = || (0..=before + after).map(|n| n as f64 / camera.fps);
    let [cues, objects] = [0, 1].map(|ball| times().map(|t| sample(t, course.centres(t)[ball])).collect());
    let mut marked = Vec::new();
    for ball in [TrackedBall::Cue, TrackedBall::Object] {
        for (number, place) in places[ball as usize].iter().enumerate() {
            let positions = course.marker(camera, &marked_ball(model, ball), ball, *place);
            let in_sight = positions.into_iter().filter(|(.., in_sight)| *in_sight);
            let samples = in_sight.map(|(t, at, _)| sample(t, at)).collect();
            marked.push(Marker { ball, name: format!("m{}", number + 1), samples });
        }
    }
    Ok((tracked(camera.fps, (cues, objects), marked, Spin::Unknown, String::new()), course.truth))
}

/// The ball that a marker is on.
fn marked_ball(model: &Model, ball: TrackedBall) -> Ball {
    if ball == TrackedBall::Cue { model.ball } else { model.object_ball() }
}

fn tracked(
    fps: f64,
    (cue, object): (Vec<Sample>, Vec<Sample>),
    markers: Vec<Marker>,
    spin: Spin,
    name: String,
) -> TrackShot {
    TrackShot { markers, ..TrackShot::new(name, fps, spin, [cue, object]) }
}

impl Maker<'_> {
    /// Every shot as a camera sees it, and what it really was.
    pub(super) fn tracks(&mut self) -> Result<Vec<(TrackShot, TrueImpact)>, BadSpec> {
        (0..self.spec.shots.count).map(|number| self.track(number)).collect()
    }

    fn track(&mut self, number: usize) -> Result<(TrackShot, TrueImpact), BadSpec> {
        let camera = self.spec.camera;
        let Camera { fps, position_sd_m: sd, gaps, outliers, markers, .. } = camera;
        let (_, _, cue) = self.shot(number);
        let direction = self.between([-std::f64::consts::PI, std::f64::consts::PI]);
        let object = [self.between(Camera::FIELD_M), self.between(Camera::FIELD_M)];
        let frames = camera.frames();
        let time = (frames[0] as f64 + self.rng.random::<f64>()) / fps;
        let meeting = (time, direction, object);
        let course =
            Course::new(&self.model, &self.coefficients, &Cloth::from(self.spec.cloth), &cue, meeting)?;
        let (mut cues, mut objects) = (Vec::new(), Vec::new());
        for n in 0..=frames[0] + frames[1] {
            let t = n as f64 / fps;
            let [cue, object] = course.centres(t);
            for ([x, y], samples) in [(cue, &mut cues), (object, &mut objects)] {
                let mut seen = Sample { t, x: x + self.noise(sd), y: y + self.noise(sd), sd: None };
                let (missing, wrong) = (self.rng.random::<f64>() < gaps, self.rng.random::<f64>() < outliers);
                let (dx, dy) = (self.between([-0.02, 0.02]), self.between([-0.02, 0.02]));
                if wrong {
                    seen.x += dx;
                    seen.y += dy;
                }
                if !missing {
                    samples.push(seen);
                }
            }
        }
        let played = self.spec.shots.cue_spin[number % self.spec.shots.cue_spin.len()];
        let mut marked = Vec::new();
        for (ball, number) in [TrackedBall::Cue, TrackedBall::Object]
            .into_iter()
            .flat_map(|ball| (0..markers).map(move |number| (ball, number)))
        {
            let place = self.place_on_top();
            let mut samples = Vec::new();
            for (t, at, in_sight) in course.marker(&camera, &marked_ball(&self.model, ball), ball, place) {
                let [x, y] = at.map(|at| at + self.noise(sd));
                if in_sight {
                    samples.push(Sample { t, x, y, sd: None });
                }
            }
            marked.push(Marker { ball, name: format!("m{}", number + 1), samples });
        }
        let spin = match played {
            _ if markers > 0 => Spin::Unknown,
            Played::Stun => Spin::Stun,
            Played::NaturalRoll => Spin::NaturalRoll,
            Played::AlmostRoll | Played::Draw | Played::Side | Played::SlightSide | Played::Any => {
                Spin::Measured { spin: course.truth.cue_before.spin, sd: [None; 3] }
            }
        };
        let shot = tracked(fps, (cues, objects), marked, spin, (number + 1).to_string());
        Ok((shot, course.truth))
    }
}

/// A marker nearer to the rim than this part of the radius above the centre is not seen.
const LEAST_HEIGHT: f64 = 0.1;

/// Rotations are followed in steps of this many seconds.
const STEP: f64 = 1e-4;

/// Where on the ball a marker is at time `t` that is at `place` at the impact.
fn turned_until(place: Vec3, spin: Vec3, impact: f64, t: f64, change: &dyn Fn(f64) -> Vec3) -> Vec3 {
    let steps = ((t - impact).abs() / STEP).ceil().max(1.0);
    let step = (t - impact) / steps;
    let middle = |n: usize| impact + (n as f64 + 0.5) * step;
    (0..steps as usize).fold(place, |place, n| turn(place, (spin + change(middle(n))) * step))
}

impl Maker<'_> {
    /// A place on the upper quarter of the ball, where it is seen for some time.
    fn place_on_top(&mut self) -> Vec3 {
        let (height, angle) = (self.between([0.5, 0.95]), self.between([0.0, std::f64::consts::TAU]));
        let across = (1.0 - height * height).sqrt();
        Vec3::new(across * angle.cos(), across * angle.sin(), height)
    }
}

/// The canonical long CSV, `shot,frame,ball,x,y`, with `point` where there are markers.
pub(super) fn long_csv(shots: &[(TrackShot, TrueImpact)]) -> String {
    let marked = shots.iter().any(|(shot, _)| !shot.markers.is_empty());
    let mut table =
        String::from(if marked { "shot,frame,ball,point,x,y\n" } else { "shot,frame,ball,x,y\n" });
    for (shot, _) in shots {
        let centres = [("cue", "centre", &shot.cue), ("object", "centre", &shot.object)];
        let points = shot.markers.iter().map(|marker| {
            let ball = if marker.ball == TrackedBall::Cue { "cue" } else { "object" };
            (ball, marker.name.as_str(), &marker.samples)
        });
        for (ball, point, samples) in centres.into_iter().chain(points) {
            let place = if marked { format!("{ball},{point}") } else { ball.to_string() };
            for Sample { t, x, y, .. } in samples {
                let frame = (t * shot.fps).round();
                _ = writeln!(table, "{},{frame},{place},{x:.7},{y:.7}", shot.name);
            }
        }
    }
    table
}

/// Which spin was played, `shots.csv`.
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
