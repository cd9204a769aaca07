//! Where both balls are at any time: pieces quadratic in time, before the impact, in flight,
//! sliding and rolling.
//!
//! Nature is smooth where an idealised model has jumps: a contact lasts 280 µs, a landing 1 ms.
//! Each is one more quadratic piece, so that χ² has neither kinks nor jumps where a frame passes
//! it.

use num_dual::DualNum;

use super::dual::{Dual, DualVector, INPUTS, constant, norm};
use super::impact::{Contact, Correction, Side};
use super::own::{self, OWN};
use crate::physics::ball::{Ball, Vec3};
use crate::physics::cloth_motion::{GRAVITY, MAX_FLIGHTS, MIN_REBOUND};
use crate::physics::collision::NotACollision;
use crate::problem::frames;
use crate::problem::unknowns::{Id, Own, Shared};

/// Half of the time that a landing lasts, s. It moves a ball by less than 6 µm.
const HALF_LANDING: f64 = 5e-4;

/// Half of the time that the contact of the balls lasts, s (Kim 2024, below Eq. 37).
const HALF_CONTACT: f64 = 1.4e-4;

/// Number of coefficients of x, y and height: the constant, those per s and per s²/2.
pub(super) const COEFFICIENTS: usize = 9;

/// How the cue ball moves on the cloth before the impact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Approach {
    /// Without slip.
    Rolls,
    /// With the slip that its spin gives it.
    Slides,
}

/// Spin of the cue ball before the impact as far as it is stated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StatedSpin {
    pub approach: Approach,
    /// Shared unknown that the topspin is counted from.
    pub mean: Option<Id>,
    /// Measured spin in the table frame, rad/s.
    pub measured: Option<Vec3>,
}

/// Outcome offsets of the cue ball and of the object ball.
const OFFSETS: [[Id; 2]; 2] = [[Id::CueAlong, Id::CueAcross], [Id::ObjectAlong, Id::ObjectAcross]];

/// A part of a ball's path, in time since the first guess of the impact: x, y and height, quadratic in time
/// (m, m/s, m/s²).
pub(super) type Piece = frames::Piece<COEFFICIENTS, INPUTS>;

/// Place, velocity and acceleration of a ball on the table, and the same of its height.
struct Moving {
    place: DualVector,
    velocity: DualVector,
    pull: DualVector,
    height: [Dual; 3],
}

impl Moving {
    /// A ball on the cloth.
    fn flat(place: &DualVector, velocity: &DualVector, pull: &DualVector) -> Self {
        Self { place: *place, velocity: *velocity, pull: *pull, height: [constant(0.0); 3] }
    }
}

/// Returns the path of a ball that moves so at `start`.
fn piece(start: Dual, moving: &Moving) -> Piece {
    let Moving { place, velocity, pull, height: [h, v_h, a_h] } = moving;
    let origin = |x: Dual, v: Dual, a: Dual| [x - v * start + a * start * start * 0.5, v - a * start, a];
    let [x0, x1, x2] = origin(place.x, velocity.x, pull.x);
    let [y0, y1, y2] = origin(place.y, velocity.y, pull.y);
    let [h0, h1, h2] = origin(*h, *v_h, *a_h);
    Piece::new(start.re, &[x0, x1, x2, y0, y1, y2, h0, h1, h2])
}

/// Returns the path along which the velocity of a ball that moves so at `at` changes by `change`, evenly from
/// `half` before to `half` after.
fn between(at: Dual, half: f64, moving: &Moving, change: &DualVector) -> Piece {
    let Moving { place, velocity, pull, height } = moving;
    let half = constant(half);
    let early = Moving {
        place: place - velocity * half + pull * (half * half * 0.5),
        velocity: velocity - pull * half,
        pull: pull + change / (half * 2.0),
        height: *height,
    };
    piece(at - half, &early)
}

/// The cloth's action on a ball.
struct Cloth {
    sliding: Dual,
    rolling: Dual,
    bounce: Dual,
    /// Acceleration of a sliding ball down the tilted table, m/s².
    tilt: DualVector,
    /// Acceleration of gravity in the film's seconds, m/s²: a wrong frame rate changes what
    /// accelerates balls, not an impact.
    gravity: Dual,
}

