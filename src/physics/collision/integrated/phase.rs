//! Compression and restitution, each walked through from event to event.

use super::dynamics::{Dynamics, Forces, Give, Grip, Grips, Pair, Site, Slips, at, norm};
use super::solver::{EVENTS, GaveUp, Integrator, Stretch};
use crate::physics::collision::{MAX_TOLERANCE, Regime};

/// The events: the end of the phase, a change of grip of each contact, a lift-off of each ball, and the
/// balls no longer separating.
mod event {
    pub const END: usize = 0;
    pub const GRIP: [usize; 3] = [1, 2, 3];
    /// The balls have none.
    pub const LIFT_OFF: [usize; 3] = [usize::MAX, 4, 5];
    pub const STOPPED: usize = 6;
    /// A contact that slid from rest has started.
    pub const STARTED: [usize; 3] = [7, 8, 9];
}

/// A step goes at most this part of the way to where a slip would vanish.
const TOWARDS_STICK: f64 = 0.99;

/// A step is at most this many times as long as friction takes to turn a slip: longer ones are unstable from six on.
const STABLE: f64 = 4.0;

/// A step of a contact that starts goes at most this part of the way to where it has started.
const NOT_STARTED: f64 = 0.5;

/// Stands in for the normal force at first contact.
pub(in crate::physics::collision) const TOUCH: f64 = 1e-30;

/// More changes of grip than this in one impact, of a stiff contact some times as many, are a chatter that leads nowhere.
const MAX_EVENTS: usize = 200;

/// A phase of an impact under a model: the model says how hard the balls press at a state and how fast
/// its own variable passes.
pub(in crate::physics::collision) trait Model<const N: usize> {
    /// Normal impulse q.
    fn impulse(&self, phase: &Phase, x: f64, y: &[f64; N]) -> f64;

    /// Normal force F between the balls.
    fn normal(&self, phase: &Phase, y: &[f64; N]) -> f64;

    /// dt/dx, where F is an impulse per t.
    fn pace(&self, phase: &Phase, y: &[f64; N]) -> f64;

    /// The state with the greatest normal force that the next `step` may bring.
    fn fastest(&self, phase: &Phase, y: &[f64; N], step: f64) -> [f64; N];

    /// Rates by x of what the model adds to the state, with v_x.
    fn own_rates(&self, phase: &Phase, y: &[f64; N], slips: &Slips, v_x: f64, rates: &mut [f64; N]);

    /// What a contact that gives way adds to slips and normal force; a rigid one adds nothing.
    fn give(&self, _: &Phase, _: &[f64; N], _: f64) -> Give {
        Give::default()
    }

    /// The time in which the friction of a contact that gives way turns.
    fn longest_turn(&self, _: &Phase, _: &[f64; N], _: &Slips) -> f64 {
        f64::INFINITY
    }

    /// Of a contact that gives way: positive until it changes its grip, and until its friction follows its slip again.
    fn grip_events(&self, _: &Phase, _: &[f64; N], _: &Slips, _: &Forces, _: &Give) -> Option<[f64; 2]> {
        None
    }

    /// Changes that grip, `again` where the friction follows its slip again.
    fn change_grip(&self, _: &mut Phase, _: f64, _: &mut [f64; N], _: bool) {}

    /// Positive until restitution ends.
    fn restitution_left(&self, phase: &Phase, y: &[f64; N]) -> f64;

    /// Positive until a ball that flies lands.
    fn above_cloth(&self, y: &[f64; N], site: Site) -> f64;

    /// Puts a ball that has landed on the cloth.
    fn land(&self, q: f64, y: &mut [f64; N], site: Site);
}

