//! What a report says of hand-built fits.

use std::fs;
use std::path::PathBuf;

use caromfit::fit::{Estimate, Fit, Noise, Rejected, Residual, Status};
use caromfit::observable::Observable;
use caromfit::parameters::Parameter;
use caromfit::report::{csv, folder_name, group_folders, json, table, text, write};
use nalgebra::DMatrix;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

const NAN: f64 = f64::NAN;

fn estimate(parameter: Parameter, value: f64, std_error: f64) -> Estimate {
    Estimate {
        parameter,
        value,
        std_error: Some(std_error),
        interval_95: Some([value - 1.96 * std_error, value + 1.96 * std_error]),
        std_error_at_bound: None,
        status: Status::Free,
    }
}

fn without_error(parameter: Parameter, value: f64, status: Status) -> Estimate {
    Estimate { parameter, value, std_error: None, interval_95: None, std_error_at_bound: None, status }
}

/// Ten throws, and nothing to complain about.
fn normal() -> Fit {
    let throw = |i: i32| {
        let cut = f64::from(8 * i).to_radians();
        let predicted = (0.5 * f64::from(i)).to_radians();
        let sd = 0.1_f64.to_radians();
        let standardized = [0.3, -1.2, 0.7, 1.9, -0.4, 0.1, -0.8, 1.1, -2.1, 0.5][(i - 1) as usize];
        Residual {
            shot: i.to_string(),
            observable: Observable::Throw,
            measured: predicted + standardized * sd,
            predicted,
            sd,
            standardized,
            cut,
            speed: Some(0.5 * f64::from(i)),
        }
    };
    Fit {
        dataset: "lab-a".to_owned(),
        group: None,
        path: PathBuf::from("data/lab-a/dataset.toml"),
        cloth: Some("Simonis 860".to_owned()),
        source: Some("measured by \"A\", 2026".to_owned()),
        fidelity: "full",
        effects: vec![("friction", true), ("cloth", true), ("spin_loss", false)],
        estimates: [
            estimate(Parameter::Mu, 0.101_37, 0.002_71),
            estimate(Parameter::MuS, 0.31, 0.046),
            estimate(Parameter::E, 0.941_2, 0.003_9),
        ],
        correlation: DMatrix::from_row_slice(3, 3, &[1.0, -0.5, 0.25, -0.5, 1.0, 0.125, 0.25, 0.125, 1.0]),
        chi2: 7.0,
        dof: 7,
        noise: vec![Noise {
            observable: Observable::Throw,
            count: 10,
            rms: 0.11_f64.to_radians(),
            estimated_sd: None,
        }],
        shots_used: 10,
        shots_rejected: Vec::new(),
        residuals: (1..=10).map(throw).collect(),
        termination: "the cost no longer falls".to_owned(),
        converged: true,
        iterations: 9,
        seconds: 0.0123,
        warnings: Vec::new(),
        notes: Vec::new(),
    }
}

/// A label of a group where one parameter is fixed, one left alone, one at its bound.
fn restricted() -> Fit {
    let mut fit = normal();
    fit.group = Some(("chalk".to_owned(), "fresh, blue".to_owned()));
    fit.estimates = [
        Estimate {
            interval_95: Some([0.0, 0.012_87]),
            std_error_at_bound: None,
            ..without_error(Parameter::Mu, 0.0, Status::AtLowerBound)
        },
        without_error(Parameter::MuS, 0.3, Status::NotIdentified),
        without_error(Parameter::E, 0.94, Status::Fixed),
    ];
    fit.correlation = DMatrix::from_element(3, 3, NAN);
    fit.noise[0].estimated_sd = Some(0.1_f64.to_radians());
    fit.shots_rejected = vec![Rejected { shot: "7".to_owned(), reason: "no impact found".to_owned() }];
    fit.warnings = vec!["μ_s is not identified: no shot has follow or draw.".to_owned()];
    fit
}

