//! The information of shots that are planned, at a given truth.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::block::{FilmBlock, MeasuredSpin, ShotFrames, World};
use super::camera::Point;
use super::impact::{Contact, Correction};
use super::own::{self, OWN};
use super::priors::list_unknowns;
use super::spins::{FIRST_SPREADS, LEAST_SPREAD, SIDE_SPREAD, ShotSpin, TOPSPIN_SPREAD};
use crate::measurement::dataset::{Dataset, Tracks};
use crate::measurement::spin::Spin;
use crate::physics::collision::{Model, NotACollision};
use crate::problem::frames::Frame;
use crate::problem::sums::{Noise, Spread};
use crate::problem::unknowns::{Id, Own, Shared, Unknown};

/// A shot that is planned, in the frame of the table.
#[derive(Clone, Copy, Debug)]
pub struct PlannedShot {
    /// Velocity of the cue ball along and across the line of centres, m/s.
    pub velocity: [f64; 2],
    /// Direction of the line of centres, rad.
    pub direction: f64,
    /// Place of the object ball, m from the middle of the film.
    pub place: [f64; 2],
    /// Instant of the impact, s.
    pub instant: f64,
    /// Topspin over natural roll, and its standard deviation from shot to shot.
    pub topspin: f64,
    pub topspin_sd: f64,
    /// Number of such shots, of which the spread of spins is estimated.
    pub shots: usize,
    /// What is known of the spin.
    pub spin: Spin,
    /// Standard errors of the side spins of both balls after the impact, rad/s, if markers show them.
    pub after_sd: Option<[f64; 2]>,
}

/// Steps towards a spread, as many as fits take at most.
const SPREAD_STEPS: usize = 10;

/// How planned shots are filmed.
#[derive(Clone, Copy, Debug)]
pub struct Filming {
    /// Frames per second.
    pub fps: f64,
    /// Number of frames.
    pub frames: usize,
    /// Standard deviation of a coordinate, m.
    pub sd: f64,
}

/// The unknowns of a film that is planned: of balls as a data set states them, with these spins.
pub(crate) fn unknowns_of(dataset: &Dataset, spins: &[Spin]) -> Vec<Unknown> {
    let radius = dataset.ball.radius;
    let spins: Vec<ShotSpin> = spins.iter().map(|spin| ShotSpin::stated(*spin, Point::x(), radius)).collect();
    list_unknowns(dataset, &dataset.settings_of_balls(), &Tracks::new(Vec::new()), &spins)
}

/// Returns the information of a shot about all shared unknowns in the order of [`Id`], its own
/// eliminated; `None` if its frames do not tell these.
///
/// # Errors
/// The shot is no collision.
pub(crate) fn information(
    shot: &PlannedShot,
    filming: &Filming,
    (model, unknowns, shared): (&Model, &[Unknown], &Shared),
) -> Result<Option<DMatrix<f64>>, NotACollision> {
    let contact = Contact::new(model, unknowns);
    let radius = contact.object().radius;
    let [along, across] = shot.velocity;
    let (sin, cos) = shot.direction.sin_cos();
    let velocity = Point::new(along * cos - across * sin, along * sin + across * cos);
    let spin = match shot.spin {
        Spin::Unknown if shot.topspin != 1.0 => ShotSpin::slides(),
        stated => ShotSpin::stated(stated, velocity, radius),
    };
    let mut values = Own::zeros(OWN);
    values[own::TIME] = shot.instant;
    (values[own::X], values[own::Y]) = (shot.place[0], shot.place[1]);
    values[own::DIRECTION] = shot.direction;
    (values[own::ALONG], values[own::ACROSS]) = (along, across);
    if spin.stated.mean.is_some() {
        values[own::TOPSPIN] = shot.topspin - spin.mean(shared);
    }
    let unseen = ShotFrames { tracks: [Vec::new(), Vec::new()], fps: filming.fps, spins: Vec::new() };
    let mut film = FilmBlock {
        shots: Arc::new(vec![unseen.clone()]),
        spins: vec![spin],
        spreads: FIRST_SPREADS.map(|first| Spread::first(first, LEAST_SPREAD)),
        world: World { contact, noise: [Noise { sd: filming.sd, rho: 0.0 }; 2] },
        states_noise: true,
        corrections: vec![Correction::zeros()],
        loss: None,
    };
    let struck = film.struck(0, &spin, &values, shared)?;
    let Some(seen) = film.paths(0, &values, shared) else { return Ok(None) };
    let tracks = [0, 1].map(|ball| {
        let frame = |n: usize| {
            let time = n as f64 / filming.fps;
            Frame { time, seen: seen.place(ball, time).into(), weight: Point::repeat(1.0), used: true }
        };
        (0..filming.frames).map(frame).collect()
    });
    let after = shot.after_sd.into_iter().flatten().enumerate();
    let after = after.map(|(ball, sd)| {
        let spin = struck.after[ball].spin[2].re / radius;
        MeasuredSpin { ball, spin, sd }
    });
    film.shots = Arc::new(vec![ShotFrames { tracks, spins: after.collect(), ..unseen }]);
    let (products, _) = film.contribute(0, &values, shared).own_system(0.0, OWN);
    let Some(own) = products.cholesky() else { return Ok(None) };
    let variances = own.inverse().diagonal();
    let spreads = [(TOPSPIN_SPREAD, own::TOPSPIN, shot.topspin_sd), (SIDE_SPREAD, own::SIDE, 0.0)];
    for (which, place, truth) in spreads {
        let spread = &mut film.spreads[which];
        spread.sd = expected_spread(spread, variances[place], truth, shot.shots as f64);
    }
    let sums = film.contribute(0, &values, shared);
    Ok(sums.reduced(&Id::ALL).map(|(information, _)| information))
}

/// Returns the spread that n shots with the spread t show on average. With v the variance of the value of a
/// shot, σ² = 1/(1/v − 1/s²) that by its frames alone, and w = s²/(s² + σ²), restricted likelihood ends at
/// s² = [n w²(σ² + t²) + s₀²]/(n w + 1).
fn expected_spread(spread: &Spread, variance: f64, truth: f64, shots: f64) -> f64 {
    let by_frames = (variance.recip() - spread.sd.powi(-2)).max(f64::MIN_POSITIVE).recip();
    let mut square = spread.first * spread.first;
    for _ in 0..SPREAD_STEPS {
        let part = square / (square + by_frames);
        let seen = shots * part * part * (by_frames + truth * truth);
        square = (seen + spread.first * spread.first) / (shots * part + 1.0);
    }
    square.sqrt().max(spread.least)
}