/// Compression, or restitution after it, with the grips as they are.
#[derive(Clone, Copy)]
pub(in crate::physics::collision) struct Phase<'a> {
    pub dynamics: &'a Dynamics,
    pub grips: Grips,
    /// 1 in compression. In restitution e: its variables are stretched by 1/e, so that they are of
    /// order 1 however small e is.
    pub stretch: f64,
    /// q at its beginning.
    pub q: f64,
    /// v_x + k at its beginning, and v_x there.
    separation: f64,
    v_x: f64,
    /// A contact that gives way has been stuck.
    pub held_once: bool,
}

impl<'a> Phase<'a> {
    pub fn compression(dynamics: &'a Dynamics) -> Self {
        let grips = Grips([Grip::Slides; 3]);
        Self { dynamics, grips, stretch: 1.0, q: 0.0, separation: 0.0, v_x: -1.0, held_once: false }
    }

    /// From where compression ended.
    pub fn restitution(self, e: f64, q: f64, y: &[f64]) -> Self {
        Self { stretch: e, q, separation: self.dynamics.separation(q, y), v_x: 0.0, ..self }
    }

    pub fn is_compression(&self) -> bool {
        self.v_x < 0.0
    }

    pub fn regime(&self) -> Regime {
        let sticks = self.grips[Site::Balls] == Grip::Sticks || self.held_once;
        if sticks { Regime::Stick } else { Regime::Slide }
    }

    /// With another grip between the balls.
    pub fn grips_with(&self, grip: Grip) -> Grips {
        let mut grips = self.grips;
        grips[Site::Balls] = grip;
        grips
    }

    /// v_x/stretch.
    pub fn v_x(&self, q: f64, y: &[f64]) -> f64 {
        (self.v_x + (self.dynamics.separation(q, y) - self.separation)) / self.stretch
    }
}

/// A phase under its model, as the integrator sees it.
struct Watched<'a, M> {
    model: &'a M,
    phase: Phase<'a>,
    /// The grip of a contact that gives way has changed just here, without a step.
    is_reversed: bool,
}

impl<M> Watched<'_, M> {
    fn forces<const N: usize>(&self, x: f64, y: &[f64; N]) -> (f64, Slips, Forces)
    where
        M: Model<N>,
    {
        let Phase { dynamics, grips, .. } = &self.phase;
        let q = self.model.impulse(&self.phase, x, y);
        let slips = dynamics.slips(q, y);
        let give = self.model.give(&self.phase, y, self.phase.v_x(q, y));
        let forces = dynamics.forces(grips, &slips, self.model.normal(&self.phase, y), &give);
        (q, slips, forces)
    }

    /// d(slip)/dx of all contacts.
    fn slip_rates<const N: usize>(&self, x: f64, y: &[f64; N]) -> [Pair; 3]
    where
        M: Model<N>,
    {
        let Phase { dynamics, grips, .. } = &self.phase;
        let (_, _, forces) = self.forces(x, y);
        let pace = self.model.pace(&self.phase, y);
        dynamics.slip_rates(grips, &forces).map(|rate| rate.map(|r| pace * r))
    }
}

