//! Tables of measured shots, one a row: values, standard deviations, spins, observables, labels.
//!
//! (n_x, n_y) is a unit vector, which can err only across itself: an error σ of its direction (rad)
//! gives its components the standard deviations `nx_sd` = σ|n_y| and `ny_sd` = σ|n_x|, whose
//! squares add up to σ² again.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use super::error::{did_you_mean, nearest, similarity};
use super::manifest::{Assume, Kind};
use super::table::Table;
use crate::measurement::dataset::{Before, Measured, Measurement, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::valid::{Fault, POSITIVE, is_unit};
use crate::physics::ball::Vec3;

/// Values of a column with standard deviations, SI and radians; `None` for empty and wrong cells.
pub(crate) type Values = Vec<Option<Measured>>;

/// Returns a column with its standard deviations, which must be positive; `None` if it is missing.
pub(crate) fn values(table: &Table, name: &str, unit_si: f64) -> Option<Values> {
    let values = table.numbers(name)?;
    let sd_name = format!("{name}_sd");
    let sds = table.numbers(&sd_name).unwrap_or_else(|| vec![None; values.len()]);
    for (row, sd) in sds.iter().enumerate() {
        // also if it becomes 0 in radians
        if sd.is_some_and(|sd| Fault::of_number(&sd_name, sd * unit_si, POSITIVE).is_some()) {
            let text = table.text(&sd_name, row).unwrap_or_default();
            let message = format!("{text} is not a standard deviation; expected more than 0");
            table.wrong(row, sd_name.as_str(), message);
        }
    }
    let measured = |(value, sd): (Option<f64>, Option<f64>)| {
        Some(Measured { value: value? * unit_si, sd: sd.map(|sd| sd * unit_si) })
    };
    Some(values.into_iter().zip(sds).map(measured).collect())
}

/// The columns of a table of one kind of data.
struct Layout {
    /// Columns of the state before the impact, with their SI units.
    before: &'static [(&'static str, f64)],
    /// Columns that must exist and have no empty cells.
    required: &'static [&'static str],
    spin: [&'static str; 3],
    observables: &'static [Observable],
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

const ANGLES: Layout = Layout {
    before: &[("cut_deg", DEGREE), ("speed_m_s", 1.0)],
    required: &["cut_deg"],
    spin: ["omega_x", "omega_y", "omega_z"],
    observables: &Observable::ANGLES,
};

const IMPACTS: Layout = Layout {
    before: &[("nx", 1.0), ("ny", 1.0), ("cue_vx", 1.0), ("cue_vy", 1.0)],
    required: &[
        "shot",
        "nx",
        "ny",
        "cue_vx",
        "cue_vy",
        "cue_vx_after",
        "cue_vy_after",
        "obj_vx_after",
        "obj_vy_after",
    ],
    spin: ["cue_wx", "cue_wy", "cue_wz"],
    observables: &Observable::IMPACTS,
};

/// Returns the shots of a table, one a row; rows with problems are left out.
pub(crate) fn shots(table: &Table, kind: Kind, assume: Option<Assume>) -> Vec<Shot> {
    let is_impacts = kind == Kind::Impacts;
    let layout = if is_impacts { IMPACTS } else { ANGLES };
    let mut known = vec!["shot", "cue_spin"];
    known.extend(layout.before.iter().map(|(name, _)| *name));
    known.extend(layout.spin);
    known.extend(layout.observables.iter().map(|observable| observable.column()));
    check_names(table, &known);
    for column in layout.required {
        table.require(column, &known);
    }
    let inputs: Vec<Option<Values>> =
        layout.before.iter().map(|(name, unit_si)| values(table, name, *unit_si)).collect();
    let observables = Observables::read(table, layout.observables);
    if !is_impacts {
        observables.require(table, layout.observables, &known);
    }
    let spins = spins(table, layout.spin, assume);
    let mut shots = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let inputs: Vec<Option<Measured>> =
            inputs.iter().map(|values| values.as_ref().and_then(|values| values[row])).collect();
        let before = if is_impacts { impact(table, row, &inputs) } else { angle(table, row, &inputs) };
        let after = observables.row(table, row);
        let spin = spins.get(row).copied().flatten();
        let (Some(before), Some(spin)) = (before, spin) else { continue };
        let name = table.text("shot", row).unwrap_or_default();
        shots.push(Shot {
            file: table.path.clone(),
            line: table.line(row),
            labels: labels(table, &known, row),
            ..Shot::new(name, before, spin, after)
        });
    }
    shots
}

/// Returns the cut angle of a row, and the speed if it is stated.
fn angle(table: &Table, row: usize, inputs: &[Option<Measured>]) -> Option<Before> {
    let [cut, speed] = *inputs else { return None };
    let wrong = |column: &str, message: &str| {
        table.wrong(row, column, format!("{} {message}", table.text(column, row).unwrap_or_default()));
    };
    if cut.is_some_and(|cut| cut.value.abs() >= FRAC_PI_2) {
        wrong("cut_deg", "is not a cut angle; expected degrees, more than -90 and less than 90");
    }
    if speed.is_some_and(|speed| speed.value <= 0.0) {
        wrong("speed_m_s", "is not a speed; expected more than 0");
    }
    Some(Before::Angle { cut: cut?, speed })
}

