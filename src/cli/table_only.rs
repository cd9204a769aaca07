//! A table in the place of a data set: what a dataset.toml would say comes from the file and the command line.

use std::path::Path;

use caromfit::io::{self, draft};
use caromfit::measurement::dataset::Dataset;
use caromfit::physics::ball::Ball;

use super::Failure;

/// The heading of these options.
const HEADING: &str = "For a single table";

/// What a table without a dataset.toml needs to be told.
#[derive(clap::Args)]
pub struct Told {
    /// Camera frame rate, frames/s
    #[arg(long, help_heading = HEADING, value_name = "N")]
    fps: Option<f64>,
    /// Radius of the balls, m; pool balls, 0.028575, unless given
    #[arg(long, help_heading = HEADING, value_name = "M")]
    radius: Option<f64>,
    /// Cue ball's spin before the impact
    #[arg(long, help_heading = HEADING, value_parser = ["stun", "natural-roll", "unknown", "measured"])]
    spin: Option<String>,
    /// Track of the cue ball
    #[arg(long, help_heading = HEADING, value_name = "TRACK", requires = "object")]
    cue: Option<String>,
    /// Track of the object ball
    #[arg(long, help_heading = HEADING, value_name = "TRACK", requires = "cue")]
    object: Option<String>,
    /// Unit of lengths
    #[arg(long, help_heading = HEADING, value_parser = ["m", "cm", "mm", "in", "ft", "px"])]
    unit: Option<String>,
}

/// Times of a film that was recorded faster than this times what they follow are those of its slow motion.
pub const SLOW_MOTION: f64 = 1.05;

impl Told {
    /// Whether anything was told.
    pub fn is_empty(&self) -> bool {
        let words = [&self.spin, &self.cue, &self.object, &self.unit];
        self.fps.is_none() && self.radius.is_none() && words.iter().all(|word| word.is_none())
    }

    /// The data set, and what was assumed: sentences.
    pub fn load(&self, table: &Path) -> Result<(Dataset, Vec<String>), Failure> {
        let mut draft = draft::draft(&[table.to_path_buf()])?;
        let name = table.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        draft.set_name(&name);
        let mut said = draft.found.clone();
        if let Some(fps) = self.fps {
            draft.fill("capture_fps", &format!("capture_fps = {fps:?}"));
            if draft.follows.is_some_and(|follows| fps > SLOW_MOTION * follows) {
                draft.set_playback();
                said.push(format!(
                    "Its times are those of slow motion, recorded at {fps} frames per second."
                ));
            }
        }
        if let Some(spin) = &self.spin {
            draft.fill("cue_spin", &format!("assume = \"{spin}\""));
        }
        if let (Some(cue), Some(object)) = (&self.cue, &self.object) {
            draft.set_balls(cue, object);
        }
        match (&self.unit, draft.blanks.contains(&"length_unit")) {
            (Some(unit), _) => draft.set_unit(unit),
            (None, true) => {
                draft.set_unit("px");
                said.push("Lengths are taken as pixels: the balls are the ruler (else: --unit).".to_owned());
            }
            (None, false) => {}
        }
        match self.radius {
            Some(radius) => draft.set_radius(radius),
            None => said.extend(draft.radius().map(assumed_radius)),
        }
        let tracks = draft.tracks.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        let missing: Vec<String> = draft
            .blanks
            .iter()
            .filter_map(|blank| match *blank {
                "capture_fps" => Some("--fps (what the camera recorded at)".to_owned()),
                "cue_spin" => Some("--spin (natural-roll, stun, unknown or measured)".to_owned()),
                "which ball is which" => Some(format!("--cue and --object (of the tracks {tracks})")),
                "which column is what" => {
                    Some("a dataset.toml (caromfit init writes a first version)".to_owned())
                }
                _ => None,
            })
            .collect();
        if !missing.is_empty() {
            return Err(Failure::input(format!(
                "{}: does not say what a fit needs; expected {}, or a dataset.toml",
                table.display(),
                missing.join(", ")
            )));
        }
        self.check_balls(&draft.tracks)?;
        // messages name the table and the line of what stands for its dataset.toml
        let place = table.with_file_name(format!("{name} (assumed dataset.toml)"));
        let mut dataset = io::load_text(&draft.text, &place)?;
        dataset.path = table.to_path_buf();
        Ok((dataset, said))
    }

    /// That --cue and --object name two tracks of the table.
    fn check_balls(&self, tracks: &[String]) -> Result<(), Failure> {
        let (Some(cue), Some(object)) = (&self.cue, &self.object) else { return Ok(()) };
        let known = tracks.join(", ");
        for (option, name) in [("--cue", cue), ("--object", object)] {
            if !tracks.is_empty() && !tracks.contains(name) {
                return Err(Failure::input(format!(
                    "{option} is \"{name}\", which is no track of the table; expected one of {known}"
                )));
            }
        }
        if cue == object {
            let message = "expected two different tracks, of";
            return Err(Failure::input(format!("--cue and --object are both \"{cue}\"; {message} {known}")));
        }
        Ok(())
    }
}

/// What is said of a radius that nobody stated.
fn assumed_radius(radius: &str) -> String {
    let is_pool = radius.parse::<f64>().is_ok_and(|radius| radius == Ball::POOL.radius);
    let which = if is_pool { "pool balls, radius" } else { "balls of radius" };
    format!("The balls are taken as {which} {radius} m (else: --radius).")
}

/// Whether a path names a table rather than a data set.
pub fn is_table(path: &Path) -> bool {
    path.is_file() && path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("toml"))
}
