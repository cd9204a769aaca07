//! `caromfit schema`: what fit.json, compare.json and the JSON of other commands hold, as JSON Schema.

use clap::builder::PossibleValuesParser;

use super::{Failure, print};

/// Each command that prints JSON, with the schema of what it prints.
const SCHEMAS: [(&str, &str); 8] = [
    ("fit", include_str!("../guide/fit.schema.json")),
    ("compare", include_str!("../guide/compare.schema.json")),
    ("accuracy", include_str!("../guide/accuracy.schema.json")),
    ("check", include_str!("../guide/check.schema.json")),
    ("collide", include_str!("../guide/collide.schema.json")),
    ("design", include_str!("../guide/design.schema.json")),
    ("extract", include_str!("../guide/extract.schema.json")),
    ("synth", include_str!("../guide/synth.schema.json")),
];

/// Prints the JSON Schema (draft 2020-12) of what a command prints with --json. Of fit it describes fit.json, which is one element of the
/// array that fit --json prints; check and extract, and collide with --cases, print arrays of what their schemas describe, too. Of
/// compare and design it describes compare.json and design.json, which their --json prints.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit schema compare > compare.schema.json")]
pub struct Args {
    /// Of which command
    #[arg(value_parser = PossibleValuesParser::new(SCHEMAS.map(|(of, _)| of)), default_value = "fit")]
    of: String,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    // the parser lets no other name through
    let (_, schema) = SCHEMAS.into_iter().find(|(of, _)| *of == args.of).unwrap_or(SCHEMAS[0]);
    print(schema)
}
