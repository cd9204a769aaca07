//! The paths of two discs before and after their impact, with all derivatives (physics of discs
//! that slide on a table without rolling).
//!
//! The line of centres n points from the first disc to the second, t = z × n, g = v₂ − v₁; the
//! closing speed is k = −g·n and the slip s = g·t − R₁ω₁ − R₂ω₂:
//!
//! ```text
//! e_i = e − e₁k + d_e            J_t/J_n = law(k, s; μ, κ, e_i) + d_J
//! Δg = (1 + e_i) k (n + (J_t/J_n) t)             J_n = (1 + e_i) k, per reduced mass
//! Δω_i = −(J_t/J_n + d_S,i) (J_n/m_i)/(ν R_i)    momentum gained: d_P J_n
//! p(τ) = c + v (τ − ½ (a/|v| + γ) τ²)            until the disc stops
//! ```
//!
//! Friction may act a little earlier than the normal force: that of soft rims ends before it does.
//! The law is that of two equal bodies ([`Model`]); it does not depend on how masses or radii
//! differ. Discs that stick together move on as one rigid body about their centre of mass.

use nalgebra::{SVector, Vector2};
use num_dual::{Derivative, DualNum, DualSVec64};

use super::own::{self, CORE};
use crate::physics::Number;
use crate::physics::ball::{Ball, BallState, Vec3};
use crate::physics::collision::{Coefficients, Fidelity, Input, Model};
use crate::physics::disc::Discs;
use crate::physics::friction_law::Law;
use crate::problem::film::dual::{constant, gradient};
use crate::problem::frames;
use crate::problem::unknowns::{Id, Own, Shared};

/// Shared unknowns that move the discs.
pub(super) const MOVING: [Id; 10] = [
    Id::Mu,
    Id::E,
    Id::FallB,
    Id::FallC,
    Id::Kappa,
    Id::ESlope,
    Id::MassRatio,
    Id::Slowing,
    Id::Drag,
    Id::ContactDistance,
];

/// Number of inputs of a shot's motion, its own unknowns first.
pub(super) const INPUTS: usize = CORE + MOVING.len();

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
pub(super) struct Paths {
    pub(crate) pieces: [[Piece; 2]; 2],
    pub(crate) time: Dual,
    pub(crate) direction: Dual,
    pub(crate) distance: Dual,
    pub(crate) radii: [Dual; 2],
    pub(crate) velocities: [[DualVector; 2]; 2],
    pub(crate) spins: [[Dual; 2]; 2],
}

