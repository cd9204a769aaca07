//! Comparisons have what fits have: friction that falls, contacts that give way, frames.

use caromfit::compare;
use caromfit::compare::{Compared, Comparison, Difference, Options, Quantity};
use caromfit::fit;
use caromfit::fit::Method;
use caromfit::measurement::dataset::{Dataset, Shot};
use caromfit::measurement::parameter::{Compliance, Parameter, Setting};
use caromfit::physics::ball::Ball;
use caromfit::physics::collision::{Effects, Fidelity, FidelityChoice, Model};
use caromfit::physics::friction_law::Law;
use caromfit::simulate::{Camera, ClothSpec, Kind, Noise, Played, Spec, Truth};

use crate::frames::count;
use crate::options;
use crate::synthetic::{made, made_with, spec};

const MU: Quantity = Quantity::Parameter(Parameter::Mu);
const MU_S: Quantity = Quantity::Parameter(Parameter::MuS);
const B: Quantity = Quantity::Parameter(Parameter::B);
const KAPPA: Quantity = Quantity::Parameter(Parameter::Kappa);

/// Standard errors by which a difference may be off: one in 2000 is by chance.
const ERRORS: f64 = 3.5;

fn of(comparison: &Comparison, quantity: Quantity) -> &Compared {
    comparison.quantities.iter().find(|q| q.quantity == quantity).unwrap()
}

fn difference(comparison: &Comparison, quantity: Quantity) -> &Difference {
    let compared = of(comparison, quantity);
    let [difference] = compared.differences.as_slice() else { panic!("{compared:?}") };
    difference
}

fn is_right(difference: &Difference, truth: f64) {
    let Difference { value, std_error, .. } = *difference;
    assert!((value - truth).abs() < ERRORS * std_error, "{value} ± {std_error}, true {truth}");
}

/// Shots of balls whose friction falls by b with the slip, exactly measured but for usual noise of a good camera.
fn falling(name: &str, b: f64, seed: u64) -> Dataset {
    let usual = spec(Kind::Impacts, &[Played::Stun, Played::NaturalRoll, Played::Side], 60, seed);
    let noise = Noise { velocity_m_s: 0.001, line_of_centres_deg: 0.02, spin_rad_s: 0.1, angle_deg: 0.2 };
    let law = Law::Exponential { b, c: 1.088 };
    let model = Model { law, ..Model::new(Fidelity::Full, Ball::POOL) };
    let mut dataset = made_with(&Spec { name: name.to_owned(), noise, ..usual }, &model);
    dataset.settings.falls = true;
    dataset
}

#[test]
fn falling_friction_is_compared() {
    let both = [falling("clean", 0.06, 41), falling("chalked", 0.12, 42)];
    // μ and b differ by data set, c is held
    let apart = compare::compare(&both, &options::of_comparison()).unwrap();
    assert!(apart.converged && apart.warnings.is_empty(), "{:?}", apart.warnings);
    is_right(difference(&apart, B), 0.06);
    is_right(difference(&apart, MU), 0.0);
    assert!(difference(&apart, B).is_real() && of(&apart, B).same_or_different.unwrap().p_value < 1e-6);
    let held = of(&apart, Quantity::Parameter(Parameter::C));
    assert!(held.shared && !held.estimates[0].fitted && held.estimates[0].value == 1.088);
    // one μ for all: b alone then tells them apart, and better
    let shared = compare::compare(&both, &Options { share: vec![MU], ..options::of_comparison() }).unwrap();
    is_right(difference(&shared, B), 0.06);
    assert!(difference(&shared, B).std_error < difference(&apart, B).std_error);
    assert_eq!(of(&shared, MU).estimates.len(), 1);
    let same = of(&shared, MU).same_or_different.unwrap();
    assert!(same.extra_parameters == 1 && same.p_value > 1e-3, "{same:?}");
    // without a friction that falls there is no b
    let constant = both.map(|mut dataset| {
        dataset.settings.falls = false;
        dataset
    });
    let error =
        compare::compare(&constant, &Options { share: vec![B], ..options::of_comparison() }).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("mu_b: no data set has it"), "{error}");
}

