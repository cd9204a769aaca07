//! `caromfit fit`: its files, its output, and what it refuses.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use serde_json::Value;

use super::{caromfit, done, keys, numbers, refused, stderr};
use crate::loader::{ANGLES, SHOTS, swap, write};

/// A copy of a shipped data set, and a folder for results that is not there yet.
struct Lab {
    _folder: tempfile::TempDir,
    data: PathBuf,
    out: PathBuf,
}

impl Lab {
    fn of(name: &str) -> Self {
        let lab = Self::empty();
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(name);
        for entry in fs::read_dir(from).unwrap() {
            let path = entry.unwrap().path();
            if path.is_file() {
                fs::copy(&path, lab.data.join(path.file_name().unwrap())).unwrap();
            }
        }
        lab
    }

    fn empty() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (data, out) = (folder.path().join("data"), folder.path().join("results/fits"));
        fs::create_dir(&data).unwrap();
        Self { _folder: folder, data, out }
    }

    fn with(toml: &str, csv: &str) -> Self {
        let lab = Self::empty();
        write(&lab.data, &[("dataset.toml", toml.as_bytes()), ("shots.csv", csv.as_bytes())]);
        lab
    }

    fn fit(&self, more: &[&str]) -> Output {
        let args = ["fit", self.data.to_str().unwrap(), "--out", self.out.to_str().unwrap()];
        caromfit(args.iter().chain(more))
    }

    /// Every file and folder below the results, none where they are not there at all.
    fn written(&self) -> Vec<String> {
        fn list(folder: &Path, base: &Path, found: &mut Vec<String>) {
            for entry in fs::read_dir(folder).into_iter().flatten() {
                let path = entry.unwrap().path();
                found.push(path.strip_prefix(base).unwrap().to_str().unwrap().to_string());
                list(&path, base, found);
            }
        }
        let base = self.out.parent().unwrap();
        let mut found = Vec::new();
        list(base, base, &mut found);
        found.sort();
        found
    }

    fn fit_json(&self, name: &str) -> Value {
        serde_json::from_slice(&fs::read(self.out.join(name).join("fit.json")).unwrap()).unwrap()
    }
}

const FILES: [&str; 6] =
    ["fit.json", "report.html", "residuals.csv", "residuals.png", "residuals.svg", "shots.csv"];

/// The keys of a fit.json that programs rely on, and what belongs together in it; its types are those of its schema.
fn check_fit(fit: &Value, dataset: &str) {
    let expected = "dataset version fidelity effects parameters correlation chi2 dof shots_used shots_rejected termination iterations seconds";
    assert!(keys(fit).is_superset(&expected.split(' ').collect()), "{fit}");
    assert_eq!(fit["dataset"], dataset);
    assert_eq!(fit["version"], env!("CARGO_PKG_VERSION"));
    assert!(fit["effects"]["friction"].is_boolean());
    // nothing is stated of the masses, so that their ratio is an unknown
    assert_eq!(keys(&fit["parameters"]), BTreeSet::from(["mu", "mu_s", "e", "mass_ratio"]));
    for parameter in fit["parameters"].as_object().unwrap().values() {
        let status = parameter["status"].as_str().unwrap();
        if matches!(status, "fixed" | "not-identified") {
            assert!(parameter["std_error"].is_null() && parameter["interval_95"].is_null(), "{parameter}");
        }
        if status == "free" {
            let interval = numbers(&parameter["interval_95"]);
            let estimate = parameter["estimate"].as_f64().unwrap();
            assert!(interval[0] <= estimate && estimate <= interval[1], "{parameter}");
            assert!(parameter["std_error"].as_f64().unwrap() > 0.0);
        }
    }
    assert_eq!(fit["correlation"]["order"], serde_json::json!(["mu", "mu_s", "e", "mass_ratio"]));
    let rows = fit["correlation"]["matrix"].as_array().unwrap();
    assert!(rows.len() == 4 && rows.iter().all(|row| row.as_array().unwrap().len() == 4));
    assert!(fit["chi2"].as_f64().unwrap() >= 0.0);
}

