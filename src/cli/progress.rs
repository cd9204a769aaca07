//! Progress on standard error, for work of more than a second and if it is a terminal.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use caromfit::dataset::{self, Dataset, DatasetError};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work that takes less than this shows no progress.
const QUIET: Duration = Duration::from_secs(1);

/// Can be moved on from several threads.
pub struct Progress {
    bar: ProgressBar,
    begun: Instant,
    shown: AtomicBool,
}

impl Progress {
    pub fn new(steps: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps as u64), ProgressDrawTarget::hidden());
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}  {elapsed} (about {eta} left)")
        {
            bar.set_style(style);
        }
        let shown = AtomicBool::new(!std::io::stderr().is_terminal());
        Self { bar, begun: Instant::now(), shown }
    }

    /// For work on each shot of data sets: footage counts its shots, and any data set one more than
    /// `others`, what else is done with it.
    pub fn over_shots(datasets: &[Dataset], others: usize) -> Self {
        let filmed = |dataset: &Dataset| dataset.tracks.as_ref().map_or(0, |tracks| tracks.shots.len());
        Self::new(datasets.iter().map(|dataset| filmed(dataset) + others + 1).sum())
    }

    /// Names the step that begins.
    pub fn step(&self, name: &str) {
        self.bar.set_message(name.to_string());
        self.show_when_slow();
    }

    /// The step is done.
    pub fn done(&self) {
        self.bar.inc(1);
        self.show_when_slow();
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }

    fn show_when_slow(&self) {
        if !self.shown.load(Ordering::Relaxed)
            && self.begun.elapsed() > QUIET
            && !self.shown.swap(true, Ordering::Relaxed)
        {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
            self.bar.enable_steady_tick(Duration::from_millis(200));
        }
    }
}

/// Loads data sets; what is wrong with any of them.
pub fn load(paths: &[std::path::PathBuf]) -> (Vec<Dataset>, Vec<DatasetError>) {
    let progress = Progress::new(paths.len());
    let (mut datasets, mut wrong) = (Vec::new(), Vec::new());
    for path in paths {
        progress.step(&format!("reading {}", path.display()));
        match dataset::load(path) {
            Ok(dataset) => datasets.push(dataset),
            Err(error) => wrong.push(error),
        }
        progress.done();
    }
    progress.finish();
    (datasets, wrong)
}
