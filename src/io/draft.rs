//! Files, or tables in folders → a commented dataset.toml, with blanks for what they do not show.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use glob::{MatchOptions, Pattern, glob_with};
use minijinja::context;
use toml::Value;

use super::error::{Problem, message};
use super::table::near_miss;
use super::text::{beginning, decode, filled_lines, line_of_names, value, without_separator_line};
use super::tracking::{KNOWN, Survey};
use crate::words::Sentences;

/// The dataset.toml: a comment behind a tab is aligned, a line behind > is a finding, a key behind
/// # is to be stated by the user, who must if its comment says FILL IN.
const TEMPLATE: &str = include_str!("draft.jinja");
/// Name of the table of properties of single shots.
const SHOTS: &str = "shots.csv";
/// Endings of tables in a folder and, if it lacks them, of other files: ImageJ calls its tables
/// .xls, OpenSim .trc, Tracker its projects .trk and .trz.
const ENDINGS: [&[&str]; 2] = [&["csv", "txt", "tsv", "dat"], &["json", "xls", "trc", "trk", "trz"]];
/// Least number of one-frame files that are not tables of shots, and maximum of boxes in each.
const FRAMES: usize = 10;
const BOXES: usize = 5;
/// Maximum number of lines shown of a table in no known format, and of characters in each.
const MAX_LINES: usize = 6;
const MAX_CHARACTERS: usize = 160;

/// A dataset.toml that was drafted.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Draft {
    /// The folder that holds all the files.
    pub(crate) folder: PathBuf,
    /// Findings about the files, in sentences.
    pub(crate) found: Vec<String>,
    /// The names of the tracks, in the order of first appearance.
    pub(crate) tracks: Vec<String>,
    /// Frames per second that the times in the files follow, if they are in seconds.
    pub(crate) follows: Option<f64>,
    pub(crate) are_discs: bool,
    lines: Vec<String>,
}

/// Returns the key of a line, also if it is behind #.
fn key_of(line: &str) -> &str {
    line.trim_start_matches("# ").split_once(" = ").map_or("", |(key, _)| key)
}

fn toml(value: impl Into<Value>) -> String {
    value.into().to_string()
}

impl Draft {
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

    pub(crate) fn set(&mut self, key: &str, value: impl Into<Value>) {
        if let Some(line) = self.lines.iter_mut().find(|line| key_of(line) == key) {
            *line = format!("{key} = {}", value.into());
        }
    }

    /// Returns the number of a stated key, as written.
    pub(crate) fn value(&self, key: &str) -> Option<&str> {
        let stated = self.lines.iter().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
        stated.and_then(|stated| stated.split(' ').next())
    }

