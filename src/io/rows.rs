//! Tables of measured shots, one a row: values, standard deviations, spins, observables, labels.
//!
//! (n_x, n_y) is a unit vector, which can err only across itself: an error σ of its direction (rad)
//! gives its components the standard deviations `nx_sd` = σ|n_y| and `ny_sd` = σ|n_x|, whose
//! squares add up to σ² again.

use std::collections::{BTreeMap, HashMap};
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

/// A column of numbers: its name, its SI unit, and its range in that unit.
pub(crate) type Column = (&'static str, f64, Condition);

/// The numbers of a table by column and row with their standard deviations, SI and radians.
pub(crate) struct Numbers(HashMap<&'static str, Vec<Option<Measured>>>);

impl Numbers {
    /// Reads the columns that the table has. Complains about values that are out of range, and
    /// standard deviations that are not positive.
    pub(crate) fn read(table: &Table, columns: impl IntoIterator<Item = Column>) -> Self {
        let measured = |(name, unit_si, range): Column| {
            let sd_name = format!("{name}_sd");
            let [numbers, sds] = [(name, range), (&sd_name, POSITIVE)].map(|(column, condition)| {
                // a standard deviation may become 0 in radians
                let in_si = |number: Option<f64>| number.map(|number| number * unit_si);
                let numbers: Vec<_> = table.numbers(column)?.into_iter().map(in_si).collect();
                for (row, number) in numbers.iter().enumerate() {
                    if number.is_some_and(|number| Fault::of_number(column, number, condition).is_some()) {
                        let text = table.text(column, row).unwrap_or_default();
                        let is = if column == name { "out of range" } else { "not a standard deviation" };
                        table.wrong(row, column, format!("{text} is {is}; expected {}", condition.1));
                    }
                }
                Some(numbers)
            });
            let sd = |row: usize| sds.as_ref().and_then(|sds| sds[row]);
            let rows = numbers?.into_iter().enumerate();
            Some((name, rows.map(|(row, value)| Some(Measured { value: value?, sd: sd(row) })).collect()))
        };
        Self(columns.into_iter().filter_map(measured).collect())
    }

    pub(crate) fn at(&self, column: &str, row: usize) -> Option<Measured> {
        self.0.get(column)?[row]
    }
}

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
    spin: OMEGA,
    observables: &Observable::ANGLES,
};

const IMPACTS: Layout = Layout {
    before: &[("nx", 1.0, FINITE), ("ny", 1.0, FINITE), ("cue_vx", 1.0, FINITE), ("cue_vy", 1.0, FINITE)],
    required: "shot nx ny cue_vx cue_vy cue_vx_after cue_vy_after obj_vx_after obj_vy_after",
    spin: ["cue_wx", "cue_wy", "cue_wz"],
    observables: &Observable::IMPACTS,
};

/// Returns the shots of a table, one a row, with the label of the column `by`; rows with problems
/// are left out.
pub(crate) fn shots(table: &Table, kind: Kind, assume: Option<Assume>, by: Option<&str>) -> Vec<Shot> {
    let layout = if kind == Kind::Impacts { IMPACTS } else { ANGLES };
    let observed = layout.observables.iter().map(|one| (one.column(), one.unit_si(), FINITE));
    let columns: Vec<Column> = layout.before.iter().copied().chain(observed).collect();
    let names = columns.iter().map(|(name, ..)| *name).chain(layout.spin);
    let known: Vec<&str> = ["shot", "cue_spin"].into_iter().chain(names).collect();
    check_names(table, &known, layout.required);
    let numbers = Numbers::read(table, columns);
    let observables: Vec<Observable> =
        layout.observables.iter().copied().filter(|one| table.has(one.column())).collect();
    check_observed(table, &numbers, &observables, &known);
    let spins = spins(table, layout.spin, assume);
    let mut shots = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let at = |column: &str| numbers.at(column, row);
        let before = match kind {
            Kind::Impacts => {
                let line = at("nx").zip(at("ny"));
                let line = line.zip(at("cue_vx").zip(at("cue_vy")));
                line.map(|((nx, ny), (vx, vy))| impact(table, row, [nx, ny], [vx, vy]))
            }
            _ => at("cut_deg").map(|cut| Before::Angle { cut, speed: at("speed_m_s") }),
        };
        let (Some(before), Some(spin)) = (before, spins.get(row).copied().flatten()) else { continue };
        let after = observables.iter().filter_map(|observable| {
            Some(Measurement { observable: *observable, measured: at(observable.column())? })
        });
        let mut labels = labels(table, &known, row);
        labels.extend(by.map(|by| (by.to_owned(), table.text(by, row).unwrap_or_default().to_owned())));
        let name = table.text("shot", row).unwrap_or_default();
        let (file, line) = (table.path.clone(), table.line(row));
        shots.push(Shot { file, line, labels, ..Shot::new(name, before, spin, after.collect()) });
    }
    shots
}

