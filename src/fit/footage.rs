//! Footage → shots: extracts the impacts of a data set of kind `tracks`.

use std::sync::Arc;

use rayon::prelude::*;

use super::{Depth, Method, Options, Status};
use crate::extraction::disc;
use crate::extraction::disc::{DiscImpact, Quantity};
use crate::extraction::{Impact, Unusable, extract_all, near_model, shots};
use crate::film::camera::Camera;
use crate::film::discs::Calibrated;
use crate::film::frame_noise::constant_axis;
use crate::fit;
use crate::likelihood::frames::Film;
use crate::measurement::dataset::{Dataset, Measured, Shot, Tracks};
use crate::measurement::loss::Loss;
use crate::measurement::number;
use crate::measurement::parameter::{Parameter, Setting};
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::measurement::values::Values;
use crate::physics::collision::{Coefficients, Fidelity, Model};
use crate::physics::disc::Discs;
use crate::physics::friction_law::Law;
use crate::trajectory::scene::{LiftPrior, Scene};

/// So many shots tell the friction between the balls well enough to know how high it lifts them.
const LEARN_FROM: usize = 300;

/// So many standard errors are no chance.
const SURELY: f64 = 5.0;

/// Rubber on rubber seldom has more friction.
const MOST_FRICTION: f64 = 2.0;

/// Twice the error of spins that 1000 frames/s and 0.1 mm tell, in parts of the natural roll's…
const NEAR_STUN: f64 = 0.06;
/// …and more spins than this part within it are no chance.
const MANY_STUNS: f64 = 0.2;

/// Rounds of extracting those shots and fitting them: the first starts from published values.
const LEARN_ROUNDS: usize = 2;

/// Relative standard deviation of a lift about what the collision model says of it. Gravity during the contact,
/// which the model leaves out, takes 3 % of a usual lift.
const LIFT_SD: f64 = 0.03;

/// All lifts may be wrong together by what gravity takes of those of fast shots, which tell the most, and by what the
/// friction is that they were predicted with.
const SHARED_LIFT_SD: f64 = 0.02;

/// Extracts the impacts of a data set of kind `tracks`: its shots, and those left out with the reason. Any
/// other data set, and one that has its impacts already, is returned as it is, without extractions. `done` is called after every shot, from several
/// threads.
#[must_use]
pub fn with_impacts(
    dataset: Dataset,
    done: &(dyn Fn() + Sync),
) -> (Dataset, Vec<(TrackShot, Impact)>, Scene) {
    extracted(dataset, (None, None), done)
}

/// As [`with_impacts`], from the scene that a search for the camera learned, if there was one, or by the camera that discs calibrated.
pub(super) fn extracted(
    mut dataset: Dataset,
    (learned_before, camera): (Option<&Scene>, Option<&Calibrated>),
    done: &(dyn Fn() + Sync),
) -> (Dataset, Vec<(TrackShot, Impact)>, Scene) {
    let scene = Scene { side_sd: dataset.side_sd, ..Scene::of(&dataset.model(Fidelity::Full)) };
    // other data, or footage whose impacts were extracted before
    if !dataset.shots.is_empty() {
        return (dataset, Vec::new(), scene);
    }
    if dataset.tracks.as_ref().is_some_and(|tracks| tracks.discs.is_some()) {
        return (to_be_fitted(dataset, camera), Vec::new(), scene);
    }
    let Some(tracks) = dataset.tracks.take() else { return (dataset, Vec::new(), scene) };
    dataset.left_out.extend_from_slice(&tracks.left_out);
    let scene = Scene { viewpoint: tracks.viewpoint, ..scene };
    let before = learned_before.map(|before| Scene { viewpoint: tracks.viewpoint, ..*before });
    let again = before.map(|before| learned(&dataset, &tracks.shots, &before));
    let (mut scene, lift_sd) = again
        .filter(|(_, lift_sd)| lift_sd.is_some())
        .unwrap_or_else(|| learned(&dataset, &tracks.shots, &scene));
    let impacts = extract_all(&tracks.shots, &scene, done);
    let mut extracted = Vec::with_capacity(tracks.shots.len());
    let reason = Reasons::of(&tracks, &impacts);
    for (track, impact) in tracks.shots.into_iter().zip(impacts) {
        match impact {
            Ok(impact) => extracted.push((track, impact)),
            Err(why) => dataset.left_out.push((track.name, reason.in_words(&why))),
        }
    }
    dataset.lift_sd = lift_sd;
    let found = extracted.iter().map(|(track, impact)| (track, impact)).collect();
    (dataset.shots, dataset.sliding, dataset.rolling) = shots_of(found, &mut scene);
    for shot in dataset.shots.iter_mut().filter(|_| dataset.side_sd > 0.0) {
        shot.add_side_spin(dataset.side_sd, dataset.ball.radius);
    }
    let notes =
        tracks.notes.into_iter().chain(many_stuns(&extracted)).chain(found_rolling(&extracted)).collect();
    dataset.tracks = Some(Tracks { shots: Vec::new(), notes, ..tracks });
    (dataset, extracted, scene)
}

