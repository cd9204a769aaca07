//! `[impacts] covariance`: the joint errors of every shot, as `caromfit extract` writes them. Each
//! row is a quantity of a shot, with its covariances with all quantities of the shot.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::{DMatrix, DVector};

use super::error::Problems;
use super::table::Table;
use crate::measurement::dataset::{Joint, Shared, Shot};

/// Names of a shot's quantities before its observations, in the order of [`Joint`].
pub(crate) const BEFORE: [&str; Joint::BEFORE] =
    ["direction_rad", "cue_vx", "cue_vy", "cue_wx", "cue_wy", "cue_wz"];

/// Returns the column of derivatives by a quantity that shots share: μ_k or μ_r of the cloth, or the
/// factor of the lifts.
pub(crate) const fn by(shared: Shared) -> &'static str {
    match shared {
        Shared::Sliding => "by_mu_k",
        Shared::Lift => "by_lift",
        Shared::Rolling => "by_mu_r",
    }
}

/// Largest difference of symmetric entries, in units of the product of the standard deviations.
const SYMMETRIC: f64 = 1e-9;

/// Returns the names of the quantities of a shot, in the order of [`Joint`].
pub(crate) fn quantities(shot: &Shot) -> Vec<&'static str> {
    let after = shot.after.iter().map(|measurement| measurement.observable.column());
    BEFORE.into_iter().chain(after).collect()
}

/// Gives every shot its joint errors, and their derivatives by shared quantities.
pub(crate) fn read(path: &Path, shots: &mut [Shot], shared: &[Shared], problems: &Problems) {
    let Some(table) = Table::read(path, problems) else { return };
    for column in ["shot", "quantity"] {
        table.require(column, &["shot", "quantity"]);
    }
    let mut rows: HashMap<(&str, &str), usize> = HashMap::new();
    for row in 0..table.rows() {
        let (Some(shot), Some(quantity)) = (table.text("shot", row), table.text("quantity", row)) else {
            continue;
        };
        if let Some(first) = rows.insert((shot, quantity), row) {
            let message = format!(
                "\"{quantity}\" of shot {shot} also stands in line {}; expected it once",
                table.line(first)
            );
            table.wrong(row, "quantity", message);
        }
    }
    let others = table.names().filter(|name| !["shot", "quantity"].contains(name));
    let columns: HashMap<&str, Vec<Option<f64>>> =
        others.filter_map(|name| Some((name, table.numbers(name)?))).collect();
    for shot in shots {
        let names = quantities(shot);
        let mut joint = Joint {
            covariance: DMatrix::zeros(names.len(), names.len()),
            by_shared: vec![DVector::zeros(names.len()); Shared::ALL.len()],
        };
        let mut complete = true;
        for (i, name) in names.iter().enumerate() {
            let Some(row) = rows.get(&(shot.name.as_str(), *name)) else {
                let message = format!("no row of \"{name}\" for shot {}; expected one", shot.name);
                problems.add(path, None, "quantity", message);
                complete = false;
                continue;
            };
            let mut number = |column: &str| {
                let value = columns.get(column).and_then(|numbers| numbers[*row]);
                if value.is_none() {
                    let message = format!("no covariance of \"{name}\" with \"{column}\"; expected a number");
                    table.wrong(*row, column, message);
                    complete = false;
                }
                value.unwrap_or(f64::NAN)
            };
            for (j, other) in names.iter().enumerate() {
                joint.covariance[(i, j)] = number(other);
            }
            for shared in shared {
                joint.by_shared[shared.place()][i] = number(by(*shared));
            }
        }
        if complete {
            check(path, shot, &names, &joint.covariance, problems);
            shot.joint = Some(Box::new(joint));
        }
    }
}

fn check(path: &Path, shot: &Shot, names: &[&str], covariance: &DMatrix<f64>, problems: &Problems) {
    for (i, name) in names.iter().enumerate() {
        let variance = covariance[(i, i)];
        if variance < 0.0 {
            let message = format!(
                "the variance of \"{name}\" of shot {} is {variance:e}; expected 0 or more",
                shot.name
            );
            problems.add(path, None, *name, message);
        }
        for j in 0..i {
            let scale = (variance * covariance[(j, j)]).abs().sqrt();
            let (above, below) = (covariance[(j, i)], covariance[(i, j)]);
            if (above - below).abs() > SYMMETRIC * scale {
                let message = format!(
                    "the covariance of \"{name}\" and \"{}\" of shot {} is {below:e} in one row and {above:e} in the \
                     other; expected the same",
                    names[j], shot.name
                );
                problems.add(path, None, *name, message);
            }
        }
    }
}
