//! Names that most tests use.

pub use std::collections::{BTreeMap, BTreeSet};
pub use std::fs;
pub use std::path::{Path, PathBuf};
pub use std::process::Command;
pub use std::sync::atomic::{AtomicUsize, Ordering};
pub use std::time::Instant;

pub use caromfit::compare::{Comparison, Quantity};
pub use caromfit::fit::predict;
pub use caromfit::fit::{Depth, Estimate, Falling, Fit, FitError, Grade, Options, Status};
pub use caromfit::measurement::correction::Correction;
pub use caromfit::measurement::dataset::{Before, Dataset, Measured, ObjectBall, Shot, Tracks};
pub use caromfit::measurement::loss::Loss;
pub use caromfit::measurement::observable::{Axis, Observable};
pub use caromfit::measurement::parameter::{Compliance, Parameter, Setting};
pub use caromfit::measurement::spin::Spin;
pub use caromfit::measurement::track::{Sample, TrackShot};
pub use caromfit::physics::ball::{Ball, BallState, Vec3};
pub use caromfit::physics::cloth_motion::Cloth;
pub use caromfit::physics::collision::{
    Coefficients, Effects, Fidelity, Input, Model, NotACollision, Outcome, Regime, SPEEDS, TOLERANCES,
};
pub use caromfit::physics::contact_frame::{cloth_slip, cue_velocity, slip};
pub use caromfit::physics::friction_law::Law;
pub use caromfit::simulate::{Spec, TrueImpact};
pub use caromfit::{compare, fit, io, simulate};
pub use nalgebra::{DMatrix, DVector};
pub use rand::{Rng, SeedableRng};
pub use rand_chacha::ChaCha8Rng;
pub use rayon::prelude::*;
pub use serde::Serialize;
pub use serde_json::{Value, json};
pub use statrs::distribution::{ContinuousCDF, Normal};

pub use crate::shipped::{root, shipped};
pub use crate::study::{Pulls, count, figure, take_inputs_for_exact};
pub use crate::synthetic::{ERRORS, EXACT, FINE, TRUTH, auto, is_right, made, made_with, spec, with};
pub(crate) use crate::{options, synthetic};

/// A part of what the library writes of a result, by its JSON pointer; null without it.
pub fn part(result: &impl Serialize, pointer: &str) -> Value {
    serde_json::to_value(result).unwrap().pointer(pointer).cloned().unwrap_or_default()
}

/// A number of what the library writes of a result; NaN without it.
pub fn number(result: &impl Serialize, pointer: &str) -> f64 {
    part(result, pointer).as_f64().unwrap_or(f64::NAN)
}
