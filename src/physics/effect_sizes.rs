//! Which effects a collision calls for: the size of each from the dimensionless numbers of the shot, and
//! the cheapest fidelity whose missing effects stay together within a tolerance.
//!
//! Sizes are bounds, to leading order, on what an effect changes, in parts of the cue ball's speed U.
//! With q = (1 + e)k/2 for the normal impulse, J_y and J_z for the most that friction can give along y
//! and z (μq cos θ₀ and μq, but no more than stops the slip, |v_y0|/2β_y and |v_z0|/2β_z):
//!
//! | effect | changes velocities by | there is one |
//! | --- | --- | --- |
//! | inelasticity | (1 − e)k/2 | always |
//! | friction | √(J_y² + J_z²) | where the balls slip |
//! | stick | what friction would give beyond that | if friction can stop a component of the slip |
//! | turning | μq·Δθ, Δθ ≤ 2μ(β_y − β_z)q·sin θ cos θ/(v_∥0 − 2β_yμq) | if spin and slip are not aligned |
//! | cloth | μ_s J_z | with topspin |
//! | cloth-turning | μ_s J_z · μ cos θ₀ | with topspin, cut or side spin |
//! | cloth-on-cue | μ_k J_z | with draw |
//! | gravity | gΔt, horizontally max(μ_k, μ_s) of it | always |
//! | falling-friction | q times the change of μ | where friction falls with the slip |
//! | compliance | what stops the slip, once more, where friction may stop it | if κ > 0 and v_∥0 ≤ max(μκk, 2β_yμq) |
//! | | else μq·Δθ, Δθ ≤ ⅚κμ²(β_y − β_z) sin θ cos θ (k/v_∥)² by which friction lags behind the slip | if spin and slip are not aligned |
//!
//! A friction impulse J changes a spin times R by J/ν: where spins count too, it counts 1/ν times.
//!
//! And for the motion of both balls on the cloth in the time T after the impact ([`motion`]), s the slip on the
//! cloth, t = 2V_z/(g(1 − e_t)) all flights together:
//!
//! | effect | changes velocities by at most | there is one |
//! | --- | --- | --- |
//! | flight | μ_k g min(t, T) and no more than sliding does | if a ball leaves the cloth |
//! | sliding | what stops the slip, sν/(1 + ν), or μ_k(gT + (1 + e_t)V_z) | if a ball slips on the cloth |
//! | rolling | μ_r g T | if a ball moves |
//!
//! What is off there is no stretch of the path ([`super::cloth_motion::Path`]), and nothing of it is computed.

use super::ball::BallState;
use super::cloth_motion::{Cloth, GRAVITY};
pub use super::collision::Effects;
use super::collision::{Coefficients, Fidelity, Model, NotACollision, Outcome};
use super::contact_frame::{cloth_slip, slip};

/// The default tolerance: what the effects left out may add up to, as a fraction of the speed of the cue ball U. It is below
/// what the best footage resolves.
pub const TOLERANCE: f64 = 1e-3;

/// The cloth's friction on a ball also moves the contact between the balls, by half as much again.
const FEEDBACK: f64 = 1.5;

/// Which components of the outcome must stay within the tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Compared {
    /// All components of velocities, and of spins times R.
    Everything,
    /// Horizontal velocities.
    Velocities,
}

/// The size of one effect on one shot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The name of the effect, one of [`Effects::NAMES`] or, of the motion on the cloth, one that [`motion`] gives.
    pub name: &'static str,
    /// How much the effect changes velocities at most, as a fraction of the speed of the cue ball U.
    pub size: f64,
    /// Whether the effect is larger than the tolerance and so is simulated.
    pub on: bool,
    /// The reason in words.
    pub why: &'static str,
}

/// The cheapest way to compute a shot to a tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The cheapest fidelity that contains the effects that are needed.
    pub fidelity: Fidelity,
    /// The effects that are needed.
    pub effects: Effects,
    /// The size of each effect, in the order of [`Effects::NAMES`].
    pub estimates: [Estimate; 10],
    /// The sum of the sizes of the effects that are left out, as a fraction of the speed of the cue ball U.
    pub left_out: f64,
}

impl Choice {
    /// `model` with the fidelity and the effects that were chosen.
    #[must_use]
    pub fn model(&self, model: &Model) -> Model {
        Model { fidelity: self.fidelity, effects: self.effects, ..*model }.with_some_compliance()
    }
}

/// The cheapest fidelity that can simulate all the given effects.
#[must_use]
pub fn cheapest(effects: Effects) -> Fidelity {
    let contains = |fidelity: &Fidelity| effects.and(fidelity.effects()) == effects;
    Fidelity::ALL.into_iter().find(contains).unwrap_or(Fidelity::Contact)
}

