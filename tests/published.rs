//! The paper's own numbers (Kim 2024, arXiv:2402.13258, §§ 4–5).

use crate::prelude::*;

/// The paper rounds to two digits; half a unit of the second.
const TWO_DIGITS: f64 = 0.05;

fn collide(fidelity: Fidelity, cut_deg: f64, roll: bool, mu: f64, e: f64) -> Outcome {
    let ball = Ball::POOL;
    let velocity = cue_velocity(1.0, cut_deg.to_radians());
    let cue = if roll { BallState::natural_roll(velocity, ball.radius) } else { BallState::stun(velocity) };
    Model::new(fidelity, ball).collide(&cue, &Coefficients { mu, mu_s: 0.3, e }).unwrap()
}

#[test]
fn throw_of_a_thin_stun_shot_eq_55() {
    // ψ = arctan(μ cos θ₀), cos θ₀ = 1: 1.7° at μ = 0.03 and, the paper's 4.8° corrected, 4.6° at 0.08
    for (mu, expected) in [(0.03, 1.7), (0.08, 4.6)] {
        for fidelity in [Fidelity::Linear, Fidelity::Full] {
            let v = collide(fidelity, 45.0, false, mu, 0.94).object.velocity;
            let throw = v.y.atan2(v.x).to_degrees();
            assert!((throw - expected).abs() < TWO_DIGITS, "{throw}");
            assert!((throw - mu.atan().to_degrees()).abs() < 1e-12, "{throw}");
        }
    }
}

#[test]
fn deviation_of_the_cue_ball_from_the_tangent_line_eq_56() {
    // φ, e, ψ_c with μ = 0, in degrees, and half the last digit given
    for (cut, e, expected, half_digit) in [
        (45.0, 0.92, 2.3, 0.05),
        (45.0, 0.98, 0.57, 0.005),
        (30.0, 0.92, 4.0, 0.05),
        (30.0, 0.98, 1.0, 0.05),
        (10.0, 0.92, 13.0, 0.5),
    ] {
        for fidelity in [Fidelity::Inelastic, Fidelity::Linear, Fidelity::Full] {
            let u = collide(fidelity, cut, false, 0.0, e).cue.velocity;
            let off = u.x.atan2(u.y).to_degrees();
            assert!((off - expected).abs() <= half_digit, "φ = {cut}, e = {e}: {off}");
        }
    }
}
