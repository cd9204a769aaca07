//! Names of the columns of a table, and their units beside them, as in `x [mm]`, or below.

use std::collections::HashMap;

use super::clock::is_clock;
use super::input::Input;
use super::units::{AngleUnit, TimeUnit, Unit};
use crate::io::number::parse;
use crate::io::text::{Separator, filled_lines, lines, trimmed};

/// Maximum number of lines of titles above the names of columns, as spreadsheets have.
pub(super) const TITLES: usize = 10;

/// Maximum number of further lines of a header, above or below that of the names.
const MAX_FURTHER_LINES: usize = 3;

/// Least number of names in a header: a row of data that lost its numbers has fewer.
const MIN_NAMES: usize = 3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measure {
    Length(Unit),
    Time(TimeUnit),
    Angle(AngleUnit),
}

/// Words for units, in small letters.
const UNITS: [(&str, Measure); 12] = [
    ("m metre metres meter meters", Measure::Length(Unit::M)),
    ("cm", Measure::Length(Unit::Cm)),
    ("mm", Measure::Length(Unit::Mm)),
    ("in inch inches \"", Measure::Length(Unit::In)),
    ("ft foot feet", Measure::Length(Unit::Ft)),
    ("px pixel pixels", Measure::Length(Unit::Px)),
    ("s sec second seconds", Measure::Time(TimeUnit::S)),
    ("ms", Measure::Time(TimeUnit::Ms)),
    ("us µs μs", Measure::Time(TimeUnit::Us)),
    ("frame frames", Measure::Time(TimeUnit::Frames)),
    ("rad radian radians", Measure::Angle(AngleUnit::Rad)),
    ("deg ° degree degrees", Measure::Angle(AngleUnit::Deg)),
];

impl Measure {
    /// Returns the unit of a word such as `mm`; `None` for other words.
    fn of(word: &str) -> Option<Self> {
        let word = word.trim().to_lowercase();
        let is_known = |words: &str| words.split(' ').any(|known| known == word);
        UNITS.iter().find(|(words, _)| is_known(words)).map(|(_, unit)| *unit)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Length(unit) => unit.name(),
            Self::Time(unit) => unit.name(),
            Self::Angle(unit) => unit.name(),
        }
    }

    /// Returns whether it is the unit of positions in pictures.
    pub(super) fn is_pixels(self) -> bool {
        self == Self::Length(Unit::Px)
    }
}

/// Returns the separator of names: single blanks if the row below has as many cells.
pub(super) fn blanks(text: &str, line: usize, names: &str) -> Separator {
    const SINGLE: Separator = Separator::Char(' ');
    let count = |line: &str| trimmed(line.trim_end(), SINGLE).map_or(0, |cells| cells.len());
    let below = filled_lines(text).find(|(below, _)| *below > line);
    let fits = below.is_none_or(|(_, row)| count(row) == count(names));
    if fits && !names.starts_with(' ') { SINGLE } else { Separator::Blanks }
}

/// Splits `x_mm` into `x` and mm; `None` if the last word is not a unit or does not suit the name.
pub(super) fn suffix(name: &str) -> Option<(&str, Measure)> {
    let (bare, word) = name.rsplit_once('_')?;
    let unit = Measure::of(word).filter(|_| !word.is_empty() && !bare.is_empty())?;
    let small = bare.to_lowercase();
    let begins = |words: &[&str]| words.iter().any(|word| small.starts_with(word));
    let fits = match unit {
        Measure::Length(Unit::In) => false,
        Measure::Length(_) => small.contains(['x', 'y']),
        Measure::Time(_) => begins(&["t", "zeit"]),
        Measure::Angle(_) => begins(&["ang", "theta", "rot", "phi"]),
    };
    fits.then_some((bare, unit))
}

/// Splits a name with the additions of programs: `Time (s) Run #1`, `Data Set 1:Time(s)`, `t_ms`.
fn split_loosely(name: &str) -> (&str, Option<Measure>) {
    let mut plain = name;
    if let Some((before, number)) = name.rsplit_once('#')
        && number.bytes().all(|byte| byte.is_ascii_digit())
    {
        plain = before.trim_end().strip_suffix("Run").map_or(name, str::trim_end);
    }
    let last = plain.rsplit_once(':').map(|(_, last)| last.trim_start());
    plain = last.filter(|last| !last.is_empty()).unwrap_or(plain);
    match split(plain) {
        (bare, None) => suffix(bare).map_or((bare, None), |(bare, unit)| (bare, Some(unit))),
        known => known,
    }
}

