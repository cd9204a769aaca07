//! The paths of two discs before and after their impact, with all derivatives (physics of discs
//! that slide on a table without rolling), and the law that impacts scatter about.
//!
//! The line of centres n points from the first disc to the second, t = z × n, g = v₂ − v₁; the
//! closing speed is k = −g·n and the slip s = g·t − R₁ω₁ − R₂ω₂. A shot has an e and a q = J_t/J_n
//! of its own:
//!
//! ```text
//! Δg = (1 + e) k (n + q t)                       J_n = (1 + e) k, per reduced mass
//! Δω_i = −(q + d_S,i) (J_n/m_i)/(ν R_i)          momentum gained: d_P J_n
//! p(τ) = c + v (τ − ½ (a/|v| + γ) τ²)            until the disc stops
//! e = e₀ − e₁ k + d_e                            q = law(k, s, e; μ + d_μ, b, c, κ) + d_J
//! ```
//!
//! Friction may act a little earlier than the normal force: that of soft rims ends before it does.
//! The law is that of two equal bodies ([`Model`]); it does not depend on how masses or radii
//! differ. Discs that stick together move on as one rigid body about their centre of mass.

use nalgebra::Vector2;
use num_dual::{DualNum, DualSVec64};

use super::own::{self, CORE};
use crate::physics::Number;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{Coefficients, Fidelity, Input, Model};
use crate::physics::disc::Discs;
use crate::physics::friction_law::Law;
use crate::problem::film::dual::constant;
use crate::problem::frames;
use crate::problem::unknowns::{DISCS, Id, Own, Shared};

/// Returns the shared unknowns that move the discs: those of the contact and of discs alone.
pub(super) fn list_moving() -> impl Iterator<Item = Id> {
    Id::ALL.into_iter().filter(|id| *id <= Id::MassRatio || *id >= Id::Slowing)
}

/// Number of shared unknowns that move the discs.
const MOVING: usize = Id::MassRatio as usize + 1 + DISCS;

/// Number of inputs of a shot's motion, its own unknowns first.
pub(super) const INPUTS: usize = CORE + MOVING;

/// A number with its derivatives by the inputs.
pub(super) type Dual = DualSVec64<INPUTS>;
pub(super) type DualVector = Vector2<Dual>;

/// Part of the relative speed below which a disc counts as at rest: its deceleration goes to 0 with
/// its speed, whose direction is noise.
const AT_REST: f64 = 0.02;

/// Coefficients of a piece of a disc's path: place and velocity at the impact; part of the velocity
/// lost in a second; length, direction at the impact, and angular velocity of the arm on which the
/// disc goes round; its own angular velocity, and the angle by which it has turned at the impact.
pub(super) const COEFFICIENTS: usize = 10;

/// A disc on one side of the impact.
pub(super) type Piece = frames::Piece<COEFFICIENTS, INPUTS>;

/// The motion of a shot: velocities and spins are those of each disc before and after the impact.
pub(super) struct Motion {
    pub(crate) pieces: [[Piece; 2]; 2],
    /// Inputs of the motion.
    pub(crate) own: [Dual; CORE],
    pub(crate) distance: Dual,
    pub(crate) radii: [Dual; 2],
    pub(crate) velocities: [[DualVector; 2]; 2],
    pub(crate) spins: [[Dual; 2]; 2],
}

impl Motion {
    /// Returns the components of a vector along n and t.
    pub fn along(&self, vector: &DualVector) -> [Dual; 2] {
        let (sin, cos) = self.own[own::DIRECTION].sin_cos();
        [vector.x * cos + vector.y * sin, vector.y * cos - vector.x * sin]
    }

    /// Returns g before (0) or after (1) the impact along n, and the slip of the second disc's
    /// contact point against the first's.
    pub fn relative(&self, side: usize) -> [Dual; 2] {
        let [first, second] = self.velocities;
        let [along, across] = self.along(&(second[side] - first[side]));
        [along, across - self.radii[0] * self.spins[0][side] - self.radii[1] * self.spins[1][side]]
    }
}

