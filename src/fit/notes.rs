//! Notes on a fit, in sentences.

use super::film::FittedFilm;
use super::film_words::{DIFFERS, remark};
use super::{Estimate, Fit, Remark, Status, check};
use crate::film::frame_noise::constant_axis;
use crate::measurement::dataset::{Dataset, ON_REQUEST, Shot};
use crate::measurement::number::{count_of, plain, with_error};
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::problem::{DiscImpact, Id, Quantity, Severity, Solution};

/// Frames between neighbouring positions of a disc beyond which some are missing.
const GAP: f64 = 2.5;

/// Sets what is suspicious about the shots of a fit, its warnings, and its notes, among them those
/// of what was fitted; takes the errors of a model away that the data refute.
pub(super) fn comment(
    fit: &mut Fit,
    dataset: &Dataset,
    shots: &[&Shot],
    has_topspin: bool,
    own: impl IntoIterator<Item = String>,
) {
    if fit.is_refuted() {
        // standard errors hold if the model does
        for estimate in fit.estimates.iter_mut().filter(|e| e.status != Status::Fixed) {
            *estimate = Estimate::bare(estimate.parameter, estimate.value, estimate.status);
        }
        fit.diagnostics.contours.clear();
    }
    fit.diagnostics.suspicious = check::suspicious(dataset, shots, fit.sliding);
    fit.remarks = fit.doubts();
    let note = |kind: &'static str| move |sentence: String| Remark::new(Severity::Note, kind, sentence);
    let found = fit.solution.findings.iter().filter(|finding| finding.severity() == Severity::Note);
    let mut notes: Vec<Remark> = found.filter_map(|finding| remark(finding, fit.frames.as_ref())).collect();
    notes.extend(own.into_iter().map(note("measured")));
    let on_request = fit.shots_rejected.iter().filter(|shot| shot.reason == ON_REQUEST).count();
    if on_request > 0 {
        let all = fit.shots_rejected.len() + fit.shots_used;
        notes.push(note("left-out-on-request")(format!(
            "{on_request} of {all} shots were left out on request."
        )));
    }
    notes.extend(unidentified(fit, has_topspin).map(note("undetermined")));
    notes.extend(dataset.notes().cloned().map(note("data")));
    fit.remarks.extend(notes);
}

/// Returns the parameters that the data do not determine, unless it is said of a combination.
fn unidentified(fit: &Fit, has_topspin: bool) -> impl Iterator<Item = String> {
    let worst = fit.diagnostics.identifiability.as_ref().and_then(|found| found.worst.as_ref());
    let is_combination = worst.is_some_and(|worst| worst.undetermined);
    let open = fit.estimates.iter().filter(|estimate| estimate.status == Status::NotIdentified);
    open.filter_map(move |estimate| {
        let why = match estimate.parameter {
            Parameter::MuS if !has_topspin => {
                "no shot has topspin, so the cloth never carries the object ball"
            }
            _ if is_combination => return None,
            _ => "no observation depends on it",
        };
        let (symbol, value) = (estimate.parameter.symbol(), plain(estimate.value, 3));
        Some(format!("{symbol} is not identified: {why}. It was left at {value}."))
    })
}

/// Returns what the frames of a film of balls show besides the parameters.
pub(super) fn of_film(film: &FittedFilm) -> Vec<String> {
    let rate = film.solution.get(Id::Rate).and_then(|found| {
        Some(format!(
            "Frame rate over the stated one: {}, from the frames and its prior (± {} %).",
            with_error(found.value, found.std_error?),
            plain(100.0 * found.prior?.sd, 2)
        ))
    });
    unknown_spins(film).into_iter().chain(rate).collect()
}

/// Returns what cue balls of unknown spin were found to do, if there are any.
pub(super) fn unknown_spins(film: &FittedFilm) -> Option<String> {
    let topspins = film.solution.topspins();
    let is_unknown = |track: &TrackShot| track.spin == Spin::Unknown && track.markers.is_empty();
    let shots = film.tracks().iter().zip(&topspins);
    let unknown: Vec<f64> =
        shots.filter(|(track, _)| is_unknown(track)).map(|(_, (_, found))| *found).collect();
    let rolling = unknown.iter().filter(|topspin| **topspin == 1.0).count();
    let stun = unknown.iter().filter(|topspin| topspin.abs() < 0.5 * DIFFERS).count();
    let balls = count_of(unknown.len(), "cue ball");
    (!unknown.is_empty()).then(|| {
        format!(
            "Of {balls} of unknown spin, {rolling} were found to roll naturally before the impact, and {stun} to have next to no \
             topspin."
        )
    })
}

/// Returns how the discs slow down, if it was estimated.
pub(super) fn slowing(solution: &Solution) -> Option<String> {
    let found = solution.get(Id::Slowing)?;
    Some(format!(
        "The discs slow down by {} m/s²: velocities are those at the impacts.",
        with_error(found.value, found.std_error?)
    ))
}

/// Returns what helps if in `unseen` of `all` shots the slip is not known; `None` if it is known in
/// all.
pub(super) fn rotation(unseen: usize, all: usize) -> Option<String> {
    (unseen > 0).then(|| {
        format!(
            "In {unseen} of {all} shots the rotation of the discs was not seen. Their slip is free there, so that they determine e alone. For \
             the friction, track points on both discs (as [tracks] cue and object, three or more on a circle about the centre of each, \
             or a marker beside each centre), or, if neither disc turns before the impact, state [cue_spin] assume = \"stun\"."
        )
    })
}

/// Returns what was found on the way to the impacts of discs.
pub(super) fn of_discs(solution: &Solution, shots: &[(TrackShot, DiscImpact)]) -> Vec<String> {
    let mut notes = Vec::from_iter(slowing(solution));
    let all = shots.len();
    let touching = || shots.iter().map(|(_, impact)| impact.touching).filter(|frames| *frames > 0);
    if let Some(longest) = touching().max() {
        notes.push(format!(
            "In {} of {all} shots the discs touch for several frames: up to {longest} on either side of the impact were left out. The \
             paths before and after give e and J_t/J_n of the whole contact, if no other force acts on a disc in that time.",
            touching().count()
        ));
    }
    let missing = shots.iter().filter(|(track, impact)| misses_frames(track, impact)).count();
    if missing > 0 {
        notes.push(format!(
            "In {missing} of {all} shots the frames about the impact are missing. It is taken to be where the paths before and after \
             cross, as if both discs changed their velocities at one instant without another push in the gap."
        ));
    }
    let flat = shots.iter().filter(|(track, _)| constant_axis(track).is_some()).count();
    if flat > 0 {
        notes.push(format!(
            "In {flat} of {all} shots one coordinate never changes: films of one dimension, in which the line of centres is along the \
             other. They determine e, but not J_t/J_n or μ, which need hits off the centre."
        ));
    }
    notes
}

/// Returns whether frames about an impact are missing.
fn misses_frames(track: &TrackShot, impact: &DiscImpact) -> bool {
    let Some(time) = impact.get(Quantity::Time) else { return false };
    [&track.cue, &track.object].into_iter().any(|samples| {
        let after = samples.partition_point(|sample| sample.t < time.value);
        let before = after.checked_sub(1).and_then(|i| samples.get(i));
        before.zip(samples.get(after)).is_some_and(|(a, b)| (b.t - a.t) * track.fps > GAP)
    })
}
