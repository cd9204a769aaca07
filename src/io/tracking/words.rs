//! Meanings of names of columns, as programs and people in several countries write them.

/// Names of times, of frames, of shots and of balls, in small letters, the most certain first; a
/// number or a unit may follow.
const TIMES: &str =
    "t time timestamp seconds sec zeit temps tiempo tempo tijd czas aika elapsedtime positiont";
const FRAMES: &str = "frame frames bild einzelbild image img slice fotogramma fotograma cuadro beeld klatka";
const SHOTS: &str =
    "shot trial clip run take stoß stoss versuch tir essai coup tiro tacada prova stoot poging uderzenie";
const BALLS: &str =
    "ball object disk disc puck track particle kugel bille boule balle bola palla biglia bal bila";
/// Names of columns of balls, if the rows confirm it.
const PERHAPS_BALLS: &str = "id tid color colour farbe name label who body class";
/// Words that may follow such a name.
const NUMBERS: &str = "number numbers no nr num n id idx index nummer name count";
const UNITS: &str = "s sec ms us stamp seconds stampms stamps";
const ANGLES: &str = "angle ang theta θ phi φ rot rotation";
/// Beginnings of words for errors, for motions, and for a point on a ball beside its centre.
const SPREADS: &str = "sd std stdev err sigma σ unc sem rms fehler var";
const MOTIONS: &str = "v vel speed geschw vitesse acc beschl disp rotation quaternion feret";
const MARKERS: &str = "mark rim dot spot edge rand stripe led tip";
/// Prefixes of the names of the sides of a box.
const BOXES: [&str; 4] = ["boundingbox", "bbox", "box", "bb"];
/// Names of the sides of a box: a corner with the size or the other corner, and whether the names
/// are certain without a prefix.
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

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    Time,
    Frame,
    Shot,
    Ball,
    PerhapsBall,
}

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

/// Columns that determine the middle of a box together with those of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rest {
    pub(crate) columns: [usize; 2],
    /// Whether they are width and height, and not the other corner.
    pub(crate) is_size: bool,
}

impl Rest {
    pub(super) fn middle(self, [x, y]: [f64; 2], [other_x, other_y]: [f64; 2]) -> [f64; 2] {
        if self.is_size {
            [x + 0.5 * other_x, y + 0.5 * other_y]
        } else {
            [f64::midpoint(x, other_x), f64::midpoint(y, other_y)]
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Boxed {
    pub(crate) corner: [usize; 2],
    pub(crate) rest: Rest,
}

fn has(list: &str, word: &str) -> bool {
    list.split(' ').any(|own| own == word)
}

fn words(name: &str) -> Vec<String> {
    let small = name.to_lowercase();
    let words = small.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_string).collect()
}

/// Returns the most certain column of a role among these names.
pub(super) fn find(names: &[String], role: Role) -> Option<usize> {
    let (known, after) = match role {
        Role::Time => (TIMES, UNITS),
        Role::Frame => (FRAMES, NUMBERS),
        Role::Shot => (SHOTS, NUMBERS),
        Role::Ball => (BALLS, NUMBERS),
        Role::PerhapsBall => (PERHAPS_BALLS, NUMBERS),
    };
    let rank = |(i, name): (usize, &String)| {
        let words = words(name);
        // N° tir, Nr. Stoß
        let is_number = words.len() > 1 && has(NUMBERS, &words[0]);
        let word = words[usize::from(is_number)..].concat();
        let fits =
            |known: &str| word.strip_prefix(known).is_some_and(|rest| rest.is_empty() || has(after, rest));
        Some((known.split(' ').position(fits)?, i))
    };
    let ranked = names.iter().enumerate().filter_map(rank).min();
    // in Scandinavia tid is time
    let is_tid = |name: &String| role == Role::Time && name.eq_ignore_ascii_case("tid");
    ranked.map(|(_, i)| i).or_else(|| names.iter().position(is_tid))
}

pub(super) fn is_angle(name: &str) -> bool {
    // rote is red
    let is_end = |rest: &str| rest.is_empty() || (rest.chars().count() == 1 && rest != "e");
    let is_known =
        |first: &String| ANGLES.split(' ').any(|word| first.strip_prefix(word).is_some_and(is_end));
    words(name).first().is_some_and(is_known)
}

/// Returns the meaning of a pair of columns, by the name of the x column, with its `x` at this byte.
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
    // is where its outline begins
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
        if let Some((y, at)) = replaced(names, i, "y")
            && pairs.iter().all(|([_, taken], _)| *taken != y)
        {
            pairs.push(([i, y], kind(names, i, at)));
        }
    }
    pairs
}

/// Returns the column with the name of this one, an x replaced by a word, and the place of the x.
fn replaced(names: &[String], x: usize, word: &str) -> Option<(usize, usize)> {
    let name = &names[x];
    name.match_indices('x').find_map(|(at, _)| {
        let other = format!("{}{word}{}", &name[..at], &name[at + 1..]);
        Some((names.iter().position(|own| *own == other)?, at))
    })
}

pub(super) fn beside(names: &[String], x: usize, word: &str) -> Option<usize> {
    replaced(names, x, word).map(|(column, _)| column)
}

pub(super) fn size(names: &[String], x: usize) -> Option<[usize; 2]> {
    let pair = |[width, height]: [&str; 2]| Some([beside(names, x, width)?, beside(names, x, height)?]);
    [["width", "height"], ["w", "h"]].into_iter().find_map(pair)
}

/// Returns the box, or both boxes of a wide table, of these names in small letters, if certain: two
/// corners are those of a box if a column names the ball of the row.
pub(super) fn boxes(names: &[String], names_ball: bool) -> Vec<Boxed> {
    let plain: Vec<String> = names.iter().map(|name| words(name).concat()).collect();
    let find = |(sides, is_size, are_certain): ([&str; 4], bool, bool)| {
        let mut found = Vec::new();
        for begin in plain.iter().filter_map(|name| name.strip_suffix(sides[0])) {
            let at = |side: &str| plain.iter().position(|name| name.strip_prefix(begin) == Some(side));
            if let [Some(x), Some(y), Some(other_x), Some(other_y)] = sides.map(at) {
                let rest = Rest { columns: [other_x, other_y], is_size };
                found.push((begin, Boxed { corner: [x, y], rest }));
            }
        }
        let is_stated = |begin: &str| BOXES.iter().any(|prefix| begin.ends_with(prefix));
        // x1, y1, x2, y2 of each of two balls
        let are_two = found.len() == 2 && !is_size && found.iter().all(|(begin, _)| !begin.is_empty());
        let is_good = are_certain
            || are_two
            || names_ball && !is_size
            || found.iter().all(|(begin, _)| is_stated(begin));
        (is_good && (1..=2).contains(&found.len()))
            .then(|| found.into_iter().map(|(_, boxed)| boxed).collect::<Vec<_>>())
    };
    SIDES.into_iter().find_map(find).unwrap_or_default()
}
