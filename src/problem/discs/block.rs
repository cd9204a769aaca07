//! The frames of some shots of discs as a block.

use std::sync::Arc;

use nalgebra::SVector;
use num_dual::DualSVec64;

use super::lines::{LEAST, Stuck};
use super::motion::{COEFFICIENTS, MOVING, Paths, follow, locate};
use super::own::{self, CORE, Component, spreads};
use crate::physics::disc::Discs;
use crate::problem::film::camera::{Camera, Point};
use crate::problem::film::dual::{constant, gradient};
use crate::problem::frames::{Columns, Frame, Sight, add_track, whiten};
use crate::problem::sums::{Contribution, Noise, OwnPrior, Spread};
use crate::problem::unknowns::{CAMERA, Id, Normal, Own, PHYSICS, SHARED, Shared};

/// Number of frames on either side of the impact that are left out at least.
pub(super) const TOUCHING: usize = 1;

/// Prior standard deviation of an unknown offset, over the normal impulse or the closing speed.
pub(super) const ANY: OwnPrior = OwnPrior::Stated(Normal { mean: 0.0, sd: 3.0 });

/// Number of noises of a shot: of each disc along x and along y.
pub(super) const NOISES: usize = 4;

/// Numbers that the place of a point depends on: the coefficients of the piece, the instant, and direction and
/// radius of a marker. In a row, derivatives by the camera and the residual follow.
const POINT: usize = COEFFICIENTS + 3;
const OTHERS: usize = 3 + CAMERA + 1;
const ROW: usize = COEFFICIENTS + OTHERS;

/// Which outcome of an impact each shot may have besides that of the law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Freedom {
    /// One shot may differ from the law by the scatter.
    Law,
    /// Any e and J_t/J_n; momentum and spins scatter.
    Outcome,
    /// Any e and J_t/J_n, with any balance of momentum, and any spins.
    Everything,
}

/// A point on a disc in the frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct PointTrack {
    /// Which disc it is on.
    pub(crate) disc: usize,
    /// Places of its direction and of its distance from the centre among the own unknowns; `None` for
    /// the centre.
    pub(crate) marker: Option<[usize; 2]>,
    pub(crate) frames: Vec<Frame>,
}

/// The frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct ShotFrames {
    pub(crate) name: String,
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
    /// Priors of own unknowns in every fit.
    pub(crate) known: Vec<(usize, OwnPrior)>,
    /// Standard deviation of a coordinate of each disc that neighbouring frames show, m.
    pub(crate) position_sd: [f64; 2],
    /// Number of frames on either side of the impact in which the discs may touch.
    pub(crate) touching: usize,
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
    pub(crate) freedom: Freedom,
    /// The noises of each shot one after the other.
    pub(crate) noise: Vec<Noise>,
    /// Spreads of each [`Component`].
    pub(crate) spreads: Vec<Spread>,
}

impl ShotFrames {
    /// Follows both discs through the impact; `None` if they do not approach.
    pub(super) fn follow(&self, own: &Own, shared: &Shared, discs: &Discs) -> Option<Paths> {
        follow((self.stuck.is_some(), self.turns), own, shared, discs)
    }

    /// Uses the frames within reach of the impact, but for those in which the discs may still touch unless too
    /// few are left.
    pub(crate) fn choose_frames(&mut self, instant: f64) {
        let [from, to] = self.stuck.map_or([instant; 2], |stuck| stuck.settling);
        // frames from the contact
        let away = |frame: &Frame| (from - frame.time).max(frame.time - to) * self.fps;
        for track in &mut self.tracks {
            let after = track.frames.partition_point(|frame| frame.time <= instant);
            let (early, late) = track.frames.split_at_mut(after);
            for side in [early, late] {
                let apart = side.iter().filter(|frame| away(frame) >= self.touching as f64).count();
                let least = if apart < LEAST { f64::NEG_INFINITY } else { self.touching as f64 };
                for frame in side {
                    frame.used = (least..=self.reach).contains(&away(frame));
                }
            }
        }
    }
}

