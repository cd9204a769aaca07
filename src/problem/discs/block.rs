//! The frames of some shots of discs as a block.

use std::sync::Arc;

use nalgebra::SVector;
use num_dual::DualSVec64;

use super::lines::Stuck;
use super::motion::{COEFFICIENTS, Dual, MOVING, Paths, follow, locate};
use super::own::{self, CORE, Component, spreads};
use crate::physics::disc::Discs;
use crate::problem::film::camera::{Camera, Point};
use crate::problem::film::dual::{constant, gradient};
use crate::problem::frames::{Columns, Frame, Sight, add_track, whiten};
use crate::problem::sums::{Contribution, Noise, OwnPrior, Spread};
use crate::problem::unknowns::{CAMERA, Id, Normal, Own, PHYSICS, SHARED, Shared};

/// Prior standard deviation of an unknown offset, over the normal impulse or the closing speed, and
/// of an unknown distance of the centres, m.
const ANY: f64 = 3.0;
const ANY_DISTANCE: f64 = 1e3;

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
    /// Standard deviation of a coordinate of each disc that neighbouring frames show, m.
    pub(crate) position_sd: [f64; 2],
    /// Number of frames on either side of the impact in which the discs touch.
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
    /// Whether shots differ from the law of the impact by their scatter alone; else they have any e
    /// and J_t/J_n, any balance of momentum and any spins.
    pub(crate) has_law: bool,
    /// The noises of each shot one after the other.
    pub(crate) noise: Vec<Noise>,
    /// Spreads of each [`Component`].
    pub(crate) spreads: Vec<Spread>,
}

impl DiscBlock {
    pub fn new(shots: Vec<ShotFrames>, discs: Discs, noise: Vec<Noise>) -> Self {
        let spreads = spreads(&discs, shots.len());
        Self { shots: Arc::new(shots), discs, has_law: false, noise, spreads }
    }

    /// Returns the noises of shot `i`.
    pub(super) fn noise_of(&self, i: usize) -> &[Noise] {
        &self.noise[NOISES * i..NOISES * (i + 1)]
    }

    /// Follows both discs of shot `i` through the impact; `None` if they do not approach.
    pub(super) fn follow(&self, i: usize, own: &Own, shared: &Shared) -> Option<Paths> {
        let shot = &self.shots[i];
        follow((shot.stuck.is_some(), shot.turns), own, shared, &self.discs)
    }

    /// Returns the used frames of each track of shot `i`, whitened; an empty list if the discs do
    /// not approach.
    pub(super) fn sights(&self, i: usize, own: &Own, shared: &Shared) -> Vec<Vec<Sight<ROW>>> {
        let Some(paths) = self.follow(i, own, shared) else { return Vec::new() };
        self.shots[i].tracks.iter().map(|track| self.look(i, track, &paths, own, shared)).collect()
    }