/// Returns the line of centres and the velocity of a row.
fn impact(table: &Table, row: usize, inputs: &[Option<Measured>]) -> Option<Before> {
    let [Some(nx), Some(ny), Some(vx), Some(vy)] = *inputs else { return None };
    let length = nx.value.hypot(ny.value);
    let written = |columns: [&str; 2]| {
        let [x, y] = columns.map(|column| table.text(column, row).unwrap_or_default());
        format!("({x}, {y})")
    };
    if !is_unit(nx.value, ny.value) {
        let message = format!(
            "the line of centres (nx, ny) = {} has the length {length:?}; expected a unit vector",
            written(["nx", "ny"])
        );
        table.wrong(row, "nx", message);
    } else if nx.value * vx.value + ny.value * vy.value <= 0.0 {
        let message = format!(
            "the cue ball's velocity {} takes it away from the object ball; expected one that approaches \
             along the line of centres (nx, ny) = {}, which points from cue ball to object ball",
            written(["cue_vx", "cue_vy"]),
            written(["nx", "ny"])
        );
        table.wrong(row, "cue_vx", message);
    }
    let unit = |n: Measured| Measured { value: n.value / length, sd: n.sd };
    Some(Before::Impact { normal: [unit(nx), unit(ny)], velocity: [vx, vy] })
}

/// The observables of a table, and their columns.
struct Observables(Vec<(Observable, Values)>);

impl Observables {
    fn read(table: &Table, known: &[Observable]) -> Self {
        let mut found = Vec::new();
        for observable in known {
            let name = observable.column();
            let Some(values) = values(table, name, observable.unit_si()) else { continue };
            let sd_name = format!("{name}_sd");
            let mut full = (0..table.rows()).filter(|row| values[*row].is_some());
            let has_sd = |row: &usize| table.text(&sd_name, *row).is_some();
            let with = full.clone().find(has_sd);
            if let (Some(with), Some(without)) = (with, full.find(|row| !has_sd(row))) {
                let message = format!(
                    "is empty, but line {} has one; give a standard deviation for every {name} or for none",
                    table.line(with)
                );
                table.wrong(without, sd_name.as_str(), message);
            }
            found.push((*observable, values));
        }
        Self(found)
    }

