//! Places of the own unknowns of a shot of balls. Velocities are in its collision frame, m/s.

/// Number of unknowns that each shot has of its own.
pub(crate) const OWN: usize = 9;

/// Instant of the impact, s.
pub(crate) const TIME: usize = 0;
/// Coordinates x and y of the object ball at rest, m.
pub const X: usize = 1;
pub(crate) const Y: usize = 2;
/// Direction of the line of centres on the table, rad.
pub(crate) const DIRECTION: usize = 3;
/// Velocity of the cue ball along the line of centres.
pub(crate) const ALONG: usize = 4;
/// Velocity of the cue ball across the line of centres.
pub(crate) const ACROSS: usize = 5;
/// Topspin over that of natural roll, of a ball that slides; less the measured one, if its spin is
/// measured; 0 and held for a ball that rolls.
pub(crate) const TOPSPIN: usize = 6;
/// Side spin Rω_z/U.
pub(crate) const SIDE: usize = 7;
/// Spin about the direction of travel, Rω/U, less the measured one; 0 and held unless it is measured.
pub(crate) const SWERVE: usize = 8;
