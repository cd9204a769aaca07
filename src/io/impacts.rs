//! Tables of kind `impacts`: velocities before and after each impact, table frame.
//!
//! (n_x, n_y) is a unit vector, which can err only across itself: an error σ of its direction (rad) gives its components the
//! standard deviations `nx_sd` = σ|n_y| and `ny_sd` = σ|n_x|, whose squares add up to σ² again.

use super::manifest::Assume;
use super::rows::{self, Column, Observables};
use super::table::Table;
use crate::measurement::dataset::{Before, Measured, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::valid::is_unit;

const BEFORE: [&str; 4] = ["nx", "ny", "cue_vx", "cue_vy"];
const AFTER: [&str; 4] = ["cue_vx_after", "cue_vy_after", "obj_vx_after", "obj_vy_after"];
const SPIN: [&str; 3] = ["cue_wx", "cue_wy", "cue_wz"];

/// One row, one shot.
pub(crate) fn shots(table: &Table, assume: Option<Assume>) -> Vec<Shot> {
    let mut known = vec!["shot", "cue_spin"];
    known.extend(BEFORE);
    known.extend(SPIN);
    known.extend(Observable::IMPACTS.map(Observable::column));
    rows::check_names(table, &known);

    for column in ["shot"].into_iter().chain(BEFORE).chain(AFTER) {
        table.require(column, &known);
    }
    let columns = BEFORE.map(|column| Column::read(table, column, 1.0));
    let observables = Observables::read(table, &Observable::IMPACTS);
    let spins = rows::spins(table, SPIN, assume);

    let mut shots = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let before = columns.each_ref().map(|c| c.as_ref().and_then(|column| column.measured(row)));
        let [Some(nx), Some(ny), Some(vx), Some(vy)] = before else { continue };
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
        let after = observables.row(table, row);
        let Some(spin) = spins.get(row) else { continue };
        let unit = |n: Measured| Measured { value: n.value / length, sd: n.sd };
        let before = Before::Impact { normal: [unit(nx), unit(ny)], velocity: [vx, vy] };
        let name = table.text("shot", row).unwrap_or_default();
        shots.push(Shot {
            file: table.path.clone(),
            line: table.line(row),
            labels: rows::labels(table, &known, row),
            ..Shot::new(name, before, *spin, after)
        });
    }
    shots
}
