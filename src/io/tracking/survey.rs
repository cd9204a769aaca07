//! Survey of a file of tracks for the draft of a dataset.toml.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use super::discs;
use super::guess::{self, Guess};
use super::input::{Context, Notes};
use super::raw::{RawShot, middle, sorted, span};
use super::read;
use super::settings::Sections;
use super::time::followed;
use super::units::Unit;
use crate::io::error::{Problem, Problems};
use crate::io::text::decode;
use crate::io::toml_file::Source;

/// The content of a file of tracks.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Survey {
    /// `long`, `tracker`, `kinovea`, `qualisys`, `json` or `columns`.
    pub(crate) format: &'static str,
    pub(crate) shots: usize,
    /// Names of tracks in the order of appearance, and the part of the time at which each moves.
    pub(crate) tracks: Vec<(String, f64)>,
    /// Frames per second that the file itself states, as the camera's.
    pub(crate) stated_fps: Option<f64>,
    /// Frames per second that the times follow, if they are in seconds.
    pub(crate) times_fps: Option<f64>,
    /// Unit of lengths that the file itself states, as dataset.toml names it.
    pub(crate) unit: Option<&'static str>,
    /// Whether the tracks are of discs: points keep their distances in two groups, or have angles.
    pub(crate) are_discs: bool,
    /// Settings of `[tracks]` without which the file cannot be read; perhaps empty.
    pub(in crate::io) guess: Guess,
    /// Cells and rows that cannot be read, as the loader reports them.
    pub(crate) problems: Vec<String>,
    /// The longer side of the box about all positions, in the unit of the file.
    pub(crate) extent: f64,
    /// First quartile, over the shots, of the least distance of the centres of two balls in a
    /// frame, in the unit of the file: frames may be wrong, and slow cameras miss the contact.
    /// `None` if a file holds one ball only.
    pub(crate) closest: Option<f64>,
}

/// Surveys a file. The columns are guessed by their names for a table in no known format, and for a
/// long one with boxes. `Err`: the problems of a file in no known format, or that cannot be read.
pub(crate) fn survey(file: &Path) -> Result<Survey, Vec<Problem>> {
    let plain = look(file, Guess::default());
    if plain.as_ref().is_ok_and(|plain| plain.format != "long") {
        return plain;
    }
    let guess = fs::read(file).ok().and_then(|bytes| guess::columns(&decode(&bytes).0));
    let guess = guess.filter(|guess| plain.is_err() || guess.has_boxes());
    guess.and_then(|guess| look(file, guess).ok()).map_or(plain, Ok)
}

fn look(file: &Path, guess: Guess) -> Result<Survey, Vec<Problem>> {
    let problems = Problems::new("");
    let source = Source { path: file, text: "", problems: &problems };
    let settings = Sections::default().check(guess.has_angles(), &source);
    let mut settings = settings;
    settings.stated.tracks.columns = guess.certain();
    let notes = Notes::default();
    let context = Context { settings: &settings, problems: &problems, notes: &notes };
    let read = read::file(file, context, true);
    let problems = problems.into_error().problems().to_vec();
    let Some(read::Tracked { shots, format, unit }) = read else { return Err(problems) };
    let clock = shots.first().map(|shot| shot.clock);
    // without rows, only names support the guess
    if clock.is_none() && guess.columns.is_empty() {
        return Err(problems);
    }
    let tracks = shots.iter().flat_map(|shot| &shot.tracks).filter(|track| !track.is_angle);
    let rows: Vec<_> = tracks.flat_map(|track| track.seen()).collect();
    let sides = [span(rows.iter().map(|row| row.x)), span(rows.iter().map(|row| row.y))];
    let closest_of_shots = sorted(shots.iter().filter_map(closest));
    let are_discs = |shot: &RawShot| shot.tracks.len() > 5 && discs::are_two(&shot.tracks);
    Ok(Survey {
        format: format.name(),
        shots: shots.len(),
        extent: sides.map(|[low, high]| high - low).into_iter().fold(0.0, f64::max),
        closest: closest_of_shots.get(closest_of_shots.len() / 4).copied(),
        tracks: beginnings(&shots),
        stated_fps: clock.and_then(|clock| clock.fps),
        unit: unit.map(Unit::name),
        are_discs: guess.has_angles() || shots.iter().any(are_discs),
        problems: problems.iter().map(ToString::to_string).collect(),
        guess,
        times_fps: shots.iter().find_map(followed),
    })
}

/// Returns the names of tracks, and the median of the parts of the time at which each moves.
fn beginnings(shots: &[RawShot]) -> Vec<(String, f64)> {
    let mut tracks: Vec<(String, Vec<f64>)> = Vec::new();
    for shot in shots {
        for track in shot.tracks.iter().filter(|track| !track.is_angle) {
            let Some(begin) = discs::beginning(track, &shot.tracks) else { continue };
            match tracks.iter_mut().find(|(known, _)| *known == track.name) {
                Some((_, all)) => all.push(begin),
                None => tracks.push((track.name.clone(), vec![begin])),
            }
        }
    }
    tracks.into_iter().filter_map(|(name, all)| Some((name, middle(all.into_iter())?))).collect()
}

fn closest(shot: &RawShot) -> Option<f64> {
    let [first, second] = shot.centres()?;
    let places: HashMap<u64, [f64; 2]> =
        first.rows.iter().map(|row| (row.time.to_bits(), row.place())).collect();
    let distances = second.rows.iter().filter_map(|row| {
        let [x, y] = places.get(&row.time.to_bits())?;
        Some((row.x - x).hypot(row.y - y))
    });
    // NaN in a gap, which `min` ignores
    Some(distances.fold(f64::INFINITY, f64::min)).filter(|least| least.is_finite())
}
