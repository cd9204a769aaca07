//! CSV files → a commented dataset.toml from a template, with blanks for what the files do not show.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use indexmap::IndexMap;
use minijinja::{Value as Values, context};
use toml::Value;

use super::Survey;
use super::draft_files::{Seen, is_shots_table, listed, look_at, refused};
use super::error::Problem;
use super::text::{decode, filled_lines};
use super::tracking::shots_table::KNOWN;
use super::tracking::{Column, metres};
use crate::measurement::number::count_of;
use crate::words::Sentences;

/// The dataset.toml. A comment behind a tab is aligned; a line behind > is a finding. A key behind #
/// is to be stated by the user, who must do so if its comment says FILL IN.
const TEMPLATE: &str = include_str!("draft.jinja");

/// Name of the table of properties of single shots.
const SHOTS: &str = "shots.csv";

/// Least difference of the times at which two balls begin to move, as a part of the film, for the
/// first to be the cue ball.
const EARLIER: f64 = 0.05;

/// Least frame rate of a film of balls: no film is as slow as times in ms would be in seconds.
const LEAST_FPS: f64 = 2.0;

/// Plausible extents of positions, m: a table is 2.84 m long; films show a few centimetres.
const METRES: std::ops::Range<f64> = 0.02..4.0;
/// Plausible diameters of balls, m, with allowance for noise and slow cameras.
const DIAMETERS: std::ops::Range<f64> = 0.045..0.072;
/// Balls and their radii, m, the largest first.
const BALLS: [(&str, f64); 4] =
    [("pyramid", 0.034), ("carom", 0.03075), ("pool", 0.028_575), ("snooker", 0.02625)];
/// Largest ratio of a diameter to the distance of centres that noise explains.
const NEARER: f64 = 1.02;

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
    let surveys: Vec<&Survey> = seen.iter().filter_map(|seen| seen.survey.as_ref()).collect();
    let tracks = names(&surveys);
    draft.tracks = tracks.iter().map(|(name, _)| (*name).to_owned()).collect();
    draft.follows = surveys.first().and_then(|first| times(first).0);
    draft.are_discs = surveys.first().is_some_and(|first| first.are_discs);
    let values = context! {
        name => toml(name),
        kind => toml(first.kind),
        files => toml(relative.collect::<Vec<String>>()),
        is_film => first.kind == "tracks",
        are_discs => draft.are_discs,
        has_spins => first.has_spins,
        stated_fps => surveys.first().and_then(|first| first.stated_fps).map(|fps| fps.to_string()),
        fps => draft.follows.map(|fps| ((1e4 * fps).round() / 1e4).to_string()),
        file => first.file.display().to_string(),
        lines => if surveys.is_empty() { first_lines(&first.file) } else { Vec::new() },
        table => table.as_ref().map(|table| table.display().to_string()),
        table_name => table.as_deref().and_then(Path::file_name).and_then(OsStr::to_str).map(toml),
        columns_of_shots => KNOWN.split(' ').skip(1).collect::<Vec<_>>().join(", "),
        ..context! { ..lengths(&surveys, draft.are_discs), ..tracks_of(&surveys, &tracks) }
    };
    draft.add(&Sentences::of(TEMPLATE).sentence(values));
    Ok(draft)
}

/// Returns the names of the tracks of all files, each with the part of the time at which it moves.
fn names<'a>(surveys: &[&'a Survey]) -> Vec<(&'a str, f64)> {
    let mut names = IndexMap::new();
    for (name, begin) in surveys.iter().flat_map(|survey| &survey.tracks) {
        names.entry(name.as_str()).or_insert(*begin);
    }
    names.into_iter().collect()
}

/// Returns the frame rate that the times follow, and their unit if it is not seconds.
fn times(survey: &Survey) -> (Option<f64>, Option<&'static str>) {
    match survey.times_fps {
        Some(fps) if (fps - 1.0).abs() < 1e-3 => (None, Some("frames")),
        Some(fps) if fps < 1e-3 * LEAST_FPS => (Some(1e6 * fps), Some("us")),
        Some(fps) if fps < LEAST_FPS => (Some(1e3 * fps), Some("ms")),
        fps => (fps, None),
    }
}

