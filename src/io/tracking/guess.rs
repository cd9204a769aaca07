//! A guess of `[tracks.columns]` for an unknown table by its names, for a draft.

use std::num::NonZero;

use super::column_names::{Column, ColumnNames, KEYS};
use super::heading::{Heading, TITLES, Top, suffix, tops};
use super::sample::Rows;
use super::settings::TracksSection;
use super::units::{AngleUnit, Measure, Unit};
use super::words::{self, Boxed, Kind, Role, find, is_angle, pairs};
use crate::io::number::value;

/// Largest angle of a disc in radians, two turns; degrees of a whole turn are 360.
const MAX_RADIANS: f64 = 4.0 * std::f64::consts::PI;

/// Remark on the size of a box if names do not show whether x and y are a corner or the middle.
const DOUBT: &str = "of a box: take the # away, from both, if x and y are its corner, and not its middle";

/// Guessed settings of `[tracks]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::io) struct Guess {
    /// `[tracks.columns]`.
    pub(crate) columns: Vec<Guessed>,
    pub(crate) angle_unit: Option<AngleUnit>,
    /// Whether the table has angles, which only discs do.
    pub(crate) has_angles: bool,
}

/// A key of `[tracks.columns]` and its possible column.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::io) struct Guessed {
    pub(crate) key: &'static str,
    pub(crate) column: Column,
    /// The condition under which an uncertain key is right: it is drafted as a comment.
    pub(crate) doubt: Option<&'static str>,
}

impl Guess {
    pub(in crate::io) fn column(&self, key: &str) -> Option<&Column> {
        self.columns.iter().find(|guessed| guessed.key == key).map(|guessed| &guessed.column)
    }

    pub(super) fn section(&self) -> TracksSection {
        let mut names = ColumnNames { angle_unit: self.angle_unit, ..ColumnNames::default() };
        let certain = self.columns.iter().filter(|guessed| guessed.doubt.is_none());
        certain.for_each(|guessed| names.set(guessed.key, guessed.column.clone()));
        TracksSection::of_columns((!self.columns.is_empty()).then_some(names))
    }

    pub(super) fn has_boxes(&self) -> bool {
        self.columns.iter().any(|guessed| ["width", "x2"].contains(&guessed.key))
    }
}

