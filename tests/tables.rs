//! Tables that state no standard deviations: the noise is estimated, and intervals know from how few numbers.

use crate::prelude::*;

/// Tables of each size; CAROMFIT_SETS may raise it.
const SETS: usize = 100;

/// Of the two parameters together: 95 % of 200 intervals hold with a scatter of 1.6 %, and these sizes are five. With a noise for each
/// column 78 to 89 % did for 5 to 10 shots.
const LEAST: f64 = 0.91;

/// Velocities after the impact, or those before it too, with errors of 10 mm/s, none stated.
fn impacts(shots: usize, seed: u64, spin: &str, before_too: bool) -> Dataset {
    /// m/s.
    const SD: f64 = 0.01;
    let exact = with(&spec("impacts", &[spin], shots, seed), EXACT);
    let mut dataset = made(&exact);
    let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
    let mut noise = || SD * Normal::standard().inverse_cdf(rng.random_range(f64::EPSILON..1.0));
    for shot in &mut dataset.shots {
        for measurement in &mut shot.after {
            measurement.measured.value += noise();
        }
        if let (true, Before::Impact { velocity, .. }) = (before_too, &mut shot.before) {
            for component in velocity.iter_mut() {
                component.value += noise();
            }
        }
    }
    dataset
}

/// Angles that err by 0.2° and speeds that err by 4 mm/s, as [`spec`] has them, none stated.
fn angles(shots: usize, seed: u64, spin: &str) -> Dataset {
    let mut dataset = made(&spec("angles", &[spin], shots, seed));
    for shot in &mut dataset.shots {
        shot.after.iter_mut().for_each(|measurement| measurement.measured.sd = None);
        let Before::Angle { cut, speed } = &mut shot.before else { panic!("{:?}", shot.before) };
        cut.sd = None;
        if let Some(speed) = speed {
            speed.sd = None;
        }
    }
    dataset
}

/// The part of the 95 % intervals of μ and of e that hold.
fn coverage(name: &str, shots: usize, make: impl Fn(usize, u64) -> Dataset) -> f64 {
    let sets = count("CAROMFIT_SETS", SETS);
    let (mut covered, mut squares, mut used) = ([0; 2], [0.0; 2], 0);
    for seed in 0..sets as u64 {
        let fit = options::fitted(&make(shots, seed), Depth::Intervals);
        used += fit.shots_used();
        for (i, (parameter, truth)) in [(Parameter::Mu, 0.05), (Parameter::E, 0.94)].into_iter().enumerate() {
            let estimate = fit.get(parameter).unwrap();
            let holds = estimate.interval_95.is_some_and(|[low, high]| (low..=high).contains(&truth));
            covered[i] += usize::from(holds);
            squares[i] += ((estimate.value - truth) / estimate.std_error.unwrap_or(f64::NAN)).powi(2);
        }
    }
    let [mu, e] = covered.map(|covered| covered as f64 / sets as f64);
    let errors = squares.map(|sum| (sum / sets as f64).sqrt());
    let left_out = shots * sets - used;
    figure(format!("| {name} | {shots} | {mu:.3} | {e:.3} | {errors:.2?} | {left_out} |"));
    0.5 * (mu + e)
}

#[test]
fn intervals_of_tables_without_deviations_hold() {
    for shots in [5, 6, 8, 10, 20] {
        let impacts = coverage("stun", shots, |shots, seed| impacts(shots, seed, "stun", true));
        let angles = coverage("angles, stun", shots, |shots, seed| angles(shots, seed, "stun"));
        assert!(impacts.min(angles) > LEAST, "{impacts}, {angles} of the intervals of {shots} shots hold");
    }
}

/// The long study also takes other tables.
#[test]
#[ignore = "a study without a promise: see studies.md"]
fn intervals_of_other_tables_without_deviations_hold() {
    for shots in [5, 6, 8, 10, 20] {
        coverage("roll", shots, |shots, seed| impacts(shots, seed, "natural-roll", true));
        coverage("stun, exact before", shots, |n, seed| impacts(n, seed, "stun", false));
        coverage("angles, roll", shots, |shots, seed| angles(shots, seed, "natural-roll"));
    }
}
