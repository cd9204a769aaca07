//! Two balls in two files: Tracker exports one track a file.

use std::path::{Path, PathBuf};

use super::finish::{find, last_word};
use super::input::stem;
use super::raw::{NAMES, Notes, RawShot};
use super::settings::TrackSettings;

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
        notes.of(&shot.file).add(NAMES, None, message);
        joined.push(object.index);
    }
    let mut index = 0..;
    raw.retain(|_| index.next().is_none_or(|index| !joined.contains(&index)));
}

/// Returns a file that is one ball's track, if the track's name or its own names the ball.
fn single(index: usize, shot: &RawShot, [cue, object]: [&str; 2]) -> Option<Single> {
    let stem = stem(&shot.file);
    let ([track], true) = (shot.tracks.as_slice(), shot.name == stem) else { return None };
    if track.point.is_some() {
        return None;
    }
    let is_named = |ball: &str| matches!(find(&shot.tracks, ball), Ok(Some(_)));
    // the files of Tracker's "mass A" are named A
    let words =
        |text: &str| [cue, object].map(|ball| without(text, ball).or_else(|| without(text, last_word(ball))));
    let mut in_name = words(&stem);
    let mut folder = shot.file.parent();
    if in_name == [None, None] {
        // cue/1.csv and object/1.csv
        let name = folder.and_then(Path::file_name).map(|name| name.to_string_lossy());
        in_name = words(&name.unwrap_or_default()).map(|rest| {
            let rest = rest?;
            Some(if rest.is_empty() { stem.clone() } else { format!("{rest}-{stem}") })
        });
        if in_name != [None, None] {
            folder = folder.and_then(Path::parent);
        }
    }
    let is_object = match (is_named(cue), is_named(object), &in_name) {
        (true, false, _) | (false, false, [Some(_), None]) => false,
        (false, true, _) | (false, false, [None, Some(_)]) => true,
        _ => return None,
    };
    let [cue_key, object_key] = in_name;
    let key = if is_object { object_key } else { cue_key }.unwrap_or(stem);
    Some(Single { index, is_object, key, folder: folder.map(Path::to_path_buf) })
}

/// Returns the words of a file's name without the ball's; `None` if the ball is not among them.
fn without(stem: &str, ball: &str) -> Option<String> {
    let is_between = |c: char| c.is_whitespace() || matches!(c, '-' | '_' | '.');
    let words = stem.split(is_between).filter(|word| !word.is_empty());
    let (balls, rest): (Vec<&str>, Vec<&str>) = words.partition(|word| word.eq_ignore_ascii_case(ball));
    (balls.len() == 1).then(|| rest.join("-"))
}
