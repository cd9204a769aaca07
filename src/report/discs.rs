//! Extracted impacts of discs: a table, what was left out, and a picture of each shot.

use super::ReportError;
use super::csv::{line, quoted};
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
        let name = if discs.in_seconds { name.to_owned() } else { per_frame(name) };
        [name.clone(), name + "_sd"]
    };
    let fixed =
        "mass_ratio_from,position_sd_mm,reduced_chi2,frames_used,frames_left_out,outcome,verdict,doubts";
    let own = Quantity::ALL.into_iter().flat_map(name);
    let head = ["shot".to_owned()].into_iter().chain(own).chain([fixed.to_owned()]);
    let row = |(shot, impact): &(TrackShot, DiscImpact)| {
        let mut row = vec![quoted(&shot.name).into_owned()];
        for quantity in Quantity::ALL {
            let unit = if quantity == Quantity::ContactDistance { 1e-3 } else { 1.0 };
            let text = |si: f64| (si / unit).to_string();
            let found = impact.get(quantity);
            // what is stated has no error here
            row.extend(found.map_or_else(Default::default, |found| {
                [text(found.value), found.sd.map_or_else(String::new, text)]
            }));
        }
        let doubts: Vec<String> = impact.doubts.iter().map(Doubt::to_string).collect();
        row.extend([
            if discs.masses.is_some() { "masses" } else { "momentum" }.to_owned(),
            (1e3 * impact.position_sd).to_string(),
            impact.misfit.to_string(),
            impact.frames.iter().sum::<usize>().to_string(),
            impact.outliers.to_string(),
            if impact.stuck.is_some() { "stick" } else { "part" }.to_owned(),
            if impact.doubts.is_empty() { "good" } else { "doubtful" }.to_owned(),
            quoted(&doubts.join("; ")).into_owned(),
        ]);
        line(row)
    };
    std::iter::once(line(head)).chain(extracted.iter().map(row)).collect()
}

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
                window: impact.window,
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
