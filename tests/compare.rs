//! Comparisons: differences that are there are found, and others are not.

use caromfit::compare::{Options, compare};
use caromfit::report::compare::table;

use crate::cli::done_in;
use crate::prelude::*;

const MU_S: Quantity = Quantity::Parameter(Parameter::MuS);

/// Impacts on one of two cloths.
fn cloth(name: &str, mu_s: f64, seed: u64, count: usize, played: &str) -> Dataset {
    let spec =
        with(&spec("impacts", &[played], count, seed), &format!("name = {name:?}\ntruth.mu_s = {mu_s}"));
    Dataset { cloth: Some(name.to_string()), ..made(&spec) }
}

/// A quantity in compare.json.
pub fn of(comparison: &Comparison, quantity: Quantity) -> Value {
    let parameters = part(comparison, "/parameters");
    parameters.as_array().unwrap().iter().find(|own| own["parameter"] == quantity.name()).unwrap().clone()
}

/// The only difference of a quantity.
pub fn difference(comparison: &Comparison, quantity: Quantity) -> Value {
    let compared = of(comparison, quantity);
    assert_eq!(compared["differences"].as_array().unwrap().len(), 1, "{compared}");
    compared["differences"][0].clone()
}

#[test]
fn the_two_synthetic_cloths_differ_in_what_they_were_made_to() {
    let both = [shipped("synthetic-cloth-a"), shipped("synthetic-cloth-b")];
    let all = [Quantity::Parameter(Parameter::Mu), Quantity::Parameter(Parameter::E)];
    let options = Options { per_dataset: all.to_vec(), ..options::of_comparison() };
    let comparison = compare(&both, &options).unwrap();
    let json = part(&comparison, "");
    assert!(json["converged"] == true && !comparison.is_refuted());
    assert_eq!((&json["method"], &json["told_by"]), (&"joint".into(), &"cloth".into()));
    assert_eq!([0, 1].map(|i| json["samples"][i]["shots_used"].as_u64().unwrap()), [30, 30]);
    assert!(number(&json, "/dof") > 60.0 * 100.0, "{}", json["dof"]);
    // true differences: μ 0, μ_s 0.15, e 0, μ_k 0.05
    for (quantity, truth, real) in
        [(all[0], 0.0, false), (MU_S, 0.15, true), (all[1], 0.0, false), (Quantity::Sliding, 0.05, true)]
    {
        let difference = difference(&comparison, quantity);
        let [low, high] = ["/interval_95/0", "/interval_95/1"].map(|end| number(&difference, end));
        assert!((low..=high).contains(&truth), "{}: {low}..{high}", quantity.name());
        assert_eq!(difference["real"], real, "{}: {difference}", quantity.name());
        let delta_aic = number(&of(&comparison, quantity), "/same_or_different/delta_aic");
        assert_eq!(delta_aic < 0.0, real, "{}: {delta_aic}", quantity.name());
    }
}

/// Noise stated five times too small is a model that χ²/dof 25 rules out.
#[test]
fn a_refuted_model_has_no_errors_and_no_differences() {
    let good = cloth("good", 0.2, 1, 60, "natural-roll");
    let mut bad = cloth("bad", 0.4, 2, 60, "natural-roll");
    for shot in &mut bad.shots {
        let after = shot.after.iter_mut().map(|m| &mut m.measured);
        let Before::Impact { normal, velocity } = &mut shot.before else { panic!() };
        for measured in after.chain(normal).chain(velocity) {
            measured.sd = measured.sd.map(|sd| 0.2 * sd);
        }
    }
    let comparison = compare(&[good.clone(), bad], &options::of_comparison()).unwrap();
    let first = &comparison.warnings()[0];
    assert!(first.contains("of bad (χ²/dof") && !first.contains("good"), "{first}");
    for compared in part(&comparison, "/parameters").as_array().unwrap() {
        let estimates = compared["estimates"].as_array().unwrap();
        assert!(estimates.iter().all(|value| value["std_error"].is_null()), "{compared}");
        assert!(compared["differences"] == json!([]) && compared["same_or_different"].is_null());
    }
    let table = table(&comparison);
    assert!(table.contains("(refuted)") && !table.contains(" ± 0"), "{table}");
    let other = cloth("other", 0.4, 2, 60, "natural-roll");
    assert!(!compare(&[good, other], &options::of_comparison()).unwrap().is_refuted());
}

