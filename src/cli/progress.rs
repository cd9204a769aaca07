//! Progress on standard error: on a terminal a bar, else a line each ten seconds.

use std::collections::HashMap;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use crate::io::{self, DatasetError};
use crate::measurement::dataset::Dataset;
use indicatif::{ProgressBar, ProgressStyle};

use super::Failure;

/// A bar, which several threads can move, until it is dropped.
pub(super) struct Progress(ProgressBar);

impl Progress {
    pub(super) fn new(steps: usize) -> Self {
        let bar = ProgressBar::new(steps as u64);
        let template = "{bar:30} {pos}/{len} {msg}  {elapsed} (about {eta} left)";
        let bar = ProgressStyle::with_template(template).map_or(bar.clone(), |style| bar.with_style(style));
        // a single step may be the slow one
        bar.enable_steady_tick(Duration::from_millis(200));
        let weak = bar.downgrade();
        thread::spawn(move || {
            loop {
                thread::sleep(Duration::from_secs(10));
                let Some(bar) = weak.upgrade().filter(|bar| !bar.is_finished()) else { return };
                if bar.is_hidden() {
                    let (done, all) = (bar.position(), bar.length().unwrap_or_default());
                    eprintln!("{done} of {all} steps done, {} s: {}", bar.elapsed().as_secs(), bar.message());
                }
            }
        });
        Self(bar)
    }

    pub(super) fn step(&self, name: &str) {
        self.0.set_message(name.to_owned());
    }

    pub(super) fn done(&self) {
        self.0.inc(1);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
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

/// Refuses data sets of the same name.
pub(super) fn named_apart(datasets: &[Dataset]) -> Result<(), Failure> {
    let mut known: HashMap<&str, &Dataset> = HashMap::new();
    for one in datasets {
        if let Some(other) = known.insert(&one.name, one) {
            let (one, other, name) = (one.path.display(), other.path.display(), &one.name);
            refuse!(
                "{other} and {one} are both named \"{name}\", by which results are distinguished; expected different names"
            );
        }
    }
    Ok(())
}
