//! What a fit says of its own trustworthiness, against brute force and against data made to fool it.

use std::path::Path;

use caromfit::dataset::{self, Dataset};
use caromfit::fit::{self, Fit, Options, Status};
use caromfit::parameters::Parameter;
use caromfit::synth::{self, BallSpec, Kind, Noise, Played, Shots, Spec, Truth};

fn spec(kind: Kind, cue_spin: &[Played], count: usize, seed: u64) -> Spec {
    Spec {
        name: "synthetic".to_string(),
        kind,
        seed,
        truth: Truth { mu: 0.05, mu_s: 0.3, e: 0.94 },
        shots: Shots { count, speed_m_s: [1.0, 4.0], cut_deg: [-50.0, 50.0], cue_spin: cue_spin.to_vec() },
        noise: Noise { velocity_m_s: 0.004, line_of_centres_deg: 0.05, spin_rad_s: 0.5, angle_deg: 0.2 },
        ball: BallSpec::default(),
        camera: synth::Camera::default(),
        cloth: synth::ClothSpec::default(),
    }
}

fn made(spec: &Spec) -> Dataset {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in synth::generate(spec).unwrap() {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    dataset::load(folder.path()).unwrap()
}

fn shipped(name: &str) -> Dataset {
    dataset::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("data").join(name)).unwrap()
}

fn fitted(dataset: &Dataset) -> Fit {
    fit::fit(dataset, &Options::default()).unwrap().remove(0)
}

/// χ² with one parameter held, least over the others.
fn held(dataset: &Dataset, parameter: Parameter, value: f64) -> f64 {
    let mut dataset = dataset.clone();
    let setting = &mut dataset.settings[parameter];
    (setting.initial, setting.fixed) = (value, true);
    fit::fit(&dataset, &Options { profiles: false, ..Options::default() }).unwrap()[0].chi2
}

#[test]
fn profile_ends_are_where_chi2_has_risen_by_the_quantile() {
    /// χ²(1) at 95 %: scipy.stats.chi2.ppf(0.95, 1).
    const QUANTILE: f64 = 3.841_458_820_694_124;
    /// The profile keeps the weights of the minimum, a new fit does not; and an end is found to 10⁻³.
    const SAME: f64 = 0.03;
    let dataset = made(&spec(Kind::Impacts, &[Played::NaturalRoll], 40, 11));
    let fit = fitted(&dataset);
    for estimate in &fit.estimates {
        for end in estimate.intervals.profile.unwrap() {
            let rise = held(&dataset, estimate.parameter, end) - fit.chi2;
            assert!((rise / QUANTILE - 1.0).abs() < SAME, "{}: {rise}", estimate.parameter.name());
        }
    }
}

#[test]
fn a_profile_knows_bounds_and_curvature_where_the_hessian_does_not() {
    let fit = fitted(&shipped("mathavan-2014"));
    let [mu, mu_s, e] = fit.estimates;
    // μ_s at its bound holds the others: e is far surer than its error without the bound says, and lopsided
    assert_eq!(mu_s.status, Status::AtLowerBound);
    assert!(e.is_profiled() && mu.is_profiled());
    let [low, high] = e.interval_95.unwrap();
    assert!(e.value - low > 2.0 * (high - e.value), "{:?}", e.interval_95);
    // the one-sided limit of μ_s is nothing but its upper bound
    assert_eq!(mu_s.interval_95, Some([0.0, 1.0]));
}

#[test]
fn a_profile_crosses_kinks() {
    // thick stun shots stick from some μ on: the profile of μ has kinks on either side
    let fits = fit::fit(&shipped("alciatore-2006"), &Options::default()).unwrap();
    for fit in fits {
        let [low, high] = fit.estimates[0].intervals.profile.unwrap();
        let value = fit.estimates[0].value;
        assert!(low < value && value < high, "{low} {value} {high}");
        let error = fit.estimates[0].std_error.unwrap();
        assert!(high - low > 3.0 * error && high - low < 6.0 * error);
    }
}

#[test]
fn only_the_product_is_said_to_be_determined() {
    // head-on natural roll: the object ball's speed knows e, μ and μ_s only through (1 + e)(1 − μ μ_s/2)/2
    let mut dataset = made(&spec(Kind::Angles, &[Played::NaturalRoll], 20, 3));
    let setting = &mut dataset.settings[Parameter::E];
    (setting.initial, setting.fixed) = (0.94, true);
    for shot in &mut dataset.shots {
        if let dataset::Before::Angle { cut, .. } = &mut shot.before {
            cut.value = 0.0;
            cut.sd = None;
        }
        shot.after.retain(|row| row.observable == caromfit::observable::Observable::ObjectSpeed);
    }
    let options = Options { fidelity: caromfit::collision::Fidelity::Linear, ..Options::default() };
    let fit = fit::fit(&dataset, &options).unwrap().remove(0);
    let worst = fit.diagnostics.identifiability.as_ref().unwrap().worst.clone().unwrap();
    assert!(worst.undetermined, "{worst:?}");
    assert_eq!(worst.words, "only the product μ·μ_s is determined by these shots");
    assert!(
        fit.warnings.iter().any(|w| w.contains("Only the product μ·μ_s is determined")),
        "{:?}",
        fit.warnings
    );
    assert_eq!(fit.estimates[0].status, Status::NotIdentified);
}