/// What is to be said where many of the spins that were found from the motion may as well be none: no model has a derivative
/// there, and spins that err to either side of it bias e.
fn many_stuns(extracted: &[(TrackShot, Impact)]) -> Option<String> {
    let count =
        extracted.iter().filter_map(|(_, impact)| impact.roll()).filter(|r| r.abs() < NEAR_STUN).count();
    (count as f64 > MANY_STUNS * extracted.len() as f64).then(|| {
        format!(
            "{count} of {} cue balls of unknown spin had hardly any before the impact. Spins that are found err to both sides of \
             none, where lift and pressure of the cloth change over, and many of them move e by up to half its standard error: if \
             these are stun shots, say so (cue_spin = stun in the shots table).",
            extracted.len()
        )
    })
}

/// What is to be said of shots without markers whose spin is unknown, where the motion agrees with natural roll: they are then taken as
/// rolling, as if that had been stated.
fn found_rolling(extracted: &[(TrackShot, Impact)]) -> Option<String> {
    let of_motion =
        |(track, _): &&(TrackShot, Impact)| track.spin == Spin::Unknown && track.markers.is_empty();
    let unknown = extracted.iter().filter(of_motion).count();
    let rolling =
        extracted.iter().filter(of_motion).filter(|(_, impact)| impact.spin == Spin::NaturalRoll).count();
    let were = if rolling == 1 { "was" } else { "were" };
    let balls = if unknown == 1 { "cue ball" } else { "cue balls" };
    (rolling > 0).then(|| {
        format!("{rolling} of {unknown} {balls} of unknown spin {were} found to roll naturally before the impact, and taken so.")
    })
}

/// How to say why shots cannot be used.
struct Reasons {
    /// Metres mean something.
    has_scale: bool,
    /// In so many shots, all that there are, the object ball moves first; else 0.
    interchanged: usize,
}

impl Reasons {
    fn of(tracks: &Tracks, impacts: &[Result<Impact, Unusable>]) -> Self {
        let moves = |impact: &Result<Impact, Unusable>| matches!(impact, Err(Unusable::ObjectMoving { .. }));
        Self {
            // the balls tell it where some shot shows a collision
            has_scale: !tracks.from_balls || impacts.iter().any(Result::is_ok),
            interchanged: if impacts.iter().all(moves) { impacts.len() } else { 0 },
        }
    }

    fn in_words(&self, why: &Unusable) -> String {
        let mut words = why.to_string();
        if let (Unusable::ObjectMoving { .. }, false) = (why, self.has_scale) {
            words = words.split(", with ").next().unwrap_or_default().to_owned();
        }
        if self.interchanged > 0 {
            words.push_str(if self.interchanged > 1 { ", as in all shots" } else { "" });
            words.push_str(": are cue and object interchanged ([tracks] cue, object)?");
        }
        words
    }
}

/// The values that the first fits of these shots gave, near which a search may begin ([`Options::near`](crate::fit::Options::near)).
#[must_use]
pub fn near(scene: &Scene) -> Option<Values> {
    let LiftPrior::Model(model, coefficients, _) = scene.lift else { return None };
    Some(Values::of(&model, coefficients))
}

/// Whether the spin of some shot was found from its paths alone, since nothing else shows it and the shots did not determine enough
/// of the collision: its errors are then too large to be carried over as small ones are, and a joint fit of the frames is
/// the better one.
pub(crate) fn finds_spins_from_paths(extracted: &[(TrackShot, Impact)], scene: &Scene) -> bool {
    matches!(scene.lift, LiftPrior::Published(..))
        && extracted.iter().any(|(_, impact)| impact.spin == Spin::Unknown)
}

/// The frames of the shots, of at most about `most` of them, spread evenly: for
/// [`fit_watched`](fit::fit_watched). With `camera`, also how they follow its corrections.
#[must_use]
pub fn films(
    extracted: &[(TrackShot, Impact)],
    scene: &Scene,
    camera: Option<&Camera>,
    most: usize,
) -> Vec<Option<Arc<Film>>> {
    let step = extracted.len().div_ceil(most.max(1)).max(1);
    let film = |(i, (track, impact)): (usize, &(TrackShot, Impact))| {
        (i % step == 0).then(|| Arc::new(impact.film(track, scene, camera).with_all_minima(scene)))
    };
    extracted.par_iter().enumerate().map(film).collect()
}

