//! `caromfit design`: which shots to film.

use std::path::PathBuf;

use crate::design::{self, Expected};
use crate::measurement::parameter::Parameter;
use crate::report::design as report;
use crate::report::document::DesignDocument;

use super::{Failure, answer};

#[derive(clap::Args)]
#[command(after_long_help = concat!(
    "A SPEC.toml, all of it optional:\n\n",
    include_str!("design-spec.toml"),
    "\nExample: caromfit design --want mu=0.001,mu_s=0.02,e=0.001"
))]
pub(super) struct Args {
    /// What is expected, the camera, and the kinds of shots; see below
    /// [default: pool balls, 1000 fps, 0.1 mm, 40 shots each of natural roll, stun, draw and side spin either way]
    #[arg(value_name = "SPEC.toml")]
    spec: Option<PathBuf>,
    /// Standard errors that are wanted, as in mu=0.001,e=0.001
    #[arg(long, value_name = "PARAMETER=ERROR", value_delimiter = ',', value_parser = wish)]
    want: Vec<(Parameter, f64)>,
    /// Where the results go
    #[arg(long, default_value = "fits/design", value_name = "DIR")]
    out: PathBuf,
    /// Print only design.json, on standard output
    #[arg(long)]
    json: bool,
}

fn wish(text: &str) -> Result<(Parameter, f64), String> {
    let (name, value) = text.split_once('=').unwrap_or((text, ""));
    let parameter = Parameter::COEFFICIENTS.into_iter().find(|parameter| parameter.name() == name.trim());
    let known = Parameter::COEFFICIENTS.map(Parameter::name).join(", ");
    let parameter = parameter
        .ok_or_else(|| format!("\"{}\" is not a parameter; expected one of {known}", name.trim()))?;
    let error = Some(super::number(value)?).filter(|error| *error > 0.0 && error.is_finite());
    error.map(|error| (parameter, error)).ok_or_else(|| format!("{value}; expected more than 0"))
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let mut expected = match &args.spec {
        Some(path) => Expected::read(path)?,
        None => Expected::default(),
    };
    if !args.want.is_empty() {
        expected.wanted = [None; 3];
        for (parameter, error) in &args.want {
            if expected.wanted[*parameter as usize].replace(*error).is_some() {
                refuse!("--want: {} twice; expected it once", parameter.name());
            }
        }
    }
    let name = args.spec.as_ref().map_or("the design".to_owned(), |path| path.display().to_string());
    let design = match design::design(&expected) {
        Ok(design) => design,
        Err(error) => refuse!("{name}: a shot of it is not a collision: {error}"),
    };
    report::write(&design, &args.out)?;
    let see = args.out.join("design.png");
    let text = || format!("{}\nSee {}\n", report::text(&design), see.display());
    answer(args.json, &DesignDocument::new(&design), text)
}
