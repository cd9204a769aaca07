//! The impacts of films of discs, whatever the law of friction.

use super::camera::FoundCamera;
use super::{film_words, notes};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::track::TrackShot;
use crate::physics::disc::Discs;
use crate::problem::{DiscImpact, FilmError, MeasuredDiscs, Policy, ball, measure_discs};

/// Largest friction that fits of discs try: rubber on rubber seldom has more, and what is around discs
/// may be any material.
const MOST_FRICTION: f64 = 2.0;

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

/// Returns a film of discs with the shots of equal discs that have the same restitution and friction, as
/// far as fits use them.
pub(super) fn with_equal_discs(dataset: Dataset) -> Dataset {
    let ExtractedDiscs { mut dataset, shots, .. } = extract_discs(dataset);
    let Some(discs) = dataset.tracks.as_ref().and_then(|tracks| tracks.discs) else { return dataset };
    allow_friction(&mut dataset.settings);
    dataset.ball = ball(&discs, shots.first().map(|(_, impact)| impact.radii));
    let mut unseen = 0;
    for (track, impact) in &shots {
        let fault = match &impact.stuck {
            Some(stuck) => Some(format!(
                "{}. What is fitted describes discs that part again; \"caromfit extract\" gives the motion of this shot",
                stuck.sentence()
            )),
            None => impact.find_impossible_restitution(&Policy::default()).map(|doubt| doubt.to_string()),
        };
        if let Some(fault) = fault {
            dataset.left_out.push((track.name.clone(), fault));
            continue;
        }
        let shot = impact.shot(track, &dataset.ball);
        unseen += usize::from(shot.after.len() == 1);
        dataset.shots.push(shot);
    }
    let said = doubts(&shots).chain(notes::rotation(unseen, dataset.shots.len()));
    let said: Vec<String> = said.chain([about_fits(&discs)]).collect();
    dataset.tracks.iter_mut().for_each(|tracks| tracks.notes.extend(said.iter().cloned()));
    dataset
}

/// Lets the friction be that of any material if the data set states no bounds.
pub(super) fn allow_friction(settings: &mut Settings) {
    let mu = &mut settings[Parameter::Mu];
    if *mu == Parameter::Mu.default_setting() {
        mu.upper = MOST_FRICTION;
    }
}

/// Returns a sentence of each thing that speaks against a shot.
fn doubts(shots: &[(TrackShot, DiscImpact)]) -> impl Iterator<Item = String> {
    let of_shot = |(track, impact): &(TrackShot, DiscImpact)| {
        let name = track.name.clone();
        let doubts: Vec<String> =
            impact.doubts.iter().map(|doubt| format!("Shot {name} is doubtful: {doubt}.")).collect();
        doubts
    };
    shots.iter().flat_map(of_shot)
}

fn about_fits(discs: &Discs) -> String {
    let unit =
        if discs.in_seconds { "" } else { " The frame rate is unknown: velocities are in m per frame." };
    format!(
        "Discs: e and J_t/J_n of every shot are fitted, which are those of equal discs with the same slip and closing speed. Their own \
         velocities are in what \"caromfit extract\" writes.{unit}"
    )
}
