//! Removal of places that trackers write for lost balls: 0, 0, or −1, −1, or 9999.

use super::raw::{GAPS, Log, RawTrack, Row, sorted};

/// Ratio of a jump away from the path to the fastest steps of the balls in the same time.
const MIN_JUMP: f64 = 5.0;

/// Fraction of the steps, from the slowest on, that give the balls' speed: others may be wrong.
const SPEED_QUANTILE: f64 = 0.9;

/// Least number of rows exactly at one place at which it may be that of a lost ball even if no
/// program is known to write it.
const MIN_REPEATS: usize = 3;

type Place = [f64; 2];

/// The rows of a track without gaps, in the order of time, and possible places of a lost ball.
struct Path {
    rows: Vec<usize>,
    places: Vec<Place>,
}

/// Turns positions of lost balls into gaps: exactly equal places far from the path, repeated or
/// such as programs are known to write.
pub(super) fn leave_out(tracks: &mut [RawTrack], log: Log) {
    let paths: Vec<Path> = tracks.iter().map(Path::of).collect();
    if paths.iter().all(|path| path.places.is_empty()) {
        return;
    }
    let steps = tracks.iter().zip(&paths).flat_map(|(track, path)| {
        path.rows.windows(2).map(|two| [track.rows[two[0]], track.rows[two[1]]]).filter(|two| {
            two[1].time > two[0].time && !two.iter().any(|row| path.places.contains(&place(row)))
        })
    });
    let speeds = sorted(steps.map(|[a, b]| a.distance(b) / (b.time - a.time)));
    let usual = speeds.get((SPEED_QUANTILE * speeds.len() as f64) as usize).filter(|speed| **speed > 0.0);
    let Some(usual) = usual else { return };
    for (RawTrack { name, rows, .. }, path) in tracks.iter_mut().zip(&paths) {
        let stays = path.stays(rows, MIN_JUMP * usual);
        let is_far_always =
            |at: Place| stays.iter().all(|stay| stay.is_far || place(&rows[stay.rows[0]]) != at);
        let is_lost = |stay: &&Stay| {
            let at = place(&rows[stay.rows[0]]);
            stay.is_far && (is_known(at) || is_far_always(at))
        };
        let lost: Vec<usize> = stays.iter().filter(is_lost).flat_map(|stay| stay.rows).copied().collect();
        for row in lost {
            let [x, y] = place(&rows[row]);
            let message =
                format!("\"{name}\" is at ({x}, {y}), far from its path, as if it was lost: taken as a gap");
            log.add(GAPS, rows[row].line, message);
            rows[row].lose();
        }
    }
}

fn place(row: &Row) -> Place {
    [row.x, row.y]
}

/// Returns whether programs write this place for a lost ball.
fn is_known([x, y]: Place) -> bool {
    let nines = |value: f64| {
        let digits = format!("{:.0}", value.abs());
        value.fract() == 0.0 && digits.len() > 2 && digits.bytes().all(|digit| digit == b'9')
    };
    x == y && (x == 0.0 || x == -1.0 || nines(x))
}

/// Consecutive rows at one place, and whether the track jumps far there and back.
struct Stay<'a> {
    rows: &'a [usize],
    is_far: bool,
}

impl Path {
    fn of(track: &RawTrack) -> Self {
        let is_seen = |i: &usize| !track.is_angle && !track.rows[*i].is_gap();
        let mut rows: Vec<usize> = (0..track.rows.len()).filter(is_seen).collect();
        rows.sort_by(|a, b| track.rows[*a].time.total_cmp(&track.rows[*b].time));
        let mut places: Vec<Place> = rows.iter().map(|i| place(&track.rows[*i])).collect();
        places.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let same =
            places.chunk_by(|a, b| a == b).filter(|same| same.len() >= MIN_REPEATS || is_known(same[0]));
        let places = same.map(|same| same[0]).collect();
        Self { rows, places }
    }

    /// Returns the stays at places of lost balls; a jump faster than `fast` is far.
    fn stays<'a>(&'a self, rows: &[Row], fast: f64) -> Vec<Stay<'a>> {
        let jumps = |a: usize, b: usize| rows[a].distance(rows[b]) > fast * (rows[b].time - rows[a].time);
        let mut stays = Vec::new();
        let mut from: usize = 0;
        for stay in self.rows.chunk_by(|a, b| place(&rows[*a]) == place(&rows[*b])) {
            let before = from.checked_sub(1).map(|i| jumps(self.rows[i], stay[0]));
            from += stay.len();
            let behind = self.rows.get(from).map(|next| jumps(stay[stay.len() - 1], *next));
            let is_far = before.or(behind).is_some() && before != Some(false) && behind != Some(false);
            if self.places.contains(&place(&rows[stay[0]])) {
                stays.push(Stay { rows: stay, is_far });
            }
        }
        stays
    }
}
