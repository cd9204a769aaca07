//! What a fit says of its own trustworthiness, against brute force and against data made to fool it.

use serde::Deserialize;

use crate::prelude::*;
use crate::synthetic::made_of_weighed_balls as made;

fn fitted(dataset: &Dataset) -> Fit {
    options::fitted_with(dataset, &options::of_fit())
}

fn thorough(dataset: &Dataset) -> Fit {
    options::fitted(dataset, Depth::Everything)
}

/// Impacts of balls in natural roll.
fn rolls(count: usize, seed: u64) -> Dataset {
    made(&spec("impacts", &["natural-roll"], count, seed))
}

/// χ² with some parameters held, least over the others.
fn held(dataset: &Dataset, at: &[(Parameter, f64)]) -> f64 {
    let mut dataset = dataset.clone();
    for (parameter, value) in at {
        let setting = &mut dataset.settings[*parameter];
        (setting.initial, setting.fixed) = (*value, true);
    }
    options::fitted(&dataset, Depth::Estimates).chi2()
}

/// A region of two parameters in fit.json.
#[derive(Deserialize)]
struct Contour {
    parameters: [String; 2],
    centre: [f64; 2],
    levels: Vec<Level>,
}

#[derive(Deserialize)]
struct Level {
    probability: f64,
    chi2_rise: f64,
    edge: Vec<[f64; 2]>,
}

impl Level {
    /// Whether its edge is symmetric, which only that of a parabola is.
    fn is_ellipse(&self, centre: [f64; 2]) -> bool {
        let (one, other) = self.edge.split_at(self.edge.len() / 2);
        let off = |i: usize| one.iter().zip(other).map(move |(a, b)| (a[i] + b[i] - 2.0 * centre[i]).abs());
        off(0).chain(off(1)).all(|off| off < 1e-12)
    }
}

fn contours(fit: &Fit) -> Vec<Contour> {
    serde_json::from_value(part(fit, "/contours")).unwrap()
}

/// The profile ends where χ² of a new fit is that of the interval above its minimum.
#[test]
fn a_profile_is_how_chi2_rises() {
    /// χ²(1) at 95 %: scipy.stats.chi2.ppf(0.95, 1).
    const QUANTILE: f64 = 3.841_458_820_694_124;
    /// The profile keeps the weights of the minimum, a new fit does not; and an end is found to 10⁻³.
    const SAME: f64 = 0.03;
    let dataset = rolls(40, 11);
    let fit = thorough(&dataset);
    for estimate in fit.estimates() {
        let ends = estimate.interval_95.unwrap();
        for end in ends {
            let rise = held(&dataset, &[(estimate.parameter, end)]) - fit.chi2();
            assert!((rise / QUANTILE - 1.0).abs() < SAME, "{}: {rise}", estimate.parameter.name());
        }
    }
    let covariance = fit.covariance();
    let error = fit.mu().unwrap().std_error.unwrap();
    assert!((covariance[(0, 0)] - error * error).abs() < 1e-12 * error * error);
    // as an inverse is, to rounding
    assert!((covariance[(0, 1)] / covariance[(1, 0)] - 1.0).abs() < 1e-14);
}

#[test]
fn profiles_and_regions_know_bounds_where_the_hessian_does_not() {
    let fit = thorough(&shipped("mathavan-2014"));
    let [mu_s, e] = [1, 2].map(|i: usize| fit.estimates()[i]);
    // μ_s at its bound holds the others: e is far surer than its error without the bound says, and lopsided
    assert_eq!(mu_s.status, Status::AtLowerBound);
    assert_eq!(part(&fit, "/parameters/e/interval_method"), "profile");
    let [low, high] = e.interval_95.unwrap();
    assert!(e.value - low > 2.0 * (high - e.value), "{:?}", e.interval_95);
    // the one-sided limit of μ_s is nothing but its upper bound
    assert_eq!(mu_s.interval_95, Some([0.0, 1.0]));
    let contour = &contours(&fit)[0];
    assert_eq!(contour.parameters, ["mu", "mu_s"], "{:?}", fit.estimates());
    for level in &contour.levels {
        let ends = level.edge.iter().map(|point| point[1]);
        assert_eq!(ends.clone().fold(f64::INFINITY, f64::min), 0.0);
        assert_eq!(ends.fold(0.0, f64::max), 1.0);
    }
}

#[test]
fn throw_that_falls_with_speed_is_named() {
    let mut dataset = shipped("alciatore-2014-speed");
    (dataset.settings.falls, dataset.settings.compliance) = (false, Compliance::Rigid);
    let fit = fitted(&dataset);
    let trend = part(&fit, "/goodness/trends/0");
    let [slope, p_value] = ["/slope_sd", "/p_value"].map(|key| number(&trend, key));
    assert!(trend["significant"] == true && slope < 0.0 && trend["against"] == "speed", "{trend}");
    let named = |w: &&str| {
        w.starts_with("The residuals of throw change with speed (-")
            && w.ends_with("friction is not constant.")
    };
    assert!(fit.warnings().iter().any(named), "{:?}", fit.warnings());
    assert!((p_value - ALCIATORE_P).abs() < 1e-3 * ALCIATORE_P, "{p_value}");
}

/// scipy.stats.linregress([0.8565, 1.0881, 1.3838, 2.1976, 3.2644], [6.03, 6.14, 5.50, 4.21, 3.46]).pvalue, the
/// incoming speeds that these object-ball speeds come of, which are proportional to them.
const ALCIATORE_P: f64 = 0.003_676_857;

