//! CSV files → a commented dataset.toml, with blanks for what the files do not show.

use std::path::{Path, PathBuf};

use super::draft_files::{is_no_table, listed};
use super::draft_scale::Lengths;
pub use super::draft_text::{Draft, InitError};
use super::draft_text::{NUMBER, TEXT, quoted};
use super::text::decode;
use super::tracking::shots_table::KNOWN;
use super::tracking::{Guessed, TRACKER_PROJECT, is_tracker_project};
use super::{Survey, draft_unknown, header, survey};
use crate::measurement::number::count_of;

/// The content of a file.
enum Seen {
    Tracks(Box<Survey>),
    Impacts,
    /// Whether it has columns of spins.
    Angles(bool),
    /// The names of its columns.
    Unknown(Vec<String>),
}

impl Seen {
    /// Returns its kind in dataset.toml, and in words.
    fn kind(&self) -> (&'static str, &'static str) {
        match self {
            Self::Tracks(_) => ("tracks", "a file of tracks"),
            Self::Impacts => ("impacts", "a table of impacts"),
            Self::Angles(_) => ("angles", "a table of angles"),
            Self::Unknown(_) => ("tracks", "in no known format"),
        }
    }

    /// Returns whether it has a header, but no rows.
    fn is_empty(&self) -> bool {
        matches!(self, Self::Tracks(survey) if survey.tracks.is_empty() && survey.problems.is_empty())
    }
}

/// Name of the table of properties of single shots.
const SHOTS: &str = "shots.csv";

/// Least difference of the times at which two balls begin to move, as a part of the film, for the
/// first to be the cue ball.
const EARLIER: f64 = 0.05;

/// Drafts the dataset.toml of files, or of the tables in folders; at least one is named.
///
/// # Errors
/// A file that cannot be read or is empty, or files of different kinds.
pub fn draft(named: &[PathBuf]) -> Result<Draft, InitError> {
    let mut files = listed(named)?;
    let is_shots = |file: &PathBuf| {
        file.file_name().is_some_and(|name| name.eq_ignore_ascii_case(SHOTS)) && is_shots_table(file)
    };
    let table = if files.len() > 1 { files.iter().position(is_shots).map(|i| files.remove(i)) } else { None };
    let mut draft = Draft::default();
    let seen = look_at(&files, &mut draft)?;
    draft.folder = match named {
        // also if all tables are in one of its subfolders
        [folder] if folder.is_dir() => folder.clone(),
        _ => {
            let holds_all = |folder: &&Path| seen.iter().all(|(file, _)| file.starts_with(folder));
            let above = seen.first().and_then(|(file, _)| file.ancestors().skip(1).find(holds_all));
            above.map(Path::to_path_buf).unwrap_or_default()
        }
    };
    let tracks = seen.iter().filter_map(|(file, seen)| match seen {
        Seen::Tracks(survey) => Some((file, survey.as_ref())),
        _ => None,
    });
    let tracks: Vec<(&PathBuf, &Survey)> = tracks.collect();
    if let Some((_, first)) = tracks.first() {
        draft.tracks = names(&tracks).into_iter().map(|(name, _)| name.to_owned()).collect();
        draft.follows = times(first).0;
        draft.are_discs = first.are_discs;
    }
    draft.line("# Drafted by caromfit init. Lines with FILL IN need values that the files do not state.");
    let here = if draft.folder.as_os_str().is_empty() { Path::new(".") } else { &draft.folder };
    let name = std::path::absolute(here).unwrap_or_else(|_| here.to_path_buf());
    let name = name.file_name().map_or("my-data".into(), |name| name.to_string_lossy());
    draft.state("name", quoted(&name), "also the name of its folder under fits/");
    let kind = seen.first().map_or("tracks", |(_, first)| first.kind().0);
    draft.state("kind", quoted(kind), "");
    let listed = seen.iter().map(|(file, _)| {
        quoted(&file.strip_prefix(&draft.folder).unwrap_or(file).to_string_lossy().replace('\\', "/"))
    });
    let listed = listed.collect::<Vec<_>>().join(", ");
    draft.state("files", format!("[{listed}]"), "");
    let why = "label of the cloth, for `caromfit compare`; optional";
    draft.blank("cloth", "cloth", TEXT, why);
    draft.blank("source", "source", TEXT, "who measured it, how, when; optional");
    let surveys: Vec<&Survey> = tracks.iter().map(|(_, survey)| *survey).collect();
    let lengths = Lengths::of(&surveys);
    draft.line("\n[ball]");
    if draft.are_discs {
        let why = "what was followed are points on two discs, or discs with their angles";
        draft.state("shape", "\"disc\"", why);
        let why = "of the discs; optional: otherwise estimated from the tracks at contact";
        draft.blank("radius_m", "radius_m", NUMBER, why);
        let why = "of the first disc, and [object] mass_kg of the second; optional";
        draft.blank("mass_kg", "mass_kg", NUMBER, why);
    } else {
        lengths.describe_radius(&mut draft);
        let why = "of the cue ball, and [object] mass_kg of the other, weighed to 0.1 g; optional";
        draft.suggest("mass_kg", NUMBER, why);
        if kind == "tracks" {
            draft.suggest("shape", "\"disc\"", "pucks and coins, which slide and do not roll");
        }
        if !matches!(seen.first(), Some((_, Seen::Angles(true)))) {
            draft.line("\n[cue_spin]");
            let why = "stun (it slides without turning), natural-roll (it rolls), measured, unknown";
            draft.blank("cue_spin", "assume", TEXT, why);
        }
    }
    if !tracks.is_empty() {
        describe_tracks(&tracks, &lengths, table.as_deref(), &mut draft);
    }
    if let Some((file, Seen::Unknown(names))) = seen.first() {
        draft_unknown::describe(file, names, &mut draft);
    }
    Ok(draft)
}

