//! `caromfit extract`: tracks to impacts.

use std::path::{Path, PathBuf};

use caromfit::fit::{ExtractedDiscs, FittedFilm, extract_discs, with_impacts};
use caromfit::measurement::dataset::Dataset;
use caromfit::measurement::track::TrackShot;
use caromfit::report::count_of;
use caromfit::report::document::{self, ExtractDocument};
use caromfit::report::{ReportError, extracted, write};

use super::progress::{self, Progress};
use super::{Failure, print, unless_none};

/// Finds the impact of every shot and writes OUT/NAME/: a data set of kind "impacts" with uncertainties
/// (dataset.toml, impacts.csv), what was left out and why (left-out.csv), and a picture of each shot (shots/).
/// Where [ball] shape is "disc": discs.csv with e, the impulse ratio and the motion of both discs.
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
    /// Print what was extracted as a JSON array, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    let mut wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
    wrong.extend(datasets.iter().filter(|dataset| dataset.tracks.is_none()).map(|dataset| {
        format!("{}: its kind is not \"tracks\": there is nothing to extract", dataset.path.display())
    }));
    unless_none(&wrong, Failure::input)?;
    let progress = Progress::over_shots(&datasets, 0);
    let mut empty = Vec::new();
    let mut documents = Vec::new();
    for dataset in datasets {
        progress.step(&dataset.name);
        let folder = args.out.join(write::dataset_folder(&dataset.name));
        let done = extract(dataset, &folder, !args.no_pictures, &progress)?;
        progress.done();
        let Done { dataset, shots, lines } = done;
        if shots == 0 {
            let reason =
                dataset.left_out.first().map_or(String::new(), |(shot, why)| format!(": shot {shot}: {why}"));
            empty.push(format!("{}: no shot can be used{reason}", dataset.name));
            continue;
        }
        if args.json {
            documents.push(ExtractDocument::new(&dataset, &folder, shots, lines));
            continue;
        }
        print(&format!(
            "{}: {} extracted, {} left out; see {}\n",
            dataset.name,
            count_of(shots, "shot"),
            dataset.left_out.len(),
            folder.display()
        ))?;
        let left_out = dataset.left_out.iter().map(|(shot, why)| format!("left out: shot {shot}: {why}"));
        for line in lines.into_iter().chain(left_out) {
            print(&format!("  {line}\n"))?;
        }
    }
    drop(progress);
    if args.json {
        print(&document::text(&documents)?)?;
    }
    unless_none(&empty, Failure::work)
}

/// What was extracted of a data set.
struct Done {
    dataset: Dataset,
    /// How many shots can be used; without any nothing is written.
    shots: usize,
    /// Notes on the data set and its shots.
    lines: Vec<String>,
}

fn extract(
    dataset: Dataset,
    folder: &Path,
    pictures: bool,
    progress: &Progress,
) -> Result<Done, ReportError> {
    let notes =
        |dataset: &Dataset| dataset.tracks.as_ref().map_or_else(Vec::new, |tracks| tracks.notes.clone());
    let save = |drawn: Option<Vec<(String, Vec<u8>)>>, files: &[(String, Vec<u8>)]| {
        if let Some(drawn) = drawn {
            write::write_files(&drawn, &folder.join("shots"))?;
        }
        write::write_files(files, folder)
    };
    if let Some(facts) = dataset.tracks.as_ref().and_then(|tracks| tracks.discs) {
        let ExtractedDiscs { dataset, shots, .. } = extract_discs(dataset);
        if !shots.is_empty() {
            let drawn = pictures.then(|| extracted::pictures_of_discs(&facts, &shots)).transpose()?;
            save(drawn, &extracted::of_disc_shots(&dataset, &facts, &shots))?;
        }
        let mut lines = notes(&dataset);
        for (TrackShot { name, .. }, impact) in &shots {
            lines.push(format!("shot {name}: {}", extracted::summary(impact)));
            lines.extend(extracted::remarks(impact).iter().map(|remark| format!("shot {name}: {remark}")));
        }
        return Ok(Done { dataset, shots: shots.len(), lines });
    }
    let (dataset, film) = with_impacts(dataset, &|| progress.done());
    let shots = film.as_ref().map_or_else(Vec::new, FittedFilm::impacts);
    if let Some(film) = film.filter(|_| !shots.is_empty()) {
        let drawn = pictures.then(|| extracted::pictures(&film, &shots)).transpose()?;
        save(drawn, &extracted::of_balls(&dataset, &shots))?;
    }
    let lines = notes(&dataset);
    Ok(Done { dataset, shots: shots.len(), lines })
}