/// All parameters shared, the ratio of the masses, too: the fit of all shots of both.
fn is_the_fit_of_all(both: &[Dataset; 2], auto: bool) -> Comparison {
    let both = &both.each_ref().map(|dataset| Dataset { balls: Some("same".to_owned()), ..dataset.clone() });
    let share = vec![MU, MU_S];
    let with_b = if both[0].settings.falls { vec![MU, MU_S, B] } else { share };
    let fidelity = if auto { FidelityChoice::Auto } else { Fidelity::Full.into() };
    let options = Options { share: with_b, fidelity, ..options::of_comparison() };
    let comparison = compare::compare(both, &options).unwrap();
    let mut together = both[0].clone();
    let named = |shot: &Shot| Shot { name: format!("other {}", shot.name), ..shot.clone() };
    together.shots.extend(both[1].shots.iter().map(named));
    let fit = fit::fit(&together, &fit::Options { fidelity, ..options::of_fit() }).unwrap().remove(0);
    for single in fit.estimates.iter().filter(|single| !single.parameter.is_of_balls()) {
        let own = of(&comparison, Quantity::Parameter(single.parameter)).estimates[0];
        // as far as weights come to rest, or integrated collisions are precise
        let error = single.std_error.unwrap_or(1e-9);
        assert!((own.value - single.value).abs() < 1e-2 * error, "{own:?} {single:?}");
        assert_eq!(own.std_error.is_some(), single.std_error.is_some(), "{own:?} {single:?}");
        if let Some(own) = own.std_error {
            assert!((own / error - 1.0).abs() < 1e-3, "{own} {error}");
        }
    }
    assert_eq!((comparison.dof, &comparison.computed), (fit.dof, &fit.diagnostics.computed));
    comparison
}

#[test]
fn a_joint_fit_with_falling_friction_is_the_fit_of_all_shots() {
    let mut both = [falling("one", 0.1, 43), falling("two", 0.1, 44)];
    is_the_fit_of_all(&both, false);
    for dataset in &mut both {
        dataset.settings[Parameter::C].fixed = false;
    }
    let comparison = is_the_fit_of_all(&both, false);
    assert!(of(&comparison, Quantity::Parameter(Parameter::C)).estimates[0].std_error.is_some());
}

/// Stun shots whose contact gives way by so much.
fn giving(name: &str, mu: f64, kappa: f64, seed: u64) -> Dataset {
    let effects = Effects { compliance: true, ..Fidelity::Full.effects() };
    let model = Model { effects, kappa, tolerance: 1e-9, ..Model::new(Fidelity::Ode, Ball::POOL) };
    // exact states before the impact, as of throws that are printed: errors of theirs would be integrated, too, and take minutes
    let usual = spec(Kind::Angles, &[Played::Stun], 30, seed);
    let usual = Spec { noise: Noise { angle_deg: 0.05, ..usual.noise }, ..usual };
    made_with(&Spec { name: name.to_owned(), truth: Truth { mu, ..usual.truth }, ..usual }, &model)
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
    let options = Options { fidelity: FidelityChoice::Auto, ..options::of_comparison() };
    let stated = compare::compare(&with(Setting::held(2.5)), &options).unwrap();
    is_right(difference(&stated, MU), 0.04);
    let held = &of(&stated, KAPPA).estimates[0];
    assert!(!held.fitted && held.value == 2.5, "{held:?}");
    assert!(!stated.warnings.iter().any(|warning| warning.contains("kappa")), "{:?}", stated.warnings);
    let free = Setting { fixed: false, ..Parameter::Kappa.default_setting() };
    let free = compare::compare(&with(free), &options).unwrap();
    let kappa = &of(&free, KAPPA).estimates[0];
    assert!((kappa.value - 2.5).abs() < ERRORS * kappa.std_error.unwrap(), "{kappa:?}");
    is_right(difference(&free, MU), 0.04);
    // a rigid fidelity does not know it
    let error = compare::compare(&with(Setting::held(2.5)), &options::of_comparison()).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("rigid"), "{error}");
}

#[test]
fn data_sets_call_for_a_contact_that_gives_way_together() {
    let both = [giving("one", 0.05, Model::KAPPA, 47), giving("two", 0.05, Model::KAPPA, 48)];
    let comparison = is_the_fit_of_all(&both, true);
    assert!(
        comparison.gives_way && comparison.notes.iter().any(|note| note.contains("gives way")),
        "{:?}",
        comparison.notes
    );
}

