//! `caromfit check`: what is wrong or suspicious, without fitting.

use std::path::PathBuf;

use crate::fit::check::{self, Finding};
use crate::fit::with_impacts;
use crate::measurement::dataset::Dataset;
use crate::report::count_of;
use crate::report::document::CheckDocument;
use indexmap::IndexMap;

use super::progress::{self, Progress};
use super::{Failure, answer, unless_none};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit check data/domenech-2023")]
pub(super) struct Args {
    /// Folders that hold a dataset.toml, or such files
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Print only what was found as a JSON array, on standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    let progress = Progress::over_shots(&datasets, 0);
    let (mut unusable, mut documents, mut texts) = (Vec::new(), Vec::new(), String::new());
    for dataset in datasets {
        progress.step(&dataset.name);
        let (dataset, _) = with_impacts(dataset, &|| progress.done());
        progress.done();
        let found = check::check(&dataset);
        texts += &text(&dataset, &found);
        documents.push(CheckDocument::new(&dataset, &found));
        if dataset.count_usable() == 0 {
            unusable.push(format!("{}: no shot can be used", dataset.name));
        }
    }
    drop(progress);
    answer(args.json, &documents, || texts)?;
    unless_none(&wrong, 2)?;
    unless_none(&unusable, 1)
}

fn text(dataset: &Dataset, found: &[Finding]) -> String {
    let usable = count_of(dataset.count_usable(), "shot");
    let mut text = format!("{}: {usable} can be used, {} left out\n", dataset.name, dataset.left_out.len());
    text.extend(dataset.notes().map(|note| format!("  note: {note}\n")));
    let left_out = dataset.left_out.iter().map(|(shot, reason)| (Some(shot.as_str()), reason.as_str()));
    text += &said_once("left out", left_out);
    for (what, is_suspicious) in [("suspicious", true), ("note", false)] {
        let own = found.iter().filter(|finding| finding.is_suspicious() == is_suspicious);
        text += &said_once(what, own.map(|finding| (finding.shot.as_deref(), finding.text.as_str())));
    }
    if found.is_empty() && dataset.left_out.is_empty() {
        text += "  nothing suspicious\n";
    }
    text
}

/// Returns a line for each different sentence, with the first five shots that it is about.
fn said_once<'a>(what: &str, found: impl Iterator<Item = (Option<&'a str>, &'a str)>) -> String {
    let mut sentences: IndexMap<&str, Vec<&str>> = IndexMap::new();
    for (shot, sentence) in found {
        sentences.entry(sentence).or_default().extend(shot);
    }
    let line = |(sentence, shots): (&str, Vec<&str>)| {
        let named = shots.iter().take(5).copied().collect::<Vec<_>>().join(", ");
        let of = match shots.len() {
            0 => String::new(),
            1..=5 => format!("shot {named}: "),
            count => format!("shots {named} and {} more: ", count - 5),
        };
        format!("  {what}: {of}{sentence}\n")
    };
    sentences.into_iter().map(line).collect()
}
