//! CSV files → a commented dataset.toml, with what the files do not tell left as marked blanks.

use std::path::{Path, PathBuf};

use super::draft_columns::describe_columns;
pub use super::draft_error::InitError;
use super::draft_error::TABLES;
use super::draft_sheet::{Sheet, quoted};
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
    Tracks(Survey),
    Impacts,
    Angles {
        spin: bool,
    },
    /// The names of its columns.
    Unknown(Vec<String>),
}

impl Seen {
    fn what(&self) -> &'static str {
        match self {
            Self::Tracks(_) => "a file of tracks",
            Self::Impacts => "a table of impacts",
            Self::Angles { .. } => "a table of angles",
            Self::Unknown(_) => "in no known format",
        }
    }
}

/// Of what is looked at where there is no table.
const OTHERS: [&str; 1] = ["json"];
/// The table of what differs from shot to shot.
const SHOTS: &str = "shots.csv";

/// The files, and in the place of a folder the tables in it.
fn listed(files: &[PathBuf]) -> Result<Vec<PathBuf>, InitError> {
    let mut all = Vec::new();
    for file in files {
        if !file.is_dir() {
            all.push(file.clone());
            continue;
        }
        let entries =
            file.read_dir().map_err(|source| InitError::Read { path: file.clone(), source })?.flatten();
        let ends = |path: &PathBuf, endings: &[&str]| {
            let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            path.is_file() && endings.contains(&ending.as_str())
        };
        let files: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
        let of =
            |endings: &[&str]| files.iter().filter(|path| ends(path, endings)).cloned().collect::<Vec<_>>();
        let mut tables = of(&TABLES);
        if tables.is_empty() {
            tables = of(&OTHERS);
        }
        if tables.is_empty() {
            return Err(InitError::NoTables { path: file.clone() });
        }
        tables.sort();
        all.append(&mut tables);
    }
    Ok(all)
}

/// Looks at files, or at the tables in folders, at least one, and drafts the dataset.toml that goes with them.
///
/// # Errors
/// A file that cannot be read or is empty, or files of different kinds.
pub fn draft(files: &[PathBuf]) -> Result<Draft, InitError> {
    let mut files = listed(files)?;
    let is_shots =
        |file: &PathBuf| file.file_name().is_some_and(|name| name == SHOTS) && tells_of_shots(file);
    let table = if files.len() > 1 { files.iter().position(is_shots).map(|i| files.remove(i)) } else { None };
    let files = &files;
    let mut seen: Vec<(&PathBuf, Seen)> = Vec::new();
    for file in files {
        let now = look(file)?;
        if let Some((other_path, other)) = seen.first()
            && other.what() != now.what()
        {
            let (what, other) = (now.what(), other.what());
            return Err(InitError::Mixed {
                path: file.clone(),
                what,
                other_path: (*other_path).clone(),
                other,
            });
        }
        seen.push((file, now));
    }
    let folder = common_folder(files);
    let mut sheet = Sheet { text: String::new(), found: Vec::new(), blanks: Vec::new() };
    let here = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
    let name = std::path::absolute(here).unwrap_or_else(|_| folder.clone());
    let name = name.file_name().map_or("my-data".to_string(), |name| name.to_string_lossy().into_owned());
    sheet.line(&format!("name = {}          # also the name of its folder under fits/", quoted(&name)));
    let kind = match seen.first() {
        Some((_, Seen::Impacts)) => "impacts",
        Some((_, Seen::Angles { .. })) => "angles",
        _ => "tracks",
    };
    sheet.line(&format!("kind = \"{kind}\""));
    let listed: Vec<String> = files
        .iter()
        .map(|file| quoted(&file.strip_prefix(&folder).unwrap_or(file).to_string_lossy().replace('\\', "/")))
        .collect();
    sheet.line(&format!("files = [{}]", listed.join(", ")));
    sheet.blank(
        "cloth",
        "# cloth = \"…\"",
        "which cloth: `caromfit compare` tells cloths apart by it; optional",
    );
    sheet.blank("source", "# source = \"…\"", "who measured it, how, when; optional");
    let are_discs = matches!(seen.first(), Some((_, Seen::Tracks(survey))) if survey.are_discs);
    sheet.line("\n[ball]");
    if are_discs {
        sheet.line("shape = \"disc\"               # what was followed are points on two discs, or discs with their angles");
        sheet.blank(
            "radius_m",
            "# radius_m = …",
            "of the discs; optional: else the tracks tell how far apart they are when they touch",
        );
        sheet.blank(
            "mass_kg",
            "# mass_kg = …",
            "of the first disc, and [object] mass_kg of the second; optional",
        );
    } else {
        let surveys = seen
            .iter()
            .filter_map(|(_, seen)| if let Seen::Tracks(survey) = seen { Some(survey) } else { None });
        describe_radius(surveys, &mut sheet);
        if kind == "tracks" {
            sheet.line("# shape = \"disc\"             # pucks and coins, which slide and do not roll");
        }
    }
    let spins = matches!(seen.first(), Some((_, Seen::Angles { spin: true })));
    if !spins && !are_discs {
        sheet.line("\n[cue_spin]");
        sheet.blank(
            "cue_spin",
            "# assume = \"…\"",
            "stun (it slides without turning), natural-roll (it rolls), measured, unknown",
        );
    }
    let tracks: Vec<(&PathBuf, &Survey)> = seen
        .iter()
        .filter_map(|(file, seen)| if let Seen::Tracks(survey) = seen { Some((*file, survey)) } else { None })
        .collect();
    if !tracks.is_empty() {
        describe_tracks(&tracks, table.as_deref(), &mut sheet);
    }
    if let Some((file, Seen::Unknown(names))) = seen.first() {
        describe_columns(file, names, &mut sheet);
    }
    let Sheet { text, found, mut blanks } = sheet;
    blanks.sort_by_key(|blank| ORDER.iter().position(|known| known == blank).unwrap_or(ORDER.len()));
    let head = "# Drafted by caromfit init. Lines that say FILL IN wait for what the files do not tell.\n";
    let mut names: Vec<String> = Vec::new();
    for (name, _) in tracks.iter().flat_map(|(_, survey)| &survey.tracks) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    let follows = tracks.first().and_then(|(_, survey)| survey.times_fps);
    Ok(Draft { folder, text: format!("{head}{text}"), found, blanks, tracks: names, follows, are_discs })
}

