//! Discs calibrate their camera.

use std::f64::consts::TAU;

use caromfit::fit::ExtractedDiscs;

use crate::camera::neutral;
use crate::films::pucks::{self, E, FILMED, Filmed, RADII, SETTINGS, Show, as_it_is, load};
use crate::prelude::*;

const SHOTS: usize = FILMED.shots;

/// Standard errors by which a value may be off: one in 16 000 is by chance.
const ERRORS: f64 = 4.0;

/// A film, and J_t/J_n of its shots: at random, or friction that stops the slip, or is as large as it can be.
fn film(seed: u64, filmed: &Filmed, mu: Option<f64>) -> (Dataset, Vec<f64>) {
    let (table, made) = pucks::film(seed, filmed, &mut |contact| {
        let stops = -contact.slip / (3.0 * (1.0 + E) * contact.closing);
        [E, mu.map_or(contact.chance, |mu| stops.clamp(-mu, mu))]
    });
    let mut settings = SETTINGS.to_owned();
    if !filmed.rim {
        for disc in ["a", "b"] {
            let points = format!("[\"{disc}0\", \"{disc}1\", \"{disc}2\"]");
            settings = settings.replace(&points, &format!("\"{disc}0\""));
        }
    }
    (load(&settings, &table).unwrap(), made.iter().map(|collision| collision.ratio).collect())
}

/// e and J_t/J_n of all shots are within their errors.
fn is_right(name: &str, extracted: &ExtractedDiscs, ratios: &[f64]) {
    let shots = &extracted.shots;
    assert!(shots.len() == SHOTS, "{name}: {:?}", extracted.dataset.left_out);
    let pulls = |of: &dyn Fn(usize) -> (Measured, f64)| -> Vec<f64> {
        (0..SHOTS).map(of).map(|(measured, truth)| (measured.value - truth) / measured.sd.unwrap()).collect()
    };
    let ratio = |i: usize| ratios[shots[i].0.name.parse::<usize>().unwrap()];
    let measured = |i: usize, quantity: &str| shots[i].1.get(quantity).unwrap();
    for (what, pulls) in [
        ("e", pulls(&|i| (measured(i, "e"), E))),
        ("J_t/J_n", pulls(&|i| (measured(i, "impulse_ratio"), ratio(i)))),
    ] {
        let n = pulls.len() as f64;
        let mean = pulls.iter().sum::<f64>() / n;
        let rms = (pulls.iter().map(|p| p * p).sum::<f64>() / n).sqrt();
        // the χ² of 20 shots exceeds 2.25 times its mean once in 2000
        assert!(mean.abs() < ERRORS / n.sqrt() && rms < 1.5, "{name}: {what}: {mean} {rms}");
    }
}

/// What the cameras of the tests do: the name, to what, and the correction that undoes it with its value.
fn faults() -> Vec<(&'static str, Show, [f64; 2], Correction, f64)> {
    vec![
        ("aspect", |[x, y]| [x, 0.99 * y], [0.0; 2], Correction::Aspect, 0.99),
        (
            "keystone",
            |[x, y]| [x / (1.0 + 0.05 * y), y / (1.0 + 0.05 * y)],
            [0.0; 2],
            Correction::PerspectiveY,
            0.05,
        ),
        (
            "barrel",
            |[x, y]| [x, y].map(|z| z * (1.0 - 0.01 * (x * x + y * y) / 0.25)),
            [0.0; 2],
            Correction::Lens,
            -0.01,
        ),
        ("scale", |[x, y]| [1.02 * x, 1.02 * y], [0.0; 2], Correction::Scale, 1.02),
        ("shutter", as_it_is, [0.0, 0.003], Correction::ShutterY, 0.003),
        (
            // 1.6 m above the table, 20° from the vertical: sin 20°/1.6 m
            "tilted",
            |[x, y]| {
                let (sin, cos) = (TAU / 18.0).sin_cos();
                let depth = 1.0 + y * sin / 1.6;
                [x / depth, y * cos / depth]
            },
            [0.0; 2],
            Correction::PerspectiveY,
            0.2275,
        ),
    ]
}

