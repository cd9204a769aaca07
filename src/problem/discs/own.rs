//! Places of the own unknowns of a shot of discs, in SI units and the frame of the table.

/// Instant of the impact, s.
pub const TIME: usize = 0;
/// Coordinates x and y of the first disc's centre then, m from the middle of the film.
pub const X: usize = 1;
/// Direction of the line of centres from the first disc to the second, rad.
pub const DIRECTION: usize = 3;
/// Distance of the centres less that of all shots, m.
pub const DISTANCE: usize = 4;
/// Velocities before the impact: x and y of the first disc, x and y of the second.
pub const VELOCITY: usize = 5;
/// Angular velocities of both discs before the impact.
pub const SPIN: usize = 9;
/// Offset of e from the law.
pub const RESTITUTION: usize = 11;
/// Offset of J_t/J_n from the law.
pub const RATIO: usize = 12;
/// Momentum gained along and across the line of centres, over the normal impulse.
pub const MOMENTUM: usize = 13;
/// J_t/J_n by the spin of each disc less that by the paths.
pub const SPIN_RATIO: usize = 15;
/// Decelerations less that of all shots: the first disc before and after, the second likewise.
pub const SLOWING: usize = 17;
/// Time by which friction acts earlier than the normal force, s.
pub const LEAD: usize = 21;
/// Number of own unknowns besides those of markers: direction and distance from the centre of each
/// marker at the impact.
pub const CORE: usize = 22;
