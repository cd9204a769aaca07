//! Which track is which ball: by names of tracks and files, and by the distances that points keep.

use std::path::{Path, PathBuf};

use super::Facts;
use super::raw::{Job, RawShot, RawTrack, Row, sorted, span, stem};
use super::settings::NAMED;
use crate::film::rigid_body::circle_centres;
use crate::io::error::{Subject, grouped, listed, message, quoted};
use crate::io::text::shortened;
use crate::measurement::track::Sample;
use crate::numerics::median;

/// Largest relative change of the distance of two points on one body. Points of one puck change
/// theirs by up to 0.035 (calibration, and tape that is seen from another side; 0.16 while a hand
/// holds the puck), points of two by 0.8 and more (30 films of two pucks, Chalmers 2023).
const MAX_CHANGE: f64 = 0.25;
/// Number of frames of a median distance, so that a frame with two mistaken markers does not count.
const MEDIAN_FRAMES: usize = 5;
/// Largest relative difference of the centre's distances to markers, which are placed by hand.
const MAX_INEQUALITY: f64 = 0.1;

/// Marks the tracks of both balls and of the points on them, by names in the order of [`NAMED`].
/// Returns whether each name is that of one track, and complains about the first under each key that
/// is not.
pub(super) fn assign(raw: &mut RawShot, facts: &Facts, job: Job) -> bool {
    let RawShot { tracks, line, .. } = raw;
    let mut are_found = true;
    for (which, (key, names)) in NAMED.into_iter().zip(&facts.names).enumerate() {
        for (order, name) in names.iter().enumerate() {
            let found = find(tracks, name);
            let [i] = found[..] else {
                are_found = false;
                let shown = |i: &usize| format!("\"{}\" (line {})", tracks[*i].name, tracks[*i].line());
                let twins: Vec<String> = found.iter().map(shown).collect();
                let stated = if names.len() == 1 { format!("{name:?}") } else { format!("{names:?}") };
                let mut there: Vec<String> = tracks.iter().map(|track| shortened(&track.name)).collect();
                there.dedup();
                let free = order + tracks.iter().filter(|track| track.role.is_none()).count();
                let message =
                    message!("not_one_track", name, key, stated, twins, there => listed(&there), free);
                // wrong names in the table of shots are its fault; other shots may have both balls
                if facts.names_balls {
                    job.wrong(*line, None, message);
                } else {
                    job.note(Subject::Damage, *line, message);
                }
                break;
            };
            let track = tracks[i].name.clone();
            if track != *name {
                let message = format!("the track \"{track}\" is [tracks] {key} = \"{name}\"");
                job.note(Subject::Names, tracks[i].line(), message);
            }
            tracks[i].role = Some([which, order]);
            for point in tracks.iter_mut().filter(|other| other.point.is_some() && other.name == track) {
                point.role.get_or_insert([which % 2 + 2, 0]);
            }
        }
    }
    are_found
}

fn last_word(name: &str) -> &str {
    name.rsplit(|c: char| c.is_whitespace() || c == '_').next().unwrap_or_default()
}

/// Returns the tracks without a role that a name of dataset.toml may mean: those that are called so,
/// or so in other letters, or as Tracker's mass A, or with the number of equal names.
pub(super) fn find(tracks: &[RawTrack], wanted: &str) -> Vec<usize> {
    let small = wanted.to_lowercase();
    let fits = |name: &str, way: usize| match way {
        0 => name == wanted,
        1 => name.to_lowercase() == small,
        2 => name.to_lowercase().starts_with("mass") && last_word(name) == wanted,
        _ => name.strip_prefix(wanted).is_some_and(|rest| {
            let number = rest.strip_prefix(" (").and_then(|rest| rest.strip_suffix(')'));
            number.is_some_and(|number| number.parse::<usize>().is_ok())
        }),
    };
    let is_free = |track: &RawTrack| track.point.is_none() && track.role.is_none();
    let free = || (0..tracks.len()).filter(|i| is_free(&tracks[*i]));
    let ways = (0..4).map(|way| free().filter(|i| fits(&tracks[*i].name, way)).collect::<Vec<usize>>());
    ways.into_iter().find(|found| !found.is_empty()).unwrap_or_default()
}