/// Chooses for one shot; `tolerance` in parts of U.
///
/// # Errors
/// What is no collision.
pub fn choose(
    model: &Model,
    cue: &BallState,
    coefficients: &Coefficients,
    tolerance: f64,
    compared: Compared,
) -> Result<Choice, NotACollision> {
    // everything else is refused here as it is in a collision
    Model { fidelity: Fidelity::Inelastic, ..*model }.collide(cue, coefficients)?;
    let sizes = Shot::new(model, cue, coefficients).sizes(compared);
    let missing = |fidelity: Fidelity| -> f64 {
        let on = fidelity.effects().list();
        sizes.iter().zip(on).filter(|(_, (_, on))| !on).map(|((size, _), _)| size).sum()
    };
    let within = |fidelity: &Fidelity| missing(*fidelity) <= tolerance;
    let fidelity = Fidelity::ALL.into_iter().find(within).unwrap_or(Fidelity::Contact);
    let mut effects = fidelity.effects();
    if fidelity != Fidelity::Contact {
        // what is not there needs no switch; under gravity everything hangs together
        for ((size, _), name) in sizes.iter().zip(Effects::NAMES) {
            if let Some(on) = effects.switch(name) {
                *on &= *size > 0.0;
            }
        }
    }
    effects.compliance &= model.kappa > 0.0;
    let on = effects.list();
    let estimates = std::array::from_fn(|i| {
        let (size, why) = sizes[i];
        Estimate { name: on[i].0, size, on: on[i].1, why }
    });
    Ok(Choice { fidelity, effects, estimates, left_out: missing(fidelity) })
}

/// How long footage follows the balls after an impact, seconds.
pub const FOLLOWED: f64 = 0.1;

/// What the motion of both balls calls for in the first `seconds` after an impact, with velocities to
/// `tolerance` in parts of the cue ball's speed before it: flight, sliding, rolling.
#[must_use]
pub fn motion(
    model: &Model,
    cue: &BallState,
    outcome: &Outcome,
    cloth: &Cloth<f64>,
    seconds: f64,
    tolerance: f64,
) -> [Estimate; 3] {
    let nu = model.ball.inertia;
    let [mut flight, mut sliding, mut rolling] = [0.0_f64; 3];
    for ball in [outcome.cue, outcome.object] {
        let up = ball.velocity.z;
        // sν/(1 + ν) stops the slip
        let stops = cloth_slip(&ball, model.ball.radius).xy().norm() * nu / (1.0 + nu);
        // the landings of all bounces: μ_k(1 + e_t)(V_z + e_t V_z + …)
        let landings = (1.0 + cloth.bounce) * up / (1.0 - cloth.bounce).max(f64::EPSILON);
        let slides = stops.min(cloth.sliding * (GRAVITY * seconds + landings));
        // 2V_z/g in the air, and e_t of the time before at each bounce
        let air = 2.0 * up / (GRAVITY * (1.0 - cloth.bounce).max(f64::EPSILON));
        flight = flight.max((cloth.sliding * GRAVITY * air.min(seconds)).min(slides));
        sliding = sliding.max(slides);
        let speed = ball.velocity.xy().norm();
        rolling = rolling.max((cloth.rolling * GRAVITY * seconds).min(speed));
    }
    let whys = [
        (
            "flight",
            flight,
            "a ball leaves the cloth, and is not braked meanwhile",
            "no ball leaves the cloth",
        ),
        ("sliding", sliding, "a ball slips on the cloth before it rolls", "both balls roll at once"),
        ("rolling", rolling, "the cloth brakes balls that roll", "no rolling resistance"),
    ];
    whys.map(|(name, size, there, not)| {
        let size = size / cue.velocity.norm();
        Estimate { name, size, on: size > tolerance, why: if size > 0.0 { there } else { not } }
    })
}

/// The numbers that sizes are made of, m/s.
struct Shot<'a> {
    model: &'a Model,
    coefficients: &'a Coefficients,
    speed: f64,
    k: f64,
    v_y: f64,
    v_z: f64,
    /// The largest on the way.
    mu: f64,
    beta_y: f64,
    beta_z: f64,
    /// At most.
    q: f64,
    j_y: f64,
    j_z: f64,
}

impl<'a> Shot<'a> {
    fn new(model: &'a Model, cue: &BallState, coefficients: &'a Coefficients) -> Self {
        let (v, nu) = (slip(cue, &BallState::default(), model.ball.radius), model.ball.inertia);
        let (k, v_y, v_z) = (-v.x, v.y, v.z);
        let mu = model.law.friction(coefficients.mu).largest();
        let m_s = if v_z > 0.0 { coefficients.mu_s } else { 0.0 };
        let per_r = 1.0 / model.mass_ratio();
        let nu_c = nu;
        let nu = model.object_ball().inertia;
        let rising = if v_z > 0.0 { [per_r, 0.0] } else { [0.0, 1.0] };
        let beta_y = 0.5 * ((1.0 + 1.0 / nu_c) * per_r + 1.0 + 1.0 / nu);
        let beta_z = 0.5 * (rising[0] + rising[1] + per_r / nu_c + (1.0 - m_s) / nu);
        let q = (1.0 + coefficients.e) * k / (1.0 + per_r) * (1.0 + mu * m_s);
        let slip = v_y.hypot(v_z);
        // v_y falls faster than v_z, so that |cos θ| only falls, but |sin θ| may grow
        let cos = if slip > 0.0 { v_y.abs() / slip } else { 0.0 };
        let j_y = (mu * q * cos).min(v_y.abs() / (2.0 * beta_y));
        let j_z = (mu * q).min(v_z.abs() / (2.0 * beta_z));
        // impulses are per unit of the object ball's mass; the lighter ball changes its velocity more
        let speed = cue.velocity.norm() / per_r.max(1.0);
        Self { model, coefficients, speed, k, v_y, v_z, mu, beta_y, beta_z, q, j_y, j_z }
    }

