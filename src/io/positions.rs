//! Positions of tracked balls as one long table.

use polars::prelude::{DataFrame, PolarsResult, df};

use crate::measurement::dataset::Dataset;
use crate::measurement::track::{Sample, TrackShot, TrackedBall};

/// Returns the positions of all filmed shots of a data set as one table, calibrated and repaired,
/// with a row for each point in each frame in which it is seen. Tables of velocities or angles have
/// no rows.
///
/// The columns are those of a long table of tracks (`caromfit help formats`): shot, frame (its
/// number at the camera's rate), t in s, ball (cue or object), point (centre, or the name of a
/// marker), x and y in m, x_sd and y_sd in m, or null if they are not stated.
///
/// ```
/// let dataset = caromfit::io::load("data/pucks-qualisys".as_ref())?;
/// let positions = caromfit::io::positions(&dataset)?;
/// assert_eq!(positions.column("x")?.f64()?.null_count(), 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// There are more rows than a table can hold.
pub fn positions(dataset: &Dataset) -> PolarsResult<DataFrame> {
    of_shots(dataset.tracks.iter().flat_map(|tracks| &tracks.shots))
}

/// Returns the positions of some shots as one table.
pub(crate) fn of_shots<'a>(shots: impl Iterator<Item = &'a TrackShot>) -> PolarsResult<DataFrame> {
    let mut names: [Vec<&str>; 3] = Default::default();
    let mut frames: Vec<i64> = Vec::new();
    let mut numbers: [Vec<Option<f64>>; 5] = Default::default();
    for shot in shots {
        let centres = [("cue", "centre", &shot.cue), ("object", "centre", &shot.object)];
        let markers = shot.markers.iter().map(|marker| {
            let ball = if marker.ball == TrackedBall::Cue { "cue" } else { "object" };
            (ball, marker.name.as_str(), &marker.samples)
        });
        for (ball, point, samples) in centres.into_iter().chain(markers) {
            for Sample { t, x, y, sd } in samples {
                let own = [shot.name.as_str(), ball, point];
                names.iter_mut().zip(own).for_each(|(column, name)| column.push(name));
                frames.push((t * shot.fps).round() as i64);
                let [x_sd, y_sd] = sd.map_or([None; 2], |sd| sd.map(Some));
                let own = [Some(*t), Some(*x), Some(*y), x_sd, y_sd];
                numbers.iter_mut().zip(own).for_each(|(column, number)| column.push(number));
            }
        }
    }
    let ([shot, ball, point], [t, x, y, x_sd, y_sd]) = (names, numbers);
    df!(
        "shot" => shot, "frame" => frames, "t" => t, "ball" => ball, "point" => point,
        "x" => x, "y" => y, "x_sd" => x_sd, "y_sd" => y_sd,
    )
}
