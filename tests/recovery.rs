//! Tables of known parameters: estimates are as far off as their errors say, and intervals hold.

use crate::prelude::*;
use crate::study::check_errors;
use crate::synthetic::made_of_weighed_balls;

/// Data sets of each kind; CAROMFIT_SETS may raise it. The mean of that many standardized errors scatters by 1/√200 = 0.07,
/// their standard deviation by 0.05, coverage by 1.5 %.
const SEEDS: usize = 200;

/// Fits many data sets and compares errors with what the fits say of them.
fn check(kind: &str, cue_spin: &[&str], depth: Depth) {
    let seeds = 0..count("CAROMFIT_SETS", SEEDS) as u64;
    let of = |seed: u64| options::fitted(&made(&spec(kind, cue_spin, 40, seed)), depth);
    let is_free = |fit: &Fit| fit.estimates()[..3].iter().all(|found| found.status == Status::Free);
    // a mass ratio that is three errors off may put μ_s on its bound: one of 1000 does
    let (fits, at_bounds): (Vec<Fit>, Vec<Fit>) = seeds.map(of).partition(is_free);
    assert!(400 * at_bounds.len() < fits.len(), "{} at bounds", at_bounds.len());
    check_errors(&fits, &Parameter::COEFFICIENTS, &TRUTH);
    let chi2: f64 = fits.iter().map(|fit| fit.chi2() / fit.dof() as f64).sum::<f64>() / fits.len() as f64;
    // of 200 data sets with some 150 degrees of freedom each: ±0.008
    assert!((chi2 - 1.0).abs() < 0.03, "mean χ²/dof {chi2}");
}

#[test]
fn errors_of_impacts_in_natural_roll_are_true() {
    check("impacts", &["natural-roll"], Depth::Intervals);
}

#[test]
fn errors_of_impacts_with_measured_spin_are_true() {
    // each shot has five inputs: profiles would take a minute
    let played = ["stun", "natural-roll", "draw", "side"];
    check("impacts", &played, Depth::Estimates);
}

#[test]
fn errors_of_angles_in_natural_roll_are_true() {
    check("angles", &["natural-roll"], Depth::Intervals);
}

/// The line of centres errs by 1°, as from a film of few pixels, and spins by 3 rad/s. Differences that are linearised at what
/// was measured would put e 1.0 standard errors too low, and cover it in 83 % only.
#[test]
fn large_errors_before_the_impact_do_not_bias() {
    const LARGE: &str = "noise = { line_of_centres_deg = 1, spin_rad_s = 3 }";
    let fitted = |seed: u64| {
        let usual = spec("impacts", &["natural-roll", "draw"], 40, seed);
        options::fitted(&made_of_weighed_balls(&with(&usual, LARGE)), Depth::Intervals)
    };
    let fits: Vec<Fit> = (0..count("CAROMFIT_SETS", 60) as u64).map(fitted).collect();
    assert!(fits.iter().all(|fit| fit.converged()));
    for parameter in Parameter::COEFFICIENTS {
        Pulls::of(&fits, parameter, TRUTH[parameter as usize]).check(parameter.name(), [0.93, 0.97]);
    }
}

#[test]
fn stun_shots_do_not_tell_the_cloth() {
    let fit = options::fitted(&made(&spec("impacts", &["stun"], 40, 0)), Depth::Intervals);
    let mu_s = fit.estimates()[Parameter::MuS as usize];
    assert_eq!((mu_s.status, mu_s.value), (Status::NotIdentified, 0.3));
    assert!(mu_s.std_error.is_none() && mu_s.interval_95.is_none());
    assert!(fit.notes().iter().any(|note| note.contains("no shot has topspin")), "{:?}", fit.notes());
}

#[test]
fn exact_data_give_the_parameters_back() {
    /// Without noise only the optimiser's tolerance and the 17 digits of the file are left.
    const SAME: f64 = 1e-9;
    for kind in ["impacts", "angles"] {
        let exact = with(&spec(kind, &["natural-roll"], 40, 5), EXACT);
        let fit = options::fitted(&made(&exact), Depth::Estimates);
        for (estimate, truth) in fit.estimates().iter().zip(TRUTH) {
            assert!((estimate.value - truth).abs() < SAME, "{kind:?} {estimate:?}");
        }
    }
}

#[test]
fn the_minimum_is_that_of_all_inputs_and_parameters_at_once() {
    /// Of a standard error and of χ²: the independent minimum is known to 1e-8; ours is 3e-7 off, which is not explained yet.
    const SAME: f64 = 1e-6;
    let folder = root().join("tests/reference/odr");
    let expected = fs::read_to_string(folder.join("minimum.json")).unwrap();
    let expected: Value = serde_json::from_str(&expected).unwrap();
    // the independent minimum takes the masses for equal
    let dataset = Dataset { object: Some(ObjectBall::exact(Ball::POOL)), ..io::load(&folder).unwrap() };
    let fit = options::fitted(&dataset, Depth::Estimates);
    assert!(fit.converged(), "{}", part(&fit, "/termination"));
    for (i, estimate) in fit.estimates().iter().enumerate() {
        let value = expected[estimate.parameter.name()].as_f64().unwrap();
        let error = expected["errors"][i].as_f64().unwrap();
        let off = (estimate.value - value) / error;
        let errors = estimate.std_error.unwrap() / error - 1.0;
        assert!(off.abs() < SAME && errors.abs() < SAME, "{}: {off}, {errors}", estimate.parameter.name());
    }
    let chi2 = expected["chi2"].as_f64().unwrap();
    assert!((fit.chi2() / chi2 - 1.0).abs() < SAME, "{} for {chi2}", fit.chi2());
}
