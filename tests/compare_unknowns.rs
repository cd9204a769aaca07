//! Comparisons have what fits have: friction that decreases, contacts that give way, frames, cameras.

use caromfit::compare::Options;

use crate::camera::by_phone;
use crate::compare::{Asked, difference, is_the_fit_of_all, of};
use crate::prelude::*;

const MU: Quantity = Quantity::Parameter(Parameter::Mu);
const MU_S: Quantity = Quantity::Parameter(Parameter::MuS);
const B: Quantity = Quantity::Parameter(Parameter::B);
const KAPPA: Quantity = Quantity::Parameter(Parameter::Kappa);

/// Standard errors by which a difference may be off: one in 2000 is by chance.
const ERRORS: f64 = 3.5;

fn is_right(difference: &Value, truth: f64) {
    let [value, std_error] = ["/difference", "/std_error"].map(|key| number(difference, key));
    assert!((value - truth).abs() < ERRORS * std_error, "{value} ± {std_error}, true {truth}");
}

/// Shots of balls whose friction decreases by b with the slip, exactly measured but for usual noise of a good camera.
fn falling(name: &str, b: f64, seed: u64) -> Dataset {
    let usual = spec("impacts", &["stun", "natural-roll", "side"], 60, seed);
    let law = Law::Exponential { b, c: 1.088 };
    let model = Model { law, ..Model::new(Fidelity::Full, Ball::POOL) };
    let mut dataset = made_with(&with(&usual, &format!("name = {name:?}\n{FINE}")), &model);
    dataset.settings.falls = true;
    dataset
}

#[test]
fn falling_friction_is_compared() {
    let both = [falling("clean", 0.06, 41), falling("chalked", 0.12, 42)];
    // μ and b differ by data set, c is held
    let apart = compare::compare(&both, &options::of_comparison()).unwrap();
    assert!(part(&apart, "/converged") == true && apart.warnings().is_empty(), "{:?}", apart.warnings());
    is_right(&difference(&apart, B), 0.06);
    is_right(&difference(&apart, MU), 0.0);
    assert_eq!(difference(&apart, B)["real"], true);
    assert!(number(&of(&apart, B), "/same_or_different/p_value") < 1e-6);
    let held = of(&apart, Quantity::Parameter(Parameter::C));
    let value = &held["estimates"][0];
    assert!(held["shared"] == true && value["fitted"] == false && value["estimate"] == 1.088, "{held}");
    // one μ for all: b alone then tells them apart, and better
    let shared = compare::compare(&both, &Options { share: vec![MU], ..options::of_comparison() }).unwrap();
    is_right(&difference(&shared, B), 0.06);
    let [shared_error, error] = [&shared, &apart].map(|own| number(&difference(own, B), "/std_error"));
    assert!(shared_error < error);
    let shared = of(&shared, MU);
    assert_eq!(shared["estimates"].as_array().unwrap().len(), 1);
    let same = &shared["same_or_different"];
    assert!(same["extra_parameters"] == 1 && number(same, "/p_value") > 1e-3, "{same}");
    // without a friction that decreases there is no b
    let constant = both.map(|mut dataset| {
        dataset.settings.falls = false;
        dataset
    });
    let error =
        compare::compare(&constant, &Options { share: vec![B], ..options::of_comparison() }).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("mu_b: no data set has it"), "{error}");
}

#[test]
fn a_joint_fit_with_falling_friction_is_the_fit_of_all_shots() {
    let mut both = [falling("one", 0.1, 43), falling("two", 0.1, 44)];
    is_the_fit_of_all(&both, Asked::default());
    for dataset in &mut both {
        dataset.settings[Parameter::C].fixed = false;
    }
    let comparison = is_the_fit_of_all(&both, Asked::default());
    assert!(of(&comparison, Quantity::Parameter(Parameter::C))["estimates"][0]["std_error"].is_number());
}

