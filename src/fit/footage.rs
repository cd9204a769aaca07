//! Footage of discs → shots.

use crate::extraction::disc;
use crate::extraction::disc::{DiscImpact, Quantity};
use crate::film::discs::Calibrated;
use crate::film::frame_noise::constant_axis;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::number;
use crate::measurement::parameter::Parameter;
use crate::measurement::track::TrackShot;
use crate::physics::disc::Discs;

/// So many standard errors are no chance.
const SURELY: f64 = 5.0;

/// Rubber on rubber seldom has more friction.
const MOST_FRICTION: f64 = 2.0;

/// Extracts the impacts of discs, and leaves out what a fit does not describe: shots in which they stick together; and those that are
/// doubtful, unless they are most.
pub(super) fn to_be_fitted(dataset: Dataset, camera: Option<&Calibrated>) -> Dataset {
    let (mut dataset, extracted) = with_discs_calibrated(dataset, camera);
    let stuck = extracted.iter().filter_map(|(track, impact)| Some((track, impact.stuck?)));
    dataset.left_out.extend(stuck.map(|(track, stuck)| {
        let reason = format!(
            "{}. What is fitted describes discs that part again; \"caromfit extract\" gives the motion of this shot",
            stuck.sentence()
        );
        (track.name.clone(), reason)
    }));
    let Some(tracks) = &mut dataset.tracks else { return dataset };
    let is_doubtful = |shot: &Shot| tracks.doubtful.iter().any(|(name, _)| *name == shot.name);
    let doubtful = dataset.shots.iter().filter(|shot| is_doubtful(shot)).count();
    if 2 * doubtful <= dataset.shots.len() {
        dataset.shots.retain(|shot| !is_doubtful(shot));
        for (name, reason) in tracks.doubtful.drain(..) {
            // discs that stick together are left out already
            if dataset.left_out.iter().all(|(known, _)| *known != name) {
                dataset.left_out.push((name, format!("doubtful: {reason}")));
            }
        }
    }
    let unseen = dataset.shots.iter().filter(|shot| shot.after.len() == 1).count();
    if unseen > 0 {
        tracks.notes.push(format!(
            "In {unseen} of {} shots the rotation of the discs was not seen. Their slip is free there, so that they tell e alone. For the \
             friction, track points on both discs (as [tracks] cue and object, three or more on a circle about the centre of each, or a \
             marker beside each centre), or, if neither disc turns before the impact, state [cue_spin] assume = \"stun\".",
            dataset.shots.len()
        ));
    }
    let unit = match tracks.discs {
        Some(Discs { in_seconds: false, .. }) => " The frame rate is unknown: velocities are in m per frame.",
        _ => "",
    };
    tracks.notes.push(format!(
        "Discs: e and J_t/J_n of every shot are fitted, which are those of equal discs with the same slip and closing speed. Their own \
         velocities are in what \"caromfit extract\" writes.{unit}"
    ));
    // what is around discs may be any material
    let mu = &mut dataset.settings[Parameter::Mu];
    if *mu == Parameter::Mu.default_setting() {
        mu.upper = MOST_FRICTION;
    }
    dataset
}

/// Extracts the impacts of discs. The shots of the data set are then those of equal discs with the same
/// restitution and friction, but for discs that stick together, and its ball is such a disc. Any other data set is returned as it is.
#[must_use]
pub fn with_discs(dataset: Dataset) -> (Dataset, Vec<(TrackShot, DiscImpact)>) {
    with_discs_calibrated(dataset, None)
}

/// The same, of films that were corrected by a camera whose errors are then those of the impacts, too.
pub(super) fn with_discs_calibrated(
    mut dataset: Dataset,
    camera: Option<&Calibrated>,
) -> (Dataset, Vec<(TrackShot, DiscImpact)>) {
    let Some(discs) = dataset.tracks.as_ref().and_then(|tracks| tracks.discs) else {
        return (dataset, Vec::new());
    };
    let Some(mut tracks) = dataset.tracks.take() else { return (dataset, Vec::new()) };
    dataset.left_out.extend_from_slice(&tracks.left_out);
    let impacts = disc::extract_all(&tracks.shots, &discs, camera);
    let mut extracted = Vec::with_capacity(tracks.shots.len());
    for (track, impact) in std::mem::take(&mut tracks.shots).into_iter().zip(impacts) {
        match impact {
            Ok(impact) => extracted.push((track, impact)),
            Err(reason) => dataset.left_out.push((track.name, reason.to_string())),
        }
    }
    for (track, impact) in extracted.iter().filter(|(_, impact)| !impact.doubts.is_empty()) {
        tracks.doubtful.push((track.name.clone(), impact.doubts.join("; ")));
    }
    tracks.notes.extend(notes_on(&extracted));
    tracks.disc_shots = extracted.iter().map(|(track, impact)| impact.of_table(track)).collect();
    let impacts: Vec<&DiscImpact> = extracted.iter().map(|(_, impact)| impact).collect();
    dataset.ball = disc::ball(&discs, &impacts);
    let parted = extracted.iter().filter(|(_, impact)| impact.stuck.is_none());
    dataset.shots = parted.map(|(track, impact)| impact.shot(track, &dataset.ball)).collect();
    dataset.tracks = Some(tracks);
    (dataset, extracted)
}

