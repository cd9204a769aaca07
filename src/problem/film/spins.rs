//! The cue ball's spin before the impact: what is stated of each shot, and what shots without a
//! stated spin have.
//!
//! Rolling is a state, not a value of the topspin: a ball that rolls slows down by μ_r g, one that
//! slides by μ_k g. Topspin and draw are two more: friction lifts the cue ball or the object ball.
//! A shot whose state is not stated is in the likeliest of several, each with bounds of its own,
//! within which χ² is smooth.

use nalgebra::{DVector, Matrix3};

use super::camera::{Camera, Point};
use super::marker_rotation::Rotation;
use super::own::{self, OWN};
use crate::measurement::spin::Spin;
use crate::numerics::SIGNIFICANT;
use crate::physics::ball::Vec3;
use crate::problem::sums::{OwnPrior, Spread};
use crate::problem::unknowns::{CAMERA, Id, Own, PHYSICS, Shared};

/// Bounds of the topspin of a ball that slides, over natural roll. Its surface is never faster than
/// three times its centre after a cue stroke without a miscue (offset of half a radius: 1.25).
const MAX_TOPSPIN: f64 = 3.0;

/// Standard deviation of the mean topspin of shots stated as natural roll, over natural roll. A
/// ball whose measured spin is within it rolls.
pub(super) const ROLL_SD: f64 = 0.01;

/// Number of spreads from shot to shot, and their indices: of the topspin of balls that slide, of
/// side spin, and of what [`own::SCATTERED`] lists.
pub(super) const SPREADS: usize = FIRST_SCATTER + own::SCATTERED.len();
pub(crate) const TOPSPIN_SPREAD: usize = 0;
pub(crate) const SIDE_SPREAD: usize = 1;
pub(crate) const FIRST_SCATTER: usize = 2;

/// Spreads of topspin (over natural roll), side spin (Rω_z/U), μ, e, μ_s and the mass ratio from shot
/// to shot before the frames are seen: half a tip's width off the middle of the ball; balls whose
/// friction differs by a hundredth. With twice that the errors of μ of clean films are a fifth too
/// large.
const FIRST_SPREADS: [f64; SPREADS] = [0.05, 0.02, 5e-4, 5e-4, 2.5e-3, 5e-4];

/// Smallest spread of topspin, in parts of natural roll: no frames determine a smaller one.
const LEAST_SPREAD: f64 = 0.004;

/// Returns the spreads before the frames are seen; that of side spin if it is stated.
pub(super) fn first_spreads(side_sd: f64) -> [Spread; SPREADS] {
    std::array::from_fn(|i| match FIRST_SPREADS[i] {
        first if i >= FIRST_SCATTER => Spread::first(first, 0.1 * first),
        _ if i == SIDE_SPREAD && side_sd > 0.0 => Spread::first(side_sd, LEAST_SPREAD),
        first => Spread::first(first, LEAST_SPREAD),
    })
}

/// How a number that markers show depends on the camera, to first order from one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Through {
    pub(super) camera: Camera,
    /// Derivatives of the number by the unknowns of the camera.
    pub(super) by: [f64; CAMERA],
}

impl Through {
    /// A number that no camera shows.
    pub(super) const NONE: Self = Self { camera: Camera::NONE, by: [0.0; CAMERA] };

    /// Returns what the number increases by with other values of the unknowns; takes the derivatives
    /// from `by`.
    pub(super) fn shift(&self, shared: &Shared, by: &mut DVector<f64>) -> f64 {
        let mut shift = 0.0;
        for (i, slope) in self.by.iter().enumerate() {
            shift += slope * (shared.0[PHYSICS + i] - self.camera.get(i));
            by[OWN + PHYSICS + i] -= slope;
        }
        shift
    }
}

/// Returns the axes of topspin, side spin and spin about the direction of travel.
fn axes(velocity: Point) -> [Vec3; 3] {
    let [x, y] = (velocity / velocity.norm()).into();
    [Vec3::new(-y, x, 0.0), Vec3::z(), Vec3::new(x, y, 0.0)]
}

/// The spin of one shot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShotSpin {
    /// Whether the cue ball rolls before the impact; else it slips as its spin makes it.
    pub(crate) rolls: bool,
    /// Shared unknown that the topspin of a ball that rolls is, and that of others scatters about.
    pub(crate) mean: Option<Id>,
    /// Measured spin in the table frame, rad/s.
    pub(crate) measured: Option<Vec3>,
    /// What is known of topspin, side spin and spin about the direction of travel, in the order of
    /// their places.
    pub(super) priors: [OwnPrior; 3],
    /// How these depend on the camera if they are measured.
    pub(super) through: [Through; 3],
    /// Bounds of the topspin, over natural roll.
    pub(crate) bounds: [f64; 2],
    /// States that the shot may be in.
    pub(crate) states: States,
}

/// States that a shot may be in, within each of which χ² is smooth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum States {
    /// The one that is stated.
    One,
    /// Rolling, or sliding with any spin.
    All,
    /// Rolling, or sliding, with a measured spin whose error leaves both open.
    Measured,
}

const UNBOUNDED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

impl ShotSpin {
    /// A ball in natural roll.
    const ROLLS: Self = Self {
        rolls: true,
        mean: Some(Id::Roll),
        measured: None,
        priors: [OwnPrior::Held, OwnPrior::Spread(SIDE_SPREAD), OwnPrior::Held],
        through: [Through::NONE; 3],
        bounds: UNBOUNDED,
        states: States::One,
    };

