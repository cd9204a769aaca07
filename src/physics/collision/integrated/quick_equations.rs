//! The equations of [`super::compliant`] without weight and without friction of the cloth on the cue ball, in as few
//! operations as serve a fit, for plain numbers and for several side by side.
//!
//! All velocities are in units of the closing speed. The variable is s, the state R = F^(1/3), P = ∫F dt, J_y, J_z, the cloth's
//! impulse O on the object ball, U_z, V_z, and what is carried of the friction: f while the spring's end holds (f/R on the way
//! back), its direction while it slides. Where the friction turns towards the slip faster than all else, it follows the slip
//! and lags behind its direction α by θ = α'/ρ − (α'/ρ)'/ρ, the Taylor series of θ' = α' − ρθ, where ρ is the rate at which it
//! turns and ' is d/ds.

use super::lanes::Real;

/// The state.
pub(super) mod at {
    pub const ROOT: usize = 0;
    pub const NORMAL: usize = 1;
    pub const J_Y: usize = 2;
    pub const J_Z: usize = 3;
    pub const CLOTH: usize = 4;
    pub const U_Z: usize = 5;
    pub const V_Z: usize = 6;
    pub const CARRIED: usize = 7;
    pub const COUNT: usize = 9;
}
use at::{CARRIED, CLOTH, COUNT, J_Y, J_Z, NORMAL, ROOT, U_Z, V_Z};

pub(super) type State<T> = [T; COUNT];
type Pair<T> = [T; 2];

/// From this rate on, per s, friction follows its slip; from half of it on no longer.
pub(super) const FOLLOWS: f64 = 150.0;

/// Friction that is carried follows its slip again if the cosine of the angle between them is larger than this.
const ALIGNED: f64 = 0.9999;

/// What is left of the impulse below this R, its fifth power, is so small that friction may turn there as at this R.
pub(super) const LEAST_ROOT: f64 = 0.03;

/// A spring that begins to hold at its limit holds, whatever the roundings.
const HOLDS: f64 = 1.0 + 1e-13;

/// How the contact between the balls grips.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grip {
    /// The spring's end holds.
    Springs,
    /// It slides, and its direction is carried.
    Yields,
    /// It slides, and its direction follows the slip.
    Follows,
}

/// What is watched; each is positive until it happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    /// Compression or restitution ends.
    End,
    Grip,
    /// A ball leaves the cloth, or comes back to it.
    Cue,
    Object,
}

impl Event {
    pub const ALL: [Self; 4] = [Self::End, Self::Grip, Self::Cue, Self::Object];
}

/// Which equations hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mode {
    pub grip: Grip,
    pub is_compression: bool,
    /// Whether each ball is on the cloth.
    pub cue_on: bool,
    pub object_on: bool,
}

/// One shot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shot<T> {
    /// v_y0/k and v_z0/k.
    pub slip: Pair<T>,
    /// a, b and c·k of the friction a + b exp(−c v).
    pub mu: T,
    pub falls: Option<(T, T)>,
    pub mu_s: T,
    pub e: T,
    pub kappa: T,
    pub per_nu: f64,
    /// 1/r, ν/(rν_c), 2β_y, sin δ.
    pub per_r: f64,
    pub share: f64,
    pub lever_y: f64,
    pub tilt: f64,
}

