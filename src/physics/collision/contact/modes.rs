//! The modes of a contact: its friction, transitions, stable steps and landings.

use super::{CLOTH, Grip, HEIGHT, Mode, N, NEGLIGIBLE, PHI, Pair, R, Shot, State, UP, pair};

/// The longest step: R is of order 1 after some five.
const MAX_STEP: f64 = 0.2;

/// Steps that turn the friction by more, or stop more of a rigid contact's slip, are unstable.
const STABLE: f64 = 3.0;

/// Roundings of an event's function at most.
const HIDDEN: f64 = 1e-10;

impl Shot {
    /// The mode at first contact: it slides if |v| > μκ.
    pub fn first_mode(&self) -> Mode {
        let speed = self.slip.norm();
        let is_stopped = speed == 0.0 || !self.is_frictionless() && speed <= 1.01 * self.sticks;
        let grip = match self.is_rigid {
            true if is_stopped => Grip::Stopped,
            true => Grip::Rigid,
            false if speed > self.friction(speed) * self.kappa => Grip::Slides,
            false => Grip::Stuck,
        };
        let mode = Mode { grip, restitution: false, up: [false; 2] };
        let rising = self.first_state(&mode)[PHI + 1] + self.tilt;
        Mode { up: if self.gravity > 0.0 { [false; 2] } else { [rising < 0.0, rising >= 0.0] }, ..mode }
    }

    pub fn first_state(&self, mode: &Mode) -> State {
        let mut y = [0.0; N];
        let per_slip = match mode.grip {
            Grip::Stopped => 0.0,
            Grip::Stuck => 1.0 / self.kappa,
            _ => self.first / self.slip.norm(),
        };
        y[PHI..].copy_from_slice((-per_slip * self.slip).as_slice());
        y
    }

    /// φ.
    #[inline(always)]
    pub(super) fn phi(&self, mode: &Mode, y: &State, v: Pair) -> Pair {
        if self.is_frictionless() {
            return Pair::zeros();
        }
        let phi = pair(y, PHI);
        match mode.grip {
            Grip::Stuck => phi,
            Grip::Stopped => Pair::zeros(),
            Grip::Rigid => self.along(v),
            Grip::Slides => phi * (self.friction(v.norm()) / phi.norm()),
            Grip::Follows => {
                let (along, [first, second]) = (self.along(v), self.lag(mode, y, v));
                along + first * (1.0 - second) * Pair::new(along.y, -along.x)
            }
        }
    }

    /// φ against the slip.
    #[inline(always)]
    fn along(&self, v: Pair) -> Pair {
        let speed = v.norm();
        v * (-self.friction(speed) / speed.max(f64::MIN_POSITIVE))
    }

    /// Returns the angle by which friction that follows the slip lags behind it to first order,
    /// and its part of the next order.
    #[inline(always)]
    fn lag(&self, mode: &Mode, y: &State, v: Pair) -> [f64; 2] {
        let ([stretch, _], speed) = (self.phase(mode), v.norm());
        let rate = self.slip_by(&self.forces(mode, y, self.along(v))) / (speed * speed);
        // 1/ρ over R; α'/ρ grows as R⁵/|v|²
        let slow = self.friction(speed) * self.kappa / (3.0 * stretch * speed);
        let second = slow * (-5.0 * self.v_x(y) / stretch - 2.0 * y[R] * v.dot(&rate));
        [v.perp(&rate) * slow * y[R], second]
    }

    /// Whether the slip is large, and the lag's third order within a part of what is allowed.
    fn can_follow(&self, mode: &Mode, y: &State, v: Pair, part: f64) -> bool {
        let ([stretch, _], speed) = (self.phase(mode), v.norm());
        let mu = self.friction(speed);
        let [first, second] = self.lag(mode, y, v);
        // the impulse to there is of the order of R⁵
        let error = (first * second * second).abs() * mu * y[R].powi(5);
        stretch * speed * part > 10.0 * mu * self.kappa && error < part * NEGLIGIBLE * self.tolerance
    }

    /// R, but not less than it matters.
    pub(super) fn root(&self, mode: &Mode, y: &State) -> f64 {
        y[R].max(self.least_root[usize::from(mode.restitution)])
    }

