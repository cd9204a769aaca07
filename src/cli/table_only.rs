//! A table without a dataset.toml, which the file and the command line replace.

use std::path::Path;

use crate::io;
use crate::io::draft::{self, Draft};
use crate::measurement::dataset::Dataset;
use crate::physics::ball::Ball;

use super::Failure;

/// What a dataset.toml would state of a table.
#[derive(clap::Args, Default, PartialEq)]
#[command(next_help_heading = "For a single table")]
pub(super) struct Told {
    /// Camera frame rate, frames/s
    #[arg(long, value_name = "N")]
    fps: Option<f64>,
    /// Radius of the balls, m; pool balls, 0.028575, unless given
    #[arg(long, value_name = "M")]
    radius: Option<f64>,
    /// Cue ball's spin before the impact
    #[arg(long, value_parser = SPINS)]
    spin: Option<String>,
    /// Track of the cue ball
    #[arg(long, value_name = "TRACK", requires = "object")]
    cue: Option<String>,
    /// Track of the object ball
    #[arg(long, value_name = "TRACK", requires = "cue")]
    object: Option<String>,
    /// Unit of lengths
    #[arg(long, value_parser = UNITS)]
    unit: Option<String>,
}

/// Spins before the impact, and units of lengths.
const SPINS: [&str; 4] = ["stun", "natural-roll", "unknown", "measured"];
const UNITS: [&str; 6] = ["m", "cm", "mm", "in", "ft", "px"];

impl Told {
    /// Returns the data set of a table, and sentences that name what was assumed.
    pub(super) fn load(&self, table: &Path) -> Result<(Dataset, Vec<String>), Failure> {
        let mut draft = draft::draft(&[table.to_path_buf()])?;
        let name = table.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        draft.set("name", name.as_str());
        let mut said = draft.found.clone();
        said.extend(self.fill(&mut draft));
        if draft.blanks().contains(&"length_unit") {
            draft.set_unit("px");
            said.push("Lengths are taken as pixels: the balls are the ruler (else: --unit).".to_owned());
        }
        if let Some(radius) = draft.value("radius_m").filter(|_| self.radius.is_none()) {
            let is_pool = radius.parse() == Ok(Ball::POOL.radius);
            let which = if is_pool { "pool balls, radius" } else { "balls of radius" };
            said.push(format!("The balls are taken as {which} {radius} m (else: --radius)."));
        }
        let missing = OPTIONS.into_iter().filter(|(blank, _)| draft.blanks().contains(blank));
        let missing: Vec<&str> = missing.map(|(_, option)| option).collect();
        if !missing.is_empty() {
            let (table, missing) = (table.display(), missing.join(", "));
            refuse!("{table}: does not say what a fit needs; expected {missing}, or a dataset.toml");
        }
        self.check_balls(&draft.tracks)?;
        // messages name the table and the line of the text that replaces its dataset.toml
        let place = table.with_file_name(format!("{name} (assumed dataset.toml)"));
        let mut dataset = io::load_text(&draft.text(), &place)?;
        dataset.path = table.to_path_buf();
        Ok((dataset, said))
    }

    /// Puts what is stated into a draft; returns a sentence if its times are those of slow motion:
    /// of a film that was recorded more than 5 % faster.
    pub(super) fn fill(&self, draft: &mut Draft) -> Option<String> {
        for (key, value) in [("assume", &self.spin), ("cue", &self.cue), ("object", &self.object)] {
            if let Some(value) = value {
                draft.set(key, value.as_str());
            }
        }
        if let Some(unit) = &self.unit {
            draft.set_unit(unit);
        }
        if let Some(radius) = self.radius {
            draft.set("radius_m", radius);
        }
        let fps = self.fps.filter(|fps| draft.set_fps(*fps))?;
        Some(format!("Its times are those of slow motion, recorded at {fps} frames per second."))
    }

    /// Refuses --cue and --object that do not name two tracks of the table.
    fn check_balls(&self, tracks: &[String]) -> Result<(), Failure> {
        let known = tracks.join(", ");
        for (option, name) in [("--cue", &self.cue), ("--object", &self.object)] {
            if let Some(name) = name.as_ref().filter(|name| !tracks.is_empty() && !tracks.contains(name)) {
                refuse!("{option} is \"{name}\", which is not a track of the table; expected one of {known}");
            }
        }
        if let Some(cue) = self.cue.as_ref().filter(|cue| self.object.as_ref() == Some(cue)) {
            refuse!("--cue and --object are both \"{cue}\"; expected two different tracks, of {known}");
        }
        Ok(())
    }
}

/// Options that fill blanks of a draft which a fit needs.
const OPTIONS: [(&str, &str); 4] = [
    ("capture_fps", "--fps (what the camera recorded at)"),
    ("cue_spin", "--spin (natural-roll, stun, unknown or measured)"),
    ("which ball is which", "--cue and --object (two of its tracks)"),
    ("which column is what", "a dataset.toml (caromfit init writes a first version)"),
];

pub(super) fn is_table(path: &Path) -> bool {
    path.is_file() && path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("toml"))
}
