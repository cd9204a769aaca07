//! `caromfit schema`: what fit.json, compare.json and the JSON of other commands hold, as JSON Schema.

use caromfit::report::document::{self, SCHEMAS};
use clap::builder::PossibleValuesParser;

use super::{Failure, print};

/// Prints the JSON Schema (draft 2020-12) of what a command prints with --json. Of fit it describes fit.json, which is one element of the
/// array that fit --json prints; check and extract, and collide with --cases, print arrays of what their schemas describe, too. Of
/// compare and design it describes compare.json and design.json, which their --json prints.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit schema compare > compare.schema.json")]
pub struct Args {
    /// Of which command
    #[arg(value_parser = PossibleValuesParser::new(SCHEMAS.map(|(command, _)| command)), default_value = "fit")]
    command: String,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    // the parser lets no other name through
    let (_, schema) = SCHEMAS.into_iter().find(|(command, _)| *command == args.command).unwrap_or(SCHEMAS[0]);
    print(&document::text(&schema())?)
}
