//! A guess of `[tracks.columns]` for an unknown table by its names, for a draft.

use std::num::NonZero;

use super::column_names::{Column, ColumnNames, KEYS};
use super::heading::{Heading, TITLES, blanks, suffix};
use super::sample::Rows;
use super::settings::TracksSection;
use super::units::AngleUnit;
use super::words::{self, Boxed, Kind, Role, find, is_angle, pairs};
use crate::io::number::value;
use crate::io::text::{Separator, filled_lines, trimmed, unmarked};

/// Largest angle of a disc in radians, two turns; degrees of a whole turn are 360.
const MAX_RADIANS: f64 = 4.0 * std::f64::consts::PI;

/// Guessed settings of `[tracks]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::io) struct Guess {
    /// `[tracks.columns]`.
    pub columns: Vec<Guessed>,
    pub angle_unit: Option<AngleUnit>,
    /// Whether the table has angles, which only discs do.
    pub has_angles: bool,
    /// Pairs of columns for x and y that are not positions of balls.
    pub passed: Vec<String>,
}

/// A key of `[tracks.columns]` and its possible column.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::io) struct Guessed {
    pub key: &'static str,
    pub column: Column,
    /// The condition under which an uncertain key is right: it is drafted as a comment.
    pub doubt: Option<String>,
}

impl Guess {
    pub(in crate::io) fn column(&self, key: &str) -> Option<&Column> {
        self.columns.iter().find(|guessed| guessed.key == key).map(|guessed| &guessed.column)
    }

    fn certain(&self) -> impl Iterator<Item = &Guessed> {
        self.columns.iter().filter(|guessed| guessed.doubt.is_none())
    }

    /// Returns the certain keys as a section of dataset.toml.
    pub(super) fn section(&self) -> TracksSection {
        let mut names = ColumnNames { angle_unit: self.angle_unit, ..ColumnNames::default() };
        self.certain().for_each(|guessed| names.set(guessed.key, guessed.column.clone()));
        TracksSection::of_columns((!self.columns.is_empty()).then_some(names))
    }

    /// Returns whether x and y may be those of a box instead of the ball.
    pub(super) fn has_boxes(&self) -> bool {
        self.columns.iter().any(|guessed| ["width", "x2"].contains(&guessed.key))
    }
}

/// Guesses the columns of a table; returns `None` if it is not understood.
pub(super) fn columns(text: &str) -> Option<Guess> {
    let top: Vec<(usize, &str)> = filled_lines(text).take(TITLES).collect();
    for (i, (line, content)) in top.iter().enumerate() {
        let bare = unmarked(content);
        for separator in Separator::ALL {
            let is_blank = separator == Separator::Char(' ');
            let separator = if is_blank { blanks(text, *line, bare) } else { separator };
            let Some(names) = trimmed(bare, separator).filter(|names| names.len() > 2) else { continue };
            if names.iter().all(|name| value(name).is_some()) {
                // names that are not understood may stand above the numbers
                let mut above = top[..i].iter().filter_map(|(_, line)| trimmed(line, separator));
                if above.any(|cells| cells.len() == names.len()) {
                    return None;
                }
                let heading = Heading::unnamed(*line, separator, names.len());
                return numbered(&Rows::of(text, &heading), names.len());
            }
            if let Some(guess) = named(text, &Heading::deep(text, *line, separator, names)) {
                return Some(guess);
            }
        }
    }
    None
}

/// Guesses the columns of a table without names: a time and positions of two balls, or frame, ball, x, y
/// and the size of a box (MOT, a benchmark of trackers, with -1 as the ball of detections).
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

/// Returns the key of this name.
fn known(key: &str) -> Option<&'static str> {
    KEYS.into_iter().find(|known| *known == key)
}

/// A table with names of columns, and the growing guess of their meaning.
struct Table<'a> {
    heading: &'a Heading,
    small: Vec<String>,
    rows: Rows,
    taken: Vec<usize>,
    guess: Guess,
}

