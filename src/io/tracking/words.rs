//! Words of programs and people in several countries: names of columns, units, times of clocks.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::name::worded;

/// Names of a kind of column, in small letters, the most certain first, and words that may follow.
pub(super) struct Words(&'static str, &'static str);

/// Names of columns of time; tid is the Scandinavian one.
pub(super) const TIMES: Words = Words(
    "t time timestamp seconds sec zeit temps tiempo tempo tijd czas aika elapsedtime positiont tid elapsed msec posmsec \
     zaman время 时间 時間",
    "s sec ms us ns stamp seconds stampms stamps",
);
pub(super) const FRAMES: Words = Words(
    "frame frames bild einzelbild image img slice fotogramma fotograma cuadro beeld klatka bilde videoframe kare кадр 帧 フレーム",
    NUMBERS,
);
pub(super) const SHOTS: Words = Words(
    "shot trial clip run take stoß stoss versuch tir essai coup tiro tacada prova stoot poging uderzenie støt skudd",
    NUMBERS,
);
pub(super) const BALLS: Words = Words(
    "ball object disk disc puck track particle kugel bille boule balle bola palla biglia bal bila kule",
    NUMBERS,
);
/// Names of columns of balls, if the rows confirm it.
pub(super) const PERHAPS_BALLS: Words =
    Words("id tid color colour farbe name label who body class tracker", NUMBERS);
const NUMBERS: &str = "number numbers no nr num n id idx index nummer name count";
const ANGLES: &str = "angle ang theta θ phi φ rot rotation";
/// Beginnings of words for errors, for motions, and for a point on a ball beside its centre.
const SPREADS: &str = "sd std stdev err sigma σ unc sem rms fehler var";
const MOTIONS: &str = "v vel speed geschw vitesse acc beschl disp rotation quaternion feret";
const MARKERS: &str = "mark rim dot spot edge rand stripe led tip";
/// Prefixes of the names of the sides of a box.
const BOXES: [&str; 4] = ["boundingbox", "bbox", "box", "bb"];
/// Names of the sides of a box: a corner and size (flag) or the other corner; certain ones (flag).
const SIDES: [([&str; 4], bool, bool); 8] = [
    (["left", "top", "width", "height"], true, true),
    (["left", "top", "w", "h"], true, true),
    (["xmin", "ymin", "width", "height"], true, true),
    (["x", "y", "width", "height"], true, false),
    (["x", "y", "w", "h"], true, false),
    (["xmin", "ymin", "xmax", "ymax"], false, true),
    (["left", "top", "right", "bottom"], false, true),
    (["x1", "y1", "x2", "y2"], false, false),
];

/// Meaning of a pair of columns for x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Position,
    Marker,
    /// Standard deviations of positions.
    Spread,
    /// Velocities and other quantities than positions.
    Motion,
}

fn words(name: &str) -> Vec<String> {
    let small = name.to_lowercase();
    let words = small.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_string).collect()
}

/// Returns the most certain column of a kind among these names.
pub(super) fn find(names: &[String], Words(known, after): Words) -> Option<usize> {
    let is_one_of = |list: &str, word: &str| list.split(' ').any(|own| own == word);
    let rank = |(i, name): (usize, &String)| {
        let words = words(name);
        // N° tir, Nr. Stoß
        let is_number = words.len() > 1 && is_one_of(NUMBERS, &words[0]);
        let word = words[usize::from(is_number)..].concat();
        let rest = |known: &str| word.strip_prefix(known).map(str::to_string);
        let fits = |known: &str| rest(known).is_some_and(|rest| rest.is_empty() || is_one_of(after, &rest));
        Some((known.split(' ').position(fits)?, i))
    };
    names.iter().enumerate().filter_map(rank).min().map(|(_, i)| i)
}

pub(super) fn is_angle(name: &str) -> bool {
    // rote is red
    let is_end = |rest: &str| rest.is_empty() || (rest.chars().count() == 1 && rest != "e");
    let is_known =
        |first: &String| ANGLES.split(' ').any(|word| first.strip_prefix(word).is_some_and(is_end));
    words(name).first().is_some_and(is_known)
}

