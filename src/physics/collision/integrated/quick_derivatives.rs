//! Derivatives of an impact whose contact gives way: the steps of [`quick`](super::quick) are taken again with inputs that differ a
//! little, all side by side, so that no choice of a step and no search enters the differences; at an event each goes on to where it
//! is for its own inputs.
//!
//! - Bock, H. G. (1981), in Modelling of Chemical Reaction Systems, 102–125: internal numerical differentiation.

use super::dynamics::Dynamics;
use super::lanes::{LANES, Lanes, Real};
use super::outcome;
use super::quick::{Step, of_impulses, of_state, shot};
use super::quick_equations::{Event, Grip, Shot, State};
use crate::physics::ball::{Ball, BallState};
use crate::physics::collision::{ByLaw, Column, Contact, Jacobian, Model, Others, Outcome, Regime, variable};
use crate::physics::friction_law::Friction;

/// In which lane what differs: in the order of [`variable`] from 1 on, then κ.
const KAPPA: usize = 7;
const fn lane(of: usize) -> usize {
    of + 1
}

/// By so much, of numbers of order 1: truncation and roundings of a difference are then some 1e-7.
const DIFFERENCE: f64 = 1e-7;

/// A number that differs in one lane.
fn with(value: f64, at: usize, by: f64) -> Lanes {
    let mut lanes = [value; LANES];
    lanes[at] += by;
    Lanes(lanes)
}

/// The outcome and its derivative, also by κ and by b and c of a friction that falls; `None` likewise.
pub(super) fn with_jacobian(
    model: &Model,
    cue: &BallState,
    contact: &Contact,
    dynamics: &Dynamics,
) -> Option<(Outcome, Jacobian, Others)> {
    let mut steps = Vec::with_capacity(64);
    let (_, regime) = shot(dynamics, dynamics.slip, contact.e).solve(&mut steps)?;
    let k = contact.k;
    let moved = |value: f64, of: usize| with(value, lane(of), DIFFERENCE);
    // of v/k and c·k; e may be 1
    let scaled = |value: f64, power: f64| value * ((1.0 + DIFFERENCE).powf(power) - 1.0);
    let slip = |i: usize, of: usize| {
        let mut slip = moved(dynamics.slip[i], of);
        slip.0[lane(variable::K)] += scaled(dynamics.slip[i], -1.0);
        slip
    };
    let (mu, falls) = match dynamics.friction {
        Friction::Constant(mu) => (mu, None),
        Friction::Exponential { a, b, c } => {
            (a, Some((Lanes::from(b), with(c * k, lane(variable::K), scaled(c * k, 1.0)))))
        }
    };
    let slip = [slip(0, variable::V_Y), slip(1, variable::V_Z)];
    let shots = Shot {
        mu: moved(mu, variable::MU),
        falls,
        mu_s: moved(dynamics.mu_s, variable::M_S),
        e: with(contact.e, lane(variable::E), -DIFFERENCE),
        kappa: with(dynamics.kappa, KAPPA, DIFFERENCE),
        ..shot(dynamics, slip, Lanes::from(contact.e))
    };
    let y = shots.follow(&steps);
    let first = y.map(|component| component.0[0]);
    let found = outcome(model, cue, &of_state(k, &first), regime);
    let by = |at: usize| {
        let slope = y.map(|component| (component.0[at] - component.0[0]) / DIFFERENCE);
        match at {
            // impulses are k times y, and v_y, v_z k times the slip
            _ if at == lane(variable::K) => std::array::from_fn(|i| first[i] + slope[i]),
            _ if at == lane(variable::V_Y) || at == lane(variable::V_Z) => slope,
            _ if at == lane(variable::E) => slope.map(|slope| -k * slope),
            _ => slope.map(|slope| k * slope),
        }
    };
    let (jacobian, by_kappa) = jacobian(model, by);
    Some((found, jacobian, (by_kappa, by_law(model, dynamics, contact.e, &steps))))
}

/// By b and c, in the first lanes that differ, of a friction that falls with the slip during the impact.
fn by_law(model: &Model, dynamics: &Dynamics, e: f64, steps: &[Step]) -> Option<ByLaw> {
    let Friction::Exponential { b, c, .. } = dynamics.friction else { return None };
    let mut by_law = ByLaw::zeros();
    let k = dynamics.k;
    let falls = Some((with(b, 1, DIFFERENCE), with(c * k, 2, DIFFERENCE)));
    let y = Shot { falls, ..shot(dynamics, dynamics.slip.map(Lanes::from), Lanes::from(e)) }.follow(steps);
    // impulses are k times y, and the exponent goes with c·k
    for (column, scale) in [k, k * k].into_iter().enumerate() {
        let slope = y.map(|component| scale * (component.0[column + 1] - component.0[0]) / DIFFERENCE);
        by_law.set_column(column, &of_rest(model, &slope));
    }
    Some(by_law)
}

/// The outcome is linear in the impulses: what these alone make of balls at rest.
fn of_rest(model: &Model, impulses: &State<f64>) -> Column {
    outcome(model, &BallState::default(), &of_impulses(impulses), Regime::Slide).components()
}

/// The impulses follow from v_y = −U_y − Rω_z, v_z = Rω_y and k = U_x.
fn jacobian(model: &Model, impulses_by: impl Fn(usize) -> State<f64>) -> (Jacobian, Column) {
    let by_lane = |at: usize| of_rest(model, &impulses_by(at));
    let by = |of: usize| by_lane(lane(of));
    let Ball { radius, .. } = model.ball;
    let (by_v_y, on) = (by(variable::V_Y), model.effects);
    let where_on = |on: bool, of: usize| if on { by(of) } else { Column::zeros() };
    let mut jacobian = Jacobian::from_columns(&[
        where_on(on.friction, variable::MU),
        where_on(on.cloth, variable::M_S),
        where_on(on.inelasticity, variable::E),
        by(variable::K),
        -by_v_y,
        Column::zeros(),
        radius * by(variable::V_Z),
        -radius * by_v_y,
    ]);
    for (column, row) in [0, 1, 3, 4, 5].into_iter().enumerate() {
        jacobian[(row, 3 + column)] += 1.0;
    }
    (jacobian, by_lane(KAPPA))
}

impl<T: Real> Shot<T> {
    /// Takes steps that were found before.
    fn follow(&self, steps: &[Step]) -> State<T> {
        let (mut mode, mut y) = self.start();
        for Step { mode: next, length, event } in steps {
            self.change(&mode, next, &mut y);
            mode = *next;
            let rates = self.rates(&mode, &y);
            y = self.step(&mode, &y, &rates, *length).0;
            // where the spring's end stops sliding, the rates of all impulses are continuous: that is of second order
            let catches = |event: &Event| *event == Event::Grip && mode.grip == Grip::Yields;
            if let Some((event, rate)) = event.filter(|(event, _)| !catches(event)) {
                // the event is where its function vanishes, whatever the inputs
                let off = self.events(&mode, &y)[event as usize];
                let later = (off - off.first()) * -rate.recip();
                let rates = self.rates(&mode, &y);
                for (y, rate) in y.iter_mut().zip(rates) {
                    *y += rate * later;
                }
            }
        }
        y
    }
}