impl<const N: usize, M: Model<N>> Stretch<N> for Watched<'_, M> {
    fn rates(&self, x: f64, y: &[f64; N]) -> [f64; N] {
        let (q, slips, forces) = self.forces(x, y);
        let mut rates = [0.0; N];
        self.phase.dynamics.rates(&self.phase.grips, &forces, &mut rates);
        let pace = self.model.pace(&self.phase, y);
        for rate in &mut rates[..at::COUNT] {
            *rate *= pace;
        }
        self.model.own_rates(&self.phase, y, &slips, self.phase.v_x(q, y), &mut rates);
        rates
    }

    fn events(&self, x: f64, y: &[f64; N]) -> [f64; EVENTS] {
        let (q, slips, forces) = self.forces(x, y);
        let Phase { dynamics, grips, .. } = &self.phase;
        let mut events = [f64::NAN; EVENTS];
        let v_x = self.phase.v_x(q, y);
        if self.phase.is_compression() {
            events[event::END] = -v_x;
        } else {
            events[event::END] = self.model.restitution_left(&self.phase, y);
            events[event::STOPPED] = v_x;
        }
        for site in Site::ALL {
            let i = site as usize;
            events[event::GRIP[i]] = match grips[site] {
                Grip::Slides | Grip::Starts | Grip::Creeps if dynamics.has_friction(site) => {
                    norm(slips.0[i]) - dynamics.no_slip[i]
                }
                Grip::Sticks => forces.most[i] - norm(forces.friction[i]),
                Grip::Open => self.model.above_cloth(y, site),
                _ => f64::NAN,
            };
            if grips[site] == Grip::Starts {
                events[event::STARTED[i]] = dynamics.starts_for(site, grips, &slips, &forces);
            }
            if site != Site::Balls && grips[site] != Grip::Open {
                events[event::LIFT_OFF[i]] = forces.normal[i];
            }
        }
        let give = self.model.give(&self.phase, y, v_x);
        if let Some([change, again]) = self.model.grip_events(&self.phase, y, &slips, &forces, &give) {
            let i = Site::Balls as usize;
            (events[event::GRIP[i]], events[event::STARTED[i]]) = (change, again);
        }
        events
    }

    fn holds_at_once(&self) -> Option<usize> {
        let gives_way = matches!(self.phase.grips[Site::Balls], Grip::Springs | Grip::Yields);
        (gives_way && !self.is_reversed).then_some(event::GRIP[Site::Balls as usize])
    }

    fn longest_step(&self, x: f64, y: &[f64; N], proposed: f64) -> f64 {
        let q = self.model.impulse(&self.phase, x, y);
        let slips = self.phase.dynamics.slips(q, y);
        let Phase { dynamics, grips, .. } = &self.phase;
        let fastest = self.model.fastest(&self.phase, y, proposed);
        let (_, _, forces) = self.forces(x, &fastest);
        let pace = self.model.pace(&self.phase, &fastest);
        let rates = dynamics.slip_rates(grips, &forces);
        let mut longest = proposed.min(STABLE * self.model.longest_turn(&self.phase, y, &slips));
        for site in Site::ALL {
            let i = site as usize;
            let (s, slip, rate) = (slips.0[i], norm(slips.0[i]), rates[i].map(|rate| pace * rate));
            // the rate at which friction turns a slip, times the slip
            let turning = pace * dynamics.lever(site) * forces.most[i];
            match grips[site] {
                Grip::Slides | Grip::Creeps if dynamics.has_friction(site) && slip > dynamics.no_slip[i] => {
                    let closing = -(s[0] * rate[0] + s[1] * rate[1]);
                    if closing > 0.0 {
                        // |s|/(−d|s|/dx)
                        longest = longest.min(TOWARDS_STICK * slip * slip / closing);
                    }
                    if turning > 0.0 {
                        longest = longest.min(STABLE * slip / turning);
                    }
                }
                Grip::Starts if turning > 0.0 => {
                    let ahead = dynamics.ahead / pace;
                    longest = longest.min(ahead * STABLE.min(NOT_STARTED * turning / norm(rate)));
                }
                _ => {}
            }
        }
        longest
    }
}

/// The tolerance of restitution: what is integrated there is of order 1 and counts e times.
pub(in crate::physics::collision) fn tolerance_of_restitution(tolerance: f64, e: f64) -> f64 {
    (tolerance / e).min(MAX_TOLERANCE)
}

