//! The program end to end: exit statuses, what it prints where, and what it leaves on the disk.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use crate::loader::{ANGLES, SHOTS, swap, write};

/// The bar that the reference is held to: 1e-12 of the cue ball's speed (spins: over R).
const REFERENCE: f64 = 1e-12;

fn caromfit<S: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = S>) -> Output {
    Command::new(env!("CARGO_BIN_EXE_caromfit")).args(args).output().unwrap()
}

fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

/// It was done, and nothing was said on standard error.
fn done(output: &Output) -> &str {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    assert_eq!(stderr(output), "");
    stdout(output)
}

/// It ended with a status, and with nothing on standard output.
fn refused(output: &Output, status: i32) -> &str {
    assert_eq!(output.status.code(), Some(status), "{}{}", stdout(output), stderr(output));
    assert_eq!(stdout(output), "");
    stderr(output)
}

fn keys(value: &Value) -> BTreeSet<&str> {
    value.as_object().unwrap_or_else(|| panic!("{value}")).keys().map(String::as_str).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap_or_else(|| panic!("{value}")).iter().map(|x| x.as_f64().unwrap()).collect()
}

const ROLL: [&str; 13] = [
    "collide",
    "--speed",
    "2",
    "--cut",
    "30",
    "--omega",
    "0,69.99,0",
    "--mu",
    "0.05",
    "--mu-s",
    "0.3",
    "--e",
    "0.94",
];

/// `ROLL` with the value of an option replaced.
fn roll_with(option: &str, value: &str) -> Vec<String> {
    let mut args: Vec<String> = ROLL.iter().map(ToString::to_string).collect();
    let at = args.iter().position(|arg| arg == option).unwrap();
    args[at + 1] = value.to_string();
    args
}

