//! `fit --fidelity auto`: data that show what the integrated fidelities add are computed with it, others are not.

use crate::prelude::*;

/// Data sets of each kind.
const SETS: usize = 24;

/// Of the data sets so many may be taken for the other kind.
const MISTAKEN: f64 = 0.05;

fn specified(seed: u64) -> Spec {
    // as footage of 1000 fps gives
    with(&spec("impacts", &["natural-roll", "draw"], 40, seed), FINE)
}

/// Shots of balls whose masses are known to be equal.
fn made(by: Fidelity, seed: u64) -> Dataset {
    let object = Some(ObjectBall::exact(Ball::POOL));
    Dataset { object, ..made_with(&specified(seed), &Model::new(by, Ball::POOL)) }
}

fn pull(fit: &Fit, parameter: usize) -> f64 {
    let estimate = fit.estimates()[parameter];
    (estimate.value - TRUTH[parameter]) / fit.std_error_if_model_held(estimate.parameter).unwrap()
}

#[test]
fn the_data_decide_what_they_are_computed_with() {
    let sets = count("CAROMFIT_SETS", SETS);
    let options = Options { fidelity: None, ..options::of_fit() };
    for by in [Fidelity::Full, Fidelity::Contact] {
        let (mut pulls, mut mistaken) = ([const { Vec::new() }; 3], 0);
        for seed in 0..sets as u64 {
            let fit = fit::fit(&made(by, seed), &options).unwrap().remove(0);
            let computed = part(&fit, "/computed");
            let integrated = computed.as_array().unwrap().iter().any(|own| own["fidelity"] == "contact");
            mistaken += usize::from(integrated != (by == Fidelity::Contact));
            // what decides against the correction is said
            let is_said = fit.notes().iter().any(|note| note.contains("weight") && note.contains("left out"));
            assert_eq!(is_said, !integrated, "{:?}", fit.notes());
            pulls.iter_mut().enumerate().for_each(|(i, all)| all.push(pull(&fit, i)));
        }
        assert!(mistaken as f64 <= MISTAKEN * sets as f64, "{mistaken}");
        for pulls in pulls {
            pulls.into_iter().collect::<Pulls>().check_mean(by.name());
        }
    }
}

/// Without noise, estimates are where they were made though `full` alone would be several standard errors off.
#[test]
fn corrections_undo_what_the_exact_solution_leaves_out() {
    const BIAS: f64 = 2.0;
    const CORRECTED: f64 = 0.3;
    let exact = with(&specified(7), EXACT);
    let mut dataset = made_with(&exact, &Model::new(Fidelity::Contact, Ball::POOL));
    dataset.object = Some(ObjectBall::exact(Ball::POOL));
    for row in dataset.shots.iter_mut().flat_map(|shot| &mut shot.after) {
        row.measured.sd = Some(0.001);
    }
    let off = |fidelity: Option<Fidelity>| {
        let fit = options::fitted_with(&dataset, &Options { fidelity, ..options::of_fit() });
        (0..3).map(|i| pull(&fit, i).abs()).fold(0.0, f64::max)
    };
    let [full, corrected] = [Some(Fidelity::Full), None].map(off);
    assert!(full > BIAS && corrected < CORRECTED, "{full} {corrected}");
}