/// Guesses the columns of a table by their names; rows show only which columns name balls.
fn named(text: &str, heading: &Heading) -> Option<Guess> {
    let small = heading.small();
    let all = pairs(&small);
    let of = |wanted: Kind| -> Vec<[usize; 2]> {
        all.iter().filter(|(_, kind)| *kind == wanted).map(|(pair, _)| *pair).collect()
    };
    let (mut positions, markers, spreads) = (of(Kind::Position), of(Kind::Marker), of(Kind::Spread));
    let mut taken: Vec<usize> = all.iter().flat_map(|(pair, _)| *pair).collect();
    let angles: Vec<usize> =
        (0..small.len()).filter(|i| !taken.contains(i) && is_angle(&small[*i])).collect();
    let rows = Rows::of(text, heading);
    if text.starts_with(MOTIVE) {
        lay_flat(&small, &mut positions);
    }
    let names_balls = |role| find(&small, role).is_some_and(|column| rows.values(column) > 1);
    let boxes = words::boxes(&small, names_balls(Role::Ball) || names_balls(Role::PerhapsBall));
    taken.extend(boxes.iter().flat_map(|boxed| [boxed.corner, boxed.rest.columns].concat()));
    let mut table = Table { heading, small, rows, taken, guess: Guess::default() };
    let shot = find(&table.small, Role::Shot);
    // detectors leave the column empty
    let is_full = |column: &usize| !table.taken.contains(column) && !table.rows.is_empty(*column);
    let stated = find(&table.small, Role::Ball).filter(is_full);
    if positions.is_empty() {
        positions.clone_from(&markers);
    }
    if let ([one, other], Some(_)) = (positions.as_slice(), stated)
        && let Some(one) = in_two_units(heading, *one, *other)
    {
        positions = vec![one];
    }
    // a column of balls that names only one, beside two pairs of columns
    let is_one = |column: &usize| positions.len() == 2 && boxes.len() != 1 && table.rows.values(*column) < 2;
    let stated = stated.filter(|column| !is_one(column));
    let time = find(&table.small, Role::Frame).or(find(&table.small, Role::Time));
    let others: Vec<usize> = time.into_iter().chain(shot).collect();
    let ball = stated.filter(|_| boxes.len() < 2).or_else(|| {
        find(&table.small, Role::PerhapsBall).filter(|column| {
            (positions.len() == 1 || boxes.len() == 1)
                && table.is_free(*column)
                && table.rows.distinguishes_rows(*column, &others)
        })
    });
    // without a column of balls, numbers that look like one box are those of two balls
    let are_pairs = time.is_some_and(|time| table.rows.are_pairs(time, shot));
    // ids that a tracker changed after it had lost a ball
    let ball = ball.filter(|ball| !(are_pairs && table.rows.values(*ball) > 2 && table.rows.is_whole(*ball)));
    if !boxes.is_empty() {
        positions = boxes.iter().map(|boxed| boxed.corner).collect();
    }
    table.add_all("", &["shot"], shot.map(|shot| vec![shot]));
    let only = |pairs: &[[usize; 2]]| if let [pair] = pairs { Some(pair.to_vec()) } else { None };
    match (positions.as_slice(), ball) {
        ([cue, object], None) => {
            table.add_time();
            table.add_all("cue_", &["x", "y"], Some(cue.to_vec()));
            table.add_all("object_", &["x", "y"], Some(object.to_vec()));
            if let [cue, object] = angles[..] {
                table.add_all("", &["cue_angle", "object_angle"], Some(vec![cue, object]));
            }
        }
        ([position], _) if ball.is_some() || are_pairs => {
            table.taken.extend(ball);
            table.add_time();
            table.add_all("", &["ball"], ball.map(|ball| vec![ball]));
            table.add_all("", &["x", "y"], Some(position.to_vec()));
            // without a column of balls, the paths separate them
            if ball.is_some() {
                table.add_all("", &["x_sd", "y_sd"], only(&spreads));
                table.add_all("", &["marker_x", "marker_y"], only(&markers));
                table.add_all("", &["angle"], Some(angles.clone()).filter(|angles| angles.len() == 1));
            }
        }
        _ => return None,
    }
    table.add_boxes(&positions, &boxes);
    table.add_likelihoods(&positions);
    // an angle for each ball, or no column is one of angles
    let turning = if angles.len() == positions.len() { angles.as_slice() } else { &[] };
    let mut guess = table.guess;
    if turning.iter().any(|column| !heading.has_unit(*column)) {
        let most = turning.iter().map(|column| table.rows.largest(*column)).fold(0.0, f64::max);
        guess.angle_unit = Some(if most > MAX_RADIANS { AngleUnit::Deg } else { AngleUnit::Rad });
    }
    guess.has_angles = !turning.is_empty();
    let passed = of(Kind::Motion).into_iter().flatten();
    guess.passed = passed.map(|column| heading.names[column].clone()).collect();
    Some(guess)
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
    let is_pixels = suffix(&heading.names[one[0]]).is_some_and(|(_, unit)| unit.is_pixels());
    is_same.then_some(if is_pixels { other } else { one })
}

