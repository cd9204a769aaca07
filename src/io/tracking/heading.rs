//! Names of the columns of a table, and their units beside them, as in `x [mm]`, or below.

use std::collections::HashMap;

use super::clock::is_clock;
use super::input::Input;
use super::units::{Measure, TimeUnit, Unit};
use crate::io::number::parse;
use crate::io::text::{Separator, filled_lines, lines, trimmed, unmarked};

/// Maximum number of lines of titles above the names of columns, as spreadsheets have.
pub(super) const TITLES: usize = 10;
/// Maximum number of comments above and between them, and of bytes of a line that may be a header.
const MAX_COMMENTS: usize = 100;
const MAX_BYTES: usize = 1_000_000;
/// Maximum number of further lines of a header, above or below that of the names.
const MAX_FURTHER_LINES: usize = 3;
/// Least number of names in a header: a row of data that lost its numbers has fewer.
const MIN_NAMES: usize = 3;

/// A line that may hold names of columns, split by one separator, without a mark of comments.
pub(super) struct Top<'a> {
    pub(crate) line: usize,
    pub(crate) content: &'a str,
    pub(crate) separator: Separator,
    pub(crate) names: Vec<String>,
}

impl Top<'_> {
    pub(super) fn is_comment(&self) -> bool {
        self.content.trim_start().starts_with('#')
    }

    pub(super) fn small(&self) -> Vec<String> {
        split_all(&self.names).0.iter().map(|name| name.to_lowercase()).collect()
    }
}

/// Returns the first lines of a text, comments not counted, each split by every separator.
pub(super) fn tops(text: &str, count: usize) -> Vec<Top<'_>> {
    let mut tops = Vec::new();
    let mut titles = 0;
    for (line, content) in filled_lines(text).take(count + MAX_COMMENTS) {
        titles += usize::from(!content.trim_start().starts_with('#'));
        if titles > count || content.len() > MAX_BYTES {
            break;
        }
        let bare = unmarked(content);
        for separator in Separator::ALL {
            let is_blank = separator == Separator::Char(' ');
            let separator = if is_blank { blanks(text, line, bare) } else { separator };
            let names = trimmed(bare, separator);
            tops.extend(names.map(|names| Top { line, content, separator, names }));
        }
    }
    tops
}

