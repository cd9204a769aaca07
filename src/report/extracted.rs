//! The measurements of every shot, as `caromfit extract` writes it: impacts of balls as a data set
//! of kind `impacts`, those of discs as a table, with what was left out and a picture of each shot.

use std::path::Path;

use rayon::prelude::*;
use serde_json::json;

use super::plot::{Tracks, of_balls};
use super::write::Staged;
use super::{ReportError, csv, folder_name, group_folders};
use crate::fit::FittedFilm;
use crate::io::balls;
use crate::measurement::dataset::{Before, Dataset, Measured};
use crate::measurement::number::{plain, with_error};
use crate::measurement::spin::Spin;
use crate::measurement::track::{Sample, TrackShot};
use crate::physics::disc::Discs;
use crate::problem::{DiscImpact, Impact};

/// Writes dataset.toml, impacts.csv and left-out.csv, and on request the pictures of the shots.
pub(crate) fn write_balls(
    dataset: &Dataset,
    film: &FittedFilm,
    are_drawn: bool,
    folder: &Path,
) -> Result<(), ReportError> {
    if are_drawn {
        draw(&film.impacts, |impact| of_balls(film, impact), folder)?;
    }
    Staged::new(folder)?
        .add("impacts.csv", impacts(dataset, &film.impacts))?
        .add("left-out.csv", left_out(dataset))?
        .add("dataset.toml", manifest(dataset))?
        .put()
}

/// Writes discs.csv and left-out.csv, and on request the pictures of the shots.
pub(crate) fn write_discs(
    dataset: &Dataset,
    extracted: &[(TrackShot, DiscImpact)],
    discs: &Discs,
    are_drawn: bool,
    folder: &Path,
) -> Result<(), ReportError> {
    if are_drawn {
        draw(extracted, |(shot, impact)| Some(of_discs(discs, shot, impact)), folder)?;
    }
    Staged::new(folder)?
        .add("left-out.csv", left_out(dataset))?
        .add("discs.csv", discs_table(discs, extracted))?
        .put()
}

fn of_discs<'a>(discs: &Discs, shot: &'a TrackShot, impact: &'a DiscImpact) -> Tracks<'a> {
    let [from, to] = impact.window;
    let used = |samples: &[Sample]| {
        let used = samples.iter().filter(|sample| (from..=to).contains(&sample.t));
        used.map(|sample| (sample.t, [sample.x, sample.y])).collect()
    };
    let in_seconds = ("time from the impact (ms)", 1e-3);
    Tracks {
        name: &shot.name,
        seen: [used(&shot.cue), used(&shot.object)],
        summary: summary(impact),
        names: ["first disc", "second disc"],
        time: impact.get("impact_time_s").map_or(f64::NAN, |time| time.value),
        clock: if discs.in_seconds { in_seconds } else { ("frames from the impact", 1.0) },
        position_sd: impact.position_sd,
        radii: impact.radii,
        place: Box::new(|disc, time| impact.place(disc, time)),
    }
}

/// Draws each shot in a file that is named after it.
fn draw<'a, T: Sync>(
    extracted: &'a [T],
    tracks: impl Fn(&'a T) -> Option<Tracks<'a>> + Sync,
    folder: &Path,
) -> Result<(), ReportError> {
    let drawn = extracted.par_iter().filter_map(|shot| {
        let tracks = tracks(shot)?;
        Some(tracks.figure().svg().map(|(svg, _)| (tracks.name.to_owned(), svg)))
    });
    let (names, drawn) = drawn.collect::<Result<(Vec<_>, Vec<_>), ReportError>>()?;
    let mut files = group_folders(&names).into_iter().zip(drawn);
    let staged = Staged::new(&folder.join("shots"))?;
    files.try_fold(staged, |staged, (name, svg)| staged.add(&format!("{name}.svg"), svg))?.put()
}

/// Returns the spin that all shots have, if that is stun or natural roll.
fn assumed(dataset: &Dataset) -> Option<&'static str> {
    let all = |spin: &Spin| dataset.shots.iter().all(|shot| shot.spin == *spin);
    [Spin::NaturalRoll, Spin::Stun].into_iter().find(all).map(Spin::name)
}

/// A comment on the standard deviations of extracted impacts.
const ABOUT_ERRORS: &str = "Errors of the columns of one shot, and of all shots by the cloth that they
# share, are correlated, which this table does not hold. Its standard deviations are wide enough for
# means of all shots: fit the film for errors of parameters.";

fn manifest(dataset: &Dataset) -> String {
    // the dataset.toml of the tracks; empty for a data set that a program made
    let stated = std::fs::read_to_string(&dataset.path).unwrap_or_default();
    let mut stated: toml::Table = stated.trim_start_matches('\u{feff}').parse().unwrap_or_default();
    let number = |value: &toml::Value| value.as_float().or_else(|| Some(value.as_integer()? as f64));
    let poisson = stated.get("ball").and_then(|ball| ball.get("poisson")).and_then(number);
    let balls = balls::text(&dataset.ball, dataset.object.as_ref(), poisson);
    let mut manifest: toml::Table = balls.parse().unwrap_or_default();
    let mut add = |key: &str, value: toml::Value| manifest.insert(key.to_owned(), value);
    add("name", format!("{}-impacts", dataset.name).into());
    add("kind", "impacts".into());
    add("files", vec!["impacts.csv"].into());
    for (key, value) in [("cloth", &dataset.cloth), ("balls", &dataset.balls), ("source", &dataset.source)] {
        value.as_deref().and_then(|value| add(key, value.into()));
    }
    let spin = toml::Table::from_iter([("assume".to_owned(), assumed(dataset).unwrap_or("measured").into())]);
    add("cue_spin", spin.into());
    // so that the impacts are fitted the same way
    stated.remove("fit").and_then(|fit| add("fit", fit));
    let (folder, version) = (dataset.path.file_name().unwrap_or_default(), env!("CARGO_PKG_VERSION"));
    let folder = folder_name(&folder.to_string_lossy());
    format!("# Extracted from {folder} by caromfit {version}. {ABOUT_ERRORS}\n{manifest}")
}

