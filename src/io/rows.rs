//! What the tables of both kinds share: values with standard deviations, spins, observables.

use std::collections::BTreeMap;
use std::path::Path;

use super::error::{did_you_mean, nearest, similarity};
use super::manifest::Assume;
use super::table::Table;
use crate::measurement::dataset::{Measured, Measurement};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::valid::{Fault, POSITIVE};
use crate::physics::ball::Vec3;

/// A column of numbers and the one of its standard deviations, in the file's units.
pub(crate) struct Column {
    values: Vec<Option<f64>>,
    sds: Option<Vec<Option<f64>>>,
    unit_si: f64,
}

impl Column {
    /// `None` if the column is not there. Checks that standard deviations are positive.
    pub(crate) fn read(table: &Table, name: &str, unit_si: f64) -> Option<Self> {
        let values = table.numbers(name)?;
        let sd_name = format!("{name}_sd");
        let sds = table.numbers(&sd_name);
        for (row, sd) in sds.iter().flatten().enumerate() {
            // also one that is lost when it becomes radians
            if sd.is_some_and(|sd| Fault::of_number(&sd_name, sd * unit_si, POSITIVE).is_some()) {
                let text = table.text(&sd_name, row).unwrap_or_default();
                let message = format!("{text} is no standard deviation; expected more than 0");
                table.wrong(row, sd_name.as_str(), message);
            }
        }
        Some(Self { values, sds, unit_si })
    }

    /// In SI units and radians.
    pub(crate) fn measured(&self, row: usize) -> Option<Measured> {
        let value = self.values[row]? * self.unit_si;
        let sd = self.sds.as_ref().and_then(|sds| sds[row]).map(|sd| sd * self.unit_si);
        Some(Measured { value, sd })
    }
}

/// The observables that a table has, and their columns.
pub(crate) struct Observables(Vec<(Observable, Column)>);

impl Observables {
    pub(crate) fn read(table: &Table, known: &[Observable]) -> Self {
        let mut found = Vec::new();
        for observable in known {
            let name = observable.column();
            let Some(column) = Column::read(table, name, observable.unit_si()) else { continue };
            if column.sds.is_some() {
                let sd_name = format!("{name}_sd");
                let mut full = (0..table.rows()).filter(|row| column.values[*row].is_some());
                let has_sd = |row: &usize| table.text(&sd_name, *row).is_some();
                let with = full.clone().find(has_sd);
                if let (Some(with), Some(without)) = (with, full.find(|row| !has_sd(row))) {
                    let message = format!(
                        "is empty, but line {} has one; give a standard deviation for every {name} or for none",
                        table.line(with)
                    );
                    table.wrong(without, sd_name.as_str(), message);
                }
            }
            found.push((*observable, column));
        }
        Self(found)
    }

    /// Complains if there is no column of them. `inputs` are the columns that mean something else.
    pub(crate) fn require(&self, table: &Table, known: &[Observable], inputs: &[&str]) {
        if !self.0.is_empty() {
            return;
        }
        let names: Vec<_> = known.iter().map(|observable| observable.column()).collect();
        let labels = table.names().filter(|name| !inputs.contains(name));
        let near = labels.filter_map(|name| Some((name, nearest(name, names.clone())?)));
        let nearest = near.max_by(|a, b| similarity(a.0, a.1).total_cmp(&similarity(b.0, b.1)));
        let hint =
            nearest.map_or(String::new(), |(name, near)| format!("; is \"{name}\" meant to be {near}?"));
        let message =
            format!("no column of anything observed; expected at least one of {}{hint}", names.join(", "));
        table.wrong_name(None, message);
    }

    /// What a row has; complains if that is nothing.
    pub(crate) fn row(&self, table: &Table, row: usize) -> Vec<Measurement> {
        let measurement = |(observable, column): &(Observable, Column)| {
            Some(Measurement { observable: *observable, measured: column.measured(row)? })
        };
        let found: Vec<_> = self.0.iter().filter_map(measurement).collect();
        let names: Vec<_> = self.0.iter().map(|(observable, _)| observable.column()).collect();
        if !names.is_empty() && names.iter().all(|name| table.text(name, row).is_none()) {
            let message = format!("nothing observed in this row; expected a value in {}", names.join(" or "));
            table.wrong(row, None, message);
        }
        found
    }
}

