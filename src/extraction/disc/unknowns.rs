//! The unknowns of a fit of both discs' centres, and their places.

use nalgebra::SVector;

/// Instant of impact, s.
pub(super) const TIME: usize = 0;
/// Where the first disc's centre then is, m.
pub(super) const PLACE: usize = 1;
/// Direction of the line of centres, from the first disc to the second, rad.
pub(super) const DIRECTION: usize = 3;
/// Distance of the centres then, m.
pub(super) const DISTANCE: usize = 4;
/// Decelerations along the way, m/s²: both discs before, both after the impact.
pub(super) const SLOWING: usize = 13;
/// Number of decelerations.
pub(super) const SIDES: usize = 4;
/// Number of unknowns.
pub(super) const COUNT: usize = SLOWING + SIDES;

/// First component of the velocity of a disc (0 or 1) before (0) or after (1) the impact, m/s.
pub(super) const fn velocity(disc: usize, side: usize) -> usize {
    5 + 4 * side + 2 * disc
}

/// Place of the deceleration of a disc (0 or 1) before (0) or after (1) the impact.
pub(super) const fn slowing(disc: usize, side: usize) -> usize {
    SLOWING + 2 * side + disc
}

pub(super) type Unknowns = SVector<f64, COUNT>;

/// The fit's unknowns and four spins: first disc before and after, second before and after.
pub(super) const INPUTS: usize = COUNT + 4;