/// As many parameters as observations: no standard deviations.
fn exact() -> Fit {
    let mut fit = normal();
    fit.dataset = "one-shot".to_owned();
    fit.residuals.truncate(1);
    fit.residuals[0].sd = NAN;
    fit.residuals[0].standardized = NAN;
    fit.residuals[0].speed = None;
    fit.residuals[0].shot = "a \"quoted\", shot".to_owned();
    fit.estimates = [
        without_error(Parameter::Mu, 0.095_1, Status::Free),
        without_error(Parameter::MuS, 0.3, Status::Fixed),
        without_error(Parameter::E, 0.94, Status::Fixed),
    ];
    fit.correlation = DMatrix::from_element(3, 3, NAN);
    fit.chi2 = NAN;
    fit.dof = 0;
    fit.noise[0].count = 1;
    fit.noise[0].estimated_sd = Some(NAN);
    fit.shots_used = 1;
    fit.converged = false;
    fit
}

/// Nothing was measured.
fn empty() -> Fit {
    Fit { residuals: Vec::new(), noise: Vec::new(), shots_used: 0, dof: 0, chi2: 0.0, ..normal() }
}

/// Synthetic shots of which several quantities were measured, with normal errors.
#[allow(dead_code)]
fn synthetic(name: &str, observables: &[Observable], shots: usize, seed: u64) -> Fit {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal_deviate = move || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    let mut rng = ChaCha8Rng::seed_from_u64(seed + 1);
    let mut fit = normal();
    fit.dataset = name.to_owned();
    fit.residuals.clear();
    for shot in 0..shots {
        let cut = rng.random_range(0.0..75.0_f64).to_radians();
        let speed = rng.random_range(0.5..4.0_f64);
        for &observable in observables {
            let (predicted, sd) = match observable {
                Observable::Throw => (4.5_f64.to_radians() * (2.0 * cut).sin(), 0.25_f64.to_radians()),
                Observable::Separation => (90.0_f64.to_radians() - 0.3 * cut, 0.5_f64.to_radians()),
                Observable::ObjectSpeedRatio => (0.97 * cut.cos(), 0.01),
                Observable::CueSpin(_) | Observable::ObjectSpin(_) => (30.0 * speed * cut.cos() - 10.0, 4.0),
                _ => (speed * cut.cos(), 0.02 * speed),
            };
            let standardized: f64 = normal_deviate();
            fit.residuals.push(Residual {
                shot: (shot + 1).to_string(),
                observable,
                measured: predicted + standardized * sd,
                predicted,
                sd,
                standardized,
                cut,
                speed: Some(speed),
            });
        }
    }
    fit.shots_used = shots;
    fit.dof = fit.residuals.len().saturating_sub(3);
    fit.chi2 = fit.residuals.iter().map(|residual| residual.standardized.powi(2)).sum();
    fit
}

fn parsed(fit: &Fit) -> Value {
    serde_json::from_str(&json::render(fit).unwrap()).unwrap()
}

#[test]
fn json_has_the_contract_s_names_and_shapes() {
    let fit = parsed(&normal());
    for (key, right) in [
        ("dataset", Value::is_string as fn(&Value) -> bool),
        ("version", Value::is_string),
        ("fidelity", Value::is_string),
        ("effects", Value::is_object),
        ("parameters", Value::is_object),
        ("correlation", Value::is_object),
        ("chi2", Value::is_f64),
        ("dof", Value::is_u64),
        ("shots_used", Value::is_u64),
        ("shots_rejected", Value::is_array),
        ("termination", Value::is_string),
        ("iterations", Value::is_u64),
        ("seconds", Value::is_f64),
    ] {
        assert!(right(&fit[key]), "{key}: {}", fit[key]);
    }
    assert_eq!(fit["effects"]["friction"], true);
    assert_eq!(fit["parameters"]["mu"]["estimate"], 0.101_37);
    assert_eq!(fit["parameters"]["mu"]["std_error"], 0.002_71);
    assert_eq!(fit["parameters"]["mu"]["interval_95"].as_array().unwrap().len(), 2);
    assert_eq!(fit["parameters"]["e"]["status"], "free");
    assert_eq!(fit["correlation"]["order"], serde_json::json!(["mu", "mu_s", "e"]));
    assert_eq!(fit["correlation"]["matrix"][0][1], -0.5);
    assert_eq!(fit["group"], Value::Null);
    assert_eq!(fit["noise"][0]["observable"], "throw_deg");
    assert_eq!(fit["noise"][0]["unit"], "deg");
}

