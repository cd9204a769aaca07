//! The frames of the balls of some shots as a block: each shot against the paths of its balls.

use std::sync::Arc;

use nalgebra::DVector;
use rayon::prelude::*;

use super::camera::{Camera, Point};
use super::dual::gradient;
use super::filmed::{FilmBlock, FilmedShot, ShotAt, SideSpin};
use super::marker_rotation::{Rotation, View, rotations};
use super::motion::{COEFFICIENTS, Piece, Struck, cue_before, locate, own_inputs};
use super::own::{self, MOVING, OWN, SCATTERED, input_of};
use super::spins::{FIRST_SCATTER, ShotSpin, States, Through};
use crate::numerics::EXACT;
use crate::numerics::dense::{Place, descend};
use crate::physics::cloth_motion::GRAVITY;
use crate::problem::frames::{Frame, Sight, add_track, rows, whiten};
use crate::problem::policy::{COMPARED_STEPS, ROUGH, STALL};
use crate::problem::sums::{Contribution, Noise, OwnPrior, Scattered};
use crate::problem::unknowns::{CAMERA, Id, Own, PHYSICS, Shared};

/// Noise of the first descents, m: lines through the frames next to an impact miss the balls by as
/// much.
const COARSE_SD: f64 = 1e-3;

/// Frames on either side of the impact that take part in these at least.
const COARSE_FRAMES: usize = 8;

/// Derivatives by the coefficients of a piece and by the camera, and the residual.
const ROW: usize = COEFFICIENTS + CAMERA + 1;

impl FilmedShot {
    /// Measures the spins that markers show through this camera. The balls turn as before.
    pub(super) fn measure_spins(&mut self, own: &mut Own, camera: Camera, radius: f64) {
        if self.markers.is_empty() {
            return;
        }
        let [before, after @ ..] =
            rotations(&self.markers, &self.tracks, (own[own::TIME], self.fps), View { camera, radius });
        let side_spin = |(ball, rotation): (usize, Option<Rotation>)| {
            let Rotation { spin, covariance, by_camera } = rotation?;
            let through = Through { camera, by: by_camera.row(2).transpose().into() };
            Some(SideSpin { ball, spin: spin.z, sd: covariance[(2, 2)].sqrt(), through })
        };
        self.side_spins = after.into_iter().enumerate().filter_map(side_spin).collect();
        if let Some(rotation) = before {
            let velocity = own::velocity(own);
            let new = ShotSpin::seen(&rotation, camera, velocity, radius);
            self.spin = self.spin.measured_again(new, own, velocity, radius);
        }
    }
}

impl FilmBlock {
    /// Raises the noise to what lines through the frames next to an impact miss the balls by, and
    /// leaves out frames so far away that a friction of the cloth that errs by 0.1 moves a ball by
    /// more.
    pub(crate) fn coarsen(&mut self, own: &[Own]) {
        for noise in &mut self.variation.noises {
            noise.sd = noise.sd.max(COARSE_SD);
        }
        // ½ · 0.1 g t²
        let reach = (2.0 * COARSE_SD / (0.1 * GRAVITY)).sqrt();
        self.keep_frames(own, |away, fps| away.abs() < reach.max(COARSE_FRAMES as f64 / fps));
    }

    /// Leaves out the frames for which `is_kept` is false, given their time after the impact, s, and
    /// their rate.
    pub(super) fn keep_frames(&mut self, own: &[Own], is_kept: impl Fn(f64, f64) -> bool) {
        for (shot, own) in Arc::make_mut(&mut self.shots).iter_mut().zip(own) {
            for frame in Arc::make_mut(&mut shot.tracks).iter_mut().flatten() {
                frame.used &= is_kept(frame.time - own[own::TIME], shot.fps);
            }
        }
    }

    /// Makes all balls of unknown spin slide; returns whether there are any.
    pub(crate) fn slide(&mut self) -> bool {
        let spins = Arc::make_mut(&mut self.shots).iter_mut().map(|shot| &mut shot.spin);
        let unknown = spins.filter(|spin| spin.is_unknown());
        unknown.map(|spin| *spin = ShotSpin::UNKNOWN_SLIDING).count() > 0
    }

    /// Computes what weight and cloth during the contact add to the outcome of each shot. A
    /// shot whose unknowns describe no collision has no correction.
    pub(crate) fn weigh(&mut self, own: &[Own], shared: &Shared) {
        let contact = self.contact.with_weight();
        self.contact = contact;
        Arc::make_mut(&mut self.shots).par_iter_mut().zip(own).for_each(|(shot, own)| {
            let cue = cue_before(&shot.spin, shared, &own_inputs(own), &contact.object());
            shot.correction = contact.correct(&cue, shared).map(Arc::new);
        });
    }

    /// Counts the picture in another unit and from another middle: a place becomes `factor`·place +
    /// `by`.
    pub(crate) fn move_picture(&mut self, factor: f64, by: Point) {
        for shot in Arc::make_mut(&mut self.shots) {
            let balls = Arc::make_mut(&mut shot.tracks).iter_mut();
            let markers = Arc::make_mut(&mut shot.markers).iter_mut().map(|marker| &mut marker.frames);
            for frame in balls.chain(markers).flatten() {
                frame.seen = frame.seen * factor + by;
            }
        }
        for noise in &mut self.variation.noises {
            noise.sd *= factor;
        }
    }
}

