//! `caromfit check`: what is wrong or suspicious, without fitting.

use std::path::PathBuf;

use caromfit::fit::check;
use caromfit::fit::with_impacts;
use caromfit::report::count_of;
use caromfit::report::document::{self, CheckDocument};

use super::progress::{self, Progress};
use super::{Failure, print, unless_none};

/// Loads data sets, finds the impacts of footage, and says everything that is wrong or suspicious, without fitting
/// and without writing anything. Exit status 2 if something is wrong, 1 if no shot of a data set can be used.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit check data/domenech-2023")]
pub struct Args {
    /// Folders that hold a dataset.toml, or such files
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Print what was found as a JSON array, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    let progress = Progress::over_shots(&datasets, 0);
    let (mut unusable, mut documents) = (Vec::new(), Vec::new());
    for dataset in datasets {
        progress.step(&dataset.name);
        let (dataset, _) = with_impacts(dataset, &|| progress.done());
        progress.done();
        let mut text = format!(
            "{}: {} can be used, {} left out\n",
            dataset.name,
            count_of(dataset.shots.len(), "shot"),
            dataset.left_out.len()
        );
        for note in dataset.notes() {
            text.push_str(&format!("  note: {note}\n"));
        }
        let left_out = dataset.left_out.iter().map(|(shot, reason)| (Some(shot.as_str()), reason.clone()));
        text.push_str(&said_once("left out", left_out));
        let found = check::check(&dataset);
        for (what, suspicious) in [("suspicious", true), ("note", false)] {
            let alike = found.iter().filter(|finding| finding.is_suspicious() == suspicious);
            let alike = alike.map(|finding| (finding.shot.as_deref(), finding.text.clone()));
            text.push_str(&said_once(what, alike));
        }
        if found.is_empty() && dataset.left_out.is_empty() {
            text.push_str("  nothing suspicious\n");
        }
        if args.json {
            documents.push(CheckDocument::new(&dataset, &found));
        } else {
            print(&text)?;
        }
        if dataset.shots.is_empty() {
            unusable.push(format!("{}: no shot can be used", dataset.name));
        }
    }
    progress.finish();
    if args.json {
        print(&document::text(&documents)?)?;
    }
    unless_none(&wrong, Failure::input)?;
    unless_none(&unusable, Failure::work)
}

/// Shots that are named of many with the same finding.
const NAMED: usize = 5;

/// A line for each different sentence, with the shots that it is about.
fn said_once<'a>(what: &str, found: impl Iterator<Item = (Option<&'a str>, String)>) -> String {
    let mut sentences: Vec<(String, Vec<&str>)> = Vec::new();
    for (shot, sentence) in found {
        match sentences.iter_mut().find(|(known, _)| *known == sentence) {
            Some((_, shots)) => shots.extend(shot),
            None => sentences.push((sentence, shot.into_iter().collect())),
        }
    }
    let line = |(sentence, shots): (String, Vec<&str>)| {
        let named = shots.iter().take(NAMED).copied().collect::<Vec<_>>().join(", ");
        let of = match shots.len() {
            0 => String::new(),
            1 => format!("shot {named}: "),
            count if count > NAMED => format!("shots {named} and {} more: ", count - NAMED),
            _ => format!("shots {named}: "),
        };
        format!("  {what}: {of}{sentence}\n")
    };
    sentences.into_iter().map(line).collect()
}
