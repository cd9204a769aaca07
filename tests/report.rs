//! What a report says of hand-built fits.

mod fits;
mod plots;

use std::fs;

use caromfit::fit::{Fit, Residual};
use caromfit::observable::Observable;
use caromfit::report::{csv, folder_name, group_folders, json, table, text, write};
use serde_json::Value;

use fits::{empty, exact, normal, restricted};

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
shot,observable,unit,measured,predicted,sd,standardized,cut_deg,speed_m_s,model
1,throw_deg,deg,0.53,0.5,0.1,0.3,8,0.5,
\"a \"\"quoted\"\", shot\",throw_deg,deg,0.53,0.5,,,8,,
3,object_speed_ratio,1,0.333333333333333,0.5,1e-7,-1,30,2,
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
    assert_eq!(names, ["fit.json", "report.html", "residuals.csv", "residuals.png", "residuals.svg"]);
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
