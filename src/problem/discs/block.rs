//! The frames of some shots of discs as a block.

use std::sync::Arc;

use nalgebra::DVector;

use super::motion::{COEFFICIENTS, Dual, Motion, follow, impulse_ratio, list_moving, locate, restitution};
use super::own::{self, CORE, Component, spreads};
use super::stuck::Stuck;
use crate::physics::disc::Discs;
use crate::problem::film::camera::{Camera, Point};
use crate::problem::film::dual::{constant, gradient};
use crate::problem::frames::{Frame, Sight, add_track, rows, whiten};
use crate::problem::sums::{Contribution, Noise, OwnPrior, Scattered, Variation};
use crate::problem::unknowns::{CAMERA, Own, PHYSICS, SHARED, Shared};

/// Prior standard deviation of an unknown offset, over the normal impulse or the closing speed, and
/// of an unknown distance of the centres, m.
const ANY: f64 = 3.0;
const ANY_DISTANCE: f64 = 1e3;

/// Derivative of J_t/J_n by μ from which on a contact counts as sliding to its end: of rigid ones 1,
/// and 0 if they stick.
const SLIDES: f64 = 0.9;

/// Number of noises of a shot: of each disc along x and along y.
pub(super) const NOISES: usize = 4;

/// Numbers that the place of a point depends on: the coefficients of the piece, the instant, and
/// direction and radius of a marker. In a row, derivatives by the camera and the residual follow.
const POINT: usize = COEFFICIENTS + 3;
const ROW: usize = POINT + CAMERA + 1;

/// A point on a disc in the frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct PointTrack {
    /// Which disc it is on.
    pub(crate) disc: usize,
    /// Places of its direction and of its distance from the centre among the own unknowns; `None`
    /// for the centre.
    pub(crate) marker: Option<[usize; 2]>,
    pub(crate) frames: Vec<Frame>,
}

/// The frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct ShotFrames {
    pub(crate) tracks: Vec<PointTrack>,
    /// Frames per second.
    pub(crate) fps: f64,
    /// Whether the rotation of each disc is seen.
    pub(crate) turns: [bool; 2],
    /// Whether both spins before the impact are known.
    pub(crate) knows_slip: bool,
    /// The coordinate that never changes in a film of one dimension.
    pub(crate) flat: Option<usize>,
    /// How the discs stick together after the impact, if they do.
    pub(crate) stuck: Option<Stuck>,
    /// Standard deviation of a coordinate of each disc that neighbouring frames show, m.
    pub(crate) position_sd: [f64; 2],
    /// Number of frames that were left out as wrong.
    pub(crate) outliers: usize,
    /// Number of frames on either side of the impact within which they are used.
    pub(crate) reach: f64,
    /// Reaches that were tried, with their misfit, the largest first; `None` if the last is chosen.
    pub(crate) tried: Option<Vec<(f64, f64)>>,
}

/// Frames of discs.
#[derive(Clone)]
pub(crate) struct DiscBlock {
    pub(crate) shots: Arc<Vec<ShotFrames>>,
    pub(crate) discs: Discs,
    /// Whether shots scatter about a law of the impact; else they have any e and J_t/J_n, any
    /// balance of momentum and any spins.
    pub(crate) has_law: bool,
    /// The noises of each shot one after the other, and the spreads of each [`Component`].
    pub(crate) variation: Variation,
}

impl DiscBlock {
    /// Returns the noises of shot `i`.
    pub(super) fn noise_of(&self, i: usize) -> &[Noise] {
        &self.variation.noises[NOISES * i..NOISES * (i + 1)]
    }

    /// Returns the motion of shot `i`, and the used frames of each track, whitened; `None` if the
    /// discs do not approach. Errors before the impact and after it count as independent: the
    /// frames between are left out.
    pub(super) fn sights(
        &self,
        i: usize,
        own: &Own,
        shared: &Shared,
    ) -> Option<(Motion, Vec<Vec<Sight<ROW>>>)> {
        let motion = follow(self.shots[i].stuck.is_some(), own, shared, &self.discs)?;
        let dual = |i: usize, value: f64| constant::<POINT>(value).derivative(i);
        let (instant, camera) = (own[own::TIME], Camera::new(shared));
        let see = |PointTrack { disc, marker, frames }: &PointTrack| {
            let marker = marker.map(|[direction, radius]| {
                [dual(COEFFICIENTS + 1, own[direction]), dual(COEFFICIENTS + 2, own[radius])]
            });
            let pieces = motion.pieces[*disc]
                .each_ref()
                .map(|piece| -> [_; COEFFICIENTS] { std::array::from_fn(|i| dual(i, piece.at[i])) });
            let [x, y] = [0, 1].map(|axis| self.noise_of(i)[2 * disc + axis]);
            let fps = self.shots[i].fps;
            let frame_s = *disc as f64 / fps;
            whiten(frames, ([x.rho, y.rho], fps), false, |frame| {
                let side = usize::from(frame.time > instant);
                let late = dual(COEFFICIENTS, frame.time - instant + camera.delay(frame.seen, frame_s));
                let place = locate(&pieces[side], late, marker);
                let (by_x, by_y) = (gradient(&place.x), gradient(&place.y));
                let seen = camera.look(Point::new(place.x.re, place.y.re), 0.0);
                let mut by: [Point; POINT] =
                    std::array::from_fn(|i| seen.by_place * Point::new(by_x[i], by_y[i]));
                // the instant is earlier if the frame is later
                let by_time = by[COEFFICIENTS];
                by[COEFFICIENTS] = -by_time;
                (side, rows(frame, seen, &by, (by_time, frame_s), Point::new(x.sd, y.sd)))
            })
        };
        let sights = self.shots[i].tracks.iter().map(see).collect();
        Some((motion, sights))
    }

