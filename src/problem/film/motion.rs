//! Paths of both balls at any time: pieces quadratic in time, before the impact, in flight,
//! sliding and rolling.
//!
//! Real motion is smooth at the jumps of an idealised model: a contact lasts 280 µs, a landing 1
//! ms. Each is one more quadratic piece, so that χ² is smooth when a frame passes it.

use num_dual::DualNum;

use super::dual::{Dual, DualVector, INPUTS, constant, norm};
use super::impact::{Contact, Correction, Side};
use super::own::{self, OWN};
use super::spins::ShotSpin;
use crate::physics::ball::Ball;
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

/// A part of a ball's path, in time since the first guess of the impact: x, y and height, quadratic
/// in time (m, m/s, m/s²).
pub(super) type Piece = frames::Piece<COEFFICIENTS, INPUTS>;

/// Place, velocity and acceleration of a ball at an instant: along x, along y, and upward.
#[derive(Clone, Copy)]
struct Moving([[Dual; 3]; 3]);

impl Moving {
    /// Returns a ball on the cloth.
    fn flat(place: &DualVector, velocity: &DualVector, pull: &DualVector) -> Self {
        let still = [constant(0.0); 3];
        Self([[place.x, velocity.x, pull.x], [place.y, velocity.y, pull.y], still])
    }

    /// Returns the path of a ball that moves so at `start`.
    fn piece(&self, start: Dual) -> Piece {
        let mut coefficients = [constant(0.0); COEFFICIENTS];
        for (axis, [x, v, a]) in self.0.into_iter().enumerate() {
            // x − v s + a s²/2, v − a s, a
            let all = [x - (v - a * start * 0.5) * start, v - a * start, a];
            coefficients[3 * axis..3 * axis + 3].copy_from_slice(&all);
        }
        Piece::new(start.re, &coefficients)
    }

    /// Returns the path along which the velocity of a ball that moves so along x and y at `at`
    /// changes by `change`, evenly from `half` before to `half` after; upward it moves so at the
    /// beginning.
    fn turning(&self, at: Dual, half: f64, change: &DualVector) -> Piece {
        let early = |[x, v, a]: [Dual; 3], change: Dual| {
            [x - v * half + a * (half * half * 0.5), v - a * half, a + change / (half * 2.0)]
        };
        let [x, y, height] = self.0;
        Self([early(x, change.x), early(y, change.y), height]).piece(at - half)
    }
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

/// A ball on its way after the impact, and the pieces of its path.
struct Walk {
    time: Dual,
    place: DualVector,
    velocity: DualVector,
    slip: DualVector,
    /// Change of the slip over that of the velocity by an impulse on the cloth, (1 + ν)/ν.
    lever: f64,
    /// Time after which the next piece is followed, s: the piece before lasts until then.
    late: f64,
    pieces: Vec<Piece>,
}

impl Walk {
    /// Appends the path from here on with these motions upward: height, velocity, acceleration.
    fn add(&mut self, pull: &DualVector, upward: &[Dual; 3]) {
        let mut moving = Moving::flat(&self.place, &self.velocity, pull);
        moving.0[2] = *upward;
        let piece = moving.piece(self.time);
        self.pieces.push(Piece { start: piece.start + std::mem::take(&mut self.late), ..piece });
    }

    /// Goes on for some seconds with this acceleration, which acts by the part `late` later than
    /// evenly.
    fn advance(&mut self, seconds: Dual, pull: &DualVector, late: Dual) {
        self.place += self.velocity * seconds + pull * (seconds * seconds * 0.5 * late);
        self.velocity += pull * seconds;
        self.slip += pull * (seconds * self.lever);
        self.time += seconds;
    }
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

