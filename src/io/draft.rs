//! CSV files → a commented dataset.toml, with what the files do not tell left as marked blanks.

use std::path::{Path, PathBuf};

use super::draft_columns::{describe_columns, describe_guess, describe_problems};
use super::draft_files::{is_no_table, listed};
use super::draft_scale::Lengths;
pub use super::draft_text::{Draft, InitError};
use super::draft_text::{OBJECT, quoted};
use super::text::decode;
use super::tracking::shots_table::KNOWN;
use super::tracking::{TRACKER_PROJECT, is_tracker_project};
use super::{Survey, header, survey};
use crate::measurement::number::count_of;

/// What a file is.
enum Seen {
    Tracks(Box<Survey>),
    Impacts,
    /// Whether spins are among its columns.
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

    /// Returns whether it has a header, but nothing below it.
    fn is_empty(&self) -> bool {
        matches!(self, Self::Tracks(survey) if survey.tracks.is_empty() && survey.problems.is_empty())
    }
}

/// The table of what differs from shot to shot.
const SHOTS: &str = "shots.csv";

/// Looks at files, or at the tables in folders, at least one, and drafts the dataset.toml that goes with them.
///
/// # Errors
/// A file that cannot be read or is empty, or files of different kinds.
pub fn draft(named: &[PathBuf]) -> Result<Draft, InitError> {
    let mut files = listed(named)?;
    let is_shots = |file: &PathBuf| {
        file.file_name().is_some_and(|name| name.eq_ignore_ascii_case(SHOTS)) && tells_of_shots(file)
    };
    let table = if files.len() > 1 { files.iter().position(is_shots).map(|i| files.remove(i)) } else { None };
    let Looked { seen, left_out } = look_at(&files)?;
    let folder = match named {
        // the tables may all be in one folder of it
        [folder] if folder.is_dir() => folder.clone(),
        _ => common_folder(&seen),
    };
    let tracks = seen.iter().filter_map(|(file, seen)| match seen {
        Seen::Tracks(survey) => Some((file, survey.as_ref())),
        _ => None,
    });
    let tracks: Vec<(&PathBuf, &Survey)> = tracks.collect();
    let first = tracks.first().map(|(_, survey)| *survey);
    let are_discs = first.is_some_and(|survey| survey.are_discs);
    let mut draft = Draft {
        tracks: names(&tracks).into_iter().map(|(name, _)| name.to_owned()).collect(),
        follows: first.and_then(|survey| times(survey).0),
        are_discs,
        ..Draft::default()
    };
    for file in left_out {
        draft.find(format!(
            "{}: no table of positions or measurements, or one without rows; left out.",
            file.display()
        ));
    }
    draft.line("# Drafted by caromfit init. Lines that say FILL IN wait for what the files do not tell.");
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
    let name = std::path::absolute(here).unwrap_or_else(|_| folder.clone());
    let name = name.file_name().map_or("my-data".to_string(), |name| name.to_string_lossy().into_owned());
    draft.line(format!("name = {}          # also the name of its folder under fits/", quoted(&name)));
    let kind = seen.first().map_or("tracks", |(_, first)| first.kind().0);
    draft.line(format!("kind = \"{kind}\""));
    let within =
        |file: &PathBuf| file.strip_prefix(&folder).unwrap_or(file).to_string_lossy().replace('\\', "/");
    let listed: Vec<String> = seen.iter().map(|(file, _)| quoted(&within(file))).collect();
    draft.line(format!("files = [{}]", listed.join(", ")));
    draft.blank("cloth", "which cloth: `caromfit compare` tells cloths apart by it; optional");
    draft.blank("source", "who measured it, how, when; optional");
    let lengths = Lengths::of(&tracks);
    draft.line("\n[ball]");
    if are_discs {
        let why = "what was followed are points on two discs, or discs with their angles";
        draft.noted("shape = \"disc\"", why);
        let why = "of the discs; optional: else the tracks tell how far apart they are when they touch";
        draft.blank("radius_m", why);
        draft.blank("mass_kg", "of the first disc, and [object] mass_kg of the second; optional");
    } else {
        lengths.describe_radius(&mut draft);
        let why = "of the cue ball, and [object] mass_kg of the other, weighed to 0.1 g; optional";
        draft.noted("# mass_kg = …", why);
        if kind == "tracks" {
            draft.noted("# shape = \"disc\"", "pucks and coins, which slide and do not roll");
        }
        if !matches!(seen.first(), Some((_, Seen::Angles(true)))) {
            draft.line("\n[cue_spin]");
            let why = "stun (it slides without turning), natural-roll (it rolls), measured, unknown";
            draft.blank("cue_spin", why);
        }
    }
    if !tracks.is_empty() {
        describe_tracks(&tracks, &lengths, table.as_deref(), &mut draft);
    }
    if let Some((file, Seen::Unknown(names))) = seen.first() {
        describe_columns(file, names, &mut draft);
    }
    draft.sort_blanks();
    Ok(Draft { folder, ..draft })
}

