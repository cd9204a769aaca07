//! One camera that filmed several data sets, and was not moved: its corrections are the same.

use caromfit::report::compare::notes;

use crate::camera::by_phone;
use crate::prelude::*;

/// Standard errors by which a value may be off.
const ERRORS: f64 = 3.5;

const MU_S: Quantity = Quantity::Parameter(Parameter::MuS);

/// Shots on a cloth, filmed by a phone.
fn on_cloth(name: &str, mu_s: f64, shots: usize, seed: u64) -> Dataset {
    let usual = spec(Kind::Tracks, &[Played::NaturalRoll], shots, seed);
    let spec = Spec { truth: Truth { mu: 0.05, mu_s, e: 0.94, ..Truth::default() }, ..usual };
    let film = simulate::filmed(&spec).unwrap().into_iter().map(|(shot, _)| shot).collect();
    Dataset { name: name.to_owned(), cloth: Some(name.to_owned()), ..by_phone(film) }
}

fn compared(mut datasets: Vec<Dataset>, camera: Option<&str>) -> Comparison {
    for dataset in &mut datasets {
        dataset.camera = camera.map(str::to_owned);
    }
    compare::compare(&datasets, &options::of_comparison()).unwrap()
}

/// What several films tell of their camera together: few shots on each of two cloths tell more of the balls and the cloths.
#[test]
fn one_camera_is_calibrated_by_all_films() {
    let both = || vec![on_cloth("new", 0.2, 10, 41), on_cloth("worn", 0.35, 10, 42)];
    let (apart, same) = (compared(both(), None), compared(both(), Some("phone")));
    assert!(apart.is_filmed && same.is_filmed && same.converged);
    let of = |comparison: &Comparison, quantity: Quantity| {
        let found = comparison.quantities.iter().find(|own| own.quantity == quantity).unwrap();
        let of = |e: &compare::Value| {
            (e.value, e.std_error.unwrap_or_else(|| panic!("{e:?} {:?}", comparison.findings)))
        };
        found.estimates.iter().map(of).collect::<Vec<_>>()
    };
    for (i, truth) in [0.2, 0.35].into_iter().enumerate() {
        let ((_, alone), (value, error)) = (of(&apart, MU_S)[i], of(&same, MU_S)[i]);
        assert!((value - truth).abs() < ERRORS * error, "{value} ± {error}");
        assert!(error < 1.02 * alone, "{error} {alone}");
    }
    let e = Quantity::Parameter(Parameter::E);
    let ((_, alone), (value, error)) = (of(&apart, e)[0], of(&same, e)[0]);
    assert!((value - 0.94).abs() < ERRORS * error && error < alone, "{value} ± {error}, alone {alone}");
    assert!(notes(&same).iter().any(|note| note.starts_with("One camera filmed all data sets: scale")));
    assert!(notes(&apart).iter().all(|note| !note.starts_with("One camera")));
}

#[test]
fn films_that_differ_are_not_by_one_camera() {
    let mut moved = on_cloth("worn", 0.35, 10, 42);
    for shot in &mut moved.tracks.as_mut().unwrap().shots {
        for sample in shot.cue.iter_mut().chain(&mut shot.object) {
            (sample.x, sample.y) = (1.5 * sample.x, 1.5 * sample.y);
        }
    }
    let mut datasets = vec![on_cloth("new", 0.2, 10, 41), moved];
    for dataset in &mut datasets {
        dataset.camera = Some("phone".to_owned());
    }
    let error = compare::compare(&datasets, &options::of_comparison()).unwrap_err();
    assert!(error.to_string().contains("differ by a factor of 1."), "{error}");
}
