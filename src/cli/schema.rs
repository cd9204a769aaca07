//! `caromfit schema`: what fit.json, compare.json and the JSON of other commands hold, as JSON Schema.

use super::{Failure, print};

/// Prints the JSON Schema (draft 2020-12) of fit.json or compare.json, or of what `accuracy --json` or `synth --json` prints.
/// `fit --json` prints an array of the first.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit schema compare > compare.schema.json")]
pub struct Args {
    /// Of which command
    #[arg(value_parser = ["fit", "compare", "accuracy", "synth"], default_value = "fit")]
    of: String,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    print(match args.of.as_str() {
        "compare" => include_str!("../guide/compare.schema.json"),
        "accuracy" => include_str!("../guide/accuracy.schema.json"),
        "synth" => include_str!("../guide/synth.schema.json"),
        _ => include_str!("../guide/fit.schema.json"),
    })
}
