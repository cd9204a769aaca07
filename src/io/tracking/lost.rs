//! Removal of places that trackers write for lost balls: 0, 0, or −1, −1, or 9999.

use super::raw::{GAPS, Log, RawTrack, Row, sorted};

/// Ratio of a jump away from the path to the fastest steps of the balls in the same time.
const MIN_LOST_JUMP: f64 = 5.0;

/// Fraction of the steps, from the slowest on, that give the balls' speed: others may be wrong.
const SPEED_QUANTILE: f64 = 0.9;

/// Least number of rows exactly at one place at which it may be that of a lost ball even if no
/// program is known to write it.
const MIN_REPEATS: usize = 3;

/// The rows of a track without gaps, in the order of time, and possible places of a lost ball.
struct Path {
    rows: Vec<usize>,
    places: Vec<[f64; 2]>,
}

/// Turns positions of lost balls into gaps: exactly equal places far from the path, repeated or
/// such as programs are known to write.
pub(super) fn leave_out(tracks: &mut [RawTrack], log: Log) {
    let paths: Vec<Path> = tracks.iter().map(Path::of).collect();
    if paths.iter().all(|path| path.places.is_empty()) {
        return;
    }
    let mut speeds = Vec::new();
    for (track, path) in tracks.iter().zip(&paths) {
        let steps = path.rows.windows(2).map(|two| [track.rows[two[0]], track.rows[two[1]]]);
        let is_lost = |row: &Row| path.places.contains(&row.place());
        let good = steps.filter(|two| two[1].time > two[0].time && !two.iter().any(is_lost));
        speeds.extend(good.map(|[a, b]| a.distance(b) / (b.time - a.time)));
    }
    let speeds = sorted(speeds.into_iter());
    let fast = speeds.get((SPEED_QUANTILE * speeds.len() as f64) as usize).filter(|speed| **speed > 0.0);
    let Some(fast) = fast.map(|speed| MIN_LOST_JUMP * speed) else { return };
    for (RawTrack { name, rows, .. }, path) in tracks.iter_mut().zip(&paths) {
        let (far, near): (Vec<_>, Vec<_>) =
            path.stays(rows, fast).into_iter().partition(|(_, is_far)| *is_far);
        let place = |stay: &[usize]| rows[stay[0]].place();
        let is_always_far = |at| near.iter().all(|(stay, _)| place(stay) != at);
        let is_lost = |(stay, _): &(&[usize], bool)| is_known(place(stay)) || is_always_far(place(stay));
        let lost: Vec<usize> = far.into_iter().filter(is_lost).flat_map(|(stay, _)| stay).copied().collect();
        for row in lost {
            let [x, y] = rows[row].place();
            let message =
                format!("\"{name}\" is at ({x}, {y}), far from its path, as if it was lost: taken as a gap");
            log.add(GAPS, rows[row].line, message);
            rows[row].lose();
        }
    }
}

/// Returns whether programs write this place for a lost ball.
fn is_known([x, y]: [f64; 2]) -> bool {
    let are_nines = |value: f64| {
        let digits = format!("{:.0}", value.abs());
        value.fract() == 0.0 && digits.len() > 2 && digits.bytes().all(|digit| digit == b'9')
    };
    x == y && (x == 0.0 || x == -1.0 || are_nines(x))
}

impl Path {
    fn of(track: &RawTrack) -> Self {
        let is_seen = |i: &usize| !track.is_angle && !track.rows[*i].is_gap();
        let mut rows: Vec<usize> = (0..track.rows.len()).filter(is_seen).collect();
        rows.sort_by(|a, b| track.rows[*a].time.total_cmp(&track.rows[*b].time));
        let mut places: Vec<[f64; 2]> = rows.iter().map(|i| track.rows[*i].place()).collect();
        places.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let equal = places.chunk_by(|a, b| a == b);
        let equal = equal.filter(|equal| equal.len() >= MIN_REPEATS || is_known(equal[0]));
        Self { places: equal.map(|equal| equal[0]).collect(), rows }
    }

    /// Returns consecutive rows at each place of a lost ball, and whether the track jumps there and
    /// back faster than `fast`.
    fn stays(&self, rows: &[Row], fast: f64) -> Vec<(&[usize], bool)> {
        let jumps = |a: usize, b: usize| rows[a].distance(rows[b]) > fast * (rows[b].time - rows[a].time);
        let mut stays = Vec::new();
        let mut from: usize = 0;
        for stay in self.rows.chunk_by(|a, b| rows[*a].place() == rows[*b].place()) {
            let before = from.checked_sub(1).map(|i| jumps(self.rows[i], stay[0]));
            from += stay.len();
            let behind = self.rows.get(from).map(|next| jumps(stay[stay.len() - 1], *next));
            let is_far = before.or(behind).is_some() && before != Some(false) && behind != Some(false);
            if self.places.contains(&rows[stay[0]].place()) {
                stays.push((stay, is_far));
            }
        }
        stays
    }
}
