//! shots.csv: one row per shot, with all that was measured of it, its errors, and what the fit predicts.

use std::borrow::Cow;
use std::collections::HashMap;

use super::csv::{cell, line, quoted};
use crate::fit::{Fit, FittedFilm, OwnEstimate, Residual};

/// The first columns: `used` is true or false, with the `reason` where a shot was left out or is doubtful; `chi2` is the sum of
/// the squares of `values` standardized residuals, `largest` the largest of them in size. For each observable its column, `…_sd` and
/// `…_predicted` follow, in the unit of its name (velocities m/s, spins rad/s); then, of films of balls, what the fit estimates of each shot, each
/// with its `…_sd`, which is empty where the data rule the model out.
pub const HEADER: &str = "shot,used,reason,cut_deg,speed_m_s,values,chi2,largest";

/// shots.csv as text. A cell whose number is unknown is empty.
#[must_use]
pub fn render(fit: &Fit) -> String {
    let observables = distinct(fit.residuals.iter().map(|residual| residual.observable));
    let estimates: Vec<(&str, Vec<OwnEstimate>)> =
        fit.frames.iter().flat_map(FittedFilm::estimates).collect();
    let estimated = distinct(estimates.iter().flat_map(|(_, own)| own).map(|estimate| estimate.column));
    let estimates: HashMap<&str, &[OwnEstimate]> =
        estimates.iter().map(|(shot, own)| (*shot, own.as_slice())).collect();
    let mut head = vec![HEADER.to_owned()];
    for name in observables.iter().map(|observable| observable.column()) {
        head.extend([name.to_owned(), format!("{name}_sd"), format!("{name}_predicted")]);
    }
    head.extend(estimated.iter().flat_map(|name| [(*name).to_owned(), format!("{name}_sd")]));
    let mut table = line(head);
    for own in fit.residuals.chunk_by(|one, next| one.shot == next.shot) {
        let Some(Residual { shot: name, cut, speed, .. }) = own.first() else { continue };
        let standardized = || own.iter().map(|residual| residual.standardized);
        let chi2: f64 = standardized().map(|z| z * z).sum();
        let largest = standardized().fold(0.0, |most: f64, z| if z.abs() > most.abs() { z } else { most });
        let mut row = vec![
            quoted(name).into_owned(),
            "true".to_owned(),
            String::new(),
            cell(cut.to_degrees()),
            cell(speed.unwrap_or(f64::NAN)),
            own.len().to_string(),
            cell(chi2),
            cell(largest),
        ];
        for observable in &observables {
            let found = own.iter().find(|residual| residual.observable == *observable).map(|residual| {
                [residual.measured, residual.sd, residual.predicted].map(|si| cell(si / observable.unit_si()))
            });
            row.extend(found.unwrap_or_default());
        }
        let of_shot = estimates.get(name.as_str()).copied().unwrap_or_default();
        for column in &estimated {
            let found = of_shot.iter().find(|estimate| estimate.column == *column).map(|estimate| {
                let sd = if fit.refuted.is_some() { f64::NAN } else { estimate.sd };
                [cell(estimate.value), cell(sd)]
            });
            row.extend(found.unwrap_or_default());
        }
        table += &line(row);
    }
    let empty = vec![Cow::Borrowed(""); 5 + 3 * observables.len() + 2 * estimated.len()];
    for rejected in &fit.shots_rejected {
        let own = [quoted(&rejected.shot), "false".into(), quoted(&rejected.reason)];
        table += &line(own.iter().chain(&empty));
    }
    table
}

/// Each once, in the order of first appearance.
fn distinct<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(&one) {
            found.push(one);
        }
    }
    found
}
