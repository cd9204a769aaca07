//! What the tables of both kinds share: values with standard deviations, spins, observables.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::{Problems, did_you_mean};
use super::manifest::Assume;
use super::table::Table;
use super::{Measured, Measurement, Spin};
use crate::ball::Vec3;
use crate::observable::Observable;

/// A column of numbers and the one of its standard deviations, in the file's units.
pub(super) struct Column {
    values: Vec<Option<f64>>,
    sds: Option<Vec<Option<f64>>>,
    unit_si: f64,
}

impl Column {
    /// `None` if the column is not there. Checks that standard deviations are positive.
    pub(super) fn read(table: &Table, name: &str, unit_si: f64, problems: &mut Problems) -> Option<Self> {
        let values = table.numbers(name, problems)?;
        let sd_name = format!("{name}_sd");
        let sds = table.numbers(&sd_name, problems);
        for (row, sd) in sds.iter().flatten().enumerate() {
            if let Some(sd) = sd.filter(|sd| *sd <= 0.0) {
                let message = format!("{sd} is no standard deviation; expected more than 0");
                problems.add(&table.path, Some(table.line(row)), Some(&sd_name), message);
            }
        }
        Some(Self { values, sds, unit_si })
    }

    /// In SI units and radians.
    pub(super) fn measured(&self, row: usize) -> Option<Measured> {
        let value = self.values[row]? * self.unit_si;
        let sd = self.sds.as_ref().and_then(|sds| sds[row]).map(|sd| sd * self.unit_si);
        Some(Measured { value, sd })
    }
}

/// The observables that a table has, and their columns.
pub(super) struct Observables(Vec<(Observable, Column)>);

impl Observables {
    pub(super) fn read(table: &Table, known: &[Observable], problems: &mut Problems) -> Self {
        let mut found = Vec::new();
        for observable in known {
            let name = observable.column();
            let Some(column) = Column::read(table, name, observable.unit_si(), problems) else { continue };
            if column.sds.is_some() {
                let (mut with, mut without) = (None, None);
                for row in (0..table.rows()).filter(|row| column.values[*row].is_some()) {
                    let slot = if column.measured(row).is_some_and(|m| m.sd.is_some()) {
                        &mut with
                    } else {
                        &mut without
                    };
                    slot.get_or_insert(row);
                }
                if let (Some(with), Some(without)) = (with, without) {
                    let message = format!(
                        "is empty, but line {} has one; give a standard deviation for every {name} or for none",
                        table.line(with)
                    );
                    problems.add(
                        &table.path,
                        Some(table.line(without)),
                        Some(&format!("{name}_sd")),
                        message,
                    );
                }
            }
            found.push((*observable, column));
        }
        if found.is_empty() && problems.is_empty() {
            let names: Vec<_> = known.iter().map(|o| o.column()).collect();
            let message = format!("no observable: expected at least one of the columns {}", names.join(", "));
            problems.add(&table.path, None, None, message);
        }
        Self(found)
    }

    pub(super) fn row(&self, table: &Table, row: usize, problems: &mut Problems) -> Vec<Measurement> {
        let measurement = |(observable, column): &(Observable, Column)| {
            Some(Measurement { observable: *observable, measured: column.measured(row)? })
        };
        let found: Vec<_> = self.0.iter().filter_map(measurement).collect();
        if found.is_empty() && !self.0.is_empty() {
            problems.add(&table.path, Some(table.line(row)), None, "no observable has a value in this row");
        }
        found
    }
}

/// The spin of every row: a word column, three number columns, or what dataset.toml assumes.
pub(super) fn spins(
    table: &Table,
    columns: [&str; 3],
    words: bool,
    assume: Option<Assume>,
    manifest: &Path,
    problems: &mut Problems,
) -> Vec<Spin> {
    let present = columns.iter().filter(|column| table.has(column)).count();
    if (1..3).contains(&present) {
        for column in columns.iter().filter(|column| !table.has(column)) {
            let message = format!("the column is missing; expected all three of {}", columns.join(", "));
            problems.add(&table.path, None, Some(column), message);
        }
        return Vec::new();
    }
    let numbers = columns.map(|column| Column::read(table, column, 1.0, problems));
    let mut spins = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let components = numbers.each_ref().map(|c| c.as_ref().and_then(|column| column.measured(row)));
        let word = if words { table.text("cue_spin", row) } else { None };
        let assumed = match word {
            None => assume,
            Some(word) => {
                let known = Assume::WORDS.iter().find(|(name, _)| *name == word);
                if known.is_none() {
                    let names = Assume::WORDS.map(|(name, _)| name);
                    let message = format!(
                        "\"{word}\" is no spin{}; expected {}",
                        did_you_mean(word, names),
                        names.join(", ")
                    );
                    problems.add(&table.path, Some(table.line(row)), Some("cue_spin"), message);
                    continue;
                }
                known.map(|(_, assume)| *assume)
            }
        };
        let spin = match (components, assumed) {
            // a column of the data overrides what is assumed, but not a word in the same row
            ([Some(x), Some(y), Some(z)], _) if word.is_none() || assumed == Some(Assume::Measured) => {
                Some(Spin::Measured { spin: Vec3::new(x.value, y.value, z.value), sd: [x.sd, y.sd, z.sd] })
            }
            ([None, None, None], Some(Assume::Measured)) => {
                let message =
                    format!("the spin is said to be measured; expected a value in {}", columns.join(", "));
                problems.add(&table.path, Some(table.line(row)), Some(columns[0]), message);
                continue;
            }
            ([None, None, None] | [Some(_), Some(_), Some(_)], assumed) => {
                assumed.map(|assume| match assume {
                    Assume::Stun => Spin::Stun,
                    Assume::NaturalRoll => Spin::NaturalRoll,
                    Assume::Measured | Assume::Unknown => Spin::Unknown,
                })
            }
            _ => {
                let empty = components.iter().position(Option::is_none).unwrap_or(0);
                let message = "is empty; expected all three components of the spin or none";
                problems.add(&table.path, Some(table.line(row)), Some(columns[empty]), message);
                continue;
            }
        };
        match spin {
            Some(spin) => spins.push(spin),
            None if spins.is_empty() => {
                let message = format!(
                    "nothing says how the cue ball spins; expected [cue_spin] assume = \"stun\" or \
                     \"natural-roll\" (or \"unknown\"), or columns {}",
                    columns.join(", ")
                );
                problems.add(manifest, None, None, message);
                return spins;
            }
            None => {
                let message = "is empty, and dataset.toml has no [cue_spin]; expected a spin";
                problems.add(&table.path, Some(table.line(row)), Some("cue_spin"), message);
            }
        }
    }
    spins
}

/// Columns that are neither input nor observable, as text.
pub(super) fn labels(table: &Table, known: &[&str], row: usize) -> BTreeMap<String, String> {
    let is_known =
        |name: &str| known.contains(&name) || name.strip_suffix("_sd").is_some_and(|n| known.contains(&n));
    let label = |name: &&str| (name.to_string(), table.text(name, row).unwrap_or_default().to_string());
    table.names().iter().filter(|name| !is_known(name)).map(label).collect()
}

/// A `…_sd` column of a known column that is not there is a slip of the pen.
pub(super) fn check_lonely_sds(table: &Table, known: &[&str], problems: &mut Problems) {
    for name in table.names() {
        let Some(of) = name.strip_suffix("_sd") else { continue };
        if known.contains(&of) && !table.has(of) {
            problems.add(
                &table.path,
                None,
                Some(name),
                format!("there is no column {of} that it belongs to"),
            );
        }
    }
}
