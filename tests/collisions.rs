//! The collision solver: reference values, energy, limits, derivatives, symmetries.

use std::fs;

use caromfit::ball::{Ball, BallState, Vec3};
use caromfit::collision::{ClothTorque, Coefficients, Fidelity, Model, Regime};
use caromfit::contact::{cue_velocity, slip};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The bar that the reference is held to: 1e-12 of the cue ball's speed (spins: over R).
const REFERENCE: f64 = 1e-12;

fn reference() -> serde_json::Value {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/collisions.json");
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

fn vector(value: &serde_json::Value) -> Vec3 {
    let number = |v: &serde_json::Value| v.as_f64().unwrap_or_else(|| v.as_str().unwrap().parse().unwrap());
    Vec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

#[test]
fn full_agrees_with_the_25_digit_reference() {
    let cases = reference();
    let cases = cases.as_array().unwrap();
    assert_eq!(cases.len(), 23);
    for case in cases {
        let number = |key: &str| case[key].as_f64().unwrap();
        let (speed, radius) = (number("speed"), number("radius"));
        let ball = Ball { radius, ..Ball::POOL };
        let torque = if case["as_printed"].as_bool().unwrap() {
            ClothTorque::AsPrinted
        } else {
            ClothTorque::Corrected
        };
        let model = Model { cloth_torque: torque, ..Model::new(Fidelity::Full, ball) };
        let cue = BallState {
            velocity: cue_velocity(speed, number("cut_deg").to_radians()),
            spin: vector(&case["omega"]),
        };
        let coefficients = Coefficients { mu: number("mu"), mu_s: number("mu_s"), e: number("e") };
        let outcome = model.collide(&cue, &coefficients).unwrap();
        let name = &case["name"];
        assert_eq!(outcome.regime.name(), case["regime"].as_str().unwrap(), "{name}");
        let impulse: f64 = case["impulse"].as_str().unwrap().parse().unwrap();
        assert!((outcome.impulse - impulse).abs() < REFERENCE * speed, "{name}: {}", outcome.impulse);
        for (ball, expected) in [(&outcome.cue, &case["cue"]), (&outcome.object, &case["object"])] {
            let off = (ball.velocity - vector(&expected["velocity"])).amax() / speed;
            let off_spin = (ball.spin - vector(&expected["spin"])).amax() * radius / speed;
            assert!(off < REFERENCE && off_spin < REFERENCE, "{name}: {off:e} {off_spin:e}");
        }
    }
}
