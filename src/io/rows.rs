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
use crate::measurement::fault::{Condition, FINITE, Fault, POSITIVE};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::valid::is_unit;
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

/// A column of the state before the impact: its name, its SI unit, and its range in that unit.
type Column = (&'static str, f64, Condition);

/// The columns of a table of one kind of data.
struct Layout {
    before: &'static [Column],
    /// Columns that must exist and have no empty cells, with blanks between them.
    required: &'static str,
    spin: [&'static str; 3],
    observables: &'static [Observable],
}

const CUT: Condition = (|x| x.abs() < FRAC_PI_2, "degrees, more than -90 and less than 90");

const ANGLES: Layout = Layout {
    before: &[("cut_deg", 1.0_f64.to_radians(), CUT), ("speed_m_s", 1.0, POSITIVE)],
    required: "cut_deg",
    spin: ["omega_x", "omega_y", "omega_z"],
    observables: &Observable::ANGLES,
};

const IMPACTS: Layout = Layout {
    before: &[("nx", 1.0, FINITE), ("ny", 1.0, FINITE), ("cue_vx", 1.0, FINITE), ("cue_vy", 1.0, FINITE)],
    required: "shot nx ny cue_vx cue_vy cue_vx_after cue_vy_after obj_vx_after obj_vy_after",
    spin: ["cue_wx", "cue_wy", "cue_wz"],
    observables: &Observable::IMPACTS,
};

/// Returns the shots of a table, one a row, with the label of the column `by`; rows with problems are
/// left out.
pub(crate) fn shots(table: &Table, kind: Kind, assume: Option<Assume>, by: Option<&str>) -> Vec<Shot> {
    let layout = if kind == Kind::Impacts { IMPACTS } else { ANGLES };
    let mut known = vec!["shot", "cue_spin"];
    known.extend(layout.before.iter().map(|(name, ..)| *name));
    known.extend(layout.spin);
    known.extend(layout.observables.iter().map(|observable| observable.column()));
    check_names(table, &known);
    for column in layout.required.split(' ') {
        table.require(column, &known);
    }
    let inputs: Vec<Option<Values>> = layout.before.iter().map(|column| in_range(table, *column)).collect();
    let observed = observed(table, layout.observables);
    if observed.is_empty() && kind == Kind::Angles {
        require_observable(table, &known);
    }
    let spins = spins(table, layout.spin, assume);
    let mut shots = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let inputs: Vec<Option<Measured>> =
            inputs.iter().map(|values| values.as_ref().and_then(|values| values[row])).collect();
        let before = match *inputs {
            [cut, speed] => cut.map(|cut| Before::Angle { cut, speed }),
            [Some(nx), Some(ny), Some(vx), Some(vy)] => Some(impact(table, row, [nx, ny], [vx, vy])),
            _ => None,
        };
        let after = observed.iter().filter_map(|(observable, values)| {
            Some(Measurement { observable: *observable, measured: values[row]? })
        });
        let after: Vec<Measurement> = after.collect();
        let names: Vec<_> = observed.iter().map(|(observable, _)| observable.column()).collect();
        if !names.is_empty() && names.iter().all(|name| table.is_gap(name, row)) {
            let message =
                format!("no observed value in this row; expected a value in {}", names.join(" or "));
            table.wrong(row, None, message);
        }
        let spin = spins.get(row).copied().flatten();
        let (Some(before), Some(spin)) = (before, spin) else { continue };
        let mut labels = labels(table, &known, row);
        labels.extend(by.map(|by| (by.to_owned(), table.text(by, row).unwrap_or_default().to_owned())));
        let name = table.text("shot", row).unwrap_or_default();
        let (file, line) = (table.path.clone(), table.line(row));
        shots.push(Shot { file, line, labels, ..Shot::new(name, before, spin, after) });
    }
    shots
}

/// Returns a column; complains about values that are out of its range.
fn in_range(table: &Table, (name, unit_si, range): Column) -> Option<Values> {
    let values = values(table, name, unit_si)?;
    for (row, value) in values.iter().enumerate() {
        let fault = value.and_then(|value| Fault::of_number(name, value.value, range));
        if let Some(Fault { expected, .. }) = fault {
            let text = table.text(name, row).unwrap_or_default();
            table.wrong(row, name, format!("{text} is out of range; expected {expected}"));
        }
    }
    Some(values)
}

/// Returns the line of centres and the velocity of a row.
fn impact(table: &Table, row: usize, [nx, ny]: [Measured; 2], velocity: [Measured; 2]) -> Before {
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
    } else if nx.value * velocity[0].value + ny.value * velocity[1].value <= 0.0 {
        let message = format!(
            "the cue ball's velocity {} takes it away from the object ball; expected one that approaches \
             along the line of centres (nx, ny) = {}, which points from cue ball to object ball",
            written(["cue_vx", "cue_vy"]),
            written(["nx", "ny"])
        );
        table.wrong(row, "cue_vx", message);
    }
    let normal = [nx, ny].map(|n| Measured { value: n.value / length, sd: n.sd });
    Before::Impact { normal, velocity }
}