/// Returns the meaning of a pair of columns by the name of the x column, with its `x` at this byte.
fn kind(names: &[String], column: usize, at: usize) -> Kind {
    let name = &names[column];
    let (before, after) = (words(&name[..at]), words(&name[at + 1..]));
    let any = |known: &str| {
        before.iter().chain(&after).any(|word| {
            let letters = word.trim_end_matches(|c: char| c.is_ascii_digit());
            known.split(' ').any(|known| letters == known || known.len() > 2 && letters.starts_with(known))
        })
    };
    // dx, ax, sx beside x, as vx: without the letter, the name is that of another column. ImageJ:
    // bx is of the box about the object with the centroid x, xm is weighted by brightness, xstart
    // is the beginning of its outline
    let is_other = |rest: &str| names.iter().any(|own| own == rest);
    let rest = name.strip_prefix(['a', 'b', 'd', 's', 'u']).filter(|_| at > 0);
    let is_derived = rest.is_some_and(|rest| is_other(rest.trim_start_matches(['_', ' ', '.'])))
        || ["xm", "xstart"].contains(&name.as_str()) && is_other("x");
    if any(SPREADS) {
        Kind::Spread
    } else if any(MOTIONS) || is_derived {
        Kind::Motion
    } else if any(MARKERS) || before.last().is_some_and(|word| word == "m") {
        Kind::Marker
    } else {
        Kind::Position
    }
}

/// Returns the columns whose names differ by x and y only, in their order, and their meaning.
pub(super) fn pairs(names: &[String]) -> Vec<([usize; 2], Kind)> {
    let mut pairs: Vec<([usize; 2], Kind)> = Vec::new();
    for i in 0..names.len() {
        let is_free = |y: &usize| pairs.iter().all(|([_, taken], _)| taken != y);
        if let Some((y, at)) = replaced(names, i, "y").find(|(y, _)| is_free(y)) {
            pairs.push(([i, y], kind(names, i, at)));
        }
    }
    pairs
}

/// Returns the columns with the name of this one, an x replaced by a word, and the place of the x.
fn replaced(names: &[String], x: usize, word: &str) -> impl Iterator<Item = (usize, usize)> {
    let name = &names[x];
    name.match_indices('x').flat_map(move |(at, _)| {
        let other = format!("{}{word}{}", &name[..at], &name[at + 1..]);
        (0..names.len()).filter(move |i| names[*i] == other).map(move |i| (i, at))
    })
}

pub(super) fn beside(names: &[String], x: usize, word: &str) -> Option<usize> {
    replaced(names, x, word).next().map(|(column, _)| column)
}

/// Returns the box, or both boxes of a wide table, that names describe, if certain: the columns of
/// a corner, and of the size (flag) or the other corner. Two corners belong to a box if a column
/// names the ball of the row.
pub(super) fn boxes(names: &[String], names_ball: bool) -> (Vec<[[usize; 2]; 2]>, bool) {
    let plain: Vec<String> = names.iter().map(|name| words(name).concat()).collect();
    for (sides, is_size, are_certain) in SIDES {
        let begins = plain.iter().filter_map(|name| name.strip_suffix(sides[0]));
        let strip = |begin: &&str| {
            let at = |side: &str| plain.iter().position(|name| name.strip_prefix(begin) == Some(side));
            let [Some(x), Some(y), Some(other_x), Some(other_y)] = sides.map(at) else { return None };
            Some([[x, y], [other_x, other_y]])
        };
        let (begins, found): (Vec<&str>, Vec<_>) =
            begins.filter_map(|begin| Some((begin, strip(&begin)?))).unzip();
        // x1, y1, x2, y2 of each of two balls
        let are_two = found.len() == 2 && begins.iter().all(|begin| !begin.is_empty());
        let is_stated = |begin: &&str| BOXES.iter().any(|prefix| begin.ends_with(prefix));
        let are_corners = !is_size && (names_ball || are_two);
        if (1..=2).contains(&found.len()) && (are_certain || are_corners || begins.iter().all(is_stated)) {
            return (found, is_size);
        }
    }
    (Vec::new(), true)
}

