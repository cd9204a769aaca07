//! How a table is fitted, and why a shot or the whole table cannot be.

use crate::measurement::loss::Loss;
use crate::measurement::number::count_of;
use crate::physics::collision::{Fidelity, NotACollision};
use crate::problem::unknowns::Id;

/// Choices of the fit of a table that its data set does not state.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RowsChoices {
    /// How closely collisions are computed; `None`: as the data show.
    pub(crate) fidelity: Option<Fidelity>,
    /// How outlying shots count; `None`: as the data set states.
    pub(crate) loss: Option<Loss>,
    /// Whether intervals of profiles are left out.
    pub(crate) without_profiles: bool,
}

/// Why a table cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RowsError {
    /// No shot can be fitted.
    #[error("no shot can be used{}", .left_out.first().map_or(String::new(), |(shot, why)| format!(": shot {shot}: {why}")))]
    NoShot {
        /// Names of the shots, and reasons.
        left_out: Vec<(String, String)>,
    },
    /// There are fewer numbers than free unknowns.
    #[error(
        "{} for the free parameters {}; expected at least as many observations as parameters: add shots, or fix parameters under [fit]",
        count_of(*.numbers, "observation"),
        .unknowns.iter().map(|id| id.name()).collect::<Vec<_>>().join(", ")
    )]
    TooFewNumbers {
        /// Number of observations and priors.
        numbers: usize,
        /// The free unknowns.
        unknowns: Vec<Id>,
    },
    /// Some numbers of a column have a standard deviation and others do not.
    #[error("{column} has a standard deviation in {with}, but none in {without}; give all or none")]
    MixedNoise {
        /// The column.
        column: &'static str,
        /// Place and name of the first shot with one.
        with: String,
        /// Place and name of the first shot without.
        without: String,
    },
    /// κ is stated, and the fidelity is of a rigid contact.
    #[error(
        "kappa stands in [fit], but with the fidelity {0} a contact is rigid along its surface; expected the fidelity auto, ode or \
         contact with it"
    )]
    Rigid(&'static str),
    /// No start of the search describes a collision.
    #[error(
        "no collision is like these shots, so that no search can begin: check the radius, the units and which ball is which"
    )]
    NoStart,
}

/// Reason why a shot cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Unpredictable {
    /// The state before the impact is not a collision.
    #[error(transparent)]
    NotACollision(#[from] NotACollision),
    /// The spin is unknown.
    #[error("its spin is unknown; give spin columns, or cue_spin stun or natural-roll")]
    UnknownSpin,
    /// The spin is stated in rad/s and no speed is.
    #[error("its spin is given in rad/s but no speed is: give speed_m_s or a speed after the impact")]
    SpinWithoutSpeed,
    /// Friction or restitution depends on the speed, which is not known.
    #[error(
        "the friction or e depends on the speed, but the shot has none: give speed_m_s or a speed after the \
         impact"
    )]
    FallsWithoutSpeed,
    /// The only observable determines the speed before the impact.
    #[error("its only observable, {0}, serves to find the incoming speed: no number is left to fit")]
    NothingLeft(&'static str),
}
