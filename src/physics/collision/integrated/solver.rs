//! Adaptive integration of an impact, stretch by stretch, from event to event.
//!
//! The method is Dormand and Prince's DOP853: order 8 with an embedded error estimate and dense output
//! of order 7 (E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, § II.5).
//! Its error in each step is kept below the tolerance. The dense output only tells where in a step to look
//! for an event; the step is then taken again to end there, so that the event has the method's order too.

use differential_equations::interpolate::Interpolation;
use differential_equations::methods::{DormandPrince, ExplicitRungeKutta, Ordinary};
use differential_equations::ode::{ODE, OrdinaryNumericalMethod};
use differential_equations::status::Status;

use crate::physics::collision::steps;

/// Bisection on the interpolant ends at this part of the step.
const GUESSED: f64 = 1e-4;

/// Where an event may have come and gone within a step, it is looked at in these parts of the step.
const LOOKED_AT: [f64; 3] = [0.25, 0.5, 0.75];

/// The last part of the way to an event may be gone by a step of first order: its error is of the square
/// of this part of the way.
const EULER: f64 = 1e-8;

/// So short a step is one of second order: its error is of the cube, and the method refuses it.
const SHORT: f64 = 1e-10;

/// Newton's method needs three or four steps; bisection, where it fails, halves.
const MAX_NEWTON: usize = 60;

/// The most steps of one impact, taken or tried; the hardest shots of the tests need some hundreds, those of a stiff contact more.
const MAX_STEPS: usize = 5_000;

/// How many kinds of events there are at most.
pub(in crate::physics::collision) const EVENTS: usize = 10;

/// The first step of a stretch, in units of the whole impact; the method finds its own from there.
const FIRST_STEP: f64 = 0.1;

/// A stretch of an impact between two events.
pub(in crate::physics::collision) trait Stretch<const N: usize> {
    /// dy/dx.
    fn rates(&self, x: f64, y: &[f64; N]) -> [f64; N];

    /// Functions that are positive until their event; one that is not to begin with is not watched
    /// before it is.
    fn events(&self, x: f64, y: &[f64; N]) -> [f64; EVENTS];

    /// An event whose function must be positive at the beginning or after the first step: else it has happened at the beginning.
    fn holds_at_once(&self) -> Option<usize>;

    /// The longest step that makes sense from here, up to the one proposed.
    fn longest_step(&self, x: f64, y: &[f64; N], proposed: f64) -> f64;
}

/// Where a stretch ended, and by which event.
#[derive(Clone, Copy, Debug)]
pub(in crate::physics::collision) struct End<const N: usize> {
    pub x: f64,
    pub y: [f64; N],
    pub event: usize,
}

/// The integration gave up after [`MAX_STEPS`], or more of a stiff contact, or because a step became too short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::physics::collision) struct GaveUp;

/// An integrator for all stretches of one impact.
pub(in crate::physics::collision) struct Integrator<const N: usize> {
    method: ExplicitRungeKutta<Ordinary, DormandPrince, f64, [f64; N], 8, 12, 16>,
    /// Tried so far.
    steps: usize,
    most_steps: usize,
}

/// Adapts a stretch to the library.
struct System<'a, S>(&'a S);

impl<const N: usize, S: Stretch<N>> ODE<f64, [f64; N]> for System<'_, S> {
    fn diff(&self, x: f64, y: &[f64; N], rates: &mut [f64; N]) {
        *rates = self.0.rates(x, y);
    }
}

impl<const N: usize> Integrator<N> {
    /// With an absolute tolerance for every component of the state.
    pub fn new(tolerance: f64) -> Self {
        Self { method: method(tolerance), steps: 0, most_steps: MAX_STEPS }
    }

    /// Takes so many times the usual number of steps before it gives up.
    pub fn with_more_steps(self, times: f64) -> Self {
        Self { most_steps: (times * MAX_STEPS as f64) as usize, ..self }
    }

