//! CSV files → a commented dataset.toml, with blanks for what the files do not show.

use std::path::{Path, PathBuf};

use super::Survey;
use super::draft_files::{Seen, is_shots_table, listed, look_at, refused};
pub(crate) use super::draft_text::Draft;
use super::draft_text::{NUMBER, TEXT, quoted};
use super::error::Problem;
use super::text::{decode, filled_lines};
use super::tracking::shots_table::KNOWN;
use super::tracking::{Column, Guess, metres};
use crate::measurement::number::count_of;

/// Name of the table of properties of single shots.
const SHOTS: &str = "shots.csv";

/// Least difference of the times at which two balls begin to move, as a part of the film, for the
/// first to be the cue ball.
const EARLIER: f64 = 0.05;

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
    let seen = look_at(&files, &mut draft)?;
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
    let name = std::path::absolute(here).unwrap_or_else(|_| here.to_path_buf());
    let name = name.file_name().map_or("my-data".into(), |name| name.to_string_lossy().into_owned());
    let Some(first) = seen.first() else { return Err(refused(here, "holds no table")) };
    let surveys: Vec<&Survey> = seen.iter().filter_map(|seen| seen.survey.as_ref()).collect();
    draft.tracks = names(&surveys).into_iter().map(|(name, _)| name.to_owned()).collect();
    draft.follows = surveys.first().and_then(|first| times(first).0);
    draft.are_discs = surveys.first().is_some_and(|first| first.are_discs);
    draft.line("# Drafted by caromfit init. Lines with FILL IN need values that the files do not state.");
    draft.state("name", quoted(&name), "also the name of its folder under fits/");
    draft.state("kind", quoted(first.kind), "");
    let listed = seen.iter().map(|Seen { file, .. }| {
        quoted(&file.strip_prefix(&draft.folder).unwrap_or(file).to_string_lossy().replace('\\', "/"))
    });
    let listed = listed.collect::<Vec<_>>().join(", ");
    draft.state("files", format!("[{listed}]"), "");
    draft.suggest("cloth", TEXT, "label of the cloth, for `caromfit compare`; optional");
    draft.suggest("source", TEXT, "who measured it, how, when; optional");
    let lengths = Lengths::of(&surveys);
    draft.line("\n[ball]");
    if draft.are_discs {
        let why = "what was followed are points on two discs, or discs with their angles";
        draft.state("shape", "\"disc\"", why);
        let why = "of the discs; optional: otherwise estimated from the tracks at contact";
        draft.suggest("radius_m", NUMBER, why);
    } else {
        lengths.describe_radius(&mut draft);
    }
    let why = "of the first ball or disc, and [object] mass_kg of the other, weighed to 0.1 g; optional";
    draft.suggest("mass_kg", NUMBER, why);
    if first.kind == "tracks" && !draft.are_discs {
        draft.suggest("shape", "\"disc\"", "pucks and coins, which slide and do not roll");
    }
    if !draft.are_discs && !first.has_spins {
        draft.line("\n[cue_spin]");
        let why = "stun (it slides without turning), natural-roll (it rolls), measured, unknown";
        draft.blank("cue_spin", "assume", TEXT, why);
    }
    if first.kind == "tracks" {
        describe_video(&surveys, &mut draft);
        lengths.describe_scale(&mut draft);
        draft.line("\n[tracks]");
        if surveys.is_empty() {
            describe_unknown(&first.file, &mut draft);
        } else {
            describe_tracks(&surveys, &mut draft);
        }
        if let Some(table) = table {
            draft.find(format!("{}: what differs from shot to shot.", table.display()));
            draft.set("shots", table.file_name().unwrap_or_default().to_string_lossy().into_owned());
        }
    }
    Ok(draft)
}

fn names<'a>(surveys: &[&'a Survey]) -> Vec<(&'a str, f64)> {
    let mut names: Vec<(&str, f64)> = Vec::new();
    for (name, begin) in surveys.iter().flat_map(|survey| &survey.tracks) {
        if !names.iter().any(|(known, _)| known == name) {
            names.push((name, *begin));
        }
    }
    names
}

/// Returns the frame rate that the times follow, and their unit if it is not seconds: no film is as
/// slow as times in ms would be in seconds.
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