/// A table is 2.84 m long, and no shot is filmed on less than a few centimetres.
const METRES: std::ops::Range<f64> = 0.02..4.0;

/// The ball that moves first by this part of the film is the cue ball.
const EARLIER: f64 = 0.05;

/// The most important first.
const ORDER: [&str; 8] = [
    "capture_fps",
    "length_unit",
    "which ball is which",
    "cue_spin",
    "radius_m",
    "mass_kg",
    "cloth",
    "source",
];

fn look(file: &Path) -> Result<Seen, InitError> {
    let names = header(file).map_err(|source| InitError::Read { path: file.to_path_buf(), source })?;
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
        Some(survey) => Ok(Seen::Tracks(survey)),
        None if names.first().is_some_and(|name| name.starts_with(['{', '['])) => {
            Err(InitError::Json { path: file.to_path_buf() })
        }
        None => Ok(Seen::Unknown(names)),
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

fn common_folder(files: &[PathBuf]) -> PathBuf {
    let parent = |file: &PathBuf| file.parent().map(Path::to_path_buf).unwrap_or_default();
    let mut folder = files.first().map(parent).unwrap_or_default();
    while !files.iter().all(|file| file.starts_with(&folder)) {
        folder = folder.parent().map(Path::to_path_buf).unwrap_or_default();
    }
    folder
}

fn describe_tracks(all: &[(&PathBuf, &Survey)], table: Option<&Path>, sheet: &mut Sheet) {
    let Some((file, first)) = all.first().copied() else { return };
    let shots: usize = all.iter().map(|(_, survey)| survey.shots).sum();
    let single = all.len() > 1 && all.iter().all(|(_, survey)| survey.tracks.len() == 1 && survey.shots == 1);
    let what = if single {
        "one ball each: two that are named alike but for the ball (kick-A.txt, kick-B.txt) are a shot"
            .to_owned()
    } else {
        format!("{shots} shot(s)")
    };
    sheet.found.push(format!("{} file(s) of tracks, format {}, {what}.", all.len(), first.format));
    sheet.line("\n[video]");
    match (first.stated_fps, first.times_fps) {
        (Some(fps), _) => {
            sheet.found.push(format!("{} states {fps} frames per second.", file.display()));
            sheet.line(&format!("capture_fps = {fps:?}         # as the file states"));
        }
        (None, Some(fps)) => {
            let fps = format!("{fps:.4}");
            let fps = fps.trim_end_matches('0').trim_end_matches('.');
            sheet.found.push(format!("The times follow {fps} frames per second."));
            let why = format!(
                "what the camera recorded at, not the playback rate. The times in the files follow {fps} frames per second"
            );
            sheet.blank("capture_fps", "# capture_fps = …", &why);
            let playback = format!("# playback_fps = {fps}");
            sheet.line(&format!(
                "{playback:<28} # take the # away if the camera recorded faster, so that these times are those of slow motion"
            ));
        }
        (None, None) => {
            let why =
                "frames per second that the camera recorded at, not the playback rate; times are in frames";
            sheet.blank("capture_fps", "# capture_fps = …", why);
        }
    }
    describe_scale(all, sheet);
    sheet.line("\n[tracks]");
    sheet.line(&format!("format = \"{}\"", if first.columns.is_empty() { "auto" } else { "columns" }));
    if first.are_discs && first.columns.is_empty() {
        sheet.found.push("Points keep their distances in two groups: two discs.".to_string());
        sheet.line("# cue and object are found for every shot: the disc that moves first is cue. Else: cue = [\"…\", \"…\", \"…\"]");
    } else {
        describe_balls(all, sheet);
    }
    if let Some(table) = table {
        sheet.found.push(format!("{}: what differs from shot to shot.", table.display()));
        sheet.line(&format!("shots = \"{SHOTS}\""));
    } else {
        sheet.line(&format!(
            "# shots = \"{SHOTS}\"         # optional: shot, and any of {}",
            KNOWN[1..].join(", ")
        ));
    }
    if !first.columns.is_empty() {
        sheet.found.push(
            "In no known format: [tracks.columns] is guessed from the names of columns; check it."
                .to_string(),
        );
        sheet.line("\n[tracks.columns]              # guessed: check it");
        for (key, value) in &first.columns {
            sheet.line(&format!("{key} = {value}"));
        }
    }
}

/// The radius: at most half of how near the centres come to each other, where the scale is known.
fn describe_radius<'a>(surveys: impl Iterator<Item = &'a Survey>, sheet: &mut Sheet) {
    /// Balls and their radii, mm, the largest first.
    const BALLS: [(&str, f64); 4] =
        [("pyramid", 34.0), ("carom", 30.75), ("pool", 28.575), ("snooker", 26.25)];
    /// Noise lets centres come nearer by so much.
    const NEARER: f64 = 1.02;
    let nearest = surveys.filter_map(|survey| {
        let metres = survey
            .unit
            .map_or_else(|| METRES.contains(&survey.extent).then_some(1.0), super::tracking::metres);
        Some(1e3 * survey.closest? * metres?)
    });
    let nearest = nearest.fold(f64::INFINITY, f64::min);
    match BALLS.iter().find(|(_, radius)| *radius <= 0.5 * NEARER * nearest).filter(|_| nearest.is_finite()) {
        Some((ball, radius)) => {
            sheet.found.push(format!(
                "The centres come as near as {nearest:.1} mm: radius at most {:.2} mm, as {ball} balls have.",
                0.5 * nearest
            ));
            let line = format!("radius_m = {:?}", 1e-3 * radius);
            sheet.line(&format!("{line:<28} # a {ball} ball: the centres come as near as {nearest:.1} mm"));
        }
        None => sheet.line(
            "radius_m = 0.028575          # a pool ball; carom 0.03075, snooker 0.02625: correct it if it is another",
        ),
    }
}

