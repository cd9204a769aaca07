//! Progress on standard error: on a terminal a bar after a second, else a line each ten seconds.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use crate::io::{self, DatasetError};
use crate::measurement::dataset::Dataset;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::{Failure, unless_none};

/// A bar, which several threads can move, until it is dropped.
pub(super) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    pub(super) fn new(steps: usize) -> Self {
        let mut bar = ProgressBar::with_draw_target(Some(steps as u64), ProgressDrawTarget::hidden());
        let template = "{bar:30} {pos}/{len} {msg}  {elapsed} (about {eta} left)";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar = bar.with_style(style);
        }
        // a single step may be the slow one
        let weak = bar.downgrade();
        thread::spawn(move || {
            if std::io::stderr().is_terminal() {
                thread::sleep(Duration::from_secs(1));
                if let Some(bar) = weak.upgrade().filter(|bar| !bar.is_finished()) {
                    bar.set_draw_target(ProgressDrawTarget::stderr());
                    bar.enable_steady_tick(Duration::from_millis(200));
                }
                return;
            }
            loop {
                thread::sleep(Duration::from_secs(10));
                let Some(bar) = weak.upgrade().filter(|bar| !bar.is_finished()) else { return };
                let (done, all) = (bar.position(), bar.length().unwrap_or_default());
                eprintln!("{done} of {all} steps done, {} s: {}", bar.elapsed().as_secs(), bar.message());
            }
        });
        Self { bar }
    }

    /// Shows the work on data sets: a step for each filmed shot, and for each data set one more than `others`.
    pub(super) fn over_shots(datasets: &[Dataset], others: usize) -> Self {
        let filmed = |dataset: &Dataset| dataset.tracks.as_ref().map_or(0, |tracks| tracks.shots.len());
        Self::new(datasets.iter().map(|dataset| filmed(dataset) + others + 1).sum())
    }

    pub(super) fn step(&self, name: &str) {
        self.bar.set_message(name.to_string());
    }

    pub(super) fn done(&self) {
        self.bar.inc(1);
    }

    /// Adds steps that are to come.
    pub(super) fn expect(&self, steps: usize) {
        self.bar.inc_length(steps as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Returns the data sets that can be loaded, and what is wrong with the others.
pub(super) fn load(paths: &[PathBuf]) -> (Vec<Dataset>, Vec<DatasetError>) {
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
    (datasets, wrong)
}

/// Loads data sets, all of which must be right and have different names.
pub(super) fn load_all(paths: &[PathBuf]) -> Result<Vec<Dataset>, Failure> {
    let (datasets, wrong) = load(paths);
    unless_none(&wrong, 2)?;
    named_apart(&datasets)?;
    Ok(datasets)
}

/// Refuses data sets of the same name.
pub(super) fn named_apart(datasets: &[Dataset]) -> Result<(), Failure> {
    for (i, one) in datasets.iter().enumerate() {
        if let Some(other) = datasets[..i].iter().find(|other| other.name == one.name) {
            refuse!(
                "{} and {} are both named \"{}\", by which their results are told apart; expected different names",
                other.path.display(),
                one.path.display(),
                one.name
            );
        }
    }
    Ok(())
}