#[test]
fn a_fit_and_its_files() {
    let lab = Lab::of("mathavan-2014");
    let first = lab.fit(&[]);
    let table = done(&first).to_string();
    assert!(table.contains("mathavan-2014"), "{table}");
    let mut expected = vec!["fits".to_string(), "fits/mathavan-2014".to_string()];
    let contours = ["contours.png", "contours.svg"];
    expected.extend(contours.into_iter().chain(FILES).map(|file| format!("fits/mathavan-2014/{file}")));
    assert_eq!(lab.written(), expected);
    let fit = lab.fit_json("mathavan-2014");
    check_fit(&fit, "mathavan-2014");
    assert_eq!(fit["shots_used"], 5);
    let folder = lab.out.join("mathavan-2014");
    assert!(fs::read(folder.join("residuals.png")).unwrap().starts_with(b"\x89PNG\r\n"));
    assert!(fs::read_to_string(folder.join("residuals.svg")).unwrap().contains("<svg"));
    let csv = fs::read_to_string(folder.join("residuals.csv")).unwrap();
    let header: Vec<_> = csv.lines().find(|line| !line.starts_with('#')).unwrap().split(',').collect();
    for column in ["shot", "observable", "measured", "predicted", "sd", "standardized"] {
        assert!(header.contains(&column), "{header:?}");
    }

    // a second run replaces all of them, and leaves what is not its own
    for file in contours.into_iter().chain(FILES) {
        fs::write(folder.join(file), "old").unwrap();
    }
    fs::write(folder.join("notes.txt"), "mine").unwrap();
    assert_eq!(done(&lab.fit(&[])), table);
    assert_eq!(fs::read_to_string(folder.join("notes.txt")).unwrap(), "mine");
    fs::remove_file(folder.join("notes.txt")).unwrap();
    assert_eq!(lab.written(), expected);
    let mut again = lab.fit_json("mathavan-2014");
    again["seconds"] = fit["seconds"].clone();
    assert_eq!(again, fit);
    assert_eq!(fs::read_to_string(folder.join("residuals.csv")).unwrap(), csv);
}

/// Results that are kept under version control change with the result, not with the time that it took.
#[test]
fn the_same_result_leaves_fit_json_as_it_was() {
    let lab = Lab::of("mathavan-2014");
    done(&lab.fit(&[]));
    let path = lab.out.join("mathavan-2014/fit.json");
    let first = fs::read_to_string(&path).unwrap();
    let line = first.lines().find(|line| line.contains("\"seconds\"")).unwrap();
    let slower = swap(&first, line, "  \"seconds\": 1234.5");
    fs::write(&path, &slower).unwrap();
    done(&lab.fit(&[]));
    assert_eq!(fs::read_to_string(&path).unwrap(), slower);
    let other = swap(&slower, "\"shots_used\": 5", "\"shots_used\": 4");
    fs::write(&path, &other).unwrap();
    done(&lab.fit(&[]));
    let again = lab.fit_json("mathavan-2014");
    assert_eq!(again["shots_used"], 5);
    assert!(again["seconds"].as_f64().unwrap() < 1234.5);
}

#[test]
fn a_picture_of_an_earlier_fit_does_not_stay() {
    let lab = Lab::of("alciatore-2006");
    let folder = lab.out.join("alciatore-2006/slow");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("contours.png"), "old").unwrap();
    done(&lab.fit(&[]));
    // μ alone is free: there is no pair to draw
    assert!(!folder.join("contours.png").exists() && folder.join("residuals.png").exists());
}

