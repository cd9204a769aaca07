//! The paths of two discs before and after their impact, with all derivatives (physics of discs that
//! slide on a table without rolling).
//!
//! With the line of centres n from the first disc to the second, t = z × n, g = v₂ − v₁, closing speed
//! k = −g·n and slip s = g·t − R₁ω₁ − R₂ω₂,
//!
//! ```text
//! e_i = e − e₁k + d_e            J_t/J_n = law(k, s; μ, κ, e_i) + d_J
//! Δg = (1 + e_i) k (n + (J_t/J_n) t)             J_n = (1 + e_i) k, per reduced mass
//! Δω_i = −(J_t/J_n + d_S,i) (J_n/m_i)/(ν R_i)    momentum gained: d_P J_n
//! p(τ) = c + v (τ − ½ (a/|v| + γ) τ²)            until the disc stops
//! ```
//!
//! Friction may act a little earlier than the normal force: that of soft rims ends before it does. The
//! law is that of two equal bodies ([`Model`]); none of it depends on how masses or radii differ.
//! Discs that stick together move on as one rigid body about their centre of mass.

use nalgebra::{SMatrix, SVector, Vector2};
use num_dual::{Derivative, DualNum, DualSVec64};

use super::own::{self, CORE};
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
pub(super) type Gradient = SVector<f64, INPUTS>;

/// Covariance of the inputs of a shot's motion.
pub(super) type InputCovariance = SMatrix<f64, INPUTS, INPUTS>;

/// A disc slower than this part of the relative speed counts as at rest: its deceleration goes to 0
/// with its speed, whose direction is noise.
const AT_REST: f64 = 0.02;

/// Coefficients of a piece of a disc's path: place and velocity at the impact; part of the velocity
/// lost in a second; length, direction at the impact, and angular velocity of the arm on which the disc
/// goes round; its own angular velocity, and the angle by which it has turned at the impact.
pub(super) const COEFFICIENTS: usize = 10;

/// A disc on one side of the impact.
pub(super) type Piece = frames::Piece<COEFFICIENTS, INPUTS>;

/// The impact of a shot.
#[derive(Clone, Debug)]
pub(super) struct Impact {
    pub time: Dual,
    pub direction: Dual,
    pub distance: Dual,
    /// Of each disc before and after, m/s in the frame of the table.
    pub velocities: [[DualVector; 2]; 2],
    /// Of each disc before and after, rad/s.
    pub spins: [[Dual; 2]; 2],
    pub radii: [Dual; 2],
}

/// The pieces of each disc before and after the impact.
pub(super) struct Paths {
    pub pieces: [[Piece; 2]; 2],
    pub impact: Impact,
}

/// Returns J_t/J_n of a contact with its derivatives; `None` if the discs do not approach.
fn impulse_ratio(
    [closing, slip, restitution]: [Dual; 3],
    shared: impl Fn(Id) -> Dual,
    inertia: f64,
) -> Option<Dual> {
    let [mu, b, c, kappa] = [Id::Mu, Id::FallB, Id::FallC, Id::Kappa].map(shared);
    let (model, before) = contact([closing.re, slip.re], [b.re, c.re, kappa.re], inertia);
    let coefficients = Coefficients { mu: mu.re, mu_s: 0.0, e: restitution.re.clamp(0.0, 1.0) };
    let (outcome, jacobian) = model.collide_with_jacobian(&before, &coefficients).ok()?;
    let after = outcome.object.velocity;
    let ratio = after.y / after.x;
    let inputs = [
        (Input::Mu, mu),
        (Input::E, restitution),
        (Input::VelocityX, closing),
        (Input::SpinZ, -slip),
        (Input::B, b),
        (Input::C, c),
        (Input::Kappa, kappa),
    ];
    let mut by = Gradient::zeros();
    for (which, input) in inputs {
        let derivative = jacobian.column(which as usize);
        by += gradient(&input) * ((derivative[7] - ratio * derivative[6]) / after.x);
    }
    Some(Dual::new(ratio, Derivative::some(by)))
}

/// Returns the contact of two equal discs of radius 1, the second at rest, and the first's state that
/// gives a closing speed and a slip.
fn contact([closing, slip]: [f64; 2], [b, c, kappa]: [f64; 3], inertia: f64) -> (Model, BallState) {
    let mut model = Model::new(Fidelity::Full, Ball { radius: 1.0, mass: 1.0, inertia });
    if kappa > 0.0 {
        model = model.giving_way(kappa);
    }
    if b != 0.0 {
        model.law = Law::Exponential { b, c };
    }
    let velocity = Vec3::new(closing, 0.0, 0.0);
    (model, BallState { velocity, spin: Vec3::new(0.0, 0.0, -slip) })
}

/// Returns J_t/J_n of a contact with constant friction μ and compliance κ.
pub(super) fn law_of([closing, slip, e]: [f64; 3], mu: f64, kappa: f64, inertia: f64) -> Option<f64> {
    let (model, before) = contact([closing, slip], [0.0, 1.0, kappa], inertia);
    let coefficients = Coefficients { mu, mu_s: 0.0, e: e.clamp(0.0, 1.0) };
    let after = model.collide(&before, &coefficients).ok()?.object.velocity;
    Some(after.y / after.x)
}

