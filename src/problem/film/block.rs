//! The frames of the balls of some shots as a block: each shot against the paths of its balls.

use std::sync::Arc;

use nalgebra::{DVector, SVector};
use rayon::prelude::*;

use super::camera::{Camera, Point};
use super::dual::gradient;
use super::impact::{Contact, Correction};
use super::marker_rotation::{MarkerTrack, Rotation, View, rotations};
use super::motion::{COEFFICIENTS, Piece, Struck, cue_before, locate, own_inputs};
use super::own::{self, MOVING, OWN, SCATTERED, input_of};
use super::spins::{FIRST_SCATTER, OFF_CORNER, SPREADS, ShotSpin, States, Through};
use crate::physics::cloth_motion::GRAVITY;
use crate::physics::collision::NotACollision;
use crate::problem::frames::{Columns, Frame, Sight, add_track, rows, whiten};
use crate::problem::loss::ShotLoss;
use crate::problem::policy::{COMPARED_STEPS, ROUGH, STALL};
use crate::problem::sums::{Contribution, Noise, OwnPrior, Spread, settle};
use crate::problem::unknowns::{CAMERA, Id, Own, PHYSICS, Shared};

/// Noise of the first descents, m: lines through the frames next to an impact miss the balls by as
/// much.
const COARSE_SD: f64 = 1e-3;

/// Frames on either side of the impact that take part in these at least.
const COARSE_FRAMES: usize = 8;

/// Derivatives by the coefficients of a piece and by the camera, and the residual.
const ROW: usize = COEFFICIENTS + CAMERA + 1;

/// A shot as it was filmed.
#[derive(Clone, Debug)]
pub(crate) struct FilmedShot {
    /// The frames of the cue ball and of the object ball.
    pub(crate) tracks: Arc<[Vec<Frame>; 2]>,
    /// Points on the balls.
    pub(crate) markers: Arc<Vec<MarkerTrack>>,
    /// Frames per second.
    pub(crate) fps: f64,
    /// Side spins of the balls just after the impact that markers show.
    pub(crate) side_spins: Vec<SideSpin>,
    pub(crate) spin: ShotSpin,
    /// The correction of the outcome by a finer model of the impact; `None`: there is none.
    pub(crate) correction: Option<Arc<Correction>>,
}

/// The side spin of a ball just after the impact. Spins about horizontal axes change unevenly: the
/// cloth does not touch a ball that hops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SideSpin {
    /// 0 for the cue ball, 1 for the object ball.
    pub(crate) ball: usize,
    /// rad/s.
    pub(crate) spin: f64,
    /// Its standard error, rad/s.
    pub(crate) sd: f64,
    /// The camera that shows it.
    pub(crate) through: Through,
}

impl FilmedShot {
    /// Returns the time since the impact of the last reading of a ball, s; without any, no end.
    fn lasts(&self, own: &Own, shared: &Shared) -> f64 {
        let camera = Camera::new(shared);
        let times = self.tracks.iter().flatten().map(|frame| frame.time + camera.delay(frame.seen));
        times.reduce(f64::max).map_or(f64::INFINITY, |last| last - own[own::TIME])
    }

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

/// Frames of balls.
#[derive(Clone)]
pub(crate) struct FilmBlock {
    pub(crate) shots: Arc<Vec<FilmedShot>>,
    /// Spreads from shot to shot: of topspin, side spin, and what else scatters.
    pub(crate) spreads: [Spread; SPREADS],
    pub(crate) contact: Contact,
    /// The noise of each ball.
    pub(crate) noise: [Noise; 2],
    /// Whether the noise of every frame is stated.
    pub(crate) states_noise: bool,
    /// Which of [`SCATTERED`] differ from shot to shot.
    pub(crate) scatters: [bool; SCATTERED.len()],
    /// How outlying shots count; `None`: by least squares.
    pub(crate) loss: Option<ShotLoss>,
}

impl FilmBlock {
    /// Returns the sums of residuals and derivatives of a shot, in units of the noise of each ball;
    /// they include the prior of its spin.
    pub(crate) fn contribute(&self, shot: &FilmedShot, own: &Own, shared: &Shared) -> Contribution {
        let add_up = |own: &Own| {
            let mut sums = self.add_frames(shot, own, shared);
            for (place, prior) in self.contact_priors() {
                sums.add_prior((place, prior), own[place], &self.spreads);
            }
            shot.spin.constrain(own, shared, &self.spreads, &mut sums);
            sums
        };
        let mut sums = if shot.spin.is_at_corner(own) { from_corner(own, add_up) } else { add_up(own) };
        if let Some(loss) = self.loss
            && let Some(distance) = distance(&sums)
        {
            sums.weigh(loss, distance);
        }
        sums
    }

