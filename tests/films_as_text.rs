//! A film of one shot as tables hold it: the first ball runs into the other in frame 20, at 100 frames per second.

use serde::Deserialize;

use crate::prelude::*;

/// Text of a file, or a film in rows, which may be in pieces.
#[derive(Deserialize)]
#[serde(untagged)]
pub enum Content {
    Text(String),
    Film(Film),
    Pieces(Vec<Film>),
}

/// A film as rows of a table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Film {
    #[serde(default)]
    head: String,
    /// A row, in which keys in braces stand for what [`filled`] says, with `per = "frame"` ending in the number of the ball, or for a
    /// [`formula`].
    row: String,
    #[serde(default)]
    per: Per,
    /// The first frame; of a piece, that after the piece before.
    first: Option<u32>,
    #[serde(default = "usual_frames")]
    frames: u32,
    #[serde(default)]
    tail: String,
}

/// What has a row of its own.
#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Per {
    /// Both balls of a frame, one after the other.
    Ball,
    #[default]
    Frame,
    /// The frames of the first ball, and below them those of the other.
    Track,
}

fn usual_frames() -> u32 {
    40
}

/// Where both balls are in a frame, mm.
fn balls(n: u32) -> [[f64; 2]; 2] {
    [[10.0 * f64::from(n.min(20)), 500.0], [260.0 + 9.0 * f64::from(n.max(20) - 20), 520.0]]
}

