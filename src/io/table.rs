//! Tables with commas, semicolons or tabs between cells: columns with meanings, and labels.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::error::{Log, did_you_mean, message, quoted};
use super::manifest::StatedSpin;
use super::text::{
    Mark, Place, Slip, cells, line_end, line_of_names, parse, read_utf8, value, without_separator_line,
    wrong_width,
};
use crate::measurement::fault::{Condition, Fault, POSITIVE};
use crate::measurement::observable::Measured;
use crate::measurement::spin::Spin;
use crate::physics::ball::Vec3;

/// A column of numbers: its name, its SI unit, and its range in that unit.
pub(crate) type Column = (&'static str, f64, Condition);

/// Columns of a measured spin, rad/s.
pub(crate) const OMEGA: [&str; 3] = ["omega_x", "omega_y", "omega_z"];

/// The rows of a file; columns without a meaning are labels.
pub(crate) struct Table<'a> {
    pub(crate) path: PathBuf,
    pub(crate) log: &'a Log,
    /// The separator of cells; unless it is a comma, decimals may have one.
    separator: char,
    /// The column names, and their line.
    names: Vec<String>,
    line: usize,
    rows: Vec<Record>,
    /// Columns of texts and of numbers with meanings.
    known: Vec<&'static str>,
    numbers: Vec<Column>,
}

/// The number of a record's first line, and its cells without the blanks around them.
type Record = (usize, Vec<String>);

impl<'a> Table<'a> {
    /// Gives columns of texts and of numbers their meanings. Complains about names that are nearly
    /// known, except the label `by`, about gaps in `required` columns, numbers out of range and
    /// standard deviations that are not positive.
    pub(crate) fn with(mut self, texts: &'static str, columns: &[Column], required: &str, by: &str) -> Self {
        self.known = texts.split(' ').chain(columns.iter().map(|(name, ..)| *name)).collect();
        self.numbers = columns.to_vec();
        self.check_names(required, by);
        for (name, unit_si, range) in columns.iter().filter(|(name, ..)| self.has(name)) {
            self.check_numbers(name, *unit_si, *range, "out of range");
            self.check_numbers(&format!("{name}_sd"), *unit_si, POSITIVE, "not a standard deviation");
        }
        self
    }

    /// Reads the rows of a file without comments (`#`). `None`, with a problem, if that fails.
    pub(crate) fn read(path: &Path, log: &'a Log) -> Option<Self> {
        let text = read_utf8(path, log)?;
        let (text, stated) = without_separator_line(text.into());
        let separator = stated.unwrap_or_else(|| separator(&text));
        let before = log.len();
        let wrong = |line: Option<usize>, message: &str| log.add(path, line, None, message);
        let mut rows = records(&text, separator, &|line, message| wrong(Some(line), message));
        let has_slips = log.len() > before;
        if rows.is_empty() && !has_slips {
            wrong(None, "is empty; expected a line of column names, and rows below it");
        }
        let ((line, names), before) = (rows.drain(..1.min(rows.len())).next()?, log.len());
        for (i, name) in names.iter().enumerate() {
            if name.is_empty() {
                wrong(Some(line), &format!("column {} has no name", i + 1));
            } else if names[..i].contains(name) {
                log.add(path, line, name.as_str(), "stands twice among the column names");
            }
        }
        if log.len() > before {
            return None;
        }
        if rows.is_empty() && !has_slips {
            wrong(Some(line), "no rows below the column names; expected at least one (# begins a comment)");
        }
        for (row, cells) in rows.extract_if(.., |(_, cells)| cells.len() != names.len()) {
            wrong(Some(row), &wrong_width(cells.len(), names.len(), line, Some(separator)));
        }
        let (path, known, numbers) = (path.to_path_buf(), Vec::new(), Vec::new());
        (!rows.is_empty()).then_some(Self { path, log, separator, names, line, rows, known, numbers })
    }

    /// Complains about cells of a column that are not numbers, or out of range in SI.
    fn check_numbers(&self, name: &str, unit_si: f64, range: Condition, fault: &str) {
        let Some(column) = self.place(name) else { return };
        let mut marks = Mark::default();
        for (line, cells) in &self.rows {
            let cell =
                Place { file: &self.path, line: *line, column: name, text: &cells[column], log: self.log };
            let number = marks.number(cell);
            if number.is_some_and(|number| Fault::of_number(name, number * unit_si, range).is_some()) {
                cell.wrong(format!("{} is {fault}; expected {}", cell.text, range.1));
            }
        }
        if self.separator != ',' {
            marks.finish(&self.path, self.log);
        }
    }

