//! The shots of a report one by one, and the points of a plot that lead to them.

use std::collections::HashMap;

use super::content::{Figure, Shot, Table};
use super::number::plain;
use crate::fit::{Fit, Residual};

/// The picture of a shot's track: its name and the SVG.
pub type ShotPicture = (String, String);

/// Pictures of footage that a report shows.
#[derive(Clone, Debug, Default)]
pub struct Filmed {
    /// The tracks of the shots with the largest residuals.
    pub shots: Vec<ShotPicture>,
    /// The paths of all shots, as SVG.
    pub paths: Option<String>,
}

/// More pictures than these would make the file too large to open on a phone; those that matter most stay.
pub(crate) const MOST_PICTURES: usize = 60;

/// The shots whose pictures go into the report: those with the largest residuals.
#[must_use]
pub fn worth_drawing(fits: &[Fit]) -> Vec<String> {
    let of = |fit: &Fit| {
        let shots = shot_list(named(fit), &[]);
        shots.into_iter().take(MOST_PICTURES).map(|shot| shot.name).collect::<Vec<_>>()
    };
    fits.iter().flat_map(of).collect()
}

/// Each residual with the name of its shot.
pub(super) fn named(fit: &Fit) -> impl Iterator<Item = (String, &Residual)> {
    fit.residuals.iter().map(|residual| (residual.shot.clone(), residual))
}

/// The shots that are listed in a report, those with the largest residuals first: each residual with the name of its
/// shot.
pub(super) fn shot_list<'a>(
    residuals: impl Iterator<Item = (String, &'a Residual)>,
    pictures: &[ShotPicture],
) -> Vec<Shot> {
    let mut all: Vec<(String, f64, Vec<&Residual>)> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for (name, residual) in residuals {
        let place = *known.entry(name).or_insert_with_key(|name| {
            all.push((name.clone(), 0.0, Vec::new()));
            all.len() - 1
        });
        let (_, largest, own) = &mut all[place];
        *largest = largest.max(size(residual));
        own.push(residual);
    }
    let mut worst: Vec<usize> = (0..all.len()).collect();
    worst.sort_by(|a, b| all[*b].1.total_cmp(&all[*a].1));
    let shot = |(rank, place): (usize, usize)| {
        let (name, largest, own) = &all[place];
        let head = ["", "measured", "predicted", "sd", "residual/sd"];
        let table = Table::new(head, own.iter().map(|residual| row(residual))).with_numbers(1..head.len());
        let picture = pictures.iter().find(|(drawn, _)| rank < MOST_PICTURES && drawn == name);
        let figure =
            picture.map(|(_, svg)| Figure { alt: format!("track of shot {name}"), svg: svg.clone() });
        Shot { id: format!("shot-{}", place + 1), name: name.clone(), table, figure, largest: *largest }
    };
    worst.into_iter().take(10 * MOST_PICTURES).enumerate().map(shot).collect()
}

/// How far a residual is off, in standard deviations; 0 where that is not known.
pub(super) fn size(residual: &Residual) -> f64 {
    if residual.standardized.is_finite() { residual.standardized.abs() } else { 0.0 }
}

fn row(residual: &Residual) -> Vec<String> {
    let observable = residual.observable;
    let number = |si: f64, digits| plain(si / observable.unit_si(), digits);
    vec![
        format!("{} {}", observable.label(), observable.unit()).trim_end().to_owned(),
        number(residual.measured, 5),
        number(residual.predicted, 5),
        number(residual.sd, 2),
        format!("{:+.2}", residual.standardized),
    ]
}

/// A picture with a place over each of its points (x, y, index of the residual) that names its shot when the pointer is
/// there, and leads to it; `of` tells a residual's shot and itself.
pub(super) fn with_spots<'a>(
    svg: &str,
    points: &[(i32, i32, usize)],
    shots: &[Shot],
    of: impl Fn(usize) -> Option<(String, &'a Residual)>,
) -> String {
    let ids: HashMap<&str, &str> = shots.iter().map(|shot| (shot.name.as_str(), shot.id.as_str())).collect();
    let picture = svg.trim_end().strip_suffix("</svg>").unwrap_or(svg);
    let mut text = picture.to_owned();
    for (x, y, index) in points {
        let Some((name, residual)) = of(*index) else { continue };
        let words = format!(
            "shot {name}: {}, {:+.2} standard deviations",
            residual.observable.label(),
            residual.standardized
        );
        let place = format!(
            "<circle class=\"spot\" cx=\"{x}\" cy=\"{y}\" r=\"8\"><title>{}</title></circle>",
            escaped(&words)
        );
        match ids.get(name.as_str()) {
            Some(id) => text.push_str(&format!("<a href=\"#{id}\">{place}</a>\n")),
            None => text.push_str(&format!("{place}\n")),
        }
    }
    text + "</svg>"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
