//! `caromfit compare`: is the difference real?

use std::cell::Cell;
use std::path::PathBuf;

use caromfit::compare;
use caromfit::compare::{Options, Quantity};
use caromfit::fit::footage;
use caromfit::fit::footage::with_impacts;
use caromfit::measurement::loss::Loss;
use caromfit::physics::collision::Fidelity;
use caromfit::report::{compare as report, write};

use super::progress;
use super::progress::Progress;
use super::{Failure, FidelityArg, print};

/// One joint fit of several data sets, or of the labels of one whose [fit] by names a column: which parameters differ,
/// by how much, how surely. Where the data sets have different cloth labels, μ and e are shared and μ_s and μ_k differ by
/// cloth; else μ differs by data set and the rest is shared. Bounds, priors, constraints and losses are those of each data
/// set's [fit]. Footage is compared by the velocities extracted from it (two-stage), not by all frames at once. Writes OUT/{compare.json, forest.svg, forest.png,
/// residuals.svg, residuals.png, report.html}.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit compare data/synthetic-cloth-a data/synthetic-cloth-b")]
pub struct Args {
    /// Folders that hold a dataset.toml, or such files
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Where the results go
    #[arg(long, default_value = "fits/compare", value_name = "DIR")]
    out: PathBuf,
    /// Parameters with one value for all: mu, mu_s, e, mu_k
    #[arg(long, value_delimiter = ',', value_parser = quantity, value_name = "PARAMETERS")]
    share: Vec<Quantity>,
    /// Parameters with a value for each label
    #[arg(long, value_delimiter = ',', value_parser = quantity, value_name = "PARAMETERS")]
    per_dataset: Vec<Quantity>,
    /// How closely the collision is modelled; auto takes for each shot the cheapest that leaves out less than a tenth of
    /// its standard errors, as all data sets together tell
    #[arg(long, value_enum, default_value = "auto")]
    fidelity: FidelityArg,
    /// How outlying shots count, in the place of what the data sets say
    #[arg(long, value_parser = super::loss())]
    loss: Option<Loss>,
    /// Print compare.json, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

fn quantity(name: &str) -> Result<Quantity, String> {
    let found = Quantity::ALL.into_iter().find(|quantity| quantity.name() == name);
    found.ok_or_else(|| format!("expected one of {}", Quantity::ALL.map(Quantity::name).join(", ")))
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let datasets = progress::load_all(&args.datasets)?;
    let progress = Progress::over_shots(&datasets, 0);
    progress.expect(compare::STAGES);
    let (mut datasets_of_impacts, mut filmed, mut from_paths) = (Vec::new(), Vec::new(), Vec::new());
    for dataset in datasets {
        progress.step(&dataset.name);
        let (dataset, extracted, scene) =
            with_impacts(caromfit::fit::calibrated(dataset).0, &|| progress.done());
        if footage::finds_spins_from_paths(&extracted, &scene) {
            from_paths.push(dataset.name.clone());
        }
        datasets_of_impacts.push(dataset);
        filmed.push((extracted, scene));
        progress.done();
    }
    let options = Options {
        fidelity: args.fidelity.0.unwrap_or(Fidelity::Full),
        auto: args.fidelity.0.is_none(),
        loss: args.loss,
        share: args.share.clone(),
        per_dataset: args.per_dataset.clone(),
    };
    let begun = Cell::new(false);
    let comparison = compare::compare_watched(&datasets_of_impacts, &options, &|stage| {
        if begun.replace(true) {
            progress.done();
        }
        progress.step(stage);
    });
    progress.finish();
    let mut comparison = comparison.map_err(|error| match error {
        compare::CompareError::Optimise(_) | compare::CompareError::NoWeights => Failure::work(error),
        _ => Failure::input(error),
    })?;
    if !from_paths.is_empty() {
        comparison.warn_of_spins_from_paths(&from_paths);
    }
    let pictures = report::pictures(&comparison, &filmed).map_err(Failure::work)?;
    let files = report::files(&comparison, &pictures).map_err(Failure::work)?;
    write::write_files(&files, &args.out).map_err(Failure::work)?;
    if args.json {
        print(&report::json(&comparison).map_err(Failure::work)?)
    } else {
        print(&report::table(&comparison))?;
        print(&format!("\nSee {}\n", args.out.join("report.html").display()))
    }
}
