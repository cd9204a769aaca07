//! What a shot's inputs truly were, as far as all its measurements tell: errors in variables.
//!
//! The state before the impact is measured with errors, as are the observations. With ξ the true inputs, x and y what was
//! measured and Σ the covariance of their errors, a shot's part of χ² is
//!
//! min over ξ of (ξ − x, f(ξ) − y) Σ⁻¹ (ξ − x, f(ξ) − y)ᵀ
//!
//! so that a fit minimises over the parameters and every shot's own ξ (orthogonal distance regression). The minimum over ξ
//! is found by Gauss and Newton's method, a step that does not lower the sum being halved. At ξ̂, with G = ∂f/∂ξ there,
//! the minimum is dᵀC⁻¹d with d = f(ξ̂) + G(x − ξ̂) − y and C = [G, −1] Σ [G, −1]ᵀ, and its derivative by the parameters
//! that of d at fixed ξ̂ and G. Taken at x instead of ξ̂, d and ∂f/∂θ would err together, and bias the fit.
//!
//! f has kinks ([`super::kinks`]), and the sum may have a minimum on either side of one, or at it. All are looked for that
//! are in reach, and the least is taken: what is left depends on the parameters only, and follows them without kinks.
//!
//! - Fuller, W. A. (1987). Measurement Error Models. Wiley. Section 3.2.
//! - Boggs, P. T., Byrd, R. H. and Schnabel, R. B. (1987). A stable and efficient algorithm for nonlinear orthogonal
//!   distance regression. SIAM J. Sci. Stat. Comput. 8, 1052–1078.

use super::kinks::{Kink, Kinks};
use super::prediction::{INPUTS, Plan, Prediction};
use super::shot_errors::{Errors, OfShot, Point, Units};
use crate::physics::ball::Ball;
use crate::physics::collision::{Coefficients, Model};

/// Inputs rest when a step is shorter than this, in standard errors: it moves parameters by a hundredth of it in theirs.
const AT_REST: f64 = 1e-6;

/// Those of collisions that are integrated rest sooner: their tolerance makes the sum a little rough.
const ROUGH_AT_REST: f64 = 1e-4;

/// Steps for one shot; those that are left are taken when the parameters have moved.
const MAX_STEPS: usize = 30;

/// A step is halved at most so often.
const MAX_HALVINGS: usize = 12;

/// The other sides of kinks are looked at anew from a lower minimum, at most so often.
const MAX_CROSSINGS: usize = 3;

/// The spin's place among the inputs, and where else it is looked for, in standard errors.
const SPIN: usize = 3;
const ELSEWHERE: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];

/// Spins that err by less than this part of the natural roll's, as those that markers show, leave one minimum.
const LARGE: f64 = 0.01;

/// The kinks of a prediction, in the order of [`super::prediction::Contact::side`].
const TOPSPIN: usize = 0;
const STICKS: usize = 1;

/// Inputs on both sides of a kink are so near to each other, in standard errors, that its slopes are those at the kink;
const WIDTH: f64 = 1e-9;
/// those on it are looked for in steps that grow by this factor up to so far away.
const WIDER: f64 = 8.0;
const FARTHEST: f64 = 2.0;

/// Slopes that differ by less than this part of them across a kink differ by their curvature.
const NO_KINK: f64 = 1e-6;

/// The rough friction at which sticking sets in errs by less than this factor,
const ABOUT: f64 = 1.25;
/// and where it sets in is passed by at most this part of the reach.
const COARSE: f64 = 0.02;

/// A sum that rises by this part of itself, or of 1, is rounding.
const ROUNDING: f64 = 1e-13;

/// Where a sum falls from both sides of a kink.
enum Leads {
    Near,
    Far,
    /// To the kink.
    Onto,
}

/// Inputs that were estimated.
#[derive(Clone, Copy, Debug, Default)]
pub struct Estimated {
    /// By how much they differ from what was measured, in units of their errors.
    pub t: Units,
    /// The kinks that the inputs are best at.
    pub kinks: Kinks,
}