/// Footage of shots on one of two cloths, at 500 frames/s.
fn filmed(name: &str, mu_s: f64, mu_k: f64, seed: u64) -> Dataset {
    let usual = spec(Kind::Tracks, &[Played::NaturalRoll], 20, seed);
    let cloth = ClothSpec { mu_k, ..usual.cloth };
    let camera = Camera { fps: 500.0, position_sd_m: 2e-4, ..usual.camera };
    let truth = Truth { mu_s, ..usual.truth };
    Dataset {
        cloth: Some(name.to_owned()),
        balls: Some("same".to_owned()),
        ..made(&Spec { name: name.to_owned(), truth, camera, cloth, ..usual })
    }
}

/// The frames tell more of a difference than the velocities extracted from them, and their errors are true.
#[test]
fn frames_of_two_cloths_are_compared() {
    let both = vec![filmed("slow", 0.2, 0.2, 51), filmed("fast", 0.35, 0.25, 52)];
    let by = |method: Method| {
        let analysis = compare::analyse(&both, &Options { method: Some(method), ..options::of_comparison() });
        analysis.comparison.unwrap()
    };
    let (joint, two_stage) = (by(Method::Joint), by(Method::TwoStage));
    for comparison in [&joint, &two_stage] {
        assert!(comparison.converged && comparison.refuted.is_none(), "{}", comparison.termination);
        assert_eq!(comparison.samples.iter().map(|sample| sample.shots_used).sum::<usize>(), 40);
    }
    assert!(joint.dof > 10 * two_stage.dof, "{} {}", joint.dof, two_stage.dof);
    for (quantity, truth) in [(MU_S, 0.15), (Quantity::Sliding, 0.05)] {
        let [of_frames, of_velocities] = [&joint, &two_stage].map(|c| difference(c, quantity));
        println!("{}: {of_frames:?}, two stages {of_velocities:?}", quantity.name());
        let off = (of_frames.value - truth).abs() / of_frames.std_error;
        assert!(off < ERRORS && of_frames.is_real(), "{of_frames:?}");
        assert!(of_frames.std_error < of_velocities.std_error, "{of_frames:?} {of_velocities:?}");
    }
    // where all is footage, frames are compared unless something else is asked for
    let usual = compare::analyse(&both, &options::of_comparison()).comparison.unwrap();
    assert_eq!(usual.method, Method::Joint);
    assert_eq!(difference(&usual, MU_S), difference(&joint, MU_S));
}

/// With CAROMFIT_COMPARISONS=300: tests/reference/studies.md.
#[test]
fn errors_of_differences_from_frames_are_true() {
    let count = count("CAROMFIT_COMPARISONS", 4);
    let mut pulls = [Vec::new(), Vec::new()];
    for seed in 0..count as u64 {
        let both = [filmed("a", 0.3, 0.2, 1000 + 2 * seed), filmed("b", 0.3, 0.2, 1001 + 2 * seed)];
        let options = Options { method: Some(Method::Joint), ..options::of_comparison() };
        let analysis = compare::analyse(&both, &options);
        let comparison = analysis.comparison.unwrap();
        for (pulls, quantity) in pulls.iter_mut().zip([MU_S, Quantity::Sliding]) {
            let Difference { value, std_error, .. } = *difference(&comparison, quantity);
            pulls.push(value / std_error);
        }
    }
    for (pulls, name) in pulls.iter().zip(["μ_s", "μ_k"]) {
        let n = pulls.len() as f64;
        let square = pulls.iter().map(|pull| pull * pull).sum::<f64>() / n;
        let outside = pulls.iter().filter(|pull| pull.abs() > 1.96).count();
        println!(
            "{name}, of {count}: {outside} beyond 95 %, rms of the difference over its error {:.3}",
            square.sqrt()
        );
        // four standard deviations of the mean of χ²
        assert!((square - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{name}: {square}");
    }
}

/// A data set without frames has none to compare.
#[test]
fn frames_need_footage() {
    let impacts = spec(Kind::Impacts, &[Played::NaturalRoll], 20, 53);
    let impacts = made(&Spec { name: "impacts".to_owned(), ..impacts });
    let both = vec![filmed("film", 0.2, 0.2, 51), impacts];
    let by = |method| compare::analyse(&both, &Options { method, ..options::of_comparison() }).comparison;
    let error = by(Some(Method::Joint)).unwrap_err();
    assert!(error.is_bad_input() && error.to_string().contains("impacts: its frames cannot be"), "{error}");
    assert_eq!(by(None).unwrap().method, Method::TwoStage);
}
