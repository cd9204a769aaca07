//! A guess of `[tracks.columns]` for an unknown table.

use std::num::NonZero;

use super::column_names::{Column, Columns};
use super::heading::{Heading, Rows, TITLES, headings};
use super::words::{BALLS, FRAMES, Kind, PERHAPS_BALLS, SHOTS, TIMES, beside, boxes, find, is_angle, pairs};
use crate::io::number::value;

/// Largest angle of a disc in radians, two turns; degrees of a whole turn are 360.
const MAX_RADIANS: f64 = 4.0 * std::f64::consts::PI;
/// Beginning of exports of Motive (OptiTrack), whose height is y.
const MOTIVE: &str = "Format Version";

/// Guessed `[tracks.columns]`.
#[derive(Default)]
pub(super) struct Guess {
    pub(crate) columns: Columns,
    /// Whether names leave open if x and y are a corner of a box of the size here, or its middle.
    pub(crate) is_size_doubtful: bool,
}

impl Guess {
    pub(super) fn is_doubtful(&self, key: &str) -> bool {
        self.is_size_doubtful && (key.ends_with("width") || key.ends_with("height"))
    }

    pub(super) fn certain(&self) -> Option<Columns> {
        let mut columns = self.columns.clone();
        columns.retain(|key, _| !self.is_doubtful(key));
        (!columns.is_empty()).then_some(columns)
    }

    pub(super) fn has_angles(&self) -> bool {
        self.columns.keys().any(|key| key.ends_with("angle"))
    }

    pub(super) fn has_boxes(&self) -> bool {
        ["width", "x2"].iter().any(|key| self.columns.contains_key(*key))
    }
}

/// Guesses the columns of a table; returns `None` if it is not understood.
pub(super) fn columns(text: &str) -> Option<Guess> {
    let headings = headings(text, TITLES);
    for heading in headings.iter().filter(|heading| heading.own.len() > 2) {
        let Heading { line, separator, own, .. } = heading;
        if own.iter().all(|name| value(name).is_some()) {
            // names that are not understood may stand above the numbers
            let is_above = |other: &Heading| {
                other.line < *line && other.separator == *separator && other.own.len() == own.len()
            };
            let plain = Heading::unnamed(*line, *separator, own.len());
            return (!headings.iter().any(is_above)).then(|| numbered(&Rows::of(text, &plain), own.len()))?;
        }
        if let Some(guess) = named(text, heading) {
            return Some(guess);
        }
    }
    None
}

/// Guesses the columns of a table without names: a time and positions of two balls, or frame, ball,
/// x, y and the size of a box (MOT, a benchmark of trackers, with -1 as the ball of detections).
fn numbered(rows: &Rows, width: usize) -> Option<Guess> {
    let keys = match width {
        7.. if rows.is_whole(0) && rows.values(1) > 1 && rows.is_whole(1) => "frame ball x y width height",
        7.. if rows.are_pairs(0, None) => "frame - x y width height",
        4 => "cue_x cue_y object_x object_y",
        5 if rows.is_whole(0) => "frame cue_x cue_y object_x object_y",
        5 => "t cue_x cue_y object_x object_y",
        _ => return None,
    };
    let numbered = keys.split(' ').zip((1..).filter_map(NonZero::new)).filter(|(key, _)| *key != "-");
    let columns = numbered.map(|(key, number)| (key.to_string(), Column::Number(number))).collect();
    Some(Guess { columns, is_size_doubtful: false })
}

