//! CSV files → a commented dataset.toml from a template, with blanks for what the files do not show.

use std::path::{Path, PathBuf};

use toml::Value;

use super::Survey;
use super::draft_files::{Seen, is_shots_table, listed, look_at, refused};
use super::error::Problem;
use super::text::{decode, filled_lines};
use super::tracking::shots_table::KNOWN;
use super::tracking::{Column, Guess, metres};
use crate::measurement::number::count_of;

/// Parts of a dataset.toml, each below a line with @ and its name; words in braces are filled in. A
/// line behind > is a finding. A key behind # is to be stated by the user, who must do so if its
/// comment says FILL IN.
const TEMPLATE: &str = include_str!("draft.toml");

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

/// Remark on the size of a box if names do not show whether x and y are a corner or the middle.
const DOUBT: &str = "of a box: take the # away, from both, if x and y are its corner, and not its middle";

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
    /// Adds a part of the template with the words that stand for names in braces.
    fn add(&mut self, part: &str, words: &[(&str, &str)]) {
        let fill = |text: &str| {
            let fill = |text: String, (name, word): &(&str, &str)| text.replace(&format!("{{{name}}}"), word);
            words.iter().fold(text.to_owned(), fill)
        };
        let parts = TEMPLATE.split('@').filter_map(|text| text.split_once('\n'));
        for line in parts.filter(|(name, _)| *name == part).flat_map(|(_, text)| text.lines()) {
            match (line.strip_prefix("> "), line.split_once(" # ")) {
                (Some(finding), _) => self.found.push(fill(finding)),
                (_, Some((line, comment))) => self.push(&fill(line.trim_end()), &fill(comment)),
                _ => self.lines.push(fill(line)),
            }
        }
    }

    /// Adds a line with a comment.
    fn push(&mut self, line: &str, comment: &str) {
        self.lines.push(format!("{line:<28} # {comment}"));
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
    let relative = toml(relative.collect::<Vec<String>>());
    draft.add("top", &[("name", &toml(name)), ("kind", &toml(first.kind)), ("files", &relative)]);
    let surveys: Vec<&Survey> = seen.iter().filter_map(|seen| seen.survey.as_ref()).collect();
    let tracks = names(&surveys);
    draft.tracks = tracks.iter().map(|(name, _)| (*name).to_owned()).collect();
    draft.follows = surveys.first().and_then(|first| times(first).0);
    draft.are_discs = surveys.first().is_some_and(|first| first.are_discs);
    let (is_film, lengths) = (first.kind == "tracks", Lengths::of(&surveys));
    lengths.describe_balls(&mut draft);
    if is_film && !draft.are_discs {
        draft.add("filmed balls", &[]);
    }
    if !draft.are_discs && !first.has_spins {
        draft.add("spin", &[]);
    }
    if !is_film {
        return Ok(draft);
    }
    let stated = surveys.first().and_then(|first| first.stated_fps).map(|fps| fps.to_string());
    let follows = draft.follows.map(|fps| ((1e4 * fps).round() / 1e4).to_string());
    match (stated, follows) {
        (Some(fps), _) => draft.add("stated rate", &[("fps", &fps)]),
        (None, Some(fps)) => draft.add("rate of the times", &[("fps", &fps)]),
        (None, None) => draft.add("rate", &[]),
    }
    lengths.describe_unit(&mut draft);
    if let [first, ..] = surveys[..] {
        describe_tracks(first, &tracks, &surveys, &mut draft);
    } else {
        describe_unknown(&first.file, &mut draft);
    }
    if let Some(table) = table {
        draft.add("table of shots", &[("table", &table.display().to_string())]);
        draft.set("shots", table.file_name().unwrap_or_default().to_string_lossy().into_owned());
    }
    Ok(draft)
}