#[test]
fn json_keeps_the_order_of_its_keys() {
    let text = json::render(&normal()).unwrap();
    let position = |key: &str| text.find(key).unwrap_or_else(|| panic!("{key} is missing"));
    assert!(
        position("\"mu\": {") < position("\"mu_s\": {") && position("\"mu_s\": {") < position("\"e\": {")
    );
    assert!(position("\"friction\"") < position("\"cloth\": true"));
    assert!(text.starts_with("{\n  \"dataset\": \"lab-a\",\n") && text.ends_with("\n}\n"));
}

#[test]
fn json_says_null_for_what_is_not_known() {
    let fit = parsed(&restricted());
    assert_eq!(fit["group"], serde_json::json!({"column": "chalk", "label": "fresh, blue"}));
    assert_eq!(fit["parameters"]["mu_s"]["estimate"], 0.3);
    assert_eq!(fit["parameters"]["mu_s"]["std_error"], Value::Null);
    assert_eq!(fit["parameters"]["mu_s"]["interval_95"], Value::Null);
    assert_eq!(fit["parameters"]["mu_s"]["status"], "not-identified");
    assert_eq!(fit["parameters"]["mu"]["status"], "at-lower-bound");
    assert_eq!(fit["parameters"]["e"]["status"], "fixed");
    assert_eq!(
        fit["correlation"]["matrix"],
        serde_json::json!([[null, null, null], [null, null, null], [null, null, null]])
    );
    assert_eq!(fit["shots_rejected"], serde_json::json!([{"shot": "7", "reason": "no impact found"}]));
    let exact = exact();
    assert_eq!(parsed(&exact)["chi2"], Value::Null);
    assert!(!json::render(&exact).unwrap().contains("NaN"));
}

#[test]
fn csv_is_exact() {
    let mut fit = normal();
    fit.residuals.truncate(1);
    fit.residuals.extend(exact().residuals);
    fit.residuals.push(Residual {
        shot: "3".to_owned(),
        observable: Observable::ObjectSpeedRatio,
        measured: 1.0 / 3.0,
        predicted: 0.5,
        sd: 1e-7,
        standardized: -1.0,
        cut: 30.0_f64.to_radians(),
        speed: Some(2.0),
    });
    let expected = "\
shot,observable,unit,measured,predicted,sd,standardized,cut_deg,speed_m_s
1,throw_deg,deg,0.53,0.5,0.1,0.3,8,0.5
\"a \"\"quoted\"\", shot\",throw_deg,deg,0.53,0.5,,,8,
3,object_speed_ratio,1,0.333333333333333,0.5,1e-7,-1,30,2
";
    assert_eq!(csv::render(&fit), expected);
    assert_eq!(csv::render(&empty()).lines().count(), 1);
}

#[test]
fn table_is_exact() {
    let fits = [normal(), restricted(), exact()];
    let expected = "\
data set             shots     μ                   μ_s                 e                χ²/dof  status
lab-a                10        0.1014 ± 0.0027     0.310 ± 0.046       0.9412 ± 0.0039  1.00    ok
lab-a / fresh, blue  10 of 11  0 (at lower bound)  – (not identified)  0.94 (fixed)     1.00 *  1 warning
one-shot             1         0.0951 (no error)   0.3 (fixed)         0.94 (fixed)     –       not converged

±: one standard error
fixed: held at this value, not fitted
at … bound: the best value within the allowed range is at its end; the data pull beyond it or leave it open
not identified: these data say nothing about it; it stayed at its initial value
no error: no degrees of freedom are left to tell one from
*: noise estimated from the residuals of this fit, so that χ²/dof is near 1 whatever the model
";
    assert_eq!(table::render(&fits), expected);
    assert_eq!(table::render(&[]).lines().count(), 1);
}

