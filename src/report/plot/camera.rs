//! A picture of a camera: how far its corrections move what the film shows.

use super::axis::Axis;
use super::frame::{Frame, Rect};
use super::picture::{GREY, Picture};
use super::series::color;
use crate::fit::FoundCamera;

const WIDTH: i32 = 760;
const HEIGHT: i32 = 800;

/// Arrows along either side.
const ARROWS: usize = 9;

/// The longest arrow is at most this part of the picture; arrows are enlarged by a round number for it.
const LONGEST: f64 = 0.1;
const ENLARGED: [f64; 10] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];

/// The picture; `None` where nothing was corrected.
pub fn picture(found: &FoundCamera, dataset: &str) -> Option<Picture> {
    if !found.corrects() || found.contacts.is_empty() {
        return None;
    }
    let mut picture = Picture::new(dataset, WIDTH, HEIGHT);
    let cm = |metres: f64| 100.0 * metres;
    let ends = |axis: usize| {
        let values = found.contacts.iter().map(|place| place[axis]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let sides = [ends(0), ends(1)];
    let middle = sides.map(|[low, high]| 0.5 * (low + high));
    let half = 0.6 * (sides[0][1] - sides[0][0]).max(sides[1][1] - sides[1][0]).max(0.05);
    let along = |axis: usize, i: usize| middle[axis] + half * (2.0 * i as f64 / (ARROWS - 1) as f64 - 1.0);
    let mut arrows = Vec::new();
    for i in 0..ARROWS {
        for j in 0..ARROWS {
            let table = [along(0, i), along(1, j)];
            let film = found.film(table);
            if film.iter().all(|x| x.is_finite()) {
                arrows.push((film, [table[0] - film[0], table[1] - film[1]]));
            }
        }
    }
    let longest = arrows.iter().map(|(_, by)| by[0].hypot(by[1])).fold(0.0, f64::max);
    let fits = |by: &&f64| **by * longest <= LONGEST * 2.0 * half;
    let enlarged = ENLARGED.iter().rev().find(fits).copied().unwrap_or(1.0);
    picture.title("Camera", 32);
    let title = format!(
        "arrows: by how much positions were moved, {enlarged} times enlarged (at most {:.2} mm)",
        1e3 * longest
    );
    picture.label(&title, (22, 66), GREY);
    let axis = |name: &'static str, axis: usize| {
        Axis::around(name, [middle[axis] - 1.15 * half, middle[axis] + 1.15 * half].map(cm))
    };
    let rect = Rect { left: 10, top: 84, right: WIDTH - 10, bottom: HEIGHT - 10 };
    let remarks = [format!("points: where the {} met", if found.of_discs { "discs" } else { "balls" })];
    let title = "The film, in metres as they are stated";
    let mut frame = Frame::new(&mut picture, rect, title, &remarks, (axis("x (cm)", 0), axis("y (cm)", 1)));
    for place in &found.contacts {
        frame.marker((cm(place[0]), cm(place[1])), 0, 0.45);
    }
    for (film, by) in arrows {
        let [x, y] = [0, 1].map(|i| cm(film[i] + enlarged * by[i]));
        frame.line(&[(cm(film[0]), cm(film[1])), (x, y)], color(1), 2);
        // a head that is visible on short arrows
        frame.dot(x, y, 3, color(1));
    }
    frame.axes();
    Some(picture)
}
