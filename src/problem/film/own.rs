//! Places of the own unknowns of a shot of balls. Velocities are in its collision frame, m/s.

use nalgebra::Rotation2;

use super::camera::Point;
use crate::problem::unknowns::{Id, Mode, Own, Unknown};

/// Number of unknowns that each shot has of its own.
pub(crate) const OWN: usize = MOVING + SCATTERED.len();
/// Number of those that are its motion before the impact, which are the first.
pub(crate) const MOVING: usize = 9;

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
/// First of what differs from shot to shot in [`SCATTERED`], less what the shots share; 0 and held
/// unless it scatters.
pub(crate) const SCATTER: usize = MOVING;

/// Shared unknowns from which those of a shot may differ.
pub(crate) const SCATTERED: [Id; 4] = [Id::Mu, Id::E, Id::MuS, Id::MassRatio];

/// Returns the input of the motion that an unknown of a shot changes; places count its own unknowns
/// first, then the shared ones.
pub(super) fn input_of(place: usize) -> usize {
    match place.checked_sub(SCATTER) {
        None => place,
        Some(i) => MOVING + SCATTERED.get(i).map_or(place.saturating_sub(OWN), |id| *id as usize),
    }
}

/// Returns which of them differ from shot to shot: those that are estimated.
pub(in crate::problem) fn scattering(unknowns: &[Unknown]) -> [bool; SCATTERED.len()] {
    SCATTERED.map(|id| unknowns[id as usize].mode == Mode::Free)
}

/// Returns the velocity of the cue ball on the table, m/s.
pub(super) fn velocity(own: &Own) -> Point {
    Rotation2::new(own[DIRECTION]) * Point::new(own[ALONG], own[ACROSS])
}

/// Returns own unknowns of which the first are given, and the others 0.
pub(super) fn moving(first: [f64; 6]) -> Own {
    Own::from_column_slice(&first).resize_vertically(OWN, 0.0)
}
