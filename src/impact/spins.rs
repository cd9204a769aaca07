//! What the markers on the balls tell of their spins.

use nalgebra::SMatrix;

use super::film::Film;
use super::fit::{self, Tracked};
use super::model::unknown;
use super::near;
use super::rotation::{self, Carrier, Rotation, Spot};
use super::{Impact, LiftPrior, PathErrors, Rotations, Scene, Unusable, model, window};
use crate::ball::Ball;
use crate::dataset::Spin;
use crate::track::{Marker, Sample, TrackShot, TrackedBall};

/// Frames that straddle the impact show neither spin: this part of a frame is left out on both sides.
const CLEAR: f64 = 0.01;

/// A rough spin is this wrong, relative.
const ROUGH: f64 = 0.05;

/// A cue ball that slides is preferred to one that rolls when χ² falls by this much: three standard deviations.
const SLIDES: f64 = 9.0;

/// An unknown spin is looked for from both sides of stun, as part of the natural roll's.
const ROLLS: [f64; 2] = [0.5, -0.5];
/// And, where the collision model is known, from these too.
const EVERYWHERE: [f64; 8] = [-1.0, -0.7, -0.4, -0.15, 0.15, 0.4, 0.7, 0.9];

/// A shot without markers whose spin is unknown. It is taken to be about the axis across the ball's path, as that
/// of a ball struck without side: natural roll where the motion agrees with it, else what the paths tell. They may tell
/// several: where the collision model is known, the one that it agrees with best.
pub(super) fn from_motion(
    shot: &TrackShot,
    scene: &Scene,
    guess: &model::Unknowns,
    noise: f64,
) -> Result<Impact, Unusable> {
    let rolls = Tracked::new(shot, scene, noise, Spin::NaturalRoll);
    let slides = Tracked::new(shot, scene, noise, Spin::Unknown);
    let starts = if matches!(scene.lift, LiftPrior::Model(..)) { &ROLLS[..1] } else { &ROLLS };
    let sliding = starts.iter().map(|roll| {
        let mut start = *guess;
        start[unknown::ROLL] = *roll;
        (&slides, start)
    });
    let hypotheses: Vec<(&Tracked, model::Unknowns)> =
        std::iter::once((&rolls, *guess)).chain(sliding).collect();
    // a wrong hypothesis ends the window early
    let chosen: Vec<_> = hypotheses.iter().map(|(tracked, start)| window::choose(tracked, start)).collect();
    let length = |fitted: &fit::Fitted| fitted.to - fitted.from;
    let widest = chosen.iter().flatten().max_by(|a, b| length(a).total_cmp(&length(b)));
    let Some([from, to]) = widest.map(|fitted| [fitted.from, fitted.to]) else {
        return chosen.into_iter().find_map(Result::err).map_or(Err(Unusable::NoCollision), Err);
    };
    let mut all = hypotheses.iter().zip(&chosen).map(|((tracked, start), chosen)| {
        let start = chosen.as_ref().map_or(*start, |fitted| fitted.z);
        tracked.fit(&start, from, to).ok()
    });
    let rolling = all.next().flatten();
    let mut sliding = all.flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2));
    let mut at_model = None;
    if let Some(paths_only) = &sliding {
        let first = slides.quantities(paths_only)?.0;
        at_model = Film::new(shot, &first, scene).at_model(scene, &EVERYWHERE);
        let start = at_model.and_then(|own| near::path(&own, &first, scene));
        // the collision tells more of a spin than the paths do, which must only not speak against it
        let allowed = paths_only.chi2 + SLIDES * slides.misfit(paths_only).max(1.0);
        let again = start.and_then(|start| slides.fit(&start, from, to).ok());
        sliding = again.filter(|again| again.chi2 < allowed).or(sliding);
    }
    let (tracked, fitted) = match (rolling, sliding) {
        (Some(rolling), Some(sliding))
            if rolling.chi2 - sliding.chi2 > SLIDES * rolls.misfit(&rolling).max(1.0) =>
        {
            (slides, sliding)
        }
        (Some(rolling), _) => (rolls, rolling),
        (None, Some(sliding)) => (slides, sliding),
        (None, None) => return Err(Unusable::NoCollision),
    };
    let at_model = at_model.filter(|_| tracked.model.spin == Spin::Unknown);
    Ok(Impact { at_model, ..tracked.impact(&fitted)?.0 })
}

