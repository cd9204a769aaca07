//! CSV files → a commented dataset.toml from a template, with blanks for what the files do not show.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use minijinja::context;
use toml::Value;

use super::draft_files::{Seen, is_shots_table, listed, look_at, refused};
use super::error::Problem;
use super::text::{decode, filled_lines};
use super::tracking::Survey;
use super::tracking::shots_table::KNOWN;
use crate::words::Sentences;

/// The dataset.toml. A comment behind a tab is aligned; a line behind > is a finding. A key behind #
/// is to be stated by the user, who must do so if its comment says FILL IN.
const TEMPLATE: &str = include_str!("draft.jinja");

/// Name of the table of properties of single shots.
const SHOTS: &str = "shots.csv";

/// A dataset.toml that was drafted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Draft {
    /// The folder that the draft belongs in: the one that holds all the files.
    pub(crate) folder: PathBuf,
    /// Findings about the files, in sentences.
    pub(crate) found: Vec<String>,
    /// The names of the tracks, in the order of first appearance.
    pub(crate) tracks: Vec<String>,
    /// Frames per second that the times in the files follow, if they are in seconds.
    pub(crate) follows: Option<f64>,
    /// Whether the files show discs, and not balls.
    pub(crate) are_discs: bool,
    lines: Vec<String>,
}

/// Returns the key of a line, also if it is behind #.
fn key_of(line: &str) -> &str {
    line.trim_start_matches("# ").split_once(" = ").map_or("", |(key, _)| key)
}

/// Returns a value as TOML writes it.
fn toml(value: impl Into<Value>) -> String {
    value.into().to_string()
}

impl Draft {
    /// Adds a filled template.
    fn add(&mut self, text: &str) {
        for line in text.lines() {
            match (line.strip_prefix("> "), line.split_once("\t# ")) {
                (Some(finding), _) => self.found.push(finding.to_owned()),
                (_, Some((line, comment))) => self.lines.push(format!("{line:<28} # {comment}")),
                _ => self.lines.push(line.to_owned()),
            }
        }
    }

    /// Returns the text of the dataset.toml.
    pub(crate) fn text(&self) -> String {
        self.lines.join("\n") + "\n"
    }

    /// Returns the names of what has to be filled in.
    pub(crate) fn blanks(&self) -> Vec<&str> {
        let blanks = self.lines.iter().filter(|line| line.contains(" # FILL IN: "));
        let names = blanks.map(|line| match key_of(line) {
            "assume" => "cue_spin",
            "cue" => "which ball is which",
            "t" => "which column is what",
            key => key,
        });
        names.collect()
    }

    /// States a key of the draft, whether stated, suggested or blank.
    pub(crate) fn set(&mut self, key: &str, value: impl Into<Value>) {
        if let Some(line) = self.lines.iter_mut().find(|line| key_of(line) == key) {
            *line = format!("{key} = {}", value.into());
        }
    }

    /// Returns the number of a key that is stated, as TOML writes it.
    pub(crate) fn value(&self, key: &str) -> Option<&str> {
        let stated = self.lines.iter().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
        stated.and_then(|stated| stated.split(' ').next())
    }

    /// States the camera's frame rate. Returns whether the times in the files are those of slow
    /// motion: of a film recorded more than 5 % faster than they follow.
    pub(crate) fn set_fps(&mut self, fps: f64) -> bool {
        self.set("capture_fps", fps);
        let slow = self.follows.filter(|follows| fps > 1.05 * follows);
        if let Some(follows) = slow {
            self.set("playback_fps", (1e4 * follows).round() / 1e4);
        }
        slow.is_some()
    }

    /// States the unit of lengths; in pixels y grows downwards.
    pub(crate) fn set_unit(&mut self, unit: &str) {
        self.set("length_unit", unit);
        if unit == "px" {
            self.set("y_axis", "down");
        }
    }
}

/// Drafts the dataset.toml of files, or of the tables in folders; at least one is named.
///
/// # Errors
/// A file that cannot be read or is empty, or files of different kinds.
pub(crate) fn draft(named: &[PathBuf]) -> Result<Draft, Problem> {
    let mut files = listed(named)?;
    let is_shots = |file: &PathBuf| {
        file.file_name().is_some_and(|name| name.eq_ignore_ascii_case(SHOTS)) && is_shots_table(file)
    };
    let table = files.iter().position(is_shots).filter(|_| files.len() > 1).map(|i| files.remove(i));
    let mut draft = Draft::default();
    let seen = look_at(&files, &mut draft.found)?;
    draft.folder = match named {
        // also if all tables are in one of its subfolders
        [folder] if folder.is_dir() => folder.clone(),
        _ => {
            let holds_all = |folder: &&Path| seen.iter().all(|seen| seen.file.starts_with(folder));
            let above = seen.first().and_then(|first| first.file.ancestors().skip(1).find(holds_all));
            above.map(Path::to_path_buf).unwrap_or_default()
        }
    };
    let here = if draft.folder.as_os_str().is_empty() { Path::new(".") } else { &draft.folder };
    let Some(first) = seen.first() else { return Err(refused(here, "holds no table")) };
    let name = std::path::absolute(here).unwrap_or_else(|_| here.to_path_buf());
    let name = name.file_name().map_or("my-data".into(), |name| name.to_string_lossy().into_owned());
    let relative = seen.iter().map(|Seen { file, .. }| {
        file.strip_prefix(&draft.folder).unwrap_or(file).to_string_lossy().replace('\\', "/")
    });
    let relative: Vec<String> = relative.collect();
    let (file, kind, has_spins) = (first.file.clone(), first.kind, first.has_spins);
    let survey = seen.into_iter().filter_map(|seen| seen.survey).reduce(Survey::and).unwrap_or_default();
    draft.tracks = survey.tracks().into_iter().map(|(name, _)| name.to_owned()).collect();
    draft.follows = survey.times().0;
    draft.are_discs = survey.are_discs();
    let values = context! {
        name => toml(name),
        kind => toml(kind),
        files => toml(relative),
        is_film => kind == "tracks",
        has_spins,
        file => file.display().to_string(),
        lines => first_lines(&file),
        table => table.as_ref().map(|table| table.display().to_string()),
        table_name => table.as_deref().and_then(Path::file_name).and_then(OsStr::to_str).map(toml),
        columns_of_shots => KNOWN.split(' ').skip(1).collect::<Vec<_>>().join(", "),
        ..survey.values()
    };
    draft.add(&Sentences::of(TEMPLATE).sentence(values));
    Ok(draft)
}

/// Returns the first lines of a table in no known format, shortened.
fn first_lines(file: &Path) -> Vec<String> {
    const MAX_LINES: usize = 6;
    const MAX_CHARACTERS: usize = 160;
    let bytes = std::fs::read(file).unwrap_or_default();
    let shortened = |(_, line): (usize, &str)| {
        let short: String = line.chars().take(MAX_CHARACTERS).collect();
        format!("{short}{}", if short.len() < line.len() { "…" } else { "" })
    };
    filled_lines(&decode(&bytes).0).take(MAX_LINES).map(shortened).collect()
}