    /// A ball that slides, with about the same topspin as the others that do.
    pub(super) const SLIDES: Self = Self {
        rolls: false,
        mean: Some(Id::Slide),
        priors: [OwnPrior::Spread(TOPSPIN_SPREAD), OwnPrior::Spread(SIDE_SPREAD), OwnPrior::Held],
        ..Self::ROLLS
    };

    /// A ball of unknown spin, rolling at first.
    pub(super) const UNKNOWN: Self = Self { states: States::All, ..Self::ROLLS };

    /// A ball of unknown spin that slides with topspin, less than that of natural roll.
    pub(super) const UNKNOWN_SLIDING: Self = Self { bounds: [0.0, 1.0], states: States::All, ..Self::SLIDES };

    /// A ball of unknown spin that slides with more.
    const UNKNOWN_FAST: Self = Self { bounds: [1.0, MAX_TOPSPIN], ..Self::UNKNOWN_SLIDING };

    /// A ball of unknown spin with draw.
    const UNKNOWN_DRAW: Self = Self { bounds: [-MAX_TOPSPIN, 0.0], ..Self::UNKNOWN_SLIDING };

    /// Returns the spin of a shot whose cue ball has this velocity on the table, m/s.
    pub fn stated(spin: Spin, velocity: Point, radius: f64) -> Self {
        match spin {
            Spin::Stun => Self::SLIDES,
            Spin::NaturalRoll => Self::ROLLS,
            Spin::Measured { spin, sd } => {
                let variances = sd.map(|sd| sd.unwrap_or(0.0).powi(2));
                let covariance = Matrix3::from_diagonal(&variances.into());
                Self::measured(&spin, &covariance, velocity, radius)
            }
            Spin::Unknown => Self::UNKNOWN,
        }
    }

    fn measured(spin: &Vec3, covariance: &Matrix3<f64>, velocity: Point, radius: f64) -> Self {
        let speed = velocity.norm();
        let slip = Point::new(velocity.x - radius * spin.y, velocity.y + radius * spin.x).norm();
        let error = covariance[(0, 0)].max(covariance[(1, 1)]).sqrt() * radius;
        let is_open = error > 0.0 && slip < ROLL_SD * speed + SIGNIFICANT * error;
        let rolls = slip < ROLL_SD * speed;
        // a component without a stated error scatters as one of a spin that a word states
        let [topspin, side, _] = if rolls { Self::ROLLS } else { Self::SLIDES }.priors;
        let unstated = [topspin, side, side];
        let axes = axes(velocity);
        let prior = |i: usize| {
            let sd = axes[i].dot(&(covariance * axes[i])).sqrt() * radius / speed;
            if sd > 0.0 && sd.is_finite() { OwnPrior::Stated(sd) } else { unstated[i] }
        };
        Self {
            rolls,
            mean: None,
            measured: Some(*spin),
            priors: [0, 1, 2].map(prior),
            states: if is_open { States::Measured } else { States::One },
            ..Self::ROLLS
        }
    }

    /// Returns the spin of a shot whose cue ball has this velocity on the table, m/s, and turns like
    /// this in a camera.
    pub(super) fn seen(rotation: &Rotation, camera: Camera, velocity: Point, radius: f64) -> Self {
        let Rotation { spin, covariance, by_camera } = rotation;
        let through = axes(velocity).map(|axis| {
            let by = by_camera.tr_mul(&axis) * (radius / velocity.norm());
            Through { camera, by: by.into() }
        });
        Self { through, ..Self::measured(spin, covariance, velocity, radius) }
    }

    /// Returns the spin as it is measured anew, in the state that was chosen, and changes the own
    /// unknowns so that the ball turns as before.
    pub(super) fn measured_again(&self, new: Self, own: &mut Own, velocity: Point, radius: f64) -> Self {
        let Some((before, now)) = self.measured.zip(new.measured) else { return new };
        for (i, axis) in axes(velocity).into_iter().enumerate() {
            own[own::TOPSPIN + i] += axis.dot(&(before - now)) * radius / velocity.norm();
        }
        let rolls = if new.states == States::Measured { self.rolls } else { new.rolls };
        Self { rolls, ..new }
    }

    /// Returns the states that the shot may be in, if these are several.
    pub(super) fn candidates(&self) -> Vec<Self> {
        match self.states {
            States::One => Vec::new(),
            States::Measured => [true, false].map(|rolls| Self { rolls, ..*self }).to_vec(),
            States::All => {
                vec![Self::UNKNOWN, Self::UNKNOWN_FAST, Self::UNKNOWN_SLIDING, Self::UNKNOWN_DRAW]
            }
        }
    }

    pub(crate) fn is_unknown(&self) -> bool {
        self.states == States::All
    }

    /// Returns whether natural roll ([`Id::Roll`]) or stun ([`Id::Slide`]) is stated.
    pub(crate) fn is_stated(&self, mean: Id) -> bool {
        self.mean == Some(mean) && !self.is_unknown()
    }

    pub(super) fn is_same_state(&self, other: &Self) -> bool {
        self.bounds == other.bounds && self.rolls == other.rolls
    }

    /// Returns the topspin of a shot over natural roll; 1 for a ball that rolls.
    pub(crate) fn topspin_of(&self, own: &Own) -> f64 {
        if self.rolls { 1.0 } else { own[own::TOPSPIN] }
    }

    /// Returns values whose topspin is within the bounds.
    pub fn within(&self, mut values: Own) -> Own {
        values[own::TOPSPIN] = values[own::TOPSPIN].clamp(self.bounds[0], self.bounds[1]);
        values
    }
}
