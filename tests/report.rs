//! What reports say of fits: of one that is good, one that is restricted, one without a degree of freedom, one with a robust loss.

mod plots;
mod verdicts;

use caromfit::report;
use caromfit::report::{csv, document, folder_name, group_folders, write};

use crate::prelude::*;
use crate::synthetic::made_of_weighed_balls;

/// Throws, turns and speeds of ten shots of balls that were weighed.
fn lab(spin: &str, mu: f64, seed: u64) -> Dataset {
    let keys = format!("name = \"lab-a\"\ntruth.mu = {mu}");
    let dataset = made_of_weighed_balls(&with(&spec("angles", &[spin], 10, seed), &keys));
    let text = |text: &str| Some(text.to_owned());
    Dataset { cloth: text("Simonis 860"), source: text("measured by \"A\", 2026"), ..dataset }
}

fn fitted(dataset: &Dataset) -> Fit {
    options::fitted(dataset, Depth::Intervals)
}

/// A fit of which nothing is to be said.
fn normal() -> Fit {
    fitted(&lab("natural-roll", 0.05, 1))
}

/// A label of a group where one parameter is fixed, one not identified, one at its bound, and one shot left out.
fn restricted() -> Fit {
    let mut dataset = lab("stun", 0.0, 2);
    dataset.by = Some("chalk".to_owned());
    for (shot, throw) in dataset.shots.iter_mut().zip([-0.004, 0.002].into_iter().cycle()) {
        shot.labels.insert("chalk".to_owned(), "fresh, blue".to_owned());
        // a little less than there can be
        shot.after.truncate(1);
        shot.after[0].measured.value = throw;
    }
    dataset.settings[Parameter::E] = Setting::held(0.94);
    dataset.left_out.push(("11".to_owned(), "no impact found".to_owned()));
    fitted(&dataset)
}

/// As many parameters as observations: no standard deviations.
fn exact() -> Fit {
    let mut dataset = Dataset { name: "one-shot".to_owned(), ..lab("natural-roll", 0.05, 3) };
    dataset.shots.truncate(1);
    let shot = &mut dataset.shots[0];
    "a \"quoted\", shot".clone_into(&mut shot.name);
    shot.after.truncate(1);
    shot.after[0].measured.sd = None;
    dataset.settings[Parameter::MuS] = Setting::held(0.3);
    dataset.settings[Parameter::E] = Setting::held(0.94);
    fitted(&dataset)
}

/// One shot is wrong, and counts less.
fn robust() -> Fit {
    let mut dataset = lab("natural-roll", 0.05, 4);
    dataset.shots[8].after[0].measured.value += 0.05;
    options::fitted_with(
        &dataset,
        &Options { loss: Some(Loss::Huber), depth: Depth::Estimates, ..options::of_fit() },
    )
}

/// The report as text.
fn as_text(fit: &Fit) -> String {
    report::fit::as_text(std::slice::from_ref(fit))
}

fn page(fit: &Fit) -> String {
    report::fit::page(fit).unwrap()
}

/// Asserts that a text is that of a file of tests/report.
fn is_stored(name: &str, text: &str) {
    assert_eq!(text, fs::read_to_string(root().join("tests/report").join(name)).unwrap());
}

/// Names, shapes and units are those of the contract, and what is not known is null.
#[test]
fn json_states_values_and_null_for_what_is_not_known() {
    let free = |fit: &Fit| {
        let text = document::text(fit).unwrap();
        assert!(text.starts_with("{\n  \"dataset\": \"") && text.ends_with("\n}\n") && !text.contains("NaN"));
        let places = ["\"mu\": {", "\"mu_s\": {", "\"e\": {"].map(|key| text.find(key).unwrap());
        assert!(places.is_sorted(), "{text}");
        serde_json::from_str::<Value>(&text).unwrap()
    };
    let none = json!([null, null, null]);
    let fit = normal();
    let mu = fit.mu().unwrap();
    // with 8 digits
    let rounded = |number: f64| json!(format!("{number:.7e}").parse::<f64>().unwrap());
    for (fit, values) in [
        (
            free(&fit),
            &[
                ("/effects/friction", json!(true)),
                ("/parameters/mu/estimate", rounded(mu.value)),
                ("/parameters/mu/std_error", rounded(mu.std_error.unwrap())),
                ("/parameters/e/status", json!("free")),
                ("/correlation/order", json!(["mu", "mu_s", "e"])),
                ("/correlation/matrix/1/1", json!(1.0)),
                ("/correlation/matrix/0/1", rounded(number(&fit, "/correlation/matrix/1/0"))),
                ("/group", Value::Null),
                ("/noise/0/observable", json!("throw_deg")),
                ("/noise/0/unit", json!("deg")),
            ][..],
        ),
        (
            free(&restricted()),
            &[
                ("/group", json!({"column": "chalk", "label": "fresh, blue"})),
                ("/parameters/mu_s/estimate", json!(0.3)),
                ("/parameters/mu_s/std_error", Value::Null),
                ("/parameters/mu_s/interval_95", Value::Null),
                ("/parameters/mu_s/status", json!("not-identified")),
                ("/parameters/mu/status", json!("at-lower-bound")),
                ("/parameters/e/status", json!("fixed")),
                ("/correlation/matrix/1", none.clone()),
                ("/correlation/matrix/2", none.clone()),
                ("/shots_rejected", json!([{"shot": "11", "reason": "no impact found"}])),
            ],
        ),
        (free(&exact()), &[("/reduced_chi2", Value::Null), ("/parameters/mu/std_error", Value::Null)]),
    ] {
        for (at, expected) in values {
            assert_eq!(fit.pointer(at), Some(expected), "{at}");
        }
    }
}