    /// Returns the used frames of a track of shot `i`, whitened. Errors before the impact and after
    /// it count as independent: the frames between are left out.
    fn look(
        &self,
        i: usize,
        track: &PointTrack,
        paths: &Paths,
        own: &Own,
        shared: &Shared,
    ) -> Vec<Sight<ROW>> {
        let dual = |i: usize, value: f64| constant::<POINT>(value).derivative(i);
        let time = dual(COEFFICIENTS, own[own::TIME]);
        let marker = track.marker.map(|[direction, radius]| {
            [dual(COEFFICIENTS + 1, own[direction]), dual(COEFFICIENTS + 2, own[radius])]
        });
        let pieces = paths.pieces[track.disc].each_ref().map(|piece| -> [DualSVec64<POINT>; COEFFICIENTS] {
            std::array::from_fn(|i| dual(i, piece.at[i]))
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
        let Some(paths) = self.follow(i, own, shared) else {
            return Contribution::impossible(count, SHARED, self.noise.len());
        };
        let mut total = Contribution::empty(count, SHARED, self.noise.len());
        total.sticks = shot.stuck.is_some();
        let inputs: Vec<usize> = (0..CORE).chain(MOVING.map(|id| count + id as usize)).collect();
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
        (0..CORE).filter_map(|place| Some((place, self.own_prior(&self.shots[i], place)?))).collect()
    }

    fn own_prior(&self, shot: &ShotFrames, place: usize) -> Option<OwnPrior> {
        let is_stuck = shot.stuck.is_some();
        let stated = |sd: f64| Some(OwnPrior::Stated(Normal { mean: 0.0, sd }));
        if let Some(axis) = shot.flat {
            // no motion across the film
            let across = [own::X, own::VELOCITY, own::VELOCITY + 2].map(|first| first + axis);
            let others = [own::DIRECTION, own::RATIO, own::MOMENTUM + 1, own::LEAD];
            if across.contains(&place) || others.contains(&place) {
                return Some(OwnPrior::Held);
            }
        }
        let is_held = match place {
            own::SPIN..own::RESTITUTION => !shot.turns[place - own::SPIN],
            own::SPIN_RATIO..own::SLOWING => is_stuck || !shot.turns[place - own::SPIN_RATIO],
            own::RESTITUTION | own::LEAD => is_stuck,
            _ => false,
        };
        let which = Component::ALL.iter().position(|component| component.describe().0.contains(&place));
        let is_any = match place {
            // a single shot shows no law
            own::RATIO => !self.has_law || is_stuck || !shot.knows_slip || self.shots.len() == 1,
            own::RESTITUTION..own::SLOWING => !self.has_law,
            _ => false,
        };
        match place {
            _ if is_held => Some(OwnPrior::Held),
            own::LEAD => stated(shot.fps.recip()),
            own::DISTANCE if shot.flat.is_some() => stated(ANY_DISTANCE),
            _ if is_any => stated(ANY),
            _ => which.map(OwnPrior::Spread),
        }
    }

    /// Takes shots instead of all; one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        self.noise = indices.iter().flat_map(|i| self.noise_of(*i).to_vec()).collect();
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
        if self.shots.len() == 1 {
            self.spreads = spreads(&self.discs, 1);
        }
    }

    /// Returns e and J_t/J_n of shot `i` with their derivatives; `None` if its discs do not
    /// approach.
    pub(super) fn outcome(&self, i: usize, own: &Own, shared: &Shared) -> Option<[Dual; 2]> {
        Some(self.follow(i, own, shared)?.outcome())
    }

    /// Returns the own unknowns of shot `i` after a step with the e and J_t/J_n that derivatives
    /// predict: the law has corners, which else would throw the discs off their paths.
    pub(crate) fn with_even_outcome(
        &self,
        i: usize,
        (own, shared): (&Own, &Shared),
        mut moved: Own,
        shared_after: &Shared,
    ) -> Own {
        let is_free = self.shots[i].flat.is_none() && self.shots[i].stuck.is_none();
        if let Some(outcome) = self.outcome(i, own, shared).filter(|_| is_free) {
            let step = SVector::from_fn(|input, _| match input.checked_sub(CORE) {
                None => moved[input] - own[input],
                Some(moving) => shared_after[MOVING[moving]] - shared[MOVING[moving]],
            });
            let predicted = outcome.map(|value| value.re + gradient(&value).dot(&step));
            self.set_outcome(i, &mut moved, shared_after, predicted);
        }
        moved
    }

    /// Sets the offsets of shot `i` so that its discs part with this e and J_t/J_n, as far as they
    /// are unknowns.
    pub(super) fn set_outcome(&self, i: usize, own: &mut Own, shared: &Shared, [e, ratio]: [f64; 2]) {
        (own[own::RESTITUTION], own[own::RATIO]) = (0.0, 0.0);
        if self.shots[i].stuck.is_some() {
            return;
        }
        let Some([law, _]) = self.outcome(i, own, shared) else { return };
        own[own::RESTITUTION] = e - law.re;
        if self.shots[i].flat.is_none()
            && let Some([_, law]) = self.outcome(i, own, shared)
        {
            own[own::RATIO] = ratio - law.re;
        }
    }
}