/// Returns the shared inputs with their derivatives, in the order of [`list_moving`].
fn shared_inputs(shared: &Shared) -> [Dual; MOVING] {
    let mut inputs = [constant(0.0); MOVING];
    for ((place, id), input) in (CORE..).zip(list_moving()).zip(&mut inputs) {
        *input = Dual::from_re(shared[id]).derivative(place);
    }
    inputs
}

/// Returns e by the law at a closing speed.
pub(super) fn restitution(closing: &Dual, shared: &Shared) -> Dual {
    let [_, _, e, _, _, _, slope, ..] = shared_inputs(shared);
    e - slope * closing
}

/// Returns J_t/J_n on the second of two discs by the law at a closing speed, a slip, an e, and a
/// friction that differs by so much from that of all shots; `None` if the discs do not approach.
pub(super) fn impulse_ratio(
    [closing, slip, e, off]: [Dual; 4],
    shared: &Shared,
    inertia: f64,
) -> Option<Dual> {
    let [mu, _, _, b, c, kappa, ..] = shared_inputs(shared);
    let mu = mu + off;
    // two equal discs of radius 1, the second at rest, and a spin of the first that gives the slip
    let mut model = Model::new(Fidelity::Full, Ball { radius: 1.0, mass: 1.0, inertia });
    if kappa.re > 0.0 {
        model = model.giving_way(kappa.re);
    }
    if b.re != 0.0 {
        model.law = Law::Exponential { b: b.re, c: c.re };
    }
    let before = BallState { velocity: Vec3::new(closing.re, 0.0, 0.0), spin: Vec3::new(0.0, 0.0, -slip.re) };
    let coefficients = Coefficients { mu: mu.re.max(0.0), mu_s: 0.0, e: e.re.clamp(0.0, 1.0) };
    let (outcome, jacobian) = model.collide_with_jacobian(&before, &coefficients).ok()?;
    let after = outcome.object.velocity;
    let ratio = after.y / after.x;
    let inputs = [
        (Input::VelocityX, closing),
        (Input::SpinZ, -slip),
        (Input::E, e),
        (Input::Mu, mu),
        (Input::B, b),
        (Input::C, c),
        (Input::Kappa, kappa),
    ];
    let add = |sum: Dual, (input, value): (Input, Dual)| {
        let column = jacobian.column(input as usize);
        sum + (value - value.re) * ((column[7] - ratio * column[6]) / after.x)
    };
    Some(inputs.into_iter().fold(Dual::from_re(ratio), add))
}

/// Returns the place of a point on a piece `late` seconds after the impact: the disc's centre, or a
/// marker with this direction at the impact and this distance from the centre.
pub(super) fn locate<T: Number>(at: &[T; COEFFICIENTS], late: T, marker: Option<[T; 2]>) -> Vector2<T> {
    let [x, y, v_x, v_y, rate, arm, direction, turning, spin, turned] = *at;
    let moving = if rate.re() * late.re() > 1.0 { rate.recip() } else { late };
    let way = moving - rate * moving * moving * 0.5;
    let (sin, cos) = (direction + turning * late).sin_cos();
    let centre = Vector2::new(x + v_x * way + arm * cos, y + v_y * way + arm * sin);
    let Some([direction, radius]) = marker else { return centre };
    let (sin, cos) = (direction + spin * late + turned).sin_cos();
    Vector2::new(centre.x + radius * cos, centre.y + radius * sin)
}

