//! Spins of cue balls that are not as stated, or that do not show.
//!
//! Where a film contradicts the model, other spins are looked for first, by the problem of its frames ([`crate::problem`]): rolling balls that
//! are stated not to spin look like unequal balls, a wrong frame rate or a tracker that lags.

use super::{Analysis, Options, Prepared};
use crate::fit::causes::{Cause, Explanation};
use crate::fit::{Depth, Fit, causes, check};
use crate::measurement::dataset::Dataset;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::problem::{Modelling, Policy, fit_film};

/// Shots, spread evenly, of which the spins are looked for.
const MOST_SHOTS: usize = 40;

/// Least difference of a spin from the stated one, as a part of the natural roll's: a smaller one is found along the spin of all shots.
const DIFFERS: f64 = 0.2;

/// Least part of the shots whose spins can be found and differ.
const MOST: f64 = 0.75;

/// The spin of a cue ball of which it was stated, both as parts of the natural roll's.
struct Found {
    stated: f64,
    found: f64,
}

/// Fits a data set; of footage that contradicts the spins that are stated, this is said; shots of unknown spin that show none are taken
/// as stun where no other shot shows topspin.
pub(super) fn analyse(dataset: Dataset, options: &Options, done: &(dyn Fn() + Sync)) -> Analysis {
    let Some(own) =
        dataset.tracks.as_ref().filter(|tracks| tracks.discs.is_none() && !tracks.shots.is_empty())
    else {
        return Prepared::new(dataset, done).analysed(options, done);
    };
    let stated = own.shots.iter().filter(|shot| stated_spin(shot).is_some()).count();
    let unknown = own.shots.iter().any(|shot| shot.spin == Spin::Unknown);
    if stated > 0 {
        of_stated_spins(dataset, options, done)
    } else if unknown {
        of_unknown_spins(dataset, options, done)
    } else {
        Prepared::new(dataset, done).analysed(options, done)
    }
}

fn of_stated_spins(dataset: Dataset, options: &Options, done: &(dyn Fn() + Sync)) -> Analysis {
    let mut prepared = Prepared::searched(dataset.clone(), (None, true), done);
    let mut tried = false;
    if !prepared.is_settled() {
        if let Some(explanation) = found_spins(&dataset) {
            let fits = prepared.fits(&Options { depth: Depth::Estimates, ..*options }, true, done);
            return blamed(prepared.with(fits), explanation);
        }
        tried = true;
        prepared = Prepared::new(dataset.clone(), done);
    }
    let fits = prepared.fits(options, !tried, done);
    let is_suspect = |fit: &Fit| fit.diagnostics.suspects_spins;
    if tried || !fits.as_ref().is_ok_and(|fits| fits.iter().any(is_suspect)) {
        return prepared.with(fits);
    }
    if let Some(explanation) = found_spins(&dataset) {
        return blamed(prepared.with(fits), explanation);
    }
    let fits = prepared.fits(options, false, done);
    prepared.with(fits)
}

fn of_unknown_spins(dataset: Dataset, options: &Options, done: &(dyn Fn() + Sync)) -> Analysis {
    let first = Prepared::new(dataset.clone(), done).analysed(options, done);
    let Some(stun) = stun_shots(&first) else { return first };
    let mut stated = dataset;
    let mut count = 0;
    if let Some(tracks) = &mut stated.tracks {
        for shot in tracks.shots.iter_mut().filter(|shot| stun.contains(&shot.name)) {
            shot.spin = Spin::Stun;
            count += 1;
        }
        tracks.notes.push(format!(
            "{count} of {} cue balls of unknown spin show none, and no other shot shows topspin: they are taken as stun. Only topspin \
             presses the object ball into the cloth, so that these shots do not determine μ_s; some natural-roll shots do.",
            tracks.shots.len()
        ));
    }
    let again = Prepared::new(stated, done).analysed(options, done);
    let agrees = again.fits.as_ref().is_ok_and(|fits| fits.iter().all(agrees));
    if agrees { again } else { first }
}

