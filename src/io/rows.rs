//! Tables of impacts and of angles, with a row per shot.
//!
//! (n_x, n_y) is a unit vector, which can err only across itself: an error σ of its direction (rad)
//! gives its components the standard deviations `nx_sd` = σ|n_y| and `ny_sd` = σ|n_x|, whose
//! squares add up to σ² again.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use super::error::{did_you_mean, nearest, similarity};
use super::manifest::{Kind, StatedSpin};
use super::table::{Column, OMEGA, Table};
use super::toml_file::Source;
use crate::measurement::dataset::{Before, Dataset, Measured, Measurement, Shot};
use crate::measurement::fault::{Condition, FINITE, POSITIVE};
use crate::measurement::observable::Observable;
use crate::measurement::spin::Spin;
use crate::measurement::valid::is_unit;

const CUT: Condition = (|x| x.abs() < FRAC_PI_2, "degrees, more than -90 and less than 90");

/// The columns of a kind of table.
struct Columns {
    before: &'static [Column],
    /// Columns that must exist and have no empty cells.
    required: &'static str,
    spin: [&'static str; 3],
    observables: &'static [Observable],
}

const ANGLES: Columns = Columns {
    before: &[("cut_deg", 1.0_f64.to_radians(), CUT), ("speed_m_s", 1.0, POSITIVE)],
    required: "cut_deg",
    spin: OMEGA,
    observables: &Observable::ANGLES,
};
const IMPACTS: Columns = Columns {
    before: &[("nx", 1.0, FINITE), ("ny", 1.0, FINITE), ("cue_vx", 1.0, FINITE), ("cue_vy", 1.0, FINITE)],
    required: "shot nx ny cue_vx cue_vy cue_vx_after cue_vy_after obj_vx_after obj_vy_after",
    spin: ["cue_wx", "cue_wy", "cue_wz"],
    observables: &Observable::IMPACTS,
};

/// Adds the shots of a table, with the label that `[fit] by` names; leaves out faulty rows.
pub(crate) fn add(dataset: &mut Dataset, file: &Path, kind: Kind, assume: StatedSpin, source: &Source) {
    let of_kind = if kind == Kind::Impacts { IMPACTS } else { ANGLES };
    let Columns { before, required, spin: omega, observables } = of_kind;
    let observed = observables.iter().map(|one| (one.column(), one.unit_si(), FINITE));
    let spins = omega.map(|name| (name, 1.0, FINITE));
    let columns: Vec<Column> = before.iter().copied().chain(observed).chain(spins).collect();
    let Some(table) = Table::read(file, source.problems) else { return };
    let by = dataset.by.as_deref();
    if let Some(by) = by {
        check_label(by, &table, source);
    }
    let table = table.with("shot cue_spin", &columns, required);
    check_observed(&table, observables);
    for (row, stated) in table.spins(omega, assume).into_iter().enumerate() {
        let at = |column: &str| table.at(column, row);
        let before = if kind == Kind::Impacts {
            let line = at("nx").zip(at("ny")).zip(at("cue_vx").zip(at("cue_vy")));
            line.map(|((nx, ny), (vx, vy))| impact(&table, row, [nx, ny], [vx, vy]))
        } else {
            at("cut_deg").map(|cut| Before::Angle { cut, speed: at("speed_m_s") })
        };
        let spin = stated.and_then(|stated| spin(&table, row, omega, stated));
        let (Some(before), Some(spin)) = (before, spin) else { continue };
        let after = observables.iter().filter_map(|observable| {
            Some(Measurement { observable: *observable, measured: at(observable.column())? })
        });
        let mut labels = table.labels_at(row);
        labels.extend(by.map(|by| (by.to_owned(), table.text(by, row).unwrap_or_default().to_owned())));
        let name = table.text("shot", row).unwrap_or_default();
        let (file, line) = (table.path.clone(), table.line(row));
        dataset.shots.push(Shot { file, line, labels, ..Shot::new(name, before, spin, after.collect()) });
    }
    dataset.taken.extend(table.note(by));
}

/// Complains if a table lacks the column that `[fit] by` names, or a label in it.
fn check_label(by: &str, table: &Table, source: &Source) {
    if !table.has(by) {
        let near = did_you_mean(by, table.names());
        let message = format!("by is \"{by}\", but {} has no such column{near}", table.path.display());
        return source.wrong("fit.by", message);
    }
    for row in table.rows().filter(|row| table.text(by, *row).is_none()) {
        table.wrong(row, by, "is empty; expected a label, since [fit] by names this column");
    }
}

/// Complains about tables and rows without an observed value, and about gaps in deviations.
fn check_observed(table: &Table, observables: &[Observable]) {
    let all: Vec<&str> = observables.iter().map(|observable| observable.column()).collect();
    let columns: Vec<&str> = all.iter().copied().filter(|name| table.has(name)).collect();
    if columns.is_empty() {
        let near = table.labels().filter_map(|name| Some((name, nearest(name, all.iter().copied())?)));
        let near = near.max_by(|a, b| similarity(a.0, a.1).total_cmp(&similarity(b.0, b.1)));
        let hint = near.map_or(String::new(), |(name, near)| format!("; is \"{name}\" meant to be {near}?"));
        let expected = all.join(", ");
        let message = format!("no column of anything observed; expected at least one of {expected}{hint}");
        return table.wrong_name(None, message);
    }
    for name in &columns {
        let sd_name = format!("{name}_sd");
        let has_sd = |row: &usize| !table.is_gap(&sd_name, *row);
        let mut full = table.rows().filter(|row| table.at(name, *row).is_some());
        if let (Some(with), Some(without)) = (full.clone().find(has_sd), full.find(|row| !has_sd(row))) {
            let line = table.line(with);
            let message = format!(
                "is empty, but line {line} has one; give a standard deviation for every {name} or for none"
            );
            table.wrong(without, sd_name.as_str(), message);
        }
    }
    for row in table.rows().filter(|row| columns.iter().all(|name| table.is_gap(name, *row))) {
        let expected = columns.join(" or ");
        table.wrong(row, None, format!("no observed value in this row; expected a value in {expected}"));
    }
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