/// Returns the files of one kind; obviously wrong or empty ones are left out if others remain.
fn look_at(files: &[PathBuf], draft: &mut Draft) -> Result<Vec<(PathBuf, Seen)>, InitError> {
    let (mut seen, mut unclear): (Vec<(PathBuf, Seen)>, Vec<_>) = (Vec::new(), Vec::new());
    for file in files {
        let now = look(file);
        let is_unclear = match &now {
            Ok(now) => now.is_empty() || matches!(now, Seen::Unknown(_)) && is_no_table(file),
            Err(_) => is_no_table(file),
        };
        if is_unclear { unclear.push((file, now)) } else { seen.push((file.clone(), now?)) }
    }
    for (file, now) in unclear {
        if seen.iter().all(|(_, seen)| matches!(seen, Seen::Unknown(_))) {
            seen.push((file.clone(), now?));
        } else {
            draft.find(format!(
                "{}: no table of positions or measurements, or one without rows; left out.",
                file.display()
            ));
        }
    }
    if let Some((other_path, other)) = seen.first()
        && let Some((path, now)) = seen.iter().find(|(_, now)| now.kind() != other.kind())
    {
        let [(_, what), (_, other)] = [now, other].map(Seen::kind);
        let other_path = other_path.display();
        let message = format!(
            "is {what}, but {other_path} is {other}; expected files of one kind: name those of one data set"
        );
        return Err(InitError::new(path, message));
    }
    Ok(seen)
}

fn look(file: &Path) -> Result<Seen, InitError> {
    let bytes = std::fs::read(file).map_err(|error| InitError::unread(file, &error))?;
    if is_tracker_project(file, &decode(&bytes).0) {
        return Err(InitError::new(file, TRACKER_PROJECT));
    }
    let names = header(file).map_err(|error| InitError::unread(file, &error))?;
    if names.is_empty() {
        return Err(InitError::new(file, "is empty; expected a table of tracks or measurements"));
    }
    if names.iter().any(|name| name.contains(|c: char| c == char::REPLACEMENT_CHARACTER || c.is_control())) {
        let message = "is not text; expected a table of tracks or measurements, not the film itself, nor a workbook (save its sheet \
                       as CSV)";
        return Err(InitError::new(file, message));
    }
    let has = |name: &str| names.iter().any(|n| n == name);
    if has("nx") && has("ny") && has("cue_vx") {
        return Ok(Seen::Impacts);
    }
    if has("cut_deg") {
        return Ok(Seen::Angles(has("cue_spin") || has("omega_x")));
    }
    match survey(file) {
        Ok(survey) => Ok(Seen::Tracks(Box::new(survey))),
        Err(problems) if names.first().is_some_and(|name| name.starts_with(['{', '['])) => {
            let why = problems.first().map_or(String::new(), |first| first.to_string());
            let message = format!(
                "is JSON; expected a table (CSV, tab-separated or text) of tracks or measurements, or an array of shots, each with \
                 balls, each with samples of t (or frame), x and y\n  {why}"
            );
            Err(InitError::new(file, message))
        }
        Err(_) => Ok(Seen::Unknown(names)),
    }
}

