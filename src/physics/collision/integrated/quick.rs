//! A contact that gives way, as a fit needs it: in some microseconds. The steps are those of Dormand and Prince's pair of order 5(4),
//! which end at every event; [`super::quick_derivatives`] takes them again.
//!
//! - Dormand, J. R. and Prince, P. J. (1980), J. Comput. Appl. Math. 6, 19–26.

use super::Impulses;
use super::dynamics::Dynamics;
use super::fall::{MOST_TRIALS, root};
use super::lanes::Real;
use super::quick_equations::{Event, FOLLOWS, Grip, LEAST_ROOT, Mode, Shot, State, at};
use crate::physics::collision::{Fidelity, Model, Regime};
use crate::physics::friction_law::Friction;

/// The error of a step, relative to the closing speed. That of the outcome was at most 1.7e-7 of the speed in 3000 random impacts, in
/// the median 4e-8: below the tolerance of fits, 2e-7.
const TOLERANCE: f64 = 4e-7;

/// A model with a larger tolerance than this is computed so.
const QUICK: f64 = 1e-7;

/// The first step, in units of the whole impact.
const FIRST: f64 = 0.05;

/// The longest step: what happens and is undone within a shorter one is of no account.
const LONGEST: f64 = 0.1;

/// More steps than an impact needs: a stiff spring shakes √(42/κ) radians, at κ = 1e-4 in some 4000 steps. The precise way takes ten
/// times as long there.
const MOST_STEPS: usize = 10_000;

/// A step turns the friction by no more than this, or the pair is unstable.
const STABLE: f64 = 3.0;

/// Over which the rate of an event is taken, and the least first step after one, in units of the whole impact.
const PROBE: f64 = 1e-7;
const LEAST_AFTER_EVENT: f64 = 1e-3;

/// By so much a condition of a mode may be violated.
const BROKEN: f64 = 1e-7;

/// Of R in restitution: a ball that leaves the cloth, or comes back, this near to the end does so at the end. What is left of the
/// impulse is its fifth power.
const SPENT: f64 = 1e-6;

/// Over which part of a step to either side the slope of an event's function is taken.
const BESIDE: f64 = 1e-3;

/// A step: under which equations, how long, and the event at its end with its rate.
#[derive(Clone, Copy)]
pub(super) struct Step {
    pub mode: Mode,
    pub length: f64,
    pub event: Option<(Event, f64)>,
}

/// Whether a model is one that this computes: without weight, and without friction of the cloth that `full` does not have.
pub(super) fn serves(model: &Model, dynamics: &Dynamics) -> bool {
    model.tolerance > QUICK
        && model.fidelity == Fidelity::Ode
        && dynamics.kappa > 0.0
        && dynamics.mu_k == 0.0
        && !dynamics.cloth_turning
        && dynamics.sigma == 1.0
}

/// The impulses of a shot; `None` where its steps lead nowhere.
pub(super) fn impulses(dynamics: &Dynamics, e: f64) -> Option<(Impulses, Regime)> {
    let plain = shot(dynamics, dynamics.slip, e);
    let mut steps = Vec::with_capacity(64);
    let (y, regime) = plain.solve(&mut steps)?;
    Some((of_state(dynamics.k, &y), regime))
}

pub(super) fn shot<T: Real>(dynamics: &Dynamics, slip: [T; 2], e: T) -> Shot<T> {
    let (mu, falls) = match dynamics.friction {
        Friction::Constant(mu) => (mu, None),
        Friction::Exponential { a, b, c } => (a, Some((T::from(b), T::from(c * dynamics.k)))),
    };
    Shot {
        slip,
        mu: T::from(mu),
        falls,
        mu_s: T::from(dynamics.mu_s),
        e,
        kappa: T::from(dynamics.kappa),
        per_nu: 1.0 / dynamics.nu,
        per_r: dynamics.per_r,
        share: dynamics.share,
        lever_y: dynamics.lever_y,
        tilt: dynamics.tilt,
    }
}

pub(super) fn of_state(k: f64, y: &State<f64>) -> Impulses {
    of_impulses(&y.map(|component| k * component))
}

