//! Tables with a row per shot: values, standard deviations, spins, observables, labels.
//!
//! (n_x, n_y) is a unit vector, which can err only across itself: an error σ of its direction (rad)
//! gives its components the standard deviations `nx_sd` = σ|n_y| and `ny_sd` = σ|n_x|, whose
//! squares add up to σ² again.

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::FRAC_PI_2;

use super::error::{did_you_mean, nearest, similarity};
use super::manifest::{Kind, StatedSpin};
use super::table::Table;
use crate::measurement::dataset::{Before, Measured, Measurement, Shot};
use crate::measurement::fault::{Condition, FINITE, Fault, POSITIVE};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::valid::is_unit;
use crate::physics::ball::Vec3;

/// A column of numbers: its name, its SI unit, and its range in that unit.
pub(crate) type Column = (&'static str, f64, Condition);

/// The rows of a table whose columns have meanings; all other columns are labels.
pub(crate) struct Rows<'t> {
    table: &'t Table<'t>,
    known: Vec<&'static str>,
    /// Numbers by column and row with their standard deviations, SI and radians.
    numbers: HashMap<&'static str, Vec<Option<Measured>>>,
}

impl<'t> Rows<'t> {
    /// Reads columns of texts and of numbers. Complains about names that are nearly known, about
    /// columns that must exist and have no gaps (`required`, with blanks between them), about
    /// numbers out of range and standard deviations that are not positive.
    pub(crate) fn read(
        table: &'t Table,
        texts: &[&'static str],
        columns: impl IntoIterator<Item = Column>,
        required: &str,
    ) -> Self {
        let columns: Vec<Column> = columns.into_iter().collect();
        let known = texts.iter().copied().chain(columns.iter().map(|(name, ..)| *name)).collect();
        let mut rows = Self { table, known, numbers: HashMap::new() };
        rows.check_names(required);
        for (name, unit_si, range) in columns {
            let Some(values) = rows.column(name, unit_si, range, "out of range") else { continue };
            let sds = rows.column(&format!("{name}_sd"), unit_si, POSITIVE, "not a standard deviation");
            let sd = |row: usize| sds.as_ref().and_then(|sds| sds[row]);
            let measured = |(row, value): (usize, Option<f64>)| Some(Measured { value: value?, sd: sd(row) });
            rows.numbers.insert(name, values.into_iter().enumerate().map(measured).collect());
        }
        rows
    }

    /// Returns the numbers of a column in SI; complains about those out of range. A standard
    /// deviation may become 0 in radians.
    fn column(&self, name: &str, unit_si: f64, range: Condition, fault: &str) -> Option<Vec<Option<f64>>> {
        let mut numbers = self.table.numbers(name)?;
        for (row, number) in numbers.iter_mut().enumerate() {
            *number = number.map(|number| number * unit_si);
            if number.is_some_and(|number| Fault::of_number(name, number, range).is_some()) {
                let text = self.table.text(name, row).unwrap_or_default();
                self.table.wrong(row, name, format!("{text} is {fault}; expected {}", range.1));
            }
        }
        Some(numbers)
    }

    pub(crate) fn at(&self, column: &str, row: usize) -> Option<Measured> {
        self.numbers.get(column)?[row]
    }

    /// Complains about required columns that are missing or have gaps, about a `…_sd` of a known
    /// column that is missing, and about names similar to those of known columns.
    fn check_names(&self, required: &str) {
        let Self { table, known, .. } = self;
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

    /// Returns the names of the columns that are labels.
    pub(crate) fn labels(&self) -> impl Iterator<Item = &'t str> {
        let is_label = |name: &&str| !self.known.contains(&name.strip_suffix("_sd").unwrap_or(name));
        self.table.names().filter(is_label)
    }

    /// Returns the labels of a row.
    pub(crate) fn labels_at(&self, row: usize) -> BTreeMap<String, String> {
        let text = |name: &str| self.table.text(name, row).unwrap_or_default().to_owned();
        self.labels().map(|name| (name.to_owned(), text(name))).collect()
    }

    /// Notes which columns are kept as labels, except that of a name.
    pub(crate) fn note(&self, except: Option<&str>) -> Option<String> {
        let labels = self.labels().filter(|label| Some(*label) != except);
        let mut named: Vec<String> = labels.map(|label| format!("\"{label}\"")).collect();
        named.sort_unstable();
        let are = if named.len() == 1 { "column" } else { "columns" };
        let (path, named) = (self.table.path.display(), named.join(", "));
        let note = format!("{path}: {are} kept as labels, not read as measurements: {named}");
        (!named.is_empty()).then_some(note)
    }

    /// Complains about a table or a row without an observed value, and about standard deviations
    /// that are given for some values of a column only.
    fn check_observed(&self, observables: &[Observable]) {
        let table = self.table;
        let all: Vec<&str> = observables.iter().map(|observable| observable.column()).collect();
        let columns: Vec<&str> = all.iter().copied().filter(|name| table.has(name)).collect();
        if columns.is_empty() {
            let near = self.labels().filter_map(|name| Some((name, nearest(name, all.iter().copied())?)));
            let near = near.max_by(|a, b| similarity(a.0, a.1).total_cmp(&similarity(b.0, b.1)));
            let hint =
                near.map_or(String::new(), |(name, near)| format!("; is \"{name}\" meant to be {near}?"));
            let expected = all.join(", ");
            let message =
                format!("no column of anything observed; expected at least one of {expected}{hint}");
            return table.wrong_name(None, message);
        }
        for name in &columns {
            let sd_name = format!("{name}_sd");
            let has_sd = |row: &usize| !table.is_gap(&sd_name, *row);
            let mut full = (0..table.rows()).filter(|row| self.at(name, *row).is_some());
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

    /// Returns the statement of each row about the cue ball's spin, or else of dataset.toml; `None`
    /// for a wrong one.
    pub(crate) fn spins(&self, columns: [&str; 3], assume: StatedSpin) -> Vec<Option<StatedSpin>> {
        let missing: Vec<&str> = columns.into_iter().filter(|column| !self.table.has(column)).collect();
        if (1..3).contains(&missing.len()) {
            for column in missing {
                let all = columns.join(", ");
                let message = format!("is missing from the column names; expected all three of {all}");
                self.table.wrong_name(column, message);
            }
            return vec![None; self.table.rows()];
        }
        (0..self.table.rows()).map(|row| self.spin(row, columns, assume)).collect()
    }

    fn spin(&self, row: usize, columns: [&str; 3], assume: StatedSpin) -> Option<StatedSpin> {
        let word = self.table.text("cue_spin", row);
        let known = word.and_then(|word| StatedSpin::named(&word.to_lowercase()));
        let empty: Vec<&str> = columns.into_iter().filter(|column| self.table.is_gap(column, row)).collect();
        let (column, message) = match (empty.as_slice(), word, known) {
            (_, Some(word), None) => {
                let (near, words) = (did_you_mean(word, StatedSpin::WORDS), StatedSpin::WORDS.join(", "));
                ("cue_spin", format!("\"{word}\" is not a spin{near}; expected {words}"))
            }
            ([], _, None | Some(StatedSpin::Measured)) => {
                let [Some(x), Some(y), Some(z)] = columns.map(|column| self.at(column, row)) else {
                    return None;
                };
                let spin = Vec3::new(x.value, y.value, z.value);
                return Some(StatedSpin::Is(Spin::Measured { spin, sd: [x.sd, y.sd, z.sd] }));
            }
            ([_, _, _], ..) => return Some(known.unwrap_or(assume)),
            ([], word, _) => {
                let (word, all) = (word.unwrap_or_default(), columns.join(", "));
                ("cue_spin", format!("\"{word}\", but {all} have values; expected only one"))
            }
            ([first, ..], ..) => {
                (*first, "is empty; expected all three components of the spin or none".to_string())
            }
        };
        self.table.wrong(row, column, message);
        None
    }
}

/// Columns of a measured spin, rad/s.
pub(crate) const OMEGA: [&str; 3] = ["omega_x", "omega_y", "omega_z"];

const CUT: Condition = (|x| x.abs() < FRAC_PI_2, "degrees, more than -90 and less than 90");

/// Columns before the impact.
const ANGLES: [Column; 2] = [("cut_deg", 1.0_f64.to_radians(), CUT), ("speed_m_s", 1.0, POSITIVE)];
const IMPACTS: [Column; 4] =
    [("nx", 1.0, FINITE), ("ny", 1.0, FINITE), ("cue_vx", 1.0, FINITE), ("cue_vy", 1.0, FINITE)];

/// Columns that must exist and have no empty cells.
const REQUIRED_OF_IMPACTS: &str =
    "shot nx ny cue_vx cue_vy cue_vx_after cue_vy_after obj_vx_after obj_vy_after";

/// Returns the shots of a table, one a row, with the label of the column `by`, and a note on labels;
/// rows with problems are left out.
pub(crate) fn shots(
    table: &Table,
    kind: Kind,
    assume: StatedSpin,
    by: Option<&str>,
) -> (Vec<Shot>, Option<String>) {
    let (before, required, omega, observables): (&[Column], _, _, &[Observable]) = match kind {
        Kind::Impacts => {
            (&IMPACTS, REQUIRED_OF_IMPACTS, ["cue_wx", "cue_wy", "cue_wz"], &Observable::IMPACTS)
        }
        _ => (&ANGLES, "cut_deg", OMEGA, &Observable::ANGLES),
    };
    let observed = observables.iter().map(|one| (one.column(), one.unit_si(), FINITE));
    let columns = before.iter().copied().chain(observed).chain(omega.map(|name| (name, 1.0, FINITE)));
    let rows = Rows::read(table, &["shot", "cue_spin"], columns, required);
    rows.check_observed(observables);
    let mut shots = Vec::with_capacity(table.rows());
    for (row, stated) in rows.spins(omega, assume).into_iter().enumerate() {
        let at = |column: &str| rows.at(column, row);
        let before = if kind == Kind::Impacts {
            let line = at("nx").zip(at("ny")).zip(at("cue_vx").zip(at("cue_vy")));
            line.map(|((nx, ny), (vx, vy))| impact(table, row, [nx, ny], [vx, vy]))
        } else {
            at("cut_deg").map(|cut| Before::Angle { cut, speed: at("speed_m_s") })
        };
        let spin = stated.and_then(|stated| spin(table, row, omega, stated));
        let (Some(before), Some(spin)) = (before, spin) else { continue };
        let after = observables.iter().filter_map(|observable| {
            Some(Measurement { observable: *observable, measured: at(observable.column())? })
        });
        let mut labels = rows.labels_at(row);
        labels.extend(by.map(|by| (by.to_owned(), table.text(by, row).unwrap_or_default().to_owned())));
        let name = table.text("shot", row).unwrap_or_default();
        let (file, line) = (table.path.clone(), table.line(row));
        shots.push(Shot { file, line, labels, ..Shot::new(name, before, spin, after.collect()) });
    }
    (shots, rows.note(by))
}

/// Returns the spin of a row; complains if it is not stated, or without its numbers.
fn spin(table: &Table, row: usize, columns: [&str; 3], stated: StatedSpin) -> Option<Spin> {
    let all = columns.join(", ");
    let message = match stated {
        StatedSpin::Is(spin) => return Some(spin),
        StatedSpin::Measured => format!("the spin is said to be measured; expected values in {all}"),
        StatedSpin::Unstated => format!(
            "the cue ball's spin is not stated; expected [cue_spin] assume = \"stun\", \"natural-roll\" or \
             \"unknown\" in dataset.toml, a column cue_spin, or columns {all}"
        ),
    };
    table.wrong(row, ["cue_spin", columns[0]].into_iter().find(|name| table.has(name)), message);
    None
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
    let plain = SPREADS.split(' ').find_map(bare).map_or(plain.clone(), |of| format!("{of}_sd"));
    let names = known.iter().flat_map(|name| [(*name).to_owned(), format!("{name}_sd")]);
    let slips = |known: String| {
        let most = usize::from(known.len() >= ONE_SLIP) + usize::from(known.len() >= TWO_SLIPS);
        let slips = strsim::damerau_levenshtein(&plain, &known);
        (slips <= most && !has(&known)).then_some((slips, known))
    };
    names.filter_map(slips).min().map(|(_, known)| known)
}