#[test]
fn help_version_and_usage() {
    for (args, status) in [
        (&["--help"][..], 0),
        (&["--version"], 0),
        (&["fit", "--help"], 0),
        (&["collide", "--help"], 0),
        (&[], 2),
        (&["nothing"], 2),
        (&["fit"], 2),
        (&["fit", "--nothing", "data"], 2),
        (&["collide"], 2),
        (&["collide", "--speed", "2"], 2),
        (&["collide", "--cases", "a.csv", "--mu", "0.1"], 2),
    ] {
        let output = caromfit(args);
        assert_eq!(output.status.code(), Some(status), "{args:?}");
        let (full, empty) =
            if status == 0 { (stdout(&output), stderr(&output)) } else { (stderr(&output), stdout(&output)) };
        assert!(!full.is_empty() && empty.is_empty(), "{args:?}");
    }
    assert_eq!(done(&caromfit(["--version"])), format!("caromfit {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn one_collision_as_json() {
    let output = caromfit(ROLL.iter().chain(&["--json"]));
    let value: Value = serde_json::from_str(done(&output)).unwrap();
    let expected = ["name", "fidelity", "regime", "impulse", "cue", "object"];
    assert!(keys(&value).is_superset(&BTreeSet::from(expected)), "{value}");
    assert_eq!((value["fidelity"].as_str(), value["regime"].as_str()), (Some("full"), Some("slide")));
    assert!(value["name"].is_string() && value["impulse"].as_f64().unwrap() > 1.0);
    for ball in ["cue", "object"] {
        for what in ["velocity", "spin"] {
            assert_eq!(numbers(&value[ball][what]).len(), 3);
        }
    }
    let object = numbers(&value["object"]["velocity"]);
    assert!(object[0] > 0.0 && object[1] > 0.0 && object[2] == 0.0, "{object:?}");

    let table = caromfit(ROLL);
    let table = done(&table);
    for fragment in ["slide", "full", "object ball velocity, m/s", &format!("{:.9}", object[0])] {
        assert!(table.contains(fragment), "{fragment}:\n{table}");
    }
}

#[test]
fn every_fidelity_collides() {
    for fidelity in ["elastic", "inelastic", "linear", "full"] {
        let output = caromfit(ROLL.iter().chain(&["--fidelity", fidelity, "--json"]));
        let value: Value = serde_json::from_str(done(&output)).unwrap();
        assert_eq!(value["fidelity"], fidelity);
    }
    let output = caromfit(ROLL.iter().chain(&["--fidelity", "ful"]));
    assert!(refused(&output, 2).contains("full"));
}

#[test]
fn negative_values() {
    let json = |args: &[&str]| {
        let rest = ["--speed", "2", "--mu", "0.05", "--mu-s", "0.3", "--e", "0.94", "--json"];
        let output = caromfit(["collide"].iter().chain(args).chain(&rest));
        serde_json::from_str::<Value>(done(&output)).unwrap()
    };
    let apart = json(&["--omega", "-35,60,0", "--cut", "30"]);
    let joined = json(&["--omega=-35,60,0", "--cut=30"]);
    assert_eq!(apart, joined);
    // the mirror image in the vertical plane of the line of centres
    let mirrored = json(&["--cut", "-30", "--omega", "35,60,-0"]);
    assert_eq!(mirrored["impulse"], apart["impulse"]);
    for (what, signs) in [("velocity", [1.0, -1.0, 1.0]), ("spin", [-1.0, 1.0, -1.0])] {
        for ball in ["cue", "object"] {
            let (here, there) = (numbers(&apart[ball][what]), numbers(&mirrored[ball][what]));
            let image: Vec<_> = signs.iter().zip(&there).map(|(sign, x)| sign * x).collect();
            assert_eq!(here, image, "{ball} {what}");
        }
    }
}

#[test]
fn a_collision_that_is_none() {
    for (option, value, fragments) in [
        ("--speed", "0", &["speed", "0"][..]),
        ("--speed", "-2", &["speed", "-2"]),
        ("--speed", "fast", &["--speed", "fast"]),
        ("--speed", "nan", &["speed", "NaN"]),
        ("--cut", "90", &["cut", "90"]),
        ("--cut", "-95", &["cut", "-95"]),
        ("--omega", "1,2", &["--omega", "1,2", "three"]),
        ("--omega", "1,x,2", &["--omega", "\"x\""]),
        ("--omega", "1,inf,2", &["omega_y", "inf"]),
        ("--mu", "-0.1", &["mu", "-0.1"]),
        ("--mu-s", "-0.1", &["mu_s", "-0.1"]),
        ("--e", "1.1", &["e", "1.1"]),
        ("--e", "-0.1", &["e", "-0.1"]),
    ] {
        let output = caromfit(roll_with(option, value).into_iter().chain(["--json".to_string()]));
        let said = refused(&output, 2);
        assert!(said.starts_with("error: "), "{said}");
        for fragment in fragments {
            assert!(said.contains(fragment), "{option} {value}: {fragment}: {said}");
        }
    }
    let output = caromfit(ROLL.iter().chain(&["--radius", "0"]));
    assert!(refused(&output, 2).contains("radius"));
}

/// The reference's cases as CASES.csv, every number to all its digits.
fn reference(as_printed: bool) -> (String, Vec<Value>) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reference/collisions.json");
    let cases: Vec<Value> = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    let cases: Vec<Value> = cases.into_iter().filter(|case| case["as_printed"] == as_printed).collect();
    let row = |case: &Value| {
        let omega = numbers(&case["omega"]);
        let values = ["speed", "cut_deg"].map(|key| case[key].as_f64().unwrap()).into_iter().chain(omega);
        let values = values.chain(["mu", "mu_s", "e", "radius"].map(|key| case[key].as_f64().unwrap()));
        let cells: Vec<_> = values.map(|x| format!("{x:?}")).collect();
        format!("{},{}\n", case["name"].as_str().unwrap(), cells.join(","))
    };
    let rows: Vec<_> = cases.iter().map(row).collect();
    (format!("{CASES_HEADER}{}", rows.concat()), cases)
}

const CASES_HEADER: &str = "name,speed_m_s,cut_deg,omega_x,omega_y,omega_z,mu,mu_s,e,radius_m\n";

/// A reference number is written as a string, to keep its 25 digits.
fn digits(value: &Value) -> f64 {
    value.as_str().unwrap().parse().unwrap()
}

#[test]
fn cases_agree_with_the_25_digit_reference() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cases.csv");
    let mut compared = 0;
    for as_printed in [false, true] {
        let (csv, cases) = reference(as_printed);
        fs::write(&path, csv).unwrap();
        let mut args = vec!["collide", "--cases", path.to_str().unwrap(), "--fidelity", "full", "--json"];
        if as_printed {
            args.push("--as-printed");
        }
        let output = caromfit(args);
        let computed: Vec<Value> = serde_json::from_str(done(&output)).unwrap();
        assert_eq!(computed.len(), cases.len());
        for (computed, case) in computed.iter().zip(&cases) {
            let name = &case["name"];
            assert_eq!((&computed["name"], &computed["regime"]), (name, &case["regime"]));
            let (speed, radius) = (case["speed"].as_f64().unwrap(), case["radius"].as_f64().unwrap());
            let impulse = computed["impulse"].as_f64().unwrap();
            assert!((impulse - digits(&case["impulse"])).abs() <= REFERENCE * speed, "{name}: {impulse}");
            for ball in ["cue", "object"] {
                for (what, scale) in [("velocity", speed), ("spin", speed / radius)] {
                    for (x, expected) in numbers(&computed[ball][what]).iter().zip(0..) {
                        let off = (x - digits(&case[ball][what][expected as usize])).abs();
                        assert!(off <= REFERENCE * scale, "{name}: {ball} {what} is off by {off:e}");
                    }
                }
            }
            compared += 1;
        }
    }
    assert_eq!(compared, 23);
}

