//! Robust losses of frames: a shot that was wrong counts less, and errors are from the scatter of the shots.

use caromfit::fit;
use caromfit::fit::{Depth, Fit, Options};
use caromfit::measurement::loss::Loss;
use caromfit::measurement::parameter::Parameter;
use caromfit::measurement::track::TrackShot;
use caromfit::simulate;
use caromfit::simulate::{Kind, Played, Spec, Truth};
use rayon::prelude::*;

use crate::frames::{count, dataset};
use crate::options;
use crate::synthetic::spec;

const TRUTH: Truth =
    Truth { mu: 0.05, mu_s: 0.25, e: 0.94, kappa: None, mu_b: None, mu_c: None, e_slope: None };

/// Standard errors by which a value may be off.
const ERRORS: f64 = 3.5;

fn film(truth: Truth, seed: u64) -> Vec<TrackShot> {
    let spec = Spec { truth, ..spec(Kind::Tracks, &[Played::NaturalRoll], 40, seed) };
    simulate::filmed(&spec).unwrap().into_iter().map(|(shot, _)| shot).collect()
}

fn fitted(film: Vec<TrackShot>, loss: Loss) -> Fit {
    let options = Options { loss: Some(loss), depth: Depth::Estimates, ..options::of_fit() };
    fit::fit(&dataset(film), &options).unwrap().remove(0)
}

fn pull(fit: &Fit, parameter: Parameter) -> f64 {
    let truth = [TRUTH.mu, TRUTH.mu_s, TRUTH.e][parameter as usize];
    let estimate = fit.get(parameter).unwrap();
    (estimate.value - truth) / estimate.std_error.unwrap()
}

/// Every eighth shot was played with other balls. No frame of it is wrong: what is wrong is seen only against the other shots.
#[test]
fn shots_with_other_balls_count_less() {
    let (mut shots, others) = (film(TRUTH, 51), film(Truth { mu: 0.09, e: 0.90, ..TRUTH }, 51));
    for i in (0..40).step_by(8) {
        shots[i] = others[i].clone();
    }
    for loss in [Loss::Huber, Loss::Cauchy] {
        let fit = fitted(shots.clone(), loss);
        assert_eq!(fit.method_name(), "joint");
        assert!(fit.converged && fit.shots_used == 40, "{}", fit.termination);
        let robust = fit.diagnostics.robust.as_ref().unwrap();
        let mut least: Vec<&str> = robust.weights.iter().take(5).map(|one| one.shot.as_str()).collect();
        least.sort_unstable();
        let mut wrong = [0, 8, 16, 24, 32].map(|i| shots[i].name.as_str());
        wrong.sort_unstable();
        assert_eq!(least, wrong, "{:?}", robust.weights);
        for parameter in Parameter::COEFFICIENTS {
            // Huber's loss bounds what a wrong shot does, and does not undo it
            let off = pull(&fit, parameter).abs();
            assert!(loss == Loss::Huber || off < ERRORS, "{loss:?} {parameter:?} {off}");
        }
    }
    // least squares count no shot less: they leave such shots out
    let squares = fitted(shots.clone(), Loss::Squares);
    let mut left_out: Vec<&str> = squares.shots_rejected.iter().map(|shot| shot.shot.as_str()).collect();
    left_out.sort_unstable();
    let mut wrong = [0, 8, 16, 24, 32].map(|i| shots[i].name.as_str());
    wrong.sort_unstable();
    assert_eq!(left_out, wrong);
    for parameter in Parameter::COEFFICIENTS {
        assert!(pull(&squares, parameter).abs() < ERRORS, "{parameter:?}");
    }
}

/// Few such shots are left out by least squares: the noise that they estimate from their own residuals hides no misfit.
#[test]
fn few_shots_with_other_balls_are_left_out() {
    let (mut shots, others) = (film(TRUTH, 52), film(Truth { mu: 0.09, e: 0.90, ..TRUTH }, 52));
    let wrong = [7, 19, 31];
    for i in wrong {
        shots[i] = others[i].clone();
    }
    let names = wrong.map(|i| shots[i].name.clone());
    let fit = fitted(shots, Loss::Squares);
    let mut left_out: Vec<&str> = fit.shots_rejected.iter().map(|shot| shot.shot.as_str()).collect();
    left_out.sort_unstable();
    let mut names = names.each_ref().map(String::as_str);
    names.sort_unstable();
    assert_eq!(left_out, names, "{:?}", fit.shots_rejected);
    for shot in &fit.shots_rejected {
        assert!(
            shot.reason.starts_with("its frames do not fit the collision that the other shots fit"),
            "{shot:?}"
        );
    }
    for parameter in Parameter::COEFFICIENTS {
        assert!(pull(&fit, parameter).abs() < ERRORS, "{parameter:?}");
    }
}

/// On clean films the errors of a robust loss are true, and little larger than those of least squares.
#[test]
fn errors_are_as_large_as_the_scatter() {
    let sets = count("CAROMFIT_SETS", 6) as u64;
    let both: Vec<[Fit; 2]> = (0..sets)
        .into_par_iter()
        .map(|seed| [Loss::Huber, Loss::Squares].map(|loss| fitted(film(TRUTH, 5300 + seed), loss)))
        .collect();
    for parameter in Parameter::COEFFICIENTS {
        let n = sets as f64;
        let rms = (both.iter().map(|[huber, _]| pull(huber, parameter).powi(2)).sum::<f64>() / n).sqrt();
        let error = |fit: &Fit| fit.get(parameter).unwrap().std_error.unwrap();
        let larger = both.iter().map(|[huber, squares]| error(huber) / error(squares)).sum::<f64>() / n;
        println!("{}: rms {rms:.3}, errors {larger:.3} times those of least squares", parameter.symbol());
        // four standard deviations of a root mean square, beside what the sandwich of 40 shots is off by
        assert!((rms - 1.0).abs() < 0.1 + 4.0 / (2.0 * n).sqrt(), "{parameter:?} {rms}");
        assert!((0.8..1.25).contains(&larger), "{parameter:?} {larger}");
    }
}
