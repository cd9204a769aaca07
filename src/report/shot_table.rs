//! shots.csv: one row per shot, with all that was measured of it, its errors, and what the fit predicts.

use std::borrow::Cow;
use std::collections::HashMap;

use super::csv::{cell, line, number, quoted};
use super::digits::{self, FEW, SHOT};
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
    let mut head = vec![HEADER.to_owned()];
    for name in observables.iter().map(|observable| observable.column()) {
        head.extend([name.to_owned(), format!("{name}_sd"), format!("{name}_predicted")]);
    }
    head.extend(estimated.iter().flat_map(|name| [(*name).to_owned(), format!("{name}_sd")]));
    let mut table = line(head);
    for (name, own) in &shots {
        let doubt = fit.shots_doubtful.iter().find(|doubtful| doubtful.shot == *name);
        let standardized = || own.iter().map(|residual| residual.standardized);
        let chi2: f64 = standardized().map(|z| z * z).sum();
        let largest = standardized().fold(0.0, |most: f64, z| if z.abs() > most.abs() { z } else { most });
        let (cut, speed) = own.first().map_or((f64::NAN, None), |residual| (residual.cut, residual.speed));
        let mut row = vec![
            quoted(name).into_owned(),
            "true".to_owned(),
            doubt.map_or_else(String::new, |doubtful| quoted(&doubtful.reason).into_owned()),
            number(cut.to_degrees(), SHOT),
            number(speed.unwrap_or(f64::NAN), SHOT),
            own.len().to_string(),
            cell(digits::decimal(chi2)),
            cell(digits::decimal(largest)),
        ];
        for observable in &observables {
            let found = own.iter().find(|residual| residual.observable == *observable).map(|residual| {
                let [measured, predicted, sd] =
                    [residual.measured, residual.predicted, residual.sd].map(|si| si / observable.unit_si());
                let [measured, predicted] =
                    [measured, predicted].map(|x| cell(digits::to_error(x, Some(sd))));
                [measured, number(sd, FEW), predicted]
            });
            row.extend(found.unwrap_or_default());
        }
        let of_shot = estimates.get(name).map_or(&[][..], Vec::as_slice);
        for column in &estimated {
            let found = of_shot.iter().find(|estimate| estimate.column == *column).map(|estimate| {
                let sd = if fit.refuted.is_some() { f64::NAN } else { estimate.sd };
                [cell(digits::to_error(estimate.value, Some(sd))), number(sd, FEW)]
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
