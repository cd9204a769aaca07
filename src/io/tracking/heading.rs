//! The line that names the columns of a table, and their units: beside the names, as in `x [mm]`, or in a row of units below.

use std::path::Path;

use super::column_names::AngleUnit;
use super::settings::{TimeUnit, Unit};
use super::text::{Separator, lines, trimmed};
use crate::io::error::Problems;

/// Spreadsheets have a few lines of titles above the names of their columns, at most so many.
pub(super) const TITLES: usize = 10;

/// The unit of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Measure {
    Length(Unit),
    Time(TimeUnit),
    Angle(AngleUnit),
}

impl Measure {
    /// Of a word such as `mm`; `None` where the word is no unit.
    fn of(word: &str) -> Option<Self> {
        Some(match word.trim().to_lowercase().as_str() {
            "m" | "metre" | "metres" | "meter" | "meters" => Self::Length(Unit::M),
            "cm" => Self::Length(Unit::Cm),
            "mm" => Self::Length(Unit::Mm),
            "in" | "inch" | "inches" | "\"" => Self::Length(Unit::In),
            "ft" | "foot" | "feet" => Self::Length(Unit::Ft),
            "px" | "pixel" | "pixels" => Self::Length(Unit::Px),
            "s" | "sec" | "second" | "seconds" => Self::Time(TimeUnit::S),
            "ms" => Self::Time(TimeUnit::Ms),
            "us" | "µs" | "μs" => Self::Time(TimeUnit::Us),
            "frame" | "frames" => Self::Time(TimeUnit::Frames),
            "rad" | "radian" | "radians" => Self::Angle(AngleUnit::Rad),
            "deg" | "°" | "degree" | "degrees" => Self::Angle(AngleUnit::Deg),
            _ => return None,
        })
    }

    /// As messages name it.
    fn name(self) -> &'static str {
        match self {
            Self::Length(unit) => unit.name(),
            Self::Time(unit) => unit.name(),
            Self::Angle(unit) => unit.name(),
        }
    }
}

/// `x [mm]` as `x` and mm. A name without a unit is left as it is.
fn split(name: &str) -> (&str, Option<Measure>) {
    for (open, close) in [('[', ']'), ('(', ')')] {
        let inside = name.strip_suffix(close).and_then(|rest| rest.rsplit_once(open));
        if let Some((bare, word)) = inside
            && let Some(unit) = Measure::of(word)
        {
            return (bare.trim_end(), Some(unit));
        }
    }
    (name, None)
}

/// Names and units of columns.
#[derive(Clone, Debug)]
pub(super) struct Heading {
    /// Line of the names.
    pub line: usize,
    /// Rows are below this line: that of the names, or that of the units below it.
    pub above: usize,
    pub separator: Separator,
    /// As they stand in the file, with their units.
    pub names: Vec<String>,
    /// Without the units.
    pub bare: Vec<String>,
    units: Vec<Option<Measure>>,
}

impl Heading {
    /// Of a line with these names; `text` is that of the file.
    pub(super) fn new(text: &str, line: usize, separator: Separator, names: Vec<String>) -> Self {
        let (bare, mut units): (Vec<String>, Vec<Option<Measure>>) = names
            .iter()
            .map(|name| {
                let (bare, unit) = split(name);
                (bare.to_string(), unit)
            })
            .unzip();
        let mut above = line;
        if let Some((below, row)) = row_of_units(text, line, separator, names.len()) {
            above = below;
            for (unit, other) in units.iter_mut().zip(row) {
                *unit = unit.or(other);
            }
        }
        Self { line, above, separator, names, bare, units }
    }

    /// Of a table without names: rows of so many cells, the first one in this line.
    pub(super) fn unnamed(first: usize, separator: Separator, width: usize) -> Self {
        let names: Vec<String> = (1..=width).map(|number| format!("column {number}")).collect();
        Self {
            line: first,
            above: first - 1,
            separator,
            bare: names.clone(),
            units: vec![None; width],
            names,
        }
    }

    /// The column of this name, with or without its unit.
    pub(super) fn position(&self, name: &str) -> Option<usize> {
        let at = |names: &[String]| names.iter().position(|own| own == name);
        at(&self.names).or_else(|| at(&self.bare))
    }

    /// Whether the header states the unit of a column.
    pub(super) fn has_unit(&self, column: usize) -> bool {
        self.units[column].is_some()
    }

    /// How many columns have this name, with or without their unit.
    pub(super) fn count(&self, name: &str) -> usize {
        let count = |names: &[String]| names.iter().filter(|own| *own == name).count();
        count(&self.names).max(count(&self.bare))
    }

