//! `caromfit check`: what is wrong or suspicious, without fitting.

use std::path::PathBuf;

use caromfit::check;
use caromfit::footage::with_impacts;

use super::progress::{self, Progress};
use super::{Failure, print};

/// Loads data sets, finds the impacts of footage, and says everything that is wrong or suspicious, without fitting
/// and without writing anything. Exit status 2 if something is wrong, 1 if no shot of a data set can be used.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit check data/domenech-2023")]
pub struct Args {
    /// Folders that hold a dataset.toml, or such files
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    let progress = Progress::over_shots(&datasets, 0);
    let mut unusable = Vec::new();
    for dataset in datasets {
        progress.step(&dataset.name);
        let (dataset, ..) = with_impacts(dataset, &|| progress.done());
        progress.done();
        let mut text = format!(
            "{}: {} shot(s) can be used, {} left out\n",
            dataset.name,
            dataset.shots.len(),
            dataset.left_out.len()
        );
        for note in dataset.tracks.iter().flat_map(|tracks| &tracks.notes) {
            text.push_str(&format!("  note: {note}\n"));
        }
        for (shot, reason) in &dataset.left_out {
            text.push_str(&format!("  left out: shot {shot}: {reason}\n"));
        }
        let found = check::check(&dataset);
        for finding in &found {
            let shot = finding.shot.as_ref().map_or(String::new(), |shot| format!("shot {shot}: "));
            let what = if finding.is_suspicious() { "suspicious" } else { "note" };
            text.push_str(&format!("  {what}: {shot}{}\n", finding.text));
        }
        if found.is_empty() && dataset.left_out.is_empty() {
            text.push_str("  nothing suspicious\n");
        }
        print(&text)?;
        if dataset.shots.is_empty() {
            unusable.push(format!("{}: no shot can be used", dataset.name));
        }
    }
    progress.finish();
    if !wrong.is_empty() {
        let wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
        return Err(Failure::input(wrong.join("\nerror: ")));
    }
    if unusable.is_empty() { Ok(()) } else { Err(Failure::work(unusable.join("\nerror: "))) }
}