/// Extracts the impacts of discs, and leaves out what a fit does not describe: shots in which they stick together; and those that are
/// doubtful, unless they are most.
fn to_be_fitted(dataset: Dataset, camera: Option<&Calibrated>) -> Dataset {
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

/// Some footage extracted with a scene that is known, for a joint fit of its frames: the data set with its shots, and their films
/// with how these follow the corrections of a camera.
pub(super) fn filmed_with(
    dataset: &Dataset,
    tracks: &[TrackShot],
    (mut scene, camera): (Scene, &Camera),
) -> (Dataset, Vec<Option<Arc<Film>>>) {
    let impacts = extract_all(tracks, &scene, &|| ());
    let extracted: Vec<(TrackShot, Impact)> = tracks
        .iter()
        .cloned()
        .zip(impacts)
        .filter_map(|(track, impact)| Some((track, impact.ok()?)))
        .collect();
    let rolling = shots::rolling(extracted.iter().map(|(_, impact)| impact));
    scene.cloth.rolling = rolling.value;
    let sliding = shots::sliding(extracted.iter().map(|(_, impact)| impact), rolling);
    let shots =
        extracted.iter().map(|(track, impact)| shots::shot(track, impact, sliding, rolling)).collect();
    let films = films(&extracted, &scene, Some(camera), usize::MAX);
    let rolling = Some(rolling);
    let left_out = Vec::new();
    (Dataset { shots, sliding, rolling, by: None, left_out, tracks: None, ..dataset.clone() }, films)
}

/// The scene with the lift that some of the shots, fitted together, say there is, and the relative standard error that
/// all lifts then share. Published values where they do not say. What a scene has learned before is learned once more.
pub(super) fn learned(dataset: &Dataset, tracks: &[TrackShot], scene: &Scene) -> (Scene, Option<f64>) {
    let step = tracks.len().div_ceil(LEARN_FROM).max(1);
    let sample: Vec<TrackShot> = tracks.iter().step_by(step).cloned().collect();
    let (mut scene, mut shared) = (*scene, None);
    let rounds = if matches!(scene.lift, LiftPrior::Model(..)) { 1 } else { LEARN_ROUNDS };
    for _ in 0..rounds {
        let impacts = extract_all(&sample, &scene, &|| ());
        let Some((values, mu_sd)) = coefficients(dataset, &sample, &impacts, &mut scene) else { break };
        let [b, c] = [Parameter::B, Parameter::C].map(|parameter| values[parameter]);
        let law = if b == 0.0 { Law::Constant } else { Law::Exponential { b, c } };
        let model = values.model(&Model { law, ..dataset.model_of_contact() });
        scene.lift = LiftPrior::Model(model, values.coefficients(), LIFT_SD);
        shared = Some(SHARED_LIFT_SD.hypot(mu_sd / (values[Parameter::Mu] + b)));
    }
    (scene, shared)
}

/// The shots of a data set, and the μ_k and μ_r that all of them together tell, which the scene has from then on.
fn shots_of(
    found: Vec<(&TrackShot, &Impact)>,
    scene: &mut Scene,
) -> (Vec<Shot>, Option<Measured>, Option<Measured>) {
    if found.is_empty() {
        return (Vec::new(), None, None);
    }
    let rolling = shots::rolling(found.iter().map(|(_, impact)| *impact));
    scene.cloth.rolling = rolling.value;
    let sliding = shots::sliding(found.iter().map(|(_, impact)| *impact), rolling);
    if let Some(sliding) = sliding {
        scene.cloth.sliding = sliding.value;
    }
    let scene = *scene;
    let shot = |(track, impact): (&TrackShot, &Impact)| {
        let near = near_model(track, impact, &scene);
        shots::shot(track, near.as_ref().unwrap_or(impact), sliding, rolling)
    };
    (found.into_par_iter().map(shot).collect(), sliding, Some(rolling))
}

/// What shots tell, and the standard error of μ, or of the a of a friction that falls.
fn coefficients(
    dataset: &Dataset,
    tracks: &[TrackShot],
    impacts: &[Result<Impact, Unusable>],
    scene: &mut Scene,
) -> Option<(Values, f64)> {
    let usable = tracks.iter().zip(impacts);
    let usable: Vec<_> = usable.filter_map(|(track, impact)| Some((track, impact.as_ref().ok()?))).collect();
    // paths alone may tell a spin that is wholly wrong
    let loss = usable.iter().any(|(_, impact)| impact.spin == Spin::Unknown).then_some(Loss::Huber);
    let (shots, sliding, rolling) = shots_of(usable, scene);
    let mut some = Dataset { shots, sliding, rolling, by: None, left_out: Vec::new(), ..dataset.clone() };
    // a lift hardly depends on it
    let kappa = &mut some.settings[Parameter::Kappa];
    *kappa = Setting::held(kappa.initial);
    // the second round begins where the first ended
    let fidelity = dataset.model_of_contact().fidelity;
    let options = Options {
        fidelity: fidelity.into(),
        depth: Depth::Estimates,
        loss,
        near: near(scene),
        method: Some(Method::TwoStage),
        ..Options::default()
    };
    let fit = fit::fit_watched(&some, &[], &options, &|| ()).ok()?.pop()?;
    let mut values = Values::of(&some.model_of_contact(), Coefficients { mu: 0.0, mu_s: 0.0, e: 0.0 });
    for estimate in &fit.estimates {
        values[estimate.parameter] = estimate.value;
    }
    let tells = fit.estimates.first().is_some_and(|mu| mu.status != Status::NotIdentified);
    let known = fit.converged && tells && values[Parameter::Mu] + values[Parameter::B] > 0.0;
    let mu_sd = fit.std_error_if_model_held(Parameter::Mu);
    known.then_some((values, mu_sd.unwrap_or(0.0)))
}
