//! Balls that a tracker lost and wrote down at a place where they are not: 0, 0, or −1, −1, or 9999.

use super::raw::{GAPS, Log, RawTrack, sorted};

/// A jump is one away from the path when it is this many times as long as what balls move in the same time.
const FAR: f64 = 5.0;

/// Balls move as fast as this part of all steps, from the slowest on: what is faster may be wrong.
const USUAL: f64 = 0.9;

/// A place that no program is known to write for a ball that is lost is one where a ball is exactly so often.
const OFTEN: usize = 3;

type Place = [f64; 2];

/// Rows of a track that follow each other in time and are at one place: their indices, and whether the track jumps far there and away.
struct Stay {
    place: Place,
    rows: Vec<usize>,
    is_far: bool,
}

/// Turns positions into gaps that stand for a ball that is lost: exactly the same far from the path, again and again, or one that
/// programs are known to write.
pub(super) fn leave_out(tracks: &mut [RawTrack], log: Log) {
    let orders: Vec<Vec<usize>> = tracks.iter().map(in_time).collect();
    let places: Vec<Vec<Place>> =
        tracks.iter().zip(&orders).map(|(track, order)| candidates(track, order)).collect();
    if places.iter().all(Vec::is_empty) {
        return;
    }
    let Some(speed) = usual_speed(tracks, &orders, &places) else { return };
    for (i, track) in tracks.iter_mut().enumerate() {
        let stays: Vec<Stay> = stays(track, &orders[i], &places[i], FAR * speed);
        let is_lost = |stay: &Stay| {
            let other = |known: &Stay| known.place == stay.place;
            stay.is_far
                && (is_known(stay.place) || stays.iter().filter(|stay| other(stay)).all(|stay| stay.is_far))
        };
        for stay in stays.iter().filter(|stay| is_lost(stay)) {
            for row in &stay.rows {
                let row = &mut track.rows[*row];
                let message = format!(
                    "\"{}\" is at ({}, {}), far from its path, as where it is lost: taken as a gap",
                    track.name, stay.place[0], stay.place[1]
                );
                log.add(GAPS, row.line, message);
                row.lose();
            }
        }
    }
}

/// The rows that are no gaps, in the order of time.
fn in_time(track: &RawTrack) -> Vec<usize> {
    let mut order: Vec<usize> = (0..track.rows.len()).filter(|i| !track.rows[*i].is_gap()).collect();
    if track.is_angle {
        order.clear();
    }
    order.sort_by(|a, b| track.rows[*a].time.total_cmp(&track.rows[*b].time));
    order
}

/// Whether programs write this place for a ball that is lost.
fn is_known([x, y]: Place) -> bool {
    let nines = |value: f64| {
        let digits = format!("{:.0}", value.abs());
        value.fract() == 0.0 && digits.len() > 2 && digits.bytes().all(|digit| digit == b'9')
    };
    x == y && (x == 0.0 || x == -1.0 || nines(x))
}

/// Places at which a ball may be that is lost.
fn candidates(track: &RawTrack, order: &[usize]) -> Vec<Place> {
    let mut all: Vec<Place> = order.iter().map(|i| [track.rows[*i].x, track.rows[*i].y]).collect();
    all.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let same = all.chunk_by(|a, b| a == b);
    same.filter(|same| same.len() >= OFTEN || is_known(same[0])).map(|same| same[0]).collect()
}

/// How fast balls move where they are at no such place.
fn usual_speed(tracks: &[RawTrack], orders: &[Vec<usize>], places: &[Vec<Place>]) -> Option<f64> {
    let mut speeds = Vec::new();
    for ((track, order), places) in tracks.iter().zip(orders).zip(places) {
        for two in order.windows(2) {
            let [a, b] = [track.rows[two[0]], track.rows[two[1]]];
            if b.time > a.time && ![a, b].iter().any(|row| places.contains(&[row.x, row.y])) {
                speeds.push(a.distance(b) / (b.time - a.time));
            }
        }
    }
    let speeds = sorted(speeds.into_iter());
    speeds.get((USUAL * speeds.len() as f64) as usize).copied().filter(|speed| *speed > 0.0)
}

/// The stays of a track at such places; a jump there that is faster than `fast` is far.
fn stays(track: &RawTrack, order: &[usize], places: &[Place], fast: f64) -> Vec<Stay> {
    let row = |at: usize| track.rows[order[at]];
    let place = |at: usize| [row(at).x, row(at).y];
    let jumps = |a: usize, b: usize| row(a).distance(row(b)) > fast * (row(b).time - row(a).time);
    let mut found = Vec::new();
    let mut at = 0;
    while at < order.len() {
        let first = at;
        at += 1;
        while at < order.len() && place(at) == place(first) {
            at += 1;
        }
        if !places.contains(&place(first)) {
            continue;
        }
        let before = (first > 0).then(|| jumps(first - 1, first));
        let behind = (at < order.len()).then(|| jumps(at - 1, at));
        let is_far = before.or(behind).is_some() && before.unwrap_or(true) && behind.unwrap_or(true);
        found.push(Stay { place: place(first), rows: order[first..at].to_vec(), is_far });
    }
    found
}