fn describe_scale(all: &[(&PathBuf, &Survey)], sheet: &mut Sheet) {
    sheet.line("\n[scale]");
    let extent = all.iter().map(|(_, survey)| survey.extent).fold(0.0, f64::max);
    let stated = all.first().and_then(|(_, survey)| survey.unit);
    if let Some(unit) = stated {
        sheet.line(&format!("{:<28} # as the file states", format!("length_unit = \"{unit}\"")));
    } else if METRES.contains(&extent) {
        sheet.line(&format!(
            "length_unit = \"m\"            # the positions span {extent:.3}: metres, if the film was calibrated"
        ));
    } else {
        let why = format!(
            "m, cm, mm, in, ft, or px (the balls are then the ruler, unless m_per_px = … or four [[scale.point]] are given); the positions span {extent:.0}"
        );
        sheet.blank("length_unit", "# length_unit = \"…\"", &why);
    }
    sheet
        .line("y_axis = \"up\"                # \"down\" where y grows downwards, as in pixels of a picture");
}

fn describe_balls(all: &[(&PathBuf, &Survey)], sheet: &mut Sheet) {
    let mut names: Vec<(&str, f64)> = Vec::new();
    for (name, begin) in all.iter().flat_map(|(_, survey)| &survey.tracks) {
        if !names.iter().any(|(known, _)| *known == name.as_str()) {
            names.push((name, *begin));
        }
    }
    let listed: Vec<String> = names.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    sheet.found.push(format!("Tracks: {}.", listed.join(", ")));
    let order = match names.as_slice() {
        [a, b] if a.1 + EARLIER < b.1 => Some((a.0, b.0)),
        [a, b] if b.1 + EARLIER < a.1 => Some((b.0, a.0)),
        _ => None,
    };
    // a table with a row per frame names the balls by its columns
    let wide = all.first().is_some_and(|(_, survey)| survey.columns.iter().any(|(key, _)| *key == "cue_x"));
    match order {
        Some((cue, _)) if wide => {
            let which = if cue == "cue" { "cue_x, cue_y" } else { "object_x, object_y: exchange them below" };
            sheet.found.push(format!("The ball that moves first is that of {which}."));
            sheet.line(&format!("# the ball that moves first, and so the cue ball, is that of {which}"));
        }
        None if wide => {
            sheet.line(
                "# which ball is the cue ball does not show: cue_x and cue_y, below, are to be its columns",
            );
        }
        Some((cue, object)) => {
            sheet.found.push(format!("\"{cue}\" moves first: taken as the cue ball."));
            sheet.line(&format!("cue = {:<24} # it moves first", quoted(cue)));
            sheet.line(&format!("object = {}", quoted(object)));
        }
        None => {
            let why = format!(
                "which track is the cue ball; the files have {} (where it differs from shot to shot: column cue of {SHOTS})",
                listed.join(", ")
            );
            sheet.blank("which ball is which", "# cue = \"…\"", &why);
            sheet.line("# object = \"…\"               # and which the object ball");
        }
    }
}
