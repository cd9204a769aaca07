//! CSV files → a commented dataset.toml, with what the files do not tell left as marked blanks.

use crate::measurement::number::count_of;
use std::path::{Path, PathBuf};

use super::draft_columns::{describe_columns, describe_guess, describe_problems};
pub use super::draft_error::InitError;
use super::draft_files::{is_no_table, listed};
use super::draft_scale::Lengths;
use super::draft_sheet::{BLANKS, OBJECT, Sheet, quoted};
use super::text::decode;
use super::tracking::is_tracker_project;
use super::tracking::shots_table::KNOWN;
use super::{Survey, header, survey};

/// A dataset.toml that was drafted.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// The folder that the draft belongs in: the one that holds all the files.
    pub folder: PathBuf,
    /// The text of the dataset.toml.
    pub text: String,
    /// What was found out about the files, in sentences.
    pub found: Vec<String>,
    /// The keys that have to be filled in, the most important first.
    pub blanks: Vec<&'static str>,
    /// The names of the tracks, in the order of first appearance.
    pub tracks: Vec<String>,
    /// Frames per second that the times in the files follow, where they are in seconds.
    pub follows: Option<f64>,
    /// Whether the files show discs, and not balls.
    pub are_discs: bool,
}

/// What a file is.
enum Seen {
    Tracks(Box<Survey>),
    Impacts,
    Angles {
        spin: bool,
    },
    /// The names of its columns.
    Unknown(Vec<String>),
}

impl Seen {
    /// Its kind in dataset.toml, and in words.
    fn kind(&self) -> (&'static str, &'static str) {
        match self {
            Self::Tracks(_) => ("tracks", "a file of tracks"),
            Self::Impacts => ("impacts", "a table of impacts"),
            Self::Angles { .. } => ("angles", "a table of angles"),
            Self::Unknown(_) => ("tracks", "in no known format"),
        }
    }

    /// Whether it has a header, but nothing below it.
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
    let mut sheet = Sheet::default();
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
    for file in left_out {
        sheet.find(format!(
            "{}: no table of positions or measurements, or one without rows; left out.",
            file.display()
        ));
    }
    let name = std::path::absolute(here).unwrap_or_else(|_| folder.clone());
    let name = name.file_name().map_or("my-data".to_string(), |name| name.to_string_lossy().into_owned());
    sheet.line(format!("name = {}          # also the name of its folder under fits/", quoted(&name)));
    let kind = seen.first().map_or("tracks", |(_, first)| first.kind().0);
    sheet.line(format!("kind = \"{kind}\""));
    let within =
        |file: &PathBuf| file.strip_prefix(&folder).unwrap_or(file).to_string_lossy().replace('\\', "/");
    let listed: Vec<String> = seen.iter().map(|(file, _)| quoted(&within(file))).collect();
    sheet.line(format!("files = [{}]", listed.join(", ")));
    sheet.blank("cloth", "which cloth: `caromfit compare` tells cloths apart by it; optional");
    sheet.blank("source", "who measured it, how, when; optional");
    let tracks = seen.iter().filter_map(|(file, seen)| match seen {
        Seen::Tracks(survey) => Some((file, survey.as_ref())),
        _ => None,
    });
    let tracks: Vec<(&PathBuf, &Survey)> = tracks.collect();
    let lengths = Lengths::of(&tracks);
    let are_discs = tracks.first().is_some_and(|(_, survey)| survey.are_discs);
    sheet.line("\n[ball]");
    if are_discs {
        sheet.noted(
            "shape = \"disc\"",
            "what was followed are points on two discs, or discs with their angles",
        );
        sheet.blank(
            "radius_m",
            "of the discs; optional: else the tracks tell how far apart they are when they touch",
        );
        sheet.blank("mass_kg", "of the first disc, and [object] mass_kg of the second; optional");
    } else {
        lengths.describe_radius(&mut sheet);
        sheet.noted(
            "# mass_kg = …",
            "of the cue ball, and [object] mass_kg of the other, weighed to 0.1 g; optional",
        );
        if kind == "tracks" {
            sheet.noted("# shape = \"disc\"", "pucks and coins, which slide and do not roll");
        }
    }
    let spins = matches!(seen.first(), Some((_, Seen::Angles { spin: true })));
    if !spins && !are_discs {
        sheet.line("\n[cue_spin]");
        sheet.blank(
            "cue_spin",
            "stun (it slides without turning), natural-roll (it rolls), measured, unknown",
        );
    }
    if !tracks.is_empty() {
        describe_tracks(&tracks, &lengths, table.as_deref(), &mut sheet);
    }
    if let Some((file, Seen::Unknown(names))) = seen.first() {
        describe_columns(file, names, &mut sheet);
    }
    let Sheet { text, found, mut blanks } = sheet;
    blanks.sort_by_key(|blank| BLANKS.iter().position(|(known, _)| known == blank).unwrap_or(BLANKS.len()));
    let head = "# Drafted by caromfit init. Lines that say FILL IN wait for what the files do not tell.\n";
    let names = names(&tracks).into_iter().map(|(name, _)| name.to_owned()).collect();
    let follows = tracks.first().and_then(|(_, survey)| times(survey).0);
    Ok(Draft { folder, text: format!("{head}{text}"), found, blanks, tracks: names, follows, are_discs })
}

