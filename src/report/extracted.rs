//! Extracted impacts as a data set of kind `impacts`, with what was left out and a picture of each shot.

use std::collections::BTreeSet;
use std::fmt::Write;

use rayon::prelude::*;

use super::csv::{line, quoted};
use super::plot::{Figure, track};
use super::{ReportError, folder_name};
use crate::fit::FittedFilm;
use crate::io::{balls_section, covariance};
use crate::measurement::dataset::{Before, Dataset, Measured, Shared};
use crate::measurement::observable::Observable;
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
    let spins = assumed(dataset).is_none();
    let after: Vec<Observable> = Observable::IMPACTS
        .into_iter()
        .filter(|o| dataset.shots.iter().any(|shot| shot.after.iter().any(|m| m.observable == *o)))
        .collect();
    let mut measured = vec!["nx", "ny", "cue_vx", "cue_vy"];
    measured.extend(after.iter().map(|observable| observable.column()));
    measured.extend(SPIN.iter().filter(|_| spins));
    let mut head = vec!["shot".to_owned()];
    head.extend(measured.iter().flat_map(|name| [(*name).to_owned(), format!("{name}_sd")]));
    head.extend(spins.then(|| "cue_spin".to_owned()));
    head.push("impact_time_s,position_sd_mm,reduced_chi2,frames_left_out".to_owned());
    let labels: BTreeSet<&String> = dataset.shots.iter().flat_map(|shot| shot.labels.keys()).collect();
    head.extend(labels.iter().map(|label| quoted(label).into_owned()));
    let mut table = line(head);
    for (shot, impact) in dataset.shots.iter().zip(extracted) {
        let Before::Impact { normal, velocity } = &shot.before else { continue };
        let mut cells = vec![quoted(&shot.name).into_owned()];
        let mut add = |m: Option<&Measured>| {
            let both = |m: &Measured| [m.value, m.sd.unwrap_or(0.0).max(LEAST_SD)].map(|x| x.to_string());
            cells.extend(m.map(both).unwrap_or_default());
        };
        normal.iter().chain(velocity).map(Some).for_each(&mut add);
        for observable in &after {
            add(shot.after.iter().find(|m| m.observable == *observable).map(|m| &m.measured));
        }
        if spins {
            let shown: [Option<Measured>; 3] = match shot.spin {
                Spin::Measured { spin, sd } => {
                    [0, 1, 2].map(|i| Some(Measured { value: spin[i], sd: sd[i] }))
                }
                _ => [None; 3],
            };
            for component in &shown {
                add(component.as_ref());
            }
            cells.push(
                match shot.spin {
                    Spin::Measured { .. } => "measured",
                    Spin::Stun => "stun",
                    Spin::NaturalRoll => "natural-roll",
                    Spin::Unknown => "unknown",
                }
                .to_owned(),
            );
        }
        let found = [impact.time, 1e3 * impact.position_sd, impact.reduced_chi2];
        cells.extend(found.map(|value| value.to_string()));
        cells.push(impact.outliers.to_string());
        let text = |label: &&String| shot.labels.get(*label).map_or("", String::as_str);
        cells.extend(labels.iter().map(|label| quoted(text(label)).into_owned()));
        table += &line(cells);
    }
    table
}

const SPIN: [&str; 3] = ["cue_wx", "cue_wy", "cue_wz"];

/// Standard deviations in a file are positive.
const LEAST_SD: f64 = 1e-12;

/// The joint errors of every shot: a row for each quantity.
fn covariance(dataset: &Dataset) -> String {
    let after: Vec<&str> = Observable::IMPACTS.into_iter().map(Observable::column).collect();
    let present = |name: &&str| dataset.shots.iter().any(|shot| covariance::quantities(shot).contains(name));
    let columns: Vec<&str> = covariance::BEFORE.into_iter().chain(after).filter(present).collect();
    let shared: Vec<Shared> = dataset.shared_errors().into_iter().map(|(shared, _)| shared).collect();
    let head = ["shot", "quantity"].into_iter().chain(columns.iter().copied());
    let mut table = line(head.chain(shared.iter().map(|shared| covariance::by(*shared))));
    for shot in &dataset.shots {
        let Some(errors) = &shot.joint else { continue };
        let own = covariance::quantities(shot);
        for (i, quantity) in own.iter().enumerate() {
            let with = |column: &&str| own.iter().position(|name| name == column);
            let covariances = columns.iter().map(|column| {
                with(column).map_or_else(String::new, |j| format!("{:e}", errors.covariance[(i, j)]))
            });
            let by_shared = shared.iter().map(|shared| format!("{:e}", errors.by_shared[shared.place()][i]));
            let first = [quoted(&shot.name).into_owned(), (*quantity).to_owned()];
            table += &line(first.into_iter().chain(covariances).chain(by_shared));
        }
    }
    table
}

pub(super) fn left_out(dataset: &Dataset) -> String {
    let rows = dataset.left_out.iter().map(|(shot, reason)| line([quoted(shot), quoted(reason)]));
    std::iter::once("shot,reason\n".to_owned()).chain(rows).collect()
}