worded! {
    /// A unit that dataset.toml states, or a file beside the name of a column or below it.
    #[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
    #[serde(rename_all = "lowercase")]
    pub(super) enum Unit {
        M = "m" | "m metre metres meter meters",
        Cm = "cm" | "cm",
        Mm = "mm" | "mm",
        In = "in" | "in inch inches \"",
        Ft = "ft" | "ft foot feet",
        Px = "px" | "px pixel pixels",
        Frames = "frames" | "frames frame",
        S = "s" | "s sec second seconds",
        Ms = "ms" | "ms msec millisecond milliseconds",
        Us = "us" | "us µs μs",
        Ns = "ns" | "ns nanosecond nanoseconds",
        Rad = "rad" | "rad radian radians",
        Deg = "deg" | "deg ° degree degrees",
    }
    pub(super) fn name;
    fn words;
}

impl Unit {
    pub(super) fn of(word: &str) -> Option<Self> {
        let word = word.trim().to_lowercase();
        Self::ALL.into_iter().find(|unit| unit.words().split(' ').any(|known| known == word))
    }

    /// Returns the SI unit of its quantity.
    pub(super) fn si(self) -> Self {
        match self {
            Self::Frames | Self::S | Self::Ms | Self::Us | Self::Ns => Self::S,
            Self::Rad | Self::Deg => Self::Rad,
            _ => Self::M,
        }
    }

    pub(super) fn alike(self) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |unit| unit.si() == self.si())
    }

    pub(super) fn names_alike(self) -> Vec<&'static str> {
        self.alike().map(Self::name).collect()
    }

    /// Returns the SI unit's number in one of these as whole factor and divisor (5.6 cm is 0.056 m);
    /// `None` for pixels, frames and angles.
    pub(super) fn size(self) -> Option<(f64, f64)> {
        match self {
            Self::M | Self::S => Some((1.0, 1.0)),
            Self::Cm => Some((1.0, 100.0)),
            Self::Mm | Self::Ms => Some((1.0, 1000.0)),
            Self::Us => Some((1.0, 1e6)),
            Self::Ns => Some((1.0, 1e9)),
            // 25.4 mm and 304.8 mm
            Self::In => Some((127.0, 5000.0)),
            Self::Ft => Some((381.0, 1250.0)),
            Self::Px | Self::Frames | Self::Rad | Self::Deg => None,
        }
    }

    /// Returns seconds per unit; `None` for frames.
    pub(super) fn seconds(self) -> Option<f64> {
        self.size().map(|(factor, divisor)| factor / divisor)
    }
}

/// A time of a clock, h:mm:ss.fff, or h:mm:ss:cs with a colon before its last digits.
pub(super) struct Clock {
    /// Seconds since midnight, or since the clock began.
    pub(crate) seconds: f64,
    pub(crate) has_colon: bool,
    pub(crate) digits: usize,
}

pub(super) fn clock(cell: &str) -> Option<Clock> {
    let is_date = |date: &str| date.len() == 10 && date.bytes().filter(u8::is_ascii_digit).count() == 8;
    let dated = cell.trim().split_once(['T', ' ']).filter(|(date, _)| is_date(date));
    // without the date and the zone
    let time = dated.map(|(_, time)| time.split(['Z', '+', '-']).next().unwrap_or(time));
    let time = time.unwrap_or(cell).trim();
    let has_colon = dated.is_none() && !time.contains(['.', ',']);
    let (whole, part) = if has_colon {
        time.rsplit_once(':').filter(|(_, part)| (2..=3).contains(&part.len()))?
    } else {
        time.rsplit_once(['.', ',']).unwrap_or((time, ""))
    };
    let number = |text: &str| text.parse::<u32>().ok().filter(|_| !text.starts_with('+')).map(f64::from);
    let parts: Vec<f64> = whole.split(':').map(number).collect::<Option<_>>()?;
    if !(2..=3).contains(&parts.len()) || parts[1..].iter().any(|part| *part >= 60.0) {
        return None;
    }
    let whole = parts.iter().fold(0.0, |sum, part| 60.0 * sum + part);
    let fraction = if part.is_empty() { 0.0 } else { number(part)? };
    let digits = part.len();
    Some(Clock { seconds: whole + fraction / 10.0_f64.powi(digits as i32), has_colon, digits })
}