/// The names of the shots of unknown spin that show none, where no shot shows topspin.
fn stun_shots(analysis: &Analysis) -> Option<Vec<String>> {
    let fits = analysis.fits.as_ref().ok()?;
    let mut stun = Vec::new();
    for fit in fits {
        for shown in fit.frames.as_ref()?.spins() {
            if shown.is_topspin() {
                return None;
            }
            if !shown.is_surely_some() {
                stun.push(shown.shot);
            }
        }
    }
    (!stun.is_empty()).then_some(stun)
}

/// Whether the model describes the data of a fit.
fn agrees(fit: &Fit) -> bool {
    fit.refuted.is_none() && fit.converged && !causes::is_called_for(fit)
}

/// Stun and natural roll as parts of the natural roll's, where they are stated and no marker shows the spin.
fn stated_spin(shot: &TrackShot) -> Option<f64> {
    match shot.spin {
        _ if !shot.markers.is_empty() => None,
        Spin::Stun => Some(0.0),
        Spin::NaturalRoll => Some(1.0),
        _ => None,
    }
}

/// Returns what explains a film whose cue balls do not spin as stated: with spins that are found, the problem of its frames describes them.
fn found_spins(dataset: &Dataset) -> Option<Explanation> {
    let mut some = dataset.clone();
    let tracks = some.tracks.as_mut()?;
    let step = tracks.shots.len().div_ceil(MOST_SHOTS).max(1);
    tracks.shots = tracks.shots.iter().step_by(step).cloned().collect();
    let stated: Vec<(String, f64)> =
        tracks.shots.iter().filter_map(|shot| Some((shot.name.clone(), stated_spin(shot)?))).collect();
    let film = fit_film(&some, &Modelling::of(&some), &Policy::default()).ok()?;
    let fall = film.explained_by_spins()?;
    let topspins = film.topspins();
    let found = |(name, stated): &(String, f64)| {
        let (_, found) = topspins.iter().find(|(shot, _)| shot == name)?;
        Some(Found { stated: *stated, found: *found })
    };
    let spins: Vec<Found> = stated.iter().filter_map(found).collect();
    let differ = spins.iter().filter(|spin| (spin.found - spin.stated).abs() > DIFFERS).count();
    if (spins.len() as f64) < MOST * stated.len() as f64 || 2 * differ <= stated.len() {
        return None;
    }
    let rolling = spins.iter().filter(|spin| (spin.found - 1.0).abs() < DIFFERS).count();
    let stun = spins.iter().filter(|spin| spin.found.abs() < DIFFERS).count();
    let many = |count: usize| count as f64 > MOST * spins.len() as f64;
    let spin = median(spins.iter().map(|spin| spin.found).collect());
    let (were, assume) = if many(rolling) {
        (format!("{rolling} of {} roll naturally", spins.len()), "natural-roll")
    } else if many(stun) {
        (format!("{stun} of {} have next to no topspin", spins.len()), "stun")
    } else {
        let count = spins.len();
        (
            format!("the topspin of {differ} of {count} differs (median {spin:.2} of the natural roll's)"),
            "unknown",
        )
    };
    let difference = median(spins.iter().map(|spin| spin.found - spin.stated).collect());
    let spread = median(spins.iter().map(|spin| (spin.found - spin.stated - difference).abs()).collect());
    let difference = (difference, spread / (spins.len() as f64).sqrt());
    Some(Explanation::of_spins(difference, (&film, fall), (&were, assume)))
}

/// The analysis with what explains it said first.
fn blamed(mut analysis: Analysis, explanation: Explanation) -> Analysis {
    for fit in analysis.fits.iter_mut().flatten() {
        let own = explanation.clone();
        // what seems wrong with other spins
        let suspicious = std::mem::take(&mut fit.diagnostics.suspicious);
        let said = check::warnings(&suspicious, fit.shots_used);
        fit.warnings.retain(|warning| !said.contains(warning));
        fit.warnings.insert(0, own.sentence.clone());
        // nor is a contact that gives way to be looked into
        fit.explanations.retain(|known| known.adopted && known.cause != Cause::Compliance);
        fit.explanations.insert(0, own);
    }
    analysis
}
