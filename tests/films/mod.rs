//! Films with everything that goes wrong between the table and the table of positions, and all of it at once: whatever was filmed,
//! nothing panics or hangs, and every shot is used or left out with its reason.
//!
//! At length: `CAROMFIT_FILMS=100000 cargo test --release -- --nocapture films_of_every_kind`.

mod faults;
pub mod pucks;

use std::panic::{AssertUnwindSafe, catch_unwind};

use caromfit::fit::check;
use caromfit::io::DatasetError;

use faults::{Faults, manifest, table};

use crate::prelude::*;
use crate::study::in_threads;

/// What a shot that was left out because caromfit itself failed says.
const DEFECT: &str = "defect of caromfit";

/// A film as it is loaded.
fn loaded(table: &str, manifest: &str) -> Result<Dataset, DatasetError> {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("tracks.csv"), table).unwrap();
    fs::write(folder.path().join("dataset.toml"), manifest).unwrap();
    io::load(folder.path())
}

/// Makes a film and takes it through everything that a fit does; returns the number of its shots that are used.
fn film(seed: u64) -> usize {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let faults = Faults::draw(random);
    let fps = [50.0, 120.0, 240.0, 500.0, 1000.0][random.random_range(0..5)];
    let played = ["stun", "natural-roll", "any", "side"][random.random_range(0..4)];
    let shots = random.random_range(1..=4);
    let usual = spec("tracks", &[played], shots, seed);
    let [before_ms, after_ms] = [0; 2].map(|_| random.random_range(3.0..60.0) * 1e3 / fps);
    let keys = format!(
        "shots = {{ speed_m_s = [0.1, 6], cut_deg = [-75, 75] }}\ncloth.bounce = {:?}\n\
         camera = {{ before_ms = {before_ms:?}, after_ms = {after_ms:?} }}",
        random.random::<f64>()
    );
    let spec = with(&usual, &keys);
    let discs = random.random_bool(0.1);
    let spin = ["stun", "natural-roll", "unknown"][random.random_range(0..3)];
    let more = if random.random_bool(0.2) { "position_sd_m = 1e-4\n" } else { "" };
    let table = table(&spec, fps, &faults, random);
    let dataset = match loaded(&table, &manifest(fps, &faults, (!discs).then_some(spin), more)) {
        Ok(dataset) => dataset,
        Err(error) => {
            assert!(!error.to_string().contains(DEFECT), "{error}");
            return 0;
        }
    };
    let tracks = dataset.clone();
    let dataset = fit::extract(dataset);
    assert!(dataset.sliding.is_none_or(|sliding| sliding.value >= 0.0));
    // a shot of which no row is left is none
    assert!(dataset.shots.len() + dataset.left_out.len() <= shots);
    for (shot, reason) in &dataset.left_out {
        assert!(!reason.contains(DEFECT), "shot {shot}: {reason}");
    }
    for after in dataset.shots.iter().flat_map(|shot| &shot.after) {
        assert!(after.measured.sd.is_none_or(f64::is_finite), "{after:?}");
    }
    for finding in check::check(&dataset) {
        assert!(!finding.text.contains("NaN"), "{}", finding.text);
    }
    let options = Options { depth: Depth::Estimates, fidelity: None, ..options::of_fit() };
    for fit in fit::fit(&tracks, &options).into_iter().flatten() {
        assert!(fit.estimates().iter().all(|estimate| estimate.value.is_finite()));
    }
    dataset.shots.len()
}

#[test]
fn films_of_every_kind_neither_panic_nor_hang() {
    let films = count("CAROMFIT_FILMS", 40);
    let first = count("CAROMFIT_FIRST_FILM", 0);
    let begun = Instant::now();
    // of a film of few frames as many numbers as unknowns were left; of another a collision stuck just after compression
    let once_failed = [25568, 64290];
    let seeds: Vec<u64> = (first as u64..(first + films) as u64).chain(once_failed).collect();
    let of_films =
        in_threads(&seeds, |seed| vec![(seed, catch_unwind(AssertUnwindSafe(|| film(seed))).ok())]);
    let used: usize = of_films.iter().filter_map(|(_, used)| *used).sum();
    figure(format!("{used} shots of {films} films are used; {:.0} s", begun.elapsed().as_secs_f64()));
    let failed: Vec<u64> =
        of_films.iter().filter(|(_, used)| used.is_none()).map(|(seed, _)| *seed).collect();
    assert!(failed.is_empty(), "films {failed:?}");
    // they are not all beyond use
    assert!(used > films / 2);
}

/// 40 films of natural roll, with one fault, as they are fitted.
fn fitted(fps: f64, faults: &Faults, seed: u64) -> (Dataset, Fit) {
    let usual = spec("tracks", &["natural-roll"], 40, seed);
    let ms = if fps < 500.0 { 120.0 } else { 40.0 };
    let spec = with(&usual, &format!("camera = {{ before_ms = {ms}, after_ms = {ms} }}"));
    let table = table(&spec, fps, faults, &mut ChaCha8Rng::seed_from_u64(seed));
    let dataset = loaded(&table, &manifest(fps, faults, Some("natural-roll"), "")).unwrap();
    let fit = options::fitted(&dataset, Depth::Estimates);
    (fit::extract(dataset), fit)
}

/// Whole pixels and few decimals: the resolution is recognised and is the noise, so that no shot is lost and errors are true.
#[test]
fn rounded_positions_are_fitted() {
    /// χ² of some 160 numbers with errors that are right to a few per cent, at four standard deviations.
    const MOST: f64 = 1.6;
    /// Rounding errors that repeat are taken for as large as they can be.
    const LEAST: f64 = 0.4;
    let sets = count("CAROMFIT_SETS", 2) as u64;
    for (fps, grid, noise) in [
        (1000.0, 5e-4, 1e-4),
        (240.0, 1e-3, 1e-4),
        (240.0, 1e-3, 1e-6),
        (240.0, 1e-3, 3e-4),
        (240.0, 3e-3, 3e-4),
    ] {
        let faults = Faults { grid, noise, decimals: 7, ..Faults::default() };
        for seed in 0..sets {
            let (dataset, fit) = fitted(fps, &faults, seed);
            let what = format!("{fps} fps, {grid} m, noise {noise}, seed {seed}");
            let estimates = fit.estimates().iter().zip(TRUTH);
            let pull = |(estimate, truth): (&Estimate, f64)| {
                (estimate.value - truth) / estimate.std_error.unwrap_or(f64::INFINITY)
            };
            let pulls: Vec<f64> = estimates.map(pull).collect();
            let reduced = fit.chi2() / fit.dof() as f64;
            figure(format!("{what}: chi2/dof {reduced:.2}, errors {pulls:.1?}"));
            assert_eq!(dataset.left_out, [], "{what}");
            assert!((LEAST..MOST).contains(&reduced), "{what}: {reduced}");
            assert!(pulls.iter().all(|pull| pull.abs() < 3.5), "{what}: {pulls:?}");
        }
    }
}