/// Joins the shots of one ball each whose files differ by the ball's name only, or that are the
/// only two. The missing ball of others is reported when they are finished.
pub(super) fn pair(raw: &mut Vec<RawShot>, job: Job) {
    let Some(names) = job.settings.single_names() else { return };
    let are_only = raw.len() == 2;
    let singles = raw.iter().enumerate().filter_map(|(i, shot)| {
        let (ball, key) = single(shot, names)?;
        Some((Some(key.clone()).filter(|_| !are_only), (ball, i, key)))
    });
    for (_, mut balls) in grouped(singles) {
        balls.sort();
        let [(0, i, key), (1, j, other_key)] = &balls[..] else { continue };
        if raw[*i].stated != raw[*j].stated {
            continue;
        }
        let (tracks, file) = (std::mem::take(&mut raw[*j].tracks), raw[*j].file.clone());
        let shot = &mut raw[*i];
        shot.tracks.extend(tracks);
        for (track, name) in shot.tracks.iter_mut().zip(names) {
            track.name = name.to_string();
        }
        // the common rest of the files' names, or else the first file's name
        if key == other_key && !key.0.is_empty() {
            shot.name.clone_from(&key.0);
        }
        let (name, file) = (&shot.name, file.display());
        let message = format!("is cue ball of the shot \"{name}\", whose object ball is {file}");
        job.log.note(Subject::Names, &shot.file, None, message);
    }
    raw.retain(|shot| !shot.tracks.is_empty());
}

/// Returns the number of the ball whose only track a file holds, by the name of the track or of the
/// file, with the file's name without the ball's, and the folder (that above one named after it).
fn single(shot: &RawShot, balls: [&str; 2]) -> Option<(usize, (String, Option<PathBuf>))> {
    let (stem, folder) = (stem(&shot.file), shot.file.parent());
    if shot.tracks.len() != 1 || shot.tracks[0].point.is_some() || shot.name != stem {
        return None;
    }
    // the name without the ball's, for either ball; the files of Tracker's mass A are named A
    let has_last = last_word(balls[0]) != last_word(balls[1]);
    let last = |text: &str, ball: &str| without(text, last_word(ball)).filter(|_| has_last);
    let whole = |text: &str, ball: &str| without(text, ball).filter(|rest| !rest.is_empty());
    let rests = |text: &str| balls.map(|ball| whole(text, ball).or_else(|| last(text, ball)));
    let mut keys = rests(&stem).map(|rest| Some((rest?, folder)));
    if keys == [None, None] {
        // cue/1.csv and object/1.csv
        let name = folder.and_then(Path::file_name).unwrap_or_default().to_string_lossy();
        let joined = |rest: String| format!("{rest}-{stem}").trim_start_matches('-').to_string();
        keys = rests(&name).map(|rest| Some((joined(rest?), folder.and_then(Path::parent))));
    }
    let is_track = balls.map(|ball| find(&shot.tracks, ball).len() == 1);
    let is_file = keys.each_ref().map(Option::is_some);
    let ball = match if is_track == [false, false] { is_file } else { is_track } {
        [true, false] => 0,
        [false, true] => 1,
        _ => return None,
    };
    let (key, folder) = keys[ball].take().unwrap_or((stem.into_owned(), folder));
    Some((ball, (key, folder.map(Path::to_path_buf))))
}

