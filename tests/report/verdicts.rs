//! The verdict on a fit, of every kind of doubt, and the table that it stands in.

use caromfit::report::document;
use caromfit::report::terminal::overview;

use super::{exact, fitted, is_stored, lab, normal, restricted};

use crate::prelude::*;

fn roll() -> Dataset {
    lab("natural-roll", 0.05, 1)
}

/// Shots with other stated noise.
fn noise(times: f64) -> Dataset {
    let mut dataset = roll();
    for after in dataset.shots.iter_mut().flat_map(|shot| &mut shot.after) {
        after.measured.sd = after.measured.sd.map(|sd| times * sd);
    }
    dataset
}

/// Stun shots with the friction and the restitution held, which leaves the cloth.
fn of_cloth_alone() -> Dataset {
    let mut dataset = lab("stun", 0.05, 2);
    for (parameter, value) in [(Parameter::Mu, 0.05), (Parameter::E, 0.94)] {
        dataset.settings[parameter] = Setting::held(value);
    }
    dataset
}

fn without_most() -> Dataset {
    let mut dataset = roll();
    dataset.left_out = (20..31).map(|i| (i.to_string(), "no impact found".to_owned())).collect();
    dataset
}

/// Shots, some of which are slower than any that the model is made for.
fn slow(count: usize) -> Dataset {
    let mut dataset = roll();
    let crawl = with(&spec("angles", &["natural-roll"], count, 8), "shots.speed_m_s = [0.1, 0.25]");
    for (shot, other) in dataset.shots.iter_mut().zip(made(&crawl).shots) {
        *shot = Shot { name: shot.name.clone(), ..other };
    }
    dataset
}

fn sticking() -> Dataset {
    let keys = "truth.mu = 0.3\nshots.cut_deg = [-8, 8]";
    made(&with(&spec("impacts", &["stun"], 20, 7), keys))
}

/// Friction that decreases with the slip, and noise that is not stated.
fn falling() -> Dataset {
    let model =
        Model { law: Law::Exponential { b: 0.1, c: 1.088 }, ..Model::new(Fidelity::Full, Ball::POOL) };
    let mut dataset = made_with(&with(&spec("angles", &["natural-roll"], 60, 9), "truth.mu = 0.02"), &model);
    for after in dataset.shots.iter_mut().flat_map(|shot| &mut shot.after) {
        after.measured.sd = None;
    }
    dataset
}

fn few() -> Dataset {
    let mut dataset = roll();
    dataset.shots.truncate(4);
    dataset
}

/// Every kind of doubt of a table.
#[test]
fn every_doubt_is_said() {
    for (dataset, grade, said) in [
        (noise(0.2), Grade::Unusable, "where 1 is expected"),
        (of_cloth_alone(), Grade::Unusable, "These shots determine none of μ_s."),
        (
            without_most(),
            Grade::Doubtful,
            "Only 10 of 21 shots could be used; the first that was left out is shot 20",
        ),
        (slow(6), Grade::Doubtful, "In most shots, as in 1, "),
        (noise(0.6), Grade::Doubtful, " times as large as the stated noise"),
        (sticking(), Grade::Doubtful, "only: the balls stick together where they touch"),
        (shipped("mathavan-2014"), Grade::Doubtful, "μ_s ends on its lower bound 0 (at most 1 at 95 %)."),
        (few(), Grade::Doubtful, "4 shots are not enough"),
        (falling(), Grade::Doubtful, " change with speed ("),
    ] {
        let verdict = fitted(&dataset).verdict();
        assert_eq!(verdict.grade, grade, "{said}: {verdict:?}");
        assert!(verdict.sentence.contains(said) && verdict.sentence.ends_with('.'), "{said}: {verdict:?}");
    }
    let verdict = exact().verdict();
    assert!(
        verdict.grade == Grade::Doubtful
            && verdict.sentence.contains("as many unknown values as measured ones (1 shot)"),
        "{verdict:?}"
    );
}

/// What is rare or does no harm lets the numbers stand.
#[test]
fn a_single_odd_shot_is_no_doubt_about_all() {
    let verdict = normal().verdict();
    let determined =
        "10 shots determine μ, μ_s and e; the noise explains the residuals of the angles and speeds (χ²/dof";
    assert!(verdict.grade == Grade::Good && verdict.sentence.starts_with(determined), "{verdict:?}");
    let mut dataset = slow(5);
    dataset.left_out = vec![("11".to_owned(), "no impact found".to_owned())];
    let verdict = fitted(&dataset).verdict();
    // of a table it is named
    assert_eq!(verdict.grade, Grade::Good, "{verdict:?}");
    assert!(verdict.sentence.ends_with("Shot 11 was left out: no impact found."), "{verdict:?}");
    // what stun shots cannot tell is no fault of theirs
    let verdict = fitted(&lab("stun", 0.05, 5)).verdict();
    assert_eq!(verdict.grade, Grade::Good);
    assert!(verdict.sentence.ends_with("They do not determine μ_s."), "{verdict:?}");
}

#[test]
fn it_stands_first_in_every_output() {
    let fit = restricted();
    let sentence = fit.verdict().sentence;
    assert!(sentence.starts_with("μ ends on its lower bound 0 (at most 0.0"), "{sentence}");
    assert_eq!(super::as_text(&fit).lines().nth(1), Some(format!("Verdict: doubtful. {sentence}").as_str()));
    let value: Value = serde_json::from_str(&document::text(&fit).unwrap()).unwrap();
    assert_eq!(value["verdict"], json!({"grade": "doubtful", "sentence": sentence}));
    let page = super::page(&fit);
    let (verdict, table) = (page.find("class=\"verdict doubtful\"").unwrap(), page.find("<table").unwrap());
    let wrong = page.find("What could be wrong").unwrap();
    assert!(verdict < table && table < wrong);
}

/// One line a data set, the best first; a label does not hide another.
#[test]
fn the_table_is_short_and_shows_what_is_good_first() {
    let label = |label: &str, mu: f64| {
        let mut dataset = lab("natural-roll", mu, 1);
        dataset.by = Some("chalk".to_owned());
        for shot in &mut dataset.shots {
            shot.labels.insert("chalk".to_owned(), label.to_owned());
        }
        fitted(&dataset)
    };
    let other = fitted(&Dataset { name: "lab-b".to_owned(), ..roll() });
    let fits = [exact(), restricted(), label("old", 0.05), label("none", 0.08), other];
    is_stored("overview.txt", &overview(&fits));
    // alone, a good one says why
    let alone = overview(&[normal()]);
    assert!(alone.contains("\n    10 shots determine μ, μ_s and e;"), "{alone}");
    assert_eq!(overview(&[]), "");
}
