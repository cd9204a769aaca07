//! Which track is which ball: by the names of tracks, and by those of files with one ball each.

use std::path::{Path, PathBuf};

use super::input::{Log, Notes, Subject, quoted, stem};
use super::raw::{RawShot, RawTrack};
use super::repair::Wrong;
use super::settings::{NAMED, Names, TrackSettings};
use crate::io::number::shortened;

/// The tracks of one ball.
pub(super) struct Ball {
    /// Track of the ball's centre, or tracks of the points whose mean is the centre.
    pub(crate) centres: Vec<RawTrack>,
    /// Further points on the ball.
    pub(crate) markers: Vec<RawTrack>,
}

/// Removes the tracks that a key of [`NAMED`] names from the shot, and the points on them. `there`:
/// the names of all tracks.
pub(super) fn assign(
    raw: &mut RawShot,
    which: usize,
    names: &[Names; 4],
    there: &[String],
    log: Log,
) -> Result<Ball, Wrong> {
    let RawShot { tracks, line, .. } = raw;
    let (key, names) = (NAMED[which], &names[which]);
    let mut found = Ball { centres: Vec::new(), markers: Vec::new() };
    for name in &names.0 {
        let Some(i) = find(tracks, name).map_err(|message| Wrong::input(*line, message))? else {
            let apart = if tracks.len() + found.centres.len() < 2 {
                " (one file a ball: their names differ by the ball only, as in kick-A.txt and kick-B.txt)"
            } else {
                ""
            };
            let (names, there) = (names.shown(), quoted(there));
            let message = format!(
                "there is no track \"{name}\" ([tracks] {key} = {names}); there are: {there}. Expected both balls in one file or \
                 shot{apart}, and their names in [tracks] cue and object"
            );
            // other shots may have both balls
            return Err(Wrong::damaged(*line, message));
        };
        let track = tracks.remove(i);
        if track.name != *name {
            let message = format!("the track \"{}\" is [tracks] {key} = \"{name}\"", track.name);
            log.add(Subject::Names, track.line(), message);
        }
        let is_on_it = |other: &mut RawTrack| other.point.is_some() && other.name == track.name;
        found.markers.extend(tracks.extract_if(.., is_on_it));
        found.centres.push(track);
    }
    Ok(found)
}

pub(super) fn listed(raw: &RawShot) -> Vec<String> {
    let mut there: Vec<String> = raw.tracks.iter().map(|track| shortened(&track.name)).collect();
    there.dedup();
    there.truncate(12);
    there
}

/// Numbers tracks of the same name, in their order: "A (1)", "A (2)".
pub(super) fn number_twins(tracks: &mut [RawTrack]) {
    let mut bodies: Vec<&mut RawTrack> = tracks.iter_mut().filter(|track| track.point.is_none()).collect();
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

/// Returns the track that a name of dataset.toml means.
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
    let centres = (0..tracks.len()).filter(|i| tracks[*i].point.is_none());
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
    /// Index among the shots.
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
    let mut joined = Vec::new();
    for cue in &cues {
        let is_like = |other: &&Single| other.key == cue.key && other.folder == cue.folder;
        let likely: Vec<&Single> = objects.iter().filter(|other| are_only || is_like(other)).collect();
        let ([object], 1) = (likely.as_slice(), cues.iter().filter(is_like).count()) else { continue };
        if raw[object.index].clock != raw[cue.index].clock {
            continue;
        }
        let mut track = raw[object.index].tracks.remove(0);
        track.name = names[1].to_string();
        let file = raw[object.index].file.clone();
        let shot = &mut raw[cue.index];
        shot.tracks[0].name = names[0].to_string();
        shot.tracks.push(track);
        // the common rest of the files' names, or else the first file's name
        let is_name = cue.key == object.key && !cue.key.is_empty();
        shot.name = if is_name { cue.key.clone() } else { stem(&shot.file) };
        let message =
            format!("is cue ball of the shot \"{}\", whose object ball is {}", shot.name, file.display());
        notes.of(&shot.file).add(Subject::Names, None, message);
        joined.push(object.index);
    }
    let mut index = 0..;
    raw.retain(|_| index.next().is_none_or(|index| !joined.contains(&index)));
}

/// Returns a file that is one ball's track, if the track's name or its own names the ball.
fn single(index: usize, shot: &RawShot, [cue, object]: [&str; 2]) -> Option<Single> {
    let stem = stem(&shot.file);
    let ([track], true) = (shot.tracks.as_slice(), shot.name == stem) else { return None };
    let folder = shot.file.parent();
    let folder_name = folder.and_then(Path::file_name).unwrap_or_default().to_string_lossy();
    // the file's name without the ball's, for either ball; the files of Tracker's mass A are named A
    let rests =
        |text: &str| [cue, object].map(|ball| without(text, ball).or_else(|| without(text, last_word(ball))));
    let (in_file, in_folder) = (rests(&stem), rests(&folder_name));
    let is_by_folder = in_file == [None, None] && in_folder != [None, None];
    let rest = if is_by_folder {
        // cue/1.csv and object/1.csv
        in_folder.map(|rest| {
            rest.map(|rest| if rest.is_empty() { stem.clone() } else { format!("{rest}-{stem}") })
        })
    } else {
        in_file
    };
    let is_named = |ball: &str| matches!(find(&shot.tracks, ball), Ok(Some(_)));
    let is_object = match (is_named(cue), is_named(object), &rest) {
        (true, false, _) | (false, false, [Some(_), None]) => false,
        (false, true, _) | (false, false, [None, Some(_)]) => true,
        _ => return None,
    };
    let key = rest.into_iter().nth(usize::from(is_object)).flatten().unwrap_or(stem);
    let folder = if is_by_folder { folder.and_then(Path::parent) } else { folder };
    let is_centre = track.point.is_none();
    is_centre.then(|| Single { index, is_object, key, folder: folder.map(Path::to_path_buf) })
}

/// Returns the words of a file's name without the ball's; `None` if the ball is not among them.
fn without(stem: &str, ball: &str) -> Option<String> {
    let is_between = |c: char| c.is_whitespace() || matches!(c, '-' | '_' | '.');
    let words = stem.split(is_between).filter(|word| !word.is_empty());
    let (balls, rest): (Vec<&str>, Vec<&str>) = words.partition(|word| word.eq_ignore_ascii_case(ball));
    (balls.len() == 1).then(|| rest.join("-"))
}
