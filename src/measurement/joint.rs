//! Errors of what was extracted from one track together, and what all tracks share of them.

use nalgebra::{DMatrix, DVector};

/// Errors of what was extracted from one track, table frame: direction of the line of centres (rad), the
/// cue ball's v_x, v_y (m/s), ω_x, ω_y, ω_z (rad/s) before the impact, then the shot's observations in
/// their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Their covariance without the errors that all shots share.
    pub covariance: DMatrix<f64>,
    /// How they change with each error that all shots share, in the order of [`Shared::ALL`], and behind them with each
    /// [`Shared::Camera`].
    pub by_shared: Vec<DVector<f64>>,
}

/// A number that all shots of footage were extracted with, so that they share its error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shared {
    /// The cloth's sliding friction μ_k.
    Sliding,
    /// How high friction lifts a ball, as a factor.
    Lift,
    /// The cloth's rolling resistance μ_r.
    Rolling,
    /// The camera that discs calibrate, in one of the independent ways in which it may be off.
    Camera(usize),
}

impl Shared {
    /// All but the camera's.
    pub const ALL: [Self; 3] = [Self::Sliding, Self::Lift, Self::Rolling];

    /// Where it stands in [`Joint::by_shared`].
    #[must_use]
    pub fn place(self) -> usize {
        match self {
            Self::Sliding => 0,
            Self::Lift => 1,
            Self::Rolling => 2,
            Self::Camera(way) => Self::ALL.len() + way,
        }
    }
}

impl Joint {
    /// How many quantities before the impact stand in front of the observations.
    pub const BEFORE: usize = 6;
}
