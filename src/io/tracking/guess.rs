//! A guess of the columns of an unknown table, by their names or else their number, for a draft.

use std::num::NonZero;

use super::boxes;
use super::column_names::Column;
use super::guess_table::{Guess, Guessed, Table};
use super::heading::{Heading, TITLES, blanks, suffix};
use super::sample::Rows;
use super::units::AngleUnit;
use super::words::{Kind, Role, find, is_angle, pairs};
use crate::io::number::value;
use crate::io::text::{Separator, filled_lines, lines, trimmed, unmarked};

/// Largest angle of a disc in radians, two turns; degrees of a whole turn are 360.
const MAX_RADIANS: f64 = 4.0 * std::f64::consts::PI;

/// Guesses the columns of a table; returns `None` if it is not understood.
pub(super) fn columns(text: &str) -> Option<Guess> {
    let top: Vec<(usize, &str)> = filled_lines(text).take(TITLES).collect();
    for (i, (line, content)) in top.iter().enumerate() {
        let bare = unmarked(content);
        for separator in Separator::ALL {
            let separator =
                if separator == Separator::Char(' ') { blanks(text, *line, bare) } else { separator };
            let Some(names) = trimmed(bare, separator).filter(|names| names.len() > 2) else { continue };
            if names.iter().all(|name| value(name).is_some()) {
                // names that are not understood may stand above the numbers
                let mut above = top[..i].iter().filter_map(|(_, line)| trimmed(line, separator));
                let has_names = above.any(|cells| cells.len() == names.len());
                let heading = Heading::unnamed(*line, separator, names.len());
                return if has_names { None } else { numbered(&Rows::of(text, &heading), names.len()) };
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
    let keys: &[&'static str] = match width {
        6.. if is_long && is_size(4) && is_size(5) => &["frame", "ball", "x", "y", "width", "height"],
        6.. if are_pairs && rows.values(1) == 1 && is_size(4) && is_size(5) => {
            &["frame", "", "x", "y", "width", "height"]
        }
        3.. if are_pairs && !is_long => &["frame", "x", "y"],
        4 | 5 if is_long && !rows.is_whole(2) => &["frame", "ball", "x", "y"],
        4 => &["cue_x", "cue_y", "object_x", "object_y"],
        5 if rows.is_whole(0) && rows.least_step(0, &[]) == Some(1.0) => {
            &["frame", "cue_x", "cue_y", "object_x", "object_y"]
        }
        5 => &["t", "cue_x", "cue_y", "object_x", "object_y"],
        _ => return None,
    };
    let numbers = (1..).filter_map(NonZero::new);
    let keys = keys.iter().zip(numbers).filter(|(key, _)| !key.is_empty());
    let guessed =
        |(key, number): (&&'static str, _)| Guessed { key, column: Column::Number(number), doubt: None };
    Some(Guess { columns: keys.map(guessed).collect(), ..Guess::default() })
}

fn named(text: &str, heading: &Heading) -> Option<Guess> {
    let small = heading.small();
    let all = pairs(&small);
    let of = |wanted: Kind| -> Vec<[usize; 2]> {
        all.iter().filter(|(_, kind)| *kind == wanted).map(|(pair, _)| *pair).collect()
    };
    let (mut positions, markers, spreads) = (of(Kind::Position), of(Kind::Marker), of(Kind::Spread));
    let paired: Vec<usize> = all.iter().flat_map(|(pair, _)| *pair).collect();
    let angles: Vec<usize> =
        (0..small.len()).filter(|i| !paired.contains(i) && is_angle(&small[*i])).collect();
    let rows = Rows::of(text, heading);
    rows.lay_flat(&small, &mut positions);
    let mut boxes = boxes::named(&small);
    let are_named = !boxes.is_empty();
    let mut taken = paired.clone();
    taken.extend(boxes.iter().flat_map(|boxed| [boxed.corner, boxed.rest.columns()].concat()));
    let mut table = Table { heading, small, rows, taken, guess: Guess::default() };
    let shot = find(&table.small, Role::Shot);
    // detectors leave the column empty
    let known = find(&table.small, Role::Ball)
        .filter(|column| !table.taken.contains(column) && !table.rows.is_empty(*column));
    if positions.is_empty() {
        positions.clone_from(&markers);
    }
    if let ([one, other], Some(_)) = (positions.as_slice(), known)
        && let Some(one) = in_two_units(&heading.names, *one, *other)
    {
        positions = vec![one];
    }
    if !are_named {
        boxes = table.rows.boxes_of(&positions);
    }
    // a column of balls that names only one, beside two pairs of columns
    let is_told = |column: &usize| positions.len() != 2 || boxes.len() == 1 || table.rows.values(*column) > 1;
    let known = known.filter(is_told);
    let time = find(&table.small, Role::Frame).or(find(&table.small, Role::Time));
    let others: Vec<usize> = time.into_iter().chain(shot).collect();
    let ball = known.filter(|_| boxes.len() < 2).or_else(|| {
        let perhaps = find(&table.small, Role::PerhapsBall).into_iter().chain(0..table.small.len());
        let free = |column: &usize| {
            (positions.len() == 1 || boxes.len() == 1)
                && table.is_free(*column)
                && !others.contains(column)
                && !angles.contains(column)
        };
        perhaps.filter(free).find(|column| table.rows.distinguishes_rows(*column, &others))
    });
    // without a column of balls, numbers that look like one box are those of two balls
    let are_pairs = time.is_some_and(|time| table.rows.are_pairs(time, shot));
    // ids that a tracker changed after it had lost a ball
    let ball = ball.filter(|ball| !(are_pairs && table.rows.values(*ball) > 2 && table.rows.is_whole(*ball)));
    boxes.retain(|_| are_named || ball.is_some() || are_pairs);
    if !boxes.is_empty() {
        positions = boxes.iter().map(|boxed| boxed.corner).collect();
    }
    if let Some(shot) = shot {
        table.add(["shot"], [shot]);
    }
    let groups: Vec<usize> = shot.into_iter().chain(ball).collect();
    match (positions.as_slice(), ball) {
        ([cue, object], None) => {
            table.add_time(&groups, &angles);
            table.add(["cue_x", "cue_y"], *cue);
            table.add(["object_x", "object_y"], *object);
            if let [cue, object] = angles[..] {
                table.add(["cue_angle", "object_angle"], [cue, object]);
            }
        }
        ([position], _) if ball.is_some() || are_pairs => {
            table.taken.extend(ball);
            table.add_time(&groups, &angles);
            // without a column of balls, the paths separate them
            if let Some(ball) = ball {
                table.add(["ball"], [ball]);
            }
            table.add(["x", "y"], *position);
            if let ([spread], Some(_)) = (&spreads[..], ball) {
                table.add(["x_sd", "y_sd"], *spread);
            }
            if let ([marker], Some(_)) = (&markers[..], ball) {
                table.add(["marker_x", "marker_y"], *marker);
            }
            if let ([angle], Some(_)) = (&angles[..], ball) {
                table.add(["angle"], [*angle]);
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
        let most = most(text, heading, turning);
        guess.angle_unit = Some(if most > MAX_RADIANS { AngleUnit::Deg } else { AngleUnit::Rad });
    }
    guess.has_angles = !turning.is_empty();
    let passed = of(Kind::Motion).into_iter().flatten();
    guess.passed = passed.map(|column| heading.names[column].clone()).collect();
    Some(guess)
}

/// Returns the columns in another unit than pixels, of two pairs with the same positions.
fn in_two_units(names: &[String], one: [usize; 2], other: [usize; 2]) -> Option<[usize; 2]> {
    let split = |pair: [usize; 2]| suffix(&names[pair[0]]);
    let ((bare, unit), (same, _)) = (split(one)?, split(other)?);
    bare.eq_ignore_ascii_case(same).then_some(if unit.is_pixels() { other } else { one })
}

fn most(text: &str, heading: &Heading, columns: &[usize]) -> f64 {
    let rows = lines(text).skip(heading.above).filter_map(|(_, line)| trimmed(line, heading.separator));
    let most = |row: Vec<String>| {
        columns.iter().filter_map(|i| Some(value(row.get(*i)?)?.abs())).fold(0.0, f64::max)
    };
    rows.map(most).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(text: &str) -> String {
        let Some(guess) = columns(text) else { return String::new() };
        let certain = guess.columns.iter().filter(|guessed| guessed.doubt.is_none());
        let mut said: Vec<String> =
            certain.map(|guessed| format!("{}={}", guessed.key, guessed.column.shown())).collect();
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
0.0;1;2;3;4 ¦ t=1 cue_x=2 cue_y=3 object_x=4 object_y=5
a,b,c,d↵1,2,3,4 ¦ 
t,x,y↵1,2,3 ¦ 
t,x1,y1,x2,y2,x3,y3 ¦ 
Zeit;Weiß x;Weiß y;Rot x;Rot y↵0,1;1;2;3;4 ¦ t=Zeit cue_x=Weiß x cue_y=Weiß y object_x=Rot x object_y=Rot y
time,ball,x,y,x_sd,y_sd↵0,a,1,2,3,4 ¦ t=time ball=ball x=x y=y x_sd=x_sd y_sd=y_sd
Frame,ball_id,X,Y,VX,VY↵0,a,1,2,3,4 ¦ frame=Frame ball=ball_id x=X y=Y
t,x1,y1,vx1,vy1,x2,y2,vx2,vy2↵0,1,2,3,4,5,6,7,8 ¦ t=t cue_x=x1 cue_y=y1 object_x=x2 object_y=y2
frame,track_id,x1,y1,x2,y2↵0,1,2,3,4,5 ¦ frame=frame ball=track_id x=x1 y=y1 x2=x2 y2=y2
frame,ball_id,x_px,y_px,x_m,y_m↵0,1,2,3,4,5 ¦ frame=frame ball=ball_id x=x_m y=y_m
1,1,2,3,4↵2,1,2,3,4↵3,1,2,3,4 ¦ frame=1 cue_x=2 cue_y=3 object_x=4 object_y=5
0,1,2,3,4↵0.1,1,2,3,4↵0.2,1,2,3,4 ¦ t=1 cue_x=2 cue_y=3 object_x=4 object_y=5
0 1 6.6 3.7↵1 1 6.7 3.7↵2 1 6.8 3.7↵0 2 6.6 3.7↵1 2 6.7 3.7↵2 2 6.8 3.7 ¦ frame=1 ball=2 x=3 y=4
# t x1 y1 x2 y2↵  0.0   1   2   3   4↵  0.1   1   2   3   4 ¦ t=t cue_x=x1 cue_y=y1 object_x=x2 object_y=y2
   t    x1   y1   x2   y2↵0.0 1 2 3 4↵0.1 1 2 3 4 ¦ t=t cue_x=x1 cue_y=y1 object_x=x2 object_y=y2
shot,t,whatever,x,y↵s,0,a,1.5,2.5↵s,1,a,1.5,2.5↵s,0,b,1.5,2.5↵s,1,b,1.5,2.5 ¦ shot=shot t=t ball=whatever x=x y=y
  0.00e0   1e1   2   3   4 ¦ t=1 cue_x=2 cue_y=3 object_x=4 object_y=5";

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
            ("time_stamp", seconds, "t=time_stamp ", ""),
            ("Zeit_s", seconds, "t=Zeit_s ", ""),
            ("\"Time (s) Run #1\"", seconds, "t=Time (s) Run #1 ", ""),
            ("Data Set 1:Time(s)", seconds, "t=Data Set 1:Time(s) ", ""),
            ("when", seconds, "t=when ", ""),
            ("frame_idx", "0 1 3 4", "frame=frame_idx ", ""),
            ("frame_id", "0 1 3 4", "frame=frame_id ", ""),
            ("Frame No", "0 1 3 4", "frame=Frame No ", ""),
            ("n", "0 1 3 4", "frame=n ", ""),
            ("Bildnummer", "0 1 3 4", "frame=Bildnummer ", ""),
            ("frame_idx", "0 2 4 6", "frame=frame_idx ", ""),
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
