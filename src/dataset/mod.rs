//! Measured collisions: `dataset.toml` and the tables it names.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::ball::{Ball, Vec3};
use crate::observable::Observable;
use crate::parameters::Settings;

/// A loaded and checked data set: every number finite, every standard deviation positive.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Also the name of its folder below `fits/`.
    pub name: String,
    /// The file it was read from.
    pub path: PathBuf,
    pub cloth: Option<String>,
    pub source: Option<String>,
    pub ball: Ball,
    pub settings: Settings,
    /// The label column whose values are fitted apart (`[fit] by`).
    pub by: Option<String>,
    pub shots: Vec<Shot>,
}

/// One shot, or the mean of several.
#[derive(Clone, Debug)]
pub struct Shot {
    /// The `shot` column, or the row's number from 1 where there is none.
    pub name: String,
    pub file: PathBuf,
    /// Line of the file, from 1, comments and header counted.
    pub line: usize,
    /// Columns that are neither input nor observable, kept as text.
    pub labels: BTreeMap<String, String>,
    pub before: Before,
    pub spin: Spin,
    /// At least one.
    pub after: Vec<Measurement>,
}

/// A value with its standard deviation, where the data give one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    pub value: f64,
    pub sd: Option<f64>,
}

/// An observable's measured value, in SI units and radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    pub observable: Observable,
    pub measured: Measured,
}

/// The cue ball's motion before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Before {
    /// Kind `impacts`: line of centres (unit vector, cue to object) and velocity, table frame.
    Impact { normal: [Measured; 2], velocity: [Measured; 2] },
    /// Kind `angles`: cut angle in radians, and the speed (m/s) where it is known.
    Angle { cut: Measured, speed: Option<Measured> },
}

/// The cue ball's spin before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spin {
    Stun,
    NaturalRoll,
    /// rad/s, in the table frame for `impacts` and in the collision frame for `angles`.
    Measured {
        spin: Vec3,
        sd: [Option<f64>; 3],
    },
    Unknown,
}