#[test]
fn one_case_is_still_an_array() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cases.csv");
    fs::write(&path, format!("{CASES_HEADER}one,2,30,0,0,0,0.05,0.3,0.94,0.028575\n")).unwrap();
    let output = caromfit(["collide", "--json", "--cases", path.to_str().unwrap()]);
    let value: Value = serde_json::from_str(done(&output)).unwrap();
    assert_eq!(value.as_array().unwrap().len(), 1);
    assert_eq!(value[0]["name"], "one");
}

#[test]
fn bad_cases_are_named_all_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cases.csv");
    let rows = [
        "good,2,30,0,0,0,0.05,0.3,0.94,0.028575",
        "still,0,30,0,0,0,0.05,0.3,0.94,0.028575",
        "past,2,90,0,0,0,0.05,0.3,0.94,0.028575",
        "word,2,30,x,0,0,0.05,0.3,0.94,0.028575",
        "slick,2,30,0,0,0,-0.05,0.3,0.94,0.028575",
        "cloth,2,30,0,0,0,0.05,-0.3,0.94,0.028575",
        "bouncy,2,30,0,0,0,0.05,0.3,1.01,0.028575",
        "# none,2",
        "point,2,30,0,0,0,0.05,0.3,0.94,0",
        ",2,30,0,0,0,0.05,0.3,0.94,0.028575",
        "few,2,30",
    ];
    fs::write(&path, format!("{CASES_HEADER}{}\n", rows.join("\n"))).unwrap();
    let output = caromfit(["collide", "--json", "--cases", path.to_str().unwrap()]);
    let said = refused(&output, 2);
    let expected = [
        "3: column speed_m_s: \"still\" is no collision: ",
        "4: column cut_deg: \"past\" is no collision: ",
        "5: column omega_x: \"x\" is not a finite number",
        "6: column mu: \"slick\" is no collision: ",
        "7: column mu_s: \"cloth\" is no collision: ",
        "8: column e: \"bouncy\" is no collision: ",
        "10: column radius_m: \"point\" is no collision: ",
        "11: column name: is empty; expected a value",
        "12: 3 cells; expected 10",
    ];
    for fragment in expected {
        let fragment = format!("{}:{fragment}", path.display());
        assert!(said.contains(&fragment), "{fragment}:\n{said}");
    }
    assert_eq!(said.lines().count(), 1 + expected.len(), "{said}");
    let missing = caromfit(["collide", "--cases", "nowhere.csv"]);
    assert!(refused(&missing, 2).contains("nowhere.csv: cannot be read"));
}

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

