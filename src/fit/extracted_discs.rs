//! The impacts of films of discs, whatever the law of friction.

use super::camera::FoundCamera;
use super::{film_words, notes};
use crate::measurement::dataset::Dataset;
use crate::measurement::track::TrackShot;
use crate::problem::{DiscImpact, FilmError, MeasuredDiscs, Policy, Quantity, measure_discs};

/// A film of discs with what was measured of its shots.
#[derive(Clone, Debug)]
pub struct ExtractedDiscs {
    /// The data set, with what was found on the way among its notes, and the shots without an impact left
    /// out.
    pub dataset: Dataset,
    /// The shots with an impact.
    pub shots: Vec<(TrackShot, DiscImpact)>,
    /// The camera that the discs calibrate; `None` if there is no impact.
    pub camera: Option<FoundCamera>,
}

/// Measures the impacts of a film of discs: e, J_t/J_n, spins and balance of momentum of each shot may be
/// any, and all shots share the camera. Of any other data set there are none.
#[must_use]
pub fn extract_discs(mut dataset: Dataset) -> ExtractedDiscs {
    let MeasuredDiscs { solution, impacts } = match measure_discs(&dataset, &Policy::default()) {
        Ok(measured) => measured,
        Err(error) => {
            leave_out(&mut dataset, error);
            return ExtractedDiscs { dataset, shots: Vec::new(), camera: None };
        }
    };
    dataset.left_out.extend(solution.left_out.iter().cloned());
    let camera = FoundCamera::of_film(&solution);
    let mut shots = Vec::new();
    if let Some(tracks) = &mut dataset.tracks {
        for impact in impacts {
            let track = tracks.shots.iter().find(|track| track.name == impact.name);
            shots.extend(track.cloned().map(|track| (track, impact)));
        }
        let findings = solution.findings.iter();
        tracks.notes.extend(findings.filter_map(|finding| film_words::sentence(finding, None)));
        tracks.notes.extend(camera.sentences());
        tracks.notes.extend(notes::of_discs(&solution, &shots));
    }
    ExtractedDiscs { dataset, shots, camera: Some(camera) }
}

/// Leaves out all shots of a film that cannot be fitted.
pub(super) fn leave_out(dataset: &mut Dataset, error: FilmError) {
    let reasons = match error {
        FilmError::NoImpact(reasons) => reasons,
        other => {
            let tracks = dataset.tracks.iter().flat_map(|tracks| &tracks.shots);
            tracks.map(|shot| (shot.name.clone(), other.to_string())).collect()
        }
    };
    dataset.left_out.extend(reasons);
}

/// Returns a film of discs with the shots that a fit can use.
pub(super) fn with_usable_discs(dataset: Dataset) -> Dataset {
    let ExtractedDiscs { mut dataset, shots, .. } = extract_discs(dataset);
    let Some(tracks) = &mut dataset.tracks else { return dataset };
    tracks.shots.clear();
    let mut unseen = 0;
    for (track, impact) in shots {
        let doubts = impact.doubts.iter();
        tracks.notes.extend(doubts.map(|doubt| format!("Shot {} is doubtful: {doubt}.", track.name)));
        let fault = match &impact.stuck {
            Some(stuck) => Some(format!(
                "{}. What is fitted describes discs that part again; \"caromfit extract\" gives the motion of this shot",
                stuck.sentence()
            )),
            None => impact.find_impossible_restitution(&Policy::default()).map(|doubt| doubt.to_string()),
        };
        match fault {
            Some(fault) => dataset.left_out.push((track.name, fault)),
            None => {
                unseen += usize::from(impact.get(Quantity::SlipBefore).is_none());
                tracks.shots.push(track);
            }
        }
    }
    tracks.notes.extend(notes::rotation(unseen, tracks.shots.len()));
    let knows_rate = tracks.discs.is_none_or(|discs| discs.in_seconds);
    let unit = if knows_rate { "" } else { " The frame rate is unknown: velocities are in m per frame." };
    tracks.notes.push(format!(
        "Discs: e and J_t/J_n of every shot are fitted, which are those of equal discs with the same slip and closing speed. Their own \
         velocities are in what \"caromfit extract\" writes.{unit}"
    ));
    dataset
}
