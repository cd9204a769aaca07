//! Both balls after an impact → the numbers that are measured of them.

use num_dual::DualNum;

use crate::measurement::observable::{Axis, Observable};
use crate::numerics::wrap;
use crate::problem::film::dual::{Dual, DualVector, constant, norm};
use crate::problem::film::impact::Side;

/// What the numbers of a shot depend on besides the balls after the impact.
pub(crate) struct View {
    /// Direction of the line of centres on the table; (1, 0) in the collision frame.
    pub cos: Dual,
    pub sin: Dual,
    /// Cut angle, rad, and speed before the impact, m/s.
    pub cut: Dual,
    pub speed: Dual,
    /// Sign of the measured cut angle.
    pub side: f64,
    /// Radii of both balls, m.
    pub radii: [Dual; 2],
}

impl View {
    /// Returns what is measured of the balls after the impact, rad, m/s or rad/s.
    pub fn observe(&self, observable: Observable, [cue, object]: &[Side; 2]) -> Dual {
        let against_incoming = |velocity: &DualVector| turn((direction(velocity) - self.cut) * self.side);
        match observable {
            Observable::Throw => direction(&object.velocity) * self.side,
            Observable::CueTurn => against_incoming(&cue.velocity),
            Observable::CueTurnRolling => against_incoming(&rolling(cue)),
            Observable::ObjectAngleRolling => -against_incoming(&rolling(object)),
            Observable::Separation => {
                let angle = turn(direction(&cue.velocity) - direction(&object.velocity));
                if angle.re < 0.0 { -angle } else { angle }
            }
            Observable::ObjectSpeed => norm(&object.velocity),
            Observable::CueSpeed => norm(&cue.velocity),
            Observable::ObjectSpeedRolling => norm(&rolling(object)),
            Observable::CueSpeedRolling => norm(&rolling(cue)),
            Observable::ObjectSpeedRatio => norm(&object.velocity) / self.speed,
            Observable::CueVelocity(axis) => self.on_table(&cue.velocity, cue.rise, axis),
            Observable::ObjectVelocity(axis) => self.on_table(&object.velocity, object.rise, axis),
            Observable::CueSpin(axis) => self.spin(cue, axis) / self.radii[0],
            Observable::ObjectSpin(axis) => self.spin(object, axis) / self.radii[1],
            // of discs, which are another kind of data
            Observable::Restitution | Observable::ImpulseRatio => constant(f64::NAN),
        }
    }

    fn spin(&self, ball: &Side, axis: Axis) -> Dual {
        let [x, y, z] = ball.spin;
        self.on_table(&DualVector::new(x, y), z, axis)
    }

    fn on_table(&self, horizontal: &DualVector, vertical: Dual, axis: Axis) -> Dual {
        match axis {
            Axis::X => horizontal.x * self.cos - horizontal.y * self.sin,
            Axis::Y => horizontal.x * self.sin + horizontal.y * self.cos,
            Axis::Z => vertical,
        }
    }
}

fn direction(velocity: &DualVector) -> Dual {
    velocity.y.atan2(velocity.x)
}

/// Returns the velocity once the ball rolls: V − s ν/(1 + ν) with its slip s on the cloth, whether or
/// not it flies first.
fn rolling(ball: &Side) -> DualVector {
    ball.velocity - ball.slip() * constant(ball.inertia / (1.0 + ball.inertia))
}

/// Returns the same angle within (−π, π].
fn turn(angle: Dual) -> Dual {
    angle + (wrap(angle.re) - angle.re)
}
