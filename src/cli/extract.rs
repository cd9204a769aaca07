//! `caromfit extract`: tracks to impacts.

use std::path::PathBuf;

use crate::fit::{ExtractedDiscs, FittedFilm, extract_discs, with_impacts};
use crate::report::count_of;
use crate::report::document::{self, ExtractDocument};
use crate::report::extracted;
use crate::report::write::dataset_folder;

use super::progress::{self, Progress};
use super::{Failure, print, unless_none};

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
    /// Print what was extracted as a JSON array, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    let mut wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
    wrong.extend(datasets.iter().filter(|dataset| dataset.tracks.is_none()).map(|dataset| {
        format!("{}: its kind is not \"tracks\": there is nothing to extract", dataset.path.display())
    }));
    unless_none(&wrong, 2)?;
    let progress = Progress::over_shots(&datasets, 0);
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
                let (dataset, film) = with_impacts(dataset, &|| progress.done());
                let shots = film.as_ref().map_or_else(Vec::new, FittedFilm::impacts);
                if !shots.is_empty() {
                    let drawn = film.as_ref().filter(|_| !args.no_pictures);
                    extracted::write_balls(&dataset, &shots, drawn, &folder)?;
                }
                (dataset, shots.len(), Vec::new())
            };
        let notes = dataset.tracks.iter().flat_map(|tracks| &tracks.notes).cloned().chain(lines);
        let notes: Vec<String> = notes.collect();
        progress.done();
        let left_out: Vec<String> =
            dataset.left_out.iter().map(|(shot, why)| format!("shot {shot}: {why}")).collect();
        if shots == 0 {
            let reason = left_out.first().map_or(String::new(), |first| format!(": {first}"));
            empty.push(format!("{}: no shot can be used{reason}", dataset.name));
        } else if args.json {
            documents.push(ExtractDocument::new(&dataset, &folder, shots, notes));
        } else {
            let (name, shots, count) = (&dataset.name, count_of(shots, "shot"), left_out.len());
            print(&format!("{name}: {shots} extracted, {count} left out; see {}\n", folder.display()))?;
            let left_out = left_out.iter().map(|line| format!("left out: {line}"));
            print(&notes.into_iter().chain(left_out).map(|line| format!("  {line}\n")).collect::<String>())?;
        }
    }
    drop(progress);
    if args.json {
        print(&document::text(&documents)?)?;
    }
    unless_none(&empty, 1)
}