    /// Returns the sums of shot `i`, with what is known of its own unknowns.
    pub(crate) fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        let (shot, count) = (&self.shots[i], own.len());
        let Some((motion, sights)) = self.sights(i, own, shared) else {
            return Contribution::impossible(count, SHARED, self.variation.noises.len());
        };
        let mut total = Contribution::empty(count, SHARED, self.variation.noises.len());
        total.sums.sticks = shot.stuck.is_some();
        for (track, sights) in shot.tracks.iter().zip(sights) {
            // without a marker its derivatives are 0
            let [direction, radius] = track.marker.unwrap_or([own::TIME; 2]);
            let by_camera = (0..CAMERA).map(|i| count + PHYSICS + i);
            let mut columns = places_of_inputs(count);
            columns
                .extend([own::TIME, direction, radius].into_iter().chain(by_camera).chain([count + SHARED]));
            let noise = NOISES * i + 2 * track.disc;
            add_track(&mut total, sights, &motion.pieces[track.disc], &columns, [noise, noise + 1]);
        }
        let mut total = total.or_impossible();
        for (place, prior) in self.own_priors(i) {
            total.add_prior((place, prior), own[place], &self.variation.spreads);
        }
        for number in self.deviations(i, &motion, (own, shared)) {
            total.add_scattered(number, &self.variation.spreads);
        }
        total
    }

    /// Returns how far shot `i` is from the law of the impact: its e and, if its slip is known,
    /// J_t/J_n.
    fn deviations(&self, i: usize, motion: &Motion, (own, shared): (&Own, &Shared)) -> Vec<Scattered> {
        if !self.has_law {
            return Vec::new();
        }
        let [parting, slip] = motion.relative(0);
        let (e, ratio) = (motion.own[own::RESTITUTION], motion.own[own::RATIO]);
        let inputs = [-parting, slip, e, motion.own[own::FRICTION]];
        let law = impulse_ratio(inputs, shared, self.discs.inertia);
        let off_friction = law.filter(|_| self.shows_friction(i)).map(|law| ratio - law);
        // where contacts slide to the end, a scatter of J_t/J_n looks like one of μ
        let slides = |off: &Dual| gradient(off)[own::FRICTION].abs() > SLIDES;
        let number = |(spread, off): (usize, Dual)| Scattered {
            spread,
            shows_spread: !slides(&off),
            place: own::RESTITUTION + spread,
            value: off.re,
            by: by_unknowns(&off, own.len()),
        };
        let off_restitution = e - restitution(&-parting, shared);
        std::iter::once(off_restitution).chain(off_friction).enumerate().map(number).collect()
    }

    /// Returns whether the slip of two shots or more is known, which a law of friction needs.
    pub(super) fn knows_slips(&self) -> bool {
        self.shots.iter().filter(|shot| shot.knows_slip).take(2).count() > 1
    }

    /// Returns whether shot `i` has a part in a law of friction.
    fn shows_friction(&self, i: usize) -> bool {
        self.has_law && self.shots[i].knows_slip && self.knows_slips()
    }

    /// Returns what is known of own unknowns of shot `i`.
    pub(crate) fn own_priors(&self, i: usize) -> Vec<(usize, OwnPrior)> {
        let shot = &self.shots[i];
        let mut all = vec![(own::LEAD, OwnPrior::Stated(shot.fps.recip()))];
        for (which, Component { places, .. }) in Component::ALL.iter().enumerate() {
            let prior = match places.start {
                // the law has it
                own::RESTITUTION if self.has_law => continue,
                own::RATIO if self.shows_friction(i) => continue,
                own::FRICTION if !self.shows_friction(i) => OwnPrior::Held,
                own::DISTANCE if shot.flat.is_some() => OwnPrior::Stated(ANY_DISTANCE),
                own::RATIO => OwnPrior::Stated(ANY),
                own::RESTITUTION..own::SLOWING if !self.has_law => OwnPrior::Stated(ANY),
                _ => OwnPrior::Spread(which),
            };
            all.extend(places.clone().map(|place| (place, prior)));
        }
        let mut hold = |places: &[usize]| {
            all.retain(|(place, _)| !places.contains(place));
            all.extend(places.iter().map(|place| (*place, OwnPrior::Held)));
        };
        if let Some(axis) = shot.flat {
            // no motion across the film
            hold(&[own::X, own::VELOCITY, own::VELOCITY + 2].map(|first| first + axis));
            hold(&[own::DIRECTION, own::RATIO, own::MOMENTUM + 1, own::LEAD]);
        }
        if shot.stuck.is_some() {
            hold(&[own::RESTITUTION, own::SPIN_RATIO, own::SPIN_RATIO + 1, own::LEAD]);
        }
        for disc in (0..2).filter(|disc| !shot.turns[*disc]) {
            hold(&[own::SPIN + disc, own::SPIN_RATIO + disc]);
        }
        all
    }

    /// Takes shots instead of all; one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        self.variation.noises = indices.iter().flat_map(|i| self.noise_of(*i).to_vec()).collect();
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
        if self.shots.len() == 1 {
            self.variation.spreads = spreads(&self.discs, 1);
        }
    }
}

/// Returns the places of the inputs of a motion among `count` own unknowns and the shared ones.
fn places_of_inputs(count: usize) -> Vec<usize> {
    (0..CORE).chain(list_moving().map(|id| count + id as usize)).collect()
}

/// Returns the derivatives of a number by `count` own unknowns and the shared ones.
pub(super) fn by_unknowns(number: &Dual, count: usize) -> DVector<f64> {
    let mut by = DVector::zeros(count + SHARED);
    for (place, by_input) in places_of_inputs(count).into_iter().zip(&gradient(number)) {
        by[place] = *by_input;
    }
    by
}