    /// Adds a problem in a row or, without one, in the column names.
    pub(crate) fn wrong<'c>(
        &self,
        row: impl Into<Option<usize>>,
        column: impl Into<Option<&'c str>>,
        message: impl Into<String>,
    ) {
        let line = row.into().map_or(self.line, |row| self.line(row));
        self.log.add(&self.path, line, column, message);
    }

    pub(crate) fn rows(&self) -> std::ops::Range<usize> {
        0..self.rows.len()
    }

    pub(crate) fn line(&self, row: usize) -> usize {
        self.rows[row].0
    }

    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    fn place(&self, column: &str) -> Option<usize> {
        self.names().position(|name| name == column)
    }

    pub(crate) fn has(&self, column: &str) -> bool {
        self.place(column).is_some()
    }

    /// Returns a cell; `None` if it is empty or the column is missing.
    pub(crate) fn text(&self, column: &str, row: usize) -> Option<&str> {
        Some(self.rows[row].1[self.place(column)?].as_str()).filter(|cell| !cell.is_empty())
    }

    /// Returns a number in SI with its standard deviation.
    pub(crate) fn at(&self, column: &str, row: usize) -> Option<Measured> {
        let (_, unit_si, _) = self.numbers.iter().find(|(name, ..)| *name == column)?;
        let number = |name: &str| Some(value(self.text(name, row)?)? * unit_si);
        Some(Measured { value: number(column)?, sd: number(&format!("{column}_sd")) })
    }

    /// Returns whether a cell is empty, or a word for a missing number.
    pub(crate) fn is_gap(&self, column: &str, row: usize) -> bool {
        self.text(column, row).is_none_or(|text| parse(text) == Ok(None))
    }

    /// Complains about missing columns and gaps, a `…_sd` alone, and nearly known names.
    fn check_names(&self, required: &str, by: &str) {
        let known = &self.known;
        for name in self.names().filter(|name| *name != by) {
            let value = name.strip_suffix("_sd").filter(|value| known.contains(value) && !self.has(value));
            if let Some(value) = value {
                self.wrong(None, name, format!("there is no column {value} that it belongs to"));
            } else if let Some(advice) = near_miss(name, known, |name| self.has(name)) {
                let message = format!("{advice}, or give a label that is called so another name");
                self.wrong(None, name, message);
            }
        }
        for column in required.split(' ') {
            if !self.has(column) {
                self.wrong(None, column, "is missing from the column names");
                continue;
            }
            for row in self.rows().filter(|row| self.is_gap(column, *row)) {
                self.wrong(row, column, "is empty; expected a value");
            }
        }
    }

    pub(crate) fn labels(&self) -> impl Iterator<Item = &str> {
        self.names().filter(|name| !self.known.contains(&name.strip_suffix("_sd").unwrap_or(name)))
    }

    pub(crate) fn labels_at(&self, row: usize) -> BTreeMap<String, String> {
        let text = |name: &str| self.text(name, row).unwrap_or_default().to_owned();
        self.labels().map(|name| (name.to_owned(), text(name))).collect()
    }

    /// Notes which columns are kept as labels, except that of a name.
    pub(crate) fn note(&self, except: Option<&str>) -> Option<String> {
        let mut labels: Vec<&str> = self.labels().filter(|label| Some(*label) != except).collect();
        labels.sort_unstable();
        let are = if labels.len() == 1 { "column" } else { "columns" };
        let (path, named) = (self.path.display(), quoted(&labels));
        let note = format!("{path}: {are} kept as labels, not read as measurements: {named}");
        (!labels.is_empty()).then_some(note)
    }

    /// Returns the statement of each row, or of dataset.toml, about the spin; `None`: wrong.
    pub(crate) fn spins(&self, columns: [&str; 3], assume: StatedSpin) -> Vec<Option<StatedSpin>> {
        let all = columns.join(", ");
        let missing: Vec<&str> = columns.into_iter().filter(|column| !self.has(column)).collect();
        if (1..3).contains(&missing.len()) {
            let message = format!("is missing from the column names; expected all three of {all}");
            for column in missing {
                self.wrong(None, column, message.as_str());
            }
            return vec![None; self.rows.len()];
        }
        let spin = |row: usize| {
            let word = self.text("cue_spin", row).unwrap_or_default();
            let stated = StatedSpin::named(&word.to_lowercase());
            let empty: Vec<&str> = columns.into_iter().filter(|column| self.is_gap(column, row)).collect();
            let (column, message) = match (stated, empty.as_slice()) {
                (None, _) if !word.is_empty() => {
                    let (near, words) = (did_you_mean(word, StatedSpin::WORDS), StatedSpin::WORDS.join(", "));
                    ("cue_spin", format!("\"{word}\" is not a spin{near}; expected {words}"))
                }
                (None | Some(StatedSpin::Measured), []) => {
                    let [x, y, z] = columns.map(|column| self.at(column, row));
                    let ([x, y, z], sd) = ([x?, y?, z?].map(|one| one.value), [x?.sd, y?.sd, z?.sd]);
                    return Some(StatedSpin::Is(Spin::Measured { spin: Vec3::new(x, y, z), sd }));
                }
                (_, [_, _, _]) => return Some(stated.unwrap_or(assume)),
                (_, []) => ("cue_spin", format!("\"{word}\", but {all} have values; expected only one")),
                (_, [first, ..]) => (*first, "is empty; expected all three components or none".to_owned()),
            };
            self.wrong(row, column, message);
            None
        };
        self.rows().map(spin).collect()
    }
}

