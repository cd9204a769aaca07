//! `caromfit accuracy`: what accuracy costs in time.

use std::path::PathBuf;

use crate::fit::analysis::with_impacts;
use crate::io;
use crate::physics::collision::{MAX_KAPPA, Model};
use crate::report::document::AccuracyDocument;
use crate::report::templates;
use crate::report::write::write_accuracy;
use crate::studies::accuracy;
use crate::studies::bias;

use super::progress::Progress;
use super::{Failure, answer};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit accuracy --dataset data/mathavan-2014 --out accuracy")]
pub(super) struct Args {
    /// Take the shots of this data set, at the initial values of its parameters
    #[arg(long, value_name = "DATASET")]
    dataset: Option<PathBuf>,
    /// Where the results go
    #[arg(long, default_value = "fits/accuracy", value_name = "DIR")]
    out: PathBuf,
    /// How many shots, without a data set
    #[arg(long, default_value_t = 200, value_name = "N", value_parser = clap::value_parser!(u32).range(1..100_000))]
    shots: u32,
    /// Of the shots
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Tangential compliance κ of the contact between the balls, above 0
    #[arg(long, default_value_t = Model::KAPPA, value_name = "K")]
    kappa: f64,
    /// Print only both tables as JSON, on standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    if !(args.kappa > 0.0 && args.kappa <= MAX_KAPPA) {
        refuse!("--kappa is {}; expected more than 0 to {MAX_KAPPA}", args.kappa);
    }
    let dataset = match &args.dataset {
        Some(path) => with_impacts(io::load(path)?).0,
        None => accuracy::dataset(args.shots, args.seed)?,
    };
    let shots = accuracy::cue_balls(&dataset);
    if shots.is_empty() {
        return Err(Failure { status: 1, message: format!("{}: no shot can be used", dataset.name) });
    }
    let left_out = dataset.shots.len() - shots.len() + dataset.left_out.len();
    let progress = Progress::new(1 + bias::FITTED.len());
    progress.step("errors and times");
    let ways = accuracy::study(&dataset, &shots, args.kappa)?;
    progress.done();
    let data = bias::noise_free(&dataset, args.kappa);
    let mut biases = Vec::new();
    for way in bias::FITTED {
        progress.step(&format!("fitting with {}", way.name));
        biases.push(bias::bias(&data, way)?);
        progress.done();
    }
    drop(progress);
    write_accuracy(&ways, &args.out)?;
    let document = AccuracyDocument::new(&ways, &biases, shots.len(), left_out);
    let left_out = if left_out > 0 { format!(", {left_out} left out") } else { String::new() };
    let text = || {
        format!(
            "{} shots{left_out}\n{}",
            shots.len(),
            templates::text_of(include_str!("accuracy.jinja"), &document)
        )
    };
    answer(args.json, &document, text)
}
