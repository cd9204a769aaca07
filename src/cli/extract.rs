//! `caromfit extract`: tracks to impacts.

use std::path::PathBuf;

use crate::fit::analysis::with_impacts;
use crate::fit::{ExtractedDiscs, extract_discs};
use crate::report::document::ExtractDocument;
use crate::report::extracted;
use crate::report::templates;
use crate::report::write::dataset_folder;

use super::progress::{self, Progress};
use super::{Failure, answer, unless_none};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit extract my-shots --out extracted")]
pub(super) struct Args {
    /// Folders that hold a dataset.toml of kind "tracks", or such files
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Where the results go, one folder per data set
    #[arg(long, default_value = "extracted", value_name = "DIR")]
    out: PathBuf,
    /// Do not draw the shots
    #[arg(long)]
    no_pictures: bool,
    /// Print only what was extracted as a JSON array, on standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    let mut wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
    wrong.extend(datasets.iter().filter(|dataset| dataset.tracks.is_none()).map(|dataset| {
        format!("{}: its kind is not \"tracks\": it holds no tracks", dataset.path.display())
    }));
    unless_none(&wrong, 2)?;
    let progress = Progress::new(datasets.len());
    let (mut empty, mut documents) = (Vec::new(), Vec::new());
    for dataset in datasets {
        progress.step(&dataset.name);
        let folder = args.out.join(dataset_folder(&dataset.name));
        // without a shot that can be used nothing is written
        let (dataset, shots, lines) =
            if let Some(facts) = dataset.tracks.as_ref().and_then(|tracks| tracks.discs) {
                let ExtractedDiscs { dataset, shots, .. } = extract_discs(dataset);
                if !shots.is_empty() {
                    extracted::write_discs(&dataset, &shots, &facts, !args.no_pictures, &folder)?;
                }
                (dataset, shots.len(), extracted::lines(&shots))
            } else {
                let (dataset, film) = with_impacts(dataset);
                let shots = film.as_ref().map_or(0, |film| film.impacts.len());
                if let Some(film) = film.filter(|_| shots > 0) {
                    extracted::write_balls(&dataset, &film, !args.no_pictures, &folder)?;
                }
                (dataset, shots, Vec::new())
            };
        progress.done();
        let notes = dataset.tracks.iter().flat_map(|tracks| &tracks.notes).cloned().chain(lines);
        let document = ExtractDocument::new(&dataset, &folder, shots, notes.collect());
        if shots == 0 {
            let reason = document.left_out.first();
            let reason = reason.map_or(String::new(), |one| format!(": shot {}: {}", one.shot, one.reason));
            empty.push(format!("{}: no shot can be used{reason}", dataset.name));
            continue;
        }
        documents.push(document);
    }
    drop(progress);
    answer(args.json, &documents, || templates::text_of(include_str!("extract.jinja"), &documents))?;
    unless_none(&empty, 1)
}