/// The ball that moves first by this part of the film is the cue ball.
const EARLIER: f64 = 0.05;

/// What files are.
struct Looked {
    /// They are of one kind.
    seen: Vec<(PathBuf, Seen)>,
    /// Files that are left out: obviously no tables, or without rows.
    left_out: Vec<PathBuf>,
}

fn look_at(files: &[PathBuf]) -> Result<Looked, InitError> {
    let (mut seen, mut unclear): (Vec<(PathBuf, Seen)>, Vec<_>) = (Vec::new(), Vec::new());
    for file in files {
        match look(file) {
            Ok(now) if now.is_empty() || matches!(now, Seen::Unknown(_)) && is_no_table(file) => {
                unclear.push((file.clone(), Ok(now)));
            }
            Err(error) if is_no_table(file) => unclear.push((file.clone(), Err(error))),
            now => seen.push((file.clone(), now?)),
        }
    }
    let mut left_out = Vec::new();
    for (file, now) in unclear {
        // if there are only such files, what they are is to be said
        if seen.iter().all(|(_, seen)| matches!(seen, Seen::Unknown(_))) {
            seen.push((file, now?));
        } else {
            left_out.push(file);
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
    Ok(Looked { seen, left_out })
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
        let message = "is no text; expected a table of tracks or measurements, not the film itself, nor a workbook (save its sheet \
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

/// Returns whether a table is not of tracks or measurements but tells of shots what `[tracks]
/// shots` may.
fn tells_of_shots(file: &Path) -> bool {
    let names = header(file).unwrap_or_default();
    let has = |name: &str| names.iter().any(|own| own == name);
    has("shot") && KNOWN[1..].iter().any(|known| has(known)) && !["cut_deg", "nx", "x"].into_iter().any(has)
}

fn common_folder(files: &[(PathBuf, Seen)]) -> PathBuf {
    let holds_all = |folder: &&Path| files.iter().all(|(file, _)| file.starts_with(folder));
    let above = files.first().and_then(|(file, _)| file.ancestors().skip(1).find(holds_all));
    above.map(Path::to_path_buf).unwrap_or_default()
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
/// seconds, as what they are taken for.
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
    let single = all.len() > 1 && all.iter().all(|(_, survey)| survey.tracks.len() == 1 && survey.shots == 1);
    let what = if single {
        "one ball each: two that are named alike but for the ball (kick-A.txt, kick-B.txt) are a shot"
            .to_owned()
    } else {
        count_of(shots, "shot")
    };
    draft.find(format!("{} of tracks, format {}, {what}.", count_of(all.len(), "file"), first.format));
    draft.line("\n[video]");
    let (follows, time_unit) = times(first);
    if let Some(fps) = first.stated_fps {
        draft.find(format!("{} states {fps} frames per second.", file.display()));
        draft.line(format!("capture_fps = {fps:?}         # as the file states"));
    } else if let Some(fps) = follows {
        let fps = format!("{fps:.4}");
        let fps = fps.trim_end_matches('0').trim_end_matches('.');
        let follow = format!("The times follow {fps} frames per second.");
        draft.find(follow);
        let why = format!(
            "what the camera recorded at, not the playback rate. The times in the files follow {fps} frames per second"
        );
        draft.blank("capture_fps", why);
        let why =
            "take the # away if the camera recorded faster, so that these times are those of slow motion";
        draft.noted(format!("# playback_fps = {fps}"), why);
    } else {
        let in_frames = if first.in_frames { "; times are in frames" } else { "" };
        let why = format!("frames per second that the camera recorded at, not the playback rate{in_frames}");
        draft.blank("capture_fps", why);
    }
    lengths.describe_scale(draft);
    let mut exchanged = false;
    draft.line("\n[tracks]");
    draft.line(format!("format = \"{}\"", if first.guess.columns.is_empty() { "auto" } else { "columns" }));
    if let Some(unit) = time_unit {
        let are = if unit == "frames" { "numbers of frames" } else { unit };
        draft.find(format!("No film is as slow as the times are in seconds: taken as {are}."));
        let why = "in seconds the times would be those of a film far too slow: check it";
        draft.noted(format!("time_unit = \"{unit}\""), why);
    }
    if first.are_discs && first.guess.columns.is_empty() {
        draft.find("Points keep their distances in two groups: two discs.".to_string());
        draft.line("# cue and object are found for every shot: the disc that moves first is cue. Else: cue = [\"…\", \"…\", \"…\"]");
    } else {
        exchanged = describe_balls(all, draft);
    }
    if let Some(table) = table {
        draft.find(format!("{}: what differs from shot to shot.", table.display()));
        let name = table.file_name().unwrap_or_default().to_string_lossy();
        draft.line(format!("shots = {}", quoted(&name)));
    } else {
        let known = KNOWN[1..].join(", ");
        draft.line(format!("# shots = \"{SHOTS}\"         # optional: shot, and any of {known}"));
    }
    if let (Some(unit), None) = (first.guess.time_unit, time_unit) {
        let line = format!("time_unit = \"{}\"", unit.name());
        draft.noted(line, "as the steps of the times suggest: check it");
    }
    describe_guess(first, exchanged, draft);
    describe_problems(all, draft);
}

/// Names both balls; returns whether the columns that were guessed have to be exchanged, since the
/// ball of object_x moves first.
fn describe_balls(all: &[(&PathBuf, &Survey)], draft: &mut Draft) -> bool {
    let names = names(all);
    let listed: Vec<String> = names.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    draft.find(format!("Tracks: {}.", listed.join(", ")));
    let order = match names.as_slice() {
        [a, b] if a.1 + EARLIER < b.1 => Some((a.0, b.0)),
        [a, b] if b.1 + EARLIER < a.1 => Some((b.0, a.0)),
        _ => None,
    };
    // a table with a row per frame names the balls by its columns
    let guess = all.first().map(|(_, survey)| &survey.guess);
    let wide = guess.is_some_and(|guess| guess.column("cue_x").is_some());
    match order {
        Some((cue, _)) if wide => {
            let column = guess.and_then(|guess| guess.column(&format!("{cue}_x")));
            let column = column.map_or(String::new(), |column| column.shown());
            // names that say which ball it is are believed
            if cue != "cue" && column.contains("obj") {
                let first = format!("he ball of column {column} moves first");
                draft.find(format!("T{first}: is it the cue ball? Then exchange the columns."));
                draft.line(format!("# t{first}: exchange cue and object below if it is the cue ball"));
                return false;
            }
            draft.find(format!("The ball of column {column} moves first: taken as the cue ball."));
            draft.line(format!("# the ball of column {column} moves first, and so is the cue ball"));
            return cue != "cue";
        }
        Some((cue, object)) => {
            draft.find(format!("\"{cue}\" moves first: taken as the cue ball."));
            draft.line(format!("cue = {:<24} # it moves first", quoted(cue)));
            draft.line(format!("object = {}", quoted(object)));
        }
        None if wide => draft.line(
            "# which ball is the cue ball does not show: cue_x and cue_y, below, are to be its columns",
        ),
        None => {
            let why = format!(
                "which track is the cue ball; the files have {} (where it differs from shot to shot: column cue of {SHOTS})",
                listed.join(", ")
            );
            draft.blank("which ball is which", why);
            draft.noted(OBJECT, "and which the object ball");
        }
    }
    false
}
