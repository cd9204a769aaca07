//! Names that most tests use.

pub use std::collections::{BTreeMap, BTreeSet};
pub use std::fs;
pub use std::path::{Path, PathBuf};
pub use std::process::Command;
pub use std::sync::atomic::{AtomicUsize, Ordering};
pub use std::time::Instant;

pub use caromfit::compare::{Comparison, Finding, Quantity};
pub use caromfit::design::Expected;
pub use caromfit::fit::predict;
pub use caromfit::fit::{
    Depth, Estimate, Falling, Fit, FitError, Grade, NoiseVerdict, Options, Rejected, Residual, Status,
};
pub use caromfit::io::StatedObject;
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
    Coefficients, Effects, Fidelity, Input, MAX_SPEED, MIN_SPEED, MIN_TOLERANCE, Model, NotACollision,
    Outcome, Regime,
};
pub use caromfit::physics::contact_frame::{cloth_slip, cue_velocity, slip};
pub use caromfit::physics::friction_law::Law;
pub use caromfit::simulate::{BallSpec, Camera, Kind, Noise, Played, Shots, Spec, TrueImpact, Truth};
pub use caromfit::{compare, fit, io, simulate};
pub use nalgebra::{DMatrix, DVector};
pub use rand::{Rng, SeedableRng};
pub use rand_chacha::ChaCha8Rng;
pub use rayon::prelude::*;
pub use serde_json::{Value, json};
pub use statrs::distribution::{ContinuousCDF, Normal};

pub use crate::shipped::{root, shipped};
pub use crate::study::{Pulls, count, figure, take_inputs_for_exact};
pub use crate::synthetic::{ERRORS, TRUTH, auto, is_right, made, made_with, spec};
pub(crate) use crate::{options, synthetic};