impl DiscBlock {
    pub fn new(shots: Vec<ShotFrames>, discs: Discs, noise: Vec<Noise>) -> Self {
        let spreads = spreads(&discs, shots.len());
        Self { shots: Arc::new(shots), discs, freedom: Freedom::Outcome, noise, spreads }
    }

    /// Returns the noises of shot `i`.
    pub(crate) fn noise_of(&self, i: usize) -> &[Noise] {
        &self.noise[NOISES * i..NOISES * (i + 1)]
    }

    /// Returns the used frames of each track of shot `i`, whitened; an empty list if the discs do not approach.
    pub(crate) fn sights(&self, i: usize, own: &Own, shared: &Shared) -> Vec<Vec<Sight<ROW>>> {
        let Some(paths) = self.shots[i].follow(own, shared, &self.discs) else { return Vec::new() };
        self.shots[i].tracks.iter().map(|track| self.look(i, track, &paths, own, shared)).collect()
    }

    /// Returns the used frames of a track of shot `i`, whitened. Errors before the impact and after it count as
    /// independent: the frames between are left out.
    fn look(
        &self,
        i: usize,
        track: &PointTrack,
        paths: &Paths,
        own: &Own,
        shared: &Shared,
    ) -> Vec<Sight<ROW>> {
        let of = |i: usize, value: f64| constant::<POINT>(value).derivative(i);
        let time = of(COEFFICIENTS, own[own::TIME]);
        let marker = track.marker.map(|[direction, radius]| {
            [of(COEFFICIENTS + 1, own[direction]), of(COEFFICIENTS + 2, own[radius])]
        });
        let pieces = paths.pieces[track.disc].each_ref().map(|piece| -> [DualSVec64<POINT>; COEFFICIENTS] {
            std::array::from_fn(|i| of(i, piece.at[i]))
        });
        let camera = Camera::new(shared);
        let [x, y] = [0, 1].map(|axis| self.noise_of(i)[2 * track.disc + axis]);
        whiten(&track.frames, ([x.rho, y.rho], self.shots[i].fps), false, |frame| {
            let side = usize::from(frame.time > own[own::TIME]);
            let late = -time + frame.time + camera.delay(frame.seen);
            let place = locate(&pieces[side], late, marker);
            let (by_x, by_y) = (gradient(&place.x), gradient(&place.y));
            let mut seen = camera.look(Point::new(place.x.re, place.y.re), 0.0);
            // a later reading sees the point further along its path
            let by_time = seen.by_place * -Point::new(by_x[COEFFICIENTS], by_y[COEFFICIENTS]);
            seen.by_camera[Id::ShutterX as usize - PHYSICS] = by_time * frame.seen.x;
            seen.by_camera[Id::ShutterY as usize - PHYSICS] = by_time * frame.seen.y;
            let by_point = (0..POINT).map(|i| seen.by_place * Point::new(by_x[i], by_y[i]));
            let columns = by_point.chain(seen.by_camera).chain([seen.place - frame.seen]);
            let scale = frame.weight.component_div(&Point::new(x.sd, y.sd));
            let mut rows = [SVector::zeros(); 2];
            for (i, column) in columns.enumerate() {
                (rows[0][i], rows[1][i]) = (column.x * scale.x, column.y * scale.y);
            }
            (side, rows)
        })
    }