/// The cells of a table of a fit without commas in them, by the names of its columns.
fn rows(table: &str) -> Vec<BTreeMap<&str, &str>> {
    let mut lines = table.lines().map(|line| line.split(','));
    let names: Vec<&str> = lines.next().unwrap().collect();
    lines.map(|cells| names.iter().copied().zip(cells).collect()).collect()
}

#[test]
fn csv_states_numbers_and_leaves_empty_what_is_not_known() {
    /// Of the eighth digit of a speed over its noise.
    const ROUNDING: f64 = 3e-5;
    let (dataset, table) = (lab("natural-roll", 0.05, 1), csv::residuals(&normal()));
    let rows = rows(&table);
    let measured = dataset.shots.iter().flat_map(|shot| shot.after.iter().map(move |after| (shot, after)));
    assert_eq!(rows.len(), 40);
    for (row, (shot, after)) in rows.iter().zip(measured) {
        let cell = |name: &str| row[name].parse::<f64>().unwrap();
        assert_eq!((row["shot"], row["observable"]), (shot.name.as_str(), after.observable.column()));
        assert_eq!(row["unit"], if after.observable.unit() == "°" { "deg" } else { "m/s" });
        let unit = if after.observable.unit() == "°" { 1_f64.to_radians() } else { 1.0 };
        let Before::Angle { cut, speed } = shot.before else { panic!("{:?}", shot.before) };
        for (name, expected) in [
            ("measured", after.measured.value / unit),
            ("standardized", (cell("measured") - cell("predicted")) / cell("sd")),
            ("cut_deg", cut.value.to_degrees()),
            ("speed_m_s", speed.unwrap().value),
        ] {
            assert!((cell(name) - expected).abs() < ROUNDING * expected.abs().max(1.0), "{name}: {row:?}");
        }
    }
    let table = csv::residuals(&exact());
    let row = table.lines().nth(1).unwrap();
    assert!(row.starts_with("\"a \"\"quoted\"\", shot\",throw_deg,deg,"), "{row}");
    assert!(row.contains(",,,") && row.ends_with(",,,"), "{row}");
}

#[test]
fn a_row_for_each_shot_with_all_that_was_measured_of_it() {
    let (fit, left_out) = (normal(), restricted());
    let (shots, residuals) = (csv::shots(&fit), csv::residuals(&fit));
    assert_eq!(rows(&shots).len(), 10);
    for shot in rows(&shots) {
        let own: Vec<_> = rows(&residuals).into_iter().filter(|row| row["shot"] == shot["shot"]).collect();
        let chi2: f64 = own.iter().map(|row| row["standardized"].parse::<f64>().unwrap().powi(2)).sum();
        assert!((shot["chi2"].parse::<f64>().unwrap() - chi2).abs() < 1e-5 * (1.0 + chi2), "{shot:?}");
        for row in &own {
            let cells =
                ["", "_sd", "_predicted"].map(|end| shot[format!("{}{end}", row["observable"]).as_str()]);
            assert_eq!(cells, ["measured", "sd", "predicted"].map(|name| row[name]));
        }
        assert_eq!((shot["used"], shot["values"]), ("true", "4"));
    }
    let shots = csv::shots(&left_out);
    let last = shots.lines().last().unwrap();
    assert!(last.starts_with("11,false,no impact found,,") && last.ends_with(",,,"), "{last}");
}

#[test]
fn table_is_exact() {
    is_stored("table.txt", &report::fit::as_text(&[normal(), restricted(), exact()]));
}

#[test]
fn text_puts_warnings_first_and_units_beside_numbers() {
    is_stored("restricted.txt", &as_text(&restricted()));
    is_stored("normal.txt", &as_text(&normal()));
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

/// Where outlying shots count less, χ² is not a test, in every file.
#[test]
fn a_robust_fit_states_no_probability_of_its_chi2() {
    let fit = robust();
    assert_eq!(part(&fit, "/goodness/p_value"), Value::Null);
    for said in [as_text(&fit), page(&fit)] {
        assert!(said.contains("not tested, as outlying shots count less"), "{said}");
        assert!(!said.contains("of a larger one"), "{said}");
    }
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
    let odd = fitted(&Dataset { name: "../up".to_owned(), ..lab("natural-roll", 0.05, 1) });
    let out = tempfile::tempdir().unwrap();
    write(&[odd], out.path()).unwrap();
    write(&[restricted()], out.path()).unwrap();
    assert!(out.path().join("..-up").exists() && out.path().join("lab-a/fresh--blue/report.html").exists());
}
