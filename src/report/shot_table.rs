//! shots.csv: one row per shot, with all that was measured of it, its errors, and what the fit predicts.

use std::collections::HashMap;

use super::csv::Table;
use crate::fit::{Fit, FittedFilm};
use crate::problem::OwnEstimate;

/// The first columns: `used` is true or false, with the `reason` where a shot was left out or is doubtful; `chi2` is the sum of
/// the squares of `values` standardized residuals, `largest` the largest of them in size. For each observable its column, `…_sd` and
/// `…_predicted` follow, in the unit of its name (velocities m/s, spins rad/s); then, of films of balls, what the fit estimates of each shot, each
/// with its `…_sd`, which is empty where the data rule the model out.
pub const HEADER: &str = "shot,used,reason,cut_deg,speed_m_s,values,chi2,largest";

/// shots.csv as text. A cell whose number is unknown is empty.
#[must_use]
pub fn render(fit: &Fit) -> String {
    let estimates: HashMap<&str, Vec<OwnEstimate>> =
        fit.frames.iter().flat_map(FittedFilm::estimates).collect();
    let mut table = Table::new(HEADER);
    for own in fit.residuals.chunk_by(|one, next| one.shot == next.shot) {
        let standardized = || own.iter().map(|residual| residual.standardized);
        table.begin();
        table.add("shot", &own[0].shot);
        table.add("used", "true");
        table.add_number("cut_deg", own[0].cut.to_degrees());
        table.add_number("speed_m_s", own[0].speed.unwrap_or(f64::NAN));
        table.add("values", own.len().to_string());
        table.add_number("chi2", standardized().map(|z| z * z).sum());
        let largest = |most: f64, z: f64| if z.abs() > most.abs() { z } else { most };
        table.add_number("largest", standardized().fold(0.0, largest));
        for residual in own {
            let (name, unit_si) = (residual.observable.column(), residual.observable.unit_si());
            table.add_number(name, residual.measured / unit_si);
            table.add_number(&format!("{name}_sd"), residual.sd / unit_si);
            table.add_number(&format!("{name}_predicted"), residual.predicted / unit_si);
        }
        for estimate in estimates.get(own[0].shot.as_str()).into_iter().flatten() {
            table.add_number(estimate.column, estimate.value);
            let sd = if fit.refuted.is_some() { f64::NAN } else { estimate.sd };
            table.add_number(&format!("{}_sd", estimate.column), sd);
        }
    }
    for rejected in &fit.shots_rejected {
        table.begin();
        table.add("shot", &rejected.shot);
        table.add("used", "false");
        table.add("reason", &rejected.reason);
    }
    table.text()
}
