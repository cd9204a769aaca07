//! `fit --fidelity auto`: data that show what the integrated fidelities add are computed with it, others are not.

use caromfit::measurement::dataset::Measurement;

use crate::prelude::*;

/// Data sets of each kind.
const SETS: usize = 24;

/// Of the data sets so many may be taken for the other kind.
const MISTAKEN: f64 = 0.05;

fn made(by: Fidelity, seed: u64) -> Dataset {
    let spec = Spec {
        // as footage of 1000 fps gives
        noise: Noise { velocity_m_s: 0.001, line_of_centres_deg: 0.02, spin_rad_s: 0.1, angle_deg: 0.2 },
        ..spec(Kind::Impacts, &[Played::NaturalRoll, Played::Draw], 40, seed)
    };
    // the masses are exact: the minimum is looked at in the three coefficients alone
    let object = Some(ObjectBall::exact(Ball::POOL));
    Dataset { object, ..made_with(&spec, &Model::new(by, Ball::POOL)) }
}

fn pull(fit: &Fit, parameter: usize) -> f64 {
    let estimate = fit.estimates[parameter];
    (estimate.value - TRUTH[parameter]) / fit.std_error_if_model_held(estimate.parameter).unwrap()
}

#[test]
fn the_data_decide_what_they_are_computed_with() {
    let sets = count("CAROMFIT_SETS", SETS);
    let options = Options { fidelity: FidelityChoice::Auto, ..options::of_fit() };
    for by in [Fidelity::Full, Fidelity::Contact] {
        let (mut pulls, mut mistaken) = ([const { Vec::new() }; 3], 0);
        for seed in 0..sets as u64 {
            let fit = fit::fit(&made(by, seed), &options).unwrap().remove(0);
            let integrated = fit.diagnostics.computed.iter().any(|c| c.fidelity == Fidelity::Contact);
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

/// Standard errors by which `full` alone errs on such data, at least, in some parameter.
const BIAS: f64 = 2.0;

/// Corrections give what the integrated fidelity itself gives, to this part of a standard error.
const CORRECTED: f64 = 0.01;

/// Without the correction the estimates would be wrong; with it they are where χ² of the fidelity itself is least.
#[test]
fn corrections_do_what_the_integrated_fidelity_does() {
    let mut dataset = made(Fidelity::Contact, 7);
    // χ² below is that of shots whose state before the impact is exact
    take_inputs_for_exact(&mut dataset);
    let of = |fidelity: Fidelity| {
        fit::fit(&dataset, &Options { fidelity: fidelity.into(), ..options::of_fit() }).unwrap().remove(0)
    };
    let (full, contact) = (of(Fidelity::Full), of(Fidelity::Contact));
    let bias = (0..3).map(|i| pull(&full, i).abs()).fold(0.0, f64::max);
    assert!(bias > BIAS, "{bias}");
    let model = Model::new(Fidelity::Contact, Ball::POOL);
    let [mu, mu_s, e] = [0, 1, 2].map(|i: usize| contact.estimates[i].value);
    let residuals = |values: [f64; 3]| -> f64 {
        let coefficients = Coefficients { mu: values[0], mu_s: values[1], e: values[2] };
        let chi2 = |shot: &Shot| {
            let predicted = predict(shot, &model, &coefficients).unwrap().values;
            let square = |(row, value): (&Measurement, f64)| {
                ((value - row.measured.value) / row.measured.sd.unwrap()).powi(2)
            };
            shot.after.iter().zip(predicted).map(square).sum::<f64>()
        };
        dataset.shots.iter().map(chi2).sum()
    };
    // a parabola through three values of χ² along each parameter's own standard error with the others held
    for i in 0..3 {
        let at = |steps: f64| {
            let mut values = [mu, mu_s, e];
            values[i] += steps * contact.std_error_if_model_held(contact.estimates[i].parameter).unwrap();
            residuals(values)
        };
        let (low, middle, high) = (at(-1.0), at(0.0), at(1.0));
        let off = 0.5 * (high - low) / (high - 2.0 * middle + low);
        assert!(off.abs() < CORRECTED, "{i}: {off}");
    }
}
