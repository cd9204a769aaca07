//! `caromfit extract`: tracks to impacts.

use std::path::PathBuf;

use caromfit::footage::with_impacts;
use caromfit::report::{extracted, write};

use super::progress::{self, Progress};
use super::{Failure, print};

/// Finds the impact of every shot and writes OUT/NAME/: a data set of kind "impacts" with uncertainties
/// (dataset.toml, impacts.csv), what was left out and why (left-out.csv), and a picture of each shot (shots/).
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit extract my-shots --out extracted")]
pub struct Args {
    /// Folders that hold a dataset.toml of kind "tracks", or such files
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Where the results go, one folder per data set
    #[arg(long, default_value = "extracted", value_name = "DIR")]
    out: PathBuf,
    /// Do not draw the shots
    #[arg(long)]
    no_pictures: bool,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    let mut wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
    for dataset in datasets.iter().filter(|dataset| dataset.tracks.is_none()) {
        let path = dataset.path.display();
        wrong.push(format!("{path}: its kind is not \"tracks\": there is nothing to extract"));
    }
    if !wrong.is_empty() {
        return Err(Failure::input(wrong.join("\nerror: ")));
    }
    let progress = Progress::over_shots(&datasets);
    let mut empty = Vec::new();
    for dataset in datasets {
        progress.step(&dataset.name);
        let (dataset, shots, scene) = with_impacts(dataset, &|| progress.done());
        let folder = args.out.join(write::dataset_folder(&dataset.name));
        if shots.is_empty() {
            let reason =
                dataset.left_out.first().map_or(String::new(), |(shot, why)| format!(": shot {shot}: {why}"));
            empty.push(format!("{}: no shot can be used{reason}", dataset.name));
            progress.done();
            continue;
        }
        if !args.no_pictures {
            let pictures = extracted::pictures(&shots, &scene).map_err(Failure::work)?;
            let named: Vec<_> = pictures.iter().map(|(name, svg)| (name.as_str(), svg.clone())).collect();
            write::write_files(&named, &folder.join("shots")).map_err(Failure::work)?;
        }
        write::write_files(&extracted::files(&dataset, &shots), &folder).map_err(Failure::work)?;
        progress.done();
        print(&format!(
            "{}: {} shots extracted, {} left out; see {}\n",
            dataset.name,
            shots.len(),
            dataset.left_out.len(),
            folder.display()
        ))?;
        for note in dataset.tracks.iter().flat_map(|tracks| &tracks.notes) {
            print(&format!("  {note}\n"))?;
        }
        for (shot, reason) in &dataset.left_out {
            print(&format!("  left out: shot {shot}: {reason}\n"))?;
        }
    }
    progress.finish();
    if empty.is_empty() { Ok(()) } else { Err(Failure::work(empty.join("\nerror: "))) }
}