/// Returns J_t/J_n on the second of two discs in contact, by closing speed, slip and e, and by μ,
/// b, c and κ; `None` if they do not approach.
pub(super) fn friction(contact: &[Dual; 3], of_law: &[Dual; 4], inertia: f64) -> Option<Dual> {
    let ([closing, slip, e], [mu, b, c, kappa]) = (contact.map(|dual| dual.re), of_law.map(|dual| dual.re));
    // two equal discs of radius 1, the second at rest, and a spin of the first that gives the slip
    let mut model = Model::new(Fidelity::Full, Ball { radius: 1.0, mass: 1.0, inertia });
    if kappa > 0.0 {
        model = model.giving_way(kappa);
    }
    if b != 0.0 {
        model.law = Law::Exponential { b, c };
    }
    let before = BallState { velocity: Vec3::new(closing, 0.0, 0.0), spin: Vec3::new(0.0, 0.0, -slip) };
    let coefficients = Coefficients { mu, mu_s: 0.0, e: e.clamp(0.0, 1.0) };
    let (outcome, jacobian) = model.collide_with_jacobian(&before, &coefficients).ok()?;
    let after = outcome.object.velocity;
    let ratio = after.y / after.x;
    let ([closing, slip, e], [mu, b, c, kappa]) = (*contact, *of_law);
    let inputs = [
        (Input::VelocityX, closing),
        (Input::SpinZ, -slip),
        (Input::E, e),
        (Input::Mu, mu),
        (Input::B, b),
        (Input::C, c),
        (Input::Kappa, kappa),
    ];
    let mut by = SVector::zeros();
    for (input, dual) in inputs {
        let column = jacobian.column(input as usize);
        by += gradient(&dual) * ((column[7] - ratio * column[6]) / after.x);
    }
    Some(Dual::new(ratio, Derivative::some(by)))
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

/// Follows both discs through the impact, if they stick together as one body; the rotations that
/// are not seen stay. `None` if they do not approach.
pub(super) fn follow(
    (is_stuck, turns): (bool, [bool; 2]),
    values: &Own,
    shared: &Shared,
    discs: &Discs,
) -> Option<Paths> {
    let own = |i: usize| constant::<INPUTS>(values[i]).derivative(i);
    let all = |id: Id| {
        let place = MOVING.iter().position(|moving| *moving == id);
        place.map_or(constant(shared[id]), |i| constant(shared[id]).derivative(CORE + i))
    };
    let pair = |i: usize| DualVector::new(own(i), own(i + 1));
    let (sin, cos) = own(own::DIRECTION).sin_cos();
    let (n, t) = (DualVector::new(cos, sin), DualVector::new(-sin, cos));
    let distance = all(Id::ContactDistance) + own(own::DISTANCE);
    let radii = discs.radii.map_or([distance * 0.5; 2], |radii| radii.map(constant));
    let centres = [pair(own::X), pair(own::X) + n * distance];
    let before = [pair(own::VELOCITY), pair(own::VELOCITY + 2)];
    let spins = [own(own::SPIN), own(own::SPIN + 1)];

    let relative = before[1] - before[0];
    let (closing, across) = (-relative.dot(&n), relative.dot(&t));
    if !(closing.re > 0.0) {
        return None;
    }
    // J_n/m₁ = f₁ J_n, J_n/m₂ = f₂ J_n per reduced mass
    let mass_ratio = all(Id::MassRatio);
    let parts = [(mass_ratio + 1.0).recip(), mass_ratio / (mass_ratio + 1.0)];
    let restitution = all(Id::E) - all(Id::ESlope) * closing + own(own::RESTITUTION);
    let normal = (restitution + 1.0) * closing;
    let gained = (n * own(own::MOMENTUM) + t * own(own::MOMENTUM + 1)) * (normal * parts[0] * parts[1]);
    let least = relative.norm_squared() * (AT_REST * AT_REST);
    // place, velocity, and what turns
    let piece = |[disc, side]: [usize; 2], p: DualVector, v: DualVector, turns: [Dual; 5]| {
        let slowing = all(Id::Slowing) + own(own::SLOWING + 2 * disc + side);
        let rate = slowing * (v.dot(&v) + least).sqrt().recip() + all(Id::Drag);
        let [arm, direction, turning, spin, turned] = turns;
        let start = if side == 0 { f64::NEG_INFINITY } else { 0.0 };
        Piece::new(start, &[p.x, p.y, v.x, v.y, rate, arm, direction, turning, spin, turned])
    };
    let zero = constant(0.0);
    let ratio = if is_stuck {
        zero
    } else {
        let contact = [closing, slip(&across, &radii, &spins), restitution];
        let of_law = [Id::Mu, Id::FallB, Id::FallC, Id::Kappa].map(all);
        friction(&contact, &of_law, discs.inertia)? + own(own::RATIO)
    };
    let mut of_discs = Vec::with_capacity(2);
    let (mut after, mut spins_after) = (before, spins);
    for disc in 0..2 {
        let early = piece([disc, 0], centres[disc], before[disc], [zero, zero, zero, spins[disc], zero]);
        let late = if is_stuck {
            // angular momentum about the centre of mass, over m₁; spins of both discs about their
            // own
            let inertia = [radii[0].powi(2), radii[1].powi(2) / mass_ratio].map(|of| of * discs.inertia);
            let moment = parts[0] * distance * distance + inertia[0] + inertia[1];
            let momentum = parts[0] * distance * across + inertia[0] * spins[0] + inertia[1] * spins[1];
            let turning = momentum / moment + own(own::RATIO) * closing / distance;
            let mean = |of: [DualVector; 2]| of[0] * parts[1] + of[1] * parts[0];
            let (centre, drift) = (mean(centres), mean(before) + gained);
            let arm = [-parts[0], parts[1]][disc] * distance;
            (after[disc], spins_after[disc]) = (drift + t * (arm * turning), turning);
            piece([disc, 1], centre, drift, [arm, own(own::DIRECTION), turning, turning, zero])
        } else {
            let change = normal * parts[disc] * if disc == 0 { -1.0 } else { 1.0 };
            let across = t * (ratio * change);
            after[disc] += n * change + across + gained;
            if turns[disc] {
                let of_disc = ratio + own(own::SPIN_RATIO + disc);
                spins_after[disc] -= parts[disc] * normal * of_disc / (radii[disc] * discs.inertia);
            }
            // what friction changes, it has changed for a while
            let lead = own(own::LEAD);
            let turned = (spins_after[disc] - spins[disc]) * lead;
            let turning = [zero, zero, zero, spins_after[disc], turned];
            piece([disc, 1], centres[disc] + across * lead, after[disc], turning)
        };
        of_discs.push([early, late]);
    }
    Some(Paths {
        pieces: of_discs.try_into().ok()?,
        time: own(own::TIME),
        direction: own(own::DIRECTION),
        distance,
        radii,
        velocities: [0, 1].map(|disc| [before[disc], after[disc]]),
        spins: [0, 1].map(|disc| [spins[disc], spins_after[disc]]),
    })
}

/// Returns the slip of the second disc's contact point against the first's.
pub(super) fn slip(across: &Dual, radii: &[Dual; 2], spins: &[Dual; 2]) -> Dual {
    *across - radii[0] * spins[0] - radii[1] * spins[1]
}
