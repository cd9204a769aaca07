//! A shot of balls through its impact, with derivatives, and the paths of both balls.

use nalgebra::Vector3;
use num_dual::DualNum;

use super::camera::{Camera, Point};
use super::dual::{Dual, DualVector, INPUTS, SMOOTH_SPEED, constant, gradient, norm};
use super::filmed::ShotAt;
use super::impact::{Parting, Side};
use super::own::{self, MOVING};
use super::spins::ShotSpin;
use crate::physics::ball::Ball;
use crate::physics::cloth_motion::{Forces, GRAVITY, Moment, Smoothing, Stretch, contact_time};
use crate::physics::collision::{Model, NotACollision};
use crate::problem::frames;
use crate::problem::unknowns::{Id, Own, Shared};

/// Number of coefficients of x, y and height: the constant, those per s and per s²/2.
pub(super) const COEFFICIENTS: usize = 9;

/// A part of a ball's path, in time since the first guess of the impact: x, y and height, quadratic
/// in time (m, m/s, m/s²).
pub(super) type Piece = frames::Piece<COEFFICIENTS, INPUTS>;

/// Returns a part of a path as coefficients.
fn piece(stretch: &Stretch<Dual>) -> Piece {
    let Moment { time, place, velocity, .. } = &stretch.from;
    let (s, s_by) = (time.re, gradient(time));
    let mut piece = Piece::new(stretch.start, &[]);
    for axis in 0..3 {
        let [x, v, a] = [&place[axis], &velocity[axis], &stretch.acceleration[axis]];
        let [x_by, v_by, a_by] = [x, v, a].map(gradient);
        // x − v s + a s²/2, v − a s, a
        let velocity = v.re - a.re * s;
        let coefficients = [x.re - v.re * s + a.re * (0.5 * s * s), velocity, a.re];
        let by =
            [x_by - v_by * s + a_by * (0.5 * s * s) - s_by * velocity, v_by - a_by * s - s_by * a.re, a_by];
        for (i, (coefficient, by)) in (3 * axis..).zip(coefficients.into_iter().zip(&by)) {
            piece.at[i] = coefficient;
            piece.by.set_column(i, by);
        }
    }
    piece
}

/// Returns the place on the table and the height of a ball on a piece at a time since the first
/// guess of the impact.
pub(super) fn locate(at: &[f64], time: f64) -> (Point, f64) {
    let coordinate = |i: usize| at[3 * i] + at[3 * i + 1] * time + at[3 * i + 2] * (0.5 * time * time);
    (Point::new(coordinate(0), coordinate(1)), coordinate(2))
}

/// Returns the widths of the jumps of an idealised motion. Real motion is smooth there, so that χ²
/// is smooth when a frame passes one: a contact of the balls lasts, and so does a landing, for 1 ms
/// or, as in an exposure, for half of a frame, in which a ball moves by less than 25 µm at 120
/// frames/s.
fn smoothing(fps: f64) -> Smoothing {
    let landing = (0.25 / fps).max(5e-4);
    Smoothing { contact: Model::CONTACT_TIME, landing, speed: SMOOTH_SPEED }
}

/// Returns the action of the cloth on balls of this moment of inertia, seen at a frame rate. A wrong
/// rate changes what accelerates balls, not an impact.
fn forces(shared: &Shared, inertia: f64, fps: f64) -> Forces<Dual> {
    let rate = shared.dual(Id::Rate);
    let gravity = (rate * rate).recip() * GRAVITY;
    Forces {
        sliding: shared.dual(Id::MuK),
        rolling: shared.dual(Id::MuR),
        bounce: shared.dual(Id::Bounce),
        gravity,
        tilt: DualVector::new(shared.dual(Id::TiltX), shared.dual(Id::TiltY)) * gravity,
        inertia,
        smoothing: smoothing(fps),
    }
}

/// A shot at its impact: its motion before it with derivatives, and both balls in the collision frame.
pub(super) struct Struck {
    pub(crate) inputs: [Dual; MOVING],
    pub(crate) before: Side,
    /// Cue ball and object ball.
    pub(crate) after: [Side; 2],
    pub(crate) sticks: bool,
    sin: Dual,
    cos: Dual,
}

