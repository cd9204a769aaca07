//! Arguments in, library calls, results out. Exit status: 0 done; 1 understood but could not be
//! done; 2 bad usage or bad input.

#![allow(clippy::print_stderr)]

/// Returns bad input with this message.
macro_rules! refuse {
    ($($message:tt)*) => {
        return Err($crate::cli::Failure { status: 2, message: format!($($message)*) })
    };
}

mod accuracy;
mod check;
mod collide;
mod compare;
mod design;
mod example;
mod export;
mod extract;
mod fit;
mod help;
mod init;
mod progress;
mod synth;
mod table_only;

use std::error::Error;
use std::io::{ErrorKind, Write};
use std::process::ExitCode;

use crate::compare::CompareError;
use crate::fit::FitError;
use crate::physics::collision::{Fidelity, NotACollision, TOLERANCES};
use crate::report::{ReportError, document};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Parser, Subcommand};
use serde::Serialize;

/// From footage of billiard-ball collisions to the friction between the balls μ, the friction of
/// the cloth on the object ball μ_s, and the restitution e.
#[derive(Parser)]
#[command(
    name = "caromfit",
    version,
    about,
    max_term_width = 100,
    disable_help_subcommand = true,
    after_help = format!(
        "Example: caromfit example demo && caromfit fit demo/balls\n\n{}\n\
         Exit status: 0 done; 1 understood, but it could not be done; 2 bad usage or bad input.",
        help::topics()
    )
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// Defines the commands, each with its arguments and the function that runs it.
macro_rules! commands {
    ($($(#[$about:meta])* $name:ident($args:ty) => $run:path,)+) => {
        #[derive(Subcommand)]
        enum Command { $($(#[$about])* $name($args)),+ }

        impl Command {
            fn run(&self) -> Result<(), Failure> {
                match self { $(Self::$name(args) => $run(args)),+ }
            }
        }
    };
}

commands! {
    /// Fit μ, μ_s and e to data sets; writes fits/NAME/ and prints a table
    Fit(fit::Args) => fit::run,
    /// Which parameters differ between cloths or balls, by how much, with which significance
    Compare(compare::Args) => compare::run,
    /// Compute one collision, or a file of them
    Collide(collide::Args) => collide::run,
    /// Find the impacts in tracks; writes OUT/NAME/ with velocities, uncertainties and pictures
    Extract(extract::Args) => extract::run,
    /// What accuracy costs in time: error against time of every fidelity
    Accuracy(accuracy::Args) => accuracy::run,
    /// Which shots to film: standard errors before they are played, and how many shots are needed
    Design(design::Args) => design::run,
    /// Make a synthetic data set from known parameters and noise
    Synth(synth::Args) => synth::run,
    /// Write a dataset.toml for CSV files, with blanks for what they do not show
    Init(init::Args) => init::run,
    /// Say everything that is wrong or suspicious about data sets, without fitting
    Check(check::Args) => check::run,
    /// Print fitted parameters for the simulator pooltool
    Export(export::Args) => export::run,
    /// Copy a small complete example to try everything on
    Example(example::Args) => example::run,
    /// Print the JSON Schema of fit.json, compare.json, and what other commands print with --json
    Schema(help::Schema) => help::schema,
    /// Print completions for a shell
    Completions(help::Completions) => help::completions,
    /// Print the help of a command, or a page of the guide
    Help(help::Args) => help::run,
}

/// Why a command ended without its result: the exit status, and what went wrong.
struct Failure {
    status: u8,
    message: String,
}

/// Errors of work that was understood have status 1, all others are bad input.
impl<E: Error + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        let known: &(dyn Error + 'static) = &error;
        let is_of_work = known.is::<ReportError>()
            || matches!(known.downcast_ref(), Some(NotACollision::NotIntegrated { .. }))
            || known.is::<std::io::Error>()
            || known.downcast_ref::<CompareError>().is_some_and(|error| !error.is_bad_input())
            || known.downcast_ref::<FitError>().is_some_and(|error| !error.is_bad_input());
        Self { status: if is_of_work { 1 } else { 2 }, message: error.to_string() }
    }
}

/// Returns a failure that names everything that went wrong, if anything did.
fn unless_none(wrong: &[impl ToString], status: u8) -> Result<(), Failure> {
    let wrong: Vec<String> = wrong.iter().map(ToString::to_string).collect();
    let message = wrong.join("\nerror: ");
    if wrong.is_empty() { Ok(()) } else { Err(Failure { status, message }) }
}

/// A fidelity that is stated; `None` of auto.
#[derive(Clone, Copy)]
struct Chosen(Option<Fidelity>);

/// Returns a parser of collision models, or auto, by name.
fn fidelity() -> impl TypedValueParser<Value = Chosen> {
    let about =
        "the cheapest that suffices: within --tolerance (collide), or as the data show (fit, compare)";
    let auto = PossibleValue::new("auto").help(about);
    let one = |fidelity: Fidelity| PossibleValue::new(fidelity.name()).help(fidelity.meaning());
    let names = PossibleValuesParser::new(Fidelity::ALL.into_iter().map(one).chain([auto]));
    names.map(|name| Chosen(name.parse().ok()))
}

fn tolerance(text: &str) -> Result<f64, String> {
    let valid = Some(number(text)?).filter(|value| TOLERANCES.contains(value));
    valid.ok_or_else(|| format!("expected {:e} to {:e}", TOLERANCES.start(), TOLERANCES.end()))
}

fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| format!("\"{text}\" is not a number"))
}

/// Returns numbers with commas between.
fn numbers<const N: usize>(text: &str, expected: &str) -> Result<[f64; N], String> {
    let numbers = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    numbers.try_into().map_err(|numbers: Vec<f64>| format!("{} numbers; expected {expected}", numbers.len()))
}

/// Returns a parser of values by their names, which completions offer.
fn named<T: Copy + Send + Sync + 'static, const N: usize>(
    all: [T; N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(all.map(name));
    // the parser lets no other name through
    names.try_map(move |given| all.into_iter().find(|one| name(*one) == given).ok_or("unknown name"))
}

/// Runs the command that the arguments name; returns the exit status.
pub fn run() -> ExitCode {
    let command = Cli::parse().command;
    // within the threads that compute, so that these reuse the memory of reading
    let Err(failure) = rayon::scope(|_| command.run()) else { return ExitCode::SUCCESS };
    eprintln!("error: {}", failure.message);
    ExitCode::from(failure.status)
}

/// Prints a document as JSON, if that is asked for, else a text.
fn answer(json: bool, document: &impl Serialize, text: impl FnOnce() -> String) -> Result<(), Failure> {
    print(&if json { document::text(document)? } else { text() })
}

/// Prints to standard output; a closed pipe (`caromfit … | head`) is not an error.
fn print(text: &str) -> Result<(), Failure> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Failure { status: 1, message: format!("standard output: {error}") })
        }
        _ => Ok(()),
    }
}