    /// The steps taken so far count on.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.method = method(tolerance);
    }

    /// Integrates to the first event.
    pub fn run(&mut self, stretch: &impl Stretch<N>, x: f64, y: &[f64; N]) -> Result<End<N>, GaveUp> {
        self.restart(stretch, x, y, stretch.longest_step(x, y, FIRST_STEP))?;
        let mut before = stretch.events(x, y);
        let mut earlier = before;
        let mut owed = stretch.holds_at_once().filter(|event| before[*event] <= 0.0);
        let start = (x, *y);
        while self.steps < self.most_steps {
            if !self.step(stretch)? {
                continue;
            }
            let (x, y) = (self.method.t(), *self.method.y());
            let after = stretch.events(x, &y);
            if let Some(event) = owed.take().filter(|event| after[*event] <= 0.0) {
                let (x, y) = start;
                return Ok(End { x, y, event });
            }
            let late = if fired(&before, &after).is_some() {
                Some((x, y))
            } else {
                self.passed_over(stretch, [&earlier, &before, &after])?
            };
            if let Some(late) = late {
                if let Some(end) = self.locate(stretch, &before, late)? {
                    return Ok(end);
                }
                continue;
            }
            (earlier, before) = (before, after);
            self.method.set_h(stretch.longest_step(x, &y, self.method.h()));
        }
        Err(GaveUp)
    }

    /// Where an event has come and gone again within the last step, between whose ends it is positive: looked for where one that
    /// fell came so close to 0 as it had fallen in the step before.
    fn passed_over(
        &mut self,
        stretch: &impl Stretch<N>,
        [earlier, before, after]: [&[f64; EVENTS]; 3],
    ) -> Result<Option<(f64, [f64; N])>, GaveUp> {
        let may_have = |i: &usize| {
            let (fell, least) = (earlier[*i] - before[*i], before[*i].min(after[*i]));
            0.0 < least && least < fell
        };
        if !(0..EVENTS).any(|i| may_have(&i)) {
            return Ok(None);
        }
        let (from, to) = (self.method.t_prev(), self.method.t());
        for part in LOOKED_AT {
            let x = from + part * (to - from);
            let y = self.method.interpolate(x).map_err(|_| GaveUp)?;
            if fired(before, &stretch.events(x, &y)).is_some() {
                return Ok(Some((x, y)));
            }
        }
        Ok(None)
    }

    /// The first event up to a place in the last step, where it has happened: a first guess from the interpolant, then Newton's method, each
    /// time with a step of the method that ends there. `None` where the method refuses such a step: it is
    /// then set to go on from the beginning with a shorter one.
    fn locate(
        &mut self,
        stretch: &impl Stretch<N>,
        before: &[f64; EVENTS],
        (mut late, mut y): (f64, [f64; N]),
    ) -> Result<Option<End<N>>, GaveUp> {
        let (from, start) = (self.method.t_prev(), *self.method.y_prev());
        let length = late - from;
        let mut event = fired(before, &stretch.events(late, &y)).ok_or(GaveUp)?;
        let (mut early, mut x) = (from, late);
        while x - early > GUESSED * length {
            let middle = 0.5 * (early + x);
            if middle <= early || middle >= x {
                break;
            }
            let there = self.method.interpolate(middle).map_err(|_| GaveUp)?;
            match fired(before, &stretch.events(middle, &there)) {
                Some(first) => (x, event) = (middle, first),
                None => early = middle,
            }
        }
        early = from;
        for _ in 0..MAX_NEWTON {
            // of the way, not of the step that was tried: a hop may take a billionth of that
            let probe = (EULER * (x - from)).max(4.0 * f64::EPSILON * late.abs());
            if x - from < SHORT {
                // the mean of both ends' rates (Heun), or a ball that has just left the cloth would not come down
                let rates = stretch.rates(from, &start);
                let ahead = std::array::from_fn(|i| start[i] + (x - from) * rates[i]);
                let then = stretch.rates(x, &ahead);
                y = std::array::from_fn(|i| start[i] + 0.5 * (x - from) * (rates[i] + then[i]));
            } else {
                self.restart(stretch, from, &start, x - from)?;
                if !self.step(stretch)? {
                    // the whole step was a lucky one, where the rates change within it
                    let shorter = self.method.h().min(0.5 * (x - from));
                    self.restart(stretch, from, &start, shorter)?;
                    return Ok(None);
                }
                y = *self.method.y();
            }
            let values = stretch.events(x, &y);
            if let Some(first) = fired(before, &values) {
                (late, event) = (x, first);
            } else {
                early = x;
            }
            let rates = stretch.rates(x, &y);
            let ahead = |dx: f64| std::array::from_fn(|i| y[i] + dx * rates[i]);
            let slope = (stretch.events(x + probe, &ahead(probe))[event] - values[event]) / probe;
            let dx = -values[event] / slope;
            if dx.abs() <= probe {
                return Ok(Some(End { x: x + dx, y: ahead(dx), event }));
            }
            if late - early <= probe {
                break;
            }
            x += dx;
            if !(early < x && x < late) {
                x = 0.5 * (early + late);
            }
        }
        Ok(Some(End { x, y, event }))
    }

    /// Tries a step; whether it was taken.
    fn step(&mut self, stretch: &impl Stretch<N>) -> Result<bool, GaveUp> {
        steps::record(self.steps);
        self.steps += 1;
        self.method.step(&System(stretch)).map_err(|_| GaveUp)?;
        Ok(!matches!(self.method.status(), Status::RejectedStep))
    }

    fn restart(&mut self, stretch: &impl Stretch<N>, x: f64, y: &[f64; N], step: f64) -> Result<(), GaveUp> {
        self.method.h0 = step;
        self.method.init(&System(stretch), x, f64::MAX, y).map(|_| ()).map_err(|_| GaveUp)
    }
}

fn method<const N: usize>(
    tolerance: f64,
) -> ExplicitRungeKutta<Ordinary, DormandPrince, f64, [f64; N], 8, 12, 16> {
    ExplicitRungeKutta::dop853().rtol(0.0).atol(tolerance).max_steps(usize::MAX)
}

/// The first event that has happened since.
fn fired(before: &[f64; EVENTS], now: &[f64; EVENTS]) -> Option<usize> {
    (0..EVENTS).find(|i| before[*i] > 0.0 && !(now[*i] > 0.0))
}