/// Whether two or more frames of a disc about the impact are missing.
fn misses_impact((track, impact): &(TrackShot, DiscImpact)) -> bool {
    /// Frames between neighbouring positions.
    const GAP: f64 = 2.5;
    let Some(time) = impact.get(Quantity::Time) else { return false };
    [&track.cue, &track.object].into_iter().any(|samples| {
        let after = samples.partition_point(|sample| sample.t < time.value);
        let before = after.checked_sub(1).and_then(|i| samples.get(i));
        before.zip(samples.get(after)).is_some_and(|(a, b)| (b.t - a.t) * track.fps > GAP)
    })
}

/// What there is to say of all shots of discs together.
fn notes_on(extracted: &[(TrackShot, DiscImpact)]) -> Vec<String> {
    let mut notes = Vec::new();
    let unbalanced = extracted.iter().filter(|(_, impact)| impact.is_out_of_balance()).count();
    if unbalanced > 0 {
        notes.push(format!(
            "Momentum is out of balance by more than five stated errors in {unbalanced} of {} shots, though by no more than half a \
             percent of the velocities makes: the stated errors of e and J_t/J_n are those of the frames' noise \
             and of the camera as far as the shots calibrate it.",
            extracted.len()
        ));
    }
    if let Some(slowing) = extracted.iter().find_map(|(_, impact)| impact.slowing) {
        notes.push(format!(
            "The discs slow down by {} m/s², as {} show: velocities are those at the impacts.",
            number::with_error(slowing.value, slowing.sd.unwrap_or_default()),
            if extracted.len() > 1 { "all shots together" } else { "the frames" }
        ));
    }
    let touching = extracted.iter().map(|(_, impact)| impact.touching);
    if let Some(longest) = touching.clone().max().filter(|longest| *longest > 0) {
        notes.push(format!(
            "In {} of {} shots the discs touch for several frames: up to {longest} on either side of the impact were left out. Straight lines \
             before and after give e and J_t/J_n of the whole contact, if nothing else pushes a disc meanwhile.",
            touching.filter(|frames| *frames > 0).count(),
            extracted.len()
        ));
    }
    let unseen = extracted.iter().filter(|shot| misses_impact(shot)).count();
    if unseen > 0 {
        notes.push(format!(
            "In {unseen} of {} shots the frames about the impact are missing. It is taken to be where the straight lines before and after \
             cross, as if both discs changed their velocities at one instant and nothing else pushed them in the gap.",
            extracted.len()
        ));
    }
    let flat = extracted.iter().filter(|(track, _)| constant_axis(track).is_some()).count();
    if flat > 0 {
        notes.push(format!(
            "In {flat} of {} shots one coordinate never changes: films of one dimension, in which the line of centres is along the other. They \
             determine e, but neither J_t/J_n nor μ, which need hits off the centre.",
            extracted.len()
        ));
    }
    let turned = |(track, impact): &(TrackShot, DiscImpact)| {
        let (before, after) = (impact.get(Quantity::SlipBefore)?, impact.get(Quantity::SlipAfter)?);
        let surely = after.value.abs() > SURELY * after.sd.unwrap_or(f64::INFINITY);
        (impact.stuck.is_none() && before.value * after.value < 0.0 && surely)
            .then(|| (track.name.clone(), before.value, after.value))
    };
    let turned: Vec<_> = extracted.iter().filter_map(turned).collect();
    if let Some((name, before, after)) = turned.first() {
        notes.push(format!(
            "The slip of the contact turns round in the impact in {} of {} shots, first in shot {name}, from {before:.3} to {after:.3}: \
             an elastic surface (a rubber band) throws back along the surface, too, as a contact does that gives way (kappa).",
            turned.len(),
            extracted.len()
        ));
    }
    notes
}