fn describe_video(surveys: &[&Survey], draft: &mut Draft) {
    draft.line("\n[video]");
    if let Some(fps) = surveys.first().and_then(|first| first.stated_fps) {
        draft.find(format!("The file states {fps} frames per second."));
        return draft.state("capture_fps", format!("{fps:?}"), "as the file states");
    }
    let why = "frames per second that the camera recorded at, not the playback rate";
    let Some(fps) = draft.follows.map(|fps| (1e4 * fps).round() / 1e4) else {
        return draft.blank("capture_fps", "capture_fps", NUMBER, why);
    };
    draft.find(format!("The times follow {fps} frames per second."));
    let why = format!("{why}. The times in the files follow {fps} frames per second");
    draft.blank("capture_fps", "capture_fps", NUMBER, why);
    let why = "take the # away if the camera recorded faster, so that these times are those of slow motion";
    draft.suggest("playback_fps", fps.to_string(), why);
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
    fn describe_radius(&self, draft: &mut Draft) {
        let nearest = self.unit.and_then(metres).map(|metres| metres * self.nearest);
        let nearest = nearest.filter(|nearest| *nearest < DIAMETERS.end).unwrap_or(0.0);
        let Some((ball, radius)) = BALLS.iter().find(|(_, radius)| *radius <= 0.5 * NEARER * nearest) else {
            let why = "a pool ball; carom 0.03075, snooker 0.02625: correct it if it is another";
            return draft.state("radius_m", "0.028575", why);
        };
        let why = format!("{ball} balls: the centres come as near as {:.1} mm", 1e3 * nearest);
        draft.find(format!("The balls are taken as {why}."));
        draft.state("radius_m", radius.to_string(), why);
    }

    fn describe_scale(&self, draft: &mut Draft) {
        let &Self { extent, nearest, .. } = self;
        draft.line("\n[scale]");
        if let Some(unit) = self.stated {
            draft.state("length_unit", quoted(unit), "as the file states");
        } else if let Some(unit) = self.unit {
            let why = format!("the positions span {extent:.3}: metres, if the film was calibrated");
            draft.state("length_unit", quoted(unit), why);
        } else {
            let units =
                "m, cm, mm, in, ft, or px (the balls are then the ruler, unless m_per_px = … is given)";
            let why = format!("{units}; the positions span {extent:.3}");
            draft.blank("length_unit", "length_unit", TEXT, why);
            if METRES.contains(&extent) {
                draft.find(format!(
                    "The positions span {extent:.3}, but the centres come no nearer than {nearest:.4}: not the diameter of a ball in \
                     metres. If the unit is not known, write px."
                ));
            }
        }
        draft.state("y_axis", "\"up\"", "\"down\" if y grows downwards, as in pixels of a picture");
    }
}

fn describe_tracks(surveys: &[&Survey], draft: &mut Draft) {
    /// Maximum number of problems shown.
    const MAX_PROBLEMS: usize = 3;
    let first = surveys[0];
    let shots: usize = surveys.iter().map(|survey| survey.shots).sum();
    let is_single = |survey: &&Survey| survey.tracks.len() == 1 && survey.shots == 1;
    let what = if surveys.len() > 1 && surveys.iter().all(is_single) {
        "one ball each: two whose names differ by the ball only (kick-A.txt, kick-B.txt) are a shot"
            .to_owned()
    } else {
        count_of(shots, "shot")
    };
    draft.find(format!("{} of tracks, format {}, {what}.", count_of(surveys.len(), "file"), first.format));
    let is_known = first.guess.columns.is_empty();
    draft.state("format", if is_known { "\"auto\"" } else { "\"columns\"" }, "");
    if let Some(unit) = times(first).1 {
        draft.find(format!("No film is as slow as the times are in seconds: taken as {unit}."));
        draft.state("time_unit", quoted(unit), "in seconds the film would be far too slow: check it");
    }
    let mut are_exchanged = false;
    if first.are_discs && is_known {
        draft.find("Points keep their distances in two groups: two discs.");
        draft.line("# cue and object are found for every shot: the disc that moves first is cue. Else: cue = [\"…\", \"…\", \"…\"]");
    } else {
        are_exchanged = describe_balls(&names(surveys), &first.guess, draft);
    }
    suggest_shots(draft);
    if !is_known {
        describe_columns(&first.guess, are_exchanged, draft);
    }
    let problems: Vec<&str> =
        surveys.iter().flat_map(|survey| &survey.problems).map(String::as_str).collect();
    if !problems.is_empty() {
        let shown = problems[..problems.len().min(MAX_PROBLEMS)].join("\n  ");
        draft.find(format!("To be corrected in the files ({} in all):\n  {shown}", problems.len()));
    }
}

