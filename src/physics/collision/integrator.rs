//! Integration of the equations of a contact: Dormand and Prince's pair of order 5(4) (J. Comput. Appl. Math. 6, 19 (1980)), with
//! events and with steps that can be repeated.
//!
//! Derivatives of an outcome come from repeating the recorded steps with inputs changed a little, each event met where it then is:
//! their differences are smooth (Bock 1981).

/// Largest number of steps. Impacts take some dozen to some hundred; stiff contacts shake.
const MAX_STEPS: usize = 300_000;

/// Largest number of trials for an event.
const MAX_TRIALS: usize = 40;

/// The function of an event that has just been begins the next step as a rounding of 0 if it is below this.
const ROUNDING: f64 = 1e-15;

/// An event is located to this part of the step.
const LOCATED: f64 = 1e-11;

/// Probe for the slope of an event's function, in parts of the step.
const PROBE: f64 = 1e-4;

/// The number of events of a system.
pub(super) const EVENTS: usize = 4;

/// The equations of motion, as they are in a mode.
pub(super) trait System<const N: usize> {
    /// Which equations hold.
    type Mode: Copy;

    /// The state's rates.
    fn rates(&self, mode: &Self::Mode, y: &[f64; N]) -> [f64; N];

    /// Functions that are positive until their event.
    fn events(&self, mode: &Self::Mode, y: &[f64; N]) -> [f64; EVENTS];

    /// The mode for the next step, and the longest step that is stable.
    fn prepare(&self, mode: &Self::Mode, y: &[f64; N]) -> (Self::Mode, f64);

    /// The mode after an event; `None` at the end.
    fn after(&self, mode: &Self::Mode, event: usize) -> Option<Self::Mode>;

    /// Brings the state from the form of one mode into that of another.
    fn change(&self, from: &Self::Mode, to: &Self::Mode, y: &mut [f64; N]);
}

/// The integration takes too many steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct TooManySteps;

/// A step: its mode and length, and if it ends with an event, that event's function there and its slope.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<M> {
    pub mode: M,
    length: f64,
    event: Option<(usize, f64, f64)>,
}

