//! The verdict on a fit, of every kind of doubt, and the table that it stands in.

use caromfit::fit::check::Finding;
use caromfit::fit::{Combination, Identifiability, Refuted, Trend, Variable};
use caromfit::report::document;
use caromfit::report::terminal::overview;

use super::fits::{exact, normal, restricted};

use crate::prelude::*;

type Change = fn(&mut Fit);

fn rejected(shot: &str) -> Rejected {
    Rejected { shot: shot.to_owned(), reason: "no impact found".to_owned() }
}

fn refute(fit: &mut Fit) {
    fit.refuted =
        Some(Refuted { reduced_chi2: 25.7, p_value: 0.0, if_model_held: Vec::new(), restitution: None });
}

fn not_identified(fit: &mut Fit) {
    fit.estimates.iter_mut().for_each(|e| (e.status, e.std_error) = (Status::NotIdentified, None));
}

fn noise(fit: &mut Fit, verdict: NoiseVerdict, factor: f64) {
    let goodness = fit.diagnostics.goodness.as_mut().unwrap();
    (goodness.noise, goodness.noise_factor) = (verdict, Some(factor));
}

fn trend(fit: &mut Fit) {
    let found = Trend {
        quantity: "throw",
        variable: Variable::Speed,
        slope: -1.0,
        slope_per: "m/s",
        p_value: 1e-5,
        p_corrected: 1e-4,
        significant: true,
        words: "the residuals of throw change with speed: friction is not constant".to_owned(),
    };
    fit.diagnostics.goodness.as_mut().unwrap().trends = vec![found];
}

fn weak(fit: &mut Fit, undetermined: bool) {
    let worst = Combination {
        terms: Vec::new(),
        weak: true,
        undetermined,
        determined: None,
        words: "only the product μ·μ_s is determined".to_owned(),
        singular_values: Vec::new(),
    };
    fit.diagnostics.identifiability = Some(Identifiability {
        parameters: Vec::new(),
        singular_values: Vec::new(),
        condition: 1e3,
        worst: Some(worst),
        silent: Vec::new(),
    });
}

fn suspicious(fit: &mut Fit, shots: usize) {
    let finding = |shot| Finding { shot, text: "the balls may be mixed up".to_owned(), kind: "direction" };
    fit.diagnostics.suspicious = (0..shots).map(|i| finding(Some(i.to_string()))).collect();
}

/// Every kind of doubt, the most harmful first: each is said whatever stands below it.
const KINDS: [(Grade, &str, Change); 14] = [
    (Grade::Unusable, "χ²/dof is 25.7, where 1 is expected", refute),
    (Grade::Unusable, "came to no end (the cost no longer falls)", |fit| fit.converged = false),
    (Grade::Unusable, "determine none of μ, μ_s and e", not_identified),
    (Grade::Doubtful, "Only 10 of 21 shots could be used; the first that was left out is shot 7", |fit| {
        fit.shots_rejected = (7..18).map(|i| rejected(&i.to_string())).collect();
    }),
    (Grade::Doubtful, "In most shots, as in 0, the balls may be mixed up.", |fit| suspicious(fit, 6)),
    (Grade::Doubtful, "The residuals are 1.5 times as large as the stated noise", |fit| {
        noise(fit, NoiseVerdict::TooSmall, 1.5);
    }),
    (
        Grade::Doubtful,
        "μ is known to be at least 0.085 only: the balls stick together where they touch",
        |fit| {
            let own = &mut fit.estimates[0];
            (own.value, own.std_error) = (0.085, None);
        },
    ),
    (Grade::Doubtful, "Only the product μ·μ_s is determined.", |fit| weak(fit, true)),
    (Grade::Doubtful, "μ_s ends on its lower bound 0 (at most 0.03 at 95 %).", |fit| {
        let own = &mut fit.estimates[1];
        (own.value, own.status, own.std_error) = (0.0, Status::AtLowerBound, None);
        own.interval_95 = Some([0.0, 0.03]);
    }),
    (Grade::Doubtful, "Only the product μ·μ_s is determined.", |fit| weak(fit, false)),
    (Grade::Doubtful, "as many unknown values as measured ones (10 shots)", |fit| fit.dof = 0),
    (Grade::Doubtful, "4 shots are not enough", |fit| fit.shots_used = 4),
    (Grade::Doubtful, "Other values fit nearly as well", |fit| fit.diagnostics.has_rival = true),
    (Grade::Doubtful, "residuals of throw change with speed: friction is not constant", trend),
];

