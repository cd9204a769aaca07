//! Which column of an unknown table is which, by their names or, where there are none, by their number: for a draft.

use super::heading::{Heading, TITLES};
use super::number::{Cell, parse};
use super::text::{Separator, lines, trimmed};

/// Names of columns of times, frames, shots and balls, in small letters.
const TIMES: [&str; 8] = ["t", "time", "timestamp", "seconds", "sec", "zeit", "temps", "tid"];
const FRAMES: [&str; 6] = ["frame", "frames", "frame_number", "frame number", "bild", "image"];
const SHOTS: [&str; 5] = ["shot", "shot_id", "trial", "clip", "run"];
const BALLS: [&str; 10] =
    ["ball", "ball_id", "object", "object_id", "disk_id", "disc_id", "puck", "track", "track_id", "particle"];
/// How names of columns of angles begin.
const ANGLES: [&str; 5] = ["ang", "theta", "θ", "phi", "rot"];
/// Radians of a disc seldom grow beyond so many: as many as two turns. Degrees of a whole turn are 360.
const RADIANS: f64 = 4.0 * std::f64::consts::PI;

/// What of `[tracks.columns]` fits a table, as keys and values of TOML.
pub(super) struct Guess {
    pub lines: Vec<(&'static str, String)>,
    /// It has angles, which only discs do.
    pub has_angles: bool,
}

/// `None` where the table is not understood.
pub(super) fn columns(text: &str) -> Option<Guess> {
    let top: Vec<(usize, &str)> =
        lines(text).filter(|(_, line)| !line.trim().is_empty()).take(TITLES).collect();
    for (i, (line, content)) in top.iter().enumerate() {
        let bare = content.trim_start().strip_prefix('#').unwrap_or(content);
        for separator in Separator::ALL {
            let Some(names) = trimmed(bare, separator).filter(|names| names.len() > 3) else { continue };
            if names.iter().all(|name| is_number(name)) {
                // names of columns that are not understood may stand above the numbers
                let above = top[..i].iter().filter_map(|(_, line)| trimmed(line, separator));
                let has_names = above.into_iter().any(|cells| cells.len() == names.len());
                return if has_names { None } else { numbered(names.len()) };
            }
            if let Some(guess) = named(text, &Heading::new(text, *line, separator, names)) {
                return Some(guess);
            }
        }
    }
    None
}

fn is_number(cell: &str) -> bool {
    matches!(parse(cell), Ok(Cell::Number(..)))
}

/// Of a table without names: positions of two balls, with a time in front perhaps.
fn numbered(width: usize) -> Option<Guess> {
    let keys: &[&'static str] = match width {
        4 => &["cue_x", "cue_y", "object_x", "object_y"],
        5 => &["t", "cue_x", "cue_y", "object_x", "object_y"],
        _ => return None,
    };
    let lines = keys.iter().enumerate().map(|(i, key)| (*key, (i + 1).to_string())).collect();
    Some(Guess { lines, has_angles: false })
}

fn named(text: &str, heading: &Heading) -> Option<Guess> {
    let small: Vec<String> = heading.bare.iter().map(|name| name.to_lowercase()).collect();
    let one_of = |words: &[&str]| words.iter().find_map(|word| small.iter().position(|name| name == word));
    let written = |column: usize| toml::Value::from(heading.names[column].as_str()).to_string();
    let pairs = pairs(&small);
    let angles: Vec<usize> =
        (0..small.len()).filter(|i| ANGLES.iter().any(|begin| small[*i].starts_with(begin))).collect();
    let mut lines: Vec<(&'static str, String)> = Vec::new();
    let mut add = |key: &'static str, column: usize| lines.push((key, written(column)));
    if let Some(shot) = one_of(&SHOTS) {
        add("shot", shot);
    }
    match (one_of(&FRAMES), one_of(&TIMES)) {
        (None, Some(time)) => add("t", time),
        (Some(frame), _) => add("frame", frame),
        (None, None) => {}
    }
    let ball = one_of(&BALLS);
    let turning: &[usize] = match (pairs.as_slice(), ball) {
        ([[cue_x, cue_y], [object_x, object_y]], None) => {
            for (key, column) in
                [("cue_x", *cue_x), ("cue_y", *cue_y), ("object_x", *object_x), ("object_y", *object_y)]
            {
                add(key, column);
            }
            if let [cue, object] = angles.as_slice() {
                add("cue_angle", *cue);
                add("object_angle", *object);
            }
            if angles.len() == 2 { &angles } else { &[] }
        }
        ([[x, y], rest @ ..], Some(ball)) if rest.len() < 2 => {
            add("ball", ball);
            add("x", *x);
            add("y", *y);
            if let [[x, y]] = rest {
                add("marker_x", *x);
                add("marker_y", *y);
            }
            if let [angle] = angles.as_slice() {
                add("angle", *angle);
            }
            if angles.len() == 1 { &angles } else { &[] }
        }
        _ => return None,
    };
    if turning.iter().any(|column| !heading.has_unit(*column)) {
        let most = most(text, heading, turning);
        lines.push(("angle_unit", if most > RADIANS { "\"deg\"" } else { "\"rad\"" }.to_string()));
    }
    Some(Guess { lines, has_angles: !turning.is_empty() })
}

/// Columns whose names differ by x and y only, in their order.
fn pairs(names: &[String]) -> Vec<[usize; 2]> {
    let mut pairs: Vec<[usize; 2]> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        let with_y = name.char_indices().filter(|(_, c)| *c == 'x').find_map(|(at, _)| {
            let other = format!("{}y{}", &name[..at], &name[at + 1..]);
            names.iter().position(|own| *own == other)
        });
        if let Some(y) = with_y
            && pairs.iter().all(|[_, taken]| *taken != y)
        {
            pairs.push([i, y]);
        }
    }
    pairs
}

/// The largest number in these columns.
fn most(text: &str, heading: &Heading, columns: &[usize]) -> f64 {
    let rows = lines(text).skip(heading.above).filter_map(|(_, line)| trimmed(line, heading.separator));
    let cells = rows.flat_map(|row| columns.iter().filter_map(|i| row.get(*i).cloned()).collect::<Vec<_>>());
    cells
        .filter_map(|cell| match parse(&cell) {
            Ok(Cell::Number(number, _)) => Some(number.abs()),
            _ => None,
        })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guessed(text: &str) -> String {
        let lines = columns(text).map(|guess| guess.lines).unwrap_or_default();
        lines.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn columns_are_known_by_their_names() {
        assert_eq!(
            guessed("c_a_x,c_a_y,ang_a,c_b_x,c_b_y,ang_b\n0.3,0.1,2.9,0.3,0.2,4.1\n"),
            "cue_x=\"c_a_x\" cue_y=\"c_a_y\" object_x=\"c_b_x\" object_y=\"c_b_y\" cue_angle=\"ang_a\" object_angle=\"ang_b\" angle_unit=\"rad\""
        );
        assert_eq!(
            guessed("Monday\nTime [s];x1 [cm];y1 [cm];x2 [cm];y2 [cm];v\n0;1;2;3;4;5\n"),
            "t=\"Time [s]\" cue_x=\"x1 [cm]\" cue_y=\"y1 [cm]\" object_x=\"x2 [cm]\" object_y=\"y2 [cm]\""
        );
        assert_eq!(
            guessed("frame,disk_id,cx_mm,cy_mm,mx_mm,my_mm,r_px\n133,0,8,7,8,2,5\n"),
            "frame=\"frame\" ball=\"disk_id\" x=\"cx_mm\" y=\"cy_mm\" marker_x=\"mx_mm\" marker_y=\"my_mm\""
        );
        assert_eq!(
            guessed("frame\tpuck\tx\ty\ttheta\n1\tA\t0.1\t0.2\t270\n"),
            "frame=\"frame\" ball=\"puck\" x=\"x\" y=\"y\" angle=\"theta\" angle_unit=\"deg\""
        );
        assert_eq!(guessed("0.0;1;2;3;4\n"), "t=1 cue_x=2 cue_y=3 object_x=4 object_y=5");
        for unknown in ["a,b,c,d\n1,2,3,4\n", "t,x,y\n1,2,3\n", "", "t,x1,y1,x2,y2,x3,y3\n"] {
            assert_eq!(guessed(unknown), "", "{unknown}");
        }
    }
}
