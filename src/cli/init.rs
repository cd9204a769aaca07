//! `caromfit init`: a dataset.toml for CSV files.

use std::path::PathBuf;

use caromfit::io::draft;
use caromfit::report::write;

use super::{Failure, print};

/// Looks at files of tracks or measurements, detects their format, units and the names of tracks, whether they are of discs, and a
/// table shots.csv, and writes a commented dataset.toml beside them; columns of tables in no known format are guessed by their names.
/// What the files do not tell is left as a line that says FILL IN. Asks nothing, and overwrites nothing.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit init my-shots/*.csv")]
pub struct Args {
    /// The files of one data set, or its folder: exports of Tracker, Kinovea or Qualisys, JSON, or tables
    #[arg(required = true, value_name = "CSV")]
    files: Vec<PathBuf>,
    /// Print it instead of writing it
    #[arg(long)]
    stdout: bool,
}

pub fn run(args: &Args) -> Result<(), Failure> {
    let draft = draft::draft(&args.files).map_err(Failure::input)?;
    if args.stdout {
        return print(&draft.text);
    }
    let path = draft.folder.join("dataset.toml");
    if path.exists() {
        return Err(Failure::input(format!(
            "{}: is there already; expected none (remove it, or see what it would be with --stdout)",
            path.display()
        )));
    }
    let folder = if draft.folder.as_os_str().is_empty() { PathBuf::from(".") } else { draft.folder };
    write::write_files(&[("dataset.toml", draft.text.into_bytes())], &folder).map_err(Failure::work)?;
    for line in &draft.found {
        print(&format!("{line}\n"))?;
    }
    print(&format!(
        "Wrote {}. Fill in: {}. Then: caromfit check {}\n",
        path.display(),
        draft.blanks.join(", "),
        folder.display()
    ))
}