const FILES: [&str; 5] = ["fit.json", "report.html", "residuals.csv", "residuals.png", "residuals.svg"];

/// The shape of a fit.json.
fn check_fit(fit: &Value, dataset: &str) {
    let expected = [
        "dataset",
        "version",
        "fidelity",
        "effects",
        "parameters",
        "correlation",
        "chi2",
        "dof",
        "shots_used",
        "shots_rejected",
        "termination",
        "iterations",
        "seconds",
    ];
    assert!(keys(fit).is_superset(&BTreeSet::from(expected)), "{fit}");
    assert_eq!(fit["dataset"], dataset);
    assert_eq!(fit["version"], env!("CARGO_PKG_VERSION"));
    assert!(fit["effects"]["friction"].is_boolean());
    assert_eq!(keys(&fit["parameters"]), BTreeSet::from(["mu", "mu_s", "e"]));
    for (name, parameter) in fit["parameters"].as_object().unwrap() {
        let status = parameter["status"].as_str().unwrap();
        let known = ["free", "fixed", "at-lower-bound", "at-upper-bound", "not-identified"];
        assert!(known.contains(&status), "{name}: {status}");
        assert!(parameter["estimate"].is_f64(), "{name}");
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
    assert_eq!(fit["correlation"]["order"], serde_json::json!(["mu", "mu_s", "e"]));
    let rows = fit["correlation"]["matrix"].as_array().unwrap();
    assert!(rows.len() == 3 && rows.iter().all(|row| row.as_array().unwrap().len() == 3));
    assert!(fit["chi2"].as_f64().unwrap() >= 0.0 && fit["shots_rejected"].is_array());
    for count in ["dof", "shots_used", "iterations"] {
        assert!(fit[count].is_u64(), "{count}");
    }
    assert!(fit["seconds"].is_f64() && fit["termination"].is_string());
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
    let report = lab.fit(&["--bootstrap", "20", "--starts", "3", "--loss", "huber", "--seed", "5", "-v"]);
    let text = done(&report).to_string();
    for part in [
        "Bootstrap: 20 samples of shots drawn anew, seed 5",
        "3 starts, seed 5: all agree",
        "Shots that count less, huber loss",
        "What the data determine",
        "Shots that matter most",
        "Other models on these data",
    ] {
        assert!(text.contains(part), "{part} is missing from\n{text}");
    }
    let fit = lab.fit_json("domenech-2023");
    assert_eq!(fit["bootstrap"]["replicates"], 20);
    assert_eq!((&fit["starts"]["agree"], &fit["starts"]["count"]), (&Value::Bool(true), &Value::from(3)));
    assert_eq!(fit["robust"]["loss"], "huber");
    assert!(fit["identifiability"]["condition_number"].as_f64().unwrap() >= 1.0);
    assert!(fit["goodness"]["trends"].as_array().is_some_and(|trends| !trends.is_empty()));
    assert_eq!(fit["model_comparison"][0]["model"], "as fitted");
    refused(&lab.fit(&["--loss", "hubert"]), 2);
}

#[test]
fn constraints_in_dataset_toml() {
    let lab = Lab::of("domenech-2023");
    let text = fs::read_to_string(lab.data.join("dataset.toml")).unwrap();
    let constrained = |list: &str| {
        fs::write(
            lab.data.join("dataset.toml"),
            swap(&text, "[fit]", &format!("[fit]\nconstraints = {list}")),
        )
        .unwrap();
        lab.fit(&["-v"])
    };
    let report = constrained("[\"e <= 8*mu\"]");
    assert!(done(&report).contains("e <= 8*mu: holds with equality"));
    let fit = lab.fit_json("domenech-2023");
    let value = |name: &str| fit["parameters"][name]["estimate"].as_f64().unwrap();
    assert!((value("e") - 8.0 * value("mu")).abs() < 1e-9);
    let line = 1 + text.lines().position(|line| line == "[fit]").unwrap() + 1;
    let said = constrained("[\"e <= 8*mu*mu_s\"]");
    let place =
        format!("dataset.toml:{line}: column 16: the constraint \"e <= 8*mu*mu_s\": a product of parameters");
    assert!(refused(&said, 2).contains(&place), "{}", stderr(&said));
    let said = constrained("[\"mu >= 2\"]");
    assert!(refused(&said, 2).contains("no values within the bounds satisfy"), "{}", stderr(&said));
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
    assert!(said.contains("cannot be written"), "{said}");
    assert_eq!(lab.written(), ["fits"]);
}

/// The table, the CSV and the pictures, for seeded shots and for those of a data set.
#[test]
fn accuracy_against_time() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("accuracy");
    let output = caromfit(["accuracy", "--shots", "8", "--out", out.to_str().unwrap()]);
    assert!(done(&output).contains("Model error"), "{}", stdout(&output));
    assert!(stdout(&output).contains("Bias of a fit to 8 shots"), "{}", stdout(&output));
    let biases = fs::read_to_string(out.join("bias.csv")).unwrap();
    assert_eq!(biases.lines().count(), 1 + 6 * 3, "{biases}");
    assert!(biases.contains("\nauto,mu,0.05,") && biases.contains("\ninelastic,mu,0.05,,,,\n"), "{biases}");
    let csv = fs::read_to_string(out.join("accuracy.csv")).unwrap();
    // every fidelity; against the exact solution but for ode and contact with all effects
    for name in ["elastic", "inelastic", "linear", "full", "ode", "contact"] {
        assert!(csv.lines().any(|line| line.starts_with(&format!("{name},as-full,"))), "{name}");
    }
    assert!(!csv.contains("all,1e-6,exact") && csv.contains("contact,throw_deg"));
    let svg = fs::read_to_string(out.join("accuracy.svg")).unwrap();
    assert!(svg.contains("contact, all effects"));
    assert!(fs::read(out.join("accuracy.png")).unwrap().starts_with(b"\x89PNG"));

    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/data/mathavan-2014");
    let output = caromfit(["accuracy", "--dataset", data, "--out", out.to_str().unwrap()]);
    assert!(done(&output).starts_with("5 shots"), "{}", stdout(&output));
    refused(&caromfit(["accuracy", "--shots", "0"]), 2);
}

