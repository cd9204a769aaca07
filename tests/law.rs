//! Friction that decreases with the slip, fitted: a, b and c of μ(v) = a + b exp(−c v).

use crate::prelude::*;
use crate::study::check_errors;

const B: f64 = 0.09;
const C: f64 = 1.088;

/// Data sets, or as many as `CAROMFIT_SETS` says.
const SETS: usize = 12;

fn spec(seed: u64, speed_m_s: [f64; 2]) -> Spec {
    let usual = synthetic::spec("impacts", &["stun", "natural-roll", "draw"], 60, seed);
    let keys = format!(
        "truth.mu = 0.02\nshots = {{ speed_m_s = {speed_m_s:?}, cut_deg = [-60, 60] }}\nnoise.velocity_m_s = 0.003"
    );
    with(&usual, &keys)
}

fn made(spec: &Spec, fidelity: Fidelity, law: Law) -> Dataset {
    made_with(spec, &Model { law, tolerance: 1e-8, ..Model::new(fidelity, Ball::POOL) })
}

fn fitted(mut dataset: Dataset, frees_c: bool, options: &Options) -> Fit {
    dataset.settings[Parameter::C].fixed = !frees_c;
    let options = Options { falling: Falling::Fitted, ..*options };
    options::fitted_with(&dataset, &options)
}

const LAW: Law = Law::Exponential { b: B, c: C };

/// μ, μ_s, e, b and c.
const TRUTH: [f64; 5] = [0.02, 0.3, 0.94, B, C];

/// Asserts that μ, μ_s, e and b are right within their errors.
fn check_estimates(fit: &Fit) {
    for parameter in [Parameter::Mu, Parameter::MuS, Parameter::E, Parameter::B] {
        is_right(fit, parameter, TRUTH[parameter as usize]);
    }
}

#[test]
fn a_and_b_are_recovered() {
    let options = Options { depth: Depth::Intervals, ..options::of_fit() };
    let of = |seed| fitted(made(&spec(seed, [0.5, 5.0]), Fidelity::Full, LAW), false, &options);
    let fits: Vec<Fit> = (0..count("CAROMFIT_SETS", SETS) as u64).map(of).collect();
    check_errors(&fits, &[Parameter::Mu, Parameter::MuS, Parameter::E, Parameter::B], &TRUTH);
    assert!(fits.iter().all(|fit| fit.estimates()[Parameter::C as usize].status == Status::Fixed));
}

#[test]
fn c_is_recovered_too_from_a_wide_range_of_slips() {
    let wide = |seed| with(&spec(seed, [0.3, 8.0]), "shots.count = 150");
    let options = Options { depth: Depth::Estimates, ..options::of_fit() };
    let of = |seed| fitted(made(&wide(seed), Fidelity::Full, LAW), true, &options);
    // of 150 shots each
    let sets = count("CAROMFIT_SETS", SETS / 2);
    let fits: Vec<Fit> = (0..sets as u64).map(of).filter(|fit| fit.converged()).collect();
    // where a shot begins to stick the weights may turn in circles, and the fit says so
    assert!(fits.len() + sets.div_ceil(20) >= sets, "{}", fits.len());
    check_errors(&fits, &[Parameter::Mu, Parameter::B, Parameter::C], &TRUTH);
}

/// What `full` takes at the first slip `ode` follows: the correction brings it back.
#[test]
fn what_ode_made_ode_recovers() {
    let options = Options { fidelity: Fidelity::Ode.into(), depth: Depth::Estimates, ..options::of_fit() };
    for seed in 0..3 {
        let fit = fitted(made(&spec(seed, [0.5, 5.0]), Fidelity::Ode, LAW), false, &options);
        check_estimates(&fit);
    }
}

/// Half of the sets end on the bound 0 with a one-sided interval, and 0 is within nearly all.
#[test]
fn constant_friction_gives_no_b() {
    let mut at_bound = 0;
    for seed in 0..20 {
        let fit =
            fitted(made(&spec(seed, [0.5, 5.0]), Fidelity::Full, Law::Constant), false, &options::of_fit());
        let b = fit.estimates()[Parameter::B as usize];
        let [low, high] = b.interval_95.unwrap();
        if b.status == Status::AtLowerBound {
            at_bound += 1;
            assert!(low == 0.0 && high > 0.0 && b.value == 0.0, "{seed}: {low} {high}");
            assert!(
                fit.warnings().iter().any(|w| w.starts_with("b ends on its lower bound 0")),
                "{:?}",
                fit.warnings()
            );
        } else {
            assert!(b.value < 3.5 * b.std_error.unwrap(), "{seed}: {}", b.value);
        }
    }
    assert!((3..=17).contains(&at_bound), "{at_bound}");
}

/// With nearly one slip only, a + b exp(−c v) is one number.
#[test]
fn one_slip_does_not_tell_a_from_b() {
    let same = with(&spec(1, [2.0, 2.0]), "shots = { cut_deg = [30, 30], cue_spin = [\"stun\"] }");
    let dataset = made(&same, Fidelity::Full, LAW);
    let fit = fitted(dataset, false, &options::of_fit());
    // whether b ends on its bound 0 or not
    let is_said = |said: &&str| {
        said.contains("poorly distinguish μ from b") || said.contains("poorly distinguish μ and b apart")
    };
    assert!(fit.warnings().iter().any(is_said), "{:#?}", fit.warnings());
}
