//! Integration of the equations of a contact, with events and with steps that can be repeated.
//!
//! Derivatives of an outcome come from repeating the recorded steps with inputs changed a little,
//! each event met at its new place: their differences are smooth (Bock 1981).

use nalgebra::SVector;

use super::contact::{EVENTS, Mode, N, Shot, State};
use super::impact::{Values, complete, components};
use super::{Fidelity, Input, Jacobian, Model, NotACollision, Outcome, Regime};
use crate::numerics::dormand_prince::{self, Step as Advance, ahead, cubic, root};

/// Largest number of steps. Impacts take some dozen to some hundred; stiff contacts shake.
const MAX_STEPS: usize = 300_000;

/// Most steps of Newton's to an event.
const MAX_TRIALS: usize = 40;

/// A step: its mode and length, and the event at its end, with its function's value and slope
/// there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    mode: Mode,
    length: f64,
    event: Option<(usize, f64, f64)>,
}

/// Returns the outcome to the tolerance of the model, and the steps to it.
pub(super) fn solve(values: &Values<f64>, model: &Model) -> Result<(Outcome, Vec<Step>), NotACollision> {
    let shot = Shot::new(values, model);
    let mut steps = Vec::with_capacity(64);
    let y = integrate(&shot, model.tolerance, &mut steps)
        .ok_or(NotACollision::NotIntegrated { tolerance: model.tolerance, kappa: model.kappa })?;
    let stuck = steps.iter().any(|step| step.mode.is_stuck());
    let regime = if stuck { Regime::Stick } else { Regime::Slide };
    Ok((Outcome::new(regime, values, model, &shot.impulses(values, model, &y)), steps))
}

/// Returns the outcome and its derivatives by the inputs: differences of the recorded integration,
/// followed with each input changed a little.
pub(super) fn differentiate(
    values: &Values<f64>,
    model: &Model,
) -> Result<(Outcome, Jacobian), NotACollision> {
    let (outcome, mut steps) = solve(values, model)?;
    let (mut values, mut here) = (*values, outcome.components());
    let (k, radius) = (values[Input::VelocityX], model.ball.radius);
    // a shorter restitution is not followed
    let least = 1e-6 - (values[Input::E] - values[Input::ESlope] * k);
    if least > 0.0 && model.effects.inelasticity {
        values = values.moved(Input::E, least);
        let longer = solve(&values, model)?;
        (here, steps) = (longer.0.components(), longer.1);
    }
    let beside = |values: &Values<f64>| {
        let shot = Shot::new(values, model);
        let y = follow(&shot, &steps);
        SVector::from(components(values, model, &shot.impulses(values, model, &y)))
    };
    let plain = model.fidelity == Fidelity::Ode;
    let mut by = Jacobian::zeros();
    for input in Input::ALL.into_iter().filter(|input| !Values::is_off(*input, model)) {
        let scale = match input {
            Input::SpinX | Input::SpinZ if plain => continue,
            Input::ESlope => continue,
            Input::VelocityX | Input::VelocityY => k,
            Input::SpinX | Input::SpinY | Input::SpinZ => k / radius,
            Input::Kappa => model.kappa,
            _ => 1.0,
        };
        // the error of derivatives is of this order, too
        let step = 1e-7 * scale;
        by.set_column(input as usize, &((beside(&values.moved(input, step)) - here) / step));
    }
    complete(&mut by, &values, model, plain);
    Ok((outcome, by))
}

/// Returns the state at the end, and records the steps to there.
fn integrate(shot: &Shot, tolerance: f64, steps: &mut Vec<Step>) -> Option<State> {
    let mut mode = shot.first_mode();
    let mut y = shot.first_state(&mode);
    let (mut h, mut last): (f64, _) = (FIRST_STEP, None);
    let mut rates = shot.rates(&mode, &y);
    for _ in 0..MAX_STEPS {
        let (next, longest) = shot.prepare(&mode, &y);
        if next != mode {
            shot.change(&mode, &next, &mut y);
            mode = next;
            rates = shot.rates(&mode, &y);
        }
        h = h.min(longest);
        let Advance { state: there, rates: rates_there, error } = advance(shot, &mode, &y, &rates, h);
        let factor = 0.9 * (tolerance / error.max(f64::MIN_POSITIVE)).powf(0.2);
        if !(error <= tolerance) {
            h *= if factor > 0.1 { factor.min(0.9) } else { 0.1 };
            continue;
        }
        let (before, after) = (shot.events(&mode, &y), shot.events(&mode, &there));
        let between = |at: f64| cubic([&y, &rates], [&there, &rates_there], h, at);
        let first = (0..EVENTS)
            // just after an event its function is a rounding of 0
            .filter(|event| before[*event] > if last == Some(*event) { 1e-15 } else { 0.0 })
            .filter(|event| after[*event] <= 0.0)
            .map(|event| (root(|at| shot.events(&mode, &between(at))[event], h), event))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((at, event)) = first else {
            steps.push(Step { mode, length: h, event: None });
            (y, rates) = (there, rates_there);
            h *= factor.clamp(0.2, 4.0);
            last = None;
            continue;
        };
        let step;
        (y, step) = locate(shot, &mode, (&y, &rates), [at, h], event);
        steps.push(step);
        last = Some(event);
        let Some(next) = shot.after(&mode, event) else { return Some(y) };
        shot.change(&mode, &next, &mut y);
        mode = next;
        rates = shot.rates(&mode, &y);
        h = h.max(FIRST_STEP);
    }
    None
}

/// The first step, and the least that is tried after an event.
const FIRST_STEP: f64 = 0.01;

/// Returns the state at an event and the step to it, by Newton's method from near it.
fn locate(
    shot: &Shot,
    mode: &Mode,
    (y, rates): (&State, &State),
    [mut at, h]: [f64; 2],
    event: usize,
) -> (State, Step) {
    let mut trials = 0;
    loop {
        let Advance { state, rates, .. } = advance(shot, mode, y, rates, at);
        let function = |after: f64| shot.events(mode, &ahead(&state, after, [&rates], [1.0]))[event];
        let value = function(0.0);
        let probe = 1e-4 * h;
        let slope = (function(probe) - function(-probe)) / (2.0 * probe);
        let off = value / slope;
        trials += 1;
        if !(off.abs() >= 1e-11 * h) || trials == MAX_TRIALS {
            return (state, Step { mode: *mode, length: at, event: Some((event, value, slope)) });
        }
        at = (at - off).clamp(0.0, h);
    }
}

/// Returns the state at the end of the recorded steps for a shot that differs a little.
fn follow(shot: &Shot, steps: &[Step]) -> State {
    let mut mode = steps.first().map_or(shot.first_mode(), |first| first.mode);
    let mut y = shot.first_state(&mode);
    for Step { mode: next, length, event } in steps {
        shot.change(&mode, next, &mut y);
        mode = *next;
        let Advance { state, rates, .. } = advance(shot, next, &y, &shot.rates(next, &y), *length);
        y = state;
        if let Some((event, value, slope)) = event {
            let later = (value - shot.events(next, &y)[*event]) / slope;
            // an event that is grazed has no new place
            if later.abs() < FIRST_STEP {
                y = ahead(&y, later, [&rates], [1.0]);
            }
        }
    }
    y
}

#[inline(never)]
fn advance(shot: &Shot, mode: &Mode, y: &State, rates: &State, h: f64) -> Advance<N> {
    dormand_prince::step(|y| shot.rates(mode, y), y, rates, h)
}