/// Returns the line of centres and the velocity of a row.
fn impact(table: &Table, row: usize, [nx, ny]: [Measured; 2], velocity: [Measured; 2]) -> Before {
    let length = nx.value.hypot(ny.value);
    let written = |columns: [&str; 2]| {
        let [x, y] = columns.map(|column| table.text(column, row).unwrap_or_default());
        format!("({x}, {y})")
    };
    let line = written(["nx", "ny"]);
    if !is_unit(nx.value, ny.value) {
        let message = format!(
            "the line of centres (nx, ny) = {line} has the length {length:?}; expected a unit vector"
        );
        table.wrong(row, "nx", message);
    } else if nx.value * velocity[0].value + ny.value * velocity[1].value <= 0.0 {
        let message = format!(
            "the cue ball's velocity {} takes it away from the object ball; expected one that approaches \
             along the line of centres (nx, ny) = {line}, which points from cue ball to object ball",
            written(["cue_vx", "cue_vy"]),
        );
        table.wrong(row, "cue_vx", message);
    }
    let normal = [nx, ny].map(|n| Measured { value: n.value / length, sd: n.sd });
    Before::Impact { normal, velocity }
}

/// Complains about a table or a row without an observed value, and about standard deviations that
/// are given for some values of a column only.
fn check_observed(table: &Table, numbers: &Numbers, observables: &[Observable], known: &[&str]) {
    let columns: Vec<&str> = observables.iter().map(|observable| observable.column()).collect();
    if columns.is_empty() {
        let names = known.iter().copied().filter(|name| name.parse::<Observable>().is_ok());
        let labels = table.names().filter(|name| !known.contains(name));
        let near = labels.filter_map(|name| Some((name, nearest(name, names.clone())?)));
        let near = near.max_by(|a, b| similarity(a.0, a.1).total_cmp(&similarity(b.0, b.1)));
        let hint = near.map_or(String::new(), |(name, near)| format!("; is \"{name}\" meant to be {near}?"));
        let expected = names.collect::<Vec<&str>>().join(", ");
        let message = format!("no column of anything observed; expected at least one of {expected}{hint}");
        return table.wrong_name(None, message);
    }
    for name in &columns {
        let sd_name = format!("{name}_sd");
        let has_sd = |row: &usize| !table.is_gap(&sd_name, *row);
        let mut full = (0..table.rows()).filter(|row| numbers.at(name, *row).is_some());
        if let (Some(with), Some(without)) = (full.clone().find(has_sd), full.find(|row| !has_sd(row))) {
            let line = table.line(with);
            let message = format!(
                "is empty, but line {line} has one; give a standard deviation for every {name} or for none"
            );
            table.wrong(without, sd_name.as_str(), message);
        }
    }
    for row in (0..table.rows()).filter(|row| columns.iter().all(|name| table.is_gap(name, *row))) {
        let expected = columns.join(" or ");
        table.wrong(row, None, format!("no observed value in this row; expected a value in {expected}"));
    }
}

/// Columns of a measured spin, rad/s.
pub(crate) const OMEGA: [&str; 3] = ["omega_x", "omega_y", "omega_z"];

/// Statement of a row, or else of dataset.toml, about the cue ball's spin.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum StatedSpin {
    Is(Spin),
    /// The spin is said to be measured, but the row has no numbers.
    Measured,
    Unstated,
}

impl StatedSpin {
    pub(crate) fn of(assume: Option<Assume>) -> Self {
        assume.map_or(Self::Unstated, |assume| assume.spin().map_or(Self::Measured, Self::Is))
    }
}