/// Stun shots whose contact gives way by so much.
fn giving(name: &str, mu: f64, kappa: f64, seed: u64) -> Dataset {
    let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
    let model = Model { effects, kappa, tolerance: 1e-9, ..Model::new(Fidelity::Ode, Ball::POOL) };
    // exact states before the impact, as of throws that are printed: errors of theirs would be integrated, too, and take minutes
    let usual = spec("angles", &["stun"], 30, seed);
    let keys = format!("name = {name:?}\nnoise.angle_deg = 0.05\ntruth.mu = {mu}");
    made_with(&with(&usual, &keys), &model)
}

#[test]
fn a_contact_that_gives_way_is_compared() {
    let data = [giving("clean", 0.05, 2.5, 45), giving("chalked", 0.09, 2.5, 46)];
    let with = |kappa: Setting| {
        data.clone().map(|mut dataset| {
            dataset.settings.compliance = Compliance::Stated;
            dataset.settings[Parameter::Kappa] = kappa;
            dataset
        })
    };
    let options = Options { fidelity: None, ..options::of_comparison() };
    let stated = compare::compare(&with(Setting::held(2.5)), &options).unwrap();
    is_right(&difference(&stated, MU), 0.04);
    let held = &of(&stated, KAPPA)["estimates"][0];
    assert!(held["fitted"] == false && held["estimate"] == 2.5, "{held}");
    let warnings = stated.warnings();
    assert!(!warnings.iter().any(|warning| warning.contains("kappa")), "{warnings:?}");
    let free = Setting { fixed: false, ..Parameter::Kappa.default_setting() };
    let free = compare::compare(&with(free), &options).unwrap();
    let kappa = &of(&free, KAPPA)["estimates"][0];
    let [value, error] = ["/estimate", "/std_error"].map(|key| number(kappa, key));
    assert!((value - 2.5).abs() < ERRORS * error, "{kappa}");
    is_right(&difference(&free, MU), 0.04);
    // a rigid fidelity does not know it
    let error = compare::compare(&with(Setting::held(2.5)), &options::of_comparison()).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("rigid"), "{error}");
}

#[test]
fn data_sets_call_for_a_contact_that_gives_way_together() {
    let both = [giving("one", 0.05, Model::KAPPA, 47), giving("two", 0.05, Model::KAPPA, 48)];
    let comparison = is_the_fit_of_all(&both, Asked { auto: true, ..Asked::default() });
    assert!(comparison.notes().iter().any(|note| note.contains("is compliant")), "{:?}", comparison.notes());
}

/// Cue balls that differ by 1 % in mass, of which no data set says anything, are no difference of the cloth.
#[test]
fn unequal_balls_are_no_difference_of_the_cloth() {
    let both = [(1.0, 61), (1.01, 62)].map(|(ratio, seed)| {
        let Ball { mass, .. } = Ball::POOL;
        let keys = format!(
            "name = \"{seed}\"\ncamera = {{ fps = 240, position_sd_m = 2e-4 }}\nball.mass_kg = {}\nobject.mass_kg = {mass}",
            ratio * mass
        );
        let made = made(&with(&spec("tracks", &["natural-roll"], 15, seed), &keys));
        Dataset { cloth: Some(seed.to_string()), ball: Ball::POOL, object: None, ..made }
    });
    let comparison = compare::compare(&both, &options::of_comparison()).unwrap();
    let found = difference(&comparison, MU_S);
    is_right(&found, 0.0);
    assert_eq!(found["real"], false, "{found}");
    let notes = comparison.notes();
    let limit = |note: &&str| note.contains("difference in μ_s") && note.contains("is the mass ratio");
    assert!(notes.iter().any(limit), "{notes:?}");
}

