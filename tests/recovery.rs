//! Synthetic data with known parameters: estimates within their own error bars.

use caromfit::fit;
use caromfit::fit::{Depth, Fit, Options, Status};
use caromfit::measurement::parameter::Parameter;
use caromfit::simulate::{Kind, Noise, Played, Spec};

use crate::frames::count;
use crate::options;
use crate::synthetic::{self, TRUTH, check_errors, made};

/// Data sets of each kind; CAROMFIT_SETS may raise it. The mean of that many standardized errors scatters by 1/√200 = 0.07,
/// their standard deviation by 0.05, coverage by 1.5 %.
const SEEDS: usize = 200;

fn spec(kind: Kind, cue_spin: &[Played], seed: u64) -> Spec {
    synthetic::spec(kind, cue_spin, 40, seed)
}

fn fitted(spec: &Spec, depth: Depth) -> Fit {
    fit::fit(&made(spec), &Options { depth, ..options::of_fit() }).unwrap().remove(0)
}

/// Fits many data sets and compares errors with what the fits say of them.
fn check(kind: Kind, cue_spin: &[Played], parameters: &[Parameter], depth: Depth) {
    let seeds = 0..count("CAROMFIT_SETS", SEEDS) as u64;
    let fits: Vec<Fit> = seeds.map(|seed| fitted(&spec(kind, cue_spin, seed), depth)).collect();
    println!("{kind:?} {cue_spin:?}");
    let is_free =
        |fit: &Fit, parameter: &Parameter| fit.estimates[*parameter as usize].status == Status::Free;
    assert!(fits.iter().all(|fit| parameters.iter().all(|parameter| is_free(fit, parameter))));
    check_errors(&fits, parameters, &TRUTH);
    let chi2: f64 = fits.iter().map(|fit| fit.chi2 / fit.dof as f64).sum::<f64>() / fits.len() as f64;
    // of 200 data sets with some 150 degrees of freedom each: ±0.008
    assert!((chi2 - 1.0).abs() < 0.03, "mean χ²/dof {chi2}");
}

#[test]
fn impacts_in_natural_roll() {
    check(Kind::Impacts, &[Played::NaturalRoll], &Parameter::COEFFICIENTS, Depth::Intervals);
}

#[test]
fn impacts_with_measured_spin() {
    // each shot has five inputs: profiles would take a minute
    let played = [Played::Stun, Played::NaturalRoll, Played::Draw, Played::Side];
    check(Kind::Impacts, &played, &Parameter::COEFFICIENTS, Depth::Estimates);
}

#[test]
fn angles_in_natural_roll() {
    check(Kind::Angles, &[Played::NaturalRoll], &Parameter::COEFFICIENTS, Depth::Intervals);
}

#[test]
fn stun_shots_do_not_tell_the_cloth() {
    check(Kind::Impacts, &[Played::Stun], &[Parameter::Mu, Parameter::E], Depth::Intervals);
    let fit = fitted(&spec(Kind::Impacts, &[Played::Stun], 0), Depth::Intervals);
    let mu_s = fit.estimates[Parameter::MuS as usize];
    assert_eq!((mu_s.status, mu_s.value), (Status::NotIdentified, 0.3));
    assert!(mu_s.std_error.is_none() && mu_s.interval_95.is_none());
    assert!(fit.notes().iter().any(|note| note.contains("no shot has topspin")), "{:?}", fit.notes());
}

#[test]
fn exact_data_give_the_parameters_back() {
    /// Without noise only the optimiser's tolerance and the 17 digits of the file are left.
    const EXACT: f64 = 1e-9;
    for kind in [Kind::Impacts, Kind::Angles] {
        let exact = Spec { noise: Noise::default(), ..spec(kind, &[Played::NaturalRoll], 5) };
        for (estimate, truth) in fitted(&exact, Depth::Estimates).estimates.iter().zip(TRUTH) {
            assert!((estimate.value - truth).abs() < EXACT, "{kind:?} {estimate:?}");
        }
    }
}