pub(super) fn of_impulses(y: &State<f64>) -> Impulses {
    Impulses {
        normal: y[at::NORMAL],
        y: y[at::J_Y],
        z: y[at::J_Z],
        cue_cloth: [0.0; 2],
        object_cloth: [y[at::CLOTH], 0.0],
        cue_up: y[at::U_Z],
        object_up: y[at::V_Z],
    }
}

/// Where a step begins or ends.
#[derive(Clone, Copy)]
struct Point {
    y: State<f64>,
    rates: State<f64>,
    /// The functions of all events.
    events: [f64; 4],
}

/// The cubic through both ends of a step, near which the path runs.
fn between(from: &Point, to: &Point, length: f64, at: f64) -> State<f64> {
    let (t, rest) = (at / length, 1.0 - at / length);
    std::array::from_fn(|i| {
        let [y, there] = [from.y[i], to.y[i]];
        let bent = rest * (from.rates[i] * length - (there - y)) + t * ((there - y) - to.rates[i] * length);
        rest * y + t * there + t * rest * bent
    })
}

impl Shot<f64> {
    fn point(&self, mode: &Mode, y: &State<f64>) -> Point {
        Point { y: *y, rates: self.rates(mode, y), events: self.events(mode, y) }
    }

    /// Goes through the impact and writes down its steps.
    pub(super) fn solve(&self, steps: &mut Vec<Step>) -> Option<(State<f64>, Regime)> {
        let (mut mode, y) = self.start();
        let mut held = mode.grip == Grip::Springs;
        let mut length = FIRST;
        let mut now = self.point(&mode, &y);
        let mut is_reversed = false;
        for _ in 0..MOST_STEPS {
            let next = self.turned(mode, &now.y);
            if next != mode {
                self.change(&mode, &next, &mut now.y);
                mode = next;
                now = self.point(&mode, &now.y);
            }
            if mode.grip == Grip::Yields {
                length = length.min(STABLE / self.turning_rate(&mode, &now.y));
            }
            let (y, rates, error) = self.step(&mode, &now.y, &now.rates, length);
            let factor = 0.9 * (TOLERANCE / error.max(1e-300)).powf(0.2);
            if !(error <= TOLERANCE) {
                length *= if factor.is_finite() { factor.clamp(0.1, 0.9) } else { 0.1 };
                continue;
            }
            let there = Point { y, rates, events: self.events(&mode, &y) };
            // what is no longer as its mode says, and was not when the mode began, takes more care
            let before = now.events;
            let is_broken =
                |after: &[f64; 4]| (0..after.len()).any(|i| !(before[i] > 0.0) && after[i] < -BROKEN);
            let found = if any_happened(&before, &there.events) {
                Some(self.first_event(&mode, &now, (length, there))?)
            } else {
                None
            };
            if !is_reversed && grips_otherwise(&mode, &now, &there, found.as_ref()) {
                let next = after_event(mode, Event::Grip);
                held = next.grip == Grip::Springs || held && now.y[at::ROOT] > 0.0;
                self.change(&mode, &next, &mut now.y);
                (mode, is_reversed) = (next, true);
                now = self.point(&mode, &now.y);
                continue;
            }
            is_reversed = false;
            let Some((event, to, mut y)) = found else {
                if is_broken(&there.events) {
                    return None;
                }
                steps.push(Step { mode, length, event: None });
                now = there;
                length = (length * factor.clamp(0.2, 4.0)).min(LONGEST);
                continue;
            };
            let at_event = self.events(&mode, &y);
            if is_broken(&at_event) {
                return None;
            }
            let later = ahead(&y, PROBE, [(1.0, &self.rates(&mode, &y))]);
            let of = event as usize;
            let rate = (self.events(&mode, &later)[of] - at_event[of]) / PROBE;
            steps.push(Step { mode, length: to, event: Some((event, rate)) });
            let ends = event == Event::End && (!mode.is_compression || self.e == 0.0);
            if ends || !mode.is_compression && y[at::ROOT] < SPENT {
                return Some((y, if held { Regime::Stick } else { Regime::Slide }));
            }
            let next = after_event(mode, event);
            self.change(&mode, &next, &mut y);
            mode = next;
            held |= mode.grip == Grip::Springs;
            now = self.point(&mode, &y);
            length = length.max(LEAST_AFTER_EVENT);
        }
        None
    }

