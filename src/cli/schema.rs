//! `caromfit schema`: what fit.json and compare.json hold, as JSON Schema.

use super::{Failure, print};

/// Prints the JSON Schema (draft 2020-12) of fit.json or compare.json. `fit --json` prints an array of the first.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit schema compare > compare.schema.json")]
pub struct Args {
    /// Of which file
    #[arg(value_parser = ["fit", "compare"], default_value = "fit")]
    of: String,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    print(if args.of == "compare" {
        include_str!("../guide/compare.schema.json")
    } else {
        include_str!("../guide/fit.schema.json")
    })
}
