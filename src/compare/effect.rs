//! A difference of a parameter in words that a player understands: what one usual shot does otherwise.

use super::{Comparison, Quantity};
use crate::measurement::parameter::Parameter;
use crate::physics::ball::{Ball, BallState};
use crate::physics::cloth_motion::GRAVITY;
use crate::physics::collision::{Coefficients, Fidelity, Model, Outcome};
use crate::physics::contact_frame::cue_velocity;

/// Of the shots that are compared: a firm shot, m/s.
const SPEED: f64 = 2.0;

/// Half-ball hit, degrees.
const HALF_BALL_DEG: f64 = 30.0;

/// Puts a difference into words: the `second` value against the `first`, all else as in `at`. `None` where no
/// such shot can be computed.
#[must_use]
pub fn effect(
    quantity: Quantity,
    ball: Ball,
    at: &Coefficients,
    first: f64,
    second: f64,
    name: &str,
) -> Option<String> {
    let model = Model::new(Fidelity::Full, ball);
    let shot = |value: f64, cut_deg: f64, rolls: bool| -> Option<Outcome> {
        let mut at = *at;
        match quantity {
            Quantity::Parameter(Parameter::Mu) => at.mu = value,
            Quantity::Parameter(Parameter::MuS) => at.mu_s = value,
            Quantity::Parameter(Parameter::E) => at.e = value,
            Quantity::Sliding | Quantity::Parameter(_) => {}
        }
        let velocity = cue_velocity(SPEED, f64::to_radians(cut_deg));
        let cue =
            if rolls { BallState::natural_roll(velocity, ball.radius) } else { BallState::stun(velocity) };
        model.collide(&cue, &at).ok()
    };
    let more = |difference: f64, more: &'static str, less: &'static str| {
        if difference > 0.0 { more } else { less }
    };
    Some(match quantity {
        Quantity::Parameter(Parameter::Mu) => {
            let throw = |value| {
                let object = shot(value, HALF_BALL_DEG, false)?.object.velocity;
                Some(object.y.atan2(object.x))
            };
            let d = throw(second)? - throw(first)?;
            format!(
                "with {name} the object ball is thrown {:.2}° {} on a half-ball stun shot at 2 m/s: {:.0} mm per metre",
                d.abs().to_degrees(),
                more(d, "more", "less"),
                1e3 * d.abs().tan()
            )
        }
        Quantity::Parameter(Parameter::MuS) => {
            let (a, b) = (shot(first, 0.0, true)?, shot(second, 0.0, true)?);
            let (cue, object) =
                (b.cue.velocity.x - a.cue.velocity.x, b.object.velocity.x - a.object.velocity.x);
            format!(
                "with {name}, on a full natural-roll hit at 2 m/s, the object ball leaves {:.1} mm/s {} and the cue ball \
                 {:.1} mm/s {}",
                1e3 * object.abs(),
                more(object, "faster", "slower"),
                1e3 * cue.abs(),
                more(cue, "faster", "slower")
            )
        }
        Quantity::Parameter(Parameter::E) => {
            let (a, b) = (shot(first, 0.0, false)?, shot(second, 0.0, false)?);
            let d = b.cue.velocity.x - a.cue.velocity.x;
            format!(
                "with {name} the cue ball keeps {:.1} mm/s {} on a full stun hit at 2 m/s, and the object ball leaves as much {}",
                1e3 * d.abs(),
                more(d, "more", "less"),
                more(d, "slower", "faster")
            )
        }
        Quantity::Sliding => {
            // a ball that starts without spin slides 12 v²/(49 μ_k g) until it rolls
            let way = |mu_k: f64| 12.0 * SPEED * SPEED / (49.0 * mu_k * GRAVITY);
            let d = way(second) - way(first);
            format!(
                "with {name} a ball shot without spin at 2 m/s slides {:.0} mm {} before it rolls ({:.2} m)",
                1e3 * d.abs(),
                more(d, "further", "less far"),
                way(second)
            )
        }
        // no quantity of a comparison
        Quantity::Parameter(_) => return None,
    })
}

/// Words for every pair.
pub(super) fn describe(comparison: &mut Comparison, ball: Ball) {
    let typical = |parameter: Parameter| {
        let own = comparison.quantities.iter().find(|q| q.quantity == Quantity::Parameter(parameter));
        let known: Vec<f64> =
            own.map_or(Vec::new(), |q| q.estimates.iter().map(|value| value.value).collect());
        let count = known.len().max(1) as f64;
        if known.is_empty() { parameter.default_setting().initial } else { known.iter().sum::<f64>() / count }
    };
    let [mu, mu_s, e] = Parameter::COEFFICIENTS.map(typical);
    let at = Coefficients { mu, mu_s, e };
    let labels = comparison.labels.clone();
    for compared in &mut comparison.quantities {
        let value =
            |label: usize| compared.estimates.iter().find(|v| v.label == Some(label)).map(|v| v.value);
        let words: Vec<Option<String>> = compared
            .differences
            .iter()
            .map(|d| {
                let name = labels.get(d.second)?;
                effect(compared.quantity, ball, &at, value(d.first)?, value(d.second)?, name)
            })
            .collect();
        for (difference, words) in compared.differences.iter_mut().zip(words) {
            difference.words = words;
        }
    }
}
