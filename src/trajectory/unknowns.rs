//! The unknowns of a shot while its impact is extracted.

use nalgebra::SVector;

/// The unknowns of a shot. Velocities are in the collision frame, m/s.
pub(crate) mod unknown {
    /// Instant of impact, s.
    pub const TIME: usize = 0;
    /// Where the object ball lies before it, m.
    pub const OBJECT: usize = 1;
    /// Direction of the line of centres in the table frame, rad.
    pub const DIRECTION: usize = 3;
    /// Cue ball's velocity at the impact.
    pub const BEFORE: usize = 4;
    /// And just after it.
    pub const CUE: usize = 6;
    /// Object ball's velocity just after it.
    pub const BALL: usize = 8;
    /// μ_k of the cloth.
    pub const SLIDING: usize = 11;
    /// μ_r of the cloth, which a single shot is given: all shots together tell it.
    pub const ROLLING: usize = 14;
    pub const COUNT: usize = 15;
}

/// All unknowns of a shot.
pub(crate) type Unknowns = SVector<f64, { unknown::COUNT }>;
