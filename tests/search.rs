//! The least minimum is found, whatever the initial values: contacts that stick leave χ² flat in μ, and with several minima.

use caromfit::measurement::parameter::Settings;

use crate::prelude::*;
use crate::study::in_threads;

fn quick(dataset: &Dataset) -> Fit {
    options::fitted(dataset, Depth::Estimates)
}

fn with_initial(dataset: &Dataset, initial: &[(Parameter, f64)]) -> Dataset {
    let mut dataset = dataset.clone();
    for (parameter, value) in initial {
        dataset.settings[*parameter].initial = *value;
    }
    dataset
}

fn estimate(fit: &Fit, parameter: Parameter) -> Estimate {
    *fit.estimates().iter().find(|e| e.parameter == parameter).unwrap()
}

#[test]
fn falling_friction_is_found_from_anywhere() {
    let law = Law::Exponential { b: 0.1, c: 1.088 };
    let usual = spec("impacts", &["stun", "natural-roll", "side"], 60, 5);
    let usual = with(&usual, "truth.mu = 0.02\nshots.speed_m_s = [0.3, 6]");
    let model = Model { law, ..Model::new(Fidelity::Full, Ball::POOL) };
    let mut dataset = made_with(&usual, &model);
    dataset.settings.falls = true;
    for c_is_free in [false, true] {
        dataset.settings[Parameter::C].fixed = !c_is_free;
        let near = quick(&dataset);
        for parameter in [Parameter::Mu, Parameter::B] {
            assert!(estimate(&near, parameter).std_error.is_some(), "{:?}", near.estimates());
        }
        assert!(near.chi2() < 1.5 * near.dof() as f64, "χ² {} of {}", near.chi2(), near.dof());
        let mut far = vec![(Parameter::Mu, 0.4), (Parameter::B, 1.0)];
        if c_is_free {
            far.push((Parameter::C, 0.2));
        }
        let found = quick(&with_initial(&dataset, &far));
        assert!(
            (found.chi2() - near.chi2()).abs() < 1e-6 * near.chi2(),
            "{} and {}",
            found.chi2(),
            near.chi2()
        );
    }
}

/// A data set of some kind, cut range, spins, friction and noise, and what it is in words.
fn random(rng: &mut ChaCha8Rng, seed: u64) -> (Dataset, String) {
    let kind = ["impacts", "impacts", "angles", "angles", "tracks"][rng.random_range(0..5)];
    let all = ["stun", "natural-roll", "almost-roll", "draw", "side", "any"];
    let spins: Vec<&str> = (0..rng.random_range(1..4)).map(|_| all[rng.random_range(0..all.len())]).collect();
    let mu = 0.005 * 80_f64.powf(rng.random());
    let most = rng.random_range(8.0..65.0);
    let cut_deg = if rng.random() { [-most, most] } else { [0.4 * most, most] };
    let count = if kind == "tracks" { rng.random_range(8..16) } else { rng.random_range(10..41) };
    let usual = spec(kind, &spins, count, seed);
    let noise = 0.1 * 30_f64.powf(rng.random());
    let (mu_s, e) = (rng.random_range(0.1..0.5), rng.random_range(0.85..0.98));
    let mut keys = format!("truth = {{ mu = {mu}, mu_s = {mu_s}, e = {e} }}\nshots.cut_deg = {cut_deg:?}");
    if kind != "tracks" {
        keys += &format!(
            "\nnoise = {{ velocity_m_s = {}, line_of_centres_deg = {}, spin_rad_s = {}, angle_deg = {} }}",
            noise * 0.004,
            noise * 0.05,
            noise * 0.5,
            noise * 0.2
        );
    }
    let mut dataset = made(&with(&usual, &keys));
    let states_noise = kind == "tracks" || rng.random_range(0..6) > 0;
    if !states_noise {
        // nor are there errors of the inputs, so that what is minimised can be told from the residuals
        for shot in &mut dataset.shots {
            shot.after.iter_mut().for_each(|row| row.measured.sd = None);
        }
        take_inputs_for_exact(&mut dataset);
    }
    let words = format!(
        "seed {seed}: {count} {kind:?} of {spins:?}, cuts {cut_deg:.1?}, μ = {mu:.4}, noise × {noise:.2}{}",
        if states_noise { "" } else { ", not stated" }
    );
    (dataset, words)
}

