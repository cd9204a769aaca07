//! Errors in the measured state before the impact (errors in variables): what a fit of velocities makes of them, and
//! what one makes that takes that state for exact.

use caromfit::dataset::{self, Before, Dataset, Spin};
use caromfit::fit::{self, Depth, Options};
use caromfit::synth::{self, BallSpec, Camera, ClothSpec, Kind, Noise, Played, Shots, Spec, Truth};

use crate::extraction::count;

const TRUTH: [f64; 3] = [0.05, 0.3, 0.94];

/// So many shots a set that a bias stands out of the scatter; errors are told as those of 40 shots.
const SHOTS: usize = 2000;
const TOLD: f64 = 40.0;

/// The bias of μ where the errors are ignored is more than the standard error that such a fit of 40 shots states…
const WRONG: f64 = 1.0;
/// …and more than so many standard deviations of its mean over the sets.
const SURELY: f64 = 3.5;

/// Ours is a tenth of the standard error of 40 shots, and its mean over the sets known to some hundredths.
const RIGHT: f64 = 0.2;

/// A stated standard error is true to this: the scatter of 40 sets is itself known to 11 %.
const TRUE: f64 = 0.5;

fn made(seed: u64, played: &[Played], noise: Noise, cut_deg: [f64; 2]) -> Dataset {
    let [mu, mu_s, e] = TRUTH;
    let spec = Spec {
        name: "synthetic".to_owned(),
        kind: Kind::Impacts,
        seed,
        truth: Truth { mu, mu_s, e },
        shots: Shots { count: SHOTS, speed_m_s: [1.0, 4.0], cut_deg, cue_spin: played.to_vec() },
        noise,
        ball: BallSpec::default(),
        camera: Camera::default(),
        cloth: ClothSpec::default(),
    };
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in synth::generate(&spec).unwrap() {
        std::fs::write(folder.path().join(name), content).unwrap();
    }
    dataset::load(folder.path()).unwrap()
}

/// As if the state before the impact were exact.
fn ignoring(mut dataset: Dataset) -> Dataset {
    for shot in &mut dataset.shots {
        if let Before::Impact { normal, velocity } = &mut shot.before {
            for value in normal.iter_mut().chain(velocity) {
                value.sd = None;
            }
        }
        if let Spin::Measured { sd, .. } = &mut shot.spin {
            *sd = [None; 3];
        }
    }
    dataset
}

/// Bias of μ, its uncertainty, its scatter and its stated standard error, the last two as of 40 shots.
fn bias(fits: &[(f64, f64)]) -> [f64; 4] {
    let n = fits.len() as f64;
    let mean = fits.iter().map(|(value, _)| value - TRUTH[0]).sum::<f64>() / n;
    let square = fits.iter().map(|(value, _)| (value - TRUTH[0] - mean).powi(2)).sum::<f64>();
    let scatter = (square / (n - 1.0)).sqrt();
    let stated = fits.iter().map(|(_, error)| error).sum::<f64>() / n;
    let of_40 = (SHOTS as f64 / TOLD).sqrt();
    [mean, scatter / n.sqrt(), scatter * of_40, stated * of_40]
}

#[test]
fn errors_before_the_impact_would_bias_mu_if_they_were_ignored() {
    let sets = count("CAROMFIT_SETS", 40) as u64;
    // the line of centres is what footage tells least surely
    let noise = Noise { velocity_m_s: 0.001, line_of_centres_deg: 0.3, spin_rad_s: 0.001, angle_deg: 0.0 };
    for (what, played, cut_deg) in [
        ("stun, thick", Played::Stun, [-30.0, 30.0]),
        ("roll, cut to one side", Played::NaturalRoll, [5.0, 50.0]),
    ] {
        let mut found = [Vec::new(), Vec::new()];
        for seed in 0..sets {
            let dataset = made(seed, &[played], noise, cut_deg);
            for (found, dataset) in found.iter_mut().zip([dataset.clone(), ignoring(dataset)]) {
                let options = Options { depth: Depth::Estimates, ..Options::default() };
                let fit = fit::fit(&dataset, &options).unwrap().remove(0);
                found.push((fit.estimates[0].value, fit.estimates[0].std_error.unwrap()));
            }
        }
        let [ours, ignoring] = found.map(|fits| bias(&fits));
        for (way, [mean, of_mean, scatter, stated]) in [("ours", ours), ("ignoring", ignoring)] {
            println!(
                "{what}, {way}: bias {mean:+.6} ± {of_mean:.6}; of 40 shots: scatter {scatter:.6}, stated {stated:.6}"
            );
        }
        let [mean, _, scatter, stated] = ours;
        assert!(mean.abs() < RIGHT * stated, "{what}: {mean} with a stated error of {stated}");
        assert!((scatter / stated - 1.0).abs() < TRUE, "{what}: scatter {scatter}, stated {stated}");
        let [mean, of_mean, scatter, stated] = ignoring;
        assert!(
            mean > WRONG * stated && mean > SURELY * of_mean,
            "{what}: {mean} ± {of_mean}, stated {stated}"
        );
        assert!(scatter > 5.0 * stated, "{what}: scatter {scatter}, stated {stated}");
    }
}