    /// Whether the friction follows its slip.
    fn turned(&self, mode: Mode, y: &State<f64>) -> Mode {
        let grip = match mode.grip {
            Grip::Yields if self.turning_rate(&mode, y) > FOLLOWS && self.is_aligned(y) => Grip::Follows,
            Grip::Follows if y[at::ROOT] > 0.0 && self.turning_rate(&mode, y) < 0.5 * FOLLOWS => Grip::Yields,
            grip => grip,
        };
        Mode { grip, ..mode }
    }

    /// The first event within a step, of those that may come, go and come again.
    fn first_event(
        &self,
        mode: &Mode,
        from: &Point,
        (mut length, mut to): (f64, Point),
    ) -> Option<(Event, f64, State<f64>)> {
        let mut found = None;
        for _ in 0..MOST_TRIALS {
            let (event, at, y) = self.locate(mode, from, (length, &to))?;
            found = Some((event, at, y));
            // another that has happened there was earlier
            (length, to) = (at, self.point(mode, &y));
            to.events[event as usize] = f64::INFINITY;
            if !any_happened(&from.events, &to.events) {
                break;
            }
        }
        found
    }

    /// Where events happen that have within a step: which first, after what length, and the state there.
    fn locate(
        &self,
        mode: &Mode,
        from: &Point,
        (length, to): (f64, &Point),
    ) -> Option<(Event, f64, State<f64>)> {
        let mut found: Option<(Event, f64, State<f64>)> = None;
        let all = Event::ALL.into_iter().enumerate();
        for (i, event) in all.filter(|(i, _)| happened(from.events[*i], to.events[*i])) {
            let ends = [(0.0, from.events[i]), (length, to.events[i])];
            // along the cubic first, which is much cheaper than steps
            let along = |at: f64| self.events(mode, &between(from, to, length, at))[i];
            let about = root(ends, None, length, |at| (along(at), ())).0;
            let slope =
                (along(about + BESIDE * length) - along(about - BESIDE * length)) / (2.0 * BESIDE * length);
            let stepped = |at: f64| {
                let y = self.step(mode, &from.y, &from.rates, at).0;
                (self.events(mode, &y)[i], y)
            };
            let (at, y) = root(ends, Some((about, slope)), length, stepped);
            let y = y.unwrap_or(to.y);
            if found.is_none_or(|(_, first, _)| at < first) {
                found = Some((event, at, y));
            }
        }
        found
    }
}

/// Whether the contact grips otherwise from the beginning of a step on: it would change its grip while the balls just touch, or
/// it is at no end of the step as its mode says.
fn grips_otherwise(mode: &Mode, from: &Point, to: &Point, found: Option<&(Event, f64, State<f64>)>) -> bool {
    let grip = Event::Grip as usize;
    match found {
        _ if mode.grip == Grip::Follows => false,
        Some((event, _, y)) => *event == Event::Grip && from.y[at::ROOT] == 0.0 && y[at::ROOT] < LEAST_ROOT,
        None => from.events[grip] <= 0.0 && to.events[grip] <= 0.0,
    }
}

/// An event is not watched before it is positive; of a change of grip, see [`grips_otherwise`].
fn happened(before: f64, after: f64) -> bool {
    before > 0.0 && !(after > 0.0)
}

fn any_happened(before: &[f64; 4], after: &[f64; 4]) -> bool {
    (0..before.len()).any(|i| happened(before[i], after[i]))
}

/// The equations after an event.
fn after_event(mode: Mode, event: Event) -> Mode {
    match event {
        Event::End => Mode { is_compression: false, ..mode },
        Event::Grip if mode.grip == Grip::Springs => Mode { grip: Grip::Yields, ..mode },
        Event::Grip => Mode { grip: Grip::Springs, ..mode },
        Event::Cue => Mode { cue_on: !mode.cue_on, ..mode },
        Event::Object => Mode { object_on: !mode.object_on, ..mode },
    }
}