/// Legal initial values, anywhere between the bounds.
fn random_start(rng: &mut ChaCha8Rng) -> Vec<(Parameter, f64)> {
    let bounds = Settings::default();
    let of = |p: Parameter| (p, rng.random_range(bounds[p].lower..=bounds[p].upper));
    Parameter::COEFFICIENTS.map(of).to_vec()
}

/// What a fit minimises: χ², or if the noise is estimated, as in films, −2 log L.
fn objective(fit: &Fit) -> f64 {
    if is_estimated(fit) { fit.minus_two_log() } else { fit.chi2() }
}

/// Whether a fit estimates a noise from the residuals.
fn is_estimated(fit: &Fit) -> bool {
    let noises = part(fit, "/noise");
    let is_number = |noise: &Value| noise["estimated_sd"].is_number();
    fit.camera().is_some() || noises.as_array().unwrap().iter().any(is_number)
}

/// What is wrong with the search on one data set.
fn faults(seed: u64) -> Vec<String> {
    /// Of χ², a tenth of a standard error: weights taken on this side or that of a kink.
    const SAME: f64 = 0.01;
    /// Of −2 log L, where the noise is estimated without bias and not by the greatest likelihood.
    const SAME_LIKELIHOOD: f64 = 0.2;
    /// Points of the fine scan.
    const POINTS: usize = 80;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (dataset, words) = random(&mut rng, seed);
    let is_film = dataset.tracks.is_some();
    let options = Options { depth: Depth::Estimates, ..options::of_fit() };
    let fitted = |dataset: &Dataset| fit::fit(dataset, &options).map(|mut fits| fits.remove(0));
    let from = |start: &[(Parameter, f64)]| fitted(&with_initial(&dataset, start));
    let first = match from(&[]) {
        Ok(fit) => fit,
        Err(error) => return vec![format!("{words}: {error}")],
    };
    let mut faults = Vec::new();
    for found in first.estimates() {
        let bounds = dataset.settings[found.parameter];
        let is_at = [found.value == bounds.lower, found.value == bounds.upper];
        let says = [Status::AtLowerBound, Status::AtUpperBound].map(|status| found.status == status);
        if is_at != says && found.status != Status::NotIdentified {
            faults.push(format!("{words}: {found:?} within {} to {}", bounds.lower, bounds.upper));
        }
    }
    for start in [random_start(&mut rng), random_start(&mut rng)] {
        let Ok(other) = from(&start) else {
            faults.push(format!("{words}: no fit from {start:?}"));
            continue;
        };
        for (a, b) in first.estimates().iter().zip(other.estimates()) {
            let same = a.value == b.value || a.status == Status::NotIdentified;
            if !same || a.status != b.status {
                faults.push(format!("{words}: {a:?} and {b:?} from {start:?}"));
            }
        }
    }
    let least = objective(&first);
    let same = if is_estimated(&first) { SAME_LIKELIHOOD } else { SAME };
    let points = if is_film { POINTS / 6 } else { POINTS };
    for point in 0..points {
        let mu = 0.5 * 1e3_f64.powf(-(point as f64) / points as f64);
        let mut held = dataset.clone();
        let setting = &mut held.settings[Parameter::Mu];
        (setting.initial, setting.fixed) = (mu, true);
        let Ok(there) = fitted(&held) else { continue };
        // frames and shots that fit no collision at some μ are left out there: χ² is compared of the same frames and shots
        let is_of_same = rejected(&there) == rejected(&first) && there.dof() >= first.dof();
        let there = objective(&there);
        if is_of_same && there < least - same {
            let found = estimate(&first, Parameter::Mu);
            faults.push(format!(
                "{words}: {least:.4} at μ = {:.5} ({:?}), {there:.4} at {mu:.5}",
                found.value, found.status
            ));
            break;
        }
    }
    faults
}

/// The shots that a fit leaves out.
fn rejected(fit: &Fit) -> BTreeSet<String> {
    fit.shots_rejected().iter().map(|rejected| rejected.shot.clone()).collect()
}

/// CAROMFIT_SETS may raise the number of data sets, CAROMFIT_SEEDS names some ("74,180").
#[test]
fn no_minimum_is_above_that_of_a_fine_scan_and_none_depends_on_the_start() {
    let seeds: Vec<u64> = match std::env::var("CAROMFIT_SEEDS") {
        Ok(named) => named.split(',').map(|seed| seed.trim().parse().unwrap()).collect(),
        Err(_) => (0..count("CAROMFIT_SETS", 10) as u64).collect(),
    };
    let faults = in_threads(&seeds, faults);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