#[test]
fn every_doubt_is_said_and_the_most_harmful_first() {
    let good = normal().verdict();
    assert_eq!(good.grade, Grade::Good);
    assert_eq!(
        good.sentence,
        "10 shots determine μ, μ_s and e; the noise explains the residuals of the angles and speeds (χ²/dof = 1.00)."
    );
    let mut all = normal();
    for (grade, fragment, change) in KINDS.into_iter().rev() {
        let mut fit = normal();
        change(&mut fit);
        let alone = fit.verdict();
        assert_eq!(alone.grade, grade, "{fragment}: {alone:?}");
        assert!(alone.sentence.contains(fragment) && alone.sentence.ends_with('.'), "{fragment}: {alone:?}");
        // errors below the bound of two stages, and what is excluded by what was set before, apart
        change(&mut all);
        assert!(all.verdict().grade >= grade);
    }
    assert_eq!(all.verdict().grade, Grade::Unusable);
    assert!(all.verdict().sentence.contains(KINDS[0].1));
}

/// What is rare or does no harm lets the numbers stand.
#[test]
fn a_single_odd_shot_is_no_doubt_about_all() {
    let mut fit = normal();
    suspicious(&mut fit, 5);
    fit.shots_rejected = vec![rejected("11")];
    let verdict = fit.verdict();
    assert_eq!(verdict.grade, Grade::Good);
    // of a table it is named, of a film the report names it
    assert!(verdict.sentence.ends_with("Shot 11 was left out: no impact found."), "{verdict:?}");
    fit.footage = true;
    assert_eq!(fit.verdict(), normal().verdict());
    // what stun shots cannot tell is no fault of theirs
    fit.estimates[1].status = Status::NotIdentified;
    let verdict = fit.verdict();
    assert_eq!(verdict.grade, Grade::Good);
    assert!(verdict.sentence.ends_with("They say nothing about μ_s."), "{verdict:?}");
}

#[test]
fn it_stands_first_in_every_output() {
    let fit = restricted();
    let sentence = "μ ends on its lower bound 0 (at most 0.013 at 95 %).";
    assert_eq!(super::as_text(&fit).lines().nth(1), Some(format!("Verdict: doubtful. {sentence}").as_str()));
    let value: Value = serde_json::from_str(&document::text(&fit).unwrap()).unwrap();
    assert_eq!(value["verdict"], serde_json::json!({"grade": "doubtful", "sentence": sentence}));
    let page = super::page(&fit);
    let (verdict, table) = (page.find("class=\"verdict doubtful\"").unwrap(), page.find("<table").unwrap());
    let wrong = page.find("What could be wrong").unwrap();
    assert!(verdict < table && table < wrong);
}

/// One line a data set, the best first; a label does not hide another.
#[test]
fn the_table_is_short_and_shows_what_is_good_first() {
    let mut labels = [restricted(), normal(), normal()];
    labels[1].group = Some(("chalk".to_owned(), "old".to_owned()));
    labels[2].group = Some(("chalk".to_owned(), "none".to_owned()));
    labels[2].estimates[0].value = 0.2;
    let mut fits = vec![exact()];
    fits.extend(labels);
    fits.push(normal());
    fits[4].dataset = "lab-b".to_owned();
    assert_eq!(overview(&fits), super::stored("overview.txt"));
    // alone, a good one says why
    let alone = overview(&[normal()]);
    assert!(alone.contains("\n    10 shots determine μ, μ_s and e;"), "{alone}");
    assert_eq!(overview(&[]), "");
}
