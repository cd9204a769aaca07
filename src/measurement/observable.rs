//! What can be measured of a collision: one list for every kind of data set.

use std::str::FromStr;

use crate::physics::name::{UnknownName, named};

/// A measured quantity after the impact. Inside, angles are radians, speeds m/s, spins rad/s.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Observable {
    /// Object ball's direction against the line of centres, positive the way a stun shot throws.
    Throw,
    /// Cue ball's outgoing against incoming direction, positive for the usual turn of a cut shot.
    CueTurn,
    /// Angle between the two balls' outgoing directions, 0 to π.
    Separation,
    /// Horizontal speed of the object ball.
    ObjectSpeed,
    /// Horizontal speed of the cue ball.
    CueSpeed,
    /// Object ball's horizontal speed over the cue ball's before the impact.
    ObjectSpeedRatio,
    /// Object ball's speed once it rolls on the cloth.
    ObjectSpeedRolling,
    /// Cue ball's speed once it rolls on the cloth.
    CueSpeedRolling,
    /// Cue ball's direction against its incoming one, as `CueTurn`, once it rolls on the cloth.
    CueTurnRolling,
    /// Object ball's rolling direction against the cue ball's incoming direction; the cut angle
    /// less the throw.
    ObjectAngleRolling,
    /// Of discs: e, the ratio of the normal velocities after and before the impact.
    Restitution,
    /// Of discs: J_t/J_n on the second, t 90° counter-clockwise from the line of centres.
    ImpulseRatio,
    /// Component of the cue ball's velocity, table frame.
    CueVelocity(Axis),
    /// Component of the object ball's velocity, table frame.
    ObjectVelocity(Axis),
    /// Component of the cue ball's spin, table frame.
    CueSpin(Axis),
    /// Component of the object ball's spin, table frame.
    ObjectSpin(Axis),
}

/// A coordinate axis of the table frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// The horizontal axis x.
    X,
    /// The horizontal axis y, 90° counter-clockwise from x as seen from above.
    Y,
    /// The vertical axis, upwards.
    Z,
}

impl Axis {
    /// The three axes in this order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// The place of the axis in a vector: 0, 1 or 2.
    #[must_use]
    pub fn index(self) -> usize {
        self as usize
    }
}

impl Observable {
    /// The observables of a data set of kind `angles`.
    pub const ANGLES: [Self; 10] = [
        Self::Throw,
        Self::CueTurn,
        Self::Separation,
        Self::ObjectSpeed,
        Self::CueSpeed,
        Self::ObjectSpeedRatio,
        Self::ObjectSpeedRolling,
        Self::CueSpeedRolling,
        Self::CueTurnRolling,
        Self::ObjectAngleRolling,
    ];

    /// The observables of a data set of kind `impacts`.
    pub const IMPACTS: [Self; 12] = [
        Self::CueVelocity(Axis::X),
        Self::CueVelocity(Axis::Y),
        Self::CueVelocity(Axis::Z),
        Self::ObjectVelocity(Axis::X),
        Self::ObjectVelocity(Axis::Y),
        Self::ObjectVelocity(Axis::Z),
        Self::CueSpin(Axis::X),
        Self::CueSpin(Axis::Y),
        Self::CueSpin(Axis::Z),
        Self::ObjectSpin(Axis::X),
        Self::ObjectSpin(Axis::Y),
        Self::ObjectSpin(Axis::Z),
    ];

    /// The observables of discs.
    pub const DISCS: [Self; 2] = [Self::Restitution, Self::ImpulseRatio];

    /// The column that holds it in a data file, which ends in the unit where that is not SI.
    #[must_use]
    pub fn column(self) -> &'static str {
        match self {
            Self::Throw => "throw_deg",
            Self::CueTurn => "cue_turn_deg",
            Self::Separation => "separation_deg",
            Self::ObjectSpeed => "object_speed_m_s",
            Self::CueSpeed => "cue_speed_m_s",
            Self::ObjectSpeedRatio => "object_speed_ratio",
            Self::ObjectSpeedRolling => "object_speed_rolling_m_s",
            Self::CueSpeedRolling => "cue_speed_rolling_m_s",
            Self::CueTurnRolling => "cue_turn_rolling_deg",
            Self::ObjectAngleRolling => "object_angle_rolling_deg",
            Self::Restitution => "e",
            Self::ImpulseRatio => "impulse_ratio",
            Self::CueVelocity(axis) => ["cue_vx_after", "cue_vy_after", "cue_vz_after"][axis.index()],
            Self::ObjectVelocity(axis) => ["obj_vx_after", "obj_vy_after", "obj_vz_after"][axis.index()],
            Self::CueSpin(axis) => ["cue_wx_after", "cue_wy_after", "cue_wz_after"][axis.index()],
            Self::ObjectSpin(axis) => ["obj_wx_after", "obj_wy_after", "obj_wz_after"][axis.index()],
        }
    }

    /// The name in plots and tables.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::Throw => "throw",
            Self::CueTurn => "cue-ball turn",
            Self::Separation => "separation angle",
            Self::ObjectSpeed => "object-ball speed",
            Self::CueSpeed => "cue-ball speed",
            Self::ObjectSpeedRatio => "object-ball speed ratio",
            Self::ObjectSpeedRolling => "object-ball speed, rolling",
            Self::CueSpeedRolling => "cue-ball speed, rolling",
            Self::CueTurnRolling => "cue-ball turn, rolling",
            Self::ObjectAngleRolling => "object-ball angle, rolling",
            Self::Restitution => "e",
            Self::ImpulseRatio => "J_t/J_n",
            Self::CueVelocity(axis) => ["cue-ball vx", "cue-ball vy", "cue-ball vz"][axis.index()],
            Self::ObjectVelocity(axis) => {
                ["object-ball vx", "object-ball vy", "object-ball vz"][axis.index()]
            }
            Self::CueSpin(axis) => ["cue-ball ωx", "cue-ball ωy", "cue-ball ωz"][axis.index()],
            Self::ObjectSpin(axis) => ["object-ball ωx", "object-ball ωy", "object-ball ωz"][axis.index()],
        }
    }

    /// The unit of its column: `°`, `m/s`, `rad/s`, or empty for a ratio.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::ObjectSpeedRatio | Self::Restitution | Self::ImpulseRatio => "",
            Self::CueSpin(_) | Self::ObjectSpin(_) => "rad/s",
            _ if self.is_angle() => "°",
            _ => "m/s",
        }
    }

    /// Whether it is an angle: radians inside, degrees in files, tables and plots.
    pub(crate) fn is_angle(self) -> bool {
        matches!(
            self,
            Self::Throw | Self::CueTurn | Self::Separation | Self::CueTurnRolling | Self::ObjectAngleRolling
        )
    }

    /// One unit of the column in SI: π/180 for angles, else 1.
    pub(crate) fn unit_si(self) -> f64 {
        if self.is_angle() { 1.0_f64.to_radians() } else { 1.0 }
    }
}

/// By its column.
impl FromStr for Observable {
    type Err = UnknownName;

    fn from_str(column: &str) -> Result<Self, UnknownName> {
        let all = [&Self::ANGLES[..], &Self::IMPACTS, &Self::DISCS].concat();
        named("observable", &all, |observable| [observable.column()], column)
    }
}
