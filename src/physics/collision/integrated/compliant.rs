//! A contact that gives way along the surface and springs back (Mindlin 1949; Maw, Barber & Fawcett 1976).
//!
//! The normal force is Hertz's, F = x^(3/2) at an approach x in compression, and on the way back F = x_m^(3/2) u^(3/2),
//! u = (x − (1 − e²)x_m)/(e²x_m): continuous, with exactly the energetic e. The tangential stiffness follows the radius of the
//! contact, k_t = (3/2)F^(1/3)/κ, κ = (2 − σ)/2(1 − σ) with Poisson's ratio σ. With v the slip and f the friction on the
//! object ball (Walton & Braun 1986; Thornton, Cummins & Cleary 2013):
//!
//! ```text
//! stuck, F rising     df/dt = −k_t v                       new area comes into contact free of stress
//! stuck, F falling    df/dt = −k_t v + f (dF/dt)/3F        f = −k_t ξ: no energy is made at constant ξ
//! while |f| ≤ μF; else the spring's end slides:
//!                     f = μF w, |w| = 1,  dw/dt = −k_t (v − (v·w)w)/(μF)
//! it sticks again at  −k_t v·w ≤ d(μF)/dt, in restitution less the μ(dF/dt)/3 that the spring itself loses
//! ```
//!
//! Units are those of [`super::contact`], and so is the variable, but for restitution: with R = F^(1/3), dt = 2eR ds there,
//! dR/ds = −v_x/e and F dt = 2eR⁴ ds. The state carries f while the contact is stuck in compression, f/R in restitution, and w
//! while it slides.
//!
//! The friction turns towards the slip at the rate ρ = k_t|v|/(μF). Where that is fast against all else, w follows the slip
//! ([`Dynamics::lag`]): it lags behind it by the angle dα/dt/ρ, α the slip's direction, and so on in powers of 1/ρ.

use super::Impulses;
use super::contact::{AT_REST, CUE_HEIGHT, IMPULSE, OBJECT_HEIGHT, ROOT, fastest, land, vertical};
use super::dynamics::{Dynamics, Forces, Give, Grip, Grips, Pair, Site, Slips, at, norm, unit};
use super::phase::{Model, Phase, TOUCH, tolerance_of_restitution, walk};
use super::solver::{GaveUp, Integrator};
use super::starts::turn;
use crate::physics::collision::Regime;

/// Places behind those of [`super::contact`]: what the state carries of the friction.
const GIVE_Y: usize = at::COUNT + 4;
const GIVE_Z: usize = at::COUNT + 5;
const STATE: usize = at::COUNT + 6;

/// Friction can follow a slip of more than this times κμ: the third power of the lag is then below 1e-4.
const FOLLOWS: f64 = 50.0;

/// Of the tolerance, what the lag may be wrong by in all.
const OF_TOLERANCE: f64 = 0.1;

/// Of the way to where the force or the slip would vanish, for a difference.
const PROBE: f64 = 1e-4;

/// So small a force turns nothing.
const NO_FORCE: f64 = 1e-200;

/// A friction that follows its slip again is within this angle of where it then is, in radians, or the impact goes on as before.
const ALIGNED: f64 = 1e-3;

pub(in crate::physics::collision) fn impulses(
    dynamics: &Dynamics,
    e: f64,
    tolerance: f64,
) -> Result<(Impulses, Regime), GaveUp> {
    let mut integrator = Integrator::new(tolerance).with_more_steps(dynamics.shakes());
    let mut phase = Phase::compression(dynamics);
    let mut y = [0.0; STATE];
    let v = dynamics.slip;
    let mu = dynamics.friction.mu(dynamics.k * norm(v));
    // it slides at first contact if |v| > μκ|v_x|
    if norm(v) <= mu * dynamics.kappa {
        phase.grips[Site::Balls] = Grip::Springs;
        phase.held_once = norm(v) > 0.0;
        // not stretched yet, but by so much, to tell which ball it will lift
        [y[GIVE_Y], y[GIVE_Z]] = v.map(|v| -TOUCH * v);
    } else if norm(v) <= FOLLOWS * mu * dynamics.kappa {
        phase.grips[Site::Balls] = Grip::Yields;
        [y[GIVE_Y], y[GIVE_Z]] = unit(v).map(|v| -v);
    }
    // what is wrong below R₀ enters the impulses as R₀¹⁰ at first and as R₀⁵ at last
    let model = Giving { dynamics, tolerance, least_root: tolerance.powf(0.1) };
    let mut q = walk(&mut integrator, &model, &mut phase, &mut y)?;
    if e > 0.0 {
        let model = Giving { least_root: tolerance.powf(0.2), ..model };
        integrator.set_tolerance(tolerance_of_restitution(tolerance, e));
        y[IMPULSE] = 0.0;
        if phase.grips[Site::Balls] == Grip::Springs {
            let root = y[ROOT];
            y[GIVE_Y] /= root;
            y[GIVE_Z] /= root;
        }
        phase = phase.restitution(e, q, &y);
        q = walk(&mut integrator, &model, &mut phase, &mut y)?;
    }
    Ok((dynamics.impulses(q, &y), phase.regime()))
}