/// Returns the observables that a table has, with their values; standard deviations are given for every
/// value of a column or for none.
fn observed(table: &Table, known: &[Observable]) -> Vec<(Observable, Values)> {
    let mut found = Vec::new();
    for observable in known {
        let name = observable.column();
        let Some(values) = values(table, name, observable.unit_si()) else { continue };
        let sd_name = format!("{name}_sd");
        let full = (0..table.rows()).filter(|row| values[*row].is_some());
        let (with, without): (Vec<_>, Vec<_>) = full.partition(|row| !table.is_gap(&sd_name, *row));
        if let (Some(with), Some(without)) = (with.first(), without.first()) {
            let message = format!(
                "is empty, but line {} has one; give a standard deviation for every {name} or for none",
                table.line(*with)
            );
            table.wrong(*without, sd_name.as_str(), message);
        }
        found.push((*observable, values));
    }
    found
}

/// Complains that no column of a table of angles is observed; `known` are the columns with a meaning.
fn require_observable(table: &Table, known: &[&str]) {
    let names = Observable::ANGLES.map(Observable::column);
    let labels = table.names().filter(|name| !known.contains(name));
    let near = labels.filter_map(|name| Some((name, nearest(name, names)?)));
    let nearest = near.max_by(|a, b| similarity(a.0, a.1).total_cmp(&similarity(b.0, b.1)));
    let hint = nearest.map_or(String::new(), |(name, near)| format!("; is \"{name}\" meant to be {near}?"));
    let message =
        format!("no column of anything observed; expected at least one of {}{hint}", names.join(", "));
    table.wrong_name(None, message);
}

/// Returns the spin of every row: a word, three numbers, or the assumption of dataset.toml; `None`
/// for rows with problems, an empty list if the columns are wrong.
fn spins(table: &Table, columns: [&str; 3], assume: Option<Assume>) -> Vec<Option<Spin>> {
    let all = columns.join(", ");
    let missing: Vec<&str> = columns.into_iter().filter(|column| !table.has(column)).collect();
    let has_words = table.has("cue_spin");
    if missing.len() == 3 && !has_words && matches!(assume, None | Some(Assume::Measured)) {
        let said = if assume.is_none() {
            "the cue ball's spin is not stated; expected [cue_spin] assume = \"stun\", \"natural-roll\" or \
             \"unknown\" in dataset.toml, a column cue_spin, or"
        } else {
            "[cue_spin] says that the spin is measured; expected"
        };
        table.wrong_name(None, format!("{said} columns {all}"));
        return Vec::new();
    }
    if (1..3).contains(&missing.len()) {
        for column in missing {
            let message = format!("is missing from the column names; expected all three of {all}");
            table.wrong_name(column, message);
        }
        return Vec::new();
    }
    let numbers = columns.map(|column| values(table, column, 1.0));
    let spin = |row: usize| {
        let components = numbers.each_ref().map(|values| values.as_ref().and_then(|values| values[row]));
        let empty = columns.iter().filter(|column| table.is_gap(column, row));
        let empty: Vec<&&str> = empty.collect();
        let word = spin_word(table, row).ok()?;
        let column = if has_words { "cue_spin" } else { columns[0] };
        let (column, message) = match (empty.len(), word, word.or(assume)) {
            (0, None | Some(Assume::Measured), _) => return measured(components),
            (0, Some(word), _) => {
                (column, format!("\"{}\", but {all} have values; expected only one", word.name()))
            }
            (3, _, Some(said)) => match said.spin() {
                Some(spin) => return Some(spin),
                None => (column, format!("the spin is said to be measured; expected values in {all}")),
            },
            (3, _, None) => {
                (column, "is empty, and dataset.toml has no [cue_spin]; expected a spin".to_string())
            }
            _ => (*empty[0], EMPTY_COMPONENT.to_string()),
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