    /// States the camera's frame rate; returns whether it is 5 % above the times': slow motion.
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

/// Drafts the dataset.toml of files. `Err`: one that cannot be read, or files of different kinds.
pub(crate) fn draft(named: &[PathBuf]) -> Result<Draft, Problem> {
    let paths = named.iter().map(|file| if file.is_dir() { tables(file) } else { Ok(vec![file.clone()]) });
    let paths = paths.collect::<Result<Vec<_>, _>>()?.concat();
    let mut files = paths.into_iter().map(Seen::of).collect::<Result<Vec<Seen>, _>>()?;
    let table = files.iter().position(Seen::is_shots_table).filter(|_| files.len() > 1);
    let table = table.map(|i| files.remove(i).file);
    let mut draft = Draft::default();
    look_at(&mut files, &mut draft.found)?;
    draft.folder = match named {
        // also if all tables are in one of its subfolders
        [folder] if folder.is_dir() => folder.clone(),
        _ => {
            let holds_all = |folder: &&Path| files.iter().all(|seen| seen.file.starts_with(folder));
            let above = files.first().and_then(|first| first.file.ancestors().skip(1).find(holds_all));
            above.map(Path::to_path_buf).unwrap_or_default()
        }
    };
    let here = if draft.folder.as_os_str().is_empty() { Path::new(".") } else { &draft.folder };
    let Some(first) = files.first() else { return Err(Problem::new(here, "holds no table")) };
    let name = std::path::absolute(here).unwrap_or_else(|_| here.to_path_buf());
    let name = name.file_name().map_or("my-data".into(), |name| name.to_string_lossy().into_owned());
    let relative = |Seen { file, .. }: &Seen| {
        file.strip_prefix(&draft.folder).unwrap_or(file).to_string_lossy().replace('\\', "/")
    };
    let lines = filled_lines(&first.text).take(MAX_LINES);
    let lines: Vec<String> = lines.map(|(_, line)| beginning(line, MAX_CHARACTERS)).collect();
    let values = context! {
        name => toml(name),
        kind => toml(first.kind),
        files => toml(files.iter().map(relative).collect::<Vec<String>>()),
        is_film => first.kind == "tracks",
        has_spins => first.has("cue_spin") || first.has("omega_x"),
        file => first.file.display().to_string(),
        lines,
        table => table.as_ref().map(|table| table.display().to_string()),
        table_name => table.as_deref().and_then(Path::file_name).and_then(OsStr::to_str).map(toml),
        columns_of_shots => KNOWN.split(' ').skip(1).collect::<Vec<_>>().join(", "),
    };
    let survey = files.into_iter().map(|seen| seen.survey).reduce(Survey::and).unwrap_or_default();
    draft.tracks = survey.tracks().into_iter().map(|(name, _)| name.to_owned()).collect();
    draft.follows = survey.times().0;
    draft.are_discs = survey.are_discs();
    let values = context! { ..values, ..survey.values() };
    for line in Sentences::of(TEMPLATE).sentence(values).lines() {
        match (line.strip_prefix("> "), line.split_once("\t# ")) {
            (Some(finding), _) => draft.found.push(finding.to_owned()),
            (_, Some((line, comment))) => draft.lines.push(format!("{line:<28} # {comment}")),
            _ => draft.lines.push(line.to_owned()),
        }
    }
    Ok(draft)
}

/// A file and its content.
#[derive(Default)]
struct Seen {
    file: PathBuf,
    text: String,
    /// The names of columns if it is a table of shots.
    names: Vec<String>,
    /// `tracks`, `impacts` or `angles`.
    kind: &'static str,
    /// Empty for a table of impacts or angles, or of unknown columns.
    survey: Survey,
}

impl Seen {
    fn of(file: PathBuf) -> Result<Self, Problem> {
        let bytes = std::fs::read(&file);
        let bytes = bytes.map_err(|error| Problem::new(&file, format!("cannot be read: {error}")))?;
        let text = decode(&bytes).0.into_owned();
        let (table, _) = without_separator_line(text.as_str().into());
        let names = line_of_names(&table).split([',', ';', '\t']);
        let names = names.map(|name| name.trim_matches([' ', '"']).to_owned()).collect();
        Ok(Self { file, text, names, ..Self::default() })
    }

    /// Returns whether a column has this name, in capitals or with a unit, too: the loader then says
    /// how to write it.
    fn has(&self, name: &str) -> bool {
        let bare = |own: &String| own.split([' ', '[', '(']).next().unwrap_or_default().to_lowercase();
        self.names.iter().any(|own| bare(own) == name)
    }

    fn is_shots_table(&self) -> bool {
        let is_called_so = self.file.file_name().is_some_and(|name| name.eq_ignore_ascii_case(SHOTS));
        let others = ["cut_deg", "nx", "x", "cue_x", "frame", "t", "time"];
        is_called_so && !others.into_iter().any(|name| self.has(name))
    }