    /// Complains if the table has no observable. `inputs` are the columns of the state before.
    fn require(&self, table: &Table, known: &[Observable], inputs: &[&str]) {
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

    /// Returns the observations of a row; complains if they are missing.
    fn row(&self, table: &Table, row: usize) -> Vec<Measurement> {
        let measurement = |(observable, values): &(Observable, Values)| {
            Some(Measurement { observable: *observable, measured: values[row]? })
        };
        let names: Vec<_> = self.0.iter().map(|(observable, _)| observable.column()).collect();
        if !names.is_empty() && names.iter().all(|name| table.text(name, row).is_none()) {
            let message =
                format!("no observed value in this row; expected a value in {}", names.join(" or "));
            table.wrong(row, None, message);
        }
        self.0.iter().filter_map(measurement).collect()
    }
}

/// Returns the spin of every row: a word, three numbers, or the assumption of dataset.toml; `None`
/// for rows with problems, an empty list if the columns are wrong.
fn spins(table: &Table, columns: [&str; 3], assume: Option<Assume>) -> Vec<Option<Spin>> {
    let all = columns.join(", ");
    let present = columns.iter().filter(|column| table.has(column)).count();
    if (1..3).contains(&present) {
        for column in columns.iter().filter(|column| !table.has(column)) {
            let message = format!("is missing from the column names; expected all three of {all}");
            table.wrong_name(*column, message);
        }
        return Vec::new();
    }
    let has_words = table.has("cue_spin");
    if present == 0 && !has_words && matches!(assume, None | Some(Assume::Measured)) {
        let said = if assume.is_none() {
            "the cue ball's spin is not stated; expected [cue_spin] assume = \"stun\", \"natural-roll\" or \
             \"unknown\" in dataset.toml, a column cue_spin, or"
        } else {
            "[cue_spin] says that the spin is measured; expected"
        };
        table.wrong_name(None, format!("{said} columns {all}"));
        return Vec::new();
    }
    let numbers = columns.map(|column| values(table, column, 1.0));
    let spin = |row: usize| {
        let components = numbers.each_ref().map(|values| values.as_ref().and_then(|values| values[row]));
        let written = columns.map(|column| table.text(column, row).is_some());
        let word = table.text("cue_spin", row);
        let said = spin_word(table, row).ok()?;
        let of_word = if word.is_some() { "cue_spin" } else { columns[0] };
        let (column, message) = match (written, said, said.or(assume)) {
            ([true, true, true], None | Some(Assume::Measured), _) => return measured(components),
            ([true, true, true], ..) => {
                let word = word.unwrap_or_default();
                ("cue_spin", format!("\"{word}\", but {all} have values; expected only one"))
            }
            ([false, false, false], _, Some(said)) => match said.spin() {
                Some(spin) => return Some(spin),
                None => (of_word, format!("the spin is said to be measured; expected values in {all}")),
            },
            ([false, false, false], _, None) => {
                let column = if has_words { "cue_spin" } else { columns[0] };
                (column, "is empty, and dataset.toml has no [cue_spin]; expected a spin".to_string())
            }
            _ => {
                let empty = written.iter().position(|written| !written).unwrap_or(0);
                (columns[empty], EMPTY_COMPONENT.to_string())
            }
        };
        table.wrong(row, column, message);
        None
    };
    (0..table.rows()).map(spin).collect()
}

pub(crate) const EMPTY_COMPONENT: &str = "is empty; expected all three components of the spin or none";

pub(crate) fn measured(components: [Option<Measured>; 3]) -> Option<Spin> {
    let [Some(x), Some(y), Some(z)] = components else { return None };
    Some(Spin::Measured { spin: Vec3::new(x.value, y.value, z.value), sd: [x.sd, y.sd, z.sd] })
}

/// Returns the statement of a row about the cue ball's spin; reports an unknown word (`Err`).
pub(crate) fn spin_word(table: &Table, row: usize) -> Result<Option<Assume>, ()> {
    let Some(word) = table.text("cue_spin", row) else { return Ok(None) };
    Assume::of(word).map(Some).ok_or_else(|| {
        let names = Assume::ALL.map(Assume::name);
        let near = did_you_mean(word, names);
        table.wrong(
            row,
            "cue_spin",
            format!("\"{word}\" is not a spin{near}; expected {}", names.join(", ")),
        );
    })
}

/// Returns the columns that are not inputs or observables, as text.
pub(crate) fn labels(table: &Table, known: &[&str], row: usize) -> BTreeMap<String, String> {
    let is_label = |name: &&str| !known.contains(&name.strip_suffix("_sd").unwrap_or(name));
    let label = |name: &str| (name.to_string(), table.text(name, row).unwrap_or_default().to_string());
    table.names().filter(is_label).map(label).collect()
}

/// Notes which columns of a table are kept as labels.
pub(crate) fn labels_note<S: AsRef<str>>(path: &Path, labels: &[S]) -> Option<String> {
    let named: Vec<String> = labels.iter().map(|label| format!("\"{}\"", label.as_ref())).collect();
    let are = if named.len() == 1 { "column" } else { "columns" };
    (!named.is_empty()).then(|| {
        format!("{}: {are} kept as labels, not read as measurements: {}", path.display(), named.join(", "))
    })
}

/// Complains about columns that are slips of the pen instead of labels: a `…_sd` of a known column
/// that is missing, and names similar to those of known columns.
pub(crate) fn check_names(table: &Table, known: &[&str]) {
    for name in table.names() {
        let plain = name.to_lowercase().replace([' ', '-'], "_");
        let of = plain.strip_suffix("_sd").filter(|of| known.contains(of));
        if name != plain && (known.contains(&plain.as_str()) || of.is_some()) && !table.has(&plain) {
            table.wrong_name(name, format!("is not a known name; write {plain}"));
        } else if let Some(of) = of.filter(|of| !table.has(of)) {
            table.wrong_name(name, format!("there is no column {of} that it belongs to"));
        } else if let Some(meant) = near_miss(name, known, |name| table.has(name)) {
            let message = format!(
                "is not a known name, but nearly {meant}; write {meant}, or give a label that is called so another name"
            );
            table.wrong_name(name, message);
        }
    }
}

/// Words for standard deviation, after or before the name of a column.
const SPREADS: &str = "std sdev stdev stddev std_dev err error sigma unc uncertainty se stderr std_err sd";

/// Least lengths of a name with one slip of the pen, and with two.
const ONE_SLIP: usize = 5;
const TWO_SLIPS: usize = 9;

/// Returns the known name, or the `…_sd` of one, that a name resembles, if the table has no such
/// column: by another word for standard deviation, or one or two slips of the pen in a long name.
pub(crate) fn near_miss(name: &str, known: &[&str], has: impl Fn(&str) -> bool) -> Option<String> {
    let plain = name.to_lowercase().replace([' ', '-', '.'], "_");
    if known.contains(&plain.strip_suffix("_sd").unwrap_or(&plain)) {
        return None;
    }
    let bare = |word: &str| {
        let rest = plain.strip_suffix(word).or_else(|| plain.strip_prefix(word))?;
        Some(rest.trim_matches('_')).filter(|rest| known.contains(rest))
    };
    let spread_of = SPREADS.split(' ').find_map(bare).map(|of| format!("{of}_sd"));
    let slips = |known: &str| {
        let most = usize::from(known.len() >= ONE_SLIP) + usize::from(known.len() >= TWO_SLIPS);
        let slips = strsim::damerau_levenshtein(&plain, known);
        (slips <= most).then_some(slips)
    };
    let all = known.iter().flat_map(|name| [(*name).to_owned(), format!("{name}_sd")]);
    let nearly = all.filter(|name| !has(name)).filter_map(|known| Some((slips(&known)?, known))).min();
    spread_of.filter(|name| !has(name)).or(nearly.map(|(_, known)| known))
}