/// Returns whether a table is one of shots, as `[tracks] shots` names it, and not of measurements.
fn is_shots_table(file: &Path) -> bool {
    let names = header(file).unwrap_or_default();
    let has = |name: &str| names.iter().any(|own| own == name);
    has("shot") && KNOWN[1..].iter().any(|known| has(known)) && !["cut_deg", "nx", "x"].into_iter().any(has)
}

/// Returns the names of all tracks in the order of first appearance, with the part of the time at
/// which each begins to move.
fn names<'a>(all: &[(&PathBuf, &'a Survey)]) -> Vec<(&'a str, f64)> {
    let mut names: Vec<(&str, f64)> = Vec::new();
    for (name, begin) in all.iter().flat_map(|(_, survey)| &survey.tracks) {
        if !names.iter().any(|(known, _)| known == name) {
            names.push((name, *begin));
        }
    }
    names
}

/// Returns the frames per second that the times follow, and their unit if they cannot be in
/// seconds.
fn times(survey: &Survey) -> (Option<f64>, Option<&'static str>) {
    /// Least frame rate of a film of balls.
    const LEAST_FPS: f64 = 2.0;
    match survey.times_fps {
        Some(fps) if (fps - 1.0).abs() < 1e-3 => (None, Some("frames")),
        Some(fps) if fps < 1e-3 * LEAST_FPS => (Some(1e6 * fps), Some("us")),
        Some(fps) if fps < LEAST_FPS => (Some(1e3 * fps), Some("ms")),
        fps => (fps, None),
    }
}

fn describe_tracks(all: &[(&PathBuf, &Survey)], lengths: &Lengths, table: Option<&Path>, draft: &mut Draft) {
    let Some((file, first)) = all.first().copied() else { return };
    let shots: usize = all.iter().map(|(_, survey)| survey.shots).sum();
    let are_single =
        all.len() > 1 && all.iter().all(|(_, survey)| survey.tracks.len() == 1 && survey.shots == 1);
    let what = if are_single {
        "one ball each: two whose names differ by the ball only (kick-A.txt, kick-B.txt) are a shot"
            .to_owned()
    } else {
        count_of(shots, "shot")
    };
    draft.find(format!("{} of tracks, format {}, {what}.", count_of(all.len(), "file"), first.format));
    draft.line("\n[video]");
    let (follows, time_unit) = times(first);
    let asked = "frames per second that the camera recorded at, not the playback rate";
    if let Some(fps) = first.stated_fps {
        draft.find(format!("{} states {fps} frames per second.", file.display()));
        draft.state("capture_fps", format!("{fps:?}"), "as the file states");
    } else if let Some(fps) = follows.map(|fps| (1e4 * fps).round() / 1e4) {
        draft.find(format!("The times follow {fps} frames per second."));
        let why = format!("{asked}. The times in the files follow {fps} frames per second");
        draft.blank("capture_fps", "capture_fps", NUMBER, why);
        let why =
            "take the # away if the camera recorded faster, so that these times are those of slow motion";
        draft.suggest("playback_fps", fps.to_string(), why);
    } else {
        let in_frames = if first.in_frames { "; times are in frames" } else { "" };
        draft.blank("capture_fps", "capture_fps", NUMBER, format!("{asked}{in_frames}"));
    }
    lengths.describe_scale(draft);
    draft.line("\n[tracks]");
    let is_known = first.guess.columns.is_empty();
    draft.state("format", if is_known { "\"auto\"" } else { "\"columns\"" }, "");
    if let Some(unit) = time_unit {
        let are = if unit == "frames" { "numbers of frames" } else { unit };
        draft.find(format!("No film is as slow as the times are in seconds: taken as {are}."));
        let why = "in seconds the times would be those of a film far too slow: check it";
        draft.state("time_unit", quoted(unit), why);
    }
    let mut are_exchanged = false;
    if first.are_discs && is_known {
        draft.find("Points keep their distances in two groups: two discs.");
        draft.line("# cue and object are found for every shot: the disc that moves first is cue. Else: cue = [\"…\", \"…\", \"…\"]");
    } else {
        are_exchanged = describe_balls(all, draft);
    }
    if let Some(table) = table {
        draft.find(format!("{}: what differs from shot to shot.", table.display()));
        draft.state("shots", quoted(&table.file_name().unwrap_or_default().to_string_lossy()), "");
    } else {
        let why = format!("optional: shot, and any of {}", KNOWN[1..].join(", "));
        draft.suggest("shots", quoted(SHOTS), why);
    }
    if !is_known {
        describe_columns(first, are_exchanged, draft);
    }
    describe_problems(all, draft);
}