/// Goes through a phase to its end: its grips and the state are left as they are there. Returns q.
pub(in crate::physics::collision) fn walk<const N: usize>(
    integrator: &mut Integrator<N>,
    model: &impl Model<N>,
    phase: &mut Phase,
    y: &mut [f64; N],
) -> Result<f64, GaveUp> {
    let mut x = 0.0;
    let (mut held, mut stopped) = (None, None);
    let mut is_reversed = false;
    let most_events = (phase.dynamics.shakes() * MAX_EVENTS as f64) as usize;
    for _ in 0..most_events {
        let q = model.impulse(phase, x, y);
        // a ball that has just left the cloth may be pressed down again by a change of grip elsewhere
        for site in [Site::CueOnCloth, Site::ObjectOnCloth] {
            if phase.grips[site] == Grip::Open && model.above_cloth(y, site) <= 0.0 {
                model.land(q, y, site);
                phase.grips[site] = Grip::Slides;
                held = held.filter(|held| *held != site);
            }
        }
        let mut slips = phase.dynamics.slips(q, y);
        if let Some(site) = stopped {
            slips.0[site as usize] = [0.0; 2];
        }
        // where the balls just touch, what matters is what comes next
        let normal = model.normal(phase, y).max(TOUCH);
        let give = model.give(phase, y, phase.v_x(q, y));
        phase.grips = phase.dynamics.settle(phase.grips, held, &slips, normal, &give);
        let watched = Watched { model, phase: *phase, is_reversed };
        // a slip may have ended as the phase did
        if watched.events(x, y)[event::END] <= 0.0 {
            return Ok(q);
        }
        let end = integrator.run(&watched, x, y)?;
        is_reversed = end.x == x && watched.holds_at_once() == Some(end.event);
        (x, *y) = (end.x, end.y);
        if end.event == event::END || end.event == event::STOPPED {
            return Ok(model.impulse(phase, x, y));
        }
        (held, stopped) = (None, None);
        for site in Site::ALL {
            let i = site as usize;
            let gives_way = site == Site::Balls && phase.dynamics.kappa > 0.0;
            if gives_way && [event::GRIP[i], event::STARTED[i]].contains(&end.event) {
                let q = model.impulse(phase, x, y);
                model.change_grip(phase, q, y, end.event == event::STARTED[i]);
            } else if end.event == event::LIFT_OFF[i] {
                phase.grips[site] = Grip::Open;
                held = Some(site);
            } else if end.event == event::STARTED[i] {
                let slip = phase.dynamics.slips(model.impulse(phase, x, y), y).0[i];
                if norm(slip) > phase.dynamics.no_slip[i] {
                    phase.grips[site] = Grip::Slides;
                } else {
                    // it would stop before it has moved
                    phase.grips[site] = Grip::Sticks;
                    held = Some(site);
                }
            } else if end.event == event::GRIP[i] {
                match phase.grips[site] {
                    Grip::Slides | Grip::Starts | Grip::Creeps => {
                        x += remove_slip(&watched, i, x, y);
                        stopped = Some(site);
                    }
                    Grip::Sticks => {
                        phase.grips[site] = Grip::Starts;
                        held = Some(site);
                    }
                    Grip::Springs | Grip::Yields => {}
                    Grip::Open => {
                        model.land(model.impulse(phase, x, y), y, site);
                        phase.grips[site] = Grip::Slides;
                    }
                }
            }
        }
    }
    Err(GaveUp)
}

/// A last step, of first order, that takes away what is left of a slip; returns its length.
fn remove_slip<const N: usize, M: Model<N>>(
    watched: &Watched<M>,
    contact: usize,
    x: f64,
    y: &mut [f64; N],
) -> f64 {
    let watched_slip = watched.phase.dynamics.no_slip[contact];
    let (_, slips, _) = watched.forces(x, y);
    let s = slips.0[contact];
    let rate = watched.slip_rates(x, y)[contact];
    let closing = -(s[0] * rate[0] + s[1] * rate[1]);
    let step = (s[0] * s[0] + s[1] * s[1]) / closing;
    // its error is of the square; where the balls just touch, the friction is only about to set in
    if !(step > 0.0 && step * step <= watched_slip) {
        return 0.0;
    }
    let rates = watched.rates(x, y);
    for (y, rate) in y.iter_mut().zip(rates) {
        *y += step * rate;
    }
    step
}
