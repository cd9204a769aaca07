//! Studies: how many sets they take, their figures, and errors of estimates over their standard errors.

use std::fmt::Display;

use crate::prelude::*;

/// Standard deviations of its scatter that a mean or a coverage may be off: of a dozen numbers one is farther off once in 200 runs, and
/// the seeds are fixed.
const OFF: f64 = 3.5;

/// A count that an environment variable may raise, for the long study.
pub fn count(variable: &str, default: usize) -> usize {
    std::env::var(variable).ok().and_then(|n| n.parse().ok()).unwrap_or(default)
}

/// Shows a figure of a long study, with `--nocapture`.
pub fn figure(text: impl Display) {
    eprintln!("{text}");
}

/// What is found with each seed, in threads of their own: a worker of the pool that fits shots would take up one set within another, ever
/// deeper.
pub fn in_threads<T: Send>(seeds: &[u64], find: impl Fn(u64) -> Vec<T> + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut found = Vec::new();
        while let Some(seed) = seeds.get(next.fetch_add(1, Ordering::Relaxed)) {
            found.extend(find(*seed));
        }
        found
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..rayon::current_num_threads()).map(|_| scope.spawn(work)).collect();
        threads.into_iter().flat_map(|thread| thread.join().unwrap()).collect()
    })
}

/// Asserts that the fits converged and that the errors of their estimates, over their standard errors, have the mean 0 and the standard
/// deviation 1, and that 95 % of the intervals hold the truth.
pub fn check_errors(fits: &[Fit], parameters: &[Parameter], truth: &[f64]) {
    assert!(fits.iter().all(|fit| fit.converged()));
    for parameter in parameters {
        let pulls = Pulls::of(fits, *parameter, truth[*parameter as usize]);
        let (name, mean, n) = (parameter.name(), pulls.mean(), pulls.n());
        assert_eq!(pulls.intervals, fits.len(), "{name}");
        let sd = (pulls.all.iter().map(|pull| (pull - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
        figure(format!("{name}: mean {mean:.3}, sd {sd:.3}, coverage {:.3} of {n}", pulls.coverage()));
        assert!(mean.abs() < OFF / n.sqrt(), "{name}: mean {mean}");
        assert!((sd - 1.0).abs() < OFF / (2.0 * n).sqrt(), "{name}: standard deviation {sd}");
        let of_coverage = (0.95 * 0.05 / fits.len() as f64).sqrt();
        assert!((pulls.coverage() - 0.95).abs() < OFF * of_coverage, "{name}: {}", pulls.coverage());
    }
}

/// Takes the state of each shot before the impact for exact.
pub fn take_inputs_for_exact(dataset: &mut Dataset) {
    for shot in &mut dataset.shots {
        if let Before::Impact { normal, velocity } = &mut shot.before {
            normal.iter_mut().chain(velocity).for_each(|measured| measured.sd = None);
        }
        if let Spin::Measured { sd, .. } = &mut shot.spin {
            *sd = [None; 3];
        }
    }
}

/// Errors of estimates of one parameter over their standard errors, and how many intervals hold the truth.
#[derive(Default)]
pub struct Pulls {
    pub all: Vec<f64>,
    errors: f64,
    held: usize,
    intervals: usize,
}

impl FromIterator<f64> for Pulls {
    fn from_iter<T: IntoIterator<Item = f64>>(pulls: T) -> Self {
        Self { all: pulls.into_iter().collect(), ..Self::default() }
    }
}

impl Pulls {
    /// The pulls of the estimates that have an error.
    pub fn of<'a>(fits: impl IntoIterator<Item = &'a Fit>, parameter: Parameter, truth: f64) -> Self {
        let mut found = Self::default();
        for estimate in fits.into_iter().filter_map(|fit| fit.get(parameter)) {
            if let Some([low, high]) = estimate.interval_95 {
                found.intervals += 1;
                found.held += usize::from((low..=high).contains(&truth));
            }
            if let Some(error) = estimate.std_error {
                found.all.push((estimate.value - truth) / error);
                found.errors += error;
            }
        }
        found
    }

    fn n(&self) -> f64 {
        self.all.len() as f64
    }

    pub fn mean(&self) -> f64 {
        self.all.iter().sum::<f64>() / self.n()
    }

    /// The root mean square.
    pub fn rms(&self) -> f64 {
        (self.all.iter().map(|pull| pull * pull).sum::<f64>() / self.n()).sqrt()
    }

    /// The mean of the standard errors.
    pub fn error(&self) -> f64 {
        self.errors / self.n()
    }

    /// The part of the intervals that hold the truth.
    pub fn coverage(&self) -> f64 {
        self.held as f64 / self.intervals as f64
    }

    /// Asserts that the bias is below a tenth of a standard error, as far as so many sets tell.
    pub fn check_mean(&self, what: &str) {
        let (mean, n) = (self.mean(), self.n());
        let [error, rms, covered] = [self.error(), self.rms(), self.coverage()];
        figure(format!(
            "{what}: error {error:.5}, mean {mean:+.3}, rms {rms:.3}, covered {covered:.3} of {n}"
        ));
        assert!(mean.abs() < 0.1 + OFF / n.sqrt(), "{what}: mean {mean} of {:.2?}", self.all);
    }

    /// The same, and that the part of the 95 % intervals that hold is in this range.
    pub fn check(&self, what: &str, [low, high]: [f64; 2]) {
        self.check_mean(what);
        let covered = self.coverage();
        let off = OFF * (0.95 * 0.05 / self.intervals as f64).sqrt();
        assert!((low - off..=high + off).contains(&covered), "{what}: {covered} of the intervals hold");
    }
}
