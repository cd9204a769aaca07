//! Extracted impacts as a data set of kind `impacts`, with what was left out and a picture of each shot.

use std::fmt::Write;

use super::plot::track;
use super::{ReportError, folder_name};
use crate::ball::{BallState, Vec3};
use crate::dataset::{Before, Dataset, Measured, Shot, Spin};
use crate::impact::{Impact, Quantity, Scene};
use crate::track::TrackShot;

/// dataset.toml, impacts.csv and left-out.csv.
#[must_use]
pub fn files(dataset: &Dataset, extracted: &[(TrackShot, Impact)]) -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("impacts.csv", impacts(dataset, extracted).into_bytes()),
        ("left-out.csv", left_out(dataset).into_bytes()),
        ("dataset.toml", manifest(dataset).into_bytes()),
    ]
}

/// One SVG a shot, named after it.
pub fn pictures(
    extracted: &[(TrackShot, Impact)],
    scene: &Scene,
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let names: Vec<String> = extracted.iter().map(|(shot, _)| shot.name.clone()).collect();
    let folders = super::group_folders(&names);
    let draw = |((shot, impact), name): (&(TrackShot, Impact), &String)| {
        Ok((format!("{name}.svg"), track::svg(shot, impact, scene)?.into_bytes()))
    };
    extracted.iter().zip(&folders).map(draw).collect()
}

/// The one spin that all shots have, if that is stun or natural roll.
fn assumed(dataset: &Dataset) -> Option<&'static str> {
    let all = |spin: Spin| dataset.shots.iter().all(|shot| shot.spin == spin);
    match () {
        () if all(Spin::NaturalRoll) => Some("natural-roll"),
        () if all(Spin::Stun) => Some("stun"),
        () => None,
    }
}

fn manifest(dataset: &Dataset) -> String {
    let text = |text: &str| toml::Value::from(text).to_string();
    let mut manifest = format!(
        "# Extracted from {} by caromfit {}.\nname = {}\nkind = \"impacts\"\nfiles = [\"impacts.csv\"]\n",
        folder_name(&dataset.path.file_name().unwrap_or_default().to_string_lossy()),
        env!("CARGO_PKG_VERSION"),
        text(&format!("{}-impacts", dataset.name)),
    );
    for (key, value) in [("cloth", &dataset.cloth), ("source", &dataset.source)] {
        if let Some(value) = value {
            _ = writeln!(manifest, "{key} = {}", text(value));
        }
    }
    let ball = dataset.ball;
    _ = write!(
        manifest,
        "\n[ball]\nradius_m = {:?}\nmass_kg = {:?}\ninertia = {:?}\n\n[cue_spin]\nassume = \"{}\"\n",
        ball.radius,
        ball.mass,
        ball.inertia,
        assumed(dataset).unwrap_or("measured")
    );
    manifest
}

fn impacts(dataset: &Dataset, extracted: &[(TrackShot, Impact)]) -> String {
    let spins = assumed(dataset).is_none();
    let mut columns = vec!["nx", "ny", "cue_vx", "cue_vy"];
    if spins {
        columns.extend(["cue_wx", "cue_wy", "cue_wz"]);
    }
    columns.extend(["cue_vx_after", "cue_vy_after", "obj_vx_after", "obj_vy_after"]);
    let mut table = String::from("shot");
    for column in &columns {
        _ = write!(table, ",{column}");
        if !column.starts_with("cue_w") {
            _ = write!(table, ",{column}_sd");
        }
    }
    table.push_str(",impact_time_s,position_sd_mm,reduced_chi2,frames_left_out\n");
    for (shot, (_, impact)) in dataset.shots.iter().zip(extracted) {
        table.push_str(&super::csv::quoted(&shot.name));
        let Before::Impact { normal, velocity } = shot.before else { continue };
        let mut cell =
            |m: &Measured| _ = write!(table, ",{},{}", m.value, m.sd.unwrap_or(f64::NAN).max(LEAST_SD));
        normal.iter().chain(&velocity).for_each(&mut cell);
        if spins {
            let spin = spin(shot, dataset.ball.radius);
            _ = write!(table, ",{},{},{}", spin.x, spin.y, spin.z);
        }
        for measurement in &shot.after {
            let Measured { value, sd } = measurement.measured;
            _ = write!(table, ",{value},{}", sd.unwrap_or(f64::NAN).max(LEAST_SD));
        }
        _ = writeln!(
            table,
            ",{},{},{},{}",
            impact.values[Quantity::Time as usize],
            1e3 * impact.position_sd,
            impact.reduced_chi2,
            impact.outliers
        );
    }
    table
}

/// Standard deviations in a file are positive.
const LEAST_SD: f64 = 1e-12;

/// In the table frame.
fn spin(shot: &Shot, radius: f64) -> Vec3 {
    match (shot.spin, shot.before) {
        (Spin::Measured { spin, .. }, _) => spin,
        (Spin::NaturalRoll, Before::Impact { velocity: [x, y], .. }) => {
            BallState::natural_roll(Vec3::new(x.value, y.value, 0.0), radius).spin
        }
        _ => Vec3::zeros(),
    }
}

fn left_out(dataset: &Dataset) -> String {
    let mut table = String::from("shot,reason\n");
    for (shot, reason) in &dataset.left_out {
        _ = writeln!(table, "{},{}", super::csv::quoted(shot), super::csv::quoted(reason));
    }
    table
}