#[test]
fn statistics_on_request_stand_in_the_report() {
    let lab = Lab::of("domenech-2023");
    let report = lab.fit(&["--bootstrap", "20", "--loss", "huber", "--seed", "5", "-v"]);
    let text = done(&report).to_string();
    for part in [
        "Bootstrap (20 samples of shots drawn anew, seed 5",
        "Shots that count less, huber loss",
        "What the data determine",
        "Shots that matter most",
        "Other models on these data",
    ] {
        assert!(text.contains(part), "{part} is missing from\n{text}");
    }
    let fit = lab.fit_json("domenech-2023");
    assert_eq!(fit["bootstrap"]["replicates"], 20);
    assert_eq!(fit["robust"]["loss"], "huber");
    assert!(fit["identifiability"]["condition_number"].as_f64().unwrap() >= 1.0);
    assert!(fit["goodness"]["trends"].as_array().is_some_and(|trends| !trends.is_empty()));
    assert_eq!(fit["model_comparison"][0]["model"], "as fitted");
    refused(&lab.fit(&["--loss", "hubert"]), 2);
}

#[test]
fn labels_are_fitted_apart() {
    let lab = Lab::of("alciatore-2006");
    done(&lab.fit(&[]));
    for label in ["slow", "medium", "fast"] {
        let fit = lab.fit_json(&format!("alciatore-2006/{label}"));
        check_fit(&fit, "alciatore-2006");
        let status = |name: &str| fit["parameters"][name]["status"].as_str().unwrap();
        // stun shots say nothing about the cloth
        assert_eq!([status("mu"), status("mu_s"), status("e")], ["free", "not-identified", "fixed"]);
    }
    assert!(!lab.out.join("alciatore-2006/fit.json").exists());
}

#[test]
fn fit_json_is_all_that_is_printed() {
    let (one, more) = (Lab::of("alciatore-2006"), Lab::of("mathavan-2014"));
    let output = one.fit(&["--json", more.data.join("dataset.toml").to_str().unwrap()]);
    let value: Value = serde_json::from_str(done(&output)).unwrap();
    let fits = value.as_array().unwrap();
    assert_eq!(fits.len(), 4);
    for (i, fit) in fits.iter().enumerate() {
        check_fit(fit, if i < 3 { "alciatore-2006" } else { "mathavan-2014" });
    }
    assert_eq!(fits[3], one.fit_json("mathavan-2014"));
}

#[test]
fn bad_input_writes_nothing() {
    let good = Lab::of("mathavan-2014");
    let bad = Lab::with(ANGLES, "shot,cut_deg,throw_deg\n1,thick,3\n2,30,NaN\n");
    let worse = Lab::with(&swap(ANGLES, "radius_m", "radus_m"), SHOTS);
    for json in [&["--json"][..], &[]] {
        let paths = [worse.data.to_str().unwrap(), bad.data.to_str().unwrap(), "nowhere"];
        let output = good.fit(&[&paths[..], json].concat());
        let said = refused(&output, 2);
        for fragment in [
            "dataset.toml:9: column 1: unknown key \"radus_m\" (did you mean \"radius_m\"?)",
            "shots.csv:2: column cut_deg: \"thick\"",
            "shots.csv:3: column throw_deg: \"NaN\"",
            "nowhere: there is no such file",
        ] {
            assert!(said.contains(fragment), "{fragment}:\n{said}");
        }
        assert!(!good.out.parent().unwrap().exists(), "{:?}", good.written());
    }
}

#[test]
fn bad_input_leaves_earlier_results() {
    let lab = Lab::with(ANGLES, SHOTS);
    // two throws, and three parameters less the fixed one and one with a prior
    assert_eq!(lab.fit(&[]).status.code(), Some(0));
    let before = lab.fit_json("lab");
    fs::write(lab.data.join("shots.csv"), "shot,cut_deg,throw_deg\n1,thick,3\n").unwrap();
    refused(&lab.fit(&[]), 2);
    assert_eq!(lab.fit_json("lab"), before);
}

#[test]
fn two_data_sets_of_one_name() {
    let (one, other) = (Lab::of("mathavan-2014"), Lab::of("mathavan-2014"));
    let output = one.fit(&[other.data.to_str().unwrap()]);
    assert!(refused(&output, 2).contains("both named \"mathavan-2014\""));
    assert!(one.written().is_empty());
}