/// Names both balls; returns whether their columns must be exchanged, since object_x moves first.
fn describe_balls(all: &[(&PathBuf, &Survey)], draft: &mut Draft) -> bool {
    let names = names(all);
    let listed: Vec<String> = names.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    let listed = listed.join(", ");
    draft.find(format!("Tracks: {listed}."));
    let order = match names.as_slice() {
        [a, b] if a.1 + EARLIER < b.1 => Some((a.0, b.0)),
        [a, b] if b.1 + EARLIER < a.1 => Some((b.0, a.0)),
        _ => None,
    };
    // a table with a row per frame names the balls by its columns
    let guess = all.first().map(|(_, survey)| &survey.guess);
    let is_wide = guess.is_some_and(|guess| guess.column("cue_x").is_some());
    match order {
        Some((cue, _)) if is_wide => {
            let column = guess.and_then(|guess| guess.column(&format!("{cue}_x")));
            let first =
                format!("he ball of column {}", column.map_or(String::new(), |column| column.shown()));
            // names such as cue and object are believed
            let is_believed = cue != "cue" && first.contains("obj");
            let so = if is_believed {
                "exchange the columns if it is the cue ball"
            } else {
                "taken as the cue ball"
            };
            draft.find(format!("T{first} moves first: {so}."));
            let so = if is_believed { "exchange cue and object below if it is" } else { "and so is" };
            draft.line(format!("# t{first} moves first, {so} the cue ball"));
            return cue != "cue" && !is_believed;
        }
        Some((cue, object)) => {
            draft.find(format!("\"{cue}\" moves first: taken as the cue ball."));
            draft.state("cue", quoted(cue), "it moves first");
            draft.state("object", quoted(object), "");
        }
        None if is_wide => draft.line(
            "# which ball is the cue ball does not show: cue_x and cue_y, below, are to be its columns",
        ),
        None => {
            let why = format!(
                "which track is the cue ball; the files have {listed} (if it differs from shot to shot: column cue of {SHOTS})"
            );
            draft.blank("which ball is which", "cue", TEXT, why);
            draft.suggest("object", TEXT, "and which the object ball");
        }
    }
    false
}

/// Drafts `[tracks.columns]` as it was guessed, with the columns of both balls exchanged or not.
fn describe_columns(Survey { guess, .. }: &Survey, are_exchanged: bool, draft: &mut Draft) {
    draft.find("In no known format: [tracks.columns] is guessed from the names of columns; check it.");
    if !guess.passed.is_empty() {
        draft.find(format!("No positions of balls, and passed over: {}.", guess.passed.join(", ")));
    }
    draft.line("\n[tracks.columns]              # guessed: check it");
    for Guessed { key, column, doubt } in &guess.columns {
        // the keys in the same order, with the columns of the other ball
        let other = key.strip_prefix("cue_").map(|rest| format!("object_{rest}"));
        let other = other.or_else(|| key.strip_prefix("object_").map(|rest| format!("cue_{rest}")));
        let other = other.filter(|_| are_exchanged).and_then(|key| guess.column(&key));
        let column = other.unwrap_or(column).shown();
        match doubt {
            None => draft.state(key, column, ""),
            Some(why) => draft.suggest(key, column, why),
        }
    }
    if let Some(unit) = guess.angle_unit {
        draft.state("angle_unit", quoted(unit.name()), "");
    }
}

/// Lists cells and rows that have to be corrected in the files before they can be read.
fn describe_problems(all: &[(&PathBuf, &Survey)], draft: &mut Draft) {
    /// Maximum number of problems shown.
    const MAX_PROBLEMS: usize = 3;
    let problems: Vec<&String> = all.iter().flat_map(|(_, survey)| &survey.problems).collect();
    if problems.is_empty() {
        return;
    }
    let more = problems.len().saturating_sub(MAX_PROBLEMS);
    let more = if more > 0 { format!(" (and {more} more)") } else { String::new() };
    let shown: String = problems.iter().take(MAX_PROBLEMS).map(|problem| format!("\n  {problem}")).collect();
    draft.find(format!("To be corrected in the files{more}:{shown}"));
}
