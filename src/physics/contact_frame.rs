//! The contact between the balls: line of centres, collision frame, contact slip.
//!
//! The collision frame is right-handed: **x** along the line of centres from cue ball to object
//! ball, **z** up, **y** = z × x. A positive cut angle φ means that the cue ball moves towards +y:
//! U = U(cos φ, sin φ, 0).

use super::ball::{BallState, Vec3};

/// The collision frame as seen from the table frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CollisionFrame {
    nx: f64,
    ny: f64,
}

impl CollisionFrame {
    /// Returns the frame of a line of centres in the table frame; `None` if it has no direction.
    pub fn from_normal(nx: f64, ny: f64) -> Option<Self> {
        let length = nx.hypot(ny);
        (length > 0.0 && length.is_finite()).then(|| Self { nx: nx / length, ny: ny / length })
    }

    /// Returns the frame of a direction of the line of centres, rad from the table's x axis.
    pub fn from_direction(direction_rad: f64) -> Self {
        let (ny, nx) = direction_rad.sin_cos();
        Self { nx, ny }
    }

    /// Turns a vector from the table frame into the collision frame.
    pub fn to_collision(self, v: Vec3) -> Vec3 {
        Vec3::new(v.x * self.nx + v.y * self.ny, v.y * self.nx - v.x * self.ny, v.z)
    }

    /// Turns a vector from the collision frame into the table frame.
    pub fn to_table(self, v: Vec3) -> Vec3 {
        Vec3::new(v.x * self.nx - v.y * self.ny, v.x * self.ny + v.y * self.nx, v.z)
    }
}

/// Returns the cue ball's velocity before the impact in the collision frame: U(cos φ, sin φ, 0).
pub fn cue_velocity(speed: f64, cut_rad: f64) -> Vec3 {
    Vec3::new(speed * cut_rad.cos(), speed * cut_rad.sin(), 0.0)
}

/// Returns the slip between the balls, collision frame, m/s (Kim 2024, above Eq. 11):
/// v = (V_x − U_x, V_y − U_y − R(ω_z + Ω_z), V_z − U_z + R(ω_y + Ω_y)).
#[inline]
pub fn slip(cue: &BallState, object: &BallState, radius: f64) -> Vec3 {
    let relative = object.velocity - cue.velocity;
    let spin = cue.spin + object.spin;
    relative + radius * Vec3::new(0.0, -spin.z, spin.y)
}

/// Returns the slip of a ball on the cloth, horizontal, m/s: s = (V_x − RΩ_y, V_y + RΩ_x, 0).
pub fn cloth_slip(ball: &BallState, radius: f64) -> Vec3 {
    let BallState { velocity: v, spin } = ball;
    Vec3::new(v.x - radius * spin.y, v.y + radius * spin.x, 0.0)
}