impl Table<'_> {
    /// Adds the columns of keys that begin like this, if there are any.
    fn add_all(&mut self, begin: &str, keys: &[&str], columns: Option<Vec<usize>>) {
        let columns = columns.unwrap_or_default();
        for (key, column) in keys.iter().zip(&columns) {
            self.add(begin, key, *column, None);
        }
        self.taken.extend(columns);
    }

    fn add(&mut self, begin: &str, key: &str, column: usize, doubt: Option<String>) {
        let column = Column::Name(self.heading.names[column].clone());
        let key = known(&format!("{begin}{key}"));
        self.guess.columns.extend(key.map(|key| Guessed { key, column, doubt }));
    }

    fn is_free(&self, column: usize) -> bool {
        !self.taken.contains(&column) && !self.small[column].is_empty()
    }

    /// Adds the column of times or frames.
    fn add_time(&mut self) {
        for (role, key) in [(Role::Frame, "frame"), (Role::Time, "t")] {
            if let Some(column) = find(&self.small, role).filter(|column| self.is_free(*column)) {
                return self.add_all("", &[key], Some(vec![column]));
            }
        }
        let count = self.small.iter().position(|name| name == "n");
        self.add_all("", &["frame"], count.map(|column| vec![column]));
    }

    /// Adds the columns that determine the middle of boxes. The size is added as a comment if names
    /// do not show whether x and y are a corner or the middle.
    fn add_boxes(&mut self, positions: &[[usize; 2]], boxes: &[Boxed]) {
        const SIZE: [&str; 2] = ["width", "height"];
        for (i, position) in positions.iter().enumerate() {
            let begin = begin(positions, i);
            if let Some(Boxed { rest, .. }) = boxes.get(i) {
                let keys = if rest.is_size { SIZE } else { ["x2", "y2"] };
                self.add_all(begin, &keys, Some(rest.columns.to_vec()));
                continue;
            }
            let Some(size) = words::size(&self.small, position[0]) else { continue };
            let why = "of a box: take the # away, from both, if x and y are its corner, and not its middle";
            self.add(begin, SIZE[0], size[0], Some(why.to_string()));
            self.add(begin, SIZE[1], size[1], Some(String::new()));
        }
    }

    /// Adds the columns of likelihoods.
    fn add_likelihoods(&mut self, positions: &[[usize; 2]]) {
        const NAME: &str = "likelihood";
        for (i, [x, _]) in positions.iter().enumerate() {
            let alone = || self.small.iter().position(|own| own == NAME).filter(|_| positions.len() == 1);
            let column = words::beside(&self.small, *x, NAME).or_else(alone);
            self.add_all(begin(positions, i), &[NAME], column.map(|column| vec![column]));
        }
    }
}

/// Returns the beginning of the keys of a ball: nothing in a long table.
fn begin(positions: &[[usize; 2]], i: usize) -> &'static str {
    if positions.len() == 1 { "" } else { ["cue_", "object_"][i.min(1)] }
}
