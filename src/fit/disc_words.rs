//! What there is to say of all shots of a film of discs together, in sentences.

use crate::film::frame_noise::constant_axis;
use crate::measurement::number::with_error;
use crate::measurement::track::TrackShot;
use crate::problem::{DiscImpact, Id, Quantity, Solution};

/// Standard errors of a slip that surely turned round.
const SURELY: f64 = 5.0;

/// Frames between neighbouring positions of a disc beyond which some are missing.
const GAP: f64 = 2.5;

/// Returns what was found on the way to the impacts.
pub(super) fn notes(solution: &Solution, shots: &[(TrackShot, DiscImpact)]) -> Vec<String> {
    let notes = [slowing(solution), touching(shots), missing(shots), flat(shots), turned(shots)];
    notes.into_iter().flatten().collect()
}

/// Returns how the discs slow down, if it was estimated.
pub(super) fn slowing(solution: &Solution) -> Option<String> {
    let found = solution.get(Id::Slowing)?;
    Some(format!(
        "The discs slow down by {} m/s²: velocities are those at the impacts.",
        with_error(found.value, found.std_error?)
    ))
}

/// Returns what helps if in `unseen` of `all` shots the slip is not known; `None` if it is known in all.
pub(super) fn rotation(unseen: usize, all: usize) -> Option<String> {
    (unseen > 0).then(|| {
        format!(
            "In {unseen} of {all} shots the rotation of the discs was not seen. Their slip is free there, so that they tell e alone. For \
             the friction, track points on both discs (as [tracks] cue and object, three or more on a circle about the centre of each, \
             or a marker beside each centre), or, if neither disc turns before the impact, state [cue_spin] assume = \"stun\"."
        )
    })
}

fn touching(shots: &[(TrackShot, DiscImpact)]) -> Option<String> {
    let longer = shots.iter().map(|(_, impact)| impact.touching).filter(|frames| *frames > 0);
    let longest = longer.clone().max()?;
    Some(format!(
        "In {} of {} shots the discs touch for several frames: up to {longest} on either side of the impact were left out. The paths \
         before and after give e and J_t/J_n of the whole contact, if nothing else pushes a disc meanwhile.",
        longer.count(),
        shots.len()
    ))
}

fn missing(shots: &[(TrackShot, DiscImpact)]) -> Option<String> {
    let misses = |(track, impact): &&(TrackShot, DiscImpact)| {
        let Some(time) = impact.get(Quantity::Time) else { return false };
        [&track.cue, &track.object].into_iter().any(|samples| {
            let after = samples.partition_point(|sample| sample.t < time.value);
            let before = after.checked_sub(1).and_then(|i| samples.get(i));
            before.zip(samples.get(after)).is_some_and(|(a, b)| (b.t - a.t) * track.fps > GAP)
        })
    };
    let count = shots.iter().filter(misses).count();
    (count > 0).then(|| {
        format!(
            "In {count} of {} shots the frames about the impact are missing. It is taken to be where the paths before and after cross, \
             as if both discs changed their velocities at one instant and nothing else pushed them in the gap.",
            shots.len()
        )
    })
}

fn flat(shots: &[(TrackShot, DiscImpact)]) -> Option<String> {
    let count = shots.iter().filter(|(track, _)| constant_axis(track).is_some()).count();
    (count > 0).then(|| {
        format!(
            "In {count} of {} shots one coordinate never changes: films of one dimension, in which the line of centres is along the \
             other. They determine e, but neither J_t/J_n nor μ, which need hits off the centre.",
            shots.len()
        )
    })
}

fn turned(shots: &[(TrackShot, DiscImpact)]) -> Option<String> {
    let turned = |(track, impact): &(TrackShot, DiscImpact)| {
        let (before, after) = (impact.get(Quantity::SlipBefore)?, impact.get(Quantity::SlipAfter)?);
        let surely = after.value.abs() > SURELY * after.sd.unwrap_or(f64::INFINITY);
        (impact.stuck.is_none() && before.value * after.value < 0.0 && surely)
            .then(|| (track.name.clone(), before.value, after.value))
    };
    let turned: Vec<_> = shots.iter().filter_map(turned).collect();
    let (name, before, after) = turned.first()?;
    Some(format!(
        "The slip of the contact turns round in the impact in {} of {} shots, first in shot {name}, from {before:.3} to {after:.3}: an \
         elastic surface (a rubber band) throws back along the surface, too, as a contact does that gives way (kappa).",
        turned.len(),
        shots.len()
    ))
}
