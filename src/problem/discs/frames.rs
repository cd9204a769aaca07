//! The frames of a shot of discs against their paths.

use nalgebra::SVector;

use super::lines::LEAST;
use super::motion::{COEFFICIENTS, INPUTS, Impact, MOVING, Paths, follow_discs};
use super::own::{self, CORE};
use super::quantities::Known;
use super::stick::Stuck;
use crate::physics::disc::Discs;
use crate::problem::film::camera::{Camera, Point};
use crate::problem::frames::{Columns, Frame, Sight, add_track, whiten};
use crate::problem::sums::{Contribution, Noise, OwnPrior};
use crate::problem::unknowns::{CAMERA, Id, Own, PHYSICS, SHARED, Shared};

/// A point on a disc in the frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct PointTrack {
    /// Which disc it is on.
    pub disc: usize,
    /// Places of its direction and of its distance from the centre among the own unknowns; `None` for
    /// the centre.
    pub marker: Option<[usize; 2]>,
    pub frames: Vec<Frame>,
}

impl PointTrack {
    /// Returns the place of its noise along x among those of its shot.
    fn noise(&self) -> usize {
        noise_of(self.disc, self.marker.is_some())
    }
}

/// The frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct ShotFrames {
    pub name: String,
    pub tracks: Vec<PointTrack>,
    /// Frames per second.
    pub fps: f64,
    /// Whether the rotation of each disc is seen.
    pub turns: [bool; 2],
    /// Whether both spins before the impact are known.
    pub knows_slip: bool,
    /// The coordinate that never changes in a film of one dimension.
    pub flat: Option<usize>,
    /// How the discs stick together after the impact, if they do.
    pub stuck: Option<Stuck>,
    /// Number of own unknowns.
    pub own: usize,
    /// What is known of own unknowns whatever is fitted.
    pub own_known: Vec<(usize, OwnPrior)>,
    /// Standard deviations of a coordinate that neighbouring frames show, m: of each disc that of its centre
    /// and that of its markers.
    pub position_sd: [[f64; 2]; 2],
    /// Number of frames of each point on either side of the impact that are used at most.
    pub reach: usize,
    /// Number of frames on either side of the impact that may be neither before nor after it.
    pub touching: usize,
    /// Number of frames that were left out as wrong.
    pub outliers: usize,
    /// Numbers of frames that were tried, with their misfit, the largest first.
    pub tried: Vec<(usize, f64)>,
    /// Whether the number of frames is the last one.
    pub is_settled: bool,
}

/// Number of frames on either side of the impact that are left out.
pub(super) const TOUCHING: usize = 1;

/// Noise of a shot: of each disc that of its centre along x and along y, and that of its markers.
pub(super) const NOISES: usize = 8;

/// Returns the place of the noise along x of the centre of a disc, or of its markers.
fn noise_of(disc: usize, is_marker: bool) -> usize {
    4 * disc + 2 * usize::from(is_marker)
}

/// Numbers in a row behind the derivatives by the coefficients of the piece: those by the instant, by
/// direction and radius of the marker, and by the camera; and the residual.
const OTHERS: usize = 3 + CAMERA + 1;
pub(super) const ROW: usize = COEFFICIENTS + OTHERS;

/// The centre of a disc at an instant.
pub(super) struct Centre {
    /// m
    pub place: Point,
    /// m/s
    velocity: Point,
    /// Derivatives of the place by the coefficients of the piece, but for those of its own rotation.
    by: [Point; COEFFICIENTS - 2],
}

impl Centre {
    /// Returns where it is on a piece `late` seconds after the impact.
    pub fn on(at: &[f64], late: f64) -> Self {
        let rate = at[4];
        let stops = rate * late > 1.0;
        let moving = if stops { rate.recip() } else { late };
        let way = moving - 0.5 * rate * moving * moving;
        let (start, speed) = (Point::new(at[0], at[1]), Point::new(at[2], at[3]));
        let [arm, across] = turned(at[6] + at[7] * late);
        let [x, y] = [Point::x(), Point::y()];
        let by_rate = speed * (-0.5 * moving * moving);
        Self {
            place: start + speed * way + arm * at[5],
            velocity: speed * (1.0 - rate * moving) + across * (at[5] * at[7]),
            by: [x, y, x * way, y * way, by_rate, arm, across * at[5], across * (at[5] * late)],
        }
    }
}

/// Returns the unit vector of a direction, and the one 90° counter-clockwise from it.
fn turned(direction: f64) -> [Point; 2] {
    let (sin, cos) = direction.sin_cos();
    [Point::new(cos, sin), Point::new(-sin, cos)]
}

/// Returns the rows of both coordinates of a point in a frame.
fn see(
    at: &[f64],
    marker: Option<[usize; 2]>,
    frame: &Frame,
    own: &Own,
    camera: &Camera,
    sd: Point,
) -> [SVector<f64, ROW>; 2] {
    let late = frame.time - own[own::TIME] + camera.delay(frame.seen);
    let Centre { mut place, mut velocity, by: by_piece } = Centre::on(at, late);
    let mut by = [Point::zeros(); COEFFICIENTS + 3];
    by[..by_piece.len()].copy_from_slice(&by_piece);
    if let Some([direction, radius]) = marker {
        let [marker, turning] = turned(own[direction] + at[8] * late + at[9]);
        place += marker * own[radius];
        velocity += turning * (own[radius] * at[8]);
        by[8] = turning * (own[radius] * late);
        by[9] = turning * own[radius];
        by[COEFFICIENTS + 1] = turning * own[radius];
        by[COEFFICIENTS + 2] = marker;
    }
    by[COEFFICIENTS] = -velocity;
    let mut seen = camera.look(place, 0.0);
    // a later reading sees the point further along its path
    let by_time = seen.by_place * velocity;
    seen.by_camera[Id::ShutterX as usize - PHYSICS] = by_time * frame.seen.x;
    seen.by_camera[Id::ShutterY as usize - PHYSICS] = by_time * frame.seen.y;
    let columns =
        by.iter().map(|by| seen.by_place * by).chain(seen.by_camera).chain([seen.place - frame.seen]);
    let mut rows = [SVector::zeros(); 2];
    for (i, column) in columns.enumerate() {
        let scaled = column.component_mul(&frame.weight).component_div(&sd);
        (rows[0][i], rows[1][i]) = (scaled.x, scaled.y);
    }
    rows
}

