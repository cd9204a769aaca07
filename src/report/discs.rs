//! Extracted impacts of discs: a table, what was left out, and a picture of each shot.

use super::ReportError;
use super::csv::Table;
use super::extracted;
use super::number::{plain, with_error};
use super::plot::track::Tracks;
use crate::measurement::dataset::Dataset;
use crate::measurement::track::TrackShot;
use crate::physics::disc::Discs;
use crate::problem::{DiscImpact, Doubt, Quantity};

/// Its name where frames stand for seconds.
fn per_frame(name: &str) -> String {
    let moves =
        ["slip", "slip_after", "closing_speed"].contains(&name) || name.contains("_v") || name.contains("_w");
    match name {
        "impact_time_s" => "impact_frame".to_string(),
        _ if moves => format!("{name}_per_frame"),
        _ => name.to_string(),
    }
}

/// discs.csv and left-out.csv.
#[must_use]
pub fn files(
    dataset: &Dataset,
    discs: &Discs,
    extracted: &[(TrackShot, DiscImpact)],
) -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("left-out.csv", extracted::left_out(dataset).into_bytes()),
        ("discs.csv", table(discs, extracted).into_bytes()),
    ]
}

fn table(discs: &Discs, extracted: &[(TrackShot, DiscImpact)]) -> String {
    let name = |quantity: Quantity| {
        let name = quantity.column();
        if discs.in_seconds { name.to_owned() } else { per_frame(name) }
    };
    let measured: String = Quantity::ALL.map(|quantity| format!("{0},{0}_sd,", name(quantity))).concat();
    let mut table = Table::new(&format!("shot,{measured}{OTHERS}"));
    for (shot, impact) in extracted {
        table.begin();
        table.add("shot", &shot.name);
        for quantity in Quantity::ALL {
            let unit = if quantity == Quantity::ContactDistance { 1e-3 } else { 1.0 };
            let Some(found) = impact.get(quantity) else { continue };
            table.add(&name(quantity), (found.value / unit).to_string());
            if let Some(sd) = found.sd {
                table.add(&format!("{}_sd", name(quantity)), (sd / unit).to_string());
            }
        }
        let doubts: Vec<String> = impact.doubts.iter().map(Doubt::to_string).collect();
        let others = [
            if discs.masses.is_some() { "masses" } else { "momentum" }.to_owned(),
            (1e3 * impact.position_sd).to_string(),
            impact.misfit.to_string(),
            impact.frames.iter().sum::<usize>().to_string(),
            impact.outliers.to_string(),
            if impact.stuck.is_some() { "stick" } else { "part" }.to_owned(),
            if doubts.is_empty() { "good" } else { "doubtful" }.to_owned(),
            doubts.join("; "),
        ];
        for (column, cell) in OTHERS.split(',').zip(others) {
            table.add(column, cell);
        }
    }
    table.text()
}

/// The columns behind what was measured, which has no error here if it is stated.
const OTHERS: &str =
    "mass_ratio_from,position_sd_mm,reduced_chi2,frames_used,frames_left_out,outcome,verdict,doubts";

/// A picture of each shot: file name and SVG.
pub fn pictures(
    discs: &Discs,
    extracted: &[(TrackShot, DiscImpact)],
) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    extracted::drawn(
        extracted,
        |(shot, _)| &shot.name,
        |(shot, impact)| {
            let tracks = Tracks {
                name: &shot.name,
                seen: [&shot.cue, &shot.object].map(|samples| {
                    let [from, to] = impact.window;
                    let used = samples.iter().filter(|sample| (from..=to).contains(&sample.t));
                    used.map(|sample| (sample.t, [sample.x, sample.y])).collect()
                }),
                summary: summary(impact),
                names: ["first disc", "second disc"],
                time: impact.get(Quantity::Time).map_or(f64::NAN, |time| time.value),
                clock: if discs.in_seconds {
                    ("time from the impact (ms)", 1e-3)
                } else {
                    ("frames from the impact", 1.0)
                },
                position_sd: impact.position_sd,
                radii: impact.radii,
                place: &|disc, time| impact.place(disc, time),
            };
            tracks.figure()
        },
    )
}

/// The main numbers of an impact of discs, in a line.
#[must_use]
pub fn summary(impact: &DiscImpact) -> String {
    let text = |name: &str, quantity: Quantity| {
        let measured = impact.get(quantity)?;
        Some(match measured.sd {
            Some(sd) => format!("{name} {}", with_error(measured.value, sd)),
            None => format!("{name} {} (stated)", plain(measured.value, 4)),
        })
    };
    let parts = [
        // of discs that stick, the remark says it
        text("e", Quantity::Restitution).filter(|_| impact.stuck.is_none()),
        text("J_t/J_n", Quantity::ImpulseRatio),
        text("mass ratio", Quantity::MassRatio),
        Some(format!("noise {:.3} mm", 1e3 * impact.position_sd)),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// Remarks on a shot, a line each: that its discs stick together, and what makes it doubtful.
#[must_use]
pub fn remarks(impact: &DiscImpact) -> Vec<String> {
    let stuck = impact.stuck.iter().map(|stuck| format!("{}.", stuck.sentence()));
    stuck.chain(impact.doubts.iter().map(|doubt| format!("doubtful: {doubt}."))).collect()
}
