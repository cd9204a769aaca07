//! Robust losses of frames: a shot that was wrong counts less, and errors are from the scatter of the shots.

use crate::frames::dataset;
use crate::prelude::*;

const TRUTH: Truth =
    Truth { mu: 0.05, mu_s: 0.25, e: 0.94, kappa: None, mu_b: None, mu_c: None, e_slope: None };

/// The shots that a fit leaves out, in the order of their names.
fn left_out(fit: &Fit) -> Vec<String> {
    let mut names: Vec<String> = fit.shots_rejected.iter().map(|shot| shot.shot.clone()).collect();
    names.sort_unstable();
    names
}

/// A film in which some shots were played with other balls, and their names in order.
fn with_other_balls(seed: u64, wrong: &[usize]) -> (Vec<TrackShot>, Vec<String>) {
    let mut shots = film(TRUTH, seed);
    let others = film(Truth { mu: 0.09, e: 0.90, ..TRUTH }, seed);
    for i in wrong {
        shots[*i] = others[*i].clone();
    }
    let mut names: Vec<String> = wrong.iter().map(|i| shots[*i].name.clone()).collect();
    names.sort_unstable();
    (shots, names)
}

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
    let (shots, wrong) = with_other_balls(51, &[0, 8, 16, 24, 32]);
    for loss in [Loss::Huber, Loss::Cauchy] {
        let fit = fitted(shots.clone(), loss);
        assert_eq!(fit.method_name(), "joint");
        assert!(fit.converged && fit.shots_used == 40, "{}", fit.termination);
        let robust = fit.diagnostics.robust.as_ref().unwrap();
        let mut least: Vec<&str> = robust.weights.iter().take(5).map(|one| one.shot.as_str()).collect();
        least.sort_unstable();
        assert_eq!(least, wrong, "{:?}", robust.weights);
        for parameter in Parameter::COEFFICIENTS {
            // Huber's loss bounds what a wrong shot does, and does not undo it
            let off = pull(&fit, parameter).abs();
            assert!(loss == Loss::Huber || off < ERRORS, "{loss:?} {parameter:?} {off}");
        }
    }
    // least squares count no shot less: they leave such shots out
    let squares = fitted(shots, Loss::Squares);
    assert_eq!(left_out(&squares), wrong);
    for parameter in Parameter::COEFFICIENTS {
        assert!(pull(&squares, parameter).abs() < ERRORS, "{parameter:?}");
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
        figure(format!("{}: rms {rms:.3}, errors {larger:.3} times", parameter.name()));
        // four standard deviations of a root mean square, beside what the sandwich of 40 shots is off by
        assert!((rms - 1.0).abs() < 0.1 + 4.0 / (2.0 * n).sqrt(), "{parameter:?} {rms}");
        assert!((0.8..1.25).contains(&larger), "{parameter:?} {larger}");
    }
}