/// Returns the names of the tracks of all files, each with the part of the time at which it moves.
fn names<'a>(surveys: &[&'a Survey]) -> Vec<(&'a str, f64)> {
    let mut names: Vec<(&str, f64)> = Vec::new();
    for (name, begin) in surveys.iter().flat_map(|survey| &survey.tracks) {
        if !names.iter().any(|(known, _)| known == name) {
            names.push((name, *begin));
        }
    }
    names
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

/// The lengths in the files.
struct Lengths {
    extent: f64,
    /// Least distance of the centres of two balls; infinite without balls.
    nearest: f64,
    stated: Option<&'static str>,
    /// The unit, stated or metres by the extent and the contact of balls.
    unit: Option<&'static str>,
}

impl Lengths {
    fn of(surveys: &[&Survey]) -> Self {
        let extent = surveys.iter().map(|survey| survey.extent).fold(0.0, f64::max);
        let nearest = surveys.iter().filter_map(|survey| survey.closest).fold(f64::INFINITY, f64::min);
        let are_discs = surveys.iter().any(|survey| survey.are_discs);
        let may_touch = are_discs || nearest.is_infinite() || DIAMETERS.contains(&nearest);
        let stated = surveys.first().and_then(|first| first.unit);
        let unit = stated.or((METRES.contains(&extent) && may_touch).then_some("m"));
        Self { extent, nearest, stated, unit }
    }

    /// Drafts the radius: at most half of the least distance of the centres, if the scale is known.
    fn describe_balls(&self, draft: &mut Draft) {
        let nearest = self.unit.and_then(metres).map(|metres| metres * self.nearest);
        let nearest = nearest.filter(|nearest| *nearest < DIAMETERS.end).unwrap_or(0.0);
        let near = format!("{:.1}", 1e3 * nearest);
        match BALLS.iter().find(|(_, radius)| *radius <= 0.5 * NEARER * nearest) {
            _ if draft.are_discs => draft.add("discs", &[]),
            Some((ball, radius)) => {
                let radius = radius.to_string();
                draft.add("balls", &[("ball", ball), ("radius", &radius), ("nearest", &near)]);
            }
            None => draft.add("pool balls", &[]),
        }
        draft.add("mass", &[]);
    }

    fn describe_unit(&self, draft: &mut Draft) {
        let words = [format!("{:.3}", self.extent), format!("{:.4}", self.nearest)];
        let words = [("extent", words[0].as_str()), ("nearest", words[1].as_str())];
        match (self.stated, self.unit) {
            (Some(unit), _) => draft.add("stated unit", &[("unit", unit)]),
            (None, Some(_)) => draft.add("metres", &words),
            (None, None) => draft.add("unit", &words),
        }
        if self.unit.is_none() && METRES.contains(&self.extent) {
            draft.add("no metres", &words);
        }
        draft.add("axis", &[]);
    }
}

fn describe_tracks(first: &Survey, tracks: &[(&str, f64)], surveys: &[&Survey], draft: &mut Draft) {
    /// Maximum number of problems shown.
    const MAX_PROBLEMS: usize = 3;
    let shots = surveys.iter().map(|survey| survey.shots).sum();
    let is_single = |survey: &&Survey| survey.tracks.len() == 1 && survey.shots == 1;
    let shots = if surveys.len() > 1 && surveys.iter().all(is_single) {
        "one ball each: two whose names differ by the ball only (kick-A.txt, kick-B.txt) are a shot"
            .to_owned()
    } else {
        count_of(shots, "shot")
    };
    let (count, is_known) = (count_of(surveys.len(), "file"), first.guess.columns.is_empty());
    let layout = if is_known { "auto" } else { "columns" };
    let words = [("count", count.as_str()), ("format", first.format), ("shots", &shots), ("layout", layout)];
    draft.add("format", &words);
    if let Some(unit) = times(first).1 {
        draft.add("time unit", &[("unit", unit)]);
    }
    let mut are_exchanged = false;
    if first.are_discs && is_known {
        draft.add("any disc", &[]);
    } else {
        are_exchanged = describe_balls(tracks, &first.guess, draft);
    }
    draft.add("shots", &[("columns", &KNOWN[1..].join(", "))]);
    if !is_known {
        describe_columns(&first.guess, are_exchanged, draft);
    }
    let problems: Vec<&String> = surveys.iter().flat_map(|survey| &survey.problems).collect();
    if !problems.is_empty() {
        draft.add("faults", &[("count", &problems.len().to_string())]);
        draft.found.extend(problems.iter().take(MAX_PROBLEMS).map(|problem| format!("  {problem}")));
    }
}

/// Names both balls; returns whether their columns must be exchanged, since object_x moves first.
fn describe_balls(tracks: &[(&str, f64)], guess: &Guess, draft: &mut Draft) -> bool {
    let listed: Vec<String> = tracks.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    let listed = listed.join(", ");
    draft.add("tracks", &[("tracks", &listed)]);
    let order = match tracks {
        [a, b] if a.1 + EARLIER < b.1 => Some([a.0, b.0]),
        [a, b] if b.1 + EARLIER < a.1 => Some([b.0, a.0]),
        _ => None,
    };
    // a table with a row per frame names the balls by its columns
    let column = order.and_then(|[cue, _]| guess.columns.get(&format!("{cue}_x"))).map(Column::shown);
    match (order, column) {
        (Some([cue, _]), Some(column)) => {
            // names such as cue and object are believed
            let is_believed = cue != "cue" && column.contains("obj");
            let so = if is_believed { "exchange cue and object below if it is" } else { "and so is" };
            draft.add("column moves first", &[("column", &column), ("so", so)]);
            return cue != "cue" && !is_believed;
        }
        (Some([cue, object]), None) => {
            draft.add("moves first", &[("cue", &toml(cue)), ("object", &toml(object))]);
        }
        (None, _) if guess.columns.contains_key("cue_x") => draft.add("undecided columns", &[]),
        (None, _) => draft.add("undecided", &[("tracks", &listed)]),
    }
    false
}

fn describe_columns(guess: &Guess, are_exchanged: bool, draft: &mut Draft) {
    draft.add("columns", &[]);
    for (key, column) in &guess.columns {
        // the keys in the same order, with the columns of the other ball
        let other = match key.split_once('_') {
            Some(("cue", rest)) if are_exchanged => guess.columns.get(&format!("object_{rest}")),
            Some(("object", rest)) if are_exchanged => guess.columns.get(&format!("cue_{rest}")),
            _ => None,
        };
        let line = format!("{key} = {}", other.unwrap_or(column).shown());
        if guess.is_doubtful(key) {
            draft.push(&format!("# {line}"), DOUBT);
        } else {
            draft.lines.push(line);
        }
    }
}

/// Shows the first lines of a table in no known format, and asks for the meaning of its columns.
fn describe_unknown(file: &Path, draft: &mut Draft) {
    /// Maximum number of lines shown, and of characters of each.
    const MAX_LINES: usize = 6;
    const MAX_CHARACTERS: usize = 160;
    draft.add("no format", &[("file", &file.display().to_string())]);
    draft.add("shots", &[("columns", &KNOWN[1..].join(", "))]);
    draft.add("lines", &[]);
    let bytes = std::fs::read(file).unwrap_or_default();
    for (_, line) in filled_lines(&decode(&bytes).0).take(MAX_LINES) {
        let short: String = line.chars().take(MAX_CHARACTERS).collect();
        draft.lines.push(format!("#   {short}{}", if short.len() < line.len() { "…" } else { "" }));
    }
    draft.add("unknown columns", &[]);
}
