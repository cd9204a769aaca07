//! `caromfit compare`: is the difference real?

use std::cell::Cell;
use std::path::PathBuf;

use crate::compare::{self, Options, Quantity};
use crate::measurement::loss::Loss;
use crate::report::compare as report;
use crate::report::document::CompareDocument;

use super::progress::{self, Progress};
use super::{Failure, answer, unless_none};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit compare data/synthetic-cloth-a data/synthetic-cloth-b")]
pub(super) struct Args {
    /// Folders that hold a dataset.toml, or such files
    #[arg(required = true, value_name = "DATASET")]
    datasets: Vec<PathBuf>,
    /// Where the results go
    #[arg(long, default_value = "fits/compare", value_name = "DIR")]
    out: PathBuf,
    /// Parameters with one value for all: mu, mu_s, e, mu_k; mu_b and mu_c of a friction that
    /// decreases, kappa, e_slope
    #[arg(long, value_delimiter = ',', value_name = "PARAMETERS")]
    share: Vec<Quantity>,
    /// Parameters with a value for each label
    #[arg(long, value_delimiter = ',', value_name = "PARAMETERS")]
    per_dataset: Vec<Quantity>,
    /// Collision model; auto is full, with a compliant contact and the balls' weight if the data
    /// show them
    #[arg(long, value_parser = super::fidelity(), default_value = "auto")]
    fidelity: super::Chosen,
    /// How outlying shots count, instead of what the data sets state
    #[arg(long, value_parser = super::named(Loss::ALL, Loss::name))]
    loss: Option<Loss>,
    /// Print only compare.json, on standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let (datasets, wrong) = progress::load(&args.datasets);
    unless_none(&wrong, 2)?;
    progress::named_apart(&datasets)?;
    let progress = Progress::new(compare::STAGES);
    let options = Options {
        fidelity: args.fidelity.0,
        loss: args.loss,
        share: args.share.clone(),
        per_dataset: args.per_dataset.clone(),
    };
    let begun = Cell::new(false);
    let stage = |stage: &str| {
        if begun.replace(true) {
            progress.done();
        }
        progress.step(stage);
    };
    let comparison = compare::compare_watched(&datasets, &options, &stage);
    drop(progress);
    let comparison = comparison?;
    report::write(&comparison, &args.out)?;
    let see = args.out.join("report.html");
    let text = || format!("{}\nSee {}\n", report::table(&comparison), see.display());
    answer(args.json, &CompareDocument::new(&comparison), text)
}