fn is_calibrated(rim: bool, wanted: &[&str]) {
    for (name, show, shutter, which, truth) in faults().into_iter().filter(|fault| wanted.contains(&fault.0))
    {
        let (dataset, ratios) = film(71, &Filmed { show, shutter, rim, ..FILMED }, None);
        let extracted = fit::extract_discs(dataset);
        let camera = extracted.camera.as_ref().unwrap();
        let found = camera.found(which).unwrap();
        assert!(camera.converged(), "{name}: {found:?}");
        // perspective and lens are counted from the middle of the film, which is off the middle of the table by centimetres
        let off = (found.value - truth).abs();
        assert!(off < (ERRORS * found.sd.unwrap()).max(0.05 * truth.abs().min(0.3)), "{name}: {found:?}");
        is_right(name, &extracted, &ratios);
        let notes = &extracted.dataset.tracks.as_ref().unwrap().notes;
        assert!(notes.iter().any(|note| note.contains("which the discs themselves calibrate")), "{notes:?}");
    }
}

#[test]
fn points_on_discs_calibrate_the_camera() {
    is_calibrated(true, &["aspect", "keystone", "barrel", "scale", "shutter", "tilted"]);
}

/// Centres alone tell it where discs touch: a lens and a shutter hardly, but what turns a circle into an ellipse.
#[test]
fn centres_of_discs_calibrate_the_camera() {
    is_calibrated(false, &["aspect", "keystone", "scale", "tilted"]);
}

/// A camera that needs no correction is found to need none, but for its errors.
#[test]
fn a_clean_film_of_discs_stays_as_it_is() {
    for seed in 0..count("CAROMFIT_SETS", 3) as u64 {
        for rim in [true, false] {
            let (dataset, ratios) = film(80 + seed, &Filmed { rim, ..FILMED }, None);
            let extracted = fit::extract_discs(dataset);
            let camera = extracted.camera.as_ref().unwrap();
            assert!(camera.converged(), "{:?}", camera.sentence());
            // all but those of balls that hop, and of what trackers do but for a disc that is late
            assert_eq!(neutral(camera), Correction::COUNT - 7);
            is_right("clean", &extracted, &ratios);
        }
    }
}

/// With a second disc that is shown half a frame late e was 30 errors off, with a tracker that smooths both 4.
#[test]
fn what_trackers_do_to_discs_is_found() {
    let shifted = |change: &dyn Fn(&mut TrackShot)| {
        let (mut dataset, ratios) = film(72, &Filmed { rim: false, ..FILMED }, None);
        dataset.tracks.as_mut().unwrap().shots.iter_mut().for_each(change);
        let extracted = fit::extract_discs(dataset);
        is_right("tracker", &extracted, &ratios);
        let notes = &extracted.dataset.tracks.as_ref().unwrap().notes;
        let lags = notes.iter().any(|note| note.contains("after were left out"));
        (lags, extracted.camera.unwrap().found(Correction::Late).unwrap())
    };
    let (lags, late) = shifted(&|shot| shot.object.iter_mut().for_each(|sample| sample.t += 0.5 / shot.fps));
    assert!((late.value - 0.5).abs() < ERRORS * late.sd.unwrap() && !lags, "{late:?}");
    let (lags, _) = shifted(&|shot| {
        for path in [&mut shot.cue, &mut shot.object] {
            for i in 1..path.len() {
                let ([x, y], seen) = ([path[i - 1].x, path[i - 1].y], &mut path[i]);
                (seen.x, seen.y) = (0.6 * seen.x + 0.4 * x, 0.6 * seen.y + 0.4 * y);
            }
        }
    });
    assert!(lags);
}

/// Discs that slow down by a thousandth to half a hundredth of gravity: straight lines gave an e that was 8 to 13 errors off.
#[test]
fn discs_that_slow_down_are_followed() {
    for slowing in [0.01, 0.05] {
        for (rim, show) in [(true, as_it_is as Show), (true, faults()[1].1), (false, as_it_is)] {
            let (dataset, ratios) = film(95, &Filmed { show, rim, slowing, ..FILMED }, None);
            let extracted = fit::extract_discs(dataset);
            is_right("slowing", &extracted, &ratios);
            let notes = &extracted.dataset.tracks.as_ref().unwrap().notes;
            assert!(notes.iter().any(|note| note.starts_with("The discs slow down by 0.0")), "{notes:?}");
        }
    }
}