    /// Size and reason of each effect, in the order of [`Effects::NAMES`].
    fn sizes(&self, compared: Compared) -> [(f64, &'static str); 10] {
        let &Self { model, coefficients, k, v_y, v_z, mu, q, j_y, j_z, .. } = self;
        let all = compared == Compared::Everything;
        let lever = if all { 1.0 / model.ball.inertia } else { 1.0 };
        let slip = v_y.hypot(v_z);
        let (cos, sin) = if slip > 0.0 { (v_y.abs() / slip, v_z.abs() / slip) } else { (0.0, 0.0) };
        let slips = slip > 0.0 && mu > 0.0;
        let part = |size: f64| size / self.speed;
        let or = |size: f64, there: &'static str, not: &'static str| {
            (part(size), if size > 0.0 { there } else { not })
        };

        let inelasticity = 0.5 * (1.0 - coefficients.e) * k * (lever * mu).max(1.0);
        // vertically only where vertical velocities count
        let friction = if slips { j_y.hypot(j_z) * lever } else { 0.0 };

        // either component may be stopped only if μq exceeds what stops it
        let stopped = (v_y.abs() / (2.0 * self.beta_y)).max(v_z.abs() / (2.0 * self.beta_z));
        let stick = if slips && stopped <= mu * q {
            let over_y = mu * q * cos - v_y.abs() / (2.0 * self.beta_y);
            let over_z = mu * q * sin - v_z.abs() / (2.0 * self.beta_z);
            over_y.hypot(over_z) * lever
        } else {
            0.0
        };

        // |sin θ cos θ| at most, on the way towards z
        let mixed = if cos > sin && sin > 0.0 { 0.5 } else { sin * cos };
        let left = (slip - 2.0 * self.beta_y * mu * q).max(0.0);
        let turned = 2.0 * mu * (self.beta_y - self.beta_z) * q * mixed / left;
        let turned = if mixed > 0.0 { turned.min(cos.atan2(sin)) } else { 0.0 };
        let m_s = if v_z > 0.0 { coefficients.mu_s } else { 0.0 };
        let second_order = mu * q * mu * m_s * (lever + m_s);
        let turning = if slips { mu * q * turned * lever + second_order } else { 0.0 };

        let cloth = FEEDBACK * m_s * j_z * lever;
        let cloth_turning = cloth * (mu * cos).min(1.0);
        let draw = if v_z < 0.0 { model.mu_k } else { 0.0 };
        let cloth_on_cue = FEEDBACK * draw * j_z * lever;

        // Δt = T k^(−1/5) (1 + e)/2: restitution takes e times as long as compression
        let duration = model.contact_time * k.powf(-0.2) * 0.5 * (1.0 + coefficients.e);
        let held = FEEDBACK * model.mu_k.max(coefficients.mu_s) * lever;
        let gravity = GRAVITY * duration * if all { held.max(1.0) } else { held };

        let friction_law = model.law.friction(coefficients.mu);
        let falling = if slips && friction_law.falls() {
            let change = (friction_law.mu(left) - friction_law.mu(slip)).abs();
            change * q * lever
        } else {
            0.0
        };
        let stopping = (v_y.abs() / (2.0 * self.beta_y)).hypot(v_z.abs() / (2.0 * self.beta_z));
        let kappa = model.kappa;
        let compliance = if !slips || kappa == 0.0 {
            0.0
        } else if left > 0.0 && slip > mu * kappa * k {
            let behind =
                5.0 / 6.0 * kappa * mu * mu * (self.beta_y - self.beta_z) * mixed * (k / left).powi(2);
            mu * q * behind.min(1.0) * lever
        } else {
            stopping.min(2.0 * mu * q) * lever
        };
        [
            or(inelasticity, "the balls lose (1 − e)k/2", "e = 1"),
            or(friction, "the balls slip on each other", "the balls do not slip on each other"),
            or(stick, "friction may end the slip", "the slip outlasts the impact"),
            or(turning, "the slip turns during the impact", "slip and friction keep their direction"),
            or(
                cloth,
                "topspin presses the object ball into the cloth",
                "no topspin on a cloth with friction",
            ),
            or(cloth_turning, "the object ball slips aside as well", "the object ball slips straight on"),
            or(cloth_on_cue, "draw presses the cue ball into the cloth", "no draw"),
            or(gravity, "the balls' weight acts for the contact's duration", "no weight"),
            or(falling, "friction changes as the slip falls", "friction does not depend on the slip"),
            or(
                compliance,
                "the contact springs back along the surface",
                "the contact slides in one direction throughout",
            ),
        ]
    }
}
