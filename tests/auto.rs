//! `fit --fidelity auto`: data that show what the integrated fidelities add are computed with it, others are not.

use caromfit::fit;
use caromfit::fit::{Fit, Options};
use caromfit::measurement::dataset::{Before, Measurement};
use caromfit::measurement::dataset::{Dataset, ObjectBall, Shot};
use caromfit::measurement::spin::Spin;
use caromfit::physics::ball::Ball;
use caromfit::physics::collision::{Coefficients, Fidelity, FidelityChoice, Model};
use caromfit::problem::predict;
use caromfit::simulate::{Kind, Noise, Played, Spec};

use crate::frames::count;
use crate::options;
use crate::synthetic::{TRUTH, made_with, spec};

/// Data sets of each kind: means of standardized errors scatter by 1/√SETS; four of that.
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
    for by in [Fidelity::Full, Fidelity::Contact] {
        let (mut pulls, mut mistaken) = ([0.0; 3], 0);
        for seed in 0..sets as u64 {
            let options = Options { fidelity: FidelityChoice::Auto, ..options::of_fit() };
            let fit = fit::fit(&made(by, seed), &options).unwrap().remove(0);
            let integrated = fit.diagnostics.computed.iter().any(|c| c.fidelity == Fidelity::Contact);
            mistaken += usize::from(integrated != (by == Fidelity::Contact));
            // what decides against the correction is said
            assert_eq!(
                fit.notes().iter().any(|note| note.contains("weight") && note.contains("left out")),
                !integrated,
                "{:?}",
                fit.notes()
            );
            for (i, sum) in pulls.iter_mut().enumerate() {
                *sum += pull(&fit, i);
            }
        }
        let n = sets as f64;
        println!("{}: pulls {:?}, {mistaken} mistaken", by.name(), pulls.map(|sum| sum / n));
        assert!(mistaken as f64 <= MISTAKEN * n, "{mistaken}");
        for sum in pulls {
            assert!((sum / n).abs() < 0.1 + 4.0 / n.sqrt(), "{}", sum / n);
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
    for shot in &mut dataset.shots {
        // χ² below is that of shots whose state before the impact is exact
        if let Before::Impact { normal, velocity } = &mut shot.before {
            normal.iter_mut().chain(velocity).for_each(|measured| measured.sd = None);
        }
        if let Spin::Measured { sd, .. } = &mut shot.spin {
            *sd = [None; 3];
        }
    }
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
        println!("parameter {i}: {off:.5} standard errors from the minimum");
        assert!(off.abs() < CORRECTED, "{i}: {off}");
    }
}