    /// The unit of length of these columns, which must be the same in all that have one.
    pub(super) fn length(&self, columns: &[usize], file: &Path, problems: &mut Problems) -> Option<Unit> {
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
                    let message = format!("is in {}; expected {expected}", unit.name());
                    problems.add(file, Some(self.line), Some(&self.bare[*column]), message);
                }
            }
        }
        first.map(|(_, unit)| unit)
    }

    /// The unit of a column of time, which must not differ from the one that dataset.toml states.
    pub(super) fn time(
        &self,
        column: usize,
        stated: Option<TimeUnit>,
        file: &Path,
        problems: &mut Problems,
    ) -> Option<TimeUnit> {
        match (self.units[column]?, stated) {
            (Measure::Time(unit), Some(other)) if unit != other => {
                let message = format!(
                    "is in {}, but [tracks] time_unit is \"{}\"; expected the same, or no time_unit",
                    unit.name(),
                    other.name()
                );
                problems.add(file, Some(self.line), Some(&self.bare[column]), message);
                None
            }
            (Measure::Time(unit), _) => Some(unit),
            (other, _) => {
                let message = format!("is in {}; expected s, ms, us or frames", other.name());
                problems.add(file, Some(self.line), Some(&self.bare[column]), message);
                None
            }
        }
    }

    /// The unit of a column of angles: that of the header or, where it says none, of dataset.toml, which must not differ.
    pub(super) fn angle(
        &self,
        column: usize,
        stated: Option<AngleUnit>,
        file: &Path,
        problems: &mut Problems,
    ) -> Option<AngleUnit> {
        let message = match (self.units[column], stated) {
            (Some(Measure::Angle(unit)), None) | (None, Some(unit)) => return Some(unit),
            (Some(Measure::Angle(unit)), Some(other)) if unit == other => return Some(unit),
            (Some(Measure::Angle(unit)), Some(other)) => {
                format!("is in {}, but [tracks.columns] angle_unit is \"{}\"; expected the same", unit.name(), other.name())
            }
            (Some(other), _) => format!("is in {}; expected rad or deg", other.name()),
            (None, None) => {
                "nothing says what these angles are in; expected [tracks.columns] angle_unit = \"rad\" or \"deg\"".to_string()
            }
        };
        problems.add(file, Some(self.line), Some(&self.bare[column]), message);
        None
    }
}

/// The line below the names and its units, where every cell that is not empty is a unit, in brackets or not.
fn row_of_units(
    text: &str,
    header: usize,
    separator: Separator,
    width: usize,
) -> Option<(usize, Vec<Option<Measure>>)> {
    let (line, row) = lines(text).skip(header).find(|(_, line)| !line.trim().is_empty())?;
    let cells = trimmed(row, separator)?;
    if cells.len() > width + 1 {
        return None;
    }
    let mut units = Vec::with_capacity(cells.len());
    for cell in &cells {
        let word = cell.trim_matches(['[', ']', '(', ')']).trim();
        units.push(match word {
            "" | "-" => None,
            word => Some(Measure::of(word)?),
        });
    }
    units.iter().any(Option::is_some).then_some((line, units))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_split_from_the_name() {
        assert_eq!(split("x [mm]"), ("x", Some(Measure::Length(Unit::Mm))));
        assert_eq!(split("x(cm)"), ("x", Some(Measure::Length(Unit::Cm))));
        assert_eq!(split("t [µs]"), ("t", Some(Measure::Time(TimeUnit::Us))));
        assert_eq!(split("θ (°)"), ("θ", Some(Measure::Angle(AngleUnit::Deg))));
        for plain in ["x", "A (1)", "x [", "(m", "v (m/s)"] {
            assert_eq!(split(plain), (plain, None));
        }
    }

    #[test]
    fn a_row_of_units_is_not_a_row_of_numbers() {
        let units = |text| row_of_units(text, 1, Separator::Char(','), 3).map(|(line, _)| line);
        assert_eq!(units("t,x,y\n\ns,m,m\n0,1,2\n"), Some(3));
        assert_eq!(units("t,x,y\n[s],,(m)\n"), Some(2));
        for text in ["t,x,y\n0,1,2\n", "t,x,y\n,,\n1,,\n", "t,x,y\n1,,\n", "t,x,y\ns,m,m,m,m\n", "t,x,y"] {
            assert_eq!(units(text), None, "{text}");
        }
    }
}