/// Returns the words of a name without the ball's; `None` unless these are among them once.
fn without(stem: &str, ball: &str) -> Option<String> {
    let is_between = |c: char| c.is_whitespace() || matches!(c, '-' | '_' | '.');
    let words = |text: &str| {
        format!("-{}-", text.split(is_between).filter(|word| !word.is_empty()).collect::<Vec<_>>().join("-"))
    };
    let (stem, ball) = (words(stem), words(ball).to_ascii_lowercase());
    let small = stem.to_ascii_lowercase();
    let mut places = small.match_indices(&ball).map(|(at, _)| at);
    let (Some(at), None) = (places.next(), places.next()) else { return None };
    Some(format!("{}{}", &stem[..at], &stem[at + ball.len() - 1..]).trim_matches('-').to_owned())
}

/// Puts the folder before equal names of shots, as of A/1.csv and B/1.csv.
pub(super) fn name_by_folder(raw: &mut [RawShot], job: Job) {
    let twins = grouped(raw.iter().map(|shot| (shot.name.clone(), ())));
    for shot in raw.iter_mut().filter(|shot| twins[&shot.name].len() > 1) {
        let Some(folder) = shot.file.parent().and_then(Path::file_name) else { continue };
        let message = "files in several folders have equal names: their shots are named with the folder";
        job.log.note(Subject::Names, &shot.file, None, message);
        shot.name = format!("{}/{}", folder.display(), shot.name);
    }
}

/// Determines the names of both discs, the first to move first, unless tracks are named cue or
/// object or name their points: each is one track, or three or more that keep their distances. The
/// result replaces the names of the facts. `None`, with damage, if the tracks are not two discs.
pub(super) fn find_discs(raw: &RawShot, facts: &mut Facts, job: Job) -> Option<()> {
    let tracks = &raw.tracks;
    let are_named = ["cue", "object"].iter().any(|name| !find(tracks, name).is_empty());
    if are_named || tracks.len() < 2 || tracks.iter().any(|track| track.point.is_some()) {
        return Some(());
    }
    let calibration = job.settings.calibration(raw.stated.unit);
    let mut points = tracks.clone();
    for row in points.iter_mut().flat_map(|track| &mut track.rows) {
        row.place = calibration.metres(row.place);
    }
    let groups = if points.len() == 2 { vec![vec![0], vec![1]] } else { groups(&points) };
    let names_of = |group: &[usize]| group.iter().map(|i| tracks[*i].name.clone()).collect::<Vec<String>>();
    let complain = |groups: Vec<Vec<usize>>| {
        let known: Vec<String> = groups.iter().map(|group| quoted(names_of(group))).collect();
        job.note(Subject::Damage, raw.line, message!("not_two_discs", count => points.len(), known));
    };
    let mut groups: [Vec<usize>; 2] = groups.try_into().map_err(complain).ok()?;
    let begin = |group: &Vec<usize>| span(group.iter().filter_map(|i| raw.beginning(&tracks[*i])))[0];
    groups.sort_by(|one, other| begin(one).total_cmp(&begin(other)));
    let members = groups.each_ref().map(|group| group.iter().map(|i| &points[*i]).collect());
    let centres = find_centres(&members);
    // the centre, or points on a circle about it, and further points
    let [one, other] = [0, 1].map(|disc| {
        let mut names = names_of(&groups[disc]);
        match centres[disc] {
            Some(centre) => [vec![names.remove(centre)], names],
            None => [names, Vec::new()],
        }
    });
    let discs = [&one, &other].map(|points| points.iter().map(quoted).collect::<Vec<String>>());
    job.note(Subject::Names, raw.line, message!("two_discs", discs => discs.to_vec()));
    let ([cue, cue_markers], [object, object_markers]) = (one, other);
    facts.names = [cue, object, cue_markers, object_markers];
    facts.names_balls = true;
    Some(())
}

