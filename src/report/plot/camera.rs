//! A figure of a camera: how far its corrections move what the film shows.

use super::axis::ends;
use super::{Figure, Mark, Panel, Point, cm};
use crate::fit::FoundCamera;

/// Height of the panel, pixels.
const ROW: u32 = 900;

/// Arrows along either side.
const ARROWS: usize = 9;

/// The longest arrow is at most this part of the figure; arrows are enlarged by a round number for it.
const LONGEST: f64 = 0.12;
const ENLARGED: [f64; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// Returns the figure, which is empty if nothing was corrected.
pub fn figure(found: &FoundCamera) -> Figure {
    let mut figure = Figure::new("Camera");
    if found.corrections.is_empty() || found.contacts.is_empty() {
        return figure;
    }
    let sides = [0, 1].map(|axis| ends(found.contacts.iter().map(|place| place[axis])));
    let middle = sides.map(|[low, high]| 0.5 * (low + high));
    let half = 0.6 * (sides[0][1] - sides[0][0]).max(sides[1][1] - sides[1][0]).max(0.05);
    let along = |axis: usize, i: usize| middle[axis] + half * (2.0 * i as f64 / (ARROWS - 1) as f64 - 1.0);
    let places = (0..ARROWS * ARROWS).map(|n| [along(0, n / ARROWS), along(1, n % ARROWS)]);
    let arrows: Vec<([f64; 2], [f64; 2])> = places
        .map(|table| (found.film(table), table))
        .filter(|(film, _)| film.iter().all(|x| x.is_finite()))
        .map(|(film, table)| (film, [table[0] - film[0], table[1] - film[1]]))
        .collect();
    let longest = arrows.iter().map(|(_, by)| by[0].hypot(by[1])).fold(0.0, f64::max);
    let fits = |by: &&f64| **by * longest <= LONGEST * 2.0 * half;
    let enlarged = ENLARGED.iter().rev().find(fits).copied().unwrap_or(1.0);
    let about = format!(
        "points: where the {} met; arrows: by how much positions were moved, {enlarged} times enlarged (at most {:.2} mm)",
        if found.of_discs { "discs" } else { "balls" },
        1e3 * longest
    );
    let title = "Places in the film, at the scale that is stated";
    let mut panel = Panel::of_places(title, about);
    let contacts = found.contacts.iter().map(|place| Point { opacity: 0.45, ..Point::new(cm(*place), 0) });
    panel.points(contacts);
    panel.marks.extend(arrows.into_iter().map(|(film, by)| Mark::Arrow {
        from: cm(film),
        to: cm([0, 1].map(|i| film[i] + enlarged * by[i])),
    }));
    figure.add_rows(ROW, 1, vec![panel]);
    figure
}
