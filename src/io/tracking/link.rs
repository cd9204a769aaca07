//! Detections of two balls in rows that do not say which ball they are: each ball is followed from frame to frame.

use super::bodies::beginning;
use super::input::Input;
use super::raw::{GAPS, NAMES, RawShot, RawTrack, Row};

/// Parts every shot, whose rows are one track without a name, into the tracks of two balls. The one that moves first is the cue ball.
pub(super) fn part(shots: &mut [RawShot], input: &Input) {
    let names = [&input.settings.cue, &input.settings.object].map(|names| names.0[0].as_str());
    for shot in shots {
        let mut rows: Vec<Row> = shot.tracks.iter().flat_map(|track| track.seen().copied()).collect();
        rows.sort_by(|a, b| a.time.total_cmp(&b.time));
        let mut tracks = names.map(|name| RawTrack::new(name, None));
        let mut left = Vec::new();
        for frame in rows.chunk_by(|a, b| a.time == b.time) {
            let found = nearest(tracks.each_ref().map(|track| track.rows.last()), frame);
            left.extend(
                frame.iter().enumerate().filter(|(i, _)| !found.contains(&Some(*i))).map(|(_, row)| row.line),
            );
            for (track, row) in tracks.iter_mut().zip(found) {
                track.rows.extend(row.map(|row| frame[row]));
            }
        }
        if let Some(first) = left.first() {
            let are = if left.len() == 1 { "row" } else { "rows" };
            let message =
                format!("{} {are} of neither of the two balls that are followed: left out", left.len());
            input.log.add(GAPS, *first, message);
        }
        let [cue, object] = tracks.each_ref().map(|track| beginning(track, &tracks));
        if object.zip(cue).is_some_and(|(object, cue)| object < cue) {
            tracks.reverse();
            tracks.iter_mut().zip(names).for_each(|(track, name)| track.name = name.to_string());
        }
        shot.tracks = tracks.into();
    }
    let message = format!(
        "nothing says which ball a row is about: both balls are followed from frame to frame, and \"{}\" is the one that moves first",
        names[0]
    );
    input.log.add(NAMES, None, message);
}

/// Which rows of a frame are those of two balls that were last seen there: such that both together moved least.
fn nearest(last: [Option<&Row>; 2], frame: &[Row]) -> [Option<usize>; 2] {
    let [Some(one), Some(other)] = last else {
        return if frame.len() == 2 { [Some(0), Some(1)] } else { [None; 2] };
    };
    if let [row] = frame {
        return if one.distance(*row) < other.distance(*row) { [Some(0), None] } else { [None, Some(0)] };
    }
    let two = (0..frame.len()).flat_map(|i| (0..frame.len()).filter(move |j| *j != i).map(move |j| (i, j)));
    let way = |(i, j): &(usize, usize)| one.distance(frame[*i]) + other.distance(frame[*j]);
    two.min_by(|a, b| way(a).total_cmp(&way(b))).map_or([None; 2], |(i, j)| [Some(i), Some(j)])
}
