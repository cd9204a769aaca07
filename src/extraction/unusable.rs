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
    #[must_use]
    pub const fn names(self) -> [&'static str; 2] {
        match self {
            Self::Balls => ["cue ball", "object ball"],
            Self::Discs => ["first disc", "second disc"],
        }
    }

    const fn no_collision(self) -> &'static str {
        match self {
            Self::Balls => "the object ball is not set in motion by the cue ball",
            Self::Discs => "the discs do not come near each other and part again with other velocities",
        }
    }
}

/// Reason for which no impact could be extracted from a shot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum Unusable {
    /// A body was seen in too few frames.
    #[error(
        "the tracks are too short: {} frames of the {}, {} of the {}; expected at least {least} of each",
        frames[0], bodies.names()[0], frames[1], bodies.names()[1]
    )]
    TooShort {
        /// Bodies of the shot.
        bodies: Bodies,
        /// Number of frames of the first and of the second body.
        frames: [usize; 2],
        /// Number of frames needed.
        least: usize,
    },
    /// No collision was found.
    #[error("no collision found: {}", .0.no_collision())]
    NoCollision(Bodies),
    /// Too few frames of a body before or after the impact are left.
    #[error("too few frames of the {body} {when} the impact: {frames}; expected at least {least}")]
    TooFew {
        /// The body, in words.
        body: &'static str,
        /// `before` or `after`.
        when: &'static str,
        /// Number of its frames there.
        frames: usize,
        /// Number of frames needed.
        least: usize,
    },
    /// The object ball moves before the impact.
    #[error("the object ball was moving before the impact, with {speed:.3} m/s")]
    ObjectMoving {
        /// Its speed, m/s.
        speed: f64,
    },
    /// The distance of the centres of discs at the impact differs from the sum of the radii.
    #[error(
        "the centres are {:.2} ± {:.2} mm apart at the impact, not {:.2} mm (the sum of the radii): check the scale, \
         the radii and which track is which disc; without radius_m the tracks decide",
        1e3 * measured, 1e3 * error, 1e3 * expected
    )]
    Separation {
        /// Measured distance, m.
        measured: f64,
        /// Distance of discs that touch, m.
        expected: f64,
        /// Standard error of the measured distance, m.
        error: f64,
    },
    /// Two points that are stated to be on one disc change their distance.
    #[error(
        "the points \"{first}\" and \"{second}\" on the {disc} do not move as one rigid body: they are {least_mm:.1} to \
         {most_mm:.1} mm apart; check in [tracks] cue and object which points are on which disc"
    )]
    NotRigid {
        /// The disc, in words.
        disc: &'static str,
        /// The name of one point.
        first: String,
        /// The name of the other point.
        second: String,
        /// Their smallest distance, mm.
        least_mm: f64,
        /// Their largest distance, mm.
        most_mm: f64,
    },
    /// No single collision explains the motion.
    #[error(
        "its motion fits no single collision: χ²/dof is {reduced_chi2:.1} even next to the impact, where the fit is off by {rms_mm:.2} mm"
    )]
    BadFit {
        /// χ² per degree of freedom next to the impact.
        reduced_chi2: f64,
        /// Root mean square of the residuals there, mm.
        rms_mm: f64,
    },
}

impl Unusable {
    /// Returns the error for too few frames of a body (0, 1) before (0) or after (1) the impact.
    pub(crate) fn too_few(bodies: Bodies, [body, side]: [usize; 2], frames: usize, least: usize) -> Self {
        Self::TooFew { body: bodies.names()[body], when: ["before", "after"][side], frames, least }
    }
}
