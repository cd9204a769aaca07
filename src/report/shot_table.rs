//! shots.csv: one row per shot, with all that was measured of it, its errors, and what the fit predicts.

use std::collections::HashMap;
use std::fmt::Write;

use super::csv::{cell, number, quoted};
use super::digits;
use super::digits::{FEW, SHOT};
use crate::fit::{Fit, FittedFrames, Residual};
use crate::likelihood::frames::own_estimates::OwnEstimate;
use crate::measurement::observable::Observable;

/// The first columns: `used` is true or false, with the `reason` where a shot was left out or is doubtful; `chi2` is the sum of
/// the squares of `values` standardized residuals, `largest` the largest of them in size. For each observable its column, `…_sd` and
/// `…_predicted` follow, in the unit of its name (velocities m/s, spins rad/s); then, of a joint fit, what it estimates of each shot, each
/// with its `…_sd`, which is empty where the data rule the model out.
pub const HEADER: &str = "shot,used,reason,cut_deg,speed_m_s,values,chi2,largest";

/// shots.csv as text. A cell whose number is unknown is empty.
#[must_use]
pub fn render(fit: &Fit) -> String {
    let mut observables: Vec<Observable> = Vec::new();
    let mut shots: Vec<(&str, Vec<&Residual>)> = Vec::new();
    for residual in &fit.residuals {
        if !observables.contains(&residual.observable) {
            observables.push(residual.observable);
        }
        match shots.last_mut().filter(|(name, _)| *name == residual.shot) {
            Some((_, own)) => own.push(residual),
            None => shots.push((&residual.shot, vec![residual])),
        }
    }
    let mut table = HEADER.to_owned();
    for observable in &observables {
        let name = observable.column();
        _ = write!(table, ",{name},{name}_sd,{name}_predicted");
    }
    let mut estimated: Vec<&str> = Vec::new();
    let mut estimates: HashMap<&str, Vec<OwnEstimate>> = HashMap::new();
    for (shot, own) in fit.frames.iter().flat_map(FittedFrames::estimates) {
        for estimate in &own {
            if !estimated.contains(&estimate.column) {
                estimated.push(estimate.column);
            }
        }
        estimates.insert(shot, own);
    }
    for column in &estimated {
        _ = write!(table, ",{column},{column}_sd");
    }
    table.push('\n');
    for (name, own) in &shots {
        let doubt = fit.shots_doubtful.iter().find(|doubtful| doubtful.shot == *name);
        let standardized = || own.iter().map(|residual| residual.standardized);
        let chi2: f64 = standardized().map(|z| z * z).sum();
        let largest = standardized().fold(0.0, |most: f64, z| if z.abs() > most.abs() { z } else { most });
        let first = own.first().map_or((f64::NAN, None), |residual| (residual.cut, residual.speed));
        _ = write!(
            table,
            "{},true,{},{},{},{},{},{}",
            quoted(name),
            doubt.map_or_else(Default::default, |doubtful| quoted(&doubtful.reason)),
            number(first.0.to_degrees(), SHOT),
            number(first.1.unwrap_or(f64::NAN), SHOT),
            own.len(),
            cell(digits::decimal(chi2)),
            cell(digits::decimal(largest))
        );
        for observable in &observables {
            match own.iter().find(|residual| residual.observable == *observable) {
                Some(residual) => {
                    let unit = observable.unit_si();
                    let [value, predicted] = [residual.measured, residual.predicted]
                        .map(|x| cell(digits::to_error(x / unit, Some(residual.sd / unit))));
                    _ = write!(table, ",{value},{},{predicted}", number(residual.sd / unit, FEW));
                }
                None => table.push_str(",,,"),
            }
        }
        let of_shot = estimates.get(name).map_or(&[][..], Vec::as_slice);
        for column in &estimated {
            match of_shot.iter().find(|estimate| estimate.column == *column) {
                Some(OwnEstimate { value, sd, .. }) => {
                    let sd = if fit.refuted.is_some() { f64::NAN } else { *sd };
                    _ = write!(table, ",{},{}", cell(digits::to_error(*value, Some(sd))), number(sd, FEW));
                }
                None => table.push_str(",,"),
            }
        }
        table.push('\n');
    }
    for rejected in &fit.shots_rejected {
        let empty = ",".repeat(5 + 3 * observables.len() + 2 * estimated.len());
        _ = writeln!(table, "{},false,{}{empty}", quoted(&rejected.shot), quoted(&rejected.reason));
    }
    table
}