/// What a comparison and a single fit are asked for.
#[derive(Clone, Copy, Default)]
pub struct Asked {
    pub auto: bool,
    pub loss: Option<Loss>,
    /// Whether weights rest at 1e-8 and nothing is integrated: both then agree to rounding, not to a hundredth of an error.
    pub exact: bool,
}

/// All that is shared: one cloth twice, with the same balls, is one data set of all its shots.
pub fn is_the_fit_of_all(both: &[Dataset; 2], asked: Asked) -> Comparison {
    let both = both.each_ref().map(|own| Dataset { balls: Some("same".to_owned()), ..own.clone() });
    let Asked { auto, loss, exact } = asked;
    let falling = both[0].settings.falls.then_some(Quantity::Parameter(Parameter::B));
    let share = [Quantity::Parameter(Parameter::Mu), MU_S].into_iter().chain(falling).collect();
    let fidelity = (!auto).then_some(Fidelity::Full);
    let comparison = compare(&both, &Options { share, fidelity, loss, ..Options::default() }).unwrap();
    let mut together = both[0].clone();
    let named = |shot: &Shot| Shot { name: format!("other {}", shot.name), ..shot.clone() };
    together.shots.extend(both[1].shots.iter().map(named));
    let fit = fit::fit(&together, &fit::Options { fidelity, loss, ..options::of_fit() }).unwrap().remove(0);
    // or the tolerance of the integrator, 1e-6, magnified
    let same = if auto { 1e-5 } else { 1e-6 };
    for single in fit.estimates().iter().filter(|single| !single.parameter.is_of_balls()) {
        let compared = of(&comparison, Quantity::Parameter(single.parameter));
        let own = &compared["estimates"][0];
        let error = single.std_error.unwrap_or(1e-9);
        let most = if exact { same * single.value } else { 1e-2 * error };
        let off = number(own, "/estimate") - single.value;
        assert!(compared["shared"] == true && off.abs() <= most, "{own} {single:?}");
        assert_eq!(own["std_error"].is_number(), single.std_error.is_some(), "{own} {single:?}");
        if let Some(own) = own["std_error"].as_f64() {
            assert!((own / error - 1.0).abs() < if exact { 1e-4 } else { 1e-3 }, "{own} {error}");
        }
    }
    let chi2 = number(&comparison, "/chi2");
    assert!(!exact || (chi2 / fit.chi2() - 1.0).abs() < same, "{chi2} {}", fit.chi2());
    for same in ["/dof", "/computed"] {
        assert_eq!(part(&comparison, same), part(&fit, same));
    }
    assert_eq!(comparison.is_refuted(), fit.is_refuted());
    comparison
}

#[test]
fn a_joint_fit_of_one_cloth_twice_is_the_fit_of_all_its_shots() {
    let both = [("one", 1), ("two", 2)].map(|(name, seed)| cloth(name, 0.3, seed, 30, "natural-roll"));
    let exact = Asked { exact: true, ..Asked::default() };
    is_the_fit_of_all(&both, exact);
    for loss in [Loss::Huber, Loss::Cauchy] {
        let comparison = is_the_fit_of_all(&both, Asked { loss: Some(loss), ..exact });
        let test = of(&comparison, MU_S)["same_or_different"].clone();
        let p_value = number(&test, "/p_value");
        assert!(test["test"] == "Wald statistic" && (0.0..=1.0).contains(&p_value), "{test}");
        assert_eq!(part(&comparison, "/robust/losses"), json!([loss.name()]));
    }
}

/// Stun shots do not press the object ball into the cloth: their data set is left out of μ_s, and not of μ.
#[test]
fn what_cannot_tell_is_said_and_left_out() {
    let filmed = |name: &str, played, seed| {
        let spec = with(&spec("tracks", &[played], 15, seed), &format!("name = {name:?}"));
        Dataset { cloth: Some(name.to_owned()), ..made(&spec) }
    };
    let measured = |name, mu_s, seed, played| cloth(name, mu_s, seed, 30, played);
    let (rolls, stun) = ("natural-roll", "stun");
    for three in [
        [measured("a", 0.2, 1, rolls), measured("c", 0.3, 3, stun), measured("b", 0.4, 2, rolls)],
        [filmed("a", rolls, 65), filmed("c", stun, 66), filmed("b", rolls, 67)],
    ] {
        let comparison = compare(&three, &options::of_comparison()).unwrap();
        assert_eq!(of(&comparison, MU_S)["left_out"].as_array().unwrap().len(), 1);
        let table = table(&comparison);
        assert!(table.contains("c is left out: its shots have no topspin"), "{table}");
        let difference = difference(&comparison, MU_S);
        assert_eq!((&difference["first"], &difference["second"]), (&"a".into(), &"b".into()));
        assert_eq!(of(&comparison, Quantity::Parameter(Parameter::Mu))["left_out"], json!([]));
    }
}