impl ShotFrames {
    /// Uses the frames that are nearest to the impact, within reach of it, but for those in which the discs
    /// may still touch.
    pub fn choose_frames(&mut self, instant: f64) {
        let [from, to] = self.stuck.map_or([instant; 2], |stuck| stuck.settling);
        let (fps, touching, reach) = (self.fps, self.touching as f64, self.reach);
        let touches = |frame: &&mut Frame| (from - frame.time).max(frame.time - to) * fps < touching;
        for track in &mut self.tracks {
            track.frames.iter_mut().for_each(|frame| frame.used = false);
            let after = track.frames.partition_point(|frame| frame.time <= instant);
            let (early, late) = track.frames.split_at_mut(after);
            for side in [early.iter_mut().rev().collect::<Vec<_>>(), late.iter_mut().collect()] {
                let apart = side.partition_point(touches);
                let first = if side.len() - apart < LEAST { 0 } else { apart };
                side.into_iter().skip(first).take(reach).for_each(|frame| frame.used = true);
            }
        }
    }

    /// Returns the paths of the discs; `None` if they do not approach.
    pub(super) fn follow(&self, values: &Own, shared: &Shared, discs: &Discs) -> Option<Paths> {
        follow_discs(values, shared, discs, self.turns, self.stuck.is_some())
    }

    /// Returns the place of the noise along x of the points that show the path of a disc.
    pub(super) fn noise_of_path(&self, disc: usize) -> usize {
        let mut tracks = self.tracks.iter().filter(|track| track.disc == disc);
        noise_of(disc, tracks.all(|track| track.marker.is_some()))
    }

    pub(super) fn known<'a>(&self, impact: &'a Impact, discs: &'a Discs) -> Known<'a> {
        let &Self { turns, knows_slip, flat, .. } = self;
        Known { impact, discs, turns, is_seen_across: flat.is_none(), knows_slip }
    }

    /// Returns the used frames of a track, whitened. Errors before the impact and after it count as
    /// independent: the frames between are left out.
    fn look(
        &self,
        track: &PointTrack,
        paths: &Paths,
        values: &Own,
        camera: &Camera,
        noise: &[Noise],
    ) -> Vec<Sight<ROW>> {
        let noise = &noise[track.noise()..];
        let sd = Point::new(noise[0].sd, noise[1].sd);
        whiten(&track.frames, ([noise[0].rho, noise[1].rho], self.fps), false, |frame| {
            let side = usize::from(frame.time > values[own::TIME]);
            let piece = &paths.pieces[track.disc][side];
            (side, see(piece.at.as_slice(), track.marker, frame, values, camera, sd))
        })
    }

    /// Returns the sums of residuals and derivatives, in units of the noises of each disc and axis, of
    /// which those of this shot begin at `first`.
    pub fn contribute(
        &self,
        values: &Own,
        shared: &Shared,
        discs: &Discs,
        (noise, first): (&[Noise], usize),
    ) -> Contribution {
        let own = self.own;
        let Some(paths) = self.follow(values, shared, discs) else {
            return Contribution::impossible(own, SHARED, noise.len());
        };
        let mut total = Contribution::empty(own, SHARED, noise.len());
        total.sticks = self.stuck.is_some();
        let camera = Camera::new(shared);
        let inputs: [usize; INPUTS] = std::array::from_fn(|i| match i.checked_sub(CORE) {
            None => i,
            Some(moving) => own + MOVING[moving] as usize,
        });
        for track in &self.tracks {
            let sights = self.look(track, &paths, values, &camera, &noise[first..]);
            // without a marker its derivatives are 0
            let [direction, radius] = track.marker.unwrap_or([own::TIME; 2]);
            let others: [usize; OTHERS] = std::array::from_fn(|i| match i {
                0 => own::TIME,
                1 => direction,
                2 => radius,
                i if i < OTHERS - 1 => own + PHYSICS + i - 3,
                _ => own + SHARED,
            });
            let columns = Columns { inputs: &inputs, others: &others };
            let place = first + track.noise();
            add_track(&mut total, sights, &paths.pieces[track.disc], &columns, [place, place + 1]);
        }
        total.or_impossible()
    }

    /// Returns the used frames of each track, whitened; none if the unknowns describe no collision. The
    /// noises are those of this shot.
    pub fn sights(
        &self,
        values: &Own,
        shared: &Shared,
        discs: &Discs,
        noise: &[Noise],
    ) -> Vec<Vec<Sight<ROW>>> {
        let Some(paths) = self.follow(values, shared, discs) else {
            return self.tracks.iter().map(|_| Vec::new()).collect();
        };
        let camera = Camera::new(shared);
        self.tracks.iter().map(|track| self.look(track, &paths, values, &camera, noise)).collect()
    }
}