#[test]
fn effects_are_chosen_and_explained() {
    let shot = ["collide", "--speed", "2", "--cut", "30", "--mu", "0.05", "--mu-s", "0.3", "--e", "0.94"];
    let auto = |more: &[&str]| {
        let output = caromfit(shot.iter().chain(&["--fidelity", "auto", "--json"]).chain(more));
        serde_json::from_str::<Value>(done(&output)).unwrap()
    };
    assert_eq!(auto(&["--tolerance", "1e-2"])["fidelity"], "linear");
    let explained = auto(&["--tolerance", "1e-5", "--explain"]);
    assert_eq!(explained["fidelity"], "contact");
    let effects = explained["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 9);
    let expected = BTreeSet::from(["name", "size", "on", "why"]);
    assert!(effects.iter().all(|effect| keys(effect) == expected));
    // a stun ball is not lifted, slides, and rolls on
    let motion: Vec<_> = explained["motion"].as_array().unwrap().iter().map(|one| &one["on"]).collect();
    assert_eq!(motion, [false, true, true]);
    assert_eq!(auto(&["--effects", "inelasticity"])["fidelity"], "inelastic");
    let wrong = caromfit(shot.iter().chain(&["--effects", "frictoin"]));
    assert!(refused(&wrong, 2).contains("\"frictoin\" is no effect"));
    let slower = caromfit(shot.iter().chain(&["--fidelity", "ode", "--tolerance", "1e-20"]));
    assert!(refused(&slower, 2).contains("1e-12 to 1e-2"));
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