/// Splits `x [mm]` into `x` and mm. A name without a unit is returned as it is.
fn split(name: &str) -> (&str, Option<Measure>) {
    let (open, close) = if name.ends_with(']') { ('[', ']') } else { ('(', ')') };
    let parts = name.strip_suffix(close).and_then(|rest| rest.rsplit_once(open));
    let found = parts.and_then(|(bare, word)| Some((bare.trim_end(), Some(Measure::of(word)?))));
    found.unwrap_or((name, None))
}

/// Names and units of columns.
#[derive(Clone, Debug)]
pub(super) struct Heading {
    /// Line of the names.
    pub line: usize,
    /// Rows are below this line: that of the names, or that of the units below it.
    pub above: usize,
    pub separator: Separator,
    /// Names as in the file, with their units.
    pub names: Vec<String>,
    /// Names without the units.
    pub bare: Vec<String>,
    units: Vec<Option<Measure>>,
}

impl Heading {
    /// Returns the heading of a file with these names in a line.
    pub(super) fn new(text: &str, line: usize, separator: Separator, names: Vec<String>) -> Self {
        let split_by = |split: fn(&str) -> (&str, Option<Measure>)| -> (Vec<String>, Vec<Option<Measure>>) {
            let each = names.iter().map(|name| split(name));
            each.map(|(bare, unit)| (bare.to_string(), unit)).unzip()
        };
        let (mut bare, mut units) = split_by(split_loosely);
        // x_px beside x_m
        let is_twice = |(i, name): (usize, &String)| !name.is_empty() && bare[..i].contains(name);
        if bare.iter().enumerate().any(is_twice) {
            (bare, units) = split_by(split);
        }
        let mut above = line;
        for _ in 0..MAX_FURTHER_LINES {
            let Some((below, row)) = further(text, above, separator, names.len()) else { break };
            above = below;
            for (unit, other) in units.iter_mut().zip(row) {
                *unit = unit.or(other);
            }
        }
        Self { line, above, separator, names, bare, units }
    }

    /// Returns the heading of names that may repeat: `x` below `cue` becomes `cue x`, where `cue`
    /// may stand above several columns. The names are kept if some are still equal. An empty name
    /// before the last one is replaced by the word above it, as `Frame#` and `Time` of TRC files,
    /// which stand in the line of the markers.
    pub(super) fn deep(text: &str, line: usize, separator: Separator, names: Vec<String>) -> Self {
        let mut joined = names.clone();
        let above = filled_lines(text).take_while(|(above, _)| *above < line).map(|(_, title)| title);
        let above: Vec<&str> = above.collect();
        for title in above.into_iter().rev().take(MAX_FURTHER_LINES) {
            let repeated = repeated(&joined);
            let Some(title) = trimmed(title, separator) else { break };
            if !repeated.contains(&true) {
                fill_empty(&mut joined, &title);
                break;
            }
            let mut last = "";
            for (i, name) in joined.iter_mut().enumerate() {
                let word = title.get(i).map_or("", String::as_str);
                last = if word.is_empty() { last } else { word };
                if name.is_empty() {
                    *name = word.to_string();
                } else if repeated[i] && !last.is_empty() {
                    *name = format!("{last} {name}");
                }
            }
        }
        let names = if repeated(&joined).contains(&true) { names } else { joined };
        Self::new(text, line, separator, names)
    }

    /// Returns the heading of names without units in a line, with the rows below another one.
    pub(super) fn plain(line: usize, above: usize, separator: Separator, names: Vec<String>) -> Self {
        Self { line, above, separator, bare: names.clone(), units: vec![None; names.len()], names }
    }

    /// Returns the heading of a table without names: first row, and number of cells.
    pub(super) fn unnamed(first: usize, separator: Separator, width: usize) -> Self {
        let names = (1..=width).map(|number| format!("column {number}")).collect();
        Self::plain(first, first - 1, separator, names)
    }

    /// Returns the names without the units, in small letters.
    pub(super) fn small(&self) -> Vec<String> {
        self.bare.iter().map(|name| name.to_lowercase()).collect()
    }

    /// Returns the column of this name, with or without its unit.
    pub(super) fn position(&self, name: &str) -> Option<usize> {
        let at = |names: &[String]| names.iter().position(|own| own == name);
        at(&self.names).or_else(|| at(&self.bare))
    }

    pub(super) fn has_unit(&self, column: usize) -> bool {
        self.units[column].is_some()
    }

    /// Returns the number of columns of this name, with or without their unit.
    pub(super) fn count(&self, name: &str) -> usize {
        let count = |names: &[String]| names.iter().filter(|own| *own == name).count();
        count(&self.names).max(count(&self.bare))
    }

