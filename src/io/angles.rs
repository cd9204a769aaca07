//! Tables of kind `angles`: published tables and protractor measurements.

use std::f64::consts::FRAC_PI_2;

use super::manifest::Assume;
use super::rows::{self, Column, Observables};
use super::table::Table;
use crate::measurement::dataset::{Before, Shot};
use crate::measurement::observable::Observable;

const SPIN: [&str; 3] = ["omega_x", "omega_y", "omega_z"];

/// One row, one shot.
pub(crate) fn shots(table: &Table, assume: Option<Assume>) -> Vec<Shot> {
    let mut known = vec!["shot", "cut_deg", "speed_m_s", "cue_spin"];
    known.extend(SPIN);
    known.extend(Observable::ANGLES.map(Observable::column));
    rows::check_names(table, &known);

    table.require("cut_deg", &known);
    let cuts = Column::read(table, "cut_deg", 1.0_f64.to_radians());
    let speeds = Column::read(table, "speed_m_s", 1.0);
    let observables = Observables::read(table, &Observable::ANGLES);
    observables.require(table, &Observable::ANGLES, &known);
    let spins = rows::spins(table, SPIN, assume);
    let Some(cuts) = cuts else { return Vec::new() };

    let mut shots = Vec::with_capacity(table.rows());
    for row in 0..table.rows() {
        let cut = cuts.measured(row);
        if cut.is_some_and(|cut| cut.value.abs() >= FRAC_PI_2) {
            let text = table.text("cut_deg", row).unwrap_or_default();
            let message = format!("{text} is no cut angle; expected degrees, more than -90 and less than 90");
            table.wrong(row, "cut_deg", message);
        }
        let speed = speeds.as_ref().and_then(|column| column.measured(row));
        if speed.is_some_and(|speed| speed.value <= 0.0) {
            let text = table.text("speed_m_s", row).unwrap_or_default();
            table.wrong(row, "speed_m_s", format!("{text} is no speed; expected more than 0"));
        }
        let after = observables.row(table, row);
        let (Some(cut), Some(spin)) = (cut, spins.get(row)) else { continue };
        let before = Before::Angle { cut, speed };
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