impl Cloth {
    fn new(shared: &Shared) -> Self {
        let rate = shared.dual(Id::Rate);
        let gravity = (rate * rate).recip() * GRAVITY;
        Self {
            sliding: shared.dual(Id::MuK),
            rolling: shared.dual(Id::MuR),
            bounce: shared.dual(Id::Bounce),
            tilt: DualVector::new(shared.dual(Id::TiltX), shared.dual(Id::TiltY)) * gravity,
            gravity,
        }
    }

    fn pull_sliding(&self, slip: &DualVector) -> DualVector {
        self.tilt - slip * (self.sliding * self.gravity / norm(slip))
    }

    fn pull_rolling(&self, velocity: &DualVector, inertia: f64) -> DualVector {
        self.tilt * constant(1.0 / (1.0 + inertia))
            - velocity * (self.rolling * self.gravity / norm(velocity))
    }

    /// Returns the path of a ball that leaves `place` at `time`: flights, landings, sliding,
    /// rolling. Its velocity is turned from the collision frame to the table.
    fn follow(
        &self,
        mut time: Dual,
        mut place: DualVector,
        ball: &Side,
        turn: impl Fn(&DualVector) -> DualVector,
    ) -> Vec<Piece> {
        let (mut velocity, mut slip, mut rise) = (turn(&ball.velocity), turn(&ball.slip()), ball.rise);
        let zero = constant(0.0);
        // a path that is followed from a little later on
        let later = |late: f64, piece: Piece| Piece { start: piece.start + late, ..piece };
        let still = DualVector::new(zero, zero);
        // an impulse on the ball changes its slip by (1 + ν)/ν times as much as its velocity
        let lever = (1.0 + ball.inertia) / ball.inertia;
        let mut pieces = Vec::with_capacity(16);
        let mut late = HALF_CONTACT;
        while rise.re > MIN_REBOUND && pieces.len() < 2 * MAX_FLIGHTS {
            let flying =
                Moving { height: [zero, rise, -self.gravity], ..Moving::flat(&place, &velocity, &still) };
            pieces.push(later(late, piece(time, &flying)));
            let flight = rise * 2.0 / self.gravity;
            place += velocity * flight;
            time += flight;
            let (grip, speed) = (self.sliding * (self.bounce + 1.0) * rise, norm(&slip));
            let stop = speed / lever;
            let impulse = slip * (if grip.re < stop.re { grip } else { stop } / speed);
            late = 0.0;
            if (flight * self.bounce).re > 2.0 * HALF_LANDING {
                let height = (rise - self.gravity * (0.5 * HALF_LANDING)) * HALF_LANDING;
                let height = [height, rise * (self.bounce - 1.0) * 0.5, zero];
                let landing = Moving { height, ..Moving::flat(&place, &velocity, &still) };
                pieces.push(between(time, HALF_LANDING, &landing, &-impulse));
                late = HALF_LANDING;
            }
            velocity -= impulse;
            slip -= impulse * constant(lever);
            rise *= self.bounce;
        }
        if rise.re > 0.0 {
            // all further bounces last 2v_z/g(1 − e_t); their friction is (1 + e_t)/2 of a sliding
            // ball's on average, but later
            let pull = self.pull_sliding(&slip) * ((self.bounce + 1.0) * 0.5);
            pieces.push(later(late, piece(time, &Moving::flat(&place, &velocity, &pull))));
            let bouncing = rise * 2.0 / (self.gravity * (-self.bounce + 1.0));
            let lateness = self.bounce * 2.0 / (self.bounce + 1.0);
            place += velocity * bouncing + pull * (bouncing * bouncing * 0.5 * lateness);
            velocity += pull * bouncing;
            slip += pull * (bouncing * lever);
            time += bouncing;
            late = 0.0;
        }
        let pull = self.pull_sliding(&slip);
        pieces.push(later(late, piece(time, &Moving::flat(&place, &velocity, &pull))));
        let sliding = norm(&slip) / lever / (self.sliding * self.gravity);
        place += velocity * sliding + pull * (sliding * sliding * 0.5);
        velocity += pull * sliding;
        let pull = self.pull_rolling(&velocity, ball.inertia);
        pieces.push(piece(time + sliding, &Moving::flat(&place, &velocity, &pull)));
        pieces
    }
}

/// A shot at its impact: its own unknowns with derivatives, and both balls in the collision frame.
pub(super) struct Struck {
    pub inputs: [Dual; OWN],
    pub before: Side,
    /// Cue ball and object ball.
    pub after: [Side; 2],
    pub sticks: bool,
    sin: Dual,
    cos: Dual,
}