/// The ball that moves first by this part of the film is the cue ball.
const EARLIER: f64 = 0.05;

/// What files are.
struct Looked {
    /// They are of one kind.
    seen: Vec<(PathBuf, Seen)>,
    /// Those that are left out: obviously no tables, or without rows.
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
        // nothing but such files: what they are is to be said
        if seen.is_empty() || seen.iter().all(|(_, seen)| matches!(seen, Seen::Unknown(_))) {
            seen.push((file, now?));
        } else {
            left_out.push(file);
        }
    }
    if let Some((other_path, other)) = seen.first()
        && let Some((path, now)) = seen.iter().find(|(_, now)| now.kind() != other.kind())
    {
        let [(_, what), (_, other)] = [now, other].map(Seen::kind);
        return Err(InitError::Mixed { path: path.clone(), what, other_path: other_path.clone(), other });
    }
    Ok(Looked { seen, left_out })
}

fn look(file: &Path) -> Result<Seen, InitError> {
    let unread = |source| InitError::Read { path: file.to_path_buf(), source };
    if is_tracker_project(file, &decode(&std::fs::read(file).map_err(unread)?).0) {
        return Err(InitError::TrackerProject { path: file.to_path_buf() });
    }
    let names = header(file).map_err(unread)?;
    if names.is_empty() {
        return Err(InitError::Empty { path: file.to_path_buf() });
    }
    if names.iter().any(|name| name.contains(|c: char| c == char::REPLACEMENT_CHARACTER || c.is_control())) {
        return Err(InitError::NoText { path: file.to_path_buf() });
    }
    let has = |name: &str| names.iter().any(|n| n == name);
    if has("nx") && has("ny") && has("cue_vx") {
        return Ok(Seen::Impacts);
    }
    if has("cut_deg") {
        return Ok(Seen::Angles { spin: has("cue_spin") || has("omega_x") });
    }
    match survey(file) {
        Ok(survey) => Ok(Seen::Tracks(Box::new(survey))),
        Err(problems) if names.first().is_some_and(|name| name.starts_with(['{', '['])) => {
            let why = problems.first().map_or(String::new(), |first| first.to_string());
            Err(InitError::Json { path: file.to_path_buf(), why })
        }
        Err(_) => Ok(Seen::Unknown(names)),
    }
}

/// Whether a table is not of tracks or measurements but tells of shots what `[tracks] shots` may.
fn tells_of_shots(file: &Path) -> bool {
    let names = header(file).unwrap_or_default();
    let has = |name: &str| names.iter().any(|own| own == name);
    has("shot")
        && KNOWN.iter().any(|known| *known != "shot" && has(known))
        && !has("cut_deg")
        && !has("nx")
        && !has("x")
}

fn common_folder(files: &[(PathBuf, Seen)]) -> PathBuf {
    let holds_all = |folder: &&Path| files.iter().all(|(file, _)| file.starts_with(folder));
    let above = files.first().and_then(|(file, _)| file.ancestors().skip(1).find(holds_all));
    above.map(Path::to_path_buf).unwrap_or_default()
}

/// The names of all tracks in the order of first appearance, with the part of the time at which each begins to move.
fn names<'a>(all: &[(&PathBuf, &'a Survey)]) -> Vec<(&'a str, f64)> {
    let mut names: Vec<(&str, f64)> = Vec::new();
    for (name, begin) in all.iter().flat_map(|(_, survey)| &survey.tracks) {
        if !names.iter().any(|(known, _)| known == name) {
            names.push((name, *begin));
        }
    }
    names
}

/// Frames per second that the times follow, and their unit where they cannot be in seconds, as what they are taken for.
fn times(survey: &Survey) -> (Option<f64>, Option<&'static str>) {
    /// No film of balls has fewer.
    const LEAST_FPS: f64 = 2.0;
    match survey.times_fps {
        Some(fps) if (fps - 1.0).abs() < 1e-3 => (None, Some("frames")),
        Some(fps) if fps < 1e-3 * LEAST_FPS => (Some(1e6 * fps), Some("us")),
        Some(fps) if fps < LEAST_FPS => (Some(1e3 * fps), Some("ms")),
        fps => (fps, None),
    }
}

