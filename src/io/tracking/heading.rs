//! Names of the columns of a table, and their units beside them, as in `x [mm]`, or below; the
//! first rows of an unknown table, and tests of its columns.

use super::raw::{Job, span};
use super::time::{first_apart, resolution};
use super::words::{Unit, is_angle};
use crate::io::error::{grouped, message};
use crate::io::text::{SEPARATORS, Separator, filled_lines, parse, trimmed, unmarked, value};

/// Maximum number of lines of titles above the names of columns, as spreadsheets have.
pub(super) const TITLES: usize = 10;
/// Maximum number of comments above and between them, and of bytes of a line that may be a header.
const MAX_COMMENTS: usize = 100;
const MAX_BYTES: usize = 1_000_000;
/// Maximum number of further lines of a header, above or below that of the names.
const MAX_FURTHER_LINES: usize = 3;
/// Least number of names in a header: a row of data that lost its numbers has fewer.
const MIN_NAMES: usize = 3;

/// A line that may hold the names of columns, split by one separator, without a mark of comments.
#[derive(Clone, Debug)]
pub(super) struct Heading {
    pub(crate) line: usize,
    pub(crate) is_comment: bool,
    /// Rows are below this line: that of the names, or that of the units below it.
    pub(crate) above: usize,
    pub(crate) separator: Separator,
    /// The names of this line alone, in small letters without units.
    pub(crate) own: Vec<String>,
    /// The names with their units and, if they repeat, with the words in the lines above.
    pub(crate) names: Vec<String>,
    /// `names` without the units.
    pub(crate) bare: Vec<String>,
    pub(crate) units: Vec<Option<Unit>>,
}

/// Returns the first lines of a text, comments not counted, each split by every separator.
pub(super) fn headings(text: &str, count: usize) -> Vec<Heading> {
    let lines = filled_lines(text).take(count + MAX_COMMENTS + MAX_FURTHER_LINES);
    let lines: Vec<(usize, &str)> = lines.take_while(|(_, line)| line.len() <= MAX_BYTES).collect();
    let (mut headings, mut titles) = (Vec::new(), 0);
    for (i, (_, content)) in lines.iter().enumerate().take(count + MAX_COMMENTS) {
        titles += usize::from(!content.trim_start().starts_with('#'));
        if titles > count {
            break;
        }
        headings.extend(SEPARATORS.iter().filter_map(|(separator, _)| Heading::of(&lines, i, *separator)));
    }
    headings
}

impl Heading {
    fn of(lines: &[(usize, &str)], i: usize, separator: char) -> Option<Self> {
        let (line, content) = lines[i];
        let is_comment = content.trim_start().starts_with('#');
        let (titles, below) = (&lines[..i], &lines[i + 1..]);
        let content = unmarked(content);
        // single blanks only separate names without further ones
        let are_blanks = separator == ' ' && (content.starts_with(' ') || content.contains("  "));
        let separator = (!are_blanks).then_some(separator);
        let cells = trimmed(content, separator)?;
        let own_names = cells.iter().map(|name| split(name).0.to_lowercase()).collect();
        let names = told_apart(cells, titles, separator);
        let mut heading = Self { is_comment, own: own_names, ..Self::plain(line, line, separator, names) };
        let bare = heading.names.iter().map(|name| split(name)).map(|(bare, unit)| (bare.to_owned(), unit));
        (heading.bare, heading.units) = bare.unzip();
        let repeated = repeated(&heading.bare);
        for (i, bare) in heading.bare.iter_mut().enumerate() {
            let is_axis = ["x", "y", "z"].iter().any(|axis| bare.eq_ignore_ascii_case(axis));
            if let Some((ball, _)) = heading.names[i].rsplit_once(':').filter(|_| repeated[i] && is_axis) {
                *bare = format!("{ball} {bare}");
            }
        }
        for (line, row) in below.iter().take(MAX_FURTHER_LINES) {
            let Some(row) = heading.further(row) else { break };
            heading.above = *line;
            for (unit, other) in heading.units.iter_mut().zip(row) {
                *unit = unit.or(other);
            }
        }
        Some(heading)
    }

