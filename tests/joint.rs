//! Extracted impacts with their joint errors: fitting them is fitting the tracks.

use std::path::Path;

use caromfit::extraction::{Quantity, extract, shots};
use caromfit::fit;
use caromfit::fit::Fit;
use caromfit::fit::footage::with_impacts;
use caromfit::io;
use caromfit::measurement::dataset::{Before, Dataset, Joint, Shared};
use caromfit::measurement::track::TrackShot;
use caromfit::physics::collision::Coefficients;
use caromfit::report::extracted;
use caromfit::simulate;
use caromfit::simulate::Spec;
use caromfit::trajectory::scene::{LiftPrior, Scene};

use crate::options;

/// The direction of the line of centres goes through nx, ny and back; the minimum is found to some hundredths
/// of a thousandth of a standard error either way.
const SAME: f64 = 1e-7;

const SPEC: &str = r#"
name = "shots"
kind = "tracks"
seed = 8
truth = { mu = 0.05, mu_s = 0.3, e = 0.94 }
[shots]
count = 24
speed_m_s = [1.0, 4.0]
cut_deg = [-50.0, 50.0]
cue_spin = ["natural-roll", "stun", "draw"]
[camera]
gaps = 0.02
"#;

fn write(folder: &Path, files: impl IntoIterator<Item = (&'static str, Vec<u8>)>) {
    std::fs::create_dir_all(folder).unwrap();
    for (name, content) in files {
        std::fs::write(folder.join(name), content).unwrap();
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Spins {
    Told,
    Unknown,
}

/// Makes tracks, fits them, writes the extracted impacts beside them, and gives their folder.
fn extracted(folder: &Path, markers: usize, fit: &str, spins: Spins) -> Fit {
    let mut spec: Spec = toml::from_str(SPEC).unwrap();
    spec.camera.markers = markers;
    let files = simulate::generate(&spec).unwrap().into_iter().map(|(name, text)| match name {
        "dataset.toml" if spins == Spins::Unknown => {
            let untold = text.replace("\"measured\"", "\"unknown\"").replace("shots = \"shots.csv\"", "");
            (name, format!("{untold}\n{fit}").into_bytes())
        }
        "dataset.toml" => (name, format!("{text}\n{fit}").into_bytes()),
        _ => (name, text.into_bytes()),
    });
    let tracks = folder.join("tracks");
    write(&tracks, files);
    let (dataset, shots, _) = with_impacts(io::load(&tracks).unwrap(), &|| ());
    write(&folder.join("impacts"), extracted::files(&dataset, &shots));
    fit::fit(&dataset, &options::of_fit()).unwrap().remove(0)
}

#[test]
fn extract_and_fit_give_what_a_fit_of_the_tracks_gives() {
    const PRIOR: &str = "[fit]\nmu_s = { prior_mean = 0.3, prior_sd = 0.01 }\n";
    for (markers, settings, spins) in
        [(0, "", Spins::Told), (2, "", Spins::Told), (0, PRIOR, Spins::Told), (0, "", Spins::Unknown)]
    {
        let folder = tempfile::tempdir().unwrap();
        let at_once = extracted(folder.path(), markers, settings, spins);
        let impacts = io::load(&folder.path().join("impacts")).unwrap();
        let refitted = fit::fit(&impacts, &options::of_fit()).unwrap().remove(0);
        for (a, b) in at_once.estimates.iter().zip(&refitted.estimates) {
            let error = a.std_error.unwrap();
            assert!((a.value - b.value).abs() < SAME * error, "{} and {}", a.value, b.value);
            assert!((error - b.std_error.unwrap()).abs() < SAME * error);
        }
        assert!((at_once.chi2 - refitted.chi2).abs() < SAME * at_once.chi2);
        assert_eq!(at_once.dof, refitted.dof);
    }
}

#[test]
fn a_wrong_table_of_joint_errors_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    extracted(folder.path(), 0, "", Spins::Told);
    let impacts = folder.path().join("impacts");
    let good = std::fs::read_to_string(impacts.join("covariance.csv")).unwrap();
    let mut lines: Vec<&str> = good.lines().collect();
    let second = lines[2].to_string();
    let cells: Vec<&str> = second.split(',').collect();
    let with_cell = |column: usize, text: &str| {
        let mut cells = cells.clone();
        cells[column] = text;
        cells.join(",")
    };
    let check = |line: Option<String>, expected: &str| {
        let mut changed = lines.clone();
        let line = line.unwrap_or_default();
        changed[2] = &line;
        std::fs::write(impacts.join("covariance.csv"), changed.join("\n")).unwrap();
        let error = io::load(&impacts).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    check(None, "covariance.csv: column quantity: no row of \"cue_vx\" for shot 1; expected one");
    check(Some(with_cell(2, "")), "covariance.csv:3: column direction_rad: no covariance of \"cue_vx\" with");
    check(Some(with_cell(2, "7")), "and \"direction_rad\" of shot 1 is 7e0 in one row and");
    check(Some(with_cell(3, "-1")), "the variance of \"cue_vx\" of shot 1 is -1e0; expected 0 or more");
    check(Some(with_cell(2, "x")), "covariance.csv:3: column direction_rad: \"x\" is not a finite number");
    let repeated = lines[1].to_string();
    check(
        Some(repeated),
        "covariance.csv:3: column quantity: \"direction_rad\" of shot 1 also stands in line 2",
    );
    lines.clear();
    let toml = std::fs::read_to_string(impacts.join("dataset.toml")).unwrap();
    std::fs::write(impacts.join("covariance.csv"), good).unwrap();
    for key in ["mu_k", "mu_r"] {
        let sd = format!("{key}_sd");
        let without = toml.lines().filter(|line| !line.starts_with(&sd)).collect::<Vec<_>>().join("\n");
        std::fs::write(impacts.join("dataset.toml"), without).unwrap();
        let error = io::load(&impacts).unwrap_err().to_string();
        let expected = format!("only one of {key} and {sd} in [impacts]; expected both or none");
        assert!(error.contains(&expected), "{error}");
    }
}

/// Footage, what was extracted from it, and with what.
fn filmed() -> (Vec<TrackShot>, Dataset, Scene) {
    let spec: Spec = toml::from_str(SPEC).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let files = simulate::generate(&spec).unwrap();
    write(folder.path(), files.into_iter().map(|(name, text)| (name, text.into_bytes())));
    let dataset = io::load(folder.path()).unwrap();
    let tracks = dataset.tracks.clone().unwrap().shots;
    let (dataset, _, scene) = with_impacts(dataset, &|| ());
    (tracks, dataset, scene)
}

/// What is told of μ_r beforehand is put right once all shots have told it.
#[test]
fn a_wrong_rolling_resistance_moves_what_is_extracted_as_stated() {
    /// Of a standard deviation: the fit of a shot stops within some hundredths.
    const SAME: f64 = 0.05;
    let (tracks, dataset, scene) = filmed();
    let mut other = scene;
    other.cloth.rolling *= 2.0;
    let mut moved = 0.0_f64;
    for track in &tracks {
        let of = |scene| {
            let impact = extract(track, scene).unwrap();
            let shot = shots::shot(track, &impact, dataset.sliding, dataset.rolling.unwrap());
            (impact.values[Quantity::CueVxBefore as usize], shot.before, shot.after)
        };
        let ((raw, before, after), (other_raw, other_before, other_after)) = (of(&scene), of(&other));
        let (Before::Impact { velocity: a, .. }, Before::Impact { velocity: b, .. }) = (before, other_before)
        else {
            panic!("{before:?}")
        };
        let after = after.iter().zip(&other_after).map(|(a, b)| (a.measured, b.measured));
        for (a, b) in a.into_iter().zip(b).chain(after) {
            assert!((a.value - b.value).abs() < SAME * a.sd.unwrap(), "{a:?} {b:?}");
        }
        moved = moved.max((raw - other_raw).abs() / a[0].sd.unwrap());
    }
    assert!(moved > 0.5, "{moved}");
}

/// μ is changed by this part.
const STEP: f64 = 0.01;
/// The lift grows by a little less than μ where the slip falls much; single shots are off at a landing, which is a kink.
const LINEAR: f64 = 0.1;

/// What is stated of the lift's shared error is what another lift makes of the same tracks.
#[test]
fn the_lift_moves_what_is_extracted_as_stated() {
    let (tracks, dataset, scene) = filmed();
    assert!(dataset.lift_sd.is_some());
    let LiftPrior::Model(model, coefficients, sd) = scene.lift else { panic!("{scene:?}") };
    // the lift grows with μ where the balls slip
    let higher = Coefficients { mu: coefficients.mu * (1.0 + STEP), ..coefficients };
    let higher = Scene { lift: LiftPrior::Model(model, higher, sd), ..scene };
    let (mut both, mut square) = (0.0, 0.0);
    for track in &tracks {
        let of = |scene| {
            shots::shot(track, &extract(track, scene).unwrap(), dataset.sliding, dataset.rolling.unwrap())
        };
        let (before, after) = (of(&scene), of(&higher));
        let by = &before.joint.as_ref().unwrap().by_shared[Shared::Lift.place()];
        let by = by.rows(Joint::BEFORE, before.after.len());
        let shifts = before.after.iter().zip(&after.after).map(|(a, b)| b.measured.value - a.measured.value);
        for (shift, by) in shifts.zip(by.iter()) {
            both += shift * by * STEP;
            square += (by * STEP).powi(2);
        }
    }
    println!("the shifts are {} of what is stated", both / square);
    assert!((both / square - 1.0).abs() < LINEAR, "{both}, {square}");
}