    /// Returns what is known of how a shot differs from what all share, each with its place.
    fn contact_priors(&self) -> [(usize, OwnPrior); SCATTERED.len()] {
        let prior = |i| if self.scatters[i] { OwnPrior::Spread(FIRST_SCATTER + i) } else { OwnPrior::Held };
        std::array::from_fn(|i| (own::SCATTER + i, prior(i)))
    }

    fn add_frames(&self, shot: &FilmedShot, own: &Own, shared: &Shared) -> Contribution {
        let Ok(struck) = self.struck(shot, own, shared) else {
            return Contribution::impossible(OWN, PHYSICS + CAMERA, 2);
        };
        let object = self.contact.object();
        let mut total = Contribution::empty(OWN, PHYSICS + CAMERA, 2);
        total.sums.sticks = struck.sticks;
        for spin in &shot.side_spins {
            spin.add_to(&mut total, &struck, object.radius, shared);
        }
        let pieces = struck.paths(shared, shot.spin.rolls, &object, shot.lasts(own, shared));
        let inputs: Vec<usize> = (0..MOVING).chain(OWN..OWN + PHYSICS).collect();
        let others: Vec<usize> = (OWN + PHYSICS..=OWN + PHYSICS + CAMERA).collect();
        let columns = Columns { inputs: &inputs, others: &others };
        for (ball, pieces) in pieces.iter().enumerate() {
            let sights = self.look(shot, (ball, pieces), own, shared);
            add_track(&mut total, sights, pieces, &columns, [ball; 2]);
        }
        for (i, id) in SCATTERED.into_iter().enumerate().filter(|(i, _)| self.scatters[*i]) {
            total.repeat(OWN + id as usize, own::SCATTER + i);
        }
        total.or_impossible()
    }

    /// Returns the impact of a shot.
    pub(super) fn struck(
        &self,
        shot: &FilmedShot,
        own: &Own,
        shared: &Shared,
    ) -> Result<Struck, NotACollision> {
        Struck::new(own, shared, &shot.spin, (&self.contact, shot.correction.as_deref()))
    }

    /// Returns the paths of the balls of a shot; `None` if its unknowns describe no collision.
    pub(super) fn pieces(&self, shot: &FilmedShot, own: &Own, shared: &Shared) -> Option<[Vec<Piece>; 2]> {
        let struck = self.struck(shot, own, shared).ok()?;
        let object = self.contact.object();
        Some(struck.paths(shared, shot.spin.rolls, &object, shot.lasts(own, shared)))
    }

    /// Returns the used frames of each ball, whitened; `None` if the unknowns describe no
    /// collision.
    pub(super) fn sights(
        &self,
        shot: &FilmedShot,
        own: &Own,
        shared: &Shared,
    ) -> Option<[Vec<Sight<ROW>>; 2]> {
        let pieces = self.pieces(shot, own, shared)?;
        Some([0, 1].map(|ball| self.look(shot, (ball, &pieces[ball]), own, shared)))
    }

    fn look(
        &self,
        shot: &FilmedShot,
        (ball, pieces): (usize, &[Piece]),
        own: &Own,
        shared: &Shared,
    ) -> Vec<Sight<ROW>> {
        let camera = Camera::new(shared);
        let Noise { sd, rho } = self.noise[ball];
        whiten(&shot.tracks[ball], ([rho; 2], shot.fps), true, |frame| {
            see(frame, own[own::TIME], pieces, &camera, sd)
        })
    }

    /// Minimises χ² of a shot over its own unknowns and some shared ones, which it sets; returns
    /// the own unknowns at the minimum, and the sums there.
    pub(super) fn settle(
        &self,
        shot: &FilmedShot,
        own: Own,
        (shared, ids): (&mut Shared, &[Id]),
        stop: (usize, f64),
    ) -> (Own, Contribution) {
        let with = |x: &Own| {
            let mut all = shared.clone();
            for (id, value) in ids.iter().zip(x.iter().skip(OWN)) {
                all[*id] = *value;
            }
            all
        };
        let start = own.iter().copied().chain(ids.iter().map(|id| shared[*id]));
        let start = Own::from_iterator(OWN + ids.len(), start);
        let bounded = |x: Own| shot.spin.within(x);
        let (x, sums) = settle(start, ids, stop, |x: &Own| self.contribute(shot, x, &with(x)), bounded);
        *shared = with(&x);
        (x.rows(0, OWN).into_owned(), sums)
    }

    /// Raises the noise to what lines through the frames next to an impact miss the balls by, and
    /// leaves out frames so far away that a friction of the cloth that errs by 0.1 moves a ball by
    /// more.
    pub(crate) fn coarsen(&mut self, own: &[Own]) {
        for noise in &mut self.noise {
            noise.sd = noise.sd.max(COARSE_SD);
        }
        // ½ · 0.1 g t²
        let reach = (2.0 * COARSE_SD / (0.1 * GRAVITY)).sqrt();
        for (shot, own) in Arc::make_mut(&mut self.shots).iter_mut().zip(own) {
            let reach = reach.max(COARSE_FRAMES as f64 / shot.fps);
            for frame in Arc::make_mut(&mut shot.tracks).iter_mut().flatten() {
                frame.used &= (frame.time - own[own::TIME]).abs() < reach;
            }
        }
    }