    pub(super) fn plain(line: usize, above: usize, separator: Separator, names: Vec<String>) -> Self {
        let (own, bare, units) = (Vec::new(), names.clone(), vec![None; names.len()]);
        Self { line, is_comment: false, above, separator, own, names, bare, units }
    }

    pub(super) fn unnamed(first: usize, separator: Separator, width: usize) -> Self {
        let names = (1..=width).map(|number| format!("column {number}")).collect();
        Self::plain(first, first - 1, separator, names)
    }

    pub(super) fn small(&self) -> Vec<String> {
        self.bare.iter().map(|name| name.to_lowercase()).collect()
    }

    /// Returns the column of this name in this line alone.
    pub(super) fn at(&self, name: &str) -> Option<usize> {
        self.own.iter().position(|own| own == name)
    }

    /// Returns the column of this name, with or without its unit.
    pub(super) fn position(&self, name: &str) -> Option<usize> {
        let at = |names: &[String]| names.iter().position(|other| other == name);
        at(&self.names).or_else(|| at(&self.bare))
    }

    pub(super) fn lines_below<'t>(&self, text: &'t str) -> impl Iterator<Item = (usize, &'t str)> + use<'t> {
        let above = self.above;
        filled_lines(text).filter(move |(line, _)| *line > above)
    }

    /// Complains about names that stand twice among all; returns whether all differ.
    pub(super) fn has_once(&self, names: &[&str], all: &[String], job: Job) -> bool {
        let twins = names.iter().filter(|name| all.iter().filter(|own| own == *name).count() > 1);
        let complain =
            |name: &&&str| job.wrong(self.line, **name, "stands twice in the header; expected it once");
        twins.inspect(complain).count() == 0
    }

    /// Returns the unit of columns; complains about one of another kind than `like`, or that
    /// differs from that stated elsewhere or those before.
    pub(super) fn unit(
        &self,
        columns: impl IntoIterator<Item = usize>,
        like: Unit,
        mut stated: Option<(Unit, String)>,
        job: Job,
    ) -> Option<Unit> {
        for column in columns {
            let Some(unit) = self.units[column] else { continue };
            let name = self.bare[column].as_str();
            let expected = match &stated {
                Some((other, place)) if *other != unit => format!("{}, as {place}", other.name()),
                None if unit.si() != like.si() => format!("a unit like {}", like.name()),
                _ => {
                    stated.get_or_insert_with(|| (unit, format!("in the column {name}")));
                    continue;
                }
            };
            job.wrong(self.line, name, format!("is in {}; expected {expected}", unit.name()));
        }
        stated.map(|(unit, _)| unit)
    }

    /// Returns the unit of a column of time, seconds by default; complains of a contradiction.
    pub(super) fn time(&self, column: usize, job: Job) -> Unit {
        let stated = job.settings.tracks.time_unit;
        let stated = stated.map(|unit| (unit, "[tracks] time_unit states".to_string()));
        self.unit([column], Unit::S, stated, job).unwrap_or(Unit::S)
    }

    /// Returns the column of frame numbers (flag) or of times; complains if both contradict each other.
    pub(super) fn clock(&self, columns: [Option<usize>; 3], job: Job) -> Option<(usize, bool)> {
        let [frame, time, shot] = columns;
        // playback_fps goes with a known rate only
        let rate = job.settings.known_fps().map(|fps| job.settings.video.playback_fps.unwrap_or(fps));
        if let (Some(frame), Some(time), Some(rate)) = (frame, time, rate) {
            self.check_clock([frame, time], shot, rate, job);
        }
        job.frame_or_time(frame, time)
    }

    /// Complains if a column of frames and one of times contradict each other in the first shot.
    pub(super) fn check_clock(&self, columns: [usize; 2], shot: Option<usize>, rate: f64, job: Job) {
        let unit = self.time(columns[1], job);
        let Some(second) = unit.seconds() else { return };
        let mut rows = Rows::of(job.text, self);
        rows.0.truncate(rows.0.iter().take_while(|row| shot.is_none_or(|i| row[i] == rows.0[0][i])).count());
        let [Some(frames), Some(times)] = columns.map(|column| rows.numbers(column)) else { return };
        let Some(row) = first_apart(&frames, &times, resolution(&times), rate * second) else { return };
        let [frame, time] = columns.map(|column| self.names[column].as_str());
        let (number, lasts) = (frames[row] - frames[0], times[row] - times[0]);
        let (unit, own) = (unit.name(), number / (lasts * second));
        let message = message!("clocks_differ", frame, time, rate, number, lasts, unit, own);
        job.wrong(self.lines_below(job.text).nth(row).map(|(line, _)| line), time, message);
    }

    /// Returns the units in a further line of the header, of units or names; `None` for a row.
    fn further(&self, row: &str) -> Option<Vec<Option<Unit>>> {
        let cells = trimmed(row, self.separator).filter(|cells| cells.len() <= self.names.len() + 1)?;
        let bare = cells.iter().map(|cell| cell.trim_matches(['[', ']', '(', ')']).trim());
        let units: Vec<Option<Unit>> = bare.clone().map(Unit::of).collect();
        if bare.zip(&units).all(|(cell, unit)| unit.is_some() || ["", "-"].contains(&cell)) {
            return units.iter().any(Option::is_some).then_some(units);
        }
        let (words, others): (Vec<&String>, Vec<&String>) =
            cells.iter().partition(|cell| parse(cell).is_err() && !cell.contains(':'));
        (words.len() >= MIN_NAMES && others.iter().all(|cell| cell.is_empty())).then_some(units)
    }
}