/// Returns the groups of three or more points that keep their distances, the most rigid first.
pub(super) fn groups(points: &[RawTrack]) -> Vec<Vec<usize>> {
    let pairs = (0..points.len()).flat_map(|i| (0..i).map(move |j| [i, j]));
    let changes = pairs.map(|[i, j]| (change(&points[i], &points[j]), [i, j]));
    let mut rigid: Vec<(f64, [usize; 2])> = changes.filter(|(change, _)| *change <= MAX_CHANGE).collect();
    rigid.sort_by(|a, b| a.0.total_cmp(&b.0));
    let is_rigid = |i: usize, j: usize| rigid.iter().any(|(_, pair)| *pair == [i.max(j), i.min(j)]);
    let mut groups: Vec<Vec<usize>> = (0..points.len()).map(|i| vec![i]).collect();
    for (_, [i, j]) in &rigid {
        let at = |point: &usize| groups.iter().position(|group| group.contains(point));
        let (Some(a), Some(b)) = (at(i), at(j)) else { continue };
        if a != b && groups[a].iter().all(|p| groups[b].iter().all(|q| is_rigid(*p, *q))) {
            let mut joined = groups.remove(a.max(b));
            groups[a.min(b)].append(&mut joined);
            groups[a.min(b)].sort_unstable();
        }
    }
    groups.retain(|group| group.len() > 2);
    groups
}

fn change(one: &RawTrack, other: &RawTrack) -> f64 {
    let smooth = sorted(one.distances(other).windows(MEDIAN_FRAMES).map(|window| median(window.to_vec())));
    let ([least, ..], [.., most]) = (&smooth[..], &smooth[..]) else { return f64::INFINITY };
    (most - least) / smooth[smooth.len() / 2].max(f64::MIN_POSITIVE)
}

/// Returns which of the points on each disc is its centre; `None` if they are on a circle about it.
/// Of three points one may have equal distances to the others and yet be on the rim, as at the
/// corner of a square: the centre moves straight, which points beside it do not if the disc turns.
fn find_centres(discs: &[Vec<&RawTrack>; 2]) -> [Option<usize>; 2] {
    let candidates = discs.each_ref().map(|points| find_equidistant(points));
    let bends = |(points, candidate): (&Vec<&RawTrack>, &Option<usize>)| {
        let candidate = candidate.filter(|_| points.len() == 3)?;
        let sample = |row: &Row| Sample::new(row.time, row.place);
        let paths: Vec<Vec<Sample>> = points.iter().map(|point| point.seen().map(sample).collect()).collect();
        let slices: Vec<&[Sample]> = paths.iter().map(Vec::as_slice).collect();
        Some([bend(&paths[candidate]), bend(&circle_centres(&slices).ok()?)])
    };
    let bends = discs.iter().zip(&candidates).filter_map(bends);
    let [points, circles] = bends.fold([0.0; 2], |sum, bend| [sum[0] + bend[0], sum[1] + bend[1]]);
    // clearly, since all points of a disc that does not turn move alike
    let is_straighter = 2.0 * points < circles;
    [0, 1].map(|disc| candidates[disc].filter(|_| discs[disc].len() > 3 || is_straighter))
}

/// Returns how far a path bends: the median length of its second differences over a tenth of it.
fn bend(path: &[Sample]) -> f64 {
    let lag = path.len() / 10;
    let second = |i: usize| {
        let [a, b, c] = [&path[i], &path[i + lag], &path[i + 2 * lag]];
        (a.x - 2.0 * b.x + c.x).hypot(a.y - 2.0 * b.y + c.y)
    };
    median((0..path.len() - 2 * lag).map(second).collect())
}

/// Returns the point whose distances to the others are equal.
fn find_equidistant(points: &[&RawTrack]) -> Option<usize> {
    let is_like_centre = |i: &usize| {
        let others = (0..points.len()).filter(|j| j != i);
        let typical = others.map(|j| median(points[*i].distances(points[j])));
        let [least, most] = span(typical.map(|d| if d.is_nan() { f64::INFINITY } else { d }));
        most.max(0.0) <= (1.0 + MAX_INEQUALITY) * least
    };
    // no circle about a point of the rim meets the rim in three points
    (0..points.len()).filter(|_| points.len() > 2).find(is_like_centre)
}