#[test]
fn text_puts_warnings_first_and_units_beside_numbers() {
    let expected = "\
lab-a, chalk = fresh, blue
  cloth: Simonis 860
  source: measured by \"A\", 2026
  model: full (friction, cloth, not spin_loss)

Warning: μ_s is not identified: no shot has follow or draw.

Parameters (no unit), ± one standard error, 95 % interval
  μ    0 (at lower bound)               [0, 0.0129]  sliding friction between the balls
  μ_s  – (not identified), left at 0.3               friction of the cloth on the object ball during the impact
  e    0.94 (fixed)                                  coefficient of restitution between the balls

χ² = 7 for 7 degrees of freedom, χ²/dof = 1.00: near 1 whatever the model, as noise was estimated from these residuals

Noise of one observation, and root mean square (rms) of the residuals
  throw  10 values  sd 0.1° estimated from the residuals  rms 0.11°

Shots: 10 used, 1 rejected
  shot 7: no impact found

Stopped after 9 iterations, 0.012 s: the cost no longer falls
";
    assert_eq!(text::render(&restricted()), expected);
    let normal = text::render(&normal());
    assert!(normal.contains("  μ    0.1014 ± 0.0027  [0.0961, 0.1067]  sliding friction"), "{normal}");
    assert!(normal.contains("μ and μ_s -0.500, μ and e +0.250, μ_s and e +0.125"), "{normal}");
    assert!(normal.contains("would give a larger χ² with probability 0.43"), "{normal}");
    assert!(text::render(&exact()).contains("NOT CONVERGED: the cost no longer falls"));
    assert!(text::render(&empty()).contains("Shots: 0 used, 0 rejected"));
}

#[test]
fn report_is_written_whole_and_in_place() {
    let out = tempfile::tempdir().unwrap();
    let folder = write(&normal(), out.path()).unwrap();
    assert_eq!(folder, out.path().join("lab-a"));
    let mut names: Vec<_> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["fit.json", "residuals.csv", "residuals.png", "residuals.svg"]);
    assert_eq!(fs::read_dir(out.path()).unwrap().count(), 1, "no temporary files stay");

    fs::write(folder.join("mine.txt"), "kept").unwrap();
    fs::write(folder.join("fit.json"), "old").unwrap();
    write(&normal(), out.path()).unwrap();
    assert!(folder.join("mine.txt").exists());
    assert_eq!(fs::read_to_string(folder.join("fit.json")).unwrap(), json::render(&normal()).unwrap());

    let group = write(&restricted(), out.path()).unwrap();
    assert_eq!(group, out.path().join("lab-a").join("fresh--blue"));
}

#[test]
fn a_report_that_cannot_be_written_names_the_file() {
    let out = tempfile::tempdir().unwrap();
    fs::write(out.path().join("lab-a"), "a file where the folder should be").unwrap();
    let error = write(&normal(), out.path()).unwrap_err().to_string();
    assert!(error.contains("lab-a: cannot be written"), "{error}");
}

#[test]
fn folders_of_labels_are_safe_and_differ() {
    assert_eq!(folder_name("15 °/s"), "15---s");
    assert_eq!(folder_name("plain_A-1.5"), "plain_A-1.5");
    for (label, folder) in [("", "-"), (".", "-."), ("..", "-..")] {
        assert_eq!(folder_name(label), folder);
    }
    let labels = ["a b", "a/b", "a-b-2", "A b", "c"].map(str::to_owned);
    assert_eq!(group_folders(&labels), ["a-b", "a-b-3", "a-b-2", "A-b-4", "c"]);
    let mut odd = normal();
    odd.dataset = "../up".to_owned();
    let out = tempfile::tempdir().unwrap();
    assert_eq!(write(&odd, out.path()).unwrap(), out.path().join("..-up"));
}