impl Struck {
    /// Returns the impact of a shot, its instant counted from the present guess.
    ///
    /// # Errors
    /// Why its unknowns describe no collision.
    pub fn new(
        values: &Own,
        shared: &Shared,
        spin: &StatedSpin,
        (contact, correction): (&Contact, &Correction),
    ) -> Result<Self, NotACollision> {
        let inputs = own_inputs(values);
        let before = cue_before(spin, shared, &inputs, &contact.object());
        let (mut after, sticks) = contact.collide(&before, shared, correction)?;
        for (side, [along, across]) in after.iter_mut().zip(OFFSETS) {
            side.velocity += DualVector::new(shared.dual(along), shared.dual(across));
        }
        let (sin, cos) = inputs[own::DIRECTION].sin_cos();
        Ok(Self { inputs, before, after, sticks, sin, cos })
    }

    /// Returns a vector of the collision frame in the frame of the table.
    pub fn turn(&self, v: &DualVector) -> DualVector {
        DualVector::new(v.x * self.cos - v.y * self.sin, v.x * self.sin + v.y * self.cos)
    }
}

/// Paths of the cue ball and of the object ball of one shot.
pub(super) struct Paths {
    /// Pieces of each ball, the first before the impact.
    pub pieces: [Vec<Piece>; 2],
    pub struck: Struck,
}

/// Returns a shot's own unknowns with derivatives; time counts from the present guess of the impact.
pub(super) fn own_inputs(values: &Own) -> [Dual; OWN] {
    std::array::from_fn(|i| {
        let value = if i == own::TIME { 0.0 } else { values[i] };
        Dual::from_re(value).derivative(i)
    })
}

/// Returns the cue ball just before the impact, in the collision frame.
pub(super) fn cue_before(spin: &StatedSpin, shared: &Shared, inputs: &[Dual; OWN], ball: &Ball) -> Side {
    let [along, across] = [inputs[own::ALONG], inputs[own::ACROSS]];
    let topspin = spin.mean.map_or(constant(0.0), |id| shared.dual(id)) + inputs[own::TOPSPIN];
    let velocity = DualVector::new(along, across);
    let side = inputs[own::SIDE] * norm(&velocity);
    let mut turning = [-across * topspin, along * topspin, side];
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

/// Returns the paths of both balls of a shot.
///
/// # Errors
/// Why its unknowns describe no collision.
pub(super) fn follow_balls(
    values: &Own,
    shared: &Shared,
    spin: &StatedSpin,
    (contact, correction): (&Contact, &Correction),
) -> Result<Paths, NotACollision> {
    let struck = Struck::new(values, shared, spin, (contact, correction))?;
    let turn = |v: &DualVector| struck.turn(v);
    let instant = struck.inputs[own::TIME];
    let zero = constant(0.0);
    let object = contact.object();
    let cloth = Cloth::new(shared);
    let object_place = DualVector::new(struck.inputs[own::X], struck.inputs[own::Y]);
    // centres of touching balls are 2√(R_c R_o) apart on the table
    let distance = shared.dual(Id::RadiusRatio).sqrt() * (2.0 * object.radius);
    let cue_place = object_place - DualVector::new(struck.cos, struck.sin) * distance;
    let (velocity, slip) = (turn(&struck.before.velocity), turn(&struck.before.slip()));
    let pull = match spin.approach {
        Approach::Rolls => cloth.pull_rolling(&velocity, object.inertia),
        Approach::Slides => cloth.pull_sliding(&slip),
    };
    let still = DualVector::new(zero, zero);
    let places = [cue_place, object_place];
    let velocities = [velocity, still];
    let pulls = [pull, still];
    let pieces = [0, 1].map(|i| {
        let moving = Moving::flat(&places[i], &velocities[i], &pulls[i]);
        let mut before = piece(instant, &moving);
        before.start = f64::NEG_INFINITY;
        let after = &struck.after[i];
        let change = turn(&after.velocity) - velocities[i];
        let mut pieces = vec![before, between(instant, HALF_CONTACT, &moving, &change)];
        pieces.extend(cloth.follow(instant, places[i], after, turn));
        // pieces that are over before the contact ends are never followed
        for j in (3..pieces.len()).rev() {
            pieces[j - 1].start = pieces[j - 1].start.min(pieces[j].start);
        }
        for piece in &mut pieces[2..] {
            piece.start = piece.start.max(HALF_CONTACT);
        }
        pieces
    });
    Ok(Paths { pieces, struck })
}
