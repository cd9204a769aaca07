//! `caromfit collide`.

use std::collections::BTreeSet;
use std::fs;

use serde_json::Value;

use super::{caromfit, done, keys, numbers, refused};

/// The bar that the reference is held to: 1e-12 of the cue ball's speed (spins: over R).
const REFERENCE: f64 = 1e-12;

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
        "3: column speed_m_s: \"still\" is not a collision: ",
        "4: column cut_deg: \"past\" is not a collision: ",
        "5: column omega_x: \"x\" is not a finite number",
        "6: column mu: \"slick\" is not a collision: ",
        "7: column mu_s: \"cloth\" is not a collision: ",
        "8: column e: \"bouncy\" is not a collision: ",
        "10: column radius_m: \"point\" is not a collision: ",
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
    assert_eq!(effects.len(), 10);
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

/// A ball that creeps while it spins, which gravity shakes for as long as the contact lasts.
const FAILS: &str = "odd,1.160e-06,54.0,5.6,14.2,-31.4,0.3,0.1,0.94,0.028575";

/// One row that cannot be integrated so closely leaves the others as they are, and the exit status says it.
#[test]
fn a_case_that_is_not_integrated_leaves_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cases.csv");
    let rows =
        ["good,2,30,0,0,0,0.05,0.3,0.94,0.028575", FAILS, "roll,2,30,0,69.99,0,0.05,0.3,0.94,0.028575"];
    fs::write(&path, format!("{CASES_HEADER}{}\n", rows.join("\n"))).unwrap();
    let args = ["collide", "--fidelity", "contact", "--tolerance", "1e-9", "--cases", path.to_str().unwrap()];
    let output = caromfit(args.iter().chain(&["--json"]));
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    let named = format!("{}:3: \"odd\" was not computed: the integration did not reach", path.display());
    assert!(said.contains(&named) && said.lines().count() == 1, "{said}");
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    let [good, odd, roll] = [0, 1, 2].map(|i| &value[i]);
    assert!(good["impulse"].as_f64().unwrap() > 1.0 && roll["impulse"].as_f64().unwrap() > 1.0);
    assert_eq!(keys(odd), BTreeSet::from(["version", "format_version", "name", "fidelity", "error"]));
    assert!(odd["error"].as_str().unwrap().contains("1e-9"), "{odd}");
    let output = caromfit(args);
    assert_eq!(output.status.code(), Some(1));
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("good (contact)") && table.contains("roll (contact)"), "{table}");
}

#[test]
fn a_contact_that_gives_way_and_balls_of_unequal_mass() {
    // far thicker a hit than a rigid contact can throw: tan θ = 2 tan φ/7(1 + e) = tan 4.86°
    let stun =
        ["collide", "--speed", "2", "--cut", "30", "--mu", "0.2", "--mu-s", "0.3", "--e", "0.94", "--json"];
    let throw = |more: &[&str]| {
        let output = caromfit(stun.iter().chain(more));
        let value: Value = serde_json::from_str(done(&output)).unwrap();
        let v = numbers(&value["object"]["velocity"]);
        v[1].atan2(v[0]).to_degrees()
    };
    let rigid = throw(&[]);
    assert!((rigid - 4.860).abs() < 1e-3, "{rigid}");
    for fidelity in ["ode", "contact", "auto"] {
        let gives_way = throw(&["--fidelity", fidelity, "--kappa", "1.258"]);
        assert!((gives_way - 6.73).abs() < 0.02, "{fidelity} {gives_way}");
    }
    assert!((throw(&["--fidelity", "ode", "--kappa", "0"]) - rigid).abs() < 0.02);
    // `contact` resolves a contact that gives way, as Poisson's ratio says where --kappa does not
    assert!((throw(&["--fidelity", "contact"]) - 6.73).abs() < 0.02);
    let refusal = caromfit(stun.iter().chain(&["--fidelity", "contact", "--kappa", "0"]));
    assert!(
        refused(&refusal, 2)
            .contains("kappa is 0; expected more than 0 with contact; full is rigid along the surface")
    );
    // a contact that sticks throws by the ratio of its levers, whatever the masses
    assert!((throw(&["--mass-ratio", "1.2"]) - rigid).abs() < 1e-9);

    let output = caromfit(stun.iter().chain(&["--kappa", "1"]));
    let message = refused(&output, 2);
    assert!(message.contains("kappa is 1 with full"), "{message}");
    let folder = tempfile::tempdir().unwrap();
    let cases = folder.path().join("cases.csv");
    let text = "name,speed_m_s,cut_deg,omega_x,omega_y,omega_z,mu,mu_s,e,radius_m,kappa,mass_ratio\n\
                a,2,30,0,0,0,0.2,0.3,0.94,0.028575,1.258,1\nb,2,30,0,0,0,0.2,0.3,0.94,0.028575,,\n";
    fs::write(&cases, text).unwrap();
    let path = cases.to_str().unwrap();
    let output = caromfit(["collide", "--cases", path, "--fidelity", "ode", "--json"]);
    let value: Value = serde_json::from_str(done(&output)).unwrap();
    let y = [0, 1].map(|i| numbers(&value[i]["object"]["velocity"])[1]);
    assert!(y[0] > 1.3 * y[1], "{y:?}");
    fs::write(&cases, text.replace(",1.258,1\n", ",1.258,-1\n")).unwrap();
    let output = caromfit(["collide", "--cases", path, "--fidelity", "ode"]);
    let message = refused(&output, 2);
    assert!(message.contains("mass_ratio") && message.contains("cases.csv:2"), "{message}");
}

/// What a stated fidelity does not simulate is not left out in silence.
#[test]
fn effects_that_the_fidelity_has_not_are_refused() {
    let shot = ["collide", "--speed", "2", "--cut", "30", "--mu", "0.05", "--mu-s", "0.3", "--e", "0.94"];
    let with = |more: &[&'static str]| caromfit(shot.iter().chain(more));
    let message = refused(&with(&["--effects", "gravity,friction", "--fidelity", "full"]), 2).to_owned();
    assert!(message.contains("--effects gravity: --fidelity full does not simulate it"), "{message}");
    done(&with(&["--effects", "all", "--fidelity", "full"]));
    done(&with(&["--effects", "gravity,friction", "--fidelity", "auto"]));
}
