//! Tracking of two balls in rows of detections that do not name the ball.

use super::clips::STEPS;
use super::discs::beginning;
use super::input::Input;
use super::raw::{GAPS, NAMES, RawShot, RawTrack, Row, middle};

/// Splits the rows of every shot, one track without a name, into the tracks of two balls. In every
/// clip the first to move is the cue ball.
pub(super) fn part(shots: &mut [RawShot], input: &Input) {
    let names = input.settings.first_names();
    let new = || names.map(|name| RawTrack::new(name, None));
    for shot in shots {
        let mut rows: Vec<Row> = shot.tracks.iter().flat_map(|track| track.seen().copied()).collect();
        rows.sort_by(|a, b| a.time.total_cmp(&b.time));
        let (mut tracks, mut clip, mut others) = (new(), new(), Vec::new());
        let steps = rows.windows(2).map(|two| two[1].time - two[0].time).filter(|step| *step > 0.0);
        let pause = STEPS * middle(steps).unwrap_or_default();
        for frame in rows.chunk_by(|a, b| a.time == b.time) {
            let last = clip.each_ref().map(|track| track.rows.last());
            let mut found = nearest(last, frame);
            if begins(last, found.map(|i| i.map(|i| &frame[i])), pause) {
                append(&mut tracks, std::mem::replace(&mut clip, new()));
                found = nearest([None; 2], frame);
            }
            let is_other = |i: &usize| !found.contains(&Some(*i));
            others.extend((0..frame.len()).filter(is_other).map(|i| frame[i].line));
            for (track, row) in clip.iter_mut().zip(found) {
                track.rows.extend(row.map(|row| frame[row]));
            }
        }
        append(&mut tracks, clip);
        if let Some(first) = others.first() {
            let are = if others.len() == 1 { "row" } else { "rows" };
            let message = format!("{} {are} of other objects than the two balls: left out", others.len());
            input.log.add(GAPS, *first, message);
        }
        shot.tracks = tracks.into();
    }
    let message = format!(
        "rows do not name the ball: both balls are followed from frame to frame, and \"{}\" is the one that moves first",
        names[0]
    );
    input.log.add(NAMES, None, message);
}

/// Appends the tracks of a clip, that of the ball which moves first to the first track.
fn append(tracks: &mut [RawTrack; 2], mut clip: [RawTrack; 2]) {
    let [cue, object] = clip.each_ref().map(|track| beginning(track, &clip));
    if object.zip(cue).is_some_and(|(object, cue)| object < cue) {
        clip.reverse();
    }
    for (track, part) in tracks.iter_mut().zip(clip) {
        track.rows.extend(part.rows);
    }
}

/// Returns whether another clip begins: after a pause, or if both jump beyond their distance.
fn begins(last: [Option<&Row>; 2], now: [Option<&Row>; 2], pause: f64) -> bool {
    let ([Some(one), Some(other)], [Some(a), Some(b)]) = (last, now) else { return false };
    let apart = one.distance(*other);
    a.time - one.time.max(other.time) > pause || one.distance(*a) > apart && other.distance(*b) > apart
}

/// Returns the rows of a frame nearest to two balls: the sum of both steps is least.
fn nearest(last: [Option<&Row>; 2], frame: &[Row]) -> [Option<usize>; 2] {
    let [Some(one), Some(other)] = last else {
        return if frame.len() == 2 { [Some(0), Some(1)] } else { [None; 2] };
    };
    if let [row] = frame {
        return if one.distance(*row) < other.distance(*row) { [Some(0), None] } else { [None, Some(0)] };
    }
    // the best pair has one of the two nearest rows for each ball
    let near = |ball: &Row| {
        let mut rows: Vec<usize> = (0..frame.len()).collect();
        rows.sort_by(|i, j| ball.distance(frame[*i]).total_cmp(&ball.distance(frame[*j])));
        rows.truncate(2);
        rows
    };
    let way = |(i, j): &(usize, usize)| one.distance(frame[*i]) + other.distance(frame[*j]);
    let (of_one, of_other) = (near(one), near(other));
    let two = of_one.iter().flat_map(|i| of_other.iter().map(move |j| (*i, *j))).filter(|(i, j)| i != j);
    two.min_by(|a, b| way(a).total_cmp(&way(b))).map_or([None; 2], |(i, j)| [Some(i), Some(j)])
}