/// Returns the extent of positions, their unit if it is stated or plausible, and the balls: the
/// largest whose diameter is at most the least distance of the centres, if the scale is known.
fn lengths(surveys: &[&Survey], are_discs: bool) -> Values {
    let extent = surveys.iter().map(|survey| survey.extent).fold(0.0, f64::max);
    let nearest = surveys.iter().filter_map(|survey| survey.closest).fold(f64::INFINITY, f64::min);
    let may_touch = are_discs || nearest.is_infinite() || DIAMETERS.contains(&nearest);
    let stated_unit = surveys.first().and_then(|first| first.unit);
    let unit = stated_unit.or((METRES.contains(&extent) && may_touch).then_some("m"));
    let diameter = unit.and_then(metres).map(|metres| metres * nearest);
    let diameter = diameter.filter(|nearest| *nearest < DIAMETERS.end).unwrap_or(0.0);
    let ball = BALLS.iter().find(|(_, radius)| *radius <= 0.5 * NEARER * diameter);
    context! {
        extent => format!("{extent:.3}"),
        is_table_sized => METRES.contains(&extent),
        nearest => format!("{nearest:.4}"),
        nearest_mm => format!("{:.1}", 1e3 * diameter),
        stated_unit,
        unit,
        ball => ball.map(|(name, _)| *name),
        radius => ball.map(|(_, radius)| radius.to_string()),
    }
}

/// Returns the format of tracks, which ball is the cue ball, and guessed columns. Columns are
/// exchanged if those named object belong to the ball that moves first.
fn tracks_of(surveys: &[&Survey], tracks: &[(&str, f64)]) -> Values {
    let Some(first) = surveys.first() else { return Values::UNDEFINED };
    let columns = &first.guess.columns;
    let is_single = |survey: &&Survey| survey.tracks.len() == 1 && survey.shots == 1;
    let shots = if surveys.len() > 1 && surveys.iter().all(is_single) {
        "one ball each: two whose names differ by the ball only (kick-A.txt, kick-B.txt) are a shot"
            .to_owned()
    } else {
        count_of(surveys.iter().map(|survey| survey.shots).sum(), "shot")
    };
    let order = match tracks {
        [a, b] if a.1 + EARLIER < b.1 => Some([a.0, b.0]),
        [a, b] if b.1 + EARLIER < a.1 => Some([b.0, a.0]),
        _ => None,
    };
    // a table with a row per frame names the balls by its columns
    let first_column = order.and_then(|[cue, _]| columns.get(&format!("{cue}_x"))).map(Column::shown);
    // names such as cue and object are believed
    let is_other = order.is_some_and(|[cue, _]| cue != "cue");
    let is_believed = is_other && first_column.as_ref().is_some_and(|column| column.contains("obj"));
    let are_exchanged = is_other && first_column.is_some() && !is_believed;
    let line = |(key, column): (&String, &Column)| {
        // the keys in the same order, with the columns of the other ball
        let other = match key.split_once('_') {
            Some(("cue", rest)) if are_exchanged => columns.get(&format!("object_{rest}")),
            Some(("object", rest)) if are_exchanged => columns.get(&format!("cue_{rest}")),
            _ => None,
        };
        let line = format!("{key} = {}", other.unwrap_or(column).shown());
        context! { line, is_doubtful => first.guess.is_doubtful(key) }
    };
    let listed: Vec<String> = tracks.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    context! {
        count => count_of(surveys.len(), "file"),
        format => first.format,
        shots,
        layout => if columns.is_empty() { "auto" } else { "columns" },
        time_unit => times(first).1,
        tracks => listed.join(", "),
        first_column,
        is_believed,
        cue => order.map(|[cue, _]| toml(cue)),
        object => order.map(|[_, object]| toml(object)),
        has_wide_columns => columns.contains_key("cue_x"),
        columns => columns.iter().map(line).collect::<Vec<Values>>(),
        faults => surveys.iter().flat_map(|survey| &survey.problems).cloned().collect::<Vec<String>>(),
    }
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
