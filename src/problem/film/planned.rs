//! The information of shots that are planned, at a given truth.

use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

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
pub(crate) struct PlannedShot {
    /// Velocity of the cue ball along and across the line of centres, m/s.
    pub(crate) velocity: [f64; 2],
    /// Direction of the line of centres, rad.
    pub(crate) direction: f64,
    /// Place of the object ball, m from the middle of the film.
    pub(crate) place: [f64; 2],
    /// Instant of the impact, s.
    pub(crate) instant: f64,
    /// Topspin over natural roll.
    pub(crate) topspin: f64,
    /// The spin, as far as it is known.
    pub(crate) spin: Spin,
    /// Standard errors of the side spins of both balls after the impact, rad/s, if markers show them.
    pub(crate) after_sd: Option<[f64; 2]>,
}

/// Steps towards a spread, as many as fits take at most.
const SPREAD_STEPS: usize = 10;

/// Topspin, over natural roll, of every other shot without one; the others have as much draw. The outcome
/// has a corner at 0, on either side of which fits find half of such shots.
const OFF_CORNER: f64 = 1e-10;

/// How many shots are planned, and how they are filmed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Filming {
    /// Number of shots, which have the spreads of spins in common.
    pub(crate) shots: usize,
    /// Standard deviation of their topspin over natural roll.
    pub(crate) topspin_sd: f64,
    /// Frames per second.
    pub(crate) fps: f64,
    /// Number of frames.
    pub(crate) frames: usize,
    /// Standard deviation of a coordinate, m.
    pub(crate) sd: f64,
}

/// The unknowns of a film that is planned: of balls as a data set states them, with these spins.
pub(crate) fn unknowns_of(dataset: &Dataset, spins: &[Spin]) -> Vec<Unknown> {
    let radius = dataset.ball.radius;
    let spins: Vec<ShotSpin> = spins.iter().map(|spin| ShotSpin::stated(*spin, Point::x(), radius)).collect();
    list_unknowns(&dataset.settings_of_balls(), &Tracks::new(Vec::new()), &spins)
}

/// Returns the information of each of some samples of the shots about all shared unknowns in the order of
/// [`Id`], its own eliminated; `None` if its frames do not determine these. The spreads of spins are those that
/// a fit of all shots finds.
///
/// # Errors
/// A shot that is not a collision.
pub(crate) fn information(
    samples: &[PlannedShot],
    filming: &Filming,
    (model, unknowns, shared): (&Model, &[Unknown], &Shared),
) -> Result<Vec<Option<DMatrix<f64>>>, NotACollision> {
    let contact = Contact::new(model, unknowns);
    let film = |(i, shot): (usize, &PlannedShot)| {
        let side = if i % 2 == 0 { OFF_CORNER } else { -OFF_CORNER };
        let topspin = if shot.topspin == 0.0 { side } else { shot.topspin };
        Filmed::new(&PlannedShot { topspin, ..*shot }, filming, &contact, shared)
    };
    let mut films: Vec<Filmed> = samples.par_iter().enumerate().map(film).collect::<Result<_, _>>()?;
    let variances = films.par_iter().map(|film| film.own_variances(shared)).collect::<Vec<_>>();
    for (which, place, truth) in
        [(TOPSPIN_SPREAD, own::TOPSPIN, filming.topspin_sd), (SIDE_SPREAD, own::SIDE, 0.0)]
    {
        let variances: Vec<f64> = variances.iter().flatten().map(|variances| variances[place]).collect();
        let spread = Spread::first(FIRST_SPREADS[which], LEAST_SPREAD);
        let sd = found(&spread, &variances, truth, filming.shots as f64);
        for film in &mut films {
            film.block.spreads[which].sd = sd;
        }
    }
    let informs = |(film, variances): (&Filmed, &Option<Own>)| {
        variances.as_ref()?;
        let sums = film.block.contribute(0, &film.values, shared);
        sums.reduced(&Id::ALL).map(|(information, _)| information)
    };
    Ok(films.par_iter().zip(&variances).map(informs).collect())
}

/// The film of one shot, and its own unknowns.
struct Filmed {
    block: FilmBlock,
    values: Own,
}

impl Filmed {
    fn new(
        shot: &PlannedShot,
        filming: &Filming,
        contact: &Contact,
        shared: &Shared,
    ) -> Result<Self, NotACollision> {
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
        let mut block = FilmBlock {
            shots: Arc::new(vec![unseen.clone()]),
            spins: vec![spin],
            spreads: FIRST_SPREADS.map(|first| Spread::first(first, LEAST_SPREAD)),
            world: World { contact: *contact, noise: [Noise { sd: filming.sd, rho: 0.0 }; 2] },
            states_noise: true,
            corrections: vec![Correction::zeros()],
            loss: None,
        };
        let struck = block.struck(0, &spin, &values, shared)?;
        let seen = block.paths(0, &values, shared);
        let tracks = [0, 1].map(|ball| {
            let frame = |n: usize| {
                let time = n as f64 / filming.fps;
                let seen = seen.as_ref()?.place(ball, time).into();
                Some(Frame { time, seen, weight: Point::repeat(1.0), used: true })
            };
            (0..filming.frames).filter_map(frame).collect()
        });
        let after = shot.after_sd.into_iter().flatten().enumerate();
        let spins = after.map(|(ball, sd)| {
            let spin = struck.after[ball].spin[2].re / radius;
            MeasuredSpin { ball, spin, sd }
        });
        block.shots = Arc::new(vec![ShotFrames { tracks, spins: spins.collect(), ..unseen }]);
        Ok(Self { block, values })
    }

    /// Returns the variances of the own unknowns if all others are known; `None` if the frames do not
    /// determine them.
    fn own_variances(&self, shared: &Shared) -> Option<Own> {
        let (products, _) = self.block.contribute(0, &self.values, shared).own_system(0.0, OWN);
        Some(products.cholesky()?.inverse().diagonal())
    }
}

/// Returns the spread that n shots with the spread t show on average. With v the variance of the value of a
/// shot, σ² = 1/(1/v − 1/s²) that by its frames alone, and w = s²/(s² + σ²), restricted likelihood ends at
/// s² = [Σ w²(σ² + t²) + s₀²]/(Σ w + 1). The sums are n times the means over the variances of some shots.
fn found(spread: &Spread, variances: &[f64], truth: f64, shots: f64) -> f64 {
    let by_frames = |variance: &f64| (variance.recip() - spread.sd.powi(-2)).max(f64::MIN_POSITIVE).recip();
    let by_frames: Vec<f64> = variances.iter().map(by_frames).collect();
    let each = shots / by_frames.len().max(1) as f64;
    let first = spread.first * spread.first;
    let mut square = first;
    for _ in 0..SPREAD_STEPS {
        let (mut seen, mut count) = (first, 1.0);
        for by_frames in &by_frames {
            let part = square / (square + by_frames);
            seen += each * part * part * (by_frames + truth * truth);
            count += each * part;
        }
        square = seen / count;
    }
    square.sqrt().max(spread.least)
}
