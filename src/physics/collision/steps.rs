//! How many steps a solution takes, for the tests.

#[cfg(not(test))]
#[inline]
pub(super) fn record(_: usize) {}

#[cfg(test)]
pub(super) use counted::*;

#[cfg(test)]
mod counted {
    use std::cell::Cell;

    use serde_json::Value;

    use crate::physics::ball::{Ball, BallState, Vec3};
    use crate::physics::collision::{Coefficients, Model};

    thread_local! {
        static MOST: Cell<usize> = const { Cell::new(0) };
    }

    /// Of the hard cases.
    pub const HARD: Ball = Ball { radius: 1.0 / 32.0, ..Ball::POOL };

    pub fn record(step: usize) {
        MOST.set(MOST.get().max(step + 1));
    }

    /// The most steps that a hard case takes, and its name.
    pub fn most_of_hard_cases(model: &Model) -> (usize, String) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/hard_cases.json");
        let cases: Vec<Value> = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let counted = cases.iter().map(|case| {
            let number = |value: &Value| value.as_f64().unwrap();
            let cue = BallState {
                velocity: Vec3::new(number(&case["velocity"][0]), number(&case["velocity"][1]), 0.0),
                spin: Vec3::from([0, 1, 2].map(|i| number(&case["spin"][i]))),
            };
            let [mu, mu_s, e] = ["mu", "mu_s", "e"].map(|key| number(&case[key]));
            MOST.set(0);
            model.collide(&cue, &Coefficients { mu, mu_s, e }).unwrap();
            (MOST.get(), case["name"].to_string())
        });
        let most = counted.max_by_key(|(steps, _)| *steps).unwrap();
        println!("{}: at most {} steps: {}", model.fidelity.name(), most.0, most.1);
        most
    }
}