    /// Returns the sums of shot `i`, with what is known of its own unknowns.
    pub(crate) fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        let (shot, count) = (&self.shots[i], own.len());
        let Some(paths) = shot.follow(own, shared, &self.discs) else {
            return Contribution::impossible(count, SHARED, self.noise.len());
        };
        let mut total = Contribution::empty(count, SHARED, self.noise.len());
        total.sticks = shot.stuck.is_some();
        let moving = MOVING.map(|id| count + id as usize);
        let inputs: Vec<usize> = (0..CORE).chain(moving).collect();
        for track in &shot.tracks {
            let sights = self.look(i, track, &paths, own, shared);
            // without a marker its derivatives are 0
            let [direction, radius] = track.marker.unwrap_or([own::TIME; 2]);
            let of_camera = (0..CAMERA).map(|i| count + PHYSICS + i);
            let others = [own::TIME, direction, radius].into_iter().chain(of_camera).chain([count + SHARED]);
            let columns = Columns { inputs: &inputs, others: &others.collect::<Vec<_>>() };
            let noise = NOISES * i + 2 * track.disc;
            add_track(&mut total, sights, &paths.pieces[track.disc], &columns, [noise, noise + 1]);
        }
        let mut total = total.or_impossible();
        for (place, prior) in self.own_priors(i) {
            total.add_prior(place, prior.normal(&self.spreads), own[place]);
        }
        total
    }

    /// Returns what is known of own unknowns of shot `i`.
    pub(crate) fn own_priors(&self, i: usize) -> Vec<(usize, OwnPrior)> {
        let known = &self.shots[i].known;
        let mut priors = known.clone();
        for (which, component) in Component::ALL.into_iter().enumerate() {
            let is_free = match component {
                Component::Restitution => self.freedom != Freedom::Law,
                // a single shot shows no law
                Component::Ratio => self.freedom != Freedom::Law || self.shots.len() == 1,
                Component::Momentum | Component::SpinRatio => self.freedom == Freedom::Everything,
                Component::Distance | Component::Slowing => false,
            };
            let prior = if is_free { ANY } else { OwnPrior::Spread(which) };
            let is_open = |place: &usize| !known.iter().any(|(known, _)| known == place);
            priors.extend(component.describe().0.filter(is_open).map(|place| (place, prior)));
        }
        priors
    }

    /// Takes shots instead of all; one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        self.noise = indices.iter().flat_map(|i| self.noise_of(*i).to_vec()).collect();
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
        if self.shots.len() == 1 {
            self.spreads = spreads(&self.discs, 1);
        }
    }

    /// Returns e and J_t/J_n of shot `i` with their derivatives; `None` if its discs do not approach.
    pub fn outcome(&self, i: usize, own: &Own, shared: &Shared) -> Option<[super::motion::Dual; 2]> {
        Some(self.shots[i].follow(own, shared, &self.discs)?.outcome())
    }

    /// Returns the own unknowns of shot `i` after a step with the e and J_t/J_n that derivatives predict:
    /// the law has corners, which else would throw the discs off their paths.
    pub(crate) fn with_even_outcome(
        &self,
        i: usize,
        (own, shared): (&Own, &Shared),
        mut moved: Own,
        shared_after: &Shared,
    ) -> Own {
        let is_free = self.shots[i].flat.is_none() && self.shots[i].stuck.is_none();
        let outcome = self.outcome(i, own, shared).filter(|_| is_free);
        if let Some(outcome) = outcome {
            let step = SVector::from_fn(|input, _| match input.checked_sub(CORE) {
                None => moved[input] - own[input],
                Some(moving) => shared_after[MOVING[moving]] - shared[MOVING[moving]],
            });
            let predicted = outcome.map(|value| value.re + gradient(&value).dot(&step));
            self.set_outcome(i, &mut moved, shared_after, predicted);
        }
        moved
    }

    /// Sets the offsets of shot `i` so that its discs part with this e and J_t/J_n, as far as they are
    /// unknowns.
    pub(crate) fn set_outcome(&self, i: usize, own: &mut Own, shared: &Shared, [e, ratio]: [f64; 2]) {
        (own[own::RESTITUTION], own[own::RATIO]) = (0.0, 0.0);
        if self.shots[i].stuck.is_some() {
            return;
        }
        let Some([law, _]) = self.outcome(i, own, shared) else { return };
        own[own::RESTITUTION] = e - law.re;
        let Some([_, law]) = self.outcome(i, own, shared) else { return };
        own[own::RATIO] = if self.shots[i].flat.is_some() { 0.0 } else { ratio - law.re };
    }
}
