//! Which track is which ball: by the names of tracks, and by those of files with one ball each.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::input::{Log, Notes, Subject, quoted, stem};
use super::raw::{RawShot, RawTrack, Role};
use super::repair::Wrong;
use super::settings::{NAMED, Names, TrackSettings};
use crate::io::number::shortened;

/// Marks the tracks of both balls, by names in the order of [`NAMED`], and those of the points on
/// them.
///
/// # Errors
/// The first name of each ball that is not that of one track.
pub(super) fn assign(raw: &mut RawShot, names: &[Names; 4], log: Log) -> Result<(), Vec<Wrong>> {
    let mut there: Vec<String> = raw.tracks.iter().map(|track| shortened(&track.name)).collect();
    there.dedup();
    there.truncate(12);
    let (there, mut wrong) = (quoted(there), Vec::new());
    for ball in [0, 1] {
        for which in [ball, ball + 2] {
            if let Err(fault) = assign_key(raw, which, &names[which], &there, log) {
                wrong.push(fault);
                break;
            }
        }
    }
    if wrong.is_empty() { Ok(()) } else { Err(wrong) }
}

fn assign_key(raw: &mut RawShot, which: usize, names: &Names, there: &str, log: Log) -> Result<(), Wrong> {
    let RawShot { tracks, line, .. } = raw;
    let (key, ball, is_marker) = (NAMED[which], which % 2, which > 1);
    for (order, name) in names.0.iter().enumerate() {
        let Some(i) = find(tracks, name).map_err(|message| Wrong::input(*line, message))? else {
            let free = tracks.iter().filter(|track| track.role.is_none()).count();
            let apart = if free + order < 2 {
                " (one file a ball: their names differ by the ball only, as in kick-A.txt and kick-B.txt)"
            } else {
                ""
            };
            let names = names.shown();
            let message = format!(
                "there is no track \"{name}\" ([tracks] {key} = {names}); there are: {there}. Expected both balls in one file or \
                 shot{apart}, and their names in [tracks] cue and object"
            );
            // other shots may have both balls
            return Err(Wrong::damaged(*line, message));
        };
        let track = &mut tracks[i];
        if track.name != *name {
            let message = format!("the track \"{}\" is [tracks] {key} = \"{name}\"", track.name);
            log.add(Subject::Names, track.line(), message);
        }
        track.role = Some(Role { ball, is_marker, order });
        let own = track.name.clone();
        let is_on_it =
            |other: &&mut RawTrack| !other.is_centre() && other.role.is_none() && other.name == own;
        for point in tracks.iter_mut().filter(is_on_it) {
            point.role = Some(Role { ball, is_marker: true, order: 0 });
        }
    }
    Ok(())
}

/// Numbers tracks of the same name, in their order: "A (1)", "A (2)".
pub(super) fn number_twins(tracks: &mut [RawTrack]) {
    let mut bodies: Vec<&mut RawTrack> = tracks.iter_mut().filter(|track| track.is_centre()).collect();
    let names: Vec<String> = bodies.iter().map(|track| track.name.clone()).collect();
    for (i, track) in bodies.iter_mut().enumerate() {
        let before = names[..i].iter().filter(|name| **name == names[i]).count();
        if before > 0 || names[i + 1..].contains(&names[i]) {
            track.name = format!("{} ({})", names[i], before + 1);
        }
    }
}

fn last_word(name: &str) -> &str {
    name.rsplit(|c: char| c.is_whitespace() || c == '_').next().unwrap_or_default()
}

/// Returns the track without a role that a name of dataset.toml means.
///
/// # Errors
/// The name is ambiguous.
pub(super) fn find(tracks: &[RawTrack], wanted: &str) -> Result<Option<usize>, String> {
    let small = wanted.to_lowercase();
    // 0 to 3: as written, in other letters, as Tracker's mass A, with the number of equal names
    let rank = |name: &str| {
        let lower = name.to_lowercase();
        let number = name.strip_prefix(wanted).and_then(|rest| rest.strip_prefix(" (")?.strip_suffix(')'));
        let is_mass = lower.starts_with("mass") && last_word(name) == wanted;
        let is_numbered = number.is_some_and(|number| number.parse::<usize>().is_ok());
        [name == wanted, lower == small, is_mass, is_numbered].iter().position(|fits| *fits)
    };
    let is_free = |track: &RawTrack| track.is_centre() && track.role.is_none();
    let centres = (0..tracks.len()).filter(|i| is_free(&tracks[*i]));
    let mut found: Vec<(usize, usize)> = centres.filter_map(|i| Some((rank(&tracks[i].name)?, i))).collect();
    let best = found.iter().map(|(rank, _)| *rank).min();
    found.retain(|(rank, _)| Some(*rank) == best);
    match found.as_slice() {
        [] | [(3, _)] => Ok(None),
        [(_, one)] => Ok(Some(*one)),
        many => {
            let shown = |(_, i): &(_, usize)| format!("\"{}\" (line {})", tracks[*i].name, tracks[*i].line());
            let (count, all) = (many.len(), many.iter().map(shown).collect::<Vec<_>>().join(", "));
            Err(format!("{count} tracks are named \"{wanted}\"; write in [tracks] which one it is: {all}"))
        }
    }
}