/// How often a difference is found: where there is none, by the pair and by "same" against "different", and where there is
/// one that 80 % of experiments should find.
fn rates(count: u64, loss: Loss) {
    let options = Options { loss: Some(loss), ..options::of_comparison() };
    let (mut chance, mut ratio, mut found) = (0, 0, 0);
    for seed in 0..count {
        let a = cloth("a", 0.3, 2 * seed, 40, "natural-roll");
        let b = cloth("b", 0.3, 2 * seed + 1, 40, "natural-roll");
        let comparison = compare(&[a.clone(), b], &options).unwrap();
        let compared = of(&comparison, MU_S);
        chance += u64::from(compared["differences"][0]["real"] == true);
        ratio += u64::from(number(&compared, "/same_or_different/p_value") < 0.05);
        // 2.8 standard errors of a difference, which 80 % of experiments find
        let detectable = 2.8 * number(&compared, "/differences/0/std_error");
        let b = cloth("b", 0.3 + detectable, 2 * seed + 1, 40, "natural-roll");
        let comparison = compare(&[a, b], &options).unwrap();
        found += u64::from(difference(&comparison, MU_S)["real"] == true);
    }
    let name = loss.name();
    figure(format!(
        "{name}, of {count}: {chance} false by the difference, {ratio} by the ratio; {found} found"
    ));
    // four standard deviations of a count
    let within = |seen: u64, expected: f64| {
        let n = count as f64;
        (seen as f64 - n * expected).abs() < 4.0 * (n * expected * (1.0 - expected)).sqrt()
    };
    assert!(within(chance, 0.05), "{chance} of {count}");
    assert!(within(ratio, 0.05), "{ratio} of {count}");
    assert!(within(found, 0.8), "{found} of {count}");
}

/// With CAROMFIT_COMPARISONS=1000: tests/reference/studies.md.
#[test]
fn differences_are_found_where_they_are_and_hardly_elsewhere() {
    rates(count("CAROMFIT_COMPARISONS", 40) as u64, Loss::Squares);
}

/// The errors of a robust loss are from the scatter of the shots.
#[test]
fn with_a_robust_loss_too() {
    rates(count("CAROMFIT_COMPARISONS", 20) as u64, Loss::Huber);
}

/// Nothing from elsewhere, and every point of a plot leads to the shot that it names.
#[test]
fn reports_stand_alone_and_name_their_points() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_str().unwrap();
    done_in(root(), &["fit", "data/synthetic-natural-roll", "--out", out]);
    done_in(root(), &["compare", "data/synthetic-cloth-a", "data/synthetic-cloth-b", "--out", out]);
    // four velocities of each shot
    for (page, points) in [("synthetic-natural-roll/report.html", 4 * 30), ("report.html", 4 * 60)] {
        let page = fs::read_to_string(folder.path().join(page)).unwrap();
        let outside = page.replace("http://www.w3.org/2000/svg", "");
        for forbidden in ["http:", "https:", "src=", "@import", "url("] {
            assert!(!outside.contains(forbidden), "{forbidden}");
        }
        let data = page.split("<script type=\"application/json\" class=\"spots\">").nth(1).unwrap();
        let spots: Value = serde_json::from_str(data.split("</script>").next().unwrap()).unwrap();
        let labels = spots["labels"].as_array().unwrap();
        assert_eq!(labels.len(), points);
        for (i, label) in labels.iter().enumerate() {
            let shot = label["shot"].as_str().unwrap();
            assert!(page.contains(&format!("data-name=\"{shot}\"")), "{shot} is not listed");
            assert!(spots["spots"].as_array().unwrap().iter().any(|spot| spot[2] == i), "{label}");
        }
    }
}
