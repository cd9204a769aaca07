//! `caromfit export`: fitted parameters for the simulator pooltool.

use std::path::PathBuf;

use crate::report::export;
use crate::report::stored::Stored;

use super::{Failure, print};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit export fits/synthetic-natural-roll --to pooltool > ball.json\n  \
                        and then in Python: pooltool.BallParams(**json.load(open(\"ball.json\")))")]
pub(super) struct Args {
    /// A fit.json, or the folder that holds it
    #[arg(value_name = "FIT")]
    fit: PathBuf,
    /// What to write
    #[arg(long, value_parser = ["pooltool"], default_value = "pooltool")]
    to: String,
}

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let Stored { fits, .. } = Stored::read(&args.fit)?;
    let [fit] = fits.as_slice() else {
        let (path, count) = (args.fit.display(), fits.len());
        refuse!("{path}: holds {count} fits; expected one: name the folder of a label");
    };
    let exported = export::export(fit);
    print(&exported.text)?;
    for sentence in &exported.left_behind {
        eprintln!("not carried over: {sentence}");
    }
    Ok(())
}
