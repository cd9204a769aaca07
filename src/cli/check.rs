//! `caromfit check`: what is wrong or suspicious, without fitting.

use std::path::PathBuf;

use crate::fit::analysis::with_impacts;
use crate::fit::{check, doubts};
use crate::report::document::CheckDocument;
use crate::report::templates;

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
    let progress = Progress::new(datasets.len());
    let mut documents = Vec::new();
    for dataset in datasets {
        progress.step(&dataset.name);
        let (dataset, film) = with_impacts(dataset);
        progress.done();
        let mut findings = film.as_ref().map(doubts::of_film).unwrap_or_default();
        findings.extend(check::check(&dataset));
        documents.push(CheckDocument::new(&dataset, &findings));
    }
    drop(progress);
    answer(args.json, &documents, || templates::text_of(include_str!("check.jinja"), &documents))?;
    unless_none(&wrong, 2)?;
    let unusable = documents.iter().filter(|checked| checked.shots == 0);
    let unusable: Vec<String> =
        unusable.map(|checked| format!("{}: no shot can be used", checked.dataset)).collect();
    unless_none(&unusable, 1)
}