/// Follows both discs through the impact, if they stick together as one body; `None` if they do not
/// approach.
pub(super) fn follow(is_stuck: bool, values: &Own, shared: &Shared, discs: &Discs) -> Option<Motion> {
    let own: [Dual; CORE] = std::array::from_fn(|i| constant::<INPUTS>(values[i]).derivative(i));
    let [.., mass_ratio, slowing, drag, contact_distance] = shared_inputs(shared);
    let pair = |i: usize| DualVector::new(own[i], own[i + 1]);
    let (sin, cos) = own[own::DIRECTION].sin_cos();
    let (n, t) = (DualVector::new(cos, sin), DualVector::new(-sin, cos));
    let distance = contact_distance + own[own::DISTANCE];
    let radii = discs.radii.map_or([distance * 0.5; 2], |radii| radii.map(constant));
    let centres = [pair(own::X), pair(own::X) + n * distance];
    let before = [pair(own::VELOCITY), pair(own::VELOCITY + 2)];
    let spins = [own[own::SPIN], own[own::SPIN + 1]];

    let relative = before[1] - before[0];
    let closing = -relative.dot(&n);
    if !(closing.re > 0.0) {
        return None;
    }
    // J_n/m₁ = f₁ J_n, J_n/m₂ = f₂ J_n per reduced mass
    let parts = [(mass_ratio + 1.0).recip(), mass_ratio / (mass_ratio + 1.0)];
    let (normal, ratio) = ((own[own::RESTITUTION] + 1.0) * closing, own[own::RATIO]);
    let gained = (n * own[own::MOMENTUM] + t * own[own::MOMENTUM + 1]) * (normal * parts[0] * parts[1]);
    let mean = |of: [DualVector; 2]| of[0] * parts[1] + of[1] * parts[0];
    // angular momentum of discs that stick about their centre of mass, over m₁; spins of both discs
    // about their own
    let inertia = [radii[0].powi(2), radii[1].powi(2) / mass_ratio].map(|of| of * discs.inertia);
    let moment = parts[0] * distance * distance + inertia[0] + inertia[1];
    let momentum = parts[0] * distance * relative.dot(&t) + inertia[0] * spins[0] + inertia[1] * spins[1];
    let together = momentum / moment + ratio * closing / distance;

    let least = relative.norm_squared() * (AT_REST * AT_REST);
    // place, velocity, and what turns
    let piece = |[disc, side]: [usize; 2], p: DualVector, v: DualVector, round: [Dual; 5]| {
        let slowing = slowing + own[own::SLOWING + 2 * disc + side];
        let rate = slowing * (v.dot(&v) + least).sqrt().recip() + drag;
        let [arm, direction, turning, spin, turned] = round;
        let start = if side == 0 { f64::NEG_INFINITY } else { 0.0 };
        Piece::new(start, &[p.x, p.y, v.x, v.y, rate, arm, direction, turning, spin, turned])
    };
    let zero = constant(0.0);
    let (mut velocities, mut all_spins) = (before.map(|v| [v; 2]), spins.map(|spin| [spin; 2]));
    let pieces = [0, 1].map(|disc| {
        let early = piece([disc, 0], centres[disc], before[disc], [zero, zero, zero, spins[disc], zero]);
        let (after, spin) = (&mut velocities[disc][1], &mut all_spins[disc][1]);
        let sign = [-1.0, 1.0][disc];
        if is_stuck {
            let arm = parts[disc] * distance * sign;
            let drift = mean(before) + gained;
            (*after, *spin) = (drift + t * (arm * together), together);
            let round = [arm, own[own::DIRECTION], together, together, zero];
            return [early, piece([disc, 1], mean(centres), drift, round)];
        }
        let change = normal * parts[disc] * sign;
        let across = t * (ratio * change);
        *after += n * change + across + gained;
        let own_ratio = ratio + own[own::SPIN_RATIO + disc];
        *spin -= parts[disc] * normal * own_ratio / (radii[disc] * discs.inertia);
        // what friction changes, it has changed for a while
        let lead = own[own::LEAD];
        let round = [zero, zero, zero, *spin, (*spin - spins[disc]) * lead];
        [early, piece([disc, 1], centres[disc] + across * lead, *after, round)]
    });
    Some(Motion { pieces, own, distance, radii, velocities, spins: all_spins })
}
