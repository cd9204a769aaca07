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
    let mut shots: Vec<Shot> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for (name, residual) in residuals {
        let (row, size) = (row(residual), size(residual));
        if let Some(shot) = known.get(&name).and_then(|index| shots.get_mut(*index)) {
            shot.table.rows.push(row);
            shot.largest = shot.largest.max(size);
        } else {
            let id = format!("shot-{}", shots.len() + 1);
            known.insert(name.clone(), shots.len());
            let head = ["", "measured", "predicted", "sd", "residual/sd"];
            let table = Table::new(head, [row]).with_numbers(1..head.len());
            shots.push(Shot { id, name, table, figure: None, largest: size });
        }
    }
    shots.sort_by(|a, b| b.largest.total_cmp(&a.largest));
    shots.truncate(10 * MOST_PICTURES);
    for shot in shots.iter_mut().take(MOST_PICTURES) {
        let svg = pictures.iter().find(|(name, _)| *name == shot.name).map(|(_, svg)| svg.clone());
        shot.figure = svg.map(|svg| Figure { alt: format!("track of shot {}", shot.name), svg });
    }
    shots
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
