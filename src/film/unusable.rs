//! Reasons for which no impact could be extracted from a shot.

/// Bodies of a shot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Bodies {
    /// Two balls on a cloth, the second at rest before the impact.
    Balls,
    /// Two discs, both of which may move.
    Discs,
}

impl Bodies {
    /// Returns the names of both bodies.
    pub const fn names(self) -> [&'static str; 2] {
        match self {
            Self::Balls => ["cue ball", "object ball"],
            Self::Discs => ["first disc", "second disc"],
        }
    }
}

/// Reason for which no impact could be extracted from a shot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(crate) enum Unusable {
    /// Numbers of frames of both bodies, and the least number of each.
    #[error(
        "the tracks are too short: {} frames of the {}, {} of the {}; expected at least {least} of each",
        frames[0], bodies.names()[0], frames[1], bodies.names()[1]
    )]
    TooShort { bodies: Bodies, frames: [usize; 2], least: usize },
    #[error("no collision found: {}", match .0 {
        Bodies::Balls => "the object ball is not set in motion by the cue ball",
        Bodies::Discs => "the discs do not come near each other and part again with other velocities",
    })]
    NoCollision(Bodies),
    /// Number of frames of a body before or after the impact, and the least number.
    #[error("too few frames of the {body} {when} the impact: {frames}; expected at least {least}")]
    TooFew { body: &'static str, when: &'static str, frames: usize, least: usize },
    /// Speed of the object ball before the impact, m/s.
    #[error("the object ball was moving before the impact, with {speed:.3} m/s")]
    ObjectMoving { speed: f64 },
    /// Distance of the centres of discs at the impact, its standard error, and the sum of the
    /// radii, mm.
    #[error(
        "the centres are {measured:.2} ± {error:.2} mm apart at the impact, not {expected:.2} mm (the sum of the radii): check the scale, \
         the radii and which track is which disc; without radius_m the tracks decide"
    )]
    Separation { measured: f64, expected: f64, error: f64 },
    /// Least and largest distance of two points that are stated to be on one disc, mm.
    #[error(
        "the points \"{first}\" and \"{second}\" on the {disc} do not move as one rigid body: they are {least_mm:.1} to \
         {most_mm:.1} mm apart; check in [tracks] cue and object which points are on which disc"
    )]
    NotRigid { disc: &'static str, first: String, second: String, least_mm: f64, most_mm: f64 },
    /// χ² per degree of freedom next to the impact, and the root mean square of the residuals
    /// there, mm.
    #[error(
        "its motion fits no single collision: χ²/dof is {reduced_chi2:.1} even next to the impact, where the fit is off by {rms_mm:.2} mm"
    )]
    BadFit { reduced_chi2: f64, rms_mm: f64 },
}
