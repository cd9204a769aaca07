//! Extracted impacts as a data set of kind `impacts`, with what was left out and a picture of each shot.

use std::fmt::Write;

use rayon::prelude::*;

use super::csv::Table;
use super::plot::{Figure, track};
use super::{ReportError, folder_name};
use crate::fit::FittedFilm;
use crate::io::{balls_section, covariance};
use crate::measurement::dataset::{Before, Dataset, Measured};
use crate::measurement::spin::Spin;
use crate::problem::Impact;

/// dataset.toml, impacts.csv, covariance.csv and left-out.csv.
#[must_use]
pub fn files(dataset: &Dataset, extracted: &[Impact]) -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("impacts.csv", impacts(dataset, extracted).into_bytes()),
        ("covariance.csv", covariance(dataset).into_bytes()),
        ("left-out.csv", left_out(dataset).into_bytes()),
        ("dataset.toml", manifest(dataset).into_bytes()),
    ]
}

/// Returns the picture of each shot of balls: file name and SVG.
///
/// # Errors
/// A picture that cannot be drawn.
pub fn pictures(film: &FittedFilm, extracted: &[Impact]) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    drawn(extracted, |impact| &impact.shot.name, |impact| track::of_balls(film, impact))
}

/// Returns each shot drawn, in a file that is named after it.
pub(super) fn drawn<T: Sync>(
    extracted: &[T],
    name: fn(&T) -> &String,
    draw: impl Fn(&T) -> Figure + Sync,
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let names: Vec<String> = extracted.iter().map(|shot| name(shot).clone()).collect();
    let files = super::group_folders(&names);
    let file = |(shot, name): (&T, &String)| Ok((format!("{name}.svg"), draw(shot).svg()?.into_bytes()));
    extracted.par_iter().zip(&files).map(file).collect()
}

/// The one spin that all shots have, if that is stun or natural roll.
fn assumed(dataset: &Dataset) -> Option<&'static str> {
    let all = |spin: Spin| dataset.shots.iter().all(|shot| shot.spin == spin);
    let words = [(Spin::NaturalRoll, "natural-roll"), (Spin::Stun, "stun")];
    words.into_iter().find_map(|(spin, word)| all(spin).then_some(word))
}

fn manifest(dataset: &Dataset) -> String {
    let text = |text: &str| toml::Value::from(text).to_string();
    let mut manifest = format!(
        "# Extracted from {} by caromfit {}.\nname = {}\nkind = \"impacts\"\nfiles = [\"impacts.csv\"]\n",
        folder_name(&dataset.path.file_name().unwrap_or_default().to_string_lossy()),
        env!("CARGO_PKG_VERSION"),
        text(&format!("{}-impacts", dataset.name)),
    );
    for (key, value) in [("cloth", &dataset.cloth), ("balls", &dataset.balls), ("source", &dataset.source)] {
        if let Some(value) = value {
            _ = writeln!(manifest, "{key} = {}", text(value));
        }
    }
    manifest.push_str("\n[impacts]\ncovariance = \"covariance.csv\"\n");
    for (key, friction) in [("mu_k", dataset.sliding), ("mu_r", dataset.rolling)] {
        if let Some(Measured { value, sd: Some(sd) }) = friction {
            _ = writeln!(manifest, "{key} = {value:?}\n{key}_sd = {sd:?}");
        }
    }
    if let Some(sd) = dataset.lift_sd {
        _ = writeln!(manifest, "lift_sd = {sd:?}");
    }
    let mut of_tracks = stated(dataset);
    let poisson = of_tracks.get("ball").and_then(|ball| ball.get("poisson")).and_then(number);
    manifest += "\n";
    manifest += &balls_section::text(&dataset.ball, dataset.object.as_ref(), poisson);
    _ = write!(manifest, "\n[cue_spin]\nassume = \"{}\"\n", assumed(dataset).unwrap_or("measured"));
    // so that the impacts are fitted the same way
    if let Some(fit) = of_tracks.remove("fit") {
        _ = write!(manifest, "\n{}", toml::Table::from_iter([("fit".to_string(), fit)]));
    }
    manifest
}

/// A number that may be written as an integer.
fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| Some(value.as_integer()? as f64))
}

/// The dataset.toml of the tracks; empty for a data set that a program made.
fn stated(dataset: &Dataset) -> toml::Table {
    let text = std::fs::read_to_string(&dataset.path).unwrap_or_default();
    text.trim_start_matches('\u{feff}').parse().unwrap_or_default()
}

fn impacts(dataset: &Dataset, extracted: &[Impact]) -> String {
    let is_assumed = assumed(dataset).is_some();
    let mut table = Table::default();
    let measured = |table: &mut Table, column: &str, Measured { value, sd }: &Measured| {
        table.add(column, value.to_string());
        table.add(&format!("{column}_sd"), sd.unwrap_or(0.0).max(LEAST_SD).to_string());
    };
    for (shot, impact) in dataset.shots.iter().zip(extracted) {
        let Before::Impact { normal, velocity } = &shot.before else { continue };
        table.begin();
        table.add("shot", &shot.name);
        for (column, before) in
            ["nx", "ny", "cue_vx", "cue_vy"].into_iter().zip(normal.iter().chain(velocity))
        {
            measured(&mut table, column, before);
        }
        for after in &shot.after {
            measured(&mut table, after.observable.column(), &after.measured);
        }
        if let Spin::Measured { spin, sd } = shot.spin {
            for (i, column) in SPIN.into_iter().enumerate().filter(|_| !is_assumed) {
                measured(&mut table, column, &Measured { value: spin[i], sd: sd[i] });
            }
        }
        if !is_assumed {
            let spin = match shot.spin {
                Spin::Measured { .. } => "measured",
                Spin::Stun => "stun",
                Spin::NaturalRoll => "natural-roll",
                Spin::Unknown => "unknown",
            };
            table.add("cue_spin", spin);
        }
        table.add("impact_time_s", impact.time.to_string());
        table.add("position_sd_mm", (1e3 * impact.position_sd).to_string());
        table.add("reduced_chi2", impact.reduced_chi2.to_string());
        table.add("frames_left_out", impact.outliers.to_string());
        for (label, text) in &shot.labels {
            table.add(label, text);
        }
    }
    table.text()
}

const SPIN: [&str; 3] = ["cue_wx", "cue_wy", "cue_wz"];

/// Standard deviations in a file are positive.
const LEAST_SD: f64 = 1e-12;

/// The joint errors of every shot: a row for each quantity.
fn covariance(dataset: &Dataset) -> String {
    let mut table = Table::new("shot,quantity");
    for shot in &dataset.shots {
        let Some(errors) = &shot.joint else { continue };
        let own = covariance::quantities(shot);
        for (i, quantity) in own.iter().enumerate() {
            table.begin();
            table.add("shot", &shot.name);
            table.add("quantity", *quantity);
            for (j, column) in own.iter().enumerate() {
                table.add(column, format!("{:e}", errors.covariance[(i, j)]));
            }
            for (shared, _) in dataset.shared_errors() {
                table.add(covariance::by(shared), format!("{:e}", errors.by_shared[shared.place()][i]));
            }
        }
    }
    table.text()
}

pub(super) fn left_out(dataset: &Dataset) -> String {
    let mut table = Table::new("shot,reason");
    for (shot, reason) in &dataset.left_out {
        table.begin();
        table.add("shot", shot);
        table.add("reason", reason);
    }
    table.text()
}