fn impacts(dataset: &Dataset, extracted: &[Impact]) -> String {
    let is_assumed = assumed(dataset).is_some();
    // a mean of all shots has the whole error of what they share
    let shared_part = extracted.iter().map(|impact| impact.shared_part).sum::<f64>();
    let widening = (1.0 + shared_part).sqrt();
    let mut rows = Vec::new();
    for impact in extracted {
        let shot = &impact.shot;
        let Before::Impact { normal, velocity } = &shot.before else { continue };
        let before = ["nx", "ny", "cue_vx", "cue_vy"].into_iter().zip(normal.iter().chain(velocity).copied());
        let after = shot.after.iter().map(|after| (after.observable.column(), after.measured));
        let mut measured: Vec<(&str, Measured)> = before.chain(after).collect();
        if let Spin::Measured { spin, sd } = shot.spin {
            let axes = ["cue_wx", "cue_wy", "cue_wz"].into_iter().enumerate();
            measured.extend(axes.map(|(i, name)| (name, Measured { value: spin[i], sd: sd[i] })));
        }
        let mut row = csv::row_of(json!({ "shot": shot.name }));
        for (column, Measured { value, sd }) in measured {
            row.insert(column.to_owned(), value.into());
            // standard deviations in a file are positive
            row.insert(format!("{column}_sd"), (widening * sd.unwrap_or(0.0)).max(f64::EPSILON).into());
        }
        if !is_assumed {
            row.insert("cue_spin".to_owned(), shot.spin.name().into());
        }
        row.extend(csv::row_of(json!({
            "impact_time_s": impact.time,
            "position_sd_mm": 1e3 * impact.position_sd,
            "reduced_chi2": impact.reduced_chi2,
            "frames_left_out": impact.outliers,
        })));
        row.extend(shot.labels.iter().map(|(column, label)| (column.clone(), label.as_str().into())));
        rows.push(row);
    }
    csv::table("", &rows)
}

fn left_out(dataset: &Dataset) -> String {
    let row = |(shot, reason): &(String, String)| csv::row_of(json!({ "shot": shot, "reason": reason }));
    csv::table("shot,reason", &dataset.left_out.iter().map(row).collect::<Vec<_>>())
}

/// Returns the name of a column of discs if frames stand for seconds.
fn per_frame(name: &str) -> String {
    let moves =
        ["slip", "slip_after", "closing_speed"].contains(&name) || name.contains("_v") || name.contains("_w");
    match name {
        "impact_time_s" => "impact_frame".to_string(),
        _ if moves => format!("{name}_per_frame"),
        _ => name.to_string(),
    }
}

fn discs_table(discs: &Discs, extracted: &[(TrackShot, DiscImpact)]) -> String {
    let name = |column: &str| if discs.in_seconds { column.to_owned() } else { per_frame(column) };
    let row = |(shot, impact): &(TrackShot, DiscImpact)| {
        let mut row = csv::row_of(json!({ "shot": shot.name }));
        for (column, measured) in &impact.values {
            row.insert(name(column), measured.map(|measured| measured.value).into());
            // what is stated has no error here
            row.insert(format!("{}_sd", name(column)), measured.and_then(|measured| measured.sd).into());
        }
        row.extend(csv::row_of(json!({
            "mass_ratio_from": if discs.masses.is_some() { "masses" } else { "momentum" },
            "position_sd_mm": 1e3 * impact.position_sd,
            "reduced_chi2": impact.misfit,
            "frames_used": impact.frames,
            "frames_left_out": impact.outliers,
            "outcome": if impact.stuck.is_some() { "stick" } else { "part" },
            "verdict": if impact.doubts.is_empty() { "good" } else { "doubtful" },
            "doubts": impact.doubts.join("; "),
        })));
        row
    };
    csv::table("", &extracted.iter().map(row).collect::<Vec<_>>())
}

/// Returns what there is to say of the impacts of discs, a line each.
pub(crate) fn lines(extracted: &[(TrackShot, DiscImpact)]) -> Vec<String> {
    let describe = |(shot, impact): &(TrackShot, DiscImpact)| {
        let stuck = impact.stuck.iter().map(|stuck| format!("{}.", stuck.sentence()));
        let doubts = impact.doubts.iter().map(|doubt| format!("doubtful: {doubt}."));
        let lines = std::iter::once(summary(impact)).chain(stuck).chain(doubts);
        lines.map(|line| format!("shot {}: {line}", shot.name)).collect::<Vec<_>>()
    };
    extracted.iter().flat_map(describe).collect()
}

/// Returns the main numbers of an impact of discs; of discs that stick, another line has e.
fn summary(impact: &DiscImpact) -> String {
    let quantities = [("e", "e"), ("J_t/J_n", "impulse_ratio"), ("mass ratio", "mass_ratio")];
    let mut text = String::new();
    for (name, column) in quantities.into_iter().skip(usize::from(impact.stuck.is_some())) {
        text += &match impact.get(column) {
            Some(Measured { value, sd: Some(sd) }) => format!("{name} {}, ", with_error(value, sd)),
            Some(Measured { value, .. }) => format!("{name} {} (stated), ", plain(value, 4)),
            None => String::new(),
        };
    }
    text + &format!("noise {:.3} mm", 1e3 * impact.position_sd)
}
