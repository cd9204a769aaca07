//! Values that are not as expected, and the conditions that they are to meet.

use crate::physics::ball::HOLLOW_SPHERE;

/// A condition on a finite number, and its words.
pub(crate) type Condition = (fn(f64) -> bool, &'static str);

pub(crate) const FINITE: Condition = (|_| true, "a finite number");
pub(crate) const POSITIVE: Condition = (|x| x > 0.0, "more than 0");
pub(crate) const NOT_NEGATIVE: Condition = (|x| x >= 0.0, "0 or more");
pub(crate) const INERTIA: Condition =
    (|x| x > 0.0 && x <= HOLLOW_SPHERE, "more than 0, at most 2/3 (a hollow sphere)");
pub(crate) const FRACTION: Condition = (|x| (0.0..=1.0).contains(&x), "a number from 0 to 1");

/// A value that is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key} is {value}; expected {expected}")]
pub struct Fault {
    /// The path of its key, such as `camera.fps`.
    pub key: String,
    /// The value.
    pub value: String,
    /// The expectation, in words.
    pub expected: String,
}

impl Fault {
    /// Returns a value that is not as expected.
    pub(crate) fn new(key: &str, value: impl ToString, expected: impl Into<String>) -> Self {
        Self { key: key.to_owned(), value: value.to_string(), expected: expected.into() }
    }

    /// Returns a fault unless a number is finite and meets the condition.
    pub(crate) fn of_number(key: &str, number: f64, (is_met, expected): Condition) -> Option<Self> {
        let is_good = number.is_finite() && is_met(number);
        (!is_good).then(|| Self::new(key, number, expected))
    }
}
