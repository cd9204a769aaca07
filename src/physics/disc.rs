//! Discs: pucks that slide on a table without rolling, on air or nearly without friction.

/// Moment of inertia of a uniform disc over MR².
pub const UNIFORM_DISC: f64 = 0.5;

/// What is known of two discs that collide, the first in the place of the cue ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discs {
    /// Radii of both, m; else the tracks tell how far apart the centres are at the impact.
    pub radii: Option<[f64; 2]>,
    /// Masses of both, kg; else the balance of momentum tells their ratio.
    pub masses: Option<[f64; 2]>,
    /// ν of both, the moment of inertia over MR².
    pub inertia: f64,
    /// Whether the frame rate is known. Else frames stand for seconds everywhere.
    pub in_seconds: bool,
}