fn markers_of(shot: &TrackShot, ball: TrackedBall) -> impl Iterator<Item = &Marker> {
    shot.markers.iter().filter(move |marker| marker.ball == ball)
}

/// The cue ball's spin before the impact, roughly, from positions as tracked; as played where there are no
/// markers that tell it.
pub(super) fn rough(shot: &TrackShot, ball: &Ball, impact: f64, noise: f64) -> Spin {
    let before = [f64::NEG_INFINITY, impact - 0.5 / shot.fps];
    let centre = |t: f64| shot.cue.iter().find(|sample| sample.t == t).map(|s: &Sample| [s.x, s.y]);
    let spots: Vec<Spot> = markers_of(shot, TrackedBall::Cue)
        .map(|marker| Spot::new(&marker.samples, before, impact, ball.radius, noise, centre))
        .collect();
    rotation::rough(&spots)
        .map_or(shot.spin, |spin| Spin::Measured { spin, sd: [Some(ROUGH * spin.norm()); 3] })
}

/// The cue ball's spin before the impact: what its markers show, else as played.
pub(super) fn before(shot: &TrackShot, rotations: &Rotations) -> Spin {
    let measured = |rotation: Rotation| Spin::Measured {
        spin: rotation.spin,
        sd: [0, 1, 2].map(|axis| Some(rotation.covariance[(axis, axis)].sqrt())),
    };
    rotations.cue_before.map_or(shot.spin, measured)
}

/// The angular velocities that the markers show, with the fitted motion of the balls' centres and its errors.
pub(super) fn measure(shot: &TrackShot, impact: &Impact, errors: &PathErrors, scene: &Scene) -> Rotations {
    let known = model::Scene::of(impact.spin, scene);
    let motion = model::with_derivatives::<{ unknown::COUNT }>(&known, &impact.unknowns);
    let plain = model::Motion::new(&known, &impact.unknowns.into());
    let time = impact.unknowns[unknown::TIME];
    let radius = scene.ball.radius;
    let of = |ball: TrackedBall, [from, to]: [f64; 2]| {
        let centre = |t: f64| match ball {
            TrackedBall::Cue => motion.cue(time + t),
            TrackedBall::Object => motion.object(time + t),
        };
        let change = |t: f64| motion.spin_change(ball, time + t, &scene.ball);
        let plain_change = |t: f64| plain.spin_change(ball, time + t, &scene.ball);
        let seen_at = |t: f64| {
            Some(match ball {
                TrackedBall::Cue => plain.cue(t),
                TrackedBall::Object => plain.object(t),
            })
        };
        let spots: Vec<Spot> = markers_of(shot, ball)
            .map(|marker| Spot::new(&marker.samples, [from, to], time, radius, impact.position_sd, seen_at))
            .collect();
        let known = |marker: &Marker| marker.samples.iter().all(|sample| sample.sd.is_some());
        let stated = shot.position_sd.is_some() || markers_of(shot, ball).all(known);
        rotation::measure(
            &spots,
            &Carrier { centre: &centre, change: &change, plain_change: &plain_change, radius },
            stated,
        )
    };
    let clear = CLEAR / shot.fps;
    let [from, to] = impact.window;
    let sides = [
        of(TrackedBall::Cue, [from, time - clear]),
        of(TrackedBall::Cue, [time + clear, to]),
        of(TrackedBall::Object, [time + clear, to]),
    ];
    let mut rotations = Rotations::default();
    // ω = ω(z): covariances with each other and with the path come from those of z
    let mut by = SMatrix::<f64, 9, { unknown::COUNT }>::zeros();
    for (side, measured) in sides.iter().enumerate() {
        if let Some(measured) = measured {
            by.fixed_rows_mut::<3>(3 * side).copy_from(&measured.by_unknowns);
        }
    }
    rotations.covariance = by * errors.unknowns * by.transpose();
    rotations.with_path = by * errors.unknowns * errors.quantities.transpose();
    for (side, measured) in sides.into_iter().enumerate() {
        let Some(measured) = measured else { continue };
        let mut block = rotations.covariance.fixed_view_mut::<3, 3>(3 * side, 3 * side);
        block += measured.own;
        let rotation =
            Rotation { spin: measured.spin, covariance: block.into_owned(), positions: measured.positions };
        let place = [&mut rotations.cue_before, &mut rotations.cue_after, &mut rotations.object_after];
        for (i, place) in place.into_iter().enumerate() {
            if i == side {
                *place = Some(rotation);
            }
        }
    }
    rotations
}
