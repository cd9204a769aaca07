//! Progress on standard error: on a terminal a bar after a second, else a line each ten seconds.

use std::io::IsTerminal;
use std::thread;
use std::time::Duration;

use caromfit::io::{self, DatasetError};
use caromfit::measurement::dataset::Dataset;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::{Failure, unless_none};

/// Work that takes less than this shows no progress.
const QUIET: Duration = Duration::from_secs(1);

/// Time between lines where there is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);

/// Can be moved on from several threads.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    pub fn new(steps: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(steps as u64), ProgressDrawTarget::hidden());
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}  {elapsed} (about {eta} left)")
        {
            bar.set_style(style);
        }
        // a single step may be the slow one
        let weak = bar.downgrade();
        thread::spawn(move || {
            if std::io::stderr().is_terminal() {
                thread::sleep(QUIET);
                if let Some(bar) = weak.upgrade().filter(|bar| !bar.is_finished()) {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(Duration::from_millis(200));
                }
                return;
            }
            loop {
                thread::sleep(BETWEEN_LINES);
                let Some(bar) = weak.upgrade().filter(|bar| !bar.is_finished()) else { return };
                let (done, all) = (bar.position(), bar.length().unwrap_or_default());
                eprintln!("{done} of {all} steps done, {} s: {}", bar.elapsed().as_secs(), bar.message());
            }
        });
        Self { bar }
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
    }

    /// The step is done.
    pub fn done(&self) {
        self.bar.inc(1);
    }

    /// So many more steps are to come.
    pub fn expect(&self, steps: usize) {
        self.bar.inc_length(steps as u64);
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// However the work ended.
impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

/// Loads data sets; what is wrong with any of them.
pub fn load(paths: &[std::path::PathBuf]) -> (Vec<Dataset>, Vec<DatasetError>) {
    let progress = Progress::new(paths.len());
    let (mut datasets, mut wrong) = (Vec::new(), Vec::new());
    for path in paths {
        progress.step(&format!("reading {}", path.display()));
        match io::load(path) {
            Ok(dataset) => datasets.push(dataset),
            Err(error) => wrong.push(error),
        }
        progress.done();
    }
    progress.finish();
    (datasets, wrong)
}

/// Loads data sets, all of which must be right and have names of their own, by which results are told apart.
pub fn load_all(paths: &[std::path::PathBuf]) -> Result<Vec<Dataset>, Failure> {
    let (datasets, wrong) = load(paths);
    unless_none(&wrong, Failure::input)?;
    named_apart(&datasets)?;
    Ok(datasets)
}

/// Data sets must have names of their own, by which results are told apart.
pub fn named_apart(datasets: &[Dataset]) -> Result<(), Failure> {
    for (i, one) in datasets.iter().enumerate() {
        if let Some(other) = datasets[..i].iter().find(|other| other.name == one.name) {
            return Err(Failure::input(format!(
                "{} and {} are both named \"{}\", by which their results are told apart; expected different names",
                other.path.display(),
                one.path.display(),
                one.name
            )));
        }
    }
    Ok(())
}