#[test]
fn too_few_observations() {
    let toml = ANGLES.split("[fit]").next().unwrap();
    let lab = Lab::with(toml, "shot,cut_deg,throw_deg,speed_m_s\n1,30,3,2\n");
    let output = lab.fit(&[]);
    let said = refused(&output, 2);
    assert!(said.contains("lab: 1 observation") && said.contains("mu, mu_s"), "{said}");
    assert!(!lab.out.parent().unwrap().exists());
}

#[test]
fn no_usable_shot_is_work_that_could_not_be_done() {
    let lab = Lab::with(&swap(ANGLES, "natural-roll", "unknown"), SHOTS);
    let output = lab.fit(&[]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("lab: no shot can be used: shot 1: "), "{}", stderr(&output));
    assert!(!lab.out.exists());
}

#[test]
fn results_that_cannot_be_written() {
    let lab = Lab::of("mathavan-2014");
    fs::create_dir_all(lab.out.parent().unwrap()).unwrap();
    fs::write(&lab.out, "a file where the folder should be").unwrap();
    let output = lab.fit(&[]);
    let said = refused(&output, 1);
    assert!(said.contains("mathavan-2014: cannot be written"), "{said}");
    assert_eq!(lab.written(), ["fits"]);
}

#[test]
fn a_fit_counts_how_its_shots_were_computed() {
    let folder = tempfile::tempdir().unwrap();
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/data/mathavan-2014");
    let out = folder.path().to_str().unwrap();
    let output = caromfit(["fit", data, "--fidelity", "auto", "--out", out, "--json"]);
    let fits: Value = serde_json::from_str(done(&output)).unwrap();
    let fit = &fits[0];
    assert_eq!(fit["fidelity"], "auto");
    let shots = fit["computed"].as_array().unwrap().iter().map(|c| c["shots"].as_u64().unwrap());
    assert_eq!(Some(shots.sum()), fit["shots_used"].as_u64());
}

const DRAWN: &str = r#"
name = "drawn"
kind = "tracks"
seed = 5
[truth]
mu = 0.06
mu_s = 0.25
e = 0.95
[shots]
count = 8
speed_m_s = [1.0, 4.0]
cut_deg = [-50.0, 50.0]
cue_spin = ["draw"]
[noise]
velocity_m_s = 0.004
line_of_centres_deg = 0.05
spin_rad_s = 0.5
angle_deg = 0.2
"#;

/// Spins that nobody tells are found from the motion and the collision, and the fit says what it found.
#[test]
fn unknown_spins() {
    let lab = Lab::empty();
    let (spec, file) = (lab.data.with_file_name("spec.toml"), lab.data.join("dataset.toml"));
    fs::write(&spec, DRAWN).unwrap();
    fs::remove_dir(&lab.data).unwrap();
    done(&caromfit(["synth", spec.to_str().unwrap(), "--out", lab.data.to_str().unwrap()]));
    // what synth made it replaces, and nothing else
    let again = || caromfit(["synth", spec.to_str().unwrap(), "--out", lab.data.to_str().unwrap()]);
    done(&again());
    let toml = fs::read_to_string(&file).unwrap();
    fs::write(&file, format!("# my own film\n{toml}")).unwrap();
    assert!(refused(&again(), 2).contains("is no synthetic data set, and is not replaced"));
    fs::write(&file, swap(&swap(&toml, "\"measured\"", "\"unknown\""), "shots = \"shots.csv\"\n", ""))
        .unwrap();
    let fitted = |unknown: usize| {
        let output = lab.fit(&["--json"]);
        let fits: Value = serde_json::from_str(done(&output)).unwrap();
        assert_eq!(fits[0]["method"], "joint");
        let notes = fits[0]["findings"].to_string();
        assert!(notes.contains(&format!("Of {unknown} cue balls of unknown spin")), "{notes}");
    };
    fitted(8);
}