/// Returns the spin of every row: a word, three numbers, or the assumption of dataset.toml; `None`
/// for rows with problems, an empty list if the columns are wrong.
fn spins(table: &Table, columns: [&'static str; 3], assume: Option<Assume>) -> Vec<Option<Spin>> {
    let all = columns.join(", ");
    let has_words = table.has("cue_spin");
    let missing = match StatedSpin::of(assume) {
        _ if has_words || columns.into_iter().any(|column| table.has(column)) => None,
        StatedSpin::Is(_) => None,
        StatedSpin::Measured => Some("[cue_spin] says that the spin is measured; expected"),
        StatedSpin::Unstated => Some(
            "the cue ball's spin is not stated; expected [cue_spin] assume = \"stun\", \"natural-roll\" or \
             \"unknown\" in dataset.toml, a column cue_spin, or",
        ),
    };
    if let Some(missing) = missing {
        table.wrong_name(None, format!("{missing} columns {all}"));
        return Vec::new();
    }
    let column = if has_words { "cue_spin" } else { columns[0] };
    let spin = |(row, stated): (usize, Option<StatedSpin>)| {
        let message = match stated? {
            StatedSpin::Is(spin) => return Some(spin),
            StatedSpin::Measured => format!("the spin is said to be measured; expected values in {all}"),
            StatedSpin::Unstated => "is empty, and dataset.toml has no [cue_spin]; expected a spin".into(),
        };
        table.wrong(row, column, message);
        None
    };
    stated_spins(table, columns, assume).into_iter().enumerate().map(spin).collect()
}

/// Returns the statement of each row, `None` for a wrong one; an empty list if some of the columns
/// are missing.
pub(crate) fn stated_spins(
    table: &Table,
    columns: [&'static str; 3],
    assume: Option<Assume>,
) -> Vec<Option<StatedSpin>> {
    let all = columns.join(", ");
    let missing: Vec<&str> = columns.into_iter().filter(|column| !table.has(column)).collect();
    if (1..3).contains(&missing.len()) {
        for column in missing {
            let message = format!("is missing from the column names; expected all three of {all}");
            table.wrong_name(column, message);
        }
        return Vec::new();
    }
    let numbers = Numbers::read(table, columns.map(|column| (column, 1.0, FINITE)));
    let stated = |row: usize| {
        let word = table.text("cue_spin", row);
        let known =
            word.and_then(|word| Assume::ALL.into_iter().find(|one| one.name().eq_ignore_ascii_case(word)));
        let empty: Vec<&str> = columns.into_iter().filter(|column| table.is_gap(column, row)).collect();
        let (column, message) = match (empty.len(), word, known) {
            (_, Some(word), None) => {
                let names = Assume::ALL.map(Assume::name);
                let near = did_you_mean(word, names);
                ("cue_spin", format!("\"{word}\" is not a spin{near}; expected {}", names.join(", ")))
            }
            (0, _, None | Some(Assume::Measured)) => {
                let [Some(x), Some(y), Some(z)] = columns.map(|column| numbers.at(column, row)) else {
                    return None;
                };
                let spin = Vec3::new(x.value, y.value, z.value);
                return Some(StatedSpin::Is(Spin::Measured { spin, sd: [x.sd, y.sd, z.sd] }));
            }
            (3, ..) => return Some(StatedSpin::of(known.or(assume))),
            (0, _, Some(word)) => {
                ("cue_spin", format!("\"{}\", but {all} have values; expected only one", word.name()))
            }
            _ => (empty[0], "is empty; expected all three components of the spin or none".to_string()),
        };
        table.wrong(row, column, message);
        None
    };
    (0..table.rows()).map(stated).collect()
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

/// Complains about required columns that are missing or have gaps, about a `…_sd` of a known column
/// that is missing, and about names similar to those of known columns.
pub(crate) fn check_names(table: &Table, known: &[&str], required: &str) {
    for name in table.names() {
        let of = name.strip_suffix("_sd").filter(|of| known.contains(of) && !table.has(of));
        if let Some(of) = of {
            table.wrong_name(name, format!("there is no column {of} that it belongs to"));
        } else if let Some(meant) = near_miss(name, known, |name| table.has(name)) {
            let message = format!(
                "is not a known name, but nearly {meant}; write {meant}, or give a label that is called so another name"
            );
            table.wrong_name(name, message);
        }
    }
    for column in required.split(' ') {
        if !table.has(column) {
            let near = nearest(column, table.names().filter(|name| !known.contains(name)));
            let near = near.map_or(String::new(), |name| format!("; is \"{name}\" meant to be it?"));
            table.wrong_name(column, format!("is missing from the column names{near}"));
            continue;
        }
        for row in (0..table.rows()).filter(|row| table.is_gap(column, *row)) {
            table.wrong(row, column, "is empty; expected a value");
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
    if known.contains(&name.strip_suffix("_sd").unwrap_or(name)) {
        return None;
    }
    let plain = name.to_lowercase().replace([' ', '-', '.'], "_");
    let bare = |word: &str| {
        let rest = plain.strip_suffix(word).or_else(|| plain.strip_prefix(word))?;
        Some(rest.trim_matches('_')).filter(|rest| known.contains(rest))
    };
    let spread_of = SPREADS.split(' ').find_map(bare).map(|of| format!("{of}_sd"));
    let names = known.iter().flat_map(|name| [(*name).to_owned(), format!("{name}_sd")]);
    let slips = |known: String| {
        let most = usize::from(known.len() >= ONE_SLIP) + usize::from(known.len() >= TWO_SLIPS);
        let slips = strsim::damerau_levenshtein(&plain, &known);
        (slips <= most && !has(&known)).then_some((slips, known))
    };
    let nearly = names.filter_map(slips).min().map(|(_, known)| known);
    spread_of.filter(|name| !has(name)).or(nearly)
}
