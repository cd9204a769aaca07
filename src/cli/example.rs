//! `caromfit example`: a small complete example to try everything on.

use std::path::PathBuf;

use caromfit::report::write;

use super::{Failure, print};

/// Copies a small example: balls/, ten shots as a phone films them (simulated, so that the true values are known), and pucks/, a
/// real film of two disks. Both can be fitted, compared, extracted and changed. Overwrites nothing.
#[derive(clap::Args)]
#[command(after_help = "Example: caromfit example demo && caromfit fit demo/balls demo/pucks")]
pub struct Args {
    /// The folder to copy it into
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Folders and their files: name and content.
const FILES: [(&str, &[(&str, &str)]); 2] = [
    (
        "balls",
        &[
            ("shots.csv", include_str!("../example/balls/shots.csv")),
            ("balls-spec.toml", include_str!("../example/balls-spec.toml")),
            ("dataset.toml", include_str!("../example/balls/dataset.toml")),
        ],
    ),
    (
        "pucks",
        &[
            ("disk-tracks.csv", include_str!("../../data/pucks-opencv/disk-tracks.csv")),
            ("README.md", include_str!("../../data/pucks-opencv/README.md")),
            ("dataset.toml", include_str!("../../data/pucks-opencv/dataset.toml")),
        ],
    ),
];

pub fn run(args: &Args) -> Result<(), Failure> {
    for (folder, _) in FILES {
        let path = args.folder.join(folder);
        if path.exists() {
            return Err(Failure::input(format!(
                "{}: is there already; expected none, as nothing is overwritten",
                path.display()
            )));
        }
    }
    for (folder, files) in FILES {
        let files: Vec<_> = files.iter().map(|(name, text)| (*name, text.as_bytes().to_vec())).collect();
        write::write_files(&files, &args.folder.join(folder))?;
    }
    let [balls, pucks] = ["balls", "pucks"].map(|folder| args.folder.join(folder).display().to_string());
    print(&format!(
        "{balls}: ten shots of a phone at 240 frames per second, in pixels (simulated)\n\
         {pucks}: a real film of two disks, 1 shot\n\
         Next: caromfit fit {balls} {pucks}\n"
    ))
}