/// What is stated of the camera is taken, and not found; a scale is told by stated radii alone.
#[test]
fn what_is_stated_of_the_camera_of_discs_is_taken() {
    let (mut dataset, ratios) = film(90, &Filmed { show: |[x, y]| [x, 0.99 * y], ..FILMED }, None);
    let tracks = dataset.tracks.as_mut().unwrap();
    tracks.camera[Correction::Aspect as usize] = Some(Measured { value: 0.99, sd: None });
    tracks.discs.as_mut().unwrap().radii = None;
    let extracted = fit::extract_discs(dataset.clone());
    let camera = extracted.camera.as_ref().unwrap();
    let is_free = |which: Correction| camera.found(which).is_some();
    assert!(!is_free(Correction::Aspect) && !is_free(Correction::Scale) && is_free(Correction::Shear));
    neutral(camera);
    assert_eq!(camera.get(Correction::Aspect), 0.99);
    is_right("stated", &extracted, &ratios);
    // with few shots, what is stated is still corrected, and nothing else
    dataset.tracks.as_mut().unwrap().shots.truncate(2);
    let few = fit::extract_discs(dataset).camera.unwrap();
    assert!(neutral(&few) == 0 && few.get(Correction::Aspect) == 0.99);
}

/// What a camera that looks askew adds to the errors of a few shots: of centres alone these were 30 times too small, of rotations 5 to 15 times.
#[test]
fn errors_include_those_of_the_camera() {
    /// The root mean square of 18 independent normal pulls exceeds it once in 30; those of rotations and of centres alone are smaller, for
    /// the priors of radii and camera are wider than what these films do.
    const SPREAD: f64 = 1.3;
    const MU: f64 = 0.15;
    let (shots, films) = (6, count("CAROMFIT_SETS", 3));
    for rim in [true, false] {
        let filmed = Filmed { show: faults()[5].1, rim, shots, ..FILMED };
        let mut pulls: Vec<(&str, f64)> = Vec::new();
        let mut of_fits = Vec::new();
        for seed in 0..films as u64 {
            let (dataset, ratios) = film(1000 + seed, &filmed, Some(MU));
            let extracted = fit::extract_discs(dataset.clone());
            assert_eq!(extracted.shots.len(), shots, "{:?}", extracted.dataset.left_out);
            for (track, impact) in &extracted.shots {
                let ratio = ratios[track.name.parse::<usize>().unwrap()];
                for (quantity, truth) in [
                    ("e", E),
                    ("impulse_ratio", ratio),
                    ("impulse_ratio_by_cue_spin", ratio),
                    ("impulse_ratio_by_obj_spin", ratio),
                    ("momentum_along", 0.0),
                    ("momentum_across", 0.0),
                    ("angular_momentum", 0.0),
                    ("contact_distance_mm", 1e3 * (RADII[0] + RADII[1])),
                ] {
                    let pull = |found: Measured| (quantity, (found.value - truth) / found.sd.unwrap());
                    pulls.extend(impact.get(quantity).map(pull));
                }
            }
            let e = *fit::fit(&dataset, &options::of_fit()).unwrap()[0].get(Parameter::E).unwrap();
            of_fits.push((e.value - E) / e.std_error.unwrap());
        }
        let quantities: BTreeSet<&str> = pulls.iter().map(|(quantity, _)| *quantity).collect();
        for quantity in quantities {
            let own: Vec<f64> =
                pulls.iter().filter(|(other, _)| *other == quantity).map(|own| own.1).collect();
            if quantity == "contact_distance_mm" {
                // one number that all shots of a film share, so that these pulls are three, not 18
                assert!(own.iter().all(|pull| pull.abs() < ERRORS), "{own:?}");
                continue;
            }
            let rms = (own.iter().map(|p| p * p).sum::<f64>() / own.len().max(1) as f64).sqrt();
            assert!(rms < SPREAD, "{quantity:?} {rms}");
        }
        assert!(of_fits.iter().all(|pull| pull.abs() < ERRORS), "{of_fits:?}");
    }
}