#[derive(Clone, Copy)]
struct Giving<'a> {
    dynamics: &'a Dynamics,
    tolerance: f64,
    /// R₀: below, friction turns as at R₀.
    least_root: f64,
}

impl Giving<'_> {
    /// dw/ds per slip across the friction: 3e/(κμR).
    fn turning(&self, phase: &Phase, y: &[f64; STATE], slip: Pair) -> f64 {
        let mu = self.dynamics.friction.mu(self.dynamics.k * norm(slip));
        3.0 * phase.stretch / (self.dynamics.kappa * mu * y[ROOT].max(self.least_root))
    }
}

impl Model<STATE> for Giving<'_> {
    fn impulse(&self, phase: &Phase, _: f64, y: &[f64; STATE]) -> f64 {
        phase.q + phase.stretch * y[IMPULSE]
    }

    /// F = R³.
    fn normal(&self, _: &Phase, y: &[f64; STATE]) -> f64 {
        y[ROOT].powi(3)
    }

    /// dt = 2R ds, e of it in restitution.
    fn pace(&self, phase: &Phase, y: &[f64; STATE]) -> f64 {
        2.0 * y[ROOT] * phase.stretch
    }

    fn fastest(&self, phase: &Phase, y: &[f64; STATE], step: f64) -> [f64; STATE] {
        fastest(phase, y, step)
    }

    fn own_rates(&self, phase: &Phase, y: &[f64; STATE], slips: &Slips, v_x: f64, rates: &mut [f64; STATE]) {
        let (pace, root) = (self.pace(phase, y), y[ROOT]);
        rates[IMPULSE] = 2.0 * root.powi(4);
        rates[ROOT] = -v_x;
        rates[CUE_HEIGHT] = y[at::U_Z] * pace;
        rates[OBJECT_HEIGHT] = y[at::V_Z] * pace;
        let v = slips.0[Site::Balls as usize];
        let kappa = self.dynamics.kappa;
        [rates[GIVE_Y], rates[GIVE_Z]] = match phase.grips[Site::Balls] {
            // k_t dt = 3R²/κ ds
            Grip::Springs if phase.is_compression() => v.map(|v| -3.0 * root * root / kappa * v),
            // of f/R
            Grip::Springs => v.map(|v| -3.0 * phase.stretch * root / kappa * v),
            Grip::Yields => {
                let w = unit([y[GIVE_Y], y[GIVE_Z]]);
                let (along, turning) = (v[0] * w[0] + v[1] * w[1], self.turning(phase, y, v));
                [0, 1].map(|i| -turning * (v[i] - along * w[i]))
            }
            _ => [0.0; 2],
        };
    }

    fn give(&self, phase: &Phase, y: &[f64; STATE], v_x: f64) -> Give {
        let (root, carried) = (y[ROOT], [y[GIVE_Y], y[GIVE_Z]]);
        let friction = match phase.grips[Site::Balls] {
            Grip::Springs if !phase.is_compression() => carried.map(|f| f * root),
            _ => carried,
        };
        Give { friction, rising: -1.5 * root * v_x / phase.stretch, is_compression: phase.is_compression() }
    }

    /// Steps that turn the friction by more are unstable.
    fn longest_turn(&self, phase: &Phase, y: &[f64; STATE], slips: &Slips) -> f64 {
        let v = slips.0[Site::Balls as usize];
        // where it slides along a straight line nothing turns
        let straight = v[0] * y[GIVE_Z] == v[1] * y[GIVE_Y];
        if phase.grips[Site::Balls] != Grip::Yields || straight {
            return f64::INFINITY;
        }
        1.0 / (self.turning(phase, y, v) * norm(v))
    }

    fn grip_events(
        &self,
        phase: &Phase,
        y: &[f64; STATE],
        slips: &Slips,
        forces: &Forces,
        give: &Give,
    ) -> Option<[f64; 2]> {
        let lag_allowed = OF_TOLERANCE * self.tolerance;
        let slides = || self.dynamics.end_slides(&phase.grips, slips, forces, give);
        Some(match phase.grips[Site::Balls] {
            Grip::Springs => [self.dynamics.spring_holds(slips, forces, give), f64::NAN],
            Grip::Yields if phase.is_compression() => [slides(), f64::NAN],
            Grip::Yields => {
                let lag = self.dynamics.lag_error(&phase.grips, slips, y[ROOT].powi(3), give);
                [slides(), lag - 0.5 * lag_allowed]
            }
            _ => {
                let lag = self.dynamics.lag_error(&phase.grips, slips, y[ROOT].powi(3), give);
                [lag_allowed - lag, f64::NAN]
            }
        })
    }

    fn change_grip(&self, phase: &mut Phase, q: f64, y: &mut [f64; STATE], again: bool) {
        let slips = self.dynamics.slips(q, y);
        let give = self.give(phase, y, phase.v_x(q, y));
        // where the balls just touch there is a direction already
        let forces = self.dynamics.forces(&phase.grips, &slips, self.normal(phase, y).max(TOUCH), &give);
        let i = Site::Balls as usize;
        let direction = unit(forces.friction[i]);
        match phase.grips[Site::Balls] {
            Grip::Yields if again => {
                let grips = phase.grips_with(Grip::Slides);
                let following =
                    self.dynamics.forces(&grips, &slips, self.normal(phase, y), &give).friction[i];
                let along = unit(following);
                if (along[0] * direction[1] - along[1] * direction[0]).abs() < ALIGNED {
                    phase.grips = grips;
                }
            }
            Grip::Yields => {
                let root = if phase.is_compression() { 1.0 } else { y[ROOT] };
                // just below its limit, or rounding would have it beyond that from the beginning, and slide never again
                [y[GIVE_Y], y[GIVE_Z]] = forces.friction[i].map(|f| f / root);
                phase.grips[Site::Balls] = Grip::Springs;
                phase.held_once = true;
            }
            _ => {
                [y[GIVE_Y], y[GIVE_Z]] = direction;
                phase.grips[Site::Balls] = Grip::Yields;
            }
        }
    }

    fn restitution_left(&self, _: &Phase, y: &[f64; STATE]) -> f64 {
        y[ROOT]
    }

    /// Without weight a ball comes down where it no longer rises.
    fn above_cloth(&self, y: &[f64; STATE], site: Site) -> f64 {
        let (up, height) = vertical(site);
        match () {
            () if self.dynamics.gravity == 0.0 => y[up] + AT_REST,
            () if y[up] >= -AT_REST => 1.0,
            () => y[height],
        }
    }

    fn land(&self, q: f64, y: &mut [f64; STATE], site: Site) {
        land(self.dynamics, q, y, site);
    }
}

