//! Spins that nothing tells but the motion.

use super::ball_paths::{BallPaths, FittedBalls, TrackedBalls};
use super::unusable::{Bodies, Unusable};
use super::{Impact, near_model, window};
use crate::likelihood::frames::own_unknowns::EVERYWHERE;
use crate::measurement::spin::Spin;
use crate::measurement::track::TrackShot;
use crate::trajectory::scene::{LiftPrior, Scene};
use crate::trajectory::unknowns::{Unknowns, unknown};

/// A cue ball that slides is preferred to one that rolls when χ² falls by this much: three standard deviations.
const SLIDES: f64 = 9.0;

/// An unknown spin is looked for from both sides of natural roll, where the cloth's friction turns about, and of stun, as part of the
/// natural roll's; where the collision model is known, it tells draw from topspin.
const ROLLS: [f64; 3] = [0.5, 1.2, -0.5];
const OF_TOPSPIN: usize = 2;

/// A shot without markers whose spin is unknown. It is taken to be about the axis across the ball's path, as that
/// of a ball struck without side: natural roll where the motion agrees with it, else what the paths tell. They may tell
/// several: where the collision model is known, it says which.
pub(crate) fn from_motion(
    shot: &TrackShot,
    scene: &Scene,
    guess: &Unknowns,
    noise: f64,
) -> Result<Impact, Unusable> {
    let rolls = TrackedBalls::new(shot, BallPaths::new(scene, Spin::NaturalRoll), noise);
    let slides = TrackedBalls::new(shot, BallPaths::new(scene, Spin::Unknown), noise);
    let starts = if matches!(scene.lift, LiftPrior::Model(..)) { &ROLLS[..OF_TOPSPIN] } else { &ROLLS[..] };
    let sliding = starts.iter().map(|roll| {
        let mut start = *guess;
        start[unknown::ROLL] = *roll;
        (&slides, start)
    });
    let hypotheses: Vec<(&TrackedBalls, Unknowns)> =
        std::iter::once((&rolls, *guess)).chain(sliding).collect();
    let (mut fits, window) = in_one_window(&hypotheses)?;
    let rolling = fits.remove(0);
    let mut sliding = fits.into_iter().flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2));
    let paths_only = sliding.as_ref().and_then(|sliding| Some(slides.quantities(sliding).ok()?.0));
    let mut found = None;
    if let (Some(fitted), Some(impact)) = (&sliding, &paths_only) {
        found = impact.film(shot, scene, None).at_model(scene, &EVERYWHERE);
        let start = found.as_ref().and_then(|found| near_model::path(&found.own, impact, scene));
        // the collision tells more of a spin than the paths do, which must only not speak against it
        let allowed = fitted.chi2 + likely(&slides, fitted);
        let again = start.and_then(|start| slides.fit(&start, window).ok());
        sliding = again.filter(|again| again.chi2 < allowed).or(sliding);
    }
    let (tracked, fitted) = match (rolling, sliding) {
        (Some(rolling), Some(sliding)) => {
            // of the same frames
            let in_natural_roll = paths_only.and_then(|impact| {
                let impact = Impact { spin: Spin::NaturalRoll, ..impact };
                impact.film(shot, scene, None).at_model(scene, &[])
            });
            let explained = match (in_natural_roll, &found) {
                (Some(rolling), Some(sliding)) => rolling.chi2() - sliding.chi2(),
                _ => rolling.chi2 - sliding.chi2,
            };
            if explained > likely(&slides, &sliding) { (slides, sliding) } else { (rolls, rolling) }
        }
        (Some(rolling), None) => (rolls, rolling),
        (None, Some(sliding)) => (slides, sliding),
        (None, None) => return Err(Unusable::NoCollision(Bodies::Balls)),
    };
    let at_model = found.filter(|_| tracked.paths.model.spin == Spin::Unknown).map(|found| found.own);
    Ok(Impact { at_model, ..tracked.impact(&fitted)?.0 })
}

/// The fits of hypotheses over the same frames, which are all that some hypothesis agrees with; and from when to when these are.
fn in_one_window(
    hypotheses: &[(&TrackedBalls, Unknowns)],
) -> Result<(Vec<Option<FittedBalls>>, [f64; 2]), Unusable> {
    let whole: Vec<_> = hypotheses.iter().map(|(tracked, start)| window::whole(tracked, start)).collect();
    if let Some((fitted, _)) = whole.iter().flatten().find(|(_, is_good)| *is_good) {
        let window = fitted.window;
        return Ok((whole.into_iter().map(|all| Some(all?.0)).collect(), window));
    }
    // a wrong hypothesis ends the window early
    let grown: Vec<_> = hypotheses.iter().map(|(tracked, start)| window::grown(tracked, start)).collect();
    let length = |fitted: &FittedBalls| fitted.window[1] - fitted.window[0];
    let widest = grown.iter().flatten().max_by(|a, b| length(a).total_cmp(&length(b)));
    let Some(window) = widest.map(|fitted| fitted.window) else {
        return grown
            .into_iter()
            .find_map(Result::err)
            .map_or(Err(Unusable::NoCollision(Bodies::Balls)), Err);
    };
    let again = |((tracked, start), grown): (&(&TrackedBalls, Unknowns), &Result<FittedBalls, Unusable>)| {
        let start = grown.as_ref().map_or(start, |fitted| &fitted.z);
        tracked.fit(start, window).ok()
    };
    Ok((hypotheses.iter().zip(&grown).map(again).collect(), window))
}

/// χ² may fall by so much by chance.
fn likely(tracked: &TrackedBalls, fitted: &FittedBalls) -> f64 {
    SLIDES * tracked.misfit(fitted).max(1.0)
}