/// Where the inputs of a shot are looked for besides where they were: a spin that the motion told may err so much that the sum
/// has several minima. `rolling`: the spin of natural roll, rad/s.
fn elsewhere(plan: &Plan, rolling: f64) -> impl Iterator<Item = Units> {
    let errs = move |k: usize| {
        plan.together().is_some_and(|together| together.factor.column(k).amax() > LARGE * rolling)
    };
    let spins = (SPIN..INPUTS).filter(move |k| errs(*k));
    spins.flat_map(|k| ELSEWHERE.map(|by| Units::from_fn(|i, _| if i == k { by } else { 0.0 })))
}

/// The inputs that agree best with a shot's measurements at some coefficients, from those of `start`, and what is predicted
/// of them: the least minimum if `everywhere`, else that which is near. `shared` adds to the differences what the errors do
/// that all shots share.
pub fn estimate(
    errors: &Errors,
    (model, coefficients): (&Model, &Coefficients),
    (start, everywhere): (&Units, bool),
    shared: impl Fn(&Prediction, usize) -> f64,
) -> Option<(Estimated, Prediction)> {
    let shot = OfShot { errors, model, coefficients, shared };
    let first = shot.at(*start).or_else(|| shot.at(Units::zeros()))?;
    let mut best = shot.settled(first)?;
    if everywhere {
        let rolling = best.0.prediction.speed / model.ball.radius;
        let is_lower = |found: &(Point, Kinks), best: &(Point, Kinks)| {
            found.0.chi2 < best.0.chi2 - ROUNDING * (1.0 + best.0.chi2)
        };
        for found in elsewhere(errors.plan, rolling).filter_map(|t| shot.settled(shot.at(t)?)) {
            if is_lower(&found, &best) {
                best = found;
            }
        }
        for _ in 0..MAX_CROSSINGS {
            let beyond = shot.beyond_kinks(&best.0, &best.1).into_iter().flatten();
            let found = beyond.filter_map(|point| shot.settled(point));
            let least = found.min_by(|a, b| a.0.chi2.total_cmp(&b.0.chi2));
            let Some(lower) = least.filter(|found| is_lower(found, &best)) else { break };
            best = lower;
        }
    }
    let (Point { t, prediction, .. }, kinks) = best;
    Some((Estimated { t, kinks }, prediction))
}