fn suggest_shots(draft: &mut Draft) {
    draft.suggest("shots", quoted(SHOTS), format!("optional: shot, and any of {}", KNOWN[1..].join(", ")));
}

/// Names both balls; returns whether their columns must be exchanged, since object_x moves first.
fn describe_balls(names: &[(&str, f64)], guess: &Guess, draft: &mut Draft) -> bool {
    let listed: Vec<String> = names.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    let listed = listed.join(", ");
    draft.find(format!("Tracks: {listed}."));
    let order = match names {
        [a, b] if a.1 + EARLIER < b.1 => Some((a.0, b.0)),
        [a, b] if b.1 + EARLIER < a.1 => Some((b.0, a.0)),
        _ => None,
    };
    // a table with a row per frame names the balls by its columns
    let column = order.and_then(|(cue, _)| guess.columns.get(&format!("{cue}_x"))).map(Column::shown);
    match (order, column) {
        (Some((cue, _)), Some(column)) => {
            // names such as cue and object are believed
            let is_believed = cue != "cue" && column.contains("obj");
            let so = if is_believed { "exchange cue and object below if it is" } else { "and so is" };
            draft.find(format!("The ball of column {column} moves first."));
            draft.line(format!("# the ball of column {column} moves first, {so} the cue ball"));
            return cue != "cue" && !is_believed;
        }
        (Some((cue, object)), None) => {
            draft.find(format!("\"{cue}\" moves first: taken as the cue ball."));
            draft.state("cue", quoted(cue), "it moves first");
            draft.state("object", quoted(object), "");
        }
        (None, _) if guess.columns.contains_key("cue_x") => {
            draft
                .line("# the files leave open which ball is the cue ball, whose columns are cue_x and cue_y");
        }
        (None, _) => {
            let why =
                format!("which track is the cue ball, of {listed} (for each shot: column cue of {SHOTS})");
            draft.blank("which ball is which", "cue", TEXT, why);
            draft.suggest("object", TEXT, "and which the object ball");
        }
    }
    false
}

fn describe_columns(guess: &Guess, are_exchanged: bool, draft: &mut Draft) {
    draft.find("In no known format: [tracks.columns] is guessed from the names of columns; check it.");
    draft.line("\n[tracks.columns]              # guessed: check it");
    for (key, column) in &guess.columns {
        // the keys in the same order, with the columns of the other ball
        let other = match key.split_once('_') {
            Some(("cue", rest)) if are_exchanged => guess.columns.get(&format!("object_{rest}")),
            Some(("object", rest)) if are_exchanged => guess.columns.get(&format!("cue_{rest}")),
            _ => None,
        };
        let column = other.unwrap_or(column).shown();
        if guess.is_doubtful(key) {
            draft.suggest(key, column, DOUBT);
        } else {
            draft.state(key, column, "");
        }
    }
}

/// Shows the first lines of a table in no known format, and asks for the meaning of its columns.
fn describe_unknown(file: &Path, draft: &mut Draft) {
    /// Maximum number of lines shown, and of characters of each.
    const MAX_LINES: usize = 6;
    const MAX_CHARACTERS: usize = 160;
    let what = "Say under [tracks.columns] which column is what, by its name or by its number, from 1 on.";
    draft.find(format!("{}: no known format. {what}", file.display()));
    let why = "only of a table with one row per ball and frame: its name of the cue ball";
    draft.suggest("cue", TEXT, why);
    draft.suggest("object", TEXT, "and of the object ball");
    suggest_shots(draft);
    draft.line("# The first lines:");
    let bytes = std::fs::read(file).unwrap_or_default();
    for (_, line) in filled_lines(&decode(&bytes).0).take(MAX_LINES) {
        let short: String = line.chars().take(MAX_CHARACTERS).collect();
        draft.line(format!("#   {short}{}", if short.len() < line.len() { "…" } else { "" }));
    }
    draft.line("[tracks.columns]              # a column by its name, t = \"time\", or by its number, t = 1");
    let why = "time in seconds, or frame = …; without either, each row is a frame";
    draft.blank("which column is what", "t", NUMBER, why);
    draft.line("# One row per frame:\n# cue_x = …\n# cue_y = …\n# object_x = …\n# object_y = …");
    draft.line("# Or one row per ball and frame:\n# ball = …\n# x = …\n# y = …");
}
