//! The shots of a report one by one, and their paths.

use rayon::prelude::*;
use serde::Serialize;
use serde_json::{Value, json};

use super::document::ByName;
use super::templates::for_script;
use crate::fit::{FittedFilm, Residual};
use crate::measurement::number::plain;
use crate::problem::Impact;

/// Largest number of shots listed: more would make the file too large for a phone.
const MOST_LISTED: usize = 600;
/// Largest number of shots whose paths are drawn, for the same reason.
const MOST_DRAWN: usize = 60;

/// Largest number of frames of a ball that are drawn of a shot.
const MOST_FRAMES: usize = 120;

/// One shot's measured values against the model.
#[derive(Serialize)]
pub(super) struct Shot {
    /// A key that is unique in the report, by which pictures refer to it.
    id: String,
    name: String,
    /// Names of the values with their unit, measured and predicted value, standard deviation and
    /// standardized residual.
    rows: Vec<[String; 5]>,
    /// Its place in the data.
    place: usize,
    /// Its largest standardized residual, by absolute value, and the sum of the squares of all.
    largest: f64,
    chi2: f64,
}

/// Returns the shots of a report, those with the largest residuals first: each residual with the
/// name of its shot.
pub(super) fn shot_list<'a>(residuals: impl Iterator<Item = (String, &'a Residual)>) -> Vec<Shot> {
    let mut all: ByName<Vec<&Residual>> = ByName::new();
    for (name, residual) in residuals {
        all.entry(name).or_default().push(residual);
    }
    let shot = |(place, (name, own)): (usize, (String, Vec<&Residual>))| {
        let rows = own.iter().map(|residual| row(residual)).collect();
        let known = own.iter().map(|residual| residual.standardized.abs()).filter(|z| z.is_finite());
        let (largest, chi2) = known.fold((0.0_f64, 0.0), |(most, sum), z| (most.max(z), sum + z * z));
        Shot { id: format!("shot-{}", place + 1), name, rows, place, largest, chi2 }
    };
    let mut shots: Vec<Shot> = all.into_iter().enumerate().map(shot).collect();
    shots.sort_by(|a, b| b.largest.total_cmp(&a.largest));
    shots.truncate(MOST_LISTED);
    shots
}

fn row(residual: &Residual) -> [String; 5] {
    let observable = residual.observable;
    let number = |si: f64, digits| plain(si / observable.unit_si(), digits);
    [
        format!("{} {}", observable.label(), observable.unit()).trim_end().to_owned(),
        number(residual.measured, 5),
        number(residual.predicted, 5),
        number(residual.sd, 2),
        format!("{:+.2}", residual.standardized),
    ]
}

/// Returns the paths of the shots with the largest residuals, for the script of a page; `None`
/// without any.
pub(super) fn tracks(film: &FittedFilm, shots: &[Shot]) -> Option<String> {
    let worst = &shots[..shots.len().min(MOST_DRAWN)];
    let draw = |shot: &Shot| track(film, shot, film.impact(&shot.name)?);
    let drawn: Vec<Value> = worst.par_iter().filter_map(draw).collect();
    (!drawn.is_empty()).then(|| for_script(&drawn))
}

/// Returns the paths of a shot in whole numbers, that a page has room for: lengths in 0.1 mm. A
/// frame of a ball is its time from the impact (0.1 ms), its place, and that less the fitted place
/// (µm). `None` if its frames do not show an impact.
fn track(film: &FittedFilm, shot: &Shot, impact: &Impact) -> Option<Value> {
    let shown = film.solution.shown_paths(impact)?;
    let whole = |value: f64, unit: f64| (value / unit).round() as i64;
    let frames = |ball: usize| -> Vec<[i64; 5]> {
        let seen = &shown.seen[ball];
        let frame = |(time, place): &(f64, [f64; 2])| {
            let fitted = shown.paths.place(ball, *time);
            let [x, y] = place.map(|x| whole(x, 1e-4));
            let [off_x, off_y] = [0, 1].map(|axis| whole(place[axis] - fitted[axis], 1e-6));
            [whole(time - impact.time, 1e-4), x, y, off_x, off_y]
        };
        seen.iter().step_by(seen.len().div_ceil(MOST_FRAMES).max(1)).map(frame).collect()
    };
    let contact = [0, 1].map(|ball| shown.paths.place(ball, impact.time).map(|x| whole(x, 1e-4)));
    Some(json!({
        "id": shot.id,
        "name": shot.name,
        "chi2": plain(impact.reduced_chi2, 3),
        "largest": plain(shot.largest, 2),
        "radius": whole(film.solution.radius(), 1e-4),
        "contact": contact,
        "balls": [frames(0), frames(1)],
    }))
}
