//! The information of shots that are planned, at a given truth.

use std::sync::Arc;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::camera::Point;
use super::filmed::{FilmBlock, FilmedShot, ShotAt, SideSpin, set_apart};
use super::impact::Contact;
use super::own::{self, SCATTERED};
use super::priors::list_unknowns;
use super::spins::{FIRST_SCATTER, SIDE_SPREAD, ShotSpin, TOPSPIN_SPREAD, Through, first_spreads};
use crate::measurement::dataset::{Dataset, Tracks};
use crate::measurement::spin::Spin;
use crate::numerics::EXACT;
use crate::physics::collision::{Model, NotACollision};
use crate::problem::frames::Frame;
use crate::problem::policy::POLICY;
use crate::problem::sums::{Noise, Shown, Spread, Variation};
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
    /// Standard errors of the side spins of both balls after the impact, rad/s, if markers show
    /// them.
    pub(crate) after_sd: Option<[f64; 2]>,
}

/// How many shots are planned, and how they are filmed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Filming {
    /// Number of shots, which have the spreads of spins in common.
    pub(crate) shots: usize,
    /// Standard deviation of their topspin over natural roll.
    pub(crate) topspin_sd: f64,
    /// Frames per second.
    pub(crate) fps: f64,
    pub(crate) frames: usize,
    /// Standard deviation of a coordinate, m.
    pub(crate) sd: f64,
}

/// The unknowns of a film that is planned: of balls as a data set states them, with these spins.
pub(crate) fn unknowns_of(dataset: &Dataset, spins: &[Spin]) -> Vec<Unknown> {
    let radius = dataset.ball.radius;
    let spins: Vec<ShotSpin> = spins.iter().map(|spin| ShotSpin::stated(*spin, Point::x(), radius)).collect();
    let tracks = Tracks { rate_sd: Some(POLICY.rate_sd), ..Tracks::new(Vec::new()) };
    list_unknowns(&dataset.settings_of_balls(), &tracks, &spins)
}

/// Returns the information of each of some samples of the shots about all shared unknowns in the
/// order of [`Id`], its own eliminated; `None` if its frames do not determine these. The spreads of
/// spins are those that a fit of all shots finds.
///
/// # Errors
/// A shot that is not a collision.
pub(crate) fn information(
    samples: &[PlannedShot],
    filming: &Filming,
    (model, unknowns, shared): (&Model, &[Unknown], &Shared),
) -> Result<Vec<Option<DMatrix<f64>>>, NotACollision> {
    let mut film = FilmBlock {
        shots: Arc::default(),
        contact: Contact::new(model, unknowns),
        variation: Variation {
            noises: vec![Noise { sd: filming.sd, rho: 0.0 }; 2],
            is_stated: true,
            spreads: first_spreads(0.0).to_vec(),
        },
        scatters: own::scattering(unknowns),
        loss: None,
    };
    let made = samples.par_iter().enumerate().map(|(i, planned)| planned.filmed(i, filming, &film, shared));
    let made: Vec<(FilmedShot, Own)> = made.collect::<Result<_, _>>()?;
    // the variances of own unknowns if all others are known
    let variances = |(shot, own): &(FilmedShot, Own)| {
        let (products, _) = ShotAt { film: &film, shot, own, shared }.contribute().system(&[]);
        Some(products.cholesky()?.inverse().diagonal())
    };
    let variances: Vec<Option<Own>> = made.par_iter().map(variances).collect();
    let scattered = (0..SCATTERED.len()).map(|i| (FIRST_SCATTER + i, own::SCATTER + i, 0.0));
    let spins = [(TOPSPIN_SPREAD, own::TOPSPIN, filming.topspin_sd), (SIDE_SPREAD, own::SIDE, 0.0)];
    for (which, place, truth) in spins.into_iter().chain(scattered) {
        let variances: Vec<f64> = variances.iter().flatten().map(|variances| variances[place]).collect();
        film.variation.spreads[which].sd =
            found(&film.variation.spreads[which], &variances, truth, filming.shots as f64);
    }
    let informs = |((shot, own), variances): (&(FilmedShot, Own), &Option<Own>)| {
        variances.as_ref()?;
        let sums = ShotAt { film: &film, shot, own, shared }.contribute();
        sums.reduced(&Id::ALL).map(|(information, _)| information)
    };
    Ok(made.par_iter().zip(&variances).map(informs).collect())
}

impl PlannedShot {
    /// Returns the `i`-th shot as it is filmed, and its own unknowns.
    fn filmed(
        &self,
        i: usize,
        filming: &Filming,
        film: &FilmBlock,
        shared: &Shared,
    ) -> Result<(FilmedShot, Own), NotACollision> {
        // of shots without topspin fits find half on either side of the corner
        let side = if i.is_multiple_of(2) { EXACT } else { -EXACT };
        let topspin = if self.topspin == 0.0 { side } else { self.topspin };
        let radius = film.contact.object().radius;
        let [along, across] = self.velocity;
        let [x, y] = self.place;
        let mut own = own::moving([self.instant, x, y, self.direction, along, across]);
        let spin = match self.spin {
            Spin::Unknown if topspin != 1.0 => ShotSpin::SLIDES,
            stated => ShotSpin::stated(stated, own::velocity(&own), radius),
        };
        if !spin.rolls && spin.measured.is_none() {
            own[own::TOPSPIN] = topspin;
        }
        let mut shot = FilmedShot {
            tracks: Arc::default(),
            markers: Arc::default(),
            fps: filming.fps,
            side_spins: Vec::new(),
            spin,
            correction: None,
        };
        let at = ShotAt { film, shot: &shot, own: &own, shared };
        let (struck, seen) = (at.struck()?, at.paths());
        let frame = |ball: usize, n: usize| {
            let time = n as f64 / filming.fps;
            let seen = seen.as_ref()?.place(ball, time).into();
            Some(Frame { time, seen, weight: Point::repeat(1.0), apart: Point::zeros(), used: true })
        };
        let track = |ball: usize| (0..filming.frames).filter_map(|n| frame(ball, n)).collect();
        let mut tracks = [0, 1].map(track);
        set_apart(&mut tracks, filming.fps, radius);
        shot.tracks = Arc::new(tracks);
        let after = self.after_sd.into_iter().flatten().enumerate();
        shot.side_spins = after
            .map(|(ball, sd)| SideSpin {
                ball,
                spin: struck.after[ball].spin[2].re / radius,
                sd,
                through: Through::NONE,
            })
            .collect();
        Ok((shot, own))
    }
}

/// Returns the spread that some shots with the spread t show on average, by the variances of the value
/// of some of them.
fn found(spread: &Spread, variances: &[f64], truth: f64, shots: f64) -> f64 {
    let on_average = |variance: &f64| {
        let shown = spread.shown(0.0, *variance)?;
        Some(Shown { square: shown.variance + truth * truth, ..shown })
    };
    let shown: Vec<Shown> = variances.iter().filter_map(on_average).collect();
    spread.likeliest(&shown, shots / variances.len().max(1) as f64)
}