/// Guesses the columns of a table; returns `None` if it is not understood.
pub(super) fn columns(text: &str) -> Option<Guess> {
    let tops = tops(text, TITLES);
    for top in tops.iter().filter(|top| top.names.len() > 2) {
        if top.names.iter().all(|name| value(name).is_some()) {
            // names that are not understood may stand above the numbers
            let is_above = |other: &&Top| other.line < top.line && other.separator == top.separator;
            if tops.iter().filter(is_above).any(|other| other.names.len() == top.names.len()) {
                return None;
            }
            let heading = Heading::unnamed(top.line, top.separator, top.names.len());
            return numbered(&Rows::of(text, &heading), top.names.len());
        }
        if let Some(guess) = named(text, &Heading::deep(text, top)) {
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
    let numbered = keys.split(' ').zip((1..).filter_map(NonZero::new));
    let guessed =
        |(key, number)| Some(Guessed { key: known(key)?, column: Column::Number(number), doubt: None });
    Some(Guess { columns: numbered.filter_map(guessed).collect(), ..Guess::default() })
}

fn known(key: &str) -> Option<&'static str> {
    KEYS.into_iter().find(|known| *known == key)
}

/// Guesses the columns of a table by their names; rows show only which columns name balls.
fn named(text: &str, heading: &Heading) -> Option<Guess> {
    let small = heading.small();
    let rows = Rows::of(text, heading);
    let all = pairs(&small);
    let of = |wanted: Kind| -> Vec<[usize; 2]> {
        all.iter().filter(|(_, kind)| *kind == wanted).map(|(pair, _)| *pair).collect()
    };
    let (mut positions, markers, spreads) = (of(Kind::Position), of(Kind::Marker), of(Kind::Spread));
    let mut taken: Vec<usize> = all.iter().flat_map(|(pair, _)| *pair).collect();
    let mut angles: Vec<usize> =
        (0..small.len()).filter(|i| !taken.contains(i) && is_angle(&small[*i])).collect();
    if text.starts_with(MOTIVE) {
        lay_flat(&small, &mut positions);
    }
    let names_balls = |role| find(&small, role).is_some_and(|column| rows.values(column) > 1);
    let boxes = words::boxes(&small, names_balls(Role::Ball) || names_balls(Role::PerhapsBall));
    taken.extend(boxes.iter().flat_map(|boxed| [boxed.corner, boxed.rest.columns].concat()));
    let is_free = |column: &usize| !taken.contains(column) && !small[*column].is_empty();
    let shot = find(&small, Role::Shot);
    // detectors leave the column empty
    let stated = find(&small, Role::Ball).filter(|column| !taken.contains(column) && !rows.is_empty(*column));
    if positions.is_empty() {
        positions.clone_from(&markers);
    }
    if let ([one, other], Some(_)) = (positions.as_slice(), stated)
        && let Some(one) = in_two_units(heading, *one, *other)
    {
        positions = vec![one];
    }
    // a column of balls that names only one, beside two pairs of columns
    let is_one = |column: &usize| positions.len() == 2 && boxes.len() != 1 && rows.values(*column) < 2;
    let stated = stated.filter(|column| !is_one(column) && boxes.len() < 2);
    let [frame, time] = [Role::Frame, Role::Time].map(|role| find(&small, role));
    let others: Vec<usize> = frame.or(time).into_iter().chain(shot).collect();
    let may_name = |column: &usize| {
        (positions.len() == 1 || boxes.len() == 1)
            && is_free(column)
            && rows.distinguishes_rows(*column, &others)
    };
    let ball = stated.or_else(|| find(&small, Role::PerhapsBall).filter(may_name));
    // without a column of balls, numbers that look like one box are those of two balls
    let are_pairs = frame.or(time).is_some_and(|time| rows.are_pairs(time, shot));
    // ids that a tracker changed after it had lost a ball
    let ball = ball.filter(|ball| !(are_pairs && rows.values(*ball) > 2 && rows.is_whole(*ball)));
    if !boxes.is_empty() {
        positions = boxes.iter().map(|boxed| boxed.corner).collect();
    }
    let begins: &[&str] = match (positions.len(), ball) {
        (2, None) => &["cue_", "object_"],
        (1, _) if ball.is_some() || are_pairs => &[""],
        _ => return None,
    };
    let is_other = |column: &usize| is_free(column) && Some(*column) != shot && Some(*column) != ball;
    let frame = frame.filter(is_other);
    let time = time.filter(|column| frame.is_none() && is_other(column));
    let count = || small.iter().position(|name| name == "n");
    let frame = frame.or_else(|| if time.is_none() { count() } else { None });
    let mut keys = vec![
        ("shot", "", shot, None),
        ("frame", "", frame, None),
        ("t", "", time, None),
        ("ball", "", ball, None),
    ];
    // an angle for each ball, or no column is one of angles
    if angles.len() != positions.len() || begins.len() == 1 && ball.is_none() {
        angles.clear();
    }
    let only = |pairs: &[[usize; 2]]| {
        pairs.first().copied().filter(|_| pairs.len() == 1 && begins.len() == 1 && ball.is_some())
    };
    for (i, begin) in begins.iter().enumerate() {
        let likelihood = words::beside(&small, positions[i][0], "likelihood");
        let alone = || small.iter().position(|own| own == "likelihood").filter(|_| begins.len() == 1);
        let (rest, doubt) = match boxes.get(i) {
            Some(Boxed { rest, .. }) => (Some((rest.is_size, rest.columns)), None),
            None => (words::size(&small, positions[i][0]).map(|size| (true, size)), Some(DOUBT)),
        };
        let pair = |columns: Option<[usize; 2]>| columns.map_or([None; 2], |pair| pair.map(Some));
        let rest_keys =
            if rest.is_some_and(|(is_size, _)| is_size) { ["width", "height"] } else { ["x2", "y2"] };
        for (names, columns, doubt) in [
            (["x", "y"], pair(Some(positions[i])), None),
            (["x_sd", "y_sd"], pair(only(&spreads)), None),
            (["marker_x", "marker_y"], pair(only(&markers)), None),
            (["angle", "likelihood"], [angles.get(i).copied(), likelihood.or_else(alone)], None),
            (rest_keys, pair(rest.map(|(_, columns)| columns)), doubt),
        ] {
            keys.extend(names.into_iter().zip(columns).map(|(key, column)| (key, *begin, column, doubt)));
        }
    }
    let guessed = keys.into_iter().filter_map(|(key, begin, column, doubt)| {
        let column = Column::Name(heading.names[column?].clone());
        Some(Guessed { key: known(&format!("{begin}{key}"))?, column, doubt })
    });
    let columns = guessed.collect();
    let most = angles.iter().map(|column| rows.largest(*column)).fold(0.0, f64::max);
    let unit = if most > MAX_RADIANS { AngleUnit::Deg } else { AngleUnit::Rad };
    let angle_unit = angles.iter().any(|column| !heading.has_unit(*column)).then_some(unit);
    Some(Guess { columns, angle_unit, has_angles: !angles.is_empty() })
}

/// Beginning of exports of Motive (OptiTrack), whose height is y.
const MOTIVE: &str = "Format Version";

/// Replaces x and y of positions by z and x: seen from above, z, x and the height y are right-handed
/// as x, y and z are.
fn lay_flat(names: &[String], positions: &mut [[usize; 2]]) {
    for position in positions {
        if let Some(z) = words::beside(names, position[0], "z") {
            *position = [z, position[0]];
        }
    }
}

/// Returns the columns in another unit than pixels, of two pairs with the same positions.
fn in_two_units(heading: &Heading, one: [usize; 2], other: [usize; 2]) -> Option<[usize; 2]> {
    let bare = |pair: [usize; 2]| suffix(&heading.names[pair[0]]).map(|(bare, _)| bare);
    let is_same = bare(one)?.eq_ignore_ascii_case(bare(other)?);
    let is_pixels = suffix(&heading.names[one[0]]).is_some_and(|(_, unit)| unit == Measure::Length(Unit::Px));
    is_same.then_some(if is_pixels { other } else { one })
}
