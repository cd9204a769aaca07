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
/// Beginnings of words for errors, and for motions.
const SPREADS: &str = "sd std stdev err sigma σ unc sem rms fehler var";
const MOTIONS: &str = "v vel speed geschw vitesse acc beschl disp rotation quaternion feret";
/// Beginnings of words for a point on a ball beside its centre.
const MARKERS: &str = "mark rim dot spot edge rand stripe led tip";

/// Meaning of a column.
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

/// Returns the words of a name in small letters, without punctuation.
pub(super) fn words(name: &str) -> Vec<String> {
    let small = name.to_lowercase();
    let words = small.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_string).collect()
}

/// Returns the rank of a name among the known ones, 0 the most certain; `None` for other names.
fn rank(name: &str, known: &str, after: &str) -> Option<usize> {
    let follows = |rest: &str| rest.is_empty() || after.split(' ').any(|word| word == rest);
    known.split(' ').position(|word| name.strip_prefix(word).is_some_and(follows))
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
    let ranked = names.iter().enumerate().filter_map(|(i, name)| {
        let words = words(name);
        // N° tir, Nr. Stoß
        let is_number = words.len() > 1 && NUMBERS.split(' ').any(|number| words[0] == number);
        Some((rank(&words[usize::from(is_number)..].concat(), known, after)?, i))
    });
    ranked.min().map(|(_, i)| i).or_else(|| {
        // in Scandinavia tid is time
        let is_tid = |name: &String| name.eq_ignore_ascii_case("tid");
        names.iter().position(is_tid).filter(|_| role == Role::Time)
    })
}

pub(super) fn is_angle(name: &str) -> bool {
    words(name).first().is_some_and(|first| {
        // rote is red
        let is_end = |rest: &str| rest.is_empty() || (rest.chars().count() == 1 && rest != "e");
        ANGLES.split(' ').any(|word| first.strip_prefix(word).is_some_and(is_end))
    })
}

/// Returns the meaning of a pair of columns, by the name of the x column, with its `x` at this byte.
fn kind(names: &[String], column: usize, at: usize) -> Kind {
    let name = &names[column];
    let (before, after) = (words(&name[..at]), words(&name[at + 1..]));
    let any = |known: &str| {
        before.iter().chain(&after).any(|word| {
            let letters = word.trim_end_matches(|c: char| c.is_ascii_digit());
            let fits = |known: &str| letters == known || known.len() > 2 && letters.starts_with(known);
            known.split(' ').any(fits)
        })
    };
    // dx, ax, sx beside x, as vx: without the letter, the name is that of another column. ImageJ:
    // bx is of the box about the object with the centroid x, xm is weighted by brightness, xstart
    // is where its outline begins
    let derived = || {
        let rest = name.strip_prefix(['a', 'b', 'd', 's', 'u']).filter(|_| at > 0);
        let rest = rest.map(|rest| rest.trim_start_matches(['_', ' ', '.']));
        let is_other = |rest: &str| names.iter().any(|own| own == rest);
        rest.is_some_and(is_other) || ["xm", "xstart"].contains(&name.as_str()) && is_other("x")
    };
    if any(SPREADS) {
        Kind::Spread
    } else if any(MOTIONS) || derived() {
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
    for (i, name) in names.iter().enumerate() {
        let with_y = name.char_indices().filter(|(_, c)| *c == 'x').find_map(|(at, _)| {
            let other = format!("{}y{}", &name[..at], &name[at + 1..]);
            Some((names.iter().position(|own| *own == other)?, at))
        });
        if let Some((y, at)) = with_y
            && pairs.iter().all(|([_, taken], _)| *taken != y)
        {
            pairs.push(([i, y], kind(names, i, at)));
        }
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::Kind::{Marker, Motion, Position, Spread};
    use super::*;

    #[test]
    fn names_of_times_frames_shots_and_balls() {
        let found = |name: &str| {
            let roles = [Role::Time, Role::Frame, Role::Shot, Role::Ball, Role::PerhapsBall];
            roles.into_iter().find(|role| find(&[name.to_string()], *role).is_some())
        };
        for (role, names) in [
            (Role::Time, "t|T_s|t_ms|time_stamp|Zeit_s|TimeStamp|tid|POSITION_T"),
            (Role::Frame, "frame_idx|frame_id|Frame No|Frame #|Bildnummer|Bild Nr.|Slice n°"),
            (Role::Shot, "shot|Shot_ID|clip|run no|N° tir|Nr. Versuch|Tiro"),
            (Role::Ball, "ball|track_id|Track n°|particle|disk_id|object"),
            (Role::PerhapsBall, "id|color|label"),
        ] {
            for name in names.split('|') {
                assert_eq!(found(name), Some(role), "{name}");
            }
        }
        for name in ["x", "trial x", "mass", "n", "timing", "framework", "running", "", "ballast"] {
            assert_eq!(found(name), None, "{name}");
        }
        for name in ["ang_a", "theta2", "θ", "θr", "rotation"] {
            assert!(is_angle(name), "{name}");
        }
        for name in ["rote", "angular velocity", "phillip", "rotten"] {
            assert!(!is_angle(name), "{name}");
        }
    }

    #[test]
    fn pairs_that_are_no_positions() {
        let kinds = |names: &[&str]| -> Vec<Kind> {
            let names: Vec<String> = names.iter().map(ToString::to_string).collect();
            (0..names.len()).filter_map(|i| Some(kind(&names, i, names[i].find('x')?))).collect()
        };
        assert_eq!(
            kinds(&["x", "x_sd", "sigma_x", "xerr", "vx", "v_x", "x velocity", "ax", "x2"]),
            [Position, Spread, Spread, Spread, Motion, Motion, Motion, Motion, Position]
        );
        assert_eq!(
            kinds(&["ax", "bx", "cx", "mx", "x_m", "rim_x", "marker x1", "x1", "vx1"]),
            [Position, Position, Position, Marker, Position, Marker, Marker, Position, Motion]
        );
    }
}
