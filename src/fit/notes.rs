//! Notes on a fit, in sentences.

use super::film::FittedFilm;
use super::film_words::{DIFFERS, remark};
use super::{DOWN_WEIGHTED, Fit, Noise, Remark, Status, check};
use crate::film::frame_noise::constant_axis;
use crate::measurement::dataset::{Dataset, ON_REQUEST, Shot};
use crate::measurement::number::{count_of, plain, with_error};
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::problem::{DiscImpact, Id, Quantity, Severity, Solution};

/// Number of standard errors of a slip that turned round.
const TURNED_ERRORS: f64 = 5.0;

/// Frames between neighbouring positions of a disc beyond which some are missing.
const GAP: f64 = 2.5;

/// Sets what is suspicious about the shots of a fit, its warnings, and its notes, among them those of what was
/// fitted.
pub(super) fn comment(
    fit: &mut Fit,
    dataset: &Dataset,
    shots: &[&Shot],
    has_topspin: bool,
    own: impl IntoIterator<Item = String>,
) {
    // what a refuted fit found of the cloth means nothing
    let is_known = fit.refuted.is_none() || fit.frames.is_none();
    let cloth = [fit.sliding, fit.rolling].map(|measured| measured.filter(|_| is_known));
    fit.diagnostics.suspicious = check::suspicious(dataset, shots, cloth);
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
    notes.extend(estimated_noise(fit).into_iter().map(note("noise-estimated")));
    notes.extend(influential(fit).map(note("influential-shots")));
    notes.extend(robust(fit).map(note("robust-loss")));
    notes.extend(dataset.notes().cloned().map(note("data")));
    fit.remarks.extend(notes);
}

/// Returns the parameters that the data do not determine.
fn unidentified(fit: &Fit, has_topspin: bool) -> impl Iterator<Item = String> {
    let worst = fit.diagnostics.identifiability.as_ref().and_then(|found| found.worst.as_ref());
    let is_combination = worst.is_some_and(|worst| worst.undetermined);
    let open = fit.estimates.iter().filter(|estimate| estimate.status == Status::NotIdentified);
    open.filter_map(move |estimate| {
        let why = if estimate.parameter == Parameter::MuS && !has_topspin {
            "no shot has topspin, so the cloth never carries the object ball"
        } else if is_combination {
            return None;
        } else {
            "no observation depends on it"
        };
        let (symbol, value) = (estimate.parameter.symbol(), plain(estimate.value, 3));
        Some(format!("{symbol} is not identified: {why}. It was left at {value}."))
    })
}

/// Returns the standard deviations that were estimated, and those of rounded readings.
fn estimated_noise(fit: &Fit) -> Vec<String> {
    let known = |noise: &&Noise| noise.estimated_sd.is_some_and(f64::is_finite);
    let estimated: Vec<&Noise> = fit.noise.iter().filter(known).collect();
    let sd = |noise: &&Noise| {
        Some(format!("{} {}", noise.observable.label(), noise.in_words(noise.estimated_sd?, 3)))
    };
    let sds: Vec<String> = estimated.iter().filter_map(sd).collect();
    let rounded = estimated.iter().filter(|noise| noise.rounding.is_some());
    let rounded: Vec<&str> = rounded.map(|noise| noise.observable.label()).collect();
    let estimated = (!sds.is_empty()).then(|| {
        format!(
            "The data state no standard deviations: they were estimated from the residuals, one for all observables of a unit unless \
             these are not equally good ({}). χ² then says nothing about the quality of the fit.",
            sds.join(", ")
        )
    });
    let rounded = (!rounded.is_empty()).then(|| {
        format!(
            "The readings of {} are rounded to more than the residuals show: their noise is taken as that of rounding, a step over √12.",
            rounded.join(", ")
        )
    });
    estimated.into_iter().chain(rounded).collect()
}

/// Returns the shots on which the estimates depend much.
fn influential(fit: &Fit) -> Option<String> {
    let goodness = fit.diagnostics.goodness.as_ref()?;
    let from = goodness.influential_from?;
    let all: Vec<_> = goodness.influence.iter().filter(|shot| shot.cook > from).collect();
    Some(format!(
        "The estimates depend much on {} (Cook's distance), most of all on shot {}: look at whether its data can be trusted.",
        count_of(all.len(), "shot"),
        all.first()?.shot
    ))
}