/// The state at the end, from `mode` and `y`, and the event that ends it. The steps to there are recorded.
pub(super) fn integrate<const N: usize, S: System<N>>(
    system: &S,
    mut mode: S::Mode,
    mut y: [f64; N],
    tolerance: f64,
    steps: &mut Vec<Step<S::Mode>>,
) -> Result<([f64; N], usize), TooManySteps> {
    let (mut h, mut last): (f64, _) = (FIRST_STEP, None);
    for _ in 0..MAX_STEPS {
        let (next, longest) = system.prepare(&mode, &y);
        system.change(&mode, &next, &mut y);
        mode = next;
        h = h.min(longest);
        let rates = system.rates(&mode, &y);
        let (there, rates_there, error) = step(system, &mode, &y, &rates, h);
        let factor = 0.9 * (tolerance / error.max(f64::MIN_POSITIVE)).powf(0.2);
        if !(error <= tolerance) {
            h *= if factor > 0.1 { factor.min(0.9) } else { 0.1 };
            continue;
        }
        let (before, after) = (system.events(&mode, &y), system.events(&mode, &there));
        let between = |at: f64| cubic([&y, &rates], [&there, &rates_there], h, at);
        let first = (0..EVENTS)
            .filter(|event| before[*event] > if last == Some(*event) { ROUNDING } else { 0.0 })
            .filter(|event| after[*event] <= 0.0)
            .map(|event| {
                let function = |at: f64| system.events(&mode, &between(at))[event];
                (root(function, [before[event], after[event]], h), event)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((at, event)) = first else {
            steps.push(Step { mode, length: h, event: None });
            y = there;
            h *= factor.clamp(0.2, 4.0);
            last = None;
            continue;
        };
        let (length, state, value, slope) = locate(system, &mode, (&y, &rates), [at.min(h), h], event);
        steps.push(Step { mode, length, event: Some((event, value, slope)) });
        y = state;
        last = Some(event);
        let Some(next) = system.after(&mode, event) else { return Ok((y, event)) };
        system.change(&mode, &next, &mut y);
        mode = next;
        h = h.max(AFTER_EVENT);
    }
    Err(TooManySteps)
}

/// The first step, and the least that is tried after an event.
const FIRST_STEP: f64 = 0.05;
const AFTER_EVENT: f64 = 1e-3;

/// Newton's method from near an event, with steps that end there: the step's length, the state, the function and its slope.
fn locate<const N: usize, S: System<N>>(
    system: &S,
    mode: &S::Mode,
    (y, rates): (&[f64; N], &[f64; N]),
    [mut at, h]: [f64; 2],
    event: usize,
) -> (f64, [f64; N], f64, f64) {
    let mut trials = 0;
    loop {
        let state = step(system, mode, y, rates, at).0;
        let value = system.events(mode, &state)[event];
        let rates = system.rates(mode, &state);
        let [later, earlier] =
            [PROBE * h, -PROBE * h].map(|dt| system.events(mode, &ahead(&state, dt, [&rates], [1.0]))[event]);
        let slope = (later - earlier) / (2.0 * PROBE * h);
        let off = value / slope;
        trials += 1;
        if !(off.abs() >= LOCATED * h) || trials == MAX_TRIALS {
            return (at, state, value, slope);
        }
        at = (at - off).clamp(0.0, h);
    }
}

/// The state at the end of the recorded steps for a system that differs a little.
pub(super) fn follow<const N: usize, S: System<N>>(
    system: &S,
    mut y: [f64; N],
    steps: &[Step<S::Mode>],
) -> [f64; N] {
    let mut mode = steps.first().map(|first| first.mode);
    for Step { mode: next, length, event } in steps {
        if let Some(mode) = &mode {
            system.change(mode, next, &mut y);
        }
        mode = Some(*next);
        y = step(system, next, &y, &system.rates(next, &y), *length).0;
        if let Some((event, value, slope)) = event {
            let later = (value - system.events(next, &y)[*event]) / slope;
            y = ahead(&y, later, [&system.rates(next, &y)], [1.0]);
        }
    }
    y
}

/// A step of order 5: the state there, its rates, and the largest error.
#[inline(never)]
fn step<const N: usize, S: System<N>>(
    system: &S,
    mode: &S::Mode,
    y: &[f64; N],
    k1: &[f64; N],
    h: f64,
) -> ([f64; N], [f64; N], f64) {
    let rates = |y: &[f64; N]| system.rates(mode, y);
    let k2 = rates(&ahead(y, h, [k1], A2));
    let k3 = rates(&ahead(y, h, [k1, &k2], A3));
    let k4 = rates(&ahead(y, h, [k1, &k2, &k3], A4));
    let k5 = rates(&ahead(y, h, [k1, &k2, &k3, &k4], A5));
    let k6 = rates(&ahead(y, h, [k1, &k2, &k3, &k4, &k5], A6));
    let there = ahead(y, h, [k1, &k3, &k4, &k5, &k6], B);
    let k7 = rates(&there);
    let error = ahead(&[0.0; N], h, [k1, &k3, &k4, &k5, &k6, &k7], E);
    // also finds a NaN
    let largest = error.iter().fold(0.0, |most, e| if e.abs() <= most { most } else { e.abs() });
    (there, k7, largest)
}

#[inline(always)]
fn ahead<const N: usize, const M: usize>(
    y: &[f64; N],
    h: f64,
    rates: [&[f64; N]; M],
    by: [f64; M],
) -> [f64; N] {
    let mut there = *y;
    for (rates, by) in rates.into_iter().zip(by) {
        let by = by * h;
        for i in 0..N {
            there[i] += by * rates[i];
        }
    }
    there
}

/// The cubic through both ends of a step.
fn cubic<const N: usize>([y, k]: [&[f64; N]; 2], [y1, k1]: [&[f64; N]; 2], h: f64, at: f64) -> [f64; N] {
    let (t, rest) = (at / h, 1.0 - at / h);
    std::array::from_fn(|i| {
        let d = y1[i] - y[i];
        rest * y[i] + t * y1[i] + t * rest * (rest * (k[i] * h - d) + t * (d - k1[i] * h))
    })
}

/// Where a function falls through 0 between 0 and `h`, to a millionth of it, by regula falsi (Illinois).
fn root(f: impl Fn(f64) -> f64, [before, after]: [f64; 2], h: f64) -> f64 {
    let (mut low, mut high, mut at) = ((0.0, before), (h, after), h);
    for _ in 0..MAX_TRIALS {
        let next = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        if (next - at).abs() < 1e-6 * h {
            return next;
        }
        at = next;
        let value = f(at);
        if value > 0.0 {
            low = (at, value);
            high.1 *= 0.5;
        } else {
            high = (at, value);
            low.1 *= 0.5;
        }
    }
    at
}

const A2: [f64; 1] = [1.0 / 5.0];
const A3: [f64; 2] = [3.0 / 40.0, 9.0 / 40.0];
const A4: [f64; 3] = [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0];
const A5: [f64; 4] = [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0];
const A6: [f64; 5] = [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0];
const B: [f64; 5] = [35.0 / 384.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0];
const E: [f64; 6] =
    [71.0 / 57600.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];