/// What is shared is tested: balls of another restitution contradict that e is the same.
#[test]
fn data_that_contradict_what_is_shared_are_named() {
    let e = Quantity::Parameter(Parameter::E);
    let both = [(0.94, 63), (0.90, 64)].map(|(e, seed)| {
        let keys = format!("name = \"{seed}\"\ntruth.e = {e}");
        made(&with(&spec("tracks", &["natural-roll"], 15, seed), &keys))
    });
    let comparison = compare::compare(&both, &options::of_comparison()).unwrap();
    let warnings = comparison.warnings();
    let is_named = |said: &&str| said.starts_with("e is shared, and the data contradict");
    assert!(warnings.iter().any(is_named), "{warnings:?}");
    assert!(number(&of(&comparison, e), "/same_or_different/p_value") < 1e-6);
    let apart = Options { per_dataset: vec![e], ..options::of_comparison() };
    is_right(&difference(&compare::compare(&both, &apart).unwrap(), e), -0.04);
}

/// Shots on a cloth, filmed by a phone.
fn on_cloth(name: &str, mu_s: f64, shots: usize, seed: u64) -> Dataset {
    let spec = with(&spec("tracks", &["natural-roll"], shots, seed), &format!("truth.mu_s = {mu_s}"));
    let film = simulate::filmed(&spec).unwrap().into_iter().map(|(shot, _)| shot).collect();
    Dataset { name: name.to_owned(), cloth: Some(name.to_owned()), ..by_phone(film) }
}

fn compared(datasets: Vec<Dataset>, camera: Option<&str>) -> Comparison {
    let by_camera = |dataset| Dataset { camera: camera.map(str::to_owned), ..dataset };
    let datasets: Vec<Dataset> = datasets.into_iter().map(by_camera).collect();
    compare::compare(&datasets, &options::of_comparison()).unwrap()
}

/// What several films tell of their camera together: few shots on each of two cloths tell more of the balls and the cloths.
#[test]
fn one_camera_is_calibrated_by_all_films() {
    let both = || vec![on_cloth("new", 0.2, 10, 41), on_cloth("worn", 0.35, 10, 42)];
    let (apart, same) = (compared(both(), None), compared(both(), Some("phone")));
    assert!([&apart, &same].iter().all(|own| part(*own, "/converged") == true));
    let of = |comparison: &Comparison, quantity: Quantity| -> Vec<(f64, f64)> {
        let estimates = of(comparison, quantity)["estimates"].as_array().unwrap().clone();
        estimates.iter().map(|own| (number(own, "/estimate"), number(own, "/std_error"))).collect()
    };
    for (i, truth) in [0.2, 0.35].into_iter().enumerate() {
        let ((_, alone), (value, error)) = (of(&apart, MU_S)[i], of(&same, MU_S)[i]);
        assert!((value - truth).abs() < ERRORS * error, "{value} ± {error}");
        assert!(error < 1.02 * alone, "{error} {alone}");
    }
    let e = Quantity::Parameter(Parameter::E);
    let ((_, alone), (value, error)) = (of(&apart, e)[0], of(&same, e)[0]);
    assert!((value - 0.94).abs() < ERRORS * error && error < alone, "{value} ± {error}, alone {alone}");
}

#[test]
fn films_that_differ_are_not_by_one_camera() {
    let compared = |factors: [f64; 2]| {
        let mut both = [on_cloth("new", 0.2, 10, 41), on_cloth("worn", 0.35, 10, 42)];
        for shot in &mut both[1].tracks.as_mut().unwrap().shots {
            for sample in shot.cue.iter_mut().chain(&mut shot.object) {
                (sample.x, sample.y) = (factors[0] * sample.x, factors[1] * sample.y);
            }
        }
        let by_phone = |dataset| Dataset { camera: Some("phone".to_owned()), ..dataset };
        compare::compare(&both.map(by_phone), &options::of_comparison())
    };
    let error = compared([1.5; 2]).unwrap_err();
    assert!(error.to_string().contains("differ by a factor of 1."), "{error}");
    let moved = compared([1.0, 1.1]).unwrap();
    assert!(moved.warnings().concat().contains("with the same camera have"), "{:?}", moved.warnings());
}