fn describe_tracks(all: &[(&PathBuf, &Survey)], lengths: &Lengths, table: Option<&Path>, sheet: &mut Sheet) {
    let Some((file, first)) = all.first().copied() else { return };
    let shots: usize = all.iter().map(|(_, survey)| survey.shots).sum();
    let single = all.len() > 1 && all.iter().all(|(_, survey)| survey.tracks.len() == 1 && survey.shots == 1);
    let what = if single {
        "one ball each: two that are named alike but for the ball (kick-A.txt, kick-B.txt) are a shot"
            .to_owned()
    } else {
        count_of(shots, "shot")
    };
    sheet.find(format!("{} of tracks, format {}, {what}.", count_of(all.len(), "file"), first.format));
    sheet.line("\n[video]");
    let (follows, time_unit) = times(first);
    match (first.stated_fps, follows) {
        (Some(fps), _) => {
            sheet.find(format!("{} states {fps} frames per second.", file.display()));
            sheet.line(format!("capture_fps = {fps:?}         # as the file states"));
        }
        (None, Some(fps)) => {
            let fps = format!("{fps:.4}");
            let fps = fps.trim_end_matches('0').trim_end_matches('.');
            sheet.find(format!("The times follow {fps} frames per second."));
            let why = format!(
                "what the camera recorded at, not the playback rate. The times in the files follow {fps} frames per second"
            );
            sheet.blank("capture_fps", why);
            sheet.noted(
                format!("# playback_fps = {fps}"),
                "take the # away if the camera recorded faster, so that these times are those of slow motion",
            );
        }
        (None, None) => {
            let in_frames = if first.in_frames { "; times are in frames" } else { "" };
            let why =
                format!("frames per second that the camera recorded at, not the playback rate{in_frames}");
            sheet.blank("capture_fps", why);
        }
    }
    lengths.describe_scale(sheet);
    let mut exchanged = false;
    sheet.line("\n[tracks]");
    sheet.line(format!("format = \"{}\"", if first.guess.columns.is_empty() { "auto" } else { "columns" }));
    if let Some(unit) = time_unit {
        let are = if unit == "frames" { "numbers of frames" } else { unit };
        sheet.find(format!("No film is as slow as the times are in seconds: taken as {are}."));
        let why = "in seconds the times would be those of a film far too slow: check it";
        sheet.noted(format!("time_unit = \"{unit}\""), why);
    }
    if first.are_discs && first.guess.columns.is_empty() {
        sheet.find("Points keep their distances in two groups: two discs.".to_string());
        sheet.line("# cue and object are found for every shot: the disc that moves first is cue. Else: cue = [\"…\", \"…\", \"…\"]");
    } else {
        exchanged = describe_balls(all, sheet);
    }
    if let Some(table) = table {
        sheet.find(format!("{}: what differs from shot to shot.", table.display()));
        let name = table.file_name().unwrap_or_default().to_string_lossy();
        sheet.line(format!("shots = {}", quoted(&name)));
    } else {
        sheet.line(format!(
            "# shots = \"{SHOTS}\"         # optional: shot, and any of {}",
            KNOWN[1..].join(", ")
        ));
    }
    if let (Some(unit), None) = (first.guess.time_unit, time_unit) {
        let line = format!("time_unit = \"{}\"", unit.name());
        sheet.noted(line, "as the steps of the times suggest: check it");
    }
    describe_guess(first, exchanged, sheet);
    describe_problems(all, sheet);
}

/// Names both balls; whether the columns that were guessed have to be exchanged, since the ball of object_x moves first.
fn describe_balls(all: &[(&PathBuf, &Survey)], sheet: &mut Sheet) -> bool {
    let names = names(all);
    let listed: Vec<String> = names.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    sheet.find(format!("Tracks: {}.", listed.join(", ")));
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
                sheet.find(format!(
                    "The ball of column {column} moves first: is it the cue ball? Then exchange the columns."
                ));
                sheet.line(format!("# the ball of column {column} moves first: exchange cue and object below if it is the cue ball"));
                return false;
            }
            sheet.find(format!("The ball of column {column} moves first: taken as the cue ball."));
            sheet.line(format!("# the ball of column {column} moves first, and so is the cue ball"));
            return cue != "cue";
        }
        None if wide => {
            sheet.line(
                "# which ball is the cue ball does not show: cue_x and cue_y, below, are to be its columns",
            );
        }
        Some((cue, object)) => {
            sheet.find(format!("\"{cue}\" moves first: taken as the cue ball."));
            sheet.line(format!("cue = {:<24} # it moves first", quoted(cue)));
            sheet.line(format!("object = {}", quoted(object)));
        }
        None => {
            let why = format!(
                "which track is the cue ball; the files have {} (where it differs from shot to shot: column cue of {SHOTS})",
                listed.join(", ")
            );
            sheet.blank("which ball is which", why);
            sheet.noted(OBJECT, "and which the object ball");
        }
    }
    false
}
