//! What a report says of hand-built fits.

mod fits;
mod plots;
mod verdicts;

use caromfit::fit::{Robust, Weight};
use caromfit::report;
use caromfit::report::{csv, document, folder_name, group_folders, write};

use fits::{empty, exact, normal, restricted};

use crate::prelude::*;

/// The report as text.
fn as_text(fit: &Fit) -> String {
    report::fit::as_text(std::slice::from_ref(fit))
}

fn parsed(fit: &Fit) -> Value {
    serde_json::from_str(&document::text(fit).unwrap()).unwrap()
}

/// What stands in a file of tests/report.
fn stored(name: &str) -> String {
    fs::read_to_string(root().join("tests/report").join(name)).unwrap()
}

/// Names, shapes and units are those of the contract, and what is not known is null.
#[test]
fn json_states_values_and_null_for_what_is_not_known() {
    let free = |fit: Fit| {
        let text = document::text(&fit).unwrap();
        assert!(text.starts_with("{\n  \"dataset\": \"") && text.ends_with("\n}\n") && !text.contains("NaN"));
        let places = ["\"mu\": {", "\"mu_s\": {", "\"e\": {"].map(|key| text.find(key).unwrap());
        assert!(places.is_sorted(), "{text}");
        serde_json::from_str::<Value>(&text).unwrap()
    };
    let none = json!([null, null, null]);
    for (fit, values) in [
        (
            free(normal()),
            &[
                ("/effects/friction", json!(true)),
                ("/parameters/mu/estimate", json!(0.101_37)),
                ("/parameters/mu/std_error", json!(0.002_71)),
                ("/parameters/e/status", json!("free")),
                ("/correlation/order", json!(["mu", "mu_s", "e"])),
                ("/correlation/matrix/0/1", json!(-0.5)),
                ("/group", Value::Null),
                ("/noise/0/observable", json!("throw_deg")),
                ("/noise/0/unit", json!("deg")),
            ][..],
        ),
        (
            free(restricted()),
            &[
                ("/group", json!({"column": "chalk", "label": "fresh, blue"})),
                ("/parameters/mu_s/estimate", json!(0.3)),
                ("/parameters/mu_s/std_error", Value::Null),
                ("/parameters/mu_s/interval_95", Value::Null),
                ("/parameters/mu_s/status", json!("not-identified")),
                ("/parameters/mu/status", json!("at-lower-bound")),
                ("/parameters/e/status", json!("fixed")),
                ("/correlation/matrix/0", none.clone()),
                ("/correlation/matrix/2", none.clone()),
                ("/shots_rejected", json!([{"shot": "7", "reason": "no impact found"}])),
            ],
        ),
        (free(exact()), &[("/chi2", Value::Null)]),
    ] {
        for (at, expected) in values {
            assert_eq!(fit.pointer(at), Some(expected), "{at}");
        }
    }
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
    assert_eq!(csv::residuals(&fit), stored("residuals.csv"));
    assert_eq!(csv::residuals(&empty()).lines().count(), 1);
}

#[test]
fn a_row_for_each_shot_with_all_that_was_measured_of_it() {
    let mut fit = normal();
    fit.residuals.truncate(2);
    fit.residuals.push(Residual {
        shot: "2".to_owned(),
        observable: Observable::ObjectSpeedRatio,
        measured: 0.75,
        predicted: 0.5,
        sd: 0.125,
        standardized: 2.0,
        cut: fit.residuals[1].cut,
        speed: None,
    });
    fit.shots_rejected = restricted().shots_rejected;
    assert_eq!(csv::shots(&fit), stored("shots.csv"));
}

#[test]
fn table_is_exact() {
    let fits = [normal(), restricted(), exact()];
    assert_eq!(report::fit::as_text(&fits), stored("table.txt"));
}

#[test]
fn text_puts_warnings_first_and_units_beside_numbers() {
    assert_eq!(as_text(&restricted()), stored("restricted.txt"));
    let normal = as_text(&normal());
    assert!(normal.contains("  μ    0.1014 ± 0.0027  [0.0961, 0.1067]  sliding friction"), "{normal}");
    assert!(normal.contains("μ and μ_s -0.500, μ and e +0.250, μ_s and e +0.125"), "{normal}");
    assert!(normal.contains("p = 0.43 of a larger one"), "{normal}");
    assert!(normal.contains("  μ  ± 0.0027  noise 0.0027\n"), "{normal}");
    assert!(as_text(&exact()).contains("came to no end (the cost no longer falls)"));
    assert!(as_text(&empty()).contains("shots: 0 used, 0 not used"));
}

fn page(fit: &Fit) -> String {
    report::fit::page(fit).unwrap()
}

/// Both renderers walk the same value: what one says, the other says.
#[test]
fn text_and_html_say_the_same() {
    for fit in [normal(), restricted(), exact(), robust()] {
        let (text, page) = (as_text(&fit), page(&fit));
        let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
        let escaped =
            |text: &str| escaped(text).replace('"', "&quot;").replace('\'', "&#x27;").replace('/', "&#x2f;");
        // the verdict is one line in a text and two elements of a page; remarks and facts are split off
        let lines = text.lines().skip(2).map(|line| line.trim_start_matches("Warning: "));
        let words = lines.flat_map(|line| line.split("  ")).flat_map(|words| words.split(": "));
        let words = words.flat_map(|words| words.split(" (")).map(|words| words.trim().trim_end_matches(')'));
        let compared: Vec<&str> = words.filter(|words| !words.is_empty()).collect();
        for words in &compared {
            assert!(page.contains(&escaped(words)), "{words}");
        }
        assert!(compared.len() > 20, "{compared:?}");
    }
}

/// Where outlying shots count less, χ² tests nothing, in every file.
#[test]
fn a_robust_fit_states_no_probability_of_its_chi2() {
    let fit = robust();
    assert_eq!(parsed(&fit)["goodness"]["p_value"], Value::Null);
    for said in [as_text(&fit), page(&fit)] {
        assert!(said.contains("not tested, as outlying shots count less"), "{said}");
        assert!(!said.contains("of a larger one"), "{said}");
    }
}

fn robust() -> Fit {
    let mut fit = normal();
    let goodness = fit.diagnostics.goodness.as_mut().unwrap();
    (goodness.p_value, goodness.noise, goodness.noise_factor) = (None, NoiseVerdict::NotTested, None);
    fit.diagnostics.robust =
        Some(Robust::new(Loss::Huber, vec![Weight { shot: "9".to_owned(), weight: 0.4 }]));
    fit
}

#[test]
fn folders_of_labels_are_safe_and_differ() {
    assert_eq!(folder_name("15 °/s"), "15---s");
    assert_eq!(folder_name("plain_A-1.5"), "plain_A-1.5");
    for (label, folder) in [("", "-"), (".", "-."), ("..", "-..")] {
        assert_eq!(folder_name(label), folder);
    }
    let labels = ["a b", "a/b", "a-b-2", "A b", "c"].map(str::to_owned);
    assert_eq!(group_folders(&labels), ["a-b", "a-b-2", "a-b-2-2", "A-b-3", "c"]);
    let mut odd = normal();
    odd.dataset = "../up".to_owned();
    let out = tempfile::tempdir().unwrap();
    write(&[odd], out.path()).unwrap();
    write(&[restricted()], out.path()).unwrap();
    assert!(out.path().join("..-up").exists() && out.path().join("lab-a/fresh--blue/report.html").exists());
}