/// A file of one track, and which ball it is.
struct Single {
    index: usize,
    is_object: bool,
    /// The file's name without the ball's name.
    key: String,
    /// The folder, or the folder above if the folder is named after the ball.
    folder: Option<PathBuf>,
}

/// Joins the shots of one ball each whose files differ by the ball's name only, or that are the
/// only two. Others are left, and their missing ball is reported when they are finished.
pub(super) fn pair(raw: &mut Vec<RawShot>, settings: &TrackSettings, notes: &Notes) {
    let Some(names) = settings.single_names() else { return };
    let singles = raw.iter().enumerate().filter_map(|(index, shot)| single(index, shot, names));
    let (objects, cues): (Vec<Single>, Vec<Single>) = singles.partition(|single| single.is_object);
    let are_only = cues.len() + objects.len() == 2 && raw.len() == 2;
    for cue in &cues {
        let is_like = |other: &&Single| other.key == cue.key && other.folder == cue.folder;
        let likely: Vec<&Single> = objects.iter().filter(|other| are_only || is_like(other)).collect();
        let ([object], 1) = (likely.as_slice(), cues.iter().filter(is_like).count()) else { continue };
        if raw[object.index].clock != raw[cue.index].clock {
            continue;
        }
        let file = raw[object.index].file.clone();
        let rows = [raw[cue.index].written(), raw[object.index].written()].concat();
        let track = raw[object.index].tracks.pop();
        raw[cue.index].tracks.extend(track);
        raw[cue.index] = raw[cue.index].clone().on_grid(rows);
        let shot = &mut raw[cue.index];
        for (track, name) in shot.tracks.iter_mut().zip(names) {
            track.name = name.to_string();
        }
        // the common rest of the files' names, or else the first file's name
        if cue.key == object.key && !cue.key.is_empty() {
            shot.name.clone_from(&cue.key);
        }
        let message =
            format!("is cue ball of the shot \"{}\", whose object ball is {}", shot.name, file.display());
        notes.of(&shot.file).add(Subject::Names, None, message);
    }
    raw.retain(|shot| !shot.tracks.is_empty());
}

/// Returns a file that is one ball's track, if the track's name or its own names the ball.
fn single(index: usize, shot: &RawShot, balls: [&str; 2]) -> Option<Single> {
    let stem = stem(&shot.file);
    if shot.tracks.len() != 1 || !shot.tracks[0].is_centre() || shot.name != stem {
        return None;
    }
    // the file's name without the ball's, for either ball; the files of Tracker's mass A are named
    // A
    let rests = |text: &str| balls.map(|ball| without(text, ball).or_else(|| without(text, last_word(ball))));
    let (mut rest, mut folder) = (rests(&stem), shot.file.parent());
    if rest == [None, None] {
        // cue/1.csv and object/1.csv
        let of_folder = rests(&folder.and_then(Path::file_name).unwrap_or_default().to_string_lossy());
        if of_folder != [None, None] {
            rest = of_folder
                .map(|rest| Some([rest?, stem.clone()].join("-").trim_start_matches('-').to_string()));
            folder = folder.and_then(Path::parent);
        }
    }
    let is_object = match (balls.map(|ball| matches!(find(&shot.tracks, ball), Ok(Some(_)))), &rest) {
        ([true, false], _) | ([false, false], [Some(_), None]) => false,
        ([false, true], _) | ([false, false], [None, Some(_)]) => true,
        _ => return None,
    };
    let key = std::mem::take(&mut rest[usize::from(is_object)]).unwrap_or(stem);
    Some(Single { index, is_object, key, folder: folder.map(Path::to_path_buf) })
}

/// Returns the words of a file's name without the ball's; `None` if the ball is not among them.
fn without(stem: &str, ball: &str) -> Option<String> {
    let is_between = |c: char| c.is_whitespace() || matches!(c, '-' | '_' | '.');
    let words = stem.split(is_between).filter(|word| !word.is_empty());
    let (balls, rest): (Vec<&str>, Vec<&str>) = words.partition(|word| word.eq_ignore_ascii_case(ball));
    (balls.len() == 1).then(|| rest.join("-"))
}

/// Puts the folder before equal names of shots from different folders, as of A/1.csv and B/1.csv.
pub(super) fn name_by_folder(raw: &mut [RawShot], notes: &Notes) {
    let folder = |shot: &RawShot| shot.file.parent()?.file_name().map(|name| name.display().to_string());
    let mut folders: HashMap<String, Vec<Option<String>>> = HashMap::new();
    for shot in raw.iter() {
        folders.entry(shot.name.clone()).or_default().push(folder(shot));
    }
    for shot in raw {
        let all = &folders[&shot.name];
        let different: HashSet<&String> = all.iter().flatten().collect();
        if all.len() > 1 && different.len() == all.len() {
            let message = "files in several folders have equal names: their shots are named with the folder";
            notes.of(&shot.file).add(Subject::Names, None, message);
            shot.name = format!("{}/{}", folder(shot).unwrap_or_default(), shot.name);
        }
    }
}
