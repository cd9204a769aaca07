//! The effects of an impact, each with its switch, and how large each is on one shot: the choice of
//! `auto` is the cheapest fidelity whose missing effects stay together within a tolerance.
//!
//! Sizes are bounds, to leading order, on the change of velocities by an effect, as a fraction of
//! the cue ball's speed U. An impulse of friction counts 1/ν times, for the spin.

use super::impact::{Impact, Values};
use super::{Coefficients, Fidelity, Input, Model, NotACollision};
use crate::physics::ball::BallState;
use crate::physics::cloth_motion::GRAVITY;

/// The table of effects: switch, name, the reason for its size and that for a size of 0.
macro_rules! effects {
    ($($(#[doc = $doc:literal])+ $switch:ident = $name:literal | $there:literal | $not:literal,)+) => {
        /// Effects of an impact, each on or off.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[allow(clippy::struct_excessive_bools)] // any combination of the effects can be asked for
        pub struct Effects {
            $($(#[doc = $doc])+ pub $switch: bool,)+
        }

        impl Effects {
            /// Two rigid balls that exchange their velocities along the line of centres.
            pub const NONE: Self = Self { $($switch: false),+ };

            /// All effects.
            pub const ALL: Self = Self { $($switch: true),+ };

            /// The names of the effects, as on the command line and in fit.json.
            pub const NAMES: [&'static str; 10] = [$($name),+];

            /// The reasons for the size of each effect, and for a size of 0.
            const REASONS: [[&'static str; 2]; 10] = [$([$there, $not]),+];

            /// Returns each effect's name and whether it is on, in the order of [`Effects::NAMES`].
            pub fn list(&self) -> [(&'static str, bool); 10] {
                [$(($name, self.$switch)),+]
            }

            /// Returns the switch of a name of [`Effects::NAMES`].
            pub fn switch(&mut self, name: &str) -> Option<&mut bool> {
                match name {
                    $($name => Some(&mut self.$switch),)+
                    _ => None,
                }
            }

            /// Returns the effects that are on in both.
            #[must_use]
            pub fn and(self, other: Self) -> Self {
                Self { $($switch: self.$switch && other.$switch),+ }
            }
        }
    };
}

effects! {
    /// The balls lose energy in the impact: e < 1.
    inelasticity = "inelasticity" | "the balls lose (1 − e)k/2" | "e = 1",
    /// Friction between the balls.
    friction = "friction" | "the balls slip on each other" | "the balls do not slip on each other",
    /// Friction between the balls ends when their slip has stopped: the contact sticks.
    stick = "stick" | "friction may end the slip" | "the slip outlasts the impact",
    /// The friction between the balls turns with the slip during the impact.
    turning = "turning" | "the slip turns during the impact" | "slip and friction keep their direction",
    /// Friction of the cloth on a ball that is pressed down: on the object ball, with topspin.
    cloth = "cloth" | "topspin presses the object ball into the cloth" | "no topspin on a cloth with friction",
    /// The cloth's friction follows the object ball's slip on it, and is not just along −x.
    cloth_turning = "cloth-turning" | "the object ball slips aside as well" | "the object ball slips straight on",
    /// Friction of the cloth on the cue ball, with draw.
    cloth_on_cue = "cloth-on-cue" | "draw presses the cue ball into the cloth" | "no draw",
    /// Gravity during the contact, with the balls' weight on the cloth.
    gravity = "gravity" | "the balls' weight acts for the contact's duration" | "no weight",
    /// Friction between the balls that depends on the slip follows it during the impact.
    falling_friction =
        "falling-friction" | "friction changes as the slip decreases" | "friction does not depend on the slip",
    /// The contact is compliant along the surface and springs back, by [`Model::kappa`].
    compliance =
        "compliance" | "the contact springs back along the surface" |
        "the contact slides in one direction throughout",
}

/// The default tolerance of [`choose`], below what the best footage resolves.
pub const NEGLIGIBLE_CHANGE: f64 = 1e-3;

/// Factor by which the cloth's friction counts, as it also moves the contact between the balls.
const FEEDBACK: f64 = 1.5;

/// An effect on a shot.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "fit", derive(serde::Serialize, schemars::JsonSchema))]
pub struct Estimate {
    /// Its name.
    pub name: &'static str,
    /// Change of velocities if it is left out, as a fraction of the cue ball's speed U.
    pub size: f64,
    /// Whether it was computed.
    pub on: bool,
    /// The reason for its size, in words.
    pub why: &'static str,
}

/// The cheapest way to compute a shot to a tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The model with the cheapest fidelity that suffices, and with the effects that are needed.
    pub model: Model,
    /// The size of each effect, in the order of [`Effects::NAMES`].
    pub estimates: [Estimate; 10],
    /// The sum of the sizes of the effects that are left out.
    pub left_out: f64,
}

/// Chooses the cheapest fidelity and the effects for one shot; `tolerance` as a fraction of U.
///
/// # Errors
/// Input that describes no collision.
pub fn choose(
    model: &Model,
    cue: &BallState,
    coefficients: &Coefficients,
    tolerance: f64,
) -> Result<Choice, NotACollision> {
    let sizes = sizes(model, cue, coefficients)?;
    let missing = |fidelity: Fidelity| -> f64 {
        let on = fidelity.effects().list();
        sizes.iter().zip(on).filter(|(_, (_, on))| !on).map(|(size, _)| size).sum()
    };
    let within = |fidelity: &Fidelity| missing(*fidelity) <= tolerance;
    let fidelity = Fidelity::ALL.into_iter().find(within).unwrap_or(Fidelity::Contact);
    let mut effects = fidelity.effects();
    effects.compliance &= model.kappa > 0.0;
    let estimates = std::array::from_fn(|i| {
        let (name, mut on) = effects.list()[i];
        // an effect of size 0 is switched off; under gravity all depend on each other
        on &= sizes[i] > 0.0 || fidelity == Fidelity::Contact;
        if let Some(switch) = effects.switch(name) {
            *switch = on;
        }
        Estimate { name, size: sizes[i], on, why: Effects::REASONS[i][usize::from(sizes[i] == 0.0)] }
    });
    let model = Model { fidelity, effects, ..*model }.with_some_compliance();
    Ok(Choice { model, estimates, left_out: missing(fidelity) })
}

/// Returns the size of each effect as a fraction of U, in the order of [`Effects::NAMES`].
fn sizes(model: &Model, cue: &BallState, coefficients: &Coefficients) -> Result<[f64; 10], NotACollision> {
    // with all effects, and validated as a collision without integration
    let model = Model { effects: Effects::ALL, fidelity: Fidelity::Full, ..*model };
    let values = Values::new(&model, cue, coefficients);
    model.validate(cue, coefficients, &values)?;
    let Impact { k, slip: [v_y, v_z], lever: [lever_y, lever_z], n, m_s, .. } = Impact::new(&values, &model);
    let (e, kappa) = (values[Input::E], model.kappa);
    let mu = coefficients.mu + model.law.numbers()[0].max(0.0);
    let per_nu = 1.0 / model.ball.inertia;
    let slip = v_y.hypot(v_z);
    let slips = slip > 0.0 && mu > 0.0;
    let (cos, sin) = if slip > 0.0 { (v_y.abs() / slip, v_z.abs() / slip) } else { (0.0, 0.0) };
    // the normal impulse, and the largest impulses of friction, at most what stops the slip: |v_y|
    // decreases faster than |v_z|, so that cos θ only decreases, but sin θ may grow
    let q = (1.0 + e) * k / n * (1.0 + mu * m_s);
    let (stops_y, stops_z) = (v_y.abs() / lever_y, v_z.abs() / lever_z);
    let (j_y, j_z) = ((mu * q * cos).min(stops_y), (mu * q).min(stops_z));
    // the least slip at the end, and the largest sin θ cos θ on the way towards z
    let left = (slip - lever_y * mu * q).max(0.0);
    let mixed = if cos > sin && sin > 0.0 { 0.5 } else { sin * cos };
    let only = |present: bool, size: f64| if present { size } else { 0.0 };

    // friction's impulse beyond what stops the slip, if it can stop a component
    let stick = (mu * q * cos - stops_y).hypot(mu * q * sin - stops_z);
    // Δθ ≤ 2μ(β_y − β_z)q mixed/left
    let turned = mu * (lever_y - lever_z) * q * mixed / left;
    let turned = only(mixed > 0.0, turned.min(cos.atan2(sin)));
    let cloth = FEEDBACK * m_s * j_z * per_nu;
    // Δt = T k^(−1/5) (1 + e)/2: restitution takes e times as long as compression
    let duration = model.contact_time * k.powf(-0.2) * 0.5 * (1.0 + e);
    let held = FEEDBACK * model.mu_k.max(coefficients.mu_s) * per_nu;
    let change = (model.law.mu(coefficients.mu, left) - model.law.mu(coefficients.mu, slip)).abs();
    // 2J, or if the slip lasts μq Δθ, Δθ ≤ ⅚κμ²(β_y − β_z) mixed (k/left)²
    let compliance = if left > 0.0 && slip > mu * kappa * k {
        let lag = 5.0 / 12.0 * kappa * mu * mu * (lever_y - lever_z) * mixed * (k / left).powi(2);
        mu * q * lag.min(1.0)
    } else {
        stops_y.hypot(stops_z).min(2.0 * mu * q)
    };
    let sizes = [
        0.5 * (1.0 - e) * k * (per_nu * mu).max(1.0),
        only(slips, j_y.hypot(j_z) * per_nu),
        only(slips && stops_y.max(stops_z) <= mu * q, stick * per_nu),
        only(slips, mu * q * turned * per_nu + mu * q * mu * m_s * (per_nu + m_s)),
        cloth,
        cloth * (mu * cos).min(1.0),
        only(v_z < 0.0, FEEDBACK * model.mu_k * j_z * per_nu),
        GRAVITY * duration * held.max(1.0),
        only(slips, change * q * per_nu),
        only(slips && kappa > 0.0, compliance * per_nu),
    ];
    // impulses are per unit of the object ball's mass; the lighter ball changes its velocity more
    let speed = cue.velocity.norm() / (n - 1.0).max(1.0);
    Ok(sizes.map(|size| size / speed))
}
