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
    object: bool,
    /// The file's name without the ball's name.
    key: String,
    /// The folder, or the folder above if the folder is named after the ball.
    folder: Option<PathBuf>,
}

/// Joins the shots of one ball each whose files differ by the ball's name only, or that are the
/// only two. Others are left, and their missing ball is reported when they are finished.
pub(super) fn pair(raw: &mut Vec<RawShot>, settings: &TrackSettings, notes: &Notes) {
    let Some(names) = settings.single_names() else { return };
    let singles: Vec<Single> =
        raw.iter().enumerate().filter_map(|(index, shot)| single(index, shot, names)).collect();
    let alone = singles.len() == 2 && raw.len() == 2;
    let mut gone = Vec::new();
    for cue in singles.iter().filter(|single| !single.object) {
        let is_like = |other: &Single| other.key == cue.key && other.folder == cue.folder;
        let objects: Vec<&Single> =
            singles.iter().filter(|other| other.object && (alone || is_like(other))).collect();
        let twins = singles.iter().filter(|other| !other.object && is_like(other)).count();
        let ([object], 1) = (objects.as_slice(), twins) else { continue };
        if raw[object.index].clock != raw[cue.index].clock {
            continue;
        }
        let mut track = raw[object.index].tracks.remove(0);
        track.name = names[1].to_string();
        let file = raw[object.index].file.clone();
        let shot = &mut raw[cue.index];
        shot.tracks[0].name = names[0].to_string();
        shot.tracks.push(track);
        let own = shot.file.clone();
        // the common rest of the files' names, or else the first file's name
        let is_name = cue.key == object.key && !cue.key.is_empty();
        shot.name = if is_name { cue.key.clone() } else { stem(&own) };
        let message =
            format!("is cue ball of the shot \"{}\", whose object ball is {}", shot.name, file.display());
        notes.of(&own).add(NAMES, None, message);
        gone.push(object.index);
    }
    gone.sort_unstable();
    for index in gone.into_iter().rev() {
        raw.remove(index);
    }
}

/// Returns a file that is one ball's track, if the track's name or its own names the ball.
fn single(index: usize, shot: &RawShot, [cue, object]: [&str; 2]) -> Option<Single> {
    let stem = stem(&shot.file);
    let ([track], true) = (shot.tracks.as_slice(), shot.name == stem) else { return None };
    if track.point.is_some() {
        return None;
    }
    let named = |ball: &str| matches!(find(&shot.tracks, ball), Ok(Some(_)));
    // the files of Tracker's "mass A" are named A
    let words =
        |text: &str| [cue, object].map(|ball| without(text, ball).or_else(|| without(text, last_word(ball))));
    let mut in_stem = words(&stem);
    let mut folder = shot.file.parent();
    if in_stem.iter().all(Option::is_none) {
        // cue/1.csv and object/1.csv
        let name = folder.and_then(Path::file_name).map(|name| name.to_string_lossy());
        in_stem = words(&name.unwrap_or_default()).map(|rest| {
            let rest = rest?;
            Some(if rest.is_empty() { stem.clone() } else { format!("{rest}-{stem}") })
        });
        if in_stem.iter().any(Option::is_some) {
            folder = folder.and_then(Path::parent);
        }
    }
    let folder = folder.map(Path::to_path_buf);
    let object = match (named(cue), named(object), &in_stem) {
        (true, false, _) | (false, false, [Some(_), None]) => false,
        (false, true, _) | (false, false, [None, Some(_)]) => true,
        _ => return None,
    };
    let key = in_stem[usize::from(object)].clone().unwrap_or(stem);
    Some(Single { index, object, key, folder })
}

/// Returns the words of a file's name without the ball's; `None` if the ball is not among them.
fn without(stem: &str, ball: &str) -> Option<String> {
    let apart = |c: char| c.is_whitespace() || matches!(c, '-' | '_' | '.');
    let words: Vec<&str> = stem.split(apart).filter(|word| !word.is_empty()).collect();
    let is_ball = |word: &&str| word.eq_ignore_ascii_case(ball);
    let one = words.iter().filter(|word| is_ball(word)).count() == 1;
    let rest: Vec<&str> = words.iter().copied().filter(|word| !is_ball(word)).collect();
    one.then(|| rest.join("-"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_ball_is_a_word_of_its_own() {
        assert_eq!(without("kick-7_A", "a").as_deref(), Some("kick-7"));
        assert_eq!(without("A", "A").as_deref(), Some(""));
        assert_eq!(without("table-7", "A"), None);
        assert_eq!(without("a-a", "A"), None);
        assert_eq!(without("shot01-A", last_word("mass A")).as_deref(), Some("shot01"));
    }
}
