//! `caromfit compare`: is the difference real?

use std::path::PathBuf;

use caromfit::collision::Fidelity;
use caromfit::compare::{self, Options, Quantity};
use caromfit::footage::with_impacts;
use caromfit::report::{compare as report, write};

use super::progress::{self, Progress};
use super::{Failure, FidelityArg, print};

/// One joint fit of several data sets, or of the labels of one whose [fit] by names a column: which parameters differ,
/// by how much, how surely. Where the data sets have different cloth labels, μ and e are shared and μ_s and μ_k differ by
/// cloth; else μ differs by data set and the rest is shared. Writes OUT/{compare.json, forest.svg, forest.png,
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
    /// How closely the collision is modelled
    #[arg(long, value_enum, default_value = "full")]
    fidelity: FidelityArg,
    /// Print compare.json, and nothing else, on standard output
    #[arg(long)]
    json: bool,
}

fn quantity(name: &str) -> Result<Quantity, String> {
    let found = Quantity::ALL.into_iter().find(|quantity| quantity.name() == name);
    found.ok_or_else(|| format!("expected one of {}", Quantity::ALL.map(Quantity::name).join(", ")))
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    if !wrong.is_empty() {
        let wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
        return Err(Failure::input(wrong.join("\nerror: ")));
    }
    let progress = Progress::over_shots(&datasets, 0);
    let mut extracted = Vec::new();
    for dataset in datasets {
        progress.step(&dataset.name);
        extracted.push(with_impacts(dataset, &|| progress.done()).0);
        progress.done();
    }
    let options = Options {
        fidelity: args.fidelity.0.unwrap_or(Fidelity::Full),
        share: args.share.clone(),
        per_dataset: args.per_dataset.clone(),
    };
    let comparison = compare::compare(&extracted, &options);
    progress.finish();
    let comparison = comparison.map_err(|error| match error {
        compare::CompareError::Optimise(_) | compare::CompareError::NoWeights => Failure::work(error),
        _ => Failure::input(error),
    })?;
    let files = report::files(&comparison).map_err(Failure::work)?;
    write::write_files(&files, &args.out).map_err(Failure::work)?;
    if args.json {
        print(&report::json(&comparison).map_err(Failure::work)?)
    } else {
        print(&report::table(&comparison))?;
        print(&format!("\nSee {}\n", args.out.join("report.html").display()))
    }
}