/// How a friction that follows its slip lags behind it.
#[derive(Clone, Copy)]
struct Lag {
    angle: f64,
    /// What the next order would change.
    error: f64,
}

impl Dynamics {
    /// Positive while the spring's end holds. In compression per normal force, so that it tells where the balls just touch, too:
    /// there f = −Fv/κ.
    fn spring_holds(&self, slips: &Slips, forces: &Forces, give: &Give) -> f64 {
        let i = Site::Balls as usize;
        let (most, friction, normal) = (forces.most[i], norm(forces.friction[i]), forces.normal[i]);
        if !give.is_compression {
            return most - friction;
        }
        if normal > 0.0 {
            return (most - friction) / normal;
        }
        let slip = norm(slips.0[i]);
        self.friction.mu(self.k * slip) - slip / self.kappa
    }

    /// Positive while the spring's end slides, in units of the slip.
    fn end_slides(&self, grips: &Grips, slips: &Slips, forces: &Forces, give: &Give) -> f64 {
        let i = Site::Balls as usize;
        let (v, normal) = (slips.0[i], forces.normal[i]);
        // where the balls just touch there is no friction yet, but this
        let w = unit(give.friction);
        let speed = norm(v);
        let mu = self.friction.mu(self.k * speed);
        let root = normal.cbrt();
        // κ/(3/2 R) d(μF)/dt, (2/3)μ dF/dt in restitution
        let kept = if give.is_compression { 1.0 } else { 2.0 / 3.0 };
        let mut limit = kept * mu * give.rising;
        if self.friction.falls() && speed > 0.0 {
            let rate = self.slip_rates(grips, forces)[i];
            let slower = (v[0] * rate[0] + v[1] * rate[1]) / speed;
            limit += self.friction.slope(self.k * speed) * self.k * slower * normal;
        }
        let limit = if root > 0.0 { limit * self.kappa / (1.5 * root) } else { self.kappa * mu };
        -(v[0] * w[0] + v[1] * w[1]) - limit
    }