    /// Determines the kind and the content; `Err` if it is neither tracks nor, by its beginning, text.
    fn look(&mut self) -> Result<(), Problem> {
        let is_near = |own: &String| near_miss(own, &["cut_deg"], |_| false).is_some();
        self.kind = match () {
            () if ["nx", "ny", "cue_vx"].into_iter().all(|name| self.has(name)) => "impacts",
            () if self.has("cut_deg") || self.names.iter().any(is_near) => "angles",
            () => "tracks",
        };
        if self.kind == "tracks" {
            self.survey = match Survey::of(&self.file, &self.text) {
                Err(problems) if !is_text(&self.text) => {
                    return problems.into_iter().next().map_or(Ok(()), Err);
                }
                survey => survey.unwrap_or_default(),
            };
        }
        Ok(())
    }
}

/// Returns whether a file begins with text, not with JSON, XML or other bytes.
fn is_text(text: &str) -> bool {
    let is_odd = |c: char| c == char::REPLACEMENT_CHARACTER || c.is_control() && !c.is_whitespace();
    let mut lines = filled_lines(text);
    lines.next().is_some_and(|(_, line)| !line.starts_with(['{', '[', '<']) && !line.contains(is_odd))
}

/// Returns the tables in a folder or, if it lacks tables, in its subfolders, or in theirs.
fn tables(folder: &Path) -> Result<Vec<PathBuf>, Problem> {
    let options =
        MatchOptions { case_sensitive: false, require_literal_leading_dot: true, ..MatchOptions::new() };
    let escaped = PathBuf::from(Pattern::escape(&folder.to_string_lossy()));
    for depth in ["", "*/", "*/*/"] {
        for endings in ENDINGS {
            let patterns = endings.iter().map(|ending| escaped.join(format!("{depth}*.{ending}")));
            let paths = patterns.flat_map(|pattern| glob_with(&pattern.to_string_lossy(), options));
            let mut tables: Vec<PathBuf> = paths.flatten().flatten().filter(|path| path.is_file()).collect();
            if !tables.is_empty() {
                tables.sort();
                return Ok(tables);
            }
        }
    }
    Err(Problem::new(folder, "holds no table (.csv, .txt, .tsv or .dat); save a workbook's sheet as CSV"))
}

/// Looks at files; leaves out those that are not understood if others are. `Err`: different kinds.
fn look_at(files: &mut Vec<Seen>, found: &mut Vec<String>) -> Result<(), Problem> {
    let numbers = |row: &str| row.split_whitespace().filter_map(value).count();
    let is_row = |row: &str| (5..=7).contains(&numbers(row));
    let is_frame = |text: &str| (1..=BOXES).contains(&text.lines().count()) && text.lines().all(is_row);
    let frames: Vec<&Path> =
        files.iter().filter(|seen| is_frame(&seen.text)).map(|seen| &*seen.file).collect();
    if frames.len() >= FRAMES {
        let (count, first) = (frames.len(), frames[0]);
        let name = first.file_name().unwrap_or_default().to_string_lossy();
        return Err(Problem::new(first.parent().unwrap_or(first), message!("files_of_frames", count, name)));
    }
    let looked: Vec<Result<(), Problem>> = files.iter_mut().map(Seen::look).collect();
    let is_clear = |seen: &Seen| ["impacts", "angles"].contains(&seen.kind) || !seen.survey.is_empty();
    if !files.iter().any(is_clear) {
        return looked.into_iter().collect();
    }
    for seen in files.extract_if(.., |seen| !is_clear(seen)) {
        let why = "no table of positions or measurements, or one without rows; left out";
        found.push(format!("{}: {why}.", seen.file.display()));
    }
    // one [tracks.columns] serves all files: that of most
    let is_like = |one: &Seen, other: &Seen| one.survey.columns == other.survey.columns;
    let alike = |seen: &&Seen| files.iter().filter(|other| is_like(seen, other)).count();
    let most = files.iter().find(|seen| 2 * alike(seen) > files.len());
    let most = most.map(|seen| seen.survey.columns.clone());
    let is_other = |seen: &mut Seen| most.as_ref().is_some_and(|most| seen.survey.columns != *most);
    for Seen { file, .. } in files.extract_if(.., is_other) {
        found.push(format!("{}: its columns are not those of the other files; left out.", file.display()));
    }
    if let Some(other) = files.iter().find(|seen| seen.kind != files[0].kind) {
        let (own, Seen { file, kind, .. }) = (other.kind, &files[0]);
        let first = format!("{} is of kind {kind}", file.display());
        let message = format!("is of kind {own}, but {first}; expected files of one data set");
        return Err(Problem::new(&other.file, message));
    }
    Ok(())
}
