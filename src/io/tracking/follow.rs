//! Both balls of rows that do not name the ball: each is followed from frame to frame.

use super::raw::{Job, RawShot, RawTrack, Row, stem};
use super::settings::TrackSettings;
use crate::io::error::{Subject, message};

/// Splits the rows of every shot into the tracks of two balls, named when clips are separated.
pub(super) fn follow(shots: &mut [RawShot], job: Job) {
    for shot in shots {
        let rows: Vec<Row> = shot.tracks.iter().flat_map(RawTrack::seen).copied().collect();
        if rows.windows(2).all(|two| two[0].time < two[1].time) {
            // a file of one ball
            shot.tracks.iter_mut().for_each(|track| track.name = stem(job.file).into_owned());
            continue;
        }
        let frames: Vec<&[Row]> = rows.chunk_by(|a, b| a.time == b.time).collect();
        let Some((start, balls)) = find_balls(&frames) else {
            let message = "rows do not name the ball, and no frame has two; expected a row of each ball, or a column that names it";
            job.wrong(rows.first().map(|row| row.line), None, message);
            continue;
        };
        let (before, after) = frames.split_at(start);
        let (mut tracks, mut others) = (vec![RawTrack::default(); 2], Vec::new());
        // from there back to the first frame, and then on to the last
        for frames in [before.iter().rev().collect::<Vec<_>>(), after.iter().collect()] {
            let mut last = balls;
            for frame in frames {
                let followed = nearest(last, frame);
                let is_other = |row: &usize| !followed.contains(&Some(*row));
                others.extend((0..frame.len()).filter(is_other).map(|row| frame[row].line));
                for (ball, row) in followed.into_iter().enumerate() {
                    let Some(row) = row else { continue };
                    last[ball] = frame[row];
                    tracks[ball].rows.push(frame[row]);
                }
            }
        }
        for track in &mut tracks {
            track.rows.sort_by(|a, b| a.time.total_cmp(&b.time));
        }
        if let Some(first) = others.iter().min() {
            job.note(Subject::Gaps, *first, message!("other_objects", rows => others.len()));
        }
        shot.tracks = tracks;
        let message = "rows do not name the ball: both balls are followed from frame to frame, and the one that moves first is the cue ball";
        job.note(Subject::Names, None, message);
    }
}

/// Returns the number of the first frame with a row of each ball, and these two rows. If most frames
/// have more rows, the two balls are those that are not at the same place in the last such frame.
fn find_balls(frames: &[&[Row]]) -> Option<(usize, [Row; 2])> {
    let mut counts: Vec<usize> = frames.iter().map(|frame| frame.len()).collect();
    counts.sort_unstable();
    let of_two = counts.iter().filter(|count| **count == 2).count();
    let typical = if 3 * of_two < counts.len() { counts[counts.len() / 2] } else { 2 };
    let is_typical = |frame: &&[Row]| frame.len() == typical.max(2);
    let start = frames.iter().position(is_typical)?;
    let last = frames.iter().rfind(|frame| is_typical(frame))?;
    let way = |row: &Row| last.iter().map(|other| row.distance(other)).fold(f64::INFINITY, f64::min);
    let mut rows = frames[start].to_vec();
    rows.sort_by(|a, b| way(b).total_cmp(&way(a)));
    Some((start, [rows[0], rows[1]]))
}

/// Returns the rows of a frame nearest to two balls: the sum of both steps is least.
fn nearest([one, other]: [Row; 2], frame: &[Row]) -> [Option<usize>; 2] {
    if let [row] = frame {
        return if one.distance(row) < other.distance(row) { [Some(0), None] } else { [None, Some(0)] };
    }
    let way = |(i, j): &(usize, usize)| one.distance(&frame[*i]) + other.distance(&frame[*j]);
    let pairs = (0..frame.len()).flat_map(|i| (0..frame.len()).map(move |j| (i, j)));
    let least = pairs.filter(|(i, j)| i != j).min_by(|a, b| way(a).total_cmp(&way(b)));
    least.map_or([None; 2], |(i, j)| [Some(i), Some(j)])
}

/// Names the tracks that were followed: the first to move is the cue ball.
pub(super) fn name_followed(shot: &mut RawShot, settings: &TrackSettings) {
    if shot.tracks.len() != 2 || shot.tracks.iter().any(|track| !track.name.is_empty()) {
        return;
    }
    let [one, other] = [0, 1].map(|i| shot.beginning(&shot.tracks[i]));
    if other.zip(one).is_some_and(|(other, one)| other < one) {
        shot.tracks.reverse();
    }
    for (track, name) in shot.tracks.iter_mut().zip(settings.first_names()) {
        track.name = name.to_string();
    }
}