/// The spin of every row: a word column, three number columns, or what dataset.toml assumes. Rows are
/// left out if something is wrong with them.
pub(crate) fn spins(table: &Table, columns: [&str; 3], assume: Option<Assume>) -> Vec<Spin> {
    let present = columns.iter().filter(|column| table.has(column)).count();
    if (1..3).contains(&present) {
        for column in columns.iter().filter(|column| !table.has(column)) {
            let message =
                format!("is missing from the column names; expected all three of {}", columns.join(", "));
            table.wrong_name(*column, message);
        }
        return Vec::new();
    }
    let has_words = table.has("cue_spin");
    if present == 0 && !has_words && matches!(assume, None | Some(Assume::Measured)) {
        let said = if assume.is_none() {
            "nothing says how the cue ball spins; expected [cue_spin] assume = \"stun\", \"natural-roll\" or \
             \"unknown\" in dataset.toml, a column cue_spin, or"
                .to_string()
        } else {
            "[cue_spin] says that the spin is measured; expected".to_string()
        };
        let message = format!("{said} columns {}", columns.join(", "));
        table.wrong_name(None, message);
        return Vec::new();
    }
    let numbers = columns.map(|column| Column::read(table, column, 1.0));
    let spins = (0..table.rows()).filter_map(|row| {
        let components = numbers.each_ref().map(|c| c.as_ref().and_then(|column| column.measured(row)));
        let written = columns.map(|column| table.text(column, row).is_some());
        let wrong = |column: &str, message: String| {
            table.wrong(row, column, message);
            None
        };
        let word = table.text("cue_spin", row);
        let said = spin_word(table, row).ok()?;
        if let Some(empty) = written.iter().position(|w| !w).filter(|_| written.contains(&true)) {
            let message = "is empty; expected all three components of the spin or none".to_string();
            return wrong(columns[empty], message);
        }
        if written == [true; 3] {
            if let (Some(word), false) = (word, matches!(said, None | Some(Assume::Measured))) {
                let message =
                    format!("\"{word}\", but {} have values; expected only one", columns.join(", "));
                return wrong("cue_spin", message);
            }
            // a cell that is no number has been complained about
            return measured(components);
        }
        let Some(said) = said.or(assume) else {
            let message = "is empty, and dataset.toml has no [cue_spin]; expected a spin".to_string();
            return wrong(if has_words { "cue_spin" } else { columns[0] }, message);
        };
        said.spin().or_else(|| {
            let message =
                format!("the spin is said to be measured; expected values in {}", columns.join(", "));
            wrong(if word.is_some() { "cue_spin" } else { columns[0] }, message)
        })
    });
    spins.collect()
}

/// The spin of all three components.
pub(crate) fn measured(components: [Option<Measured>; 3]) -> Option<Spin> {
    let [Some(x), Some(y), Some(z)] = components else { return None };
    Some(Spin::Measured { spin: Vec3::new(x.value, y.value, z.value), sd: [x.sd, y.sd, z.sd] })
}

/// What the cell of a row says of the cue ball's spin; `Err` where that is no word for it, which is complained about.
pub(crate) fn spin_word(table: &Table, row: usize) -> Result<Option<Assume>, ()> {
    let Some(word) = table.text("cue_spin", row) else { return Ok(None) };
    Assume::of(word).map(Some).ok_or_else(|| {
        let names = Assume::ALL.map(Assume::name);
        let near = did_you_mean(word, names);
        table.wrong(row, "cue_spin", format!("\"{word}\" is no spin{near}; expected {}", names.join(", ")));
    })
}

/// Columns that are neither input nor observable, as text.
pub(crate) fn labels(table: &Table, known: &[&str], row: usize) -> BTreeMap<String, String> {
    let is_known =
        |name: &str| known.contains(&name) || name.strip_suffix("_sd").is_some_and(|n| known.contains(&n));
    let label = |name: &str| (name.to_string(), table.text(name, row).unwrap_or_default().to_string());
    table.names().filter(|name| !is_known(name)).map(label).collect()
}

/// Says which columns of a table are kept as labels.
pub(crate) fn labels_note<S: AsRef<str>>(path: &Path, labels: &[S]) -> Option<String> {
    let named: Vec<String> = labels.iter().map(|label| format!("\"{}\"", label.as_ref())).collect();
    let are = if named.len() == 1 { "column" } else { "columns" };
    (!named.is_empty()).then(|| {
        format!("{}: {are} kept as labels, not read as measurements: {}", path.display(), named.join(", "))
    })
}

