//! Notes on a fit, in sentences.

use minijinja::{Value as Values, context};

use super::film::FittedFilm;
use super::film_words::{DIFFERS, Remark, remark};
use super::{Estimate, Fit, Status, check};
use crate::film::frame_noise::constant_axis;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::problem::{DiscImpact, Id, Quantity, Severity, Solution};

/// Frames between neighbouring positions of a disc beyond which some are missing.
const GAP: f64 = 2.5;

/// Returns a note with the numbers of its words.
pub(super) fn note(name: &str, values: Values) -> Option<Remark> {
    Remark::new(Severity::Note, name, values, Values::default())
}

/// Sets what is suspicious about the shots of a fit, its warnings, and its notes, among them those
/// of what was fitted; takes the errors of a model away that the data refute.
pub(super) fn comment(
    fit: &mut Fit,
    dataset: &Dataset,
    shots: &[&Shot],
    has_topspin: bool,
    own: impl IntoIterator<Item = Remark>,
) {
    if fit.is_refuted() {
        // standard errors hold if the model does
        for estimate in fit.estimates.iter_mut().filter(|e| e.status != Status::Fixed) {
            *estimate = Estimate::bare(estimate.parameter, estimate.value, estimate.status);
        }
        fit.diagnostics.contours.clear();
    }
    fit.diagnostics.suspicious = check::suspicious(dataset, shots, fit.sliding);
    let mut all = fit.doubts();
    let found = fit.solution.findings.iter().filter(|finding| finding.severity() == Severity::Note);
    all.extend(found.filter_map(|finding| remark(finding, fit.frames.as_ref())));
    all.extend(own);
    let on_request = fit.shots_rejected.len() - fit.unwanted().len();
    all.extend(of_shots("left-out-on-request", on_request, fit.shots_rejected.len() + fit.shots_used()));
    // parameters that the data do not determine, unless it is said of a combination
    let worst = fit.diagnostics.identifiability.as_ref().and_then(|found| found.worst.as_ref());
    let is_combination = worst.is_some_and(|worst| worst.undetermined);
    for Estimate { parameter, value, status, .. } in &fit.estimates {
        let without_topspin = *parameter == Parameter::MuS && !has_topspin;
        if *status == Status::NotIdentified && (without_topspin || !is_combination) {
            let parameter = parameter.name();
            all.extend(note("undetermined/not-identified", context! { parameter, value, without_topspin }));
        }
    }
    for text in dataset.notes() {
        all.extend(Remark::new(Severity::Note, "data", context! {}, context! { text }));
    }
    fit.remarks = all;
}

/// Returns what the frames of a film of balls show besides the parameters.
pub(super) fn of_film(film: &FittedFilm) -> Vec<Remark> {
    let rate = film.solution.get(Id::Rate).and_then(|found| {
        let (rate, sd, prior_sd) = (found.value, found.std_error?, found.prior?.sd);
        note("measured/frame-rate", context! { rate, sd, prior_sd })
    });
    unknown_spins(film).into_iter().chain(rate).collect()
}

/// Returns what cue balls of unknown spin were found to do, if there are any.
pub(super) fn unknown_spins(film: &FittedFilm) -> Option<Remark> {
    let topspins = film.solution.topspins();
    let is_unknown = |track: &TrackShot| track.spin == Spin::Unknown && track.markers.is_empty();
    let shots = film.tracks().iter().zip(&topspins);
    let unknown: Vec<f64> =
        shots.filter(|(track, _)| is_unknown(track)).map(|(_, (_, found))| *found).collect();
    let rolling = unknown.iter().filter(|topspin| **topspin == 1.0).count();
    let stun = unknown.iter().filter(|topspin| topspin.abs() < 0.5 * DIFFERS).count();
    let balls = Some(unknown.len()).filter(|balls| *balls > 0)?;
    note("measured/unknown-spins", context! { balls, rolling, stun })
}

/// Returns how the discs slow down, if it was estimated.
pub(super) fn slowing(solution: &Solution) -> Option<Remark> {
    let found = solution.get(Id::Slowing)?;
    let (slowing, sd) = (found.value, found.std_error?);
    note("measured/slowing", context! { slowing, sd })
}

/// Returns a note on some of all shots; `None` if these are none.
pub(super) fn of_shots(name: &str, shots: usize, of: usize) -> Option<Remark> {
    (shots > 0).then(|| note(name, context! { shots, of })).flatten()
}

/// Returns what was found on the way to the impacts of discs.
pub(super) fn of_discs(solution: &Solution, shots: &[(TrackShot, DiscImpact)]) -> Vec<Remark> {
    let of = shots.len();
    let touching = shots.iter().map(|(_, impact)| impact.touching).filter(|frames| *frames > 0);
    let (count, longest) = (touching.clone().count(), touching.max());
    let touching =
        longest.and_then(|longest| note("measured/touching", context! { shots => count, of, longest }));
    let missing = shots.iter().filter(|(track, impact)| misses_frames(track, impact)).count();
    let flat = shots.iter().filter(|(track, _)| constant_axis(track).is_some()).count();
    let all = [
        slowing(solution),
        touching,
        of_shots("measured/missing-frames", missing, of),
        of_shots("measured/one-dimension", flat, of),
    ];
    all.into_iter().flatten().collect()
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