#[test]
fn trends_are_found_no_more_often_than_chance_has_it() {
    /// Of 200 data sets 5 % with a scatter of 1.5 %: 3.5 scatters.
    const MOST: usize = 20;
    let (mut named, mut normal, mut explained) = (0, 0, 0);
    let seeds = 200;
    for seed in 0..seeds {
        let fit = fitted(&rolls(25, 1000 + seed));
        let goodness = part(&fit, "/goodness");
        let [trends, influence] = ["trends", "influence"].map(|key| goodness[key].as_array().unwrap());
        named += usize::from(trends.iter().any(|trend| trend["significant"] == true));
        normal += usize::from(number(&goodness, "/normality/p_value") > 0.05);
        explained += usize::from(goodness["stated_noise"] == "explains-residuals");
        let leverage: f64 = influence.iter().map(|shot| number(shot, "/leverage")).sum();
        assert!(leverage < 3.0);
    }
    assert!(named <= MOST, "{named} of {seeds} data sets have a trend by chance");
    assert!(normal >= 180 && explained >= 195, "{normal} {explained}");
}

#[test]
fn a_robust_loss_lists_the_wrong_shots_and_keeps_to_the_others() {
    let mut spoilt = rolls(40, 8);
    for row in spoilt.shots.iter_mut().step_by(10).flat_map(|shot| &mut shot.after) {
        row.measured.value += 0.05;
    }
    for loss in [Loss::Huber, Loss::Cauchy] {
        let options = Options { loss: Some(loss), ..options::of_fit() };
        let fit = options::fitted_with(&spoilt, &options);
        assert!(fit.converged(), "{}", part(&fit, "/termination"));
        let weights = part(&fit, "/robust/weights_below_1");
        let small = weights.as_array().unwrap().iter().filter(|one| number(*one, "/weight") < 0.4);
        let mut listed: Vec<&str> = small.map(|one| one["shot"].as_str().unwrap()).collect();
        listed.sort_unstable();
        assert_eq!(listed, ["1", "11", "21", "31"], "{weights}");
        for (estimate, truth) in fit.estimates().iter().zip([0.05, 0.3, 0.94]) {
            let off = (estimate.value - truth) / estimate.std_error.unwrap();
            assert!(off.abs() < 2.5, "{} is off by {off}", estimate.parameter.name());
        }
    }
    assert!(part(&fitted(&spoilt), "/robust").is_null());
}

#[test]
fn on_the_edge_of_a_region_chi2_has_risen_by_its_quantile() {
    /// As for the profiles: the weights of the minimum against those of a new fit.
    const SAME: f64 = 0.03;
    /// An ellipse serves where no end of an interval is off by a tenth of its half, χ² by a fifth.
    const OF_ELLIPSE: f64 = 0.2;
    let dataset = rolls(30, 12);
    let fit = thorough(&dataset);
    let contours = contours(&fit);
    assert_eq!(contours.len(), 3);
    for Contour { parameters, centre, levels } in &contours {
        let parameters = parameters.each_ref().map(|name| name.parse::<Parameter>().unwrap());
        for level in levels {
            let Level { probability, chi2_rise, edge } = level;
            let most = if level.is_ellipse(*centre) { OF_ELLIPSE } else { SAME };
            // −2 ln(1 − p) of χ²(2)
            assert!((chi2_rise + 2.0 * (1.0 - probability).ln()).abs() < 1e-9);
            for point in edge.iter().step_by(7) {
                let at: Vec<_> = parameters.into_iter().zip(*point).collect();
                let rise = held(&dataset, &at) - fit.chi2();
                assert!((rise / chi2_rise - 1.0).abs() < most, "{point:?}: {rise}, expected {chi2_rise}");
            }
        }
    }
}

#[test]
fn the_bootstrap_scatters_as_the_errors_say() {
    /// 300 samples tell a standard deviation to 4 %, 40 shots their own to some 12 %.
    const SAME: f64 = 0.4;
    let dataset = rolls(40, 31);
    let options = Options { bootstrap: 300, seed: 7, ..options::of_fit() };
    let count = AtomicUsize::new(0);
    let done = || {
        count.fetch_add(1, Ordering::Relaxed);
    };
    let fit = fit::fit_watched(&dataset, &options, &done).unwrap().remove(0);
    assert_eq!(count.into_inner(), 300);
    let bootstrap = part(&fit, "/bootstrap");
    assert_eq!((&bootstrap["failed"], bootstrap["parameters"].as_object().unwrap().len()), (&0.into(), 3));
    for estimate in &fit.estimates()[..3] {
        let one = &bootstrap["parameters"][estimate.parameter.name()];
        let error = estimate.std_error.unwrap();
        assert!((number(one, "/std_error") / error - 1.0).abs() < SAME, "{one} {error}");
        assert!(number(one, "/bias").abs() < 0.3 * error);
        for interval in ["interval_95_percentile", "interval_95_bca"] {
            let [low, high] = [0, 1].map(|end| number(one, &format!("/{interval}/{end}")));
            assert!(low < estimate.value && estimate.value < high);
        }
    }
    // the same seed, the same samples, whatever thread they ran on
    let again = options::fitted_with(&dataset, &options);
    assert_eq!(part(&again, "/bootstrap"), bootstrap);
}