    /// Appends the path of a ball after the impact, whose upward velocity is `rise`: flights,
    /// landings, sliding, rolling.
    fn follow(&self, walk: &mut Walk, mut rise: Dual, inertia: f64) {
        let none = constant(0.0);
        let still = DualVector::new(none, none);
        let mut flights = 0;
        while rise.re > MIN_REBOUND && flights < MAX_FLIGHTS {
            flights += 1;
            walk.add(&still, &[none, rise, -self.gravity]);
            let flight = rise * 2.0 / self.gravity;
            walk.advance(flight, &still, none);
            let (grip, speed) = (self.sliding * (self.bounce + 1.0) * rise, norm(&walk.slip));
            let stop = speed / walk.lever;
            let impulse = walk.slip * (if grip.re < stop.re { grip } else { stop } / speed);
            if (flight * self.bounce).re > 2.0 * HALF_LANDING {
                let mut landing = Moving::flat(&walk.place, &walk.velocity, &still);
                let height = (rise - self.gravity * (0.5 * HALF_LANDING)) * HALF_LANDING;
                landing.0[2] = [height, rise * (self.bounce - 1.0) * 0.5, none];
                walk.pieces.push(landing.turning(walk.time, HALF_LANDING, &-impulse));
                walk.late = HALF_LANDING;
            }
            walk.velocity -= impulse;
            walk.slip -= impulse * constant(walk.lever);
            rise *= self.bounce;
        }
        if rise.re > 0.0 {
            // all further bounces last 2v_z/g(1 − e_t); their friction is (1 + e_t)/2 of a sliding
            // ball's on average, but later
            let pull = self.pull_sliding(&walk.slip) * ((self.bounce + 1.0) * 0.5);
            walk.add(&pull, &[none; 3]);
            let bouncing = rise * 2.0 / (self.gravity * (-self.bounce + 1.0));
            walk.advance(bouncing, &pull, self.bounce * 2.0 / (self.bounce + 1.0));
        }
        let pull = self.pull_sliding(&walk.slip);
        walk.add(&pull, &[none; 3]);
        let sliding = norm(&walk.slip) / walk.lever / (self.sliding * self.gravity);
        walk.advance(sliding, &pull, constant(1.0));
        let pull = self.pull_rolling(&walk.velocity, inertia);
        walk.add(&pull, &[none; 3]);
    }
}

/// A shot at its impact: its own unknowns with derivatives, and both balls in the collision frame.
pub(super) struct Struck {
    pub(crate) inputs: [Dual; OWN],
    pub(crate) before: Side,
    /// Cue ball and object ball.
    pub(crate) after: [Side; 2],
    pub(crate) sticks: bool,
    sin: Dual,
    cos: Dual,
}

/// Outcome offsets of the cue ball and of the object ball.
const OFFSETS: [[Id; 2]; 2] = [[Id::CueAlong, Id::CueAcross], [Id::ObjectAlong, Id::ObjectAcross]];

impl Struck {
    /// Returns the impact of a shot, its instant counted from the present guess.
    ///
    /// # Errors
    /// Why its unknowns describe no collision.
    pub fn new(
        values: &Own,
        shared: &Shared,
        spin: &ShotSpin,
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

    /// Returns the paths of the cue ball, which rolls before the impact or slides, and of the
    /// object ball, each with its first piece before the impact.
    pub fn paths(&self, shared: &Shared, rolls: bool, object: &Ball) -> [Vec<Piece>; 2] {
        let instant = self.inputs[own::TIME];
        let cloth = Cloth::new(shared);
        let object_place = DualVector::new(self.inputs[own::X], self.inputs[own::Y]);
        // the distance of the centres of touching balls on the table is 2√(R_c R_o)
        let distance = shared.dual(Id::RadiusRatio).sqrt() * (2.0 * object.radius);
        let cue_place = object_place - DualVector::new(self.cos, self.sin) * distance;
        let (velocity, slip) = (self.turn(&self.before.velocity), self.turn(&self.before.slip()));
        let pull =
            if rolls { cloth.pull_rolling(&velocity, object.inertia) } else { cloth.pull_sliding(&slip) };
        let still = DualVector::new(constant(0.0), constant(0.0));
        let balls = [(cue_place, velocity, pull), (object_place, still, still)];
        [0, 1].map(|i| {
            let ((place, velocity, pull), after) = (&balls[i], &self.after[i]);
            let moving = Moving::flat(place, velocity, pull);
            let after_impact = self.turn(&after.velocity);
            let before = Piece { start: f64::NEG_INFINITY, ..moving.piece(instant) };
            let contact = moving.turning(instant, HALF_CONTACT, &(after_impact - velocity));
            let mut walk = Walk {
                time: instant,
                place: *place,
                velocity: after_impact,
                slip: self.turn(&after.slip()),
                lever: (1.0 + after.inertia) / after.inertia,
                late: HALF_CONTACT,
                pieces: vec![before, contact],
            };
            cloth.follow(&mut walk, after.rise, after.inertia);
            let mut pieces = walk.pieces;
            // pieces that are over before the contact ends are never followed
            for j in (3..pieces.len()).rev() {
                pieces[j - 1].start = pieces[j - 1].start.min(pieces[j].start);
            }
            for piece in &mut pieces[2..] {
                piece.start = piece.start.max(HALF_CONTACT);
            }
            pieces
        })
    }
}

/// Returns a shot's own unknowns with derivatives; time counts from the present guess of the
/// impact.
pub(super) fn own_inputs(values: &Own) -> [Dual; OWN] {
    std::array::from_fn(|i| {
        let value = if i == own::TIME { 0.0 } else { values[i] };
        Dual::from_re(value).derivative(i)
    })
}

/// Returns the cue ball just before the impact, in the collision frame.
pub(super) fn cue_before(spin: &ShotSpin, shared: &Shared, inputs: &[Dual; OWN], ball: &Ball) -> Side {
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