/// Splits `x_mm` into `x` and mm; `None` if the last word is not a unit or does not suit the name.
fn suffix(name: &str) -> Option<(&str, Unit)> {
    let (bare, word) = name.rsplit_once('_').or_else(|| name.rsplit_once(" in "))?;
    let unit = Unit::of(word).filter(|_| !word.is_empty() && !bare.is_empty())?;
    let small = bare.to_lowercase();
    let fits = match unit.si() {
        Unit::M => unit != Unit::In && small.contains(['x', 'y']),
        Unit::S => small.starts_with(['t', 'z']) || small == "elapsed",
        _ => ["ang", "theta", "rot", "phi"].iter().any(|word| small.starts_with(word)),
    };
    fits.then_some((bare, unit))
}

/// Splits a name from its unit and additions: `x [mm]`, `Time (s) Run #1`, `Data Set 1:Time(s)`.
fn split(name: &str) -> (&str, Option<Unit>) {
    let run = name.trim_end_matches(|c: char| c.is_ascii_digit()).strip_suffix("Run #");
    let plain = run.map_or(name, str::trim_end);
    let last = plain.rsplit_once(':').map(|(_, last)| last.trim_start());
    let plain = last.filter(|last| !last.is_empty()).unwrap_or(plain);
    let (open, close) = if plain.ends_with(']') { ('[', ']') } else { ('(', ')') };
    let parts = plain.strip_suffix(close).and_then(|rest| rest.rsplit_once(open));
    let bracketed = parts.and_then(|(bare, word)| Some((bare.trim_end(), Unit::of(word)?)));
    bracketed.or_else(|| suffix(plain)).map_or((plain, None), |(bare, unit)| (bare, Some(unit)))
}

/// Returns names that repeat with the words above them, which may stand above several columns: `x`
/// below `cue` is `cue x`. An empty name is replaced by the word above it (`Frame#` of TRC files).
fn told_apart(mut names: Vec<String>, titles: &[(usize, &str)], separator: Separator) -> Vec<String> {
    // Tracker begins with #multi:
    let titles = titles.iter().rev().filter(|(_, title)| !title.trim_start().starts_with("#multi"));
    for (_, title) in titles.take(MAX_FURTHER_LINES) {
        let Some(title) = trimmed(title, separator) else { break };
        let (repeated, is_as_wide) = (repeated(&names), names.len().abs_diff(title.len()) <= 1);
        let mut last = "";
        for (i, name) in names.iter_mut().enumerate() {
            let word = title.get(i).map_or("", String::as_str);
            last = if word.is_empty() { last } else { word };
            if name.is_empty() && is_as_wide {
                *name = word.to_string();
            } else if repeated[i] && !last.is_empty() {
                *name = format!("{last} {name}");
            }
        }
        if !repeated.contains(&true) {
            break;
        }
    }
    names
}

