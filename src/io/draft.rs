//! CSV files → a commented dataset.toml, with blanks for what the files do not show.

use std::path::{Path, PathBuf};

use super::Survey;
use super::draft_files::{Seen, is_shots_table, listed, look_at, numbers};
pub(crate) use super::draft_text::{Draft, InitError};
use super::draft_text::{NUMBER, TEXT, quoted};
use super::text::decode;
use super::tracking::shots_table::KNOWN;
use super::tracking::{Guess, Guessed, metres};
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

/// Question for the frame rate.
const ASKED_FPS: &str = "frames per second that the camera recorded at, not the playback rate";

/// Drafts the dataset.toml of files, or of the tables in folders; at least one is named.
///
/// # Errors
/// A file that cannot be read or is empty, or files of different kinds.
pub(crate) fn draft(named: &[PathBuf]) -> Result<Draft, InitError> {
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
    let surveys = seen.iter().filter_map(|(_, seen)| match seen {
        Seen::Tracks(survey) => Some(survey.as_ref()),
        _ => None,
    });
    let surveys: Vec<&Survey> = surveys.collect();
    draft.tracks = names(&surveys).into_iter().map(|(name, _)| name.to_owned()).collect();
    draft.follows = surveys.first().and_then(|first| times(first).0);
    draft.are_discs = surveys.first().is_some_and(|first| first.are_discs);
    draft.line("# Drafted by caromfit init. Lines with FILL IN need values that the files do not state.");
    let here = if draft.folder.as_os_str().is_empty() { Path::new(".") } else { &draft.folder };
    let name = std::path::absolute(here).unwrap_or_else(|_| here.to_path_buf());
    let name = name.file_name().map_or("my-data".into(), |name| name.to_string_lossy().into_owned());
    let first = &seen.first().ok_or_else(|| InitError::new(here, "holds no table"))?.1;
    draft.state("name", quoted(&name), "also the name of its folder under fits/");
    let kind = first.kind().0;
    draft.state("kind", quoted(kind), "");
    let listed = seen.iter().map(|(file, _)| {
        quoted(&file.strip_prefix(&draft.folder).unwrap_or(file).to_string_lossy().replace('\\', "/"))
    });
    let listed = listed.collect::<Vec<_>>().join(", ");
    draft.state("files", format!("[{listed}]"), "");
    draft.blank("cloth", "cloth", TEXT, "label of the cloth, for `caromfit compare`; optional");
    draft.blank("source", "source", TEXT, "who measured it, how, when; optional");
    let lengths = Lengths::of(&surveys);
    draft.line("\n[ball]");
    if draft.are_discs {
        draft.state(
            "shape",
            "\"disc\"",
            "what was followed are points on two discs, or discs with their angles",
        );
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
        if !matches!(first, Seen::Angles(true)) {
            draft.line("\n[cue_spin]");
            let why = "stun (it slides without turning), natural-roll (it rolls), measured, unknown";
            draft.blank("cue_spin", "assume", TEXT, why);
        }
    }
    if kind == "tracks" {
        describe_video(&surveys, &mut draft);
        lengths.describe_scale(&mut draft);
        draft.line("\n[tracks]");
        match surveys.first() {
            Some(first) => describe_tracks(first, &surveys, &mut draft),
            None => describe_unknown(&seen[0].0, &mut draft),
        }
        if let Some(table) = table {
            draft.find(format!("{}: what differs from shot to shot.", table.display()));
            draft.set("shots", table.file_name().unwrap_or_default().to_string_lossy().into_owned());
        }
        describe_problems(&surveys, &mut draft);
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
    let stated = surveys.first().and_then(|first| first.stated_fps);
    if let Some(fps) = stated {
        draft.find(format!("The file states {fps} frames per second."));
        return draft.state("capture_fps", format!("{fps:?}"), "as the file states");
    }
    let Some(fps) = draft.follows.map(|fps| (1e4 * fps).round() / 1e4) else {
        return draft.blank("capture_fps", "capture_fps", NUMBER, ASKED_FPS);
    };
    draft.find(format!("The times follow {fps} frames per second."));
    let why = format!("{ASKED_FPS}. The times in the files follow {fps} frames per second");
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
        let why = format!("a {ball} ball: the centres come as near as {:.1} mm", 1e3 * nearest);
        draft.find(format!(
            "The balls are taken as {ball} balls: the centres come as near as {:.1} mm.",
            1e3 * nearest
        ));
        draft.state("radius_m", radius.to_string(), why);
    }

    fn describe_scale(&self, draft: &mut Draft) {
        let &Self { extent, nearest, .. } = self;
        draft.line("\n[scale]");
        match (self.stated, self.unit) {
            (Some(unit), _) => draft.state("length_unit", quoted(unit), "as the file states"),
            (None, Some(unit)) => {
                let why = format!("the positions span {extent:.3}: metres, if the film was calibrated");
                draft.state("length_unit", quoted(unit), why);
            }
            (None, None) => {
                let why = format!(
                    "m, cm, mm, in, ft, or px (the balls are then the ruler, unless m_per_px = … or four [[scale.point]] are given); \
                     the positions span {extent:.3}"
                );
                draft.blank("length_unit", "length_unit", TEXT, why);
                if METRES.contains(&extent) {
                    draft.find(format!(
                        "The positions span {extent:.3}, but the centres come no nearer than {nearest:.4}, which is not the diameter of \
                         a ball in metres. If the unit is not known, write px: the balls are then the ruler."
                    ));
                }
            }
        }
        draft.state("y_axis", "\"up\"", "\"down\" if y grows downwards, as in pixels of a picture");
    }
}