/// A number to a ten-thousandth, without zeros at its end.
fn short(number: f64) -> String {
    let text = format!("{number:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A row with the place of a ball in a frame: `{n}` is the frame, `{s}` its time in s, `{ball}` and `{id}` count balls from 0 and 1
/// on; `{x}`, `{y}`, `{left}`, `{top}`, `{right}`, `{bottom}`, `{width}` and `{height}` are its middle and the box about it in mm, `{mx}`
/// and `{my}` in m, `{cx}` and `{cy}` in cm, `{u}` and `{v}` in parts of a picture of 1920 × 1080.
fn filled(row: &str, n: u32, ball: usize, suffix: &str) -> String {
    let [x, y] = balls(n)[ball];
    // a box is not quite as large in every frame
    let half = 28.0 + f64::from(n % 3);
    let lengths = [("x", x), ("y", y), ("mx", 1e-3 * x), ("my", 1e-3 * y), ("cx", 0.1 * x), ("cy", 0.1 * y)];
    let sides = [("left", x - half), ("top", y - half), ("right", x + half), ("bottom", y + half)];
    let sizes = [("width", 2.0 * half), ("height", 2.0 * half), ("u", x / 1920.0), ("v", y / 1080.0)];
    let numbers = lengths.into_iter().chain(sides).chain(sizes).map(|(key, number)| (key, short(number)));
    let names = [
        ("ball", ball.to_string()),
        ("id", (ball + 1).to_string()),
        ("name", ["white", "red"][ball].to_owned()),
    ];
    let cells = numbers.chain(names);
    cells.fold(row.to_owned(), |row, (key, cell)| row.replace(&format!("{{{key}{suffix}}}"), &cell))
}

/// The value in a frame of `17n+400`, of `n/120:3` with 3 decimals, and of `0.1n%3`, where % is the remainder.
fn formula(text: &str, n: u32) -> Option<String> {
    let (text, decimals) = match text.split_once(':') {
        Some((text, decimals)) => (text, Some(decimals.parse::<usize>().ok()?)),
        None => (text, None),
    };
    let (step, rest) = text.split_once('n')?;
    let step = match step {
        "" => 1.0,
        "-" => -1.0,
        number => number.parse().ok()?,
    };
    let (operation, offset) = rest.split_at(rest.find(['+', '-']).unwrap_or(rest.len()));
    let offset = if offset.is_empty() { 0.0 } else { offset.parse().ok()? };
    let n = f64::from(n);
    let n = match operation.split_at_checked(1) {
        None => n,
        Some(("%", by)) => n % by.parse::<f64>().ok()?,
        Some(("/", by)) => n / by.parse::<f64>().ok()?,
        Some(_) => return None,
    };
    let number = step * n + offset;
    Some(decimals.map_or_else(|| short(number), |decimals| format!("{number:.decimals$}")))
}

/// A row with the values of its formulas.
fn evaluated(row: &str, n: u32) -> String {
    let (mut text, mut rest) = (String::new(), row);
    while let Some(open) = rest.find('{') {
        text += &rest[..open];
        let inner = rest[open + 1..].split('}').next().unwrap_or_default();
        if let Some(value) = formula(inner, n) {
            text += &value;
            rest = &rest[open + inner.len() + 2..];
        } else {
            text.push('{');
            rest = &rest[open + 1..];
        }
    }
    text + rest
}

impl Film {
    fn row(&self, n: u32, ball: Option<usize>) -> String {
        let time = format!("{:.2}", 0.01 * f64::from(n));
        let row = self.row.replace("{n}", &n.to_string()).replace("{s}", &time);
        let row = match ball {
            Some(ball) => filled(&row, n, ball, ""),
            None => filled(&filled(&row, n, 0, "0"), n, 1, "1"),
        };
        evaluated(&row, n) + "\n"
    }

    fn rows(&self, first: u32) -> Vec<String> {
        let frames = first..first + self.frames;
        match self.per {
            Per::Frame => frames.map(|n| self.row(n, None)).collect(),
            Per::Ball => frames.map(|n| self.row(n, Some(0)) + &self.row(n, Some(1))).collect(),
            Per::Track => {
                [0, 1].iter().flat_map(|ball| frames.clone().map(|n| self.row(n, Some(*ball)))).collect()
            }
        }
    }

    fn text(&self, first: u32) -> String {
        let head = if self.head.is_empty() { String::new() } else { format!("{}\n", self.head) };
        format!("{head}{}{}", self.rows(first).concat(), self.tail)
    }
}

impl Content {
    /// Names and texts: a file for each frame where the name has `{n}`.
    pub fn files(&self, name: &str) -> Vec<(String, String)> {
        let text = match self {
            Self::Text(text) => text.clone(),
            Self::Film(film) if name.contains("{n}") => {
                let numbered = (0..).zip(film.rows(0));
                return numbered
                    .map(|(n, row): (u32, _)| (name.replace("{n}", &format!("{n:06}")), row))
                    .collect();
            }
            Self::Film(film) => film.text(film.first.unwrap_or(0)),
            Self::Pieces(films) => {
                let mut next = 0;
                let piece = |film: &Film| {
                    let first = film.first.unwrap_or(next);
                    next = first + film.frames;
                    film.text(first)
                };
                films.iter().map(piece).collect()
            }
        };
        vec![(name.to_owned(), text)]
    }
}

/// Writes files of these names, in folders that are made.
pub fn write_all<T: AsRef<[u8]>>(folder: &Path, files: impl IntoIterator<Item = (String, T)>) {
    for (name, content) in files {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }
}

/// The parts that a text lacks, and the text.
pub fn lacking(what: &str, text: &str, parts: &[String]) -> Vec<String> {
    /// Characters of the text that are shown.
    const SHOWN: usize = 3000;
    let missing: Vec<&String> = parts.iter().filter(|part| !text.contains(part.as_str())).collect();
    let shown: String = text.chars().take(SHOWN).collect();
    if missing.is_empty() { Vec::new() } else { vec![format!("{missing:?} are not in {what}:\n{shown}")] }
}

/// What is wrong with tracks that were read of a film in mm.
pub fn faults(tracks: &Tracks) -> Vec<String> {
    /// Rounding of lengths written to a micrometre, m.
    const ROUNDED: f64 = 2e-6;
    let shot = &tracks.shots[0];
    let mut faults = Vec::new();
    for (samples, ball) in [(&shot.cue, 0), (&shot.object, 1)] {
        if samples.len() != usual_frames() as usize {
            faults.push(format!("{} frames of ball {ball}", samples.len()));
        }
        for (n, sample) in (0..).zip(samples) {
            let [x, y] = balls(n)[ball];
            if (sample.x - 1e-3 * x).hypot(sample.y - 1e-3 * y) > ROUNDED {
                faults.push(format!("ball {ball} is at {}, {} in frame {n}", sample.x, sample.y));
            }
        }
    }
    if !shot.markers.is_empty() {
        faults.push(format!("{} markers", shot.markers.len()));
    }
    faults
}