impl ShotAt<'_> {
    /// Returns the impact of the shot, its instant counted from the present guess.
    ///
    /// # Errors
    /// Why its unknowns describe no collision.
    pub(super) fn struck(&self) -> Result<Struck, NotACollision> {
        let Self { film, shot, own, shared } = *self;
        let inputs = own_inputs(own);
        let before = cue_before(&shot.spin, shared, &inputs, &film.contact.object());
        let offsets = std::array::from_fn(|i| own[own::SCATTER + i]);
        let Parting { balls: mut after, sticks, .. } =
            film.contact.collide(&before, shared, &offsets, shot.correction.as_deref())?;
        for (side, offset) in after.iter_mut().zip(Id::OFFSETS.chunks_exact(2)) {
            side.velocity += DualVector::new(shared.dual(offset[0]), shared.dual(offset[1]));
        }
        let (sin, cos) = inputs[own::DIRECTION].sin_cos();
        Ok(Struck { inputs, before, after, sticks, sin, cos })
    }
}

impl Struck {
    /// Returns a vector of the collision frame in the frame of the table.
    pub fn turn(&self, v: &DualVector) -> DualVector {
        DualVector::new(v.x * self.cos - v.y * self.sin, v.x * self.sin + v.y * self.cos)
    }

    /// Returns a ball at the impact in the frame of the table.
    fn moment(&self, place: &DualVector, ball: &Side) -> Moment<Dual> {
        let velocity = self.turn(&ball.velocity);
        Moment {
            time: self.inputs[own::TIME],
            place: Vector3::new(place.x, place.y, constant(0.0)),
            velocity: Vector3::new(velocity.x, velocity.y, ball.rise),
            slip: self.turn(&ball.slip()),
        }
    }

    /// Returns the paths of the cue ball, which rolls before the impact or slides, and of the
    /// object ball, each with its first piece before the impact and until its last reading.
    pub fn paths(&self, at: &ShotAt) -> [Vec<Piece>; 2] {
        let (shared, object, camera) = (at.shared, at.film.contact.object(), Camera::new(at.shared));
        let frames = at.shot.tracks.iter().flatten();
        let last = frames.map(|frame| frame.time + camera.delay(frame.seen, 0.0)).reduce(f64::max);
        let until = last.map_or(f64::INFINITY, |last| last - at.own[own::TIME]);
        let forces = forces(shared, object.inertia, at.shot.fps);
        let object_place = DualVector::new(self.inputs[own::X], self.inputs[own::Y]);
        // the centres of balls that begin to touch are 2√(R_c R_o) apart, and v_n T/2 less in the
        // middle of a contact of duration T
        let closing = self.before.velocity.x;
        let approach = shared.dual(Id::Approach) * closing * contact_time(Model::CONTACT_TIME, closing) * 0.5;
        let distance = shared.dual(Id::RadiusRatio).sqrt() * (2.0 * object.radius) - approach;
        let cue_place = object_place - DualVector::new(self.cos, self.sin) * distance;
        let before = self.moment(&cue_place, &self.before);
        let cue_before = if at.shot.spin.rolls { forces.roll(before) } else { forces.slide(before) };
        let cue = self.moment(&cue_place, &self.after[0]);
        let object = self.moment(&object_place, &self.after[1]);
        let object_before = Stretch::free(Moment { velocity: Vector3::zeros(), ..object });
        [forces.through(cue_before, cue, until), forces.through(object_before, object, until)]
            .map(|path| path.iter().map(piece).collect())
    }
}

/// Returns a shot's motion before the impact with derivatives; time counts from the present guess of the
/// impact.
pub(super) fn own_inputs(values: &Own) -> [Dual; MOVING] {
    std::array::from_fn(|i| {
        let value = if i == own::TIME { 0.0 } else { values[i] };
        Dual::from_re(value).derivative(i)
    })
}

/// Returns the cue ball just before the impact, in the collision frame.
pub(super) fn cue_before(spin: &ShotSpin, shared: &Shared, inputs: &[Dual; MOVING], ball: &Ball) -> Side {
    let [along, across] = [inputs[own::ALONG], inputs[own::ACROSS]];
    let rolling = spin.mean.filter(|id| *id == Id::Roll);
    let topspin = rolling.map_or(constant(0.0), |id| shared.dual(id)) + inputs[own::TOPSPIN];
    let velocity = DualVector::new(along, across);
    let side = inputs[own::SIDE] * norm(&velocity);
    let swerve = inputs[own::SWERVE];
    let mut turning = [along * swerve - across * topspin, across * swerve + along * topspin, side];
    if let Some(measured) = spin.measured {
        // from the table to the collision frame
        let (sin, cos) = inputs[own::DIRECTION].sin_cos();
        let [x, y, z] = [measured.x, measured.y, measured.z].map(|w| w * ball.radius);
        turning[0] += cos * x + sin * y;
        turning[1] += cos * y - sin * x;
        turning[2] += z;
    }
    Side { velocity, rise: constant(0.0), spin: turning, inertia: ball.inertia }
}