fn describe_tracks(first: &Survey, surveys: &[&Survey], draft: &mut Draft) {
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
    let column = order.and_then(|(cue, _)| guess.column(&format!("{cue}_x"))).map(|column| column.shown());
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
        (None, _) if guess.column("cue_x").is_some() => {
            draft.line(
                "# which ball is the cue ball does not show: cue_x and cue_y, below, are to be its columns",
            );
        }
        (None, _) => {
            let why = format!(
                "which track is the cue ball; the files have {listed} (if it differs from shot to shot: column cue of {SHOTS})"
            );
            draft.blank("which ball is which", "cue", TEXT, why);
            draft.suggest("object", TEXT, "and which the object ball");
        }
    }
    false
}

fn describe_columns(guess: &Guess, are_exchanged: bool, draft: &mut Draft) {
    draft.find("In no known format: [tracks.columns] is guessed from the names of columns; check it.");
    draft.line("\n[tracks.columns]              # guessed: check it");
    for Guessed { key, column, doubt } in &guess.columns {
        // the keys in the same order, with the columns of the other ball
        let other = key.strip_prefix("cue_").map(|rest| format!("object_{rest}"));
        let other = other.or_else(|| key.strip_prefix("object_").map(|rest| format!("cue_{rest}")));
        let other = other.filter(|_| are_exchanged).and_then(|key| guess.column(&key));
        let column = other.unwrap_or(column).shown();
        match doubt {
            None => draft.state(key, column, ""),
            Some(why) => draft.suggest(key, column, *why),
        }
    }
    if let Some(unit) = guess.angle_unit {
        draft.state("angle_unit", quoted(unit.name()), "");
    }
}

fn describe_problems(surveys: &[&Survey], draft: &mut Draft) {
    /// Maximum number of problems shown.
    const MAX_PROBLEMS: usize = 3;
    let problems: Vec<&String> = surveys.iter().flat_map(|survey| &survey.problems).collect();
    if !problems.is_empty() {
        let shown: String =
            problems.iter().take(MAX_PROBLEMS).map(|problem| format!("\n  {problem}")).collect();
        draft.find(format!("To be corrected in the files ({} in all):{shown}", problems.len()));
    }
}

/// Shows the first lines of a table in no known format, and asks for the meaning of its columns.
fn describe_unknown(file: &Path, draft: &mut Draft) {
    /// Maximum number of lines of a header and of cells that are shown, and of characters.
    const MOST_HEADERS: usize = 6;
    const MOST_CELLS: usize = 30;
    const LONGEST: usize = 160;
    let cut = |text: &str| {
        let short: String = text.trim().chars().take(LONGEST).collect();
        if short.len() < text.trim().len() { short + "…" } else { short }
    };
    let bytes = std::fs::read(file).unwrap_or_default();
    let text = decode(&bytes).0;
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    // numbers in a header stand alone
    let is_row = |line: &&str| numbers(line) >= 3 && 2 * numbers(line) > line.split([',', ';', '\t']).count();
    let row = lines.iter().position(is_row);
    draft.find(format!(
        "{}: no known format. Say under [tracks.columns] which column is what, by its name or by its number, from 1 on.",
        file.display(),
    ));
    let why = "only of a table with one row per ball and frame: its name of the cue ball";
    draft.suggest("cue", TEXT, why);
    draft.suggest("object", TEXT, "and of the object ball");
    suggest_shots(draft);
    draft.line("# The names of the columns:");
    let header = &lines[..row.unwrap_or(lines.len().min(1))];
    for line in &header[header.len().saturating_sub(MOST_HEADERS)..] {
        draft.line(format!("#   {}", cut(line)));
    }
    if let Some(row) = row.map(|row| lines[row]) {
        let separator = [';', '\t', ','].into_iter().find(|c| row.contains(*c)).unwrap_or(' ');
        let cells = row.split(separator).filter(|cell| separator != ' ' || !cell.is_empty()).take(MOST_CELLS);
        let numbered: Vec<String> =
            (1..).zip(cells).map(|(i, cell): (usize, _)| format!("{i}: {}", cut(cell))).collect();
        draft.line(format!(
            "# The first row of numbers, with the number of each column:\n#   {}",
            numbered.join("  ")
        ));
    }
    draft.line("[tracks.columns]              # a column by its name, t = \"time\", or by its number, t = 1");
    let why = "time in seconds, or frame = …; without either, each row is a frame";
    draft.blank("which column is what", "t", NUMBER, why);
    draft.line("# One row per frame:\n# cue_x = …\n# cue_y = …\n# object_x = …\n# object_y = …");
    draft.line("# Or one row per ball and frame:\n# ball = …\n# x = …\n# y = …");
}