    fn wrong(&self, column: usize, message: String, input: &Input) {
        input.wrong(self.line, self.bare[column].as_str(), message);
    }

    /// Returns the unit of length of these columns; complains if they state different ones.
    pub(super) fn length(&self, columns: &[usize], input: &Input) -> Option<Unit> {
        let mut first: Option<(usize, Unit)> = None;
        for column in columns {
            match (self.units[*column], first) {
                (None, _) => {}
                (Some(Measure::Length(unit)), None) => first = Some((*column, unit)),
                (Some(Measure::Length(unit)), Some((_, other))) if unit == other => {}
                (Some(unit), other) => {
                    let expected = other.map_or("a unit of length".to_string(), |(at, other)| {
                        format!("{}, as in the column {}", other.name(), self.bare[at])
                    });
                    self.wrong(*column, format!("is in {}; expected {expected}", unit.name()), input);
                }
            }
        }
        first.map(|(_, unit)| unit)
    }

    /// Returns the unit of a column of time, seconds by default; complains of a contradiction.
    pub(super) fn time(&self, column: usize, input: &Input) -> TimeUnit {
        let message = match (self.units[column], input.settings.time_unit) {
            (None, _) => return TimeUnit::S,
            (Some(Measure::Time(unit)), Some(other)) if unit != other => format!(
                "is in {}, but [tracks] time_unit is \"{}\"; expected the same, or no time_unit",
                unit.name(),
                other.name()
            ),
            (Some(Measure::Time(unit)), _) => return unit,
            (Some(other), _) => format!("is in {}; expected s, ms, us or frames", other.name()),
        };
        self.wrong(column, message, input);
        TimeUnit::S
    }

    /// Returns the unit of a column of angles; complains if header and dataset.toml differ.
    pub(super) fn angle(&self, column: usize, stated: Option<AngleUnit>, input: &Input) -> Option<AngleUnit> {
        let message = match (self.units[column], stated) {
            (Some(Measure::Angle(unit)), None) | (None, Some(unit)) => return Some(unit),
            (Some(Measure::Angle(unit)), Some(other)) if unit == other => return Some(unit),
            (Some(Measure::Angle(unit)), Some(other)) => {
                format!("is in {}, but [tracks.columns] angle_unit is \"{}\"; expected the same", unit.name(), other.name())
            }
            (Some(other), _) => format!("is in {}; expected rad or deg", other.name()),
            (None, None) => {
                "the unit of these angles is not stated; expected [tracks.columns] angle_unit = \"rad\" or \"deg\"".to_string()
            }
        };
        self.wrong(column, message, input);
        None
    }
}

/// Returns of each name whether another one is equal.
fn repeated(names: &[String]) -> Vec<bool> {
    let mut counts: HashMap<&str, usize> = HashMap::new();
    for name in names {
        *counts.entry(name).or_default() += 1;
    }
    names.iter().map(|name| !name.is_empty() && counts[name.as_str()] > 1).collect()
}

/// Replaces each empty name, except the last one, by the word above it in a line of as many cells.
fn fill_empty(names: &mut [String], above: &[String]) {
    if names.len().abs_diff(above.len()) > 1 {
        return;
    }
    let before_last = names.len().saturating_sub(1);
    for (name, word) in names.iter_mut().zip(above).take(before_last) {
        if name.is_empty() && parse(word).is_err() {
            name.clone_from(word);
        }
    }
}

/// Returns a further line of a header below one of its lines, with its units: a line of units, in
/// brackets or not, or of other names without a number.
fn further(
    text: &str,
    header: usize,
    separator: Separator,
    width: usize,
) -> Option<(usize, Vec<Option<Measure>>)> {
    let (line, row) = lines(text).skip(header).find(|(_, row)| !row.trim().is_empty())?;
    let cells = trimmed(row, separator).filter(|cells| cells.len() <= width + 1)?;
    let unit = |cell: &String| match cell.trim_matches(['[', ']', '(', ')']).trim() {
        "" | "-" => Some(None),
        word => Measure::of(word).map(Some),
    };
    let units: Option<Vec<Option<Measure>>> = cells.iter().map(unit).collect();
    if let Some(units) = units {
        return units.iter().any(Option::is_some).then_some((line, units));
    }
    let is_word = |cell: &&String| parse(cell).is_err() && !is_clock(cell);
    let words = cells.iter().filter(is_word).count();
    let is_empty = |cell: &String| cell.is_empty() || is_word(&cell);
    (words >= MIN_NAMES && cells.iter().all(is_empty))
        .then(|| (line, cells.iter().map(|cell| unit(cell).flatten()).collect()))
}