/// The least χ² of a shot.
#[derive(Clone)]
pub(super) struct Settled {
    pub(super) own: Own,
    pub(super) shared: Shared,
    pub(super) sums: Contribution,
}

impl ShotAt<'_> {
    /// Returns the sums of residuals and derivatives of the shot, in units of the noise of each
    /// ball; they include the prior of its spin.
    pub(crate) fn contribute(&self) -> Contribution {
        let Self { film, own, .. } = *self;
        let mut sums = self.add_frames();
        for (i, scatters) in film.scatters.into_iter().enumerate() {
            let prior = if scatters { OwnPrior::Spread(FIRST_SCATTER + i) } else { OwnPrior::Held };
            sums.add_prior((own::SCATTER + i, prior), own[own::SCATTER + i], &film.variation.spreads);
        }
        self.constrain_spin(&mut sums);
        if let Some(loss) = self.film.loss
            && let Some(offsets) = sums.offsets()
        {
            sums.weigh(loss, offsets.distance);
        }
        sums
    }

    /// Adds what is known of the spin to the sums, and marks own unknowns that are held: for good, or
    /// at a bound that they press against.
    fn constrain_spin(&self, sums: &mut Contribution) {
        let Self { film, shot, own, shared } = *self;
        let spin = &shot.spin;
        for ((place, prior), through) in (own::TOPSPIN..).zip(spin.priors).zip(&spin.through) {
            let mut by = DVector::zeros(sums.products.ncols() - 1);
            by[place] = 1.0;
            match (prior, spin.mean) {
                (OwnPrior::Spread(spread), Some(mean)) if place == own::TOPSPIN => {
                    by[OWN + mean as usize] = -1.0;
                    let value = own[place] - shared[mean];
                    sums.add_scattered(
                        Scattered { spread, shows_spread: true, place, value, by },
                        &film.variation.spreads,
                    );
                }
                (OwnPrior::Stated(sd), _) => {
                    let value = own[place] - through.shift(shared, &mut by);
                    sums.add_stated((place, sd), value, &by);
                }
                (prior, _) => sums.add_prior((place, prior), own[place], &film.variation.spreads),
            }
        }
        let (value, slope) = (own[own::TOPSPIN], sums.slope(own::TOPSPIN));
        let is_at = |bound: f64| (value - bound).abs() < EXACT;
        let presses = is_at(spin.bounds[0]) && slope > 0.0 || is_at(spin.bounds[1]) && slope < 0.0;
        sums.sums.held[own::TOPSPIN] |= presses;
    }

    fn add_frames(&self) -> Contribution {
        let Ok(struck) = self.struck() else {
            return Contribution::impossible(OWN, PHYSICS + CAMERA, 2);
        };
        let mut total = Contribution::empty(OWN, PHYSICS + CAMERA, 2);
        total.sums.sticks = struck.sticks;
        for spin in &self.shot.side_spins {
            spin.add_to(&mut total, &struck, self.film.contact.object().radius, self.shared);
        }
        let columns: Vec<usize> = (0..MOVING).chain(OWN..=OWN + PHYSICS + CAMERA).collect();
        for (ball, pieces) in struck.paths(self).iter().enumerate() {
            add_track(&mut total, self.look(ball, pieces), pieces, &columns, [ball; 2]);
        }
        for (i, id) in SCATTERED.into_iter().enumerate().filter(|(i, _)| self.film.scatters[*i]) {
            total.repeat(OWN + id as usize, own::SCATTER + i);
        }
        total.or_impossible()
    }

    /// Returns the used frames of each ball, whitened; `None` if the unknowns describe no
    /// collision.
    pub(super) fn sights(&self) -> Option<[Vec<Sight<ROW>>; 2]> {
        let pieces = self.struck().ok()?.paths(self);
        Some([0, 1].map(|ball| self.look(ball, &pieces[ball])))
    }

    fn look(&self, ball: usize, pieces: &[Piece]) -> Vec<Sight<ROW>> {
        let (camera, instant) = (Camera::new(self.shared), self.own[own::TIME]);
        let Noise { sd, rho } = self.film.variation.noises[ball];
        let late = ball as f64 / self.shot.fps;
        let see = |frame: &Frame| {
            let time = frame.time - instant + camera.delay(frame.seen, late);
            let index = pieces.partition_point(|piece| piece.start <= time).saturating_sub(1);
            let at = &pieces[index].at;
            let powers = [1.0, time, 0.5 * time * time];
            let (place, height) = locate(at.as_slice(), time);
            let [v_x, v_y, v_h] = [0, 1, 2].map(|i| at[3 * i + 1] + at[3 * i + 2] * time);
            let mut seen = camera.find_tracked(ball, camera.look(place, height));
            seen.place += frame.apart * self.shared[Id::Push];
            seen.by_camera[Id::Push as usize - PHYSICS] = frame.apart;
            let by_time = seen.by_place * Point::new(v_x, v_y) + seen.by_height * v_h;
            let by_axes = [seen.by_place.column(0).into(), seen.by_place.column(1).into(), seen.by_height];
            let by: [Point; COEFFICIENTS] = std::array::from_fn(|i| by_axes[i / 3] * powers[i % 3]);
            (index, rows(frame, seen, &by, (by_time, late), Point::repeat(sd)))
        };
        whiten(&self.shot.tracks[ball], ([rho; 2], self.shot.fps), true, see)
    }

    /// Minimises χ² over the own unknowns of the shot and some shared ones: by some steps, or until
    /// one gains less than a decrease of χ².
    pub(super) fn settle(&self, ids: &[Id], stop: (usize, f64)) -> Settled {
        let start = self.own.iter().copied().chain(ids.iter().map(|id| self.shared[*id]));
        let start = Own::from_iterator(OWN + ids.len(), start);
        let end = descend(start, stop, |x| {
            let x = self.shot.spin.within(x);
            let (own, mut shared) = (x.rows(0, OWN).into_owned(), self.shared.clone());
            for (id, value) in ids.iter().zip(x.iter().skip(OWN)) {
                shared[*id] = *value;
            }
            let sums = ShotAt { own: &own, shared: &shared, ..*self }.contribute();
            let (matrix, gradient) = sums.system(ids);
            Place { x, sum: sums.sums.cost, matrix, gradient, rest: Settled { own, shared, sums } }
        });
        end.rest
    }

    /// Returns the least χ² of the shot in a state.
    fn judge_state(&self, spin: &ShotSpin) -> Judged {
        let is_same = spin.is_same_state(&self.shot.spin);
        let mut own = self.own.clone();
        if spin.states == States::Measured || spin.rolls {
            own[own::TOPSPIN] = 0.0;
        } else if !is_same {
            let [low, high] = spin.bounds;
            own[own::TOPSPIN] = if high > 0.0 { low.max(0.0) + SLIDE_START } else { high - SLIDE_START };
        }
        let shot = FilmedShot { spin: *spin, ..self.shot.clone() };
        let settled = ShotAt { shot: &shot, own: &own, ..*self }.settle(&[], (COMPARED_STEPS, STALL));
        // states of equal likelihood do not alternate
        let bonus = if spin.rolls { ROLL_BONUS } else { 0.0 };
        let inertia = if is_same { ROUGH } else { 0.0 };
        Judged { spin: *spin, own: settled.own, cost: settled.sums.sums.cost - bonus - inertia }
    }
}

