//! A guess of `[tracks.columns]` for an unknown table, by its names or else its numbers, for a draft.

use std::num::NonZero;

use super::column_names::{Column, ColumnNames, KEYS};
use super::heading::{Heading, TITLES, blanks, suffix};
use super::reader::LIKELY;
use super::sample::Rows;
use super::settings::TracksSection;
use super::units::{AngleUnit, TimeUnit};
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
    /// The unit of times, if only their steps show it.
    pub time_unit: Option<TimeUnit>,
    /// Pairs of columns for x and y that are not positions of balls.
    pub passed: Vec<String>,
    /// A column that may be one of times or of numbers of frames.
    pub perhaps_time: Option<String>,
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
        TracksSection::of_columns((!self.columns.is_empty()).then_some(names), self.time_unit)
    }

    /// Returns whether x and y are certainly those of a box instead of the ball.
    pub(super) fn has_boxes(&self) -> bool {
        self.certain().any(|guessed| ["width", "x2"].contains(&guessed.key))
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

/// Guesses the columns of a table without names: positions of two balls, perhaps after a time; or
/// frame, ball, x and y, and perhaps the size of a box (MOT, a benchmark of trackers).
fn numbered(rows: &Rows, width: usize) -> Option<Guess> {
    let is_long = rows.is_whole(0) && rows.is_whole(1) && rows.distinguishes_rows(1, &[0]);
    let is_size = |column: usize| rows.is_size(|row| value(&row[column]));
    // rows of two balls without a column that separates them; MOT has -1 as the ball of detections
    let are_pairs = rows.is_whole(0) && rows.are_pairs(0, None);
    let keys = match width {
        6.. if is_long && is_size(4) && is_size(5) => "frame ball x y width height",
        6.. if are_pairs && rows.values(1) == 1 && is_size(4) && is_size(5) => "frame - x y width height",
        3.. if are_pairs && !is_long => "frame x y",
        4 | 5 if is_long && !rows.is_whole(2) => "frame ball x y",
        4 => "cue_x cue_y object_x object_y",
        5 if rows.is_whole(0) && rows.least_step(0, &[]) == Some(1.0) => {
            "frame cue_x cue_y object_x object_y"
        }
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

/// Guesses the columns of a table by their names and, where these do not decide, by its rows.
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
    rows.lay_flat(&small, &mut positions);
    let mut boxes = words::boxes(&small);
    let are_named = !boxes.is_empty();
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
    if !are_named {
        boxes = table.rows.boxes(&positions);
    }
    // a column of balls that names only one, beside two pairs of columns
    let is_one = |column: &usize| positions.len() == 2 && boxes.len() != 1 && table.rows.values(*column) < 2;
    let stated = stated.filter(|column| !is_one(column));
    let time = find(&table.small, Role::Frame).or(find(&table.small, Role::Time));
    let others: Vec<usize> = time.into_iter().chain(shot).collect();
    let ball = stated.filter(|_| boxes.len() < 2).or_else(|| {
        let mut perhaps = find(&table.small, Role::PerhapsBall).into_iter().chain(0..table.small.len());
        perhaps.find(|column| {
            (positions.len() == 1 || boxes.len() == 1)
                && table.is_free(*column)
                && !others.contains(column)
                && !angles.contains(column)
                && table.rows.distinguishes_rows(*column, &others)
        })
    });
    // without a column of balls, numbers that look like one box are those of two balls
    let are_pairs = time.is_some_and(|time| table.rows.are_pairs(time, shot));
    // ids that a tracker changed after it had lost a ball
    let ball = ball.filter(|ball| !(are_pairs && table.rows.values(*ball) > 2 && table.rows.is_whole(*ball)));
    boxes.retain(|_| are_named || ball.is_some() || are_pairs);
    if !boxes.is_empty() {
        positions = boxes.iter().map(|boxed| boxed.corner).collect();
    }
    table.add_all("", &["shot"], shot.map(|shot| vec![shot]));
    let groups: Vec<usize> = shot.into_iter().chain(ball).collect();
    let only = |pairs: &[[usize; 2]]| if let [pair] = pairs { Some(pair.to_vec()) } else { None };
    match (positions.as_slice(), ball) {
        ([cue, object], None) => {
            table.add_time(&groups, &angles);
            table.add_all("cue_", &["x", "y"], Some(cue.to_vec()));
            table.add_all("object_", &["x", "y"], Some(object.to_vec()));
            if let [cue, object] = angles[..] {
                table.add_all("", &["cue_angle", "object_angle"], Some(vec![cue, object]));
            }
        }
        ([position], _) if ball.is_some() || are_pairs => {
            table.taken.extend(ball);
            table.add_time(&groups, &angles);
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
    table.add_boxes(&positions, &boxes, ball);
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

    /// Adds the column of times or frames: by its name, or else the one that grows in each group.
    fn add_time(&mut self, groups: &[usize], others: &[usize]) {
        for (role, key) in [(Role::Frame, "frame"), (Role::Time, "t")] {
            if let Some(column) = find(&self.small, role).filter(|column| self.is_free(*column)) {
                return self.add_all("", &[key], Some(vec![column]));
            }
        }
        let grows = |column: usize| Some((column, self.rows.least_step(column, groups)?));
        let mut free =
            (0..self.small.len()).filter(|column| self.is_free(*column) && !others.contains(column));
        let Some((column, step)) = free.find_map(grows) else { return };
        let key = match (self.rows.is_whole(column), step) {
            (true, 1.0) => "frame",
            (false, ..0.5) => "t",
            (false, ..200.0) => {
                self.guess.time_unit = Some(TimeUnit::Ms);
                "t"
            }
            _ => {
                self.guess.perhaps_time = Some(self.heading.names[column].clone());
                return;
            }
        };
        self.add_all("", &[key], Some(vec![column]));
    }

    /// Adds the columns that determine the middle of boxes. The size is added as a comment if
    /// neither names nor paths show whether x and y are a corner or the middle.
    fn add_boxes(&mut self, positions: &[[usize; 2]], boxes: &[Boxed], ball: Option<usize>) {
        const SIZE: [&str; 2] = ["width", "height"];
        for (i, position) in positions.iter().enumerate() {
            let begin = begin(positions, i);
            if let Some(Boxed { rest, .. }) = boxes.get(i) {
                let keys = if rest.is_size { SIZE } else { ["x2", "y2"] };
                self.add_all(begin, &keys, Some(rest.columns.to_vec()));
                continue;
            }
            let Some(size) = words::size(&self.small, position[0]) else { continue };
            match self.rows.is_corner(*position, size, ball) {
                Some(true) => self.add_all(begin, &SIZE, Some(size.to_vec())),
                Some(false) => {}
                None => {
                    let why =
                        "of a box: take the # away, from both, if x and y are its corner, and not its middle";
                    self.add(begin, SIZE[0], size[0], Some(why.to_string()));
                    self.add(begin, SIZE[1], size[1], Some(String::new()));
                }
            }
        }
    }

    /// Adds the columns of likelihoods, and of confidences as a comment: their scale is unknown.
    fn add_likelihoods(&mut self, positions: &[[usize; 2]]) {
        for (i, [x, _]) in positions.iter().enumerate() {
            let begin = begin(positions, i);
            let column = |names: &[&str]| {
                let beside = names.iter().find_map(|name| words::beside(&self.small, *x, name));
                let alone = || names.iter().find_map(|name| self.small.iter().position(|own| own == name));
                let column = beside.or_else(|| alone().filter(|_| positions.len() == 1));
                column.filter(|column| self.is_free(*column))
            };
            if let Some(column) = column(&["likelihood"]) {
                self.add_all(begin, &["likelihood"], Some(vec![column]));
            } else if let Some(column) = column(&["confidence", "conf", "score", "probability"]) {
                let why = format!("take the # away to leave out positions below {LIKELY}");
                self.add(begin, "likelihood", column, Some(why));
            }
        }
    }
}

/// Returns the beginning of the keys of a ball: nothing in a long table.
fn begin(positions: &[[usize; 2]], i: usize) -> &'static str {
    if positions.len() == 1 { "" } else { ["cue_", "object_"][i.min(1)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(text: &str) -> String {
        let Some(guess) = columns(text) else { return String::new() };
        let mut said: Vec<String> =
            guess.certain().map(|guessed| format!("{}={}", guessed.key, guessed.column.shown())).collect();
        said.extend(guess.angle_unit.map(|unit| format!("angle_unit={}", unit.name())));
        said.extend(guess.time_unit.map(|unit| format!("in {}", unit.name())));
        said.extend(guess.perhaps_time.map(|name| format!("perhaps {name}")));
        said.join(" ").replace('"', "")
    }

    /// Tables, with ↵ for the end of a line, and the expected columns.
    const TABLES: &str = "
c_a_x,c_a_y,ang_a,c_b_x,c_b_y,ang_b↵0.3,0.1,2.9,0.3,0.2,4.1 ¦ cue_x=c_a_x cue_y=c_a_y object_x=c_b_x object_y=c_b_y cue_angle=ang_a object_angle=ang_b angle_unit=rad
Monday↵Time [s];x1 [cm];y1 [cm];x2 [cm];y2 [cm];v↵0;1;2;3;4;5 ¦ t=Time [s] cue_x=x1 [cm] cue_y=y1 [cm] object_x=x2 [cm] object_y=y2 [cm]
frame,disk_id,cx_mm,cy_mm,mx_mm,my_mm,r_px↵133,0,8,7,8,2,5 ¦ frame=frame ball=disk_id x=cx_mm y=cy_mm marker_x=mx_mm marker_y=my_mm
frame;puck;x;y;theta↵1;A;0.1;0.2;270 ¦ frame=frame ball=puck x=x y=y angle=theta angle_unit=deg
a,b,c,d↵1,2,3,4 ¦ 
t,x,y↵1,2,3 ¦ 
t,x1,y1,x2,y2,x3,y3 ¦ 
Zeit;Weiß x;Weiß y;Rot x;Rot y↵0,1;1;2;3;4 ¦ t=Zeit cue_x=Weiß x cue_y=Weiß y object_x=Rot x object_y=Rot y
time,ball,x,y,x_sd,y_sd↵0,a,1,2,3,4 ¦ t=time ball=ball x=x y=y x_sd=x_sd y_sd=y_sd
t,x1,y1,vx1,vy1,x2,y2,vx2,vy2↵0,1,2,3,4,5,6,7,8 ¦ t=t cue_x=x1 cue_y=y1 object_x=x2 object_y=y2
frame,track_id,x1,y1,x2,y2↵0,1,2,3,4,5 ¦ frame=frame ball=track_id x=x1 y=y1 x2=x2 y2=y2
frame,ball_id,x_px,y_px,x_m,y_m↵0,1,2,3,4,5 ¦ frame=frame ball=ball_id x=x_m y=y_m
1,1,2,3,4↵2,1,2,3,4↵3,1,2,3,4 ¦ frame=1 cue_x=2 cue_y=3 object_x=4 object_y=5
0,1,2,3,4↵0.1,1,2,3,4↵0.2,1,2,3,4 ¦ t=1 cue_x=2 cue_y=3 object_x=4 object_y=5
0 1 6.6 3.7↵1 1 6.7 3.7↵2 1 6.8 3.7↵0 2 6.6 3.7↵1 2 6.7 3.7↵2 2 6.8 3.7 ¦ frame=1 ball=2 x=3 y=4
   t    x1   y1   x2   y2↵0.0 1 2 3 4↵0.1 1 2 3 4 ¦ t=t cue_x=x1 cue_y=y1 object_x=x2 object_y=y2
shot,t,whatever,x,y↵s,0,a,1.5,2.5↵s,1,a,1.5,2.5↵s,0,b,1.5,2.5↵s,1,b,1.5,2.5 ¦ shot=shot t=t ball=whatever x=x y=y";

    #[test]
    fn columns_are_known_by_their_names_and_numbers() {
        for case in TABLES.lines().skip(1) {
            let (table, expected) = case.split_once(" ¦ ").unwrap();
            assert_eq!(guessed(&(table.replace('↵', "\n") + "\n")), expected, "{case}");
        }
    }

    #[test]
    fn a_time_of_any_name_grows_from_row_to_row() {
        let balls = "cue_x=x1 cue_y=y1 object_x=x2 object_y=y2";
        let seconds = "0.000 0.004 0.008 0.013";
        for (name, times, before, behind) in [
            ("t_s", seconds, "t=t_s ", ""),
            ("Data Set 1:Time(s)", seconds, "t=Data Set 1:Time(s) ", ""),
            ("when", seconds, "t=when ", ""),
            ("frame_idx", "0 2 4 6", "frame=frame_idx ", ""),
            ("n", "0 1 3 4", "frame=n ", ""),
            ("when", "0.0 4.2 8.3 12.5", "t=when ", " in ms"),
            ("when", "0 4 8 13", "", " perhaps when"),
            ("score", "3 1 2 5", "", ""),
        ] {
            let rows: String = times.split(' ').map(|t| format!("{t},1,2,3,4\n")).collect();
            let said = guessed(&format!("{name},x1,y1,x2,y2\n{rows}"));
            assert_eq!(said, format!("{before}{balls}{behind}"), "{name}");
        }
    }
}
