//! `caromfit example`: a small complete example to try everything on.

use std::path::PathBuf;

use crate::report::write::Staged;

use super::{Failure, print};

#[derive(clap::Args)]
#[command(after_help = "Example: caromfit example demo && caromfit fit demo/balls demo/pucks")]
pub(super) struct Args {
    /// The folder to copy it into
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Folder, name and content of each file.
const FILES: [(&str, &str, &str); 6] = [
    ("balls", "shots.csv", include_str!("../example/balls/shots.csv")),
    ("balls", "balls-spec.toml", include_str!("../example/balls-spec.toml")),
    ("balls", "dataset.toml", include_str!("../example/balls/dataset.toml")),
    ("pucks", "disk-tracks.csv", include_str!("../../data/pucks-opencv/disk-tracks.csv")),
    ("pucks", "README.md", include_str!("../../data/pucks-opencv/README.md")),
    ("pucks", "dataset.toml", include_str!("../../data/pucks-opencv/dataset.toml")),
];

pub(super) fn run(args: &Args) -> Result<(), Failure> {
    let folders = ["balls", "pucks"].map(|name| (name, args.folder.join(name)));
    if let Some((_, path)) = folders.iter().find(|(_, path)| path.exists()) {
        refuse!("{}: is there already; expected none, as nothing is overwritten", path.display());
    }
    for (name, path) in &folders {
        let mut files = FILES.iter().filter(|(folder, ..)| folder == name);
        files.try_fold(Staged::new(path)?, |staged, (_, file, text)| staged.add(file, text))?.put()?;
    }
    let [balls, pucks] = folders.map(|(_, path)| path.display().to_string());
    print(&format!(
        "{balls}: ten shots of a phone at 240 frames per second, in pixels (simulated)\n\
         {pucks}: a real film of two disks, 1 shot\n\
         Next: caromfit fit {balls} {pucks}\n"
    ))
}
