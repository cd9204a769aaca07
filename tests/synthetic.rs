//! Synthetic data sets for other tests.

use std::fs;
use std::path::Path;

use caromfit::fit::{Fit, Options, fit};
use caromfit::io;
use caromfit::measurement::dataset::{Dataset, ObjectBall};
use caromfit::measurement::parameter::Parameter;
use caromfit::physics::ball::Ball;
use caromfit::physics::collision::{FidelityChoice, Model};
use caromfit::simulate;
use caromfit::simulate::{BallSpec, Camera, ClothSpec, Kind, Noise, Played, Shots, Spec, Truth};

/// μ, μ_s and e of the specifications.
pub const TRUTH: [f64; 3] = [0.05, 0.3, 0.94];

/// Standard errors by which an estimate may be off: one in 2000 is by chance.
pub const ERRORS: f64 = 3.5;

/// Usual shots with usual values and, unless they are tracks, the noise of footage of 250 fps.
pub fn spec(kind: Kind, cue_spin: &[Played], count: usize, seed: u64) -> Spec {
    let measured = Noise { velocity_m_s: 0.004, line_of_centres_deg: 0.05, spin_rad_s: 0.5, angle_deg: 0.2 };
    Spec {
        name: "synthetic".to_owned(),
        kind,
        seed,
        truth: Truth { mu: 0.05, mu_s: 0.3, e: 0.94, ..Truth::default() },
        shots: Shots { count, speed_m_s: [1.0, 4.0], cut_deg: [-50.0, 50.0], cue_spin: cue_spin.to_vec() },
        noise: if kind == Kind::Tracks { Noise::default() } else { measured },
        ball: BallSpec::default(),
        object: None,
        camera: Camera::default(),
        cloth: ClothSpec::default(),
    }
}

/// The data set that a specification makes.
pub fn made(spec: &Spec) -> Dataset {
    simulate::dataset(spec).unwrap()
}

/// The data set that a specification makes, with masses that are known to be equal.
pub fn made_of_weighed_balls(spec: &Spec) -> Dataset {
    Dataset { object: Some(ObjectBall::exact(Ball::POOL)), ..made(spec) }
}

/// The data set that a specification makes with the collisions of a model.
pub fn made_with(spec: &Spec, model: &Model) -> Dataset {
    let folder = tempfile::tempdir().unwrap();
    write(spec, model, folder.path());
    io::load(folder.path()).unwrap()
}

/// Writes the files of a specification with the collisions of a model into a folder, which is made.
pub fn write(spec: &Spec, model: &Model, folder: &Path) {
    fs::create_dir_all(folder).unwrap();
    for (name, content) in simulate::generate_with(spec, model).unwrap() {
        fs::write(folder.join(name), content).unwrap();
    }
}

/// The fit of a data set with the fidelity that its data call for.
pub fn auto(dataset: &Dataset) -> Fit {
    let options = Options { fidelity: FidelityChoice::Auto, ..crate::options::of_fit() };
    fit(dataset, &options).unwrap().remove(0)
}

/// Asserts that a parameter was found within its error.
pub fn is_right(fit: &Fit, parameter: Parameter, truth: f64) {
    let found = fit.get(parameter).unwrap();
    let error = found.std_error.unwrap_or_else(|| panic!("{parameter:?} has no error: {:?}", found.status));
    assert!((found.value - truth).abs() < ERRORS * error, "{parameter:?}: {} ± {error}", found.value);
}

/// Standard deviations that a mean, a standard deviation and a coverage may be off: of a dozen numbers one is farther off once in 200
/// runs, and the seeds are fixed.
pub const OFF: f64 = 3.5;

/// Asserts that the fits converged and that the errors of their estimates, over their standard errors, have the mean 0 and the standard
/// deviation 1, and that 95 % of the intervals hold the truth.
pub fn check_errors(fits: &[Fit], parameters: &[Parameter], truth: &[f64]) {
    for parameter in parameters {
        let truth = truth[*parameter as usize];
        let (mut pulls, mut covered) = (Vec::new(), 0);
        for fit in fits {
            assert!(fit.converged, "{}", fit.termination);
            let estimate = fit.estimates[*parameter as usize];
            let [low, high] = estimate.interval_95.unwrap();
            covered += u32::from((low..=high).contains(&truth));
            pulls.extend(estimate.std_error.map(|error| (estimate.value - truth) / error));
        }
        let n = pulls.len() as f64;
        let mean = pulls.iter().sum::<f64>() / n;
        let sd = (pulls.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        let coverage = f64::from(covered) / fits.len() as f64;
        let name = parameter.name();
        println!("{name}: mean {mean:.3}, sd {sd:.3}, coverage {coverage:.3}, {n} with an error");
        // of n standardized errors the mean scatters by 1/√n, the standard deviation by 1/√2n
        assert!(
            mean.abs() < OFF / n.sqrt() && (sd - 1.0).abs() < OFF / (2.0 * n).sqrt(),
            "{name}: {mean} {sd}"
        );
        let of_coverage = (0.95 * 0.05 / fits.len() as f64).sqrt();
        assert!((coverage - 0.95).abs() < OFF * of_coverage, "{name}: coverage {coverage}");
    }
}