fn repeated(names: &[String]) -> Vec<bool> {
    let twins = grouped(names.iter().map(|name| (name, ())));
    names.iter().map(|name| !name.is_empty() && twins[name].len() > 1).collect()
}

/// Maximum number of rows examined.
const MAX_ROWS: usize = 20_000;
/// Maximum number of tracks of balls in a file.
pub(super) const MAX_TRACKS: usize = 20;

pub(super) struct Rows(Vec<Vec<String>>);

impl Rows {
    pub(super) fn of(text: &str, heading: &Heading) -> Self {
        let cells = heading.lines_below(text).filter_map(|(_, line)| trimmed(line, heading.separator));
        Self(cells.filter(|cells| cells.len() >= heading.names.len()).take(MAX_ROWS).collect())
    }

    pub(super) fn column(&self, column: usize) -> impl Iterator<Item = &str> {
        self.0.iter().map(move |row| row[column].as_str())
    }

    fn numbers(&self, column: usize) -> Option<Vec<f64>> {
        let numbers: Vec<f64> = self.column(column).map(value).collect::<Option<_>>()?;
        (numbers.len() > 2).then_some(numbers)
    }

    /// Returns the numbers of rows with the same cells in some columns.
    fn counts(&self, columns: &[Option<usize>]) -> Vec<usize> {
        let cells = self.0.iter().map(|row| columns.iter().flatten().map(|column| row[*column].as_str()));
        let rows = grouped(cells.map(|cells| (cells.collect::<Vec<&str>>(), ())));
        rows.into_values().map(|rows| rows.len()).collect()
    }

    pub(super) fn values(&self, column: usize) -> usize {
        self.counts(&[Some(column)]).len()
    }

    pub(super) fn is_whole(&self, column: usize) -> bool {
        self.numbers(column).is_some_and(|numbers| numbers.iter().all(|number| number.fract() == 0.0))
    }

    /// Returns the difference of the largest and the least number of a column.
    pub(super) fn extent(&self, column: usize) -> f64 {
        let [least, most] = span(self.column(column).filter_map(value));
        most - least
    }

    /// Returns whether a column grows from row to row of each shot.
    pub(super) fn grows(&self, column: usize, shot: Option<usize>) -> bool {
        let Some(numbers) = self.numbers(column) else { return false };
        let shots = self.0.iter().map(|row| shot.map_or("", |shot| row[shot].as_str()));
        grouped(shots.zip(numbers)).values().all(|numbers| numbers.is_sorted_by(|one, next| one < next))
    }

    /// Returns the columns that grow from row to row of each shot: not angles, nor numbers of rows.
    pub(super) fn growing(&self, heading: &Heading, shot: Option<usize>) -> impl Iterator<Item = usize> {
        let names = heading.small().into_iter().enumerate();
        let named = names.filter(|(_, name)| !name.is_empty() && !is_angle(name)).map(|(column, _)| column);
        let counts = |numbers: Vec<f64>| numbers.windows(2).all(|two| two[1] - two[0] == 1.0);
        named.filter(move |i| self.grows(*i, shot) && !self.numbers(*i).is_some_and(counts))
    }

    /// Returns whether most values of a column stand in two rows of their shot, or up to `most`.
    pub(super) fn are_shared(&self, column: usize, shot: Option<usize>, most: usize) -> bool {
        let counts = self.counts(&[shot, Some(column)]);
        let shared = counts.iter().filter(|count| (2..=most).contains(*count)).count();
        counts.len() > 2 && 3 * shared > 2 * counts.len()
    }

    /// Returns whether a column has few values, and rows differ only with it.
    pub(super) fn distinguishes_rows(&self, column: usize, [one, other]: [Option<usize>; 2]) -> bool {
        let values = self.values(column);
        let are_few = (2..=MAX_TRACKS).contains(&values) && 2 * values <= self.0.len();
        are_few && self.counts(&[one, other, Some(column)]).len() == self.0.len()
    }
}