/// Complains about columns that are no labels but slips of the pen: a `…_sd` of a known column that is not there, and names that are
/// nearly those of known columns.
pub(crate) fn check_names(table: &Table, known: &[&str]) {
    for name in table.names() {
        let plain = name.to_lowercase().replace([' ', '-'], "_");
        let of = plain.strip_suffix("_sd").filter(|of| known.contains(of));
        if name != plain && (known.contains(&plain.as_str()) || of.is_some()) && !table.has(&plain) {
            table.wrong_name(name, format!("is no known name; write {plain}"));
        } else if let Some(of) = of.filter(|of| !table.has(of)) {
            table.wrong_name(name, format!("there is no column {of} that it belongs to"));
        } else if let Some(meant) = near_miss(name, known, |name| table.has(name)) {
            let message = format!(
                "is no known name, but nearly {meant}; write {meant}, or give a label that is called so another name"
            );
            table.wrong_name(name, message);
        }
    }
}

/// What people write for standard deviation, behind the name of a column or before it.
const SPREADS: [&str; 13] = [
    "std",
    "sdev",
    "stdev",
    "stddev",
    "std_dev",
    "err",
    "error",
    "sigma",
    "unc",
    "uncertainty",
    "se",
    "stderr",
    "std_err",
];

/// Longer names may have one slip of the pen, and the longest two, and are not another word then.
const ONE_SLIP: usize = 5;
const TWO_SLIPS: usize = 9;

/// Returns the known name, or the `…_sd` of one, that a name is nearly, if the table has no such column: another word for standard
/// deviation, or one or two slips of the pen in a long name.
pub(crate) fn near_miss(name: &str, known: &[&str], has: impl Fn(&str) -> bool) -> Option<String> {
    let plain = name.to_lowercase().replace([' ', '-', '.'], "_");
    let is_known = |name: &str| known.contains(&name.strip_suffix("_sd").unwrap_or(name));
    if is_known(&plain) {
        return None;
    }
    let is_missing = |name: &String| !has(name);
    let spread_of = |name: &str| {
        let mut words = SPREADS.into_iter().chain(["sd"]);
        let bare = |word| {
            let rest = name.strip_suffix(word).or_else(|| name.strip_prefix(word))?;
            Some(rest.trim_matches('_')).filter(|rest| known.contains(rest))
        };
        words.find_map(bare).map(|of| format!("{of}_sd"))
    };
    let slips = |known: &str| {
        let most = [ONE_SLIP, TWO_SLIPS].iter().filter(|least| known.len() >= **least).count();
        let slips = strsim::damerau_levenshtein(&plain, known);
        (slips <= most).then_some(slips)
    };
    let all = known.iter().flat_map(|name| [(*name).to_owned(), format!("{name}_sd")]);
    let nearly = all.filter(is_missing).filter_map(|known| Some((slips(&known)?, known))).min();
    spread_of(&plain).filter(is_missing).or(nearly.map(|(_, known)| known))
}

#[cfg(test)]
mod tests {
    use super::near_miss;

    #[test]
    fn misspelt_columns_are_told_from_labels() {
        let known = ["shot", "nx", "ny", "cue_vx", "obj_vx_after", "throw_deg", "cue_spin", "note"];
        let near = |name: &str| near_miss(name, &known, |name| ["shot", "cue_vx"].contains(&name));
        for (name, meant) in [
            ("nx_err", "nx_sd"),
            ("obj_vx_after_std", "obj_vx_after_sd"),
            ("sigma_throw_deg", "throw_deg_sd"),
            ("nxsd", "nx_sd"),
            ("obj_vx_aftr", "obj_vx_after"),
            ("thow_deg_sd", "throw_deg_sd"),
            ("Cue-Spn", "cue_spin"),
        ] {
            assert_eq!(near(name).as_deref(), Some(meant), "{name}");
        }
        for label in [
            "cloth",
            "shots",
            "cue_v",
            "nz",
            "obj_vx",
            "notes",
            "treatment",
            "nx_sd",
            "nx",
            "throw",
            "n",
            "day",
        ] {
            assert_eq!(near(label), None, "{label}");
        }
    }
}