impl<S: Fn(&Prediction, usize) -> f64> OfShot<'_, S> {
    /// The minimum near some inputs, and the kinks that it is at.
    fn settled(&self, mut now: Point) -> Option<(Point, Kinks)> {
        let mut kinks = Kinks::default();
        let at_rest = if self.errors.plan.is_direct() { ROUGH_AT_REST } else { AT_REST };
        for _ in 0..MAX_STEPS {
            let step = self.step(&now, &kinks)?;
            if step.amax() < at_rest {
                let Some((released, rest)) = self.released(&now, &kinks) else { break };
                (now, kinks) = (released, rest);
                continue;
            }
            let limit = now.chi2 + ROUNDING * (1.0 + now.chi2);
            let mut part = 1.0;
            let mut blocked = None;
            let next = (0..MAX_HALVINGS).find_map(|_| {
                let tried = self.at(now.t + part * step);
                part *= 0.5;
                let (tried, anew) = self.on_kinks(tried?, &kinks)?;
                if tried.chi2 <= limit {
                    return Some((tried, anew));
                }
                // on the way the sum falls up to a kink
                let at_kink = blocked.is_none().then(|| self.at_new_kink(&now, &tried, &kinks)).flatten();
                blocked = blocked.take().or(at_kink.filter(|(point, _)| point.chi2 <= limit));
                None
            });
            let lower =
                |(point, _): &(Point, Kinks)| next.as_ref().is_none_or(|next| point.chi2 < next.0.chi2);
            match blocked.filter(lower).or(next) {
                Some(found) => (now, kinks) = found,
                None => break,
            }
        }
        Some((now, kinks))
    }

    /// The kink between two neighbouring inputs on its two sides, towards the second; `None` where the slopes are the same.
    fn kink(&self, which: usize, near: &Point, far: &Point) -> Option<Kink> {
        let (near_slopes, far_slopes) = (self.slopes(near), self.slopes(far));
        // across a kink the slopes differ by w aᵀ, by inputs and parameters alike: f goes on without a leap
        let (by_units, by_parameters) = (far_slopes.0 - near_slopes.0, far_slopes.1 - near_slopes.1);
        let row = (0..by_units.nrows())
            .max_by(|a, b| by_units.row(*a).norm_squared().total_cmp(&by_units.row(*b).norm_squared()))?;
        let size = by_units.row(row).norm();
        if !(size > NO_KINK * near_slopes.0.norm()) {
            return None;
        }
        let normal = by_units.row(row).transpose() / size;
        let sign = normal.dot(&(far.t - near.t)).signum();
        Some(Kink {
            which,
            side: near.prediction.contact.side[which],
            normal: sign * normal,
            by_parameters: sign * by_parameters.row(row).transpose() / size,
        })
    }

    /// Neighbouring inputs on the line between two, on the sides of the first and of the second.
    fn between(&self, mut near: Point, mut far: Point, which: usize, width: f64) -> Option<(Point, Point)> {
        let side = near.prediction.contact.side[which];
        loop {
            let length = (far.t - near.t).amax();
            if !(length > width) {
                return Some((near, far));
            }
            // v_z0 is nearly linear along the line; halves where that does not gain as much
            let (from, to) = (near.prediction.contact.vertical, far.prediction.contact.vertical);
            let (part, slack) = (from / (from - to), 0.25 * width / length);
            let mut places = vec![0.5 * (near.t + far.t)];
            if which == TOPSPIN && part.is_finite() {
                let guess = |part: f64| near.t + part.clamp(0.0, 1.0) * (far.t - near.t);
                places.extend([guess(part + slack), guess(part - slack)]);
            }
            while let Some(place) = places.pop().filter(|_| (far.t - near.t).amax() > 0.5 * length) {
                let middle = self.at(place)?;
                if middle.prediction.contact.side[which] == side { near = middle } else { far = middle }
            }
            if (far.t - near.t).amax() >= length {
                return Some((near, far));
            }
        }
    }

    /// Neighbouring inputs on both sides of a kink, on its own side first, from some near it.
    fn beside(&self, point: &Point, kink: &Kink) -> Option<(Point, Point)> {
        let contact = &point.prediction.contact;
        let is_near = contact.side[kink.which] == kink.side;
        let direction = if is_near { kink.normal } else { -kink.normal };
        let mut reach = WIDTH;
        if kink.which == TOPSPIN {
            let slope = Errors::in_units(self.errors.plan, &contact.vertical_by_inputs).dot(&direction);
            reach += (contact.vertical / slope).abs();
        }
        while reach < FARTHEST {
            let other = self.at(point.t + reach * direction)?;
            if other.prediction.contact.side[kink.which] != contact.side[kink.which] {
                let (a, b) = self.between(point.clone(), other, kink.which, WIDTH)?;
                return Some(if is_near { (a, b) } else { (b, a) });
            }
            reach *= WIDER;
        }
        None
    }

    /// Inputs moved on to kinks that they are near to, and the kinks there.
    fn on_kinks(&self, mut point: Point, kinks: &Kinks) -> Option<(Point, Kinks)> {
        let mut anew = *kinks;
        // on to the second kink may be a little off the first
        for _ in 0..kinks.list().len() {
            for (number, kink) in kinks.list().iter().enumerate() {
                let (near, far) = self.beside(&point, kink)?;
                anew = anew.replaced(number, self.kink(kink.which, &near, &far)?)?;
                point = near;
            }
        }
        Some((point, anew))
    }

    /// The kink between two inputs, or, where the sum falls on beyond it, the other side of it.
    fn at_new_kink(&self, now: &Point, tried: &Point, kinks: &Kinks) -> Option<(Point, Kinks)> {
        let which = kinks.crossed(&now.prediction.contact.side, &tried.prediction.contact.side)?;
        let (near, far) = self.between(now.clone(), tried.clone(), which, WIDTH)?;
        let kink = self.kink(which, &near, &far)?;
        Some(match self.leads_to(&near, &far, &kink, kinks)? {
            Leads::Near => (near, *kinks),
            Leads::Far => (far, *kinks),
            Leads::Onto => (near, kinks.with(kink)?),
        })
    }

    /// Where the sum falls from inputs on both sides of a kink, along the others.
    fn leads_to(&self, near: &Point, far: &Point, kink: &Kink, others: &Kinks) -> Option<Leads> {
        let forth = kink.normal.dot(&self.step(near, others)?);
        let back = kink.normal.dot(&self.step(far, others)?);
        Some(if forth < -AT_REST {
            Leads::Near
        } else if back > AT_REST {
            Leads::Far
        } else {
            Leads::Onto
        })
    }

    /// Where inputs that rest at kinks go on from when one of these no longer holds them.
    fn released(&self, now: &Point, kinks: &Kinks) -> Option<(Point, Kinks)> {
        kinks.list().iter().enumerate().find_map(|(number, kink)| {
            let others = kinks.without(number);
            let (near, far) = self.beside(now, kink)?;
            match self.leads_to(&near, &far, kink, &others)? {
                Leads::Near => Some((near, others)),
                Leads::Far => Some((far, others)),
                Leads::Onto => None,
            }
        })
    }

    /// Inputs on the other sides of kinks at which a shot's part of χ² may be lower.
    fn beyond_kinks(&self, best: &Point, kinks: &Kinks) -> [Option<Point>; 2] {
        [self.beyond_no_topspin(best, kinks), self.beyond_sticking(best, kinks)]
    }

    /// With draw instead of topspin, or the other way.
    fn beyond_no_topspin(&self, best: &Point, kinks: &Kinks) -> Option<Point> {
        let contact = &best.prediction.contact;
        let slope = Errors::in_units(self.errors.plan, &contact.vertical_by_inputs);
        let (size, reach) = (slope.norm(), best.chi2.sqrt());
        let is_within = (contact.vertical - slope.dot(&best.t)).abs() <= reach * size;
        if kinks.holds(TOPSPIN) || !is_within || !(size > 0.0) {
            return None;
        }
        let across = contact.vertical.abs() / size + WIDTH;
        let beyond = self.at(best.t - across * contact.vertical.signum() * slope / size)?;
        (beyond.prediction.contact.side[TOPSPIN] != contact.side[TOPSPIN]).then_some(beyond)
    }

    /// Where the contact sticks instead of sliding to the end, or the other way.
    fn beyond_sticking(&self, best: &Point, kinks: &Kinks) -> Option<Point> {
        let contact = &best.prediction.contact;
        let slope = Errors::in_units(self.errors.plan, &contact.log_slip_by_inputs);
        let (size, reach) = (slope.norm(), best.chi2.sqrt());
        let middle = contact.log_slip - slope.dot(&best.t);
        let [least, most] = self.sticks_below();
        let is_within = middle - reach * size <= most && middle + reach * size >= least;
        if kinks.holds(STICKS) || !is_within || !(size > 0.0) {
            return None;
        }
        let towards = if contact.side[STICKS] { slope / size } else { -slope / size };
        let farthest = best.t + (reach - towards.dot(&best.t)) * towards;
        let farthest = self.at(farthest)?;
        if farthest.prediction.contact.side[STICKS] == contact.side[STICKS] {
            return None;
        }
        self.between(best.clone(), farthest, STICKS, COARSE * reach).map(|(_, far)| far)
    }

    /// ln(|v_∥0|/k) below which a contact surely sticks, and above which it surely slides: about μ(1 + e)β, with β between
    /// β_z and β_y.
    fn sticks_below(&self) -> [f64; 2] {
        let Coefficients { mu, mu_s, e } = *self.coefficients;
        let Ball { inertia: nu, .. } = self.model.ball;
        let (most_mu, least_mu) = (self.model.law.largest(mu), mu);
        let betas = [(1.0 + nu) / nu, (2.0 + nu) / (2.0 * nu), (2.0 + nu - mu_s) / (2.0 * nu)];
        let least = betas.into_iter().fold(f64::INFINITY, f64::min) * least_mu.min(most_mu);
        let most = betas.into_iter().fold(0.0, f64::max) * most_mu.max(least_mu);
        [(least * (1.0 + e) / ABOUT).ln(), (most * (1.0 + e) * ABOUT).ln()]
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::collections::BTreeMap;

    use super::*;
    use crate::measurement::dataset::{Before, Measured, Measurement, Shot};
    use crate::measurement::observable::{Axis, Observable};
    use crate::measurement::spin::Spin;
    use crate::physics::ball::{BallState, Vec3};
    use crate::physics::collision::Fidelity;

    /// Standard deviations: of velocities, m/s, of the line of centres, rad, and of spins, rad/s.
    const SD: [f64; 3] = [0.001, 5e-4, 0.3];

    /// A number that errs.
    fn erring(rng: &mut ChaCha8Rng, value: f64, sd: f64) -> Measured {
        // Irwin and Hall's sum of twelve is all but normal
        let normal: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
        Measured { value: value + sd * normal, sd: Some(sd) }
    }

    /// A shot with side spin and neither topspin nor draw, as it was measured.
    fn shot(rng: &mut ChaCha8Rng, model: &Model, coefficients: &Coefficients) -> Shot {
        let (speed, cut) = (rng.random_range(1.0..3.0), rng.random_range(-0.9_f64..0.9));
        let velocity = Vec3::new(speed * cut.cos(), speed * cut.sin(), 0.0);
        let spin = Vec3::new(0.0, 0.0, rng.random_range(-20.0..20.0));
        let after = model.collide(&BallState { velocity, spin }, coefficients).unwrap();
        let rows = [
            (Observable::CueVelocity(Axis::X), after.cue.velocity.x),
            (Observable::CueVelocity(Axis::Y), after.cue.velocity.y),
            (Observable::ObjectVelocity(Axis::X), after.object.velocity.x),
            (Observable::ObjectVelocity(Axis::Y), after.object.velocity.y),
        ];
        let [sd, of_normal, of_spin] = SD;
        let angle = erring(rng, 0.0, of_normal).value;
        let [x, y] = [velocity.x, velocity.y].map(|v| erring(rng, v, sd));
        Shot {
            name: String::new(),
            file: std::path::PathBuf::new(),
            line: 1,
            labels: BTreeMap::new(),
            before: Before::Impact {
                normal: [
                    Measured { value: angle.cos(), sd: Some(0.0) },
                    Measured { value: angle.sin(), sd: Some(of_normal) },
                ],
                velocity: [x, y],
            },
            spin: Spin::Measured {
                spin: spin.map(|w| erring(rng, w, of_spin).value),
                sd: [Some(of_spin); 3],
            },
            after: rows
                .map(|(observable, value)| Measurement { observable, measured: erring(rng, value, sd) })
                .to_vec(),
            joint: None,
            side_sd: 0.0,
        }
    }

    #[test]
    fn no_inputs_agree_better_than_those_estimated() {
        /// Of χ², a thirtieth of a standard error: just where sticking begins slopes change so fast that a search may pass by a
        /// minimum that is lower by this.
        const SAME: f64 = 1e-3;
        /// Of 300.
        const MANY: usize = 10;
        let rng = &mut ChaCha8Rng::seed_from_u64(1);
        let model = Model::new(Fidelity::Full, Ball::POOL);
        let (mut at_kinks, mut missed) = ([0; 3], Vec::new());
        for number in 0..300 {
            let (mu, mu_s) = (rng.random_range(0.02..0.4), rng.random_range(0.1..0.5));
            let coefficients = Coefficients { mu, mu_s, e: 0.94 };
            let plan = Plan::new(&shot(rng, &model, &coefficients)).unwrap();
            let errors = Errors::new(&plan, |row| plan.rows()[row].measured.sd.unwrap());
            let from = (&Units::zeros(), true);
            let (found, _) = estimate(&errors, (&model, &coefficients), from, |_, _| 0.0).unwrap();
            at_kinks[found.kinks.list().len()] += 1;
            let shot = OfShot {
                errors: &errors,
                model: &model,
                coefficients: &coefficients,
                shared: |_: &Prediction, _| 0.0,
            };
            let own = shot.at(found.t).unwrap().chi2;
            let (mut least, mut at) = (own, 0.0);
            for reach in [1e-5, 1e-4, 1e-3, 1e-2, 0.1, 0.5, 1.0, 2.0] {
                for _ in 0..100 {
                    let t = found.t + reach * Units::from_fn(|_, _| rng.random_range(-1.0..1.0));
                    let chi2 = shot.at(t).map_or(f64::INFINITY, |point| point.chi2);
                    if chi2 < least {
                        (least, at) = (chi2, reach);
                    }
                }
            }
            if least < own - SAME {
                missed.push(format!("{number}: {own:.7}, {least:.7} within {at}; {:?}", found.kinks.list()));
            }
        }
        assert!(missed.is_empty(), "{missed:#?}");
        println!("{at_kinks:?} at no kink, at one and at two");
        assert!(at_kinks[1] > MANY, "{at_kinks:?}");
    }
}