/// Guesses the columns of a table by their names; rows show only which columns name balls.
fn named(text: &str, heading: &Heading) -> Option<Guess> {
    let names = heading.small();
    let rows = Rows::of(text, heading);
    let all = pairs(&names);
    let of = |wanted: Kind| -> Vec<[usize; 2]> {
        all.iter().filter(|(_, kind)| *kind == wanted).map(|(pair, _)| *pair).collect()
    };
    let [mut positions, mut markers, spreads] = [Kind::Position, Kind::Marker, Kind::Spread].map(of);
    if text.starts_with(MOTIVE) {
        // seen from above, z, x and the height y are right-handed as x, y and z are
        for [x, y] in &mut positions {
            [*x, *y] = beside(&names, *x, "z").map_or([*x, *y], |z| [z, *x]);
        }
    }
    if positions.is_empty() {
        positions = std::mem::take(&mut markers);
    }
    let names_balls = |role| find(&names, role).is_some_and(|column| rows.values(column) > 1);
    let boxes = boxes(&names, names_balls(BALLS) || names_balls(PERHAPS_BALLS));
    let mut taken: Vec<usize> = all.iter().flat_map(|(pair, _)| *pair).collect();
    let mut angles: Vec<usize> =
        (0..names.len()).filter(|i| !taken.contains(i) && is_angle(&names[*i])).collect();
    taken.extend(boxes.iter().flat_map(|sides| [sides.corner, sides.rest].concat()));
    let is_free = |column: &usize| !taken.contains(column) && !names[*column].is_empty();
    let [frame, time, shot] = [FRAMES, TIMES, SHOTS].map(|role| find(&names, role));
    let ball = ball(&names, &rows, [frame.or(time), shot], [positions.len(), boxes.len()], is_free);
    // without a column of balls, numbers that look like one box are those of two balls
    let are_pairs = frame.or(time).is_some_and(|time| rows.are_pairs(time, shot));
    // ids that a tracker changed after it had lost a ball
    let ball = ball.filter(|ball| !(are_pairs && rows.values(*ball) > 2 && rows.is_whole(*ball)));
    if !boxes.is_empty() {
        positions = boxes.iter().map(|sides| sides.corner).collect();
    }
    let begins: &[&str] = match (positions.len(), ball) {
        (2, None) => &["cue_", "object_"],
        (1, _) if ball.is_some() || are_pairs => &[""],
        _ => return None,
    };
    let is_other = |column: &usize| is_free(column) && ![shot, ball].contains(&Some(*column));
    let frame = frame.filter(is_other);
    let time = time.filter(|column| frame.is_none() && is_other(column));
    let named_as = |name: &str| names.iter().position(|own| own == name);
    let count = named_as("n").filter(|_| time.is_none());
    // an angle for each ball, or no column is one of angles
    if angles.len() != positions.len() || begins.len() == 1 && ball.is_none() {
        angles.clear();
    }
    let mut columns = Columns::new();
    let mut add = |key: &str, column: Option<usize>| {
        let name = column.map(|column| Column::Name(heading.names[column].clone()));
        columns.extend(name.map(|name| (key.to_string(), name)));
    };
    for (key, column) in [("shot", shot), ("frame", frame.or(count)), ("t", time), ("ball", ball)] {
        add(key, column);
    }
    // deviations and markers of the ball that the row names
    let only = |pairs: &[[usize; 2]]| pairs.first().copied().filter(|_| pairs.len() == 1 && ball.is_some());
    for (i, (begin, xy)) in begins.iter().zip(&positions).enumerate() {
        let of = |word: &str| beside(&names, xy[0], word);
        let size = |width, height| Some([of(width)?, of(height)?]);
        let sides = boxes.get(i);
        let rest =
            sides.map(|sides| sides.rest).or_else(|| size("width", "height")).or_else(|| size("w", "h"));
        let is_size = sides.is_none_or(|sides| sides.is_size);
        for (pair, [x, y]) in [
            (Some(*xy), ["x", "y"]),
            (only(&spreads), ["x_sd", "y_sd"]),
            (only(&markers), ["marker_x", "marker_y"]),
            (rest, if is_size { ["width", "height"] } else { ["x2", "y2"] }),
        ] {
            add(&format!("{begin}{x}"), pair.map(|pair| pair[0]));
            add(&format!("{begin}{y}"), pair.map(|pair| pair[1]));
        }
        add(&format!("{begin}angle"), angles.get(i).copied());
        let single = || named_as("likelihood").filter(|_| begins.len() == 1);
        add(&format!("{begin}likelihood"), of("likelihood").or_else(single));
    }
    if angles.iter().any(|column| !heading.has_unit(*column)) {
        let most = angles.iter().map(|column| rows.largest(*column)).fold(0.0, f64::max);
        let unit = if most > MAX_RADIANS { "deg" } else { "rad" };
        columns.insert("angle_unit".to_string(), Column::Name(unit.to_string()));
    }
    Some(Guess { columns, is_size_doubtful: boxes.is_empty() })
}

/// Returns the column of balls of a table with these columns of times and shots, pairs of positions
/// and boxes; one whose name is less certain only if rows differ by it.
fn ball(
    names: &[String],
    rows: &Rows,
    others: [Option<usize>; 2],
    [positions, boxes]: [usize; 2],
    is_free: impl Fn(&usize) -> bool,
) -> Option<usize> {
    // detectors leave the column empty, or name one ball beside two pairs of columns
    let is_one = |column: &usize| positions == 2 && boxes != 1 && rows.values(*column) < 2;
    let is_stated =
        |column: &usize| boxes < 2 && is_free(column) && !rows.is_empty(*column) && !is_one(column);
    let may_name = |column: &usize| {
        (positions == 1 || boxes == 1) && is_free(column) && rows.distinguishes_rows(*column, others)
    };
    let stated = find(names, BALLS).filter(is_stated);
    stated.or_else(|| find(names, PERHAPS_BALLS).filter(may_name))
}