#[inline(always)]
fn length<T: Real>(v: Pair<T>) -> T {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

#[inline(always)]
pub(super) fn unit<T: Real>(v: Pair<T>) -> Pair<T> {
    let per_length = T::from(1.0) / length(v);
    scaled(v, per_length)
}

/// The direction of a friction against a slip.
#[inline(always)]
fn against<T: Real>(slip: Pair<T>) -> Pair<T> {
    scaled(unit(slip), T::from(-1.0))
}

/// Written out, since what `map` makes of it is not inlined.
#[inline(always)]
fn scaled<T: Real>(v: Pair<T>, by: T) -> Pair<T> {
    [v[0] * by, v[1] * by]
}

impl<T: Real> Shot<T> {
    /// 1 in compression, e in restitution: how much longer time is there.
    #[inline(always)]
    fn stretch(&self, mode: &Mode) -> T {
        if mode.is_compression { T::from(1.0) } else { self.e }
    }

    #[inline(always)]
    pub(super) fn slip(&self, y: &State<T>) -> Pair<T> {
        [
            self.slip[0] + y[J_Y] * self.lever_y,
            self.slip[1] + y[V_Z] - y[U_Z] + (y[J_Z] * (1.0 + self.share) - y[CLOTH]) * self.per_nu,
        ]
    }

    /// v_x, from −1 on.
    #[inline(always)]
    fn v_x(&self, y: &State<T>) -> T {
        y[NORMAL] * (1.0 + self.per_r) + y[CLOTH] - 1.0
    }

    /// dR/ds.
    #[inline(always)]
    fn root_rate(&self, mode: &Mode, y: &State<T>) -> T {
        if mode.is_compression { -self.v_x(y) } else { -self.v_x(y) / self.e }
    }

    /// μ at a slip, and dμ/d|v|.
    #[inline(always)]
    fn mu(&self, slip: Pair<T>) -> (T, T) {
        match self.falls {
            None => (self.mu, T::from(0.0)),
            Some((b, c)) => {
                let falling = (-c * length(slip)).exp() * b;
                (self.mu + falling, -c * falling)
            }
        }
    }

    /// How fast the direction of a sliding friction turns across a unit of slip: 3 stretch/κμR.
    #[inline(always)]
    fn turning(&self, mode: &Mode, y: &State<T>, mu: T) -> T {
        let root = if y[ROOT].first() > LEAST_ROOT { y[ROOT] } else { T::from(LEAST_ROOT) };
        self.stretch(mode) * 3.0 / (self.kappa * mu * root)
    }

    /// Whether the direction that is carried is that of the slip, or nearly.
    pub(super) fn is_aligned(&self, y: &State<T>) -> bool {
        let (slip, carried) = (self.slip(y), [y[CARRIED], y[CARRIED + 1]]);
        let along = -(slip[0] * carried[0] + slip[1] * carried[1]).first();
        along > ALIGNED * (length(slip) * length(carried)).first()
    }

    /// The rate ρ at which it turns.
    pub(super) fn turning_rate(&self, mode: &Mode, y: &State<T>) -> T {
        let slip = self.slip(y);
        self.turning(mode, y, self.mu(slip).0) * length(slip)
    }

    /// d(slip)/ds for forces f on the object ball, what the cloth adds to its velocity, and pace = dt/ds.
    #[inline(always)]
    fn slip_rate(&self, mode: &Mode, f: Pair<T>, force: T, pace: T) -> Pair<T> {
        let (rising, cloth) = self.vertical(mode, f[1], force);
        let lifts = f64::from(!mode.object_on) + f64::from(!mode.cue_on) * self.per_r;
        [
            pace * f[0] * self.lever_y,
            pace * (rising * lifts + (f[1] * (1.0 + self.share) - cloth) * self.per_nu),
        ]
    }

    /// The vertical force on the object ball, and what the cloth's friction takes from its motion along x.
    #[inline(always)]
    fn vertical(&self, mode: &Mode, f_z: T, force: T) -> (T, T) {
        let rising = f_z + force * self.tilt;
        (rising, if mode.object_on { rising * self.mu_s } else { T::from(0.0) })
    }

    /// The friction on the object ball.
    #[inline(always)]
    fn friction(&self, mode: &Mode, y: &State<T>, slip: Pair<T>) -> Pair<T> {
        let root = y[ROOT];
        let force = root * root * root;
        let carried = [y[CARRIED], y[CARRIED + 1]];
        match mode.grip {
            Grip::Springs if mode.is_compression => carried,
            Grip::Springs => scaled(carried, root),
            Grip::Yields => {
                let most = self.mu(slip).0 * force;
                scaled(carried, most)
            }
            Grip::Follows => {
                let mu = self.mu(slip).0;
                let stretch = self.stretch(mode);
                let per_speed = T::from(1.0) / length(slip);
                let f = scaled(slip, -mu * force * per_speed);
                // α' = (v × v')/|v|², and (α'/ρ)' from α'/ρ ∝ R⁵/|v|²
                let rate = self.slip_rate(mode, f, force, root * 2.0 * stretch);
                let per_square = per_speed * per_speed;
                let turned = (slip[0] * rate[1] - slip[1] * rate[0]) * per_square;
                let faster = (slip[0] * rate[0] + slip[1] * rate[1]) * per_square;
                // R/ρ, the same at every R
                let slow = mu * self.kappa * per_speed / (stretch * 3.0);
                let growth = self.root_rate(mode, y) * 5.0 - root * faster * 2.0;
                let lag = turned * slow * root * (T::from(1.0) - slow * growth);
                [f[0] + lag * f[1], f[1] - lag * f[0]]
            }
        }
    }

    #[inline(always)]
    pub(super) fn rates(&self, mode: &Mode, y: &State<T>) -> State<T> {
        let (slip, stretch, root) = (self.slip(y), self.stretch(mode), y[ROOT]);
        let force = root * root * root;
        let pace = if mode.is_compression { root * 2.0 } else { root * 2.0 * stretch };
        let f = self.friction(mode, y, slip);
        let (rising, cloth) = self.vertical(mode, f[1], force);
        let zero = T::from(0.0);
        let carried = match mode.grip {
            // k_t dt = 3R²/κ ds, of f/R on the way back
            Grip::Springs => {
                let factor = root * if mode.is_compression { root } else { stretch } * -3.0 / self.kappa;
                scaled(slip, factor)
            }
            Grip::Yields => {
                // across itself, so that its length stays 1
                let w = [y[CARRIED], y[CARRIED + 1]];
                let across = slip[1] * w[0] - slip[0] * w[1];
                let turned = self.turning(mode, y, self.mu(slip).0) * across;
                [turned * w[1], -turned * w[0]]
            }
            Grip::Follows => [zero; 2],
        };
        [
            self.root_rate(mode, y),
            pace * force,
            pace * f[0],
            pace * f[1],
            pace * cloth,
            if mode.cue_on { zero } else { -pace * rising * self.per_r },
            if mode.object_on { zero } else { pace * rising },
            carried[0],
            carried[1],
        ]
    }

    /// The functions of all events, in the order of [`Event::ALL`].
    pub(super) fn events(&self, mode: &Mode, y: &State<T>) -> [T; 4] {
        let slip = self.slip(y);
        let force = y[ROOT] * y[ROOT] * y[ROOT];
        let f = self.friction(mode, y, slip);
        let rising = self.vertical(mode, f[1], force).0;
        let grip = match mode.grip {
            Grip::Springs => {
                let most = self.mu(slip).0 * force;
                most * most * HOLDS - f[0] * f[0] - f[1] * f[1]
            }
            Grip::Yields => self.end_slides(mode, y, slip),
            Grip::Follows => T::from(1.0),
        };
        [
            if mode.is_compression { -self.v_x(y) } else { y[ROOT] },
            grip,
            if mode.cue_on { rising } else { y[U_Z] },
            if mode.object_on { -rising } else { y[V_Z] },
        ]
    }

    /// Positive while the spring's end slides: −v·w less κ/(3/2 R) d(μF)/dt, of which the spring itself loses a third on the way
    /// back.
    fn end_slides(&self, mode: &Mode, y: &State<T>, slip: Pair<T>) -> T {
        let (mu, slope) = self.mu(slip);
        let stretch = self.stretch(mode);
        let (root, w) = (y[ROOT], unit([y[CARRIED], y[CARRIED + 1]]));
        // dF/dt = −(3/2)R v_x/e²
        let rising = -self.v_x(y) / (stretch * stretch);
        let kept = if mode.is_compression { 1.0 } else { 2.0 / 3.0 };
        let mut limit = mu * rising * self.kappa * kept;
        if self.falls.is_some() {
            let force = root * root * root;
            let f = scaled(w, mu * force);
            let rate = self.slip_rate(mode, f, force, T::from(1.0));
            let slower = (slip[0] * rate[0] + slip[1] * rate[1]) / length(slip);
            limit += slope * slower * root * root * self.kappa * (1.0 / 1.5);
        }
        -(slip[0] * w[0] + slip[1] * w[1]) - limit
    }

    /// At first contact: it slides if |v| > μκ.
    pub(super) fn start(&self) -> (Mode, State<T>) {
        let slip = [self.slip[0].first(), self.slip[1].first()];
        let (mu, kappa) = (self.mu(self.slip).0.first(), self.kappa.first());
        let slides = slip[0].hypot(slip[1]) > mu * kappa;
        let zero = T::from(0.0);
        // of the normal force
        let vertical = if slides { mu * slip[1] / slip[0].hypot(slip[1]) } else { slip[1] / kappa };
        let pressed = vertical > self.tilt;
        let mode = Mode {
            grip: if slides { Grip::Yields } else { Grip::Springs },
            is_compression: true,
            cue_on: !pressed,
            object_on: pressed,
        };
        let mut y = [zero; COUNT];
        if slides {
            [y[CARRIED], y[CARRIED + 1]] = against(self.slip);
        }
        (mode, y)
    }

    /// Puts what is carried in the form of the next mode.
    pub(super) fn change(&self, from: &Mode, to: &Mode, y: &mut State<T>) {
        let carry = |y: &mut State<T>, pair: Pair<T>| [y[CARRIED], y[CARRIED + 1]] = pair;
        if from.is_compression && !to.is_compression && from.grip == Grip::Springs {
            let root = y[ROOT];
            carry(y, [y[CARRIED] / root, y[CARRIED + 1] / root]);
        }
        let friction = self.friction(from, y, self.slip(y));
        match (from.grip, to.grip) {
            // nothing is stretched yet
            (Grip::Springs, Grip::Yields) if y[ROOT].first() == 0.0 => carry(y, against(self.slip(y))),
            (Grip::Springs | Grip::Follows, Grip::Yields) => carry(y, unit(friction)),
            (Grip::Yields, Grip::Springs) => {
                let per = if to.is_compression { T::from(1.0) } else { T::from(1.0) / y[ROOT] };
                carry(y, scaled(friction, per));
            }
            _ => {}
        }
        if to.cue_on && !from.cue_on {
            y[U_Z] = T::from(0.0);
        }
        if to.object_on && !from.object_on {
            y[V_Z] = T::from(0.0);
        }
    }
}
