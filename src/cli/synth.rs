//! `caromfit synth`: a synthetic data set.

use std::path::PathBuf;

use crate::physics::ball::Ball;
use crate::physics::collision::Model;
use crate::report::document::SynthDocument;
use crate::report::write::Staged;
use crate::simulate;

use super::{Failure, answer};

#[derive(clap::Args)]
#[command(after_long_help = concat!(
    "A SPEC.toml:\n\n",
    include_str!("synth-spec.toml"),
    "\nExample: caromfit synth spec.toml --out data/two-cloths-a"
))]
pub(super) struct Args {
    /// What to make; see below
    #[arg(value_name = "SPEC.toml")]
    spec: PathBuf,
    /// A new folder, or one that synth made: no other data set is replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Collision model; full, or ode if the contact is compliant, unless given
    #[arg(long, value_parser = super::fidelity())]
    fidelity: Option<super::Chosen>,
    /// Print only what was made as JSON, on standard output
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let spec = simulate::read(&args.spec)?;
    let model = match args.fidelity {
        Some(super::Chosen(Some(fidelity))) => Model::new(fidelity, Ball::POOL),
        Some(_) => refuse!("--fidelity auto: expected one for all shots"),
        None => spec.usual_model(),
    };
    let fidelity = model.fidelity;
    let files = match simulate::generate_with(&spec, &model) {
        Ok(files) => files,
        Err(error) => refuse!("{}: {error}", args.spec.display()),
    };
    // another's data set is not replaced
    let there = args.out.join("dataset.toml");
    if std::fs::read_to_string(&there).is_ok_and(|text| !text.starts_with("# Synthetic:")) {
        let path = there.display();
        refuse!("{path}: is not a synthetic data set, and is not replaced; expected another --out");
    }
    let staged =
        files.iter().try_fold(Staged::new(&args.out)?, |staged, (name, text)| staged.add(name, text))?;
    staged.put()?;
    let names = files.iter().map(|(name, _)| (*name).to_owned()).collect();
    let text = || format!("{} shots in {}\n", spec.shots.count, args.out.display());
    answer(args.json, &SynthDocument::new(&spec, fidelity, &args.out, names), text)
}