/// Words for standard deviation, after or before the name of a column.
const SPREADS: &str = "std sdev stdev stddev std_dev err error sigma unc uncertainty se stderr std_err sd";

/// Units at the ends of names; known names have the first two.
const UNITS: &str = "deg m_s rad degree degrees mph km_h kmh kph cm_s mm_s ft_s in_s";
/// Parts of names, and by what they are replaced before names are compared.
const SYNONYMS: &str =
    "frame_rate=fps framerate=fps skipped=skip omega_=w object_=obj_ _angle= _hz= capture_= cue_=";

/// Splits a name in small letters into its quantity and its unit, which may be empty.
fn quantity(name: &str) -> (String, &str) {
    let (name, sd) = name.strip_suffix("_sd").map_or((name, ""), |name| (name, "_sd"));
    let bare = |unit| Some((name.strip_suffix(unit)?.strip_suffix('_')?, unit));
    let (bare, unit) = UNITS.split(' ').find_map(bare).unwrap_or((name, ""));
    let synonyms = SYNONYMS.split(' ').filter_map(|pair| pair.split_once('='));
    let bare = synonyms.fold(bare.to_owned(), |bare, (word, other)| bare.replace(word, other));
    (bare + sd, unit)
}

/// Returns advice to write the known name, or its `…_sd`, that a name resembles and the table
/// lacks: by another word for standard deviation, by the quantity with another unit or without one,
/// or by a slip of the pen in five letters, or two in nine.
pub(crate) fn near_miss(name: &str, known: &[&str], has: impl Fn(&str) -> bool) -> Option<String> {
    if known.contains(&name.strip_suffix("_sd").unwrap_or(name)) {
        return None;
    }
    let plain = name.to_lowercase().replace([' ', '-', '.', '/'], "_").replace(['[', ']', '(', ')'], "");
    let bare = |word: &str| {
        let rest = plain.strip_suffix(word).or_else(|| plain.strip_prefix(word))?;
        Some(rest.trim_matches('_')).filter(|rest| known.contains(rest))
    };
    let plain = SPREADS.split(' ').find_map(bare).map_or(plain.clone(), |of| format!("{of}_sd"));
    let (stated, unit) = quantity(&plain);
    let names = known.iter().flat_map(|name| [(*name).to_owned(), format!("{name}_sd")]);
    let slips = |known: String| {
        let slips = strsim::damerau_levenshtein(&plain, &known);
        let is_near = slips <= (2 * known.len() / 9).min(2) || quantity(&known).0 == stated;
        (is_near && !has(&known)).then_some((slips, known))
    };
    let (_, meant) = names.filter_map(slips).min()?;
    let is_other = !unit.is_empty() && !unit.starts_with(quantity(&meant).1);
    let convert = if is_other { "convert the numbers and " } else { "" };
    Some(format!("is not a known name, but nearly {meant}; {convert}write {meant}"))
}

/// Returns the most likely separator: the most frequent one in the line of names.
fn separator(text: &str) -> char {
    let names = line_of_names(text);
    // the last one of equally frequent ones
    ['\t', ';', ','].into_iter().max_by_key(|c| names.matches(*c).count()).unwrap_or(',')
}

/// Splits a text into records. Comments are passed over, and lines of blanks and separators only.
fn records(text: &str, separator: char, wrong: &dyn Fn(usize, &str)) -> Vec<Record> {
    // a quoted cell keeps its ends of lines
    let end = line_end(text);
    let (mut records, mut lines) = (Vec::new(), (1..).zip(text.split(end)));
    while let Some((first, line)) = lines.next() {
        if line.trim_start().starts_with('#') {
            continue;
        }
        let (mut record, mut last) = (line.to_owned(), first);
        while cells(&record, Some(separator)) == Err(Slip::Open) {
            // the quoted cell ends in a line with another mark
            let Some(others) = lines.clone().position(|(_, line)| line.contains('"')) else { break };
            for (line, text) in lines.by_ref().take(others + 1) {
                last = line;
                record.push(end);
                record.push_str(text);
            }
        }
        match cells(&record, Some(separator)) {
            Err(Slip::Open) => wrong(first, "a quotation mark opens here and is never closed"),
            Err(Slip::Text) => wrong(last, &message!("text_behind_quotation_mark")),
            Ok(cells) if cells.iter().all(|cell| cell.is_empty()) => {}
            Ok(cells) => records.push((first, cells.into_iter().map(Cow::into_owned).collect())),
        }
    }
    records
}