impl SideSpin {
    /// Adds what markers show of a side spin after the impact.
    fn add_to(&self, total: &mut Contribution, struck: &Struck, radius: f64, shared: &Shared) {
        let predicted = struck.after[self.ball].spin[2] / radius;
        let mut by = DVector::zeros(total.products.ncols() - 1);
        let by_inputs = gradient(&predicted);
        (0..OWN + PHYSICS).for_each(|place| by[place] = by_inputs[input_of(place)]);
        let off = predicted.re - self.spin - self.through.shift(shared, &mut by);
        total.add_number(off / self.sd, (by / self.sd).as_slice());
    }
}

/// Decrease of χ² by which a sliding ball must be likelier than a rolling one: most cue balls roll.
const ROLL_BONUS: f64 = 9.0;

/// Topspin at which a shot's descent starts in another state, from the bound nearer to 0, over
/// natural roll.
const SLIDE_START: f64 = 0.3;

/// A state of a shot with the values of its own unknowns there, and its χ².
struct Judged {
    spin: ShotSpin,
    own: Own,
    cost: f64,
}

impl FilmBlock {
    /// Chooses for every shot the likeliest of the states that it may be in given the shared
    /// unknowns, with the spins that markers show through this camera; returns whether one has
    /// changed.
    pub(crate) fn choose_states(&mut self, own: &mut [Own], shared: &Shared) -> bool {
        let (camera, radius) = (Camera::new(shared), self.contact.object().radius);
        if self.shots.iter().all(|shot| shot.spin.states == States::One && shot.markers.is_empty()) {
            return false;
        }
        let shots = Arc::make_mut(&mut self.shots).par_iter_mut().zip(&mut *own);
        shots.for_each(|(shot, own)| shot.measure_spins(own, camera, radius));
        let judge = |(shot, own): (&FilmedShot, &Own)| {
            let at = ShotAt { film: self, shot, own, shared };
            let judged = shot.spin.candidates().into_iter().map(|spin| at.judge_state(&spin));
            judged.min_by(|a, b| a.cost.total_cmp(&b.cost))
        };
        let best: Vec<Option<Judged>> = self.shots.par_iter().zip(&*own).map(judge).collect();
        let mut changed = false;
        for ((shot, own), best) in Arc::make_mut(&mut self.shots).iter_mut().zip(own).zip(best) {
            let Some(Judged { spin, own: values, .. }) = best else { continue };
            changed |= !spin.is_same_state(&shot.spin);
            (shot.spin, *own) = (spin, values);
        }
        changed
    }
}