/// Follows both discs of a shot that part, or stick if `sticks`; `None` if they do not approach.
/// `turns`: whether the rotation of each disc was seen.
pub(super) fn follow_discs(
    values: &Own,
    shared: &Shared,
    discs: &Discs,
    turns: [bool; 2],
    sticks: bool,
) -> Option<Paths> {
    let own = |i: usize| constant(values[i]).derivative(i);
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
    let closing = -relative.dot(&n);
    let across = relative.dot(&t);
    if !(closing.re > 0.0) {
        return None;
    }
    // J_n/m₁ = f₁ J_n, J_n/m₂ = f₂ J_n per reduced mass
    let mass_ratio = all(Id::MassRatio);
    let parts = [(mass_ratio + 1.0).recip(), mass_ratio / (mass_ratio + 1.0)];
    let restitution = all(Id::E) - all(Id::ESlope) * closing + own(own::RESTITUTION);
    let normal = (restitution + 1.0) * closing;
    let gained = (n * own(own::MOMENTUM) + t * own(own::MOMENTUM + 1)) * (normal * parts[0] * parts[1]);
    let mut pieces = Vec::with_capacity(4);
    let slows = |disc: usize, side: usize, velocity: &DualVector| {
        let least = relative.dot(&relative) * (AT_REST * AT_REST);
        let slowing = all(Id::Slowing) + own(own::SLOWING + 2 * disc + side);
        slowing * (velocity.dot(velocity) + least).sqrt().recip() + all(Id::Drag)
    };
    let zero = constant(0.0);
    for disc in 0..2 {
        let (place, velocity) = (centres[disc], before[disc]);
        let rate = slows(disc, 0, &velocity);
        let spin = spins[disc];
        pieces.push(Piece::new(
            f64::NEG_INFINITY,
            &[place.x, place.y, velocity.x, velocity.y, rate, zero, zero, zero, spin, zero],
        ));
    }
    let mut after = before;
    let mut spins_after = spins;
    if sticks {
        // angular momentum about the centre of mass, over m₁; spins of both discs about their own
        let inertia =
            [radii[0] * radii[0] * discs.inertia, radii[1] * radii[1] * mass_ratio.recip() * discs.inertia];
        let moment = parts[0] * distance * distance + inertia[0] + inertia[1];
        let momentum = parts[0] * distance * across + inertia[0] * spins[0] + inertia[1] * spins[1];
        let turning = momentum / moment + own(own::RATIO) * closing / distance;
        let mean = |of: [DualVector; 2]| of[0] * parts[1] + of[1] * parts[0];
        let (centre, drift) = (mean(centres), mean(before) + gained);
        let arms = [-parts[0] * distance, parts[1] * distance];
        for disc in 0..2 {
            let rate = slows(disc, 1, &drift);
            let direction = own(own::DIRECTION);
            pieces.push(Piece::new(
                0.0,
                &[centre.x, centre.y, drift.x, drift.y, rate, arms[disc], direction, turning, turning, zero],
            ));
            after[disc] = drift + t * (arms[disc] * turning);
        }
        spins_after = [turning; 2];
    } else {
        let ratio = impulse_ratio([closing, slip(&across, &radii, &spins), restitution], all, discs.inertia)?
            + own(own::RATIO);
        let lead = own(own::LEAD);
        for disc in 0..2 {
            let change = normal * parts[disc] * if disc == 0 { -1.0 } else { 1.0 };
            let across = t * (ratio * change);
            after[disc] = before[disc] + n * change + across + gained;
            if turns[disc] {
                let of_disc = ratio + own(own::SPIN_RATIO + disc);
                let torque = parts[disc] * normal * of_disc / (radii[disc] * discs.inertia);
                spins_after[disc] = spins[disc] - torque;
            }
            // what friction changes, it has changed for a while
            let (place, velocity) = (centres[disc] + across * lead, after[disc]);
            let (spin, turned) = (spins_after[disc], (spins_after[disc] - spins[disc]) * lead);
            let rate = slows(disc, 1, &velocity);
            let coefficients =
                [place.x, place.y, velocity.x, velocity.y, rate, zero, zero, zero, spin, turned];
            pieces.push(Piece::new(0.0, &coefficients));
        }
    }
    let [first_before, second_before, first_after, second_after] = pieces.try_into().ok()?;
    let impact = Impact {
        time: own(own::TIME),
        direction: own(own::DIRECTION),
        distance,
        velocities: [0, 1].map(|disc| [before[disc], after[disc]]),
        spins: [0, 1].map(|disc| [spins[disc], spins_after[disc]]),
        radii,
    };
    Some(Paths { pieces: [[first_before, first_after], [second_before, second_after]], impact })
}

/// Returns the slip of the second disc's contact point against the first's.
pub(super) fn slip(across: &Dual, radii: &[Dual; 2], spins: &[Dual; 2]) -> Dual {
    *across - radii[0] * spins[0] - radii[1] * spins[1]
}
