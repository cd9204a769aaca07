//! Discs: pucks that slide on a table without rolling, on air or nearly without friction.

/// ν of a uniform disc, its moment of inertia over MR².
pub const UNIFORM_DISC: f64 = 0.5;

/// Two discs that collide. The first takes the place of the cue ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discs {
    /// Radii of both discs, m. `None`: the tracks show the distance of the centres at the impact.
    pub radii: Option<[f64; 2]>,
    /// Masses of both discs, kg. `None`: their ratio follows from the balance of momentum.
    pub masses: Option<[f64; 2]>,
    /// ν of both discs, the moment of inertia over MR².
    pub inertia: f64,
    /// Whether the frame rate is known. If it is not, all times are in frames.
    pub in_seconds: bool,
}