    /// Makes all balls of unknown spin slide; returns whether there are any.
    pub(crate) fn slide(&mut self) -> bool {
        let spins = Arc::make_mut(&mut self.shots).iter_mut().map(|shot| &mut shot.spin);
        let unknown = spins.filter(|spin| spin.is_unknown());
        unknown.map(|spin| *spin = ShotSpin::UNKNOWN_SLIDING).count() > 0
    }

    /// Returns whether natural roll is stated of a shot.
    pub(crate) fn is_said_to_roll(&self) -> bool {
        self.shots.iter().any(|shot| shot.spin.is_said_to_roll())
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
        for noise in &mut self.noise {
            noise.sd *= factor;
        }
    }
}

/// Returns the sums on the side of the corner on which χ² decreases; if it does on neither, those
/// with the topspin held.
fn from_corner(own: &Own, add_up: impl Fn(&Own) -> Contribution) -> Contribution {
    let beside = |topspin: f64| {
        let mut own = own.clone();
        own[own::TOPSPIN] = topspin;
        add_up(&own)
    };
    let top = beside(OFF_CORNER);
    if top.slope(own::TOPSPIN) < 0.0 {
        return top;
    }
    let mut draw = beside(-OFF_CORNER);
    draw.sums.held[own::TOPSPIN] |= draw.slope(own::TOPSPIN) < 0.0;
    draw
}

/// Returns how far outcome offsets are from 0 in their standard deviations; `None` if the frames do
/// not determine them.
pub(crate) fn distance(sums: &Contribution) -> Option<f64> {
    let (information, gradient) = sums.reduced(&Id::OFFSETS)?;
    let square = gradient.dot(&information.cholesky()?.solve(&gradient));
    square.is_finite().then(|| square.max(0.0).sqrt())
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

/// Returns the index of the piece that a ball is on in a frame, and the rows of both coordinates.
fn see(
    frame: &Frame,
    instant: f64,
    pieces: &[Piece],
    camera: &Camera,
    sd: f64,
) -> (usize, [SVector<f64, ROW>; 2]) {
    let time = frame.time - instant + camera.delay(frame.seen);
    let index = pieces.partition_point(|piece| piece.start <= time).saturating_sub(1);
    let at = &pieces[index].at;
    let powers = [1.0, time, 0.5 * time * time];
    let (place, height) = locate(at.as_slice(), time);
    let [v_x, v_y, v_h] = [0, 1, 2].map(|i| at[3 * i + 1] + at[3 * i + 2] * time);
    let seen = camera.look(place, height);
    let by_time = seen.by_place * Point::new(v_x, v_y) + seen.by_height * v_h;
    let by_axes = [seen.by_place.column(0).into(), seen.by_place.column(1).into(), seen.by_height];
    let by: [Point; COEFFICIENTS] = std::array::from_fn(|i| by_axes[i / 3] * powers[i % 3]);
    (index, rows(frame, seen, &by, by_time, Point::repeat(sd)))
}

/// Decrease of χ² by which a sliding ball must be likelier than a rolling one: most cue balls roll.
const ROLL_BONUS: f64 = 9.0;

/// Topspin at which a shot's descent starts in another state, over natural roll.
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
            let candidates = shot.spin.candidates().into_iter();
            let judged = candidates.map(|spin| self.judge_state(shot, &spin, own, shared));
            let is_open = shot.spin.states != States::One;
            is_open.then(|| judged.min_by(|a, b| a.cost.total_cmp(&b.cost))).flatten()
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

    fn judge_state(&self, shot: &FilmedShot, spin: &ShotSpin, own: &Own, shared: &Shared) -> Judged {
        let is_same = spin.is_same_state(&shot.spin);
        let mut start = own.clone();
        if spin.states == States::Measured || spin.rolls {
            start[own::TOPSPIN] = 0.0;
        } else if !is_same {
            start[own::TOPSPIN] = SLIDE_START + spin.bounds[0].max(0.0);
        }
        let shot = FilmedShot { spin: *spin, ..shot.clone() };
        let (own, sums) = self.settle(&shot, start, (&mut shared.clone(), &[]), (COMPARED_STEPS, STALL));
        // states of equal likelihood do not alternate
        let bonus = if spin.rolls { ROLL_BONUS } else { 0.0 };
        let inertia = if is_same { ROUGH } else { 0.0 };
        Judged { spin: *spin, own, cost: sums.sums.cost - bonus - inertia }
    }
}
