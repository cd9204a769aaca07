//! Friction between the balls that follows its slip: its direction, where it sticks and slides again, and the steps that are stable.

use super::{Grip, Mode, PHI, R, Shot, State, norm};

/// The longest step: R is of order 1 after some five.
const LONGEST: f64 = 0.2;

/// Steps that turn the friction by more are unstable.
const STABLE: f64 = 3.0;

/// Steps of a rigid contact that stop more of the slip are unstable.
const STABLE_RIGID: f64 = 2.0;

/// Friction can follow a slip of more than this times κμ…
const FOLLOWS: f64 = 10.0;

/// …where that errs by no more than this part of the tolerance.
const OF_TOLERANCE: f64 = 0.1;

/// Roundings of an event's function at most.
const HIDDEN: f64 = 1e-10;

/// Friction whose cosine to the slip is above this may follow it.
const ALIGNED: f64 = 0.999_9;

/// The friction along the slip, the angle by which it lags behind to first order, and the next order's part of it.
struct Lag {
    along: [f64; 2],
    first: f64,
    second: f64,
}

impl Shot {
    /// φ.
    #[inline(always)]
    pub(super) fn phi(&self, mode: &Mode, y: &State, v: [f64; 2]) -> [f64; 2] {
        if self.is_frictionless() {
            return [0.0; 2];
        }
        let phi = [y[PHI], y[PHI + 1]];
        match mode.grip {
            Grip::Stuck => phi,
            Grip::Stopped => [0.0; 2],
            Grip::Rigid => {
                let speed = norm(v);
                let by = -self.friction(speed) / speed.max(f64::MIN_POSITIVE);
                v.map(|v| by * v)
            }
            Grip::Slides => {
                let by = self.friction(norm(v)) / norm(phi);
                phi.map(|p| by * p)
            }
            Grip::Follows => {
                let Lag { along, first, second } = self.lag(mode, y, v);
                let lag = first * (1.0 - second);
                [along[0] + lag * along[1], along[1] - lag * along[0]]
            }
        }
    }

    /// How friction that follows the slip lags behind it.
    #[inline(always)]
    fn lag(&self, mode: &Mode, y: &State, v: [f64; 2]) -> Lag {
        let [stretch, _] = self.phase(mode);
        let square = v[0] * v[0] + v[1] * v[1];
        let speed = square.sqrt();
        let mu = self.friction(speed);
        let per_speed = 1.0 / speed;
        let along = v.map(|v| -mu * v * per_speed);
        let rate = self.slip_by(&self.forces(mode, y, along));
        let (turned, faster) = (v[0] * rate[1] - v[1] * rate[0], v[0] * rate[0] + v[1] * rate[1]);
        let (turned, faster) = (turned * per_speed * per_speed, faster * per_speed * per_speed);
        // 1/ρ over R; α'/ρ grows as R⁵/|v|²
        let slow = mu * self.kappa * per_speed / (3.0 * stretch);
        let second = slow * (-5.0 * self.v_x(y) / stretch - 2.0 * y[R] * faster);
        Lag { along, first: turned * slow * y[R], second }
    }

    /// Whether the lag's third order is within a part of what is allowed.
    fn can_follow(&self, mode: &Mode, y: &State, v: [f64; 2], part: f64) -> bool {
        let speed = norm(v);
        let [stretch, _] = self.phase(mode);
        if stretch * speed * part <= FOLLOWS * self.friction(speed) * self.kappa {
            return false;
        }
        let Lag { first, second, .. } = self.lag(mode, y, v);
        // the impulse to there is of the order of R⁵
        (first * second * second).abs() * self.friction(speed) * y[R].powi(5)
            < part * OF_TOLERANCE * self.tolerance
    }

    /// R, but not less than it matters.
    pub(super) fn root(&self, mode: &Mode, y: &State) -> f64 {
        y[R].max(self.least_root[usize::from(mode.restitution)])
    }

    /// ρ.
    fn turning(&self, mode: &Mode, y: &State, speed: f64) -> f64 {
        let [stretch, _] = self.phase(mode);
        3.0 * stretch * speed / (self.kappa * self.friction(speed) * self.root(mode, y))
    }

    /// Positive while a contact slides on.
    pub(super) fn slides_on(&self, mode: &Mode, y: &State, v: [f64; 2], phi: [f64; 2]) -> f64 {
        let [stretch, c] = self.phase(mode);
        let speed = norm(v);
        let mu = self.friction(speed);
        let mut limit = -c * mu * self.v_x(y) / stretch;
        if self.fall[0] != 0.0 && speed > 0.0 {
            let rate = self.slip_by(&self.forces(mode, y, phi));
            let slope = -self.fall[1] * (mu - self.mu);
            limit += y[R] * slope * (v[0] * rate[0] + v[1] * rate[1]) / speed;
        }
        -(v[0] * phi[0] + v[1] * phi[1]) - self.kappa * mu / (3.0 * stretch) * limit
    }

    /// The mode for the next step, and the longest step that is stable.
    pub fn prepare(&self, mode: &Mode, y: &State) -> (Mode, f64) {
        if self.is_rigid {
            // to where the impulse would be that of the whole impact
            let whole = 1.0 / (self.pace(mode, y)[0] * (1.0 + self.per_r));
            let lever = (1.0 + self.per_r) + self.per_r * self.per_nu[0] + self.per_nu[1];
            return (*mode, whole.min(STABLE_RIGID / (self.phase(mode)[0] * self.first * lever)));
        }
        if self.is_frictionless() {
            return (Mode { grip: Grip::Follows, ..*mode }, LONGEST);
        }
        let v = self.slip(y);
        let (speed, phi) = (norm(v), [y[PHI], y[PHI + 1]]);
        let turning = self.turning(mode, y, speed);
        let is_aligned = || -(v[0] * phi[0] + v[1] * phi[1]) > ALIGNED * speed * norm(phi);
        // events that roundings at the beginning of a step have hidden
        let beyond = || norm(phi) / self.friction(speed) - 1.0;
        let slides_on = || self.slides_on(mode, y, v, self.phi(mode, y, v));
        let grip = match mode.grip {
            Grip::Slides if slides_on() < -HIDDEN => Grip::Stuck,
            Grip::Stuck if beyond() > HIDDEN && slides_on() > 0.0 => Grip::Slides,
            Grip::Slides if is_aligned() && self.can_follow(mode, y, v, 0.5) => Grip::Follows,
            Grip::Follows if !self.can_follow(mode, y, v, 1.0) => Grip::Slides,
            grip => grip,
        };
        let longest = match grip {
            Grip::Stuck => self.root(mode, y),
            Grip::Slides => STABLE / turning,
            _ => LONGEST,
        };
        (Mode { grip, ..*mode }, longest.min(LONGEST))
    }
}
