//! A ball and its state of motion.

use nalgebra::Vector3;

/// A vector in a right-handed frame whose z axis points up.
pub type Vec3 = Vector3<f64>;

/// ν of a uniform sphere, its moment of inertia over MR².
pub const UNIFORM_SPHERE: f64 = 0.4;

/// ν of a thin hollow sphere, the largest that a ball can have.
pub const HOLLOW_SPHERE: f64 = 2.0 / 3.0;

/// A ball. Both balls of a collision are equal unless stated otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// R, the radius, in metres.
    pub radius: f64,
    /// M, the mass, in kilograms; it cancels from every velocity if the balls are equal.
    pub mass: f64,
    /// ν, the moment of inertia over MR².
    pub inertia: f64,
}

impl Ball {
    /// A standard pool ball: 57.15 mm (2¼ inches) across and uniform, as the World Pool-Billiard
    /// Association specifies it, of 170 g (specified: 5.5 to 6 oz, 156 to 170 g).
    pub const POOL: Self = Self { radius: 0.028_575, mass: 0.170, inertia: UNIFORM_SPHERE };

    /// Games and the radii of their balls, m, the largest first (rules of pyramid, UMB, WPA and WPBSA).
    pub const GAMES: [(&str, f64); 4] =
        [("pyramid", 0.034), ("carom", 0.03075), ("pool", 0.028_575), ("snooker", 0.02625)];

    /// Returns the horizontal distance of the centres of balls on the table that touch, 2√(R₁R₂),
    /// m.
    pub fn contact_distance(&self, other: &Self) -> f64 {
        2.0 * (self.radius * other.radius).sqrt()
    }
}

impl Default for Ball {
    fn default() -> Self {
        Self::POOL
    }
}

/// The motion of a ball.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BallState {
    /// U or V, the velocity of the centre, m/s.
    pub velocity: Vec3,
    /// ω or Ω, the angular velocity, rad/s.
    pub spin: Vec3,
}

impl BallState {
    /// Returns a ball that slides without spin.
    pub fn stun(velocity: Vec3) -> Self {
        Self { velocity, spin: Vec3::zeros() }
    }

    /// Returns a ball in natural roll, without slip on the cloth: ω = (−V_y, V_x, 0)/R.
    pub fn natural_roll(velocity: Vec3, radius: f64) -> Self {
        let spin = Vec3::new(-velocity.y, velocity.x, 0.0) / radius;
        Self { velocity, spin }
    }
}