impl<T: Real> Shot<T> {
    /// A step from a state with these rates: the state and the rates at its end, and an estimate of its error.
    #[inline(never)]
    pub(super) fn step(&self, mode: &Mode, y: &State<T>, k1: &State<T>, h: f64) -> (State<T>, State<T>, f64) {
        let k2 = self.rates(mode, &ahead(y, h, [(1.0 / 5.0, k1)]));
        let k3 = self.rates(mode, &ahead(y, h, [(3.0 / 40.0, k1), (9.0 / 40.0, &k2)]));
        let k4 = self.rates(mode, &ahead(y, h, [(44.0 / 45.0, k1), (-56.0 / 15.0, &k2), (32.0 / 9.0, &k3)]));
        let k5 = self.rates(
            mode,
            &ahead(
                y,
                h,
                [
                    (19372.0 / 6561.0, k1),
                    (-25360.0 / 2187.0, &k2),
                    (64448.0 / 6561.0, &k3),
                    (-212.0 / 729.0, &k4),
                ],
            ),
        );
        let k6 = self.rates(
            mode,
            &ahead(
                y,
                h,
                [
                    (9017.0 / 3168.0, k1),
                    (-355.0 / 33.0, &k2),
                    (46732.0 / 5247.0, &k3),
                    (49.0 / 176.0, &k4),
                    (-5103.0 / 18656.0, &k5),
                ],
            ),
        );
        let there = ahead(
            y,
            h,
            [
                (35.0 / 384.0, k1),
                (500.0 / 1113.0, &k3),
                (125.0 / 192.0, &k4),
                (-2187.0 / 6784.0, &k5),
                (11.0 / 84.0, &k6),
            ],
        );
        let k7 = self.rates(mode, &there);
        // of order 5 less of order 4
        let error = |i: usize| {
            71.0 / 57600.0 * k1[i].first() - 71.0 / 16695.0 * k3[i].first() + 71.0 / 1920.0 * k4[i].first()
                - 17253.0 / 339_200.0 * k5[i].first()
                + 22.0 / 525.0 * k6[i].first()
                - 1.0 / 40.0 * k7[i].first()
        };
        let mut most = 0.0;
        for i in 0..at::COUNT {
            let size = h * error(i).abs();
            // NaN is the largest
            most = if size <= most { most } else { size };
        }
        (there, k7, most)
    }
}

#[inline(always)]
fn ahead<T: Real, const M: usize>(y: &State<T>, h: f64, terms: [(f64, &State<T>); M]) -> State<T> {
    let mut there = *y;
    let mut term = 0;
    while term < M {
        let (a, rates) = terms[term];
        for i in 0..at::COUNT {
            there[i] += rates[i] * (a * h);
        }
        term += 1;
    }
    there
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::ball::{Ball, BallState, Vec3};
    use crate::physics::collision::integrated::dynamics;
    use crate::physics::collision::{Coefficients, Effects};

    /// At the end of these impacts the friction, and with it what lifts a ball, vanishes together with the normal force.
    #[test]
    fn impacts_that_end_as_a_ball_leaves_the_cloth_end() {
        // (v_y0, v_z0)/k, μ and e
        for (slip, mu, e) in [
            ([0.234_793_285, 2.282_293_603], 0.131_472_192, 0.94),
            ([0.231_139_835, -1.443_777_961], 0.081_591_034, 0.940_322_773),
            ([0.203_031_088, -0.039_325_373], 0.01, 0.927_298_387),
            ([0.234_848_396, 3.649_580_036], 0.159_114_768, 0.940_973_839),
        ] {
            let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
            let kappa = Model::KAPPA;
            let tolerance = Model::TOLERANCE_OF_FITS;
            let model = Model { effects, kappa, tolerance, ..Model::new(Fidelity::Ode, Ball::POOL) };
            let (k, radius) = (15.4, model.ball.radius);
            let spin = Vec3::new(0.0, slip[1] * k / radius, -slip[0] * k / radius);
            let cue = BallState { velocity: Vec3::new(k, 0.0, 0.0), spin };
            let coefficients = Coefficients { mu, mu_s: 0.3, e };
            let contact = model.contact(&cue, &coefficients).unwrap();
            let dynamics = dynamics(&model, &cue, &coefficients, &contact).unwrap();
            assert!(serves(&model, &dynamics));
            assert!(impulses(&dynamics, e).is_some(), "{slip:?}");
        }
    }
}