/// Returns the separator of names: single blanks if the row below has as many cells.
fn blanks(text: &str, line: usize, names: &str) -> Separator {
    const SINGLE: Separator = Separator::Char(' ');
    let count = |line: &str| trimmed(line.trim_end(), SINGLE).map_or(0, |cells| cells.len());
    let below = lines(text).skip(line).find(|(_, row)| !row.trim().is_empty());
    let fits = below.is_none_or(|(_, row)| count(row) == count(names));
    if fits && !names.starts_with(' ') && !names.contains("  ") { SINGLE } else { Separator::Blanks }
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

/// Splits all names from their units, strictly if names were equal otherwise: x_px beside x_m.
fn split_all(names: &[String]) -> (Vec<String>, Vec<Option<Measure>>) {
    let by = |split: fn(&str) -> (&str, Option<Measure>)| -> (Vec<String>, Vec<Option<Measure>>) {
        let each = names.iter().map(|name| split(name));
        each.map(|(bare, unit)| (bare.to_string(), unit)).unzip()
    };
    let loosely = by(split_loosely);
    if repeated(&loosely.0).contains(&true) { by(split) } else { loosely }
}

/// Names and units of columns.
#[derive(Clone, Debug)]
pub(super) struct Heading {
    /// Line of the names.
    pub(crate) line: usize,
    /// Rows are below this line: that of the names, or that of the units below it.
    pub(crate) above: usize,
    pub(crate) separator: Separator,
    /// Names as in the file, with their units.
    pub(crate) names: Vec<String>,
    /// Names without the units.
    pub(crate) bare: Vec<String>,
    units: Vec<Option<Measure>>,
}

impl Heading {
    /// Returns the heading with the names of a line, and with the units in the lines below it.
    pub(super) fn new(text: &str, top: &Top, names: Vec<String>) -> Self {
        let (bare, units) = split_all(&names);
        let Top { line, separator, .. } = *top;
        let mut heading = Self { line, above: line, separator, names, bare, units };
        for _ in 0..MAX_FURTHER_LINES {
            let Some((below, row)) = heading.further(text) else { break };
            heading.above = below;
            for (unit, other) in heading.units.iter_mut().zip(row) {
                *unit = unit.or(other);
            }
        }
        heading
    }

    /// Returns the heading of names that may repeat: `x` below `cue` becomes `cue x`, where `cue`
    /// may stand above several columns. The names are kept if some are still equal. An empty name
    /// before the last one is replaced by the word above it, as `Frame#` and `Time` of TRC files,
    /// which stand in the line of the markers.
    pub(super) fn deep(text: &str, top: &Top) -> Self {
        let mut joined = top.names.clone();
        let above = filled_lines(text).take_while(|(above, _)| *above < top.line).map(|(_, title)| title);
        let above: Vec<&str> = above.collect();
        for title in above.into_iter().rev().take(MAX_FURTHER_LINES) {
            let repeated = repeated(&joined);
            let Some(title) = trimmed(title, top.separator) else { break };
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
        let names = if repeated(&joined).contains(&true) { top.names.clone() } else { joined };
        Self::new(text, top, names)
    }

    pub(super) fn plain(line: usize, above: usize, separator: Separator, names: Vec<String>) -> Self {
        Self { line, above, separator, bare: names.clone(), units: vec![None; names.len()], names }
    }

    pub(super) fn unnamed(first: usize, separator: Separator, width: usize) -> Self {
        let names = (1..=width).map(|number| format!("column {number}")).collect();
        Self::plain(first, first - 1, separator, names)
    }

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

    /// Complains about the names that stand twice, with or without their unit.
    pub(super) fn complain_of_twins<'n>(&self, names: impl IntoIterator<Item = &'n str>, input: &Input) {
        for name in names {
            let count = |names: &[String]| names.iter().filter(|own| *own == name).count();
            if count(&self.names).max(count(&self.bare)) > 1 {
                input.wrong(self.line, name, "stands twice in the header; expected it once");
            }
        }
    }

    /// Returns the unit of a column. Complains if it is of another kind than `like`, or not the
    /// unit that is stated elsewhere.
    pub(super) fn unit(
        &self,
        column: usize,
        like: Measure,
        stated: Option<(Measure, &str)>,
        input: &Input,
    ) -> Option<Measure> {
        let unit = self.units[column]?;
        let expected = match stated {
            Some((other, place)) if other != unit => format!("{}, as {place}", other.name()),
            None if !unit.is_like(like) => like.names_of_kind(),
            _ => return Some(unit),
        };
        let message = format!("is in {}; expected {expected}", unit.name());
        input.wrong(self.line, self.bare[column].as_str(), message);
        None
    }

    /// Returns the unit of length of these columns; complains if they state different ones.
    pub(super) fn length(&self, columns: &[usize], input: &Input) -> Option<Unit> {
        let mut first: Option<(Measure, String)> = None;
        for column in columns {
            let stated = first.as_ref().map(|(unit, place)| (*unit, place.as_str()));
            if let Some(unit) = self.unit(*column, Measure::Length(Unit::M), stated, input) {
                first.get_or_insert_with(|| (unit, format!("in the column {}", self.bare[*column])));
            }
        }
        if let (Measure::Length(unit), _) = first? { Some(unit) } else { None }
    }

    /// Returns the unit of a column of time, seconds by default; complains of a contradiction.
    pub(super) fn time(&self, column: usize, input: &Input) -> TimeUnit {
        let stated = input.settings.time_unit;
        let stated = stated.map(|unit| (Measure::Time(unit), "[tracks] time_unit states"));
        match self.unit(column, Measure::Time(TimeUnit::S), stated, input) {
            Some(Measure::Time(unit)) => unit,
            _ => TimeUnit::S,
        }
    }

    /// Returns a further line of the header below the last one, with its units: a line of units, in
    /// brackets or not, or of other names without a number.
    fn further(&self, text: &str) -> Option<(usize, Vec<Option<Measure>>)> {
        let (line, row) = lines(text).skip(self.above).find(|(_, row)| !row.trim().is_empty())?;
        let cells = trimmed(row, self.separator).filter(|cells| cells.len() <= self.names.len() + 1)?;
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
        let are_names = words >= MIN_NAMES && cells.iter().all(|cell| cell.is_empty() || is_word(&cell));
        are_names.then(|| (line, cells.iter().map(|cell| unit(cell).flatten()).collect()))
    }
}

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