    /// Positive while a contact slides on.
    pub(super) fn slides_on(&self, mode: &Mode, y: &State, v: Pair, phi: Pair) -> f64 {
        let [stretch, c] = self.phase(mode);
        let speed = v.norm();
        let mu = self.friction(speed);
        let mut limit = -c * mu * self.v_x(y) / stretch;
        if self.fall[0] != 0.0 && speed > 0.0 {
            let rate = self.slip_by(&self.forces(mode, y, phi));
            let slope = -self.fall[1] * (mu - self.mu);
            limit += y[R] * slope * v.dot(&rate) / speed;
        }
        -v.dot(&phi) - self.kappa * mu / (3.0 * stretch) * limit
    }

    /// The mode for the next step, and the longest step that is stable.
    pub fn prepare(&self, mode: &Mode, y: &State) -> (Mode, f64) {
        if self.is_rigid {
            // until the impulse would be that of the whole impact
            let whole = 1.0 / (self.pace(mode, y)[0] * (1.0 + self.per_r));
            let lever = (1.0 + self.per_r) + self.per_r * self.per_nu[0] + self.per_nu[1];
            return (*mode, whole.min(STABLE / (self.phase(mode)[0] * self.first * lever)));
        }
        if self.is_frictionless() {
            return (Mode { grip: Grip::Follows, ..*mode }, MAX_STEP);
        }
        let v = self.slip(y);
        let (speed, phi, root) = (v.norm(), pair(y, PHI), self.root(mode, y));
        let (mu, [stretch, _]) = (self.friction(speed), self.phase(mode));
        // friction within 0.8° of the slip may follow it
        let is_aligned = -v.dot(&phi) > 0.999_9 * speed * phi.norm();
        // events that roundings at the beginning of a step have hidden
        let is_beyond = phi.norm() > mu * (1.0 + HIDDEN);
        let slides_on = || self.slides_on(mode, y, v, self.phi(mode, y, v));
        let grip = match mode.grip {
            Grip::Slides if slides_on() < -HIDDEN => Grip::Stuck,
            Grip::Stuck if is_beyond && slides_on() > 0.0 => Grip::Slides,
            Grip::Slides if is_aligned && self.can_follow(mode, y, v, 0.5) => Grip::Follows,
            Grip::Follows if !self.can_follow(mode, y, v, 1.0) => Grip::Slides,
            grip => grip,
        };
        let longest = match grip {
            Grip::Stuck => root,
            // a part of 1/ρ
            Grip::Slides => STABLE * self.kappa * mu * root / (3.0 * stretch * speed),
            _ => MAX_STEP,
        };
        (Mode { grip, ..*mode }, longest.min(MAX_STEP))
    }

    /// The mode after an event; `None` at the end.
    pub fn after(&self, mode: &Mode, event: usize) -> Option<Mode> {
        let mut next = *mode;
        match event {
            0 if mode.restitution || self.e == 0.0 => return None,
            0 => next.restitution = true,
            1 if self.is_rigid => next.grip = Grip::Stopped,
            1 => next.grip = if mode.grip == Grip::Stuck { Grip::Slides } else { Grip::Stuck },
            _ => next.up[event - 2] ^= true,
        }
        Some(next)
    }

    /// Brings the state from the form of one mode into that of another.
    pub fn change(&self, from: &Mode, to: &Mode, y: &mut State) {
        if from.grip != to.grip && !self.is_rigid {
            let phi = self.phi(from, y, self.slip(y));
            y[PHI..].copy_from_slice(phi.as_slice());
        }
        for b in (0..2).filter(|b| from.up[*b] != to.up[*b]) {
            let fallen = -y[UP[b]];
            (y[UP[b]], y[HEIGHT[b]]) = (0.0, 0.0);
            let slip = self.cloth_slips(y)[b];
            let speed = slip.norm();
            if from.up[b] && fallen > 0.0 && speed > 0.0 && self.cloth_turning {
                // the cloth stops a ball that lands with an impulse, and friction in proportion to
                // it, at most what stops the slip; per unit of the object ball's mass
                let mass = if b == 0 { 1.0 / self.per_r } else { 1.0 };
                let stops = mass * speed / (1.0 + self.per_nu[b]);
                let impulse = (self.mu_cloth[b] * mass * fallen).min(stops);
                let cloth = pair(y, CLOTH[b]) - impulse / speed * slip;
                y[CLOTH[b]..CLOTH[b] + 2].copy_from_slice(cloth.as_slice());
            }
        }
    }
}