    /// Turns the friction between the balls back by its lag.
    pub(in crate::physics::collision) fn lag_behind(
        &self,
        grips: &Grips,
        slips: &Slips,
        normal: f64,
        give: &Give,
        along: &mut [Pair; 3],
    ) {
        let i = Site::Balls as usize;
        along[i] = turn(along[i], self.lag(grips, slips, normal, give, along).angle);
    }

    /// What is wrong with impulses by the lag's next order; more than any tolerance where it cannot follow.
    fn lag_error(&self, grips: &Grips, slips: &Slips, normal: f64, give: &Give) -> f64 {
        let speed = norm(slips.0[Site::Balls as usize]);
        let mu = self.friction.mu(self.k * speed);
        if speed < FOLLOWS * mu * self.kappa {
            return 1.0;
        }
        let along = slips.0.map(|slip| unit(slip).map(|s| -s));
        let grips = { Grips([Grip::Slides, grips[Site::CueOnCloth], grips[Site::ObjectOnCloth]]) };
        let lag = self.lag(&grips, slips, normal, give, &along);
        // ∫ F dt to there is of the order of R⁵
        lag.error * mu * normal.powf(5.0 / 3.0).min(1.0)
    }

    /// To second order in 1/ρ.
    fn lag(&self, grips: &Grips, slips: &Slips, normal: f64, give: &Give, along: &[Pair; 3]) -> Lag {
        let i = Site::Balls as usize;
        if normal < NO_FORCE || norm(slips.0[i]) == 0.0 {
            return Lag { angle: 0.0, error: 0.0 };
        }
        // dα/dt for a direction of the friction
        let turns = |slips: &Slips, normal: f64, along: &[Pair; 3]| {
            let rates = self.slip_rates(grips, &self.forces_along(grips, slips, normal, along));
            let (v, rate) = (slips.0[i], rates[i]);
            ((v[0] * rate[1] - v[1] * rate[0]) / (v[0] * v[0] + v[1] * v[1]), rates)
        };
        // ρ = (3/2)|v|/(κμF^(2/3))
        let fast = |slips: &Slips, normal: f64| {
            let speed = norm(slips.0[i]);
            1.5 * speed / (self.kappa * self.friction.mu(self.k * speed) * normal.cbrt().powi(2))
        };
        let (turning, rates) = turns(slips, normal, along);
        let rho = fast(slips, normal);
        let first = -turning / rho;
        if first == 0.0 {
            return Lag { angle: 0.0, error: 0.0 };
        }
        // its own rate, by a difference along the way
        let speed = norm(slips.0[i]);
        let fastest = (give.rising / normal).abs().max(norm(rates[i]) / speed);
        let dt = PROBE / fastest;
        let mut ahead = *slips;
        for (slip, rate) in ahead.0.iter_mut().zip(&rates) {
            *slip = [0, 1].map(|j| slip[j] + dt * rate[j]);
        }
        let mut along_ahead = *along;
        along_ahead[i] = unit(ahead.0[i]).map(|s| -s);
        let normal_ahead = normal + dt * give.rising;
        let later = -turns(&ahead, normal_ahead, &along_ahead).0 / fast(&ahead, normal_ahead);
        let mut lagging = *along;
        lagging[i] = turn(lagging[i], first);
        let angle = -(turns(slips, normal, &lagging).0 + (later - first) / dt) / rho;
        let change = angle - first;
        Lag { angle, error: change * change / first.abs() }
    }
}