/// Returns how a robust loss weighted the shots.
fn robust(fit: &Fit) -> Option<String> {
    let robust = fit.diagnostics.robust.as_ref()?;
    Some(format!(
        "Outlying shots count less ({} loss); {} of {} have a weight below {DOWN_WEIGHTED}. χ² is weighted, and \
         the errors are honest ones from the scatter of the shots (sandwich), whatever their noise.",
        robust.loss.name(),
        robust.weights.iter().filter(|shot| shot.weight < DOWN_WEIGHTED).count(),
        fit.shots_used
    ))
}

/// Returns what the frames of a film of balls show besides the parameters.
pub(super) fn of_film(fit: &Fit, film: &FittedFilm) -> Vec<String> {
    let solution = &film.solution;
    let estimate = |id: Id| {
        let found = solution.get(id)?;
        Some(with_error(found.value, found.std_error?))
    };
    let mut notes = Vec::new();
    if let [Some(mu_k), Some(mu_r), Some(bounce)] = [Id::MuK, Id::MuR, Id::Bounce].map(estimate) {
        notes.push(format!(
            "The cloth's sliding friction is μ_k = {mu_k}, its rolling resistance μ_r = {mu_r}, its bounce e_t = {bounce} (fitted, with \
             what is published as priors)."
        ));
    }
    notes.extend(unknown_spins(film));
    let is_open = fit.get(Parameter::MuS).is_some_and(|mu_s| mu_s.status == Status::NotIdentified);
    if is_open && solution.topspins().iter().all(|(_, topspin)| *topspin < DIFFERS) {
        notes.push(
            "Only topspin presses the object ball into the cloth, so that these shots do not determine μ_s; some natural-roll shots do."
                .to_owned(),
        );
    }
    let prior = solution.get(Id::Rate).and_then(|rate| rate.prior);
    if let Some((rate, prior)) = estimate(Id::Rate).zip(prior) {
        notes.push(format!(
            "Frame rate over the stated one: {rate}, from the frames and what is taken of it beforehand (± {} %).",
            plain(100.0 * prior.sd, 2)
        ));
    }
    notes
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

/// Returns what was found on the way to the impacts of discs.
pub(super) fn of_discs(solution: &Solution, shots: &[(TrackShot, DiscImpact)]) -> Vec<String> {
    let mut notes = Vec::from_iter(slowing(solution));
    let all = shots.len();
    let touching = || shots.iter().map(|(_, impact)| impact.touching).filter(|frames| *frames > 0);
    if let Some(longest) = touching().max() {
        notes.push(format!(
            "In {} of {all} shots the discs touch for several frames: up to {longest} on either side of the impact were left out. The \
             paths before and after give e and J_t/J_n of the whole contact, if nothing else pushes a disc meanwhile.",
            touching().count()
        ));
    }
    let missing = shots.iter().filter(|(track, impact)| misses_frames(track, impact)).count();
    if missing > 0 {
        notes.push(format!(
            "In {missing} of {all} shots the frames about the impact are missing. It is taken to be where the paths before and after \
             cross, as if both discs changed their velocities at one instant and nothing else pushed them in the gap."
        ));
    }
    let flat = shots.iter().filter(|(track, _)| constant_axis(track).is_some()).count();
    if flat > 0 {
        notes.push(format!(
            "In {flat} of {all} shots one coordinate never changes: films of one dimension, in which the line of centres is along the \
             other. They determine e, but neither J_t/J_n nor μ, which need hits off the centre."
        ));
    }
    let turned: Vec<_> = shots.iter().filter_map(|(track, impact)| Some((track, turned(impact)?))).collect();
    if let Some((first, [before, after])) = turned.first() {
        notes.push(format!(
            "The slip of the contact turns round in the impact in {} of {all} shots, first in shot {}, from {before:.3} to {after:.3}: \
             an elastic surface (a rubber band) throws back along the surface, too, as a contact does that gives way (kappa).",
            turned.len(),
            first.name
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

/// Returns the slip before and after an impact that turned it round, m/s.
fn turned(impact: &DiscImpact) -> Option<[f64; 2]> {
    let (before, after) = (impact.get(Quantity::SlipBefore)?, impact.get(Quantity::SlipAfter)?);
    let surely = after.value.abs() > TURNED_ERRORS * after.sd.unwrap_or(f64::INFINITY);
    let is_turned = impact.stuck.is_none() && before.value * after.value < 0.0 && surely;
    is_turned.then_some([before.value, after.value])
}
