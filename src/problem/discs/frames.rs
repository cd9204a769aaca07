//! The frames of a shot of discs against their paths: residuals and derivatives, whitened for noise
//! that is correlated from frame to frame, and summed up to normal equations.

use nalgebra::{Const, DMatrix, Dyn, OMatrix, SMatrix, SVector};

use super::lines::LEAST;
use super::motion::{COEFFICIENTS, INPUTS, Impact, MOVING, Paths, Piece, follow_discs};
use super::own::{self, CORE};
use super::quantities::Known;
use crate::physics::disc::Discs;
use crate::problem::film::camera::{Camera, Point};
use crate::problem::film::frames::{Frame, Whitened, correlation, weigh};
use crate::problem::sums::{BORDERED, Contribution, Noise, NoiseSums, OwnPrior};
use crate::problem::unknowns::{CAMERA, Id, Own, PHYSICS, Shared};

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
    pub tracks: Vec<PointTrack>,
    /// Frames per second.
    pub fps: f64,
    /// Whether the rotation of each disc is seen.
    pub turns: [bool; 2],
    /// Whether both spins before the impact are known.
    pub knows_slip: bool,
    /// The coordinate that never changes in a film of one dimension.
    pub flat: Option<usize>,
    /// Of discs that stick together after the impact: from when to when they settle, s.
    pub settling: Option<[f64; 2]>,
    /// Number of own unknowns.
    pub own: usize,
    /// What is known of own unknowns whatever is fitted.
    pub own_known: Vec<(usize, OwnPrior)>,
}

/// Noise of a shot: of each disc that of its centre along x and along y, and that of its markers.
pub(super) const NOISES: usize = 8;

/// Returns the place of the noise along x of the centre of a disc, or of its markers.
fn noise_of(disc: usize, is_marker: bool) -> usize {
    4 * disc + 2 * usize::from(is_marker)
}

/// Numbers in a row of a frame: derivatives by the coefficients of the piece, and by the others, which
/// are the instant, direction and radius of the marker, and the camera; and the residual.
const OTHERS: usize = 3 + CAMERA + 1;
const ROW: usize = COEFFICIENTS + OTHERS;

/// A row of a frame, in units of the noise.
type Row = SVector<f64, ROW>;

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
    pub fn on(at: &SVector<f64, COEFFICIENTS>, late: f64) -> Self {
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
    piece: &Piece,
    marker: Option<[usize; 2]>,
    frame: &Frame,
    own: &Own,
    camera: &Camera,
    sd: [f64; 2],
) -> [Row; 2] {
    let at = &piece.at;
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
    let mut rows = [Row::zeros(); 2];
    let scale = frame.weight.component_div(&Point::from(sd));
    let mut set = |i: usize, column: Point| {
        rows[0][i] = column.x * scale.x;
        rows[1][i] = column.y * scale.y;
    };
    for (i, by) in by.iter().enumerate() {
        set(i, seen.by_place * by);
    }
    for (i, by) in seen.by_camera.into_iter().enumerate() {
        set(COEFFICIENTS + 3 + i, by);
    }
    set(ROW - 1, seen.place - frame.seen);
    rows
}

/// One frame of a point, whitened.
struct Sight {
    /// Index of the frame in its track.
    index: usize,
    /// s
    time: f64,
    /// 0 before and 1 after the impact.
    side: usize,
    /// Rows of both coordinates.
    rows: [Row; 2],
    /// What the numbers of each coordinate add to the sums of its noise.
    sums: [NoiseSums; 2],
}

impl ShotFrames {
    /// Uses the frames that are nearest to the impact, up to `reach` of each track on either side, but
    /// for those in which the discs may still touch: within `touching` frames of it.
    pub fn choose_frames(&mut self, instant: f64, reach: usize, touching: f64) {
        let [from, to] = self.settling.unwrap_or([instant; 2]);
        let fps = self.fps;
        for track in &mut self.tracks {
            track.frames.iter_mut().for_each(|frame| frame.used = false);
            let after = track.frames.partition_point(|frame| frame.time <= instant);
            let (early, late) = track.frames.split_at_mut(after);
            let mut early: Vec<(f64, &mut Frame)> =
                early.iter_mut().rev().map(|frame| ((from - frame.time) * fps, frame)).collect();
            let mut late: Vec<(f64, &mut Frame)> =
                late.iter_mut().map(|frame| ((frame.time - to) * fps, frame)).collect();
            for side in [&mut early, &mut late] {
                let apart = side.partition_point(|(away, _)| *away < touching);
                let first = if side.len() - apart < LEAST { 0 } else { apart };
                side.iter_mut().skip(first).take(reach).for_each(|(_, frame)| frame.used = true);
            }
        }
    }

    /// Returns the paths of the discs; `None` if they do not approach.
    pub(super) fn follow(&self, values: &Own, shared: &Shared, discs: &Discs) -> Option<Paths> {
        follow_discs(values, shared, discs, self.turns, self.settling.is_some())
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
        pieces: &[Piece; 2],
        values: &Own,
        camera: &Camera,
        noise: &[Noise],
    ) -> Vec<Sight> {
        let sd = [noise[0].sd, noise[1].sd];
        let mut last: Option<([Row; 2], usize, f64)> = None;
        let mut sights = Vec::with_capacity(track.frames.len());
        for (index, frame) in track.frames.iter().enumerate().filter(|(_, frame)| frame.used) {
            let side = usize::from(frame.time > values[own::TIME]);
            let mut rows = see(&pieces[side], track.marker, frame, values, camera, sd);
            let before = last.replace((rows, side, frame.time)).filter(|before| before.1 == side);
            let mut sums = [NoiseSums::default(); 2];
            for axis in 0..2 {
                sums[axis].count = frame.weight[axis].powi(2).min(1.0);
                let before = before.as_ref().filter(|_| frame.weight[axis] > 0.0);
                let Some((before, _, then)) = before else { continue };
                let kept = correlation(noise[axis].rho, frame.time - then, self.fps);
                let fresh = (1.0 - kept * kept).sqrt().recip();
                sums[axis].ln_determinant = -2.0 * fresh.ln();
                sums[axis].lagged = rows[axis][ROW - 1] * before[axis][ROW - 1];
                sums[axis].square = rows[axis][ROW - 1].powi(2);
                rows[axis] = (rows[axis] - before[axis] * kept) * fresh;
            }
            sights.push(Sight { index, time: frame.time, side, rows, sums });
        }
        sights
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
            return Contribution::impossible(own, noise.len());
        };
        let mut total = Contribution::empty(own, noise.len());
        total.sticks = self.settling.is_some();
        let camera = Camera::new(shared);
        for disc in 0..2 {
            let pieces = &paths.pieces[disc];
            let mut sides = [SideProducts::new(own), SideProducts::new(own)];
            for track in self.tracks.iter().filter(|track| track.disc == disc) {
                let place = first + track.noise();
                let mut rows = [Vec::new(), Vec::new()];
                for mut sight in self.look(track, pieces, values, &camera, &noise[place..place + 2]) {
                    let residuals = sight.residuals();
                    let (weight, cost) = weigh(residuals.x, residuals.y);
                    total.cost += cost;
                    for axis in 0..2 {
                        sight.sums[axis].weighted = weight * residuals[axis].powi(2);
                        total.noises[place + axis].add(&sight.sums[axis]);
                        rows[sight.side].extend_from_slice((sight.rows[axis] * weight.sqrt()).as_slice());
                    }
                }
                for (side, rows) in sides.iter_mut().zip(rows) {
                    let rows = OMatrix::<f64, Const<ROW>, Dyn>::from_vec(rows);
                    side.add(&mut total.products, &(&rows * rows.transpose()), track.marker);
                }
            }
            for (side, piece) in sides.iter().zip(pieces) {
                side.add_inputs(&mut total.products, piece);
            }
        }
        if !(total.cost.is_finite() && total.products.sum().is_finite()) {
            return Contribution::impossible(own, noise.len());
        }
        total
    }

    /// Returns the whitened residuals of the used frames of each track; empty if the unknowns describe
    /// no collision. The noises are those of this shot.
    pub fn residuals(
        &self,
        values: &Own,
        shared: &Shared,
        discs: &Discs,
        noise: &[Noise],
    ) -> Vec<Vec<Whitened>> {
        let Some(paths) = self.follow(values, shared, discs) else {
            return vec![Vec::new(); self.tracks.len()];
        };
        let camera = Camera::new(shared);
        let of_track = |track: &PointTrack| {
            let pieces = &paths.pieces[track.disc];
            let sights = self.look(track, pieces, values, &camera, &noise[track.noise()..]);
            let whitened = |sight: &Sight| Whitened {
                index: sight.index,
                time: sight.time,
                square: sight.residuals().norm_squared(),
            };
            sights.iter().map(whitened).collect()
        };
        self.tracks.iter().map(of_track).collect()
    }
}

impl Sight {
    fn residuals(&self) -> Point {
        Point::new(self.rows[0][ROW - 1], self.rows[1][ROW - 1])
    }
}

/// Products of the rows of a disc on one side of the impact that hold derivatives by the coefficients of
/// its piece.
struct SideProducts {
    own: usize,
    coefficients: SMatrix<f64, COEFFICIENTS, COEFFICIENTS>,
    /// With the derivatives by the own and shared unknowns, and the residual.
    beside: OMatrix<f64, Const<COEFFICIENTS>, Dyn>,
}

impl SideProducts {
    fn new(own: usize) -> Self {
        Self {
            own,
            coefficients: SMatrix::zeros(),
            beside: OMatrix::zeros_generic(Const, Dyn(own + BORDERED)),
        }
    }

    /// Adds the products of the rows of a point; those of the other columns go to the total.
    fn add(
        &mut self,
        total: &mut DMatrix<f64>,
        products: &SMatrix<f64, ROW, ROW>,
        marker: Option<[usize; 2]>,
    ) {
        // without a marker its derivatives are 0
        let [direction, radius] = marker.unwrap_or([own::TIME; 2]);
        let others: [usize; OTHERS] = std::array::from_fn(|i| match i {
            0 => own::TIME,
            1 => direction,
            2 => radius,
            i if i < OTHERS - 1 => self.own + PHYSICS + i - 3,
            _ => self.own + BORDERED - 1,
        });
        self.coefficients += products.fixed_view::<COEFFICIENTS, COEFFICIENTS>(0, 0);
        for (j, column) in others.into_iter().enumerate() {
            let from = products.column(COEFFICIENTS + j);
            let mut beside = self.beside.column_mut(column);
            beside += from.fixed_rows::<COEFFICIENTS>(0);
            for (i, row) in others.into_iter().enumerate() {
                total[(row, column)] += from[COEFFICIENTS + i];
            }
        }
    }

    /// Adds them to the total by the inputs of the motion.
    fn add_inputs(&self, total: &mut DMatrix<f64>, piece: &Piece) {
        let by = piece.by.transpose();
        let by_inputs = by * self.coefficients * piece.by;
        let beside = by * &self.beside;
        let inputs: [usize; INPUTS] = std::array::from_fn(|i| match i.checked_sub(CORE) {
            None => i,
            Some(moving) => self.own + MOVING[moving] as usize,
        });
        for (i, row) in inputs.into_iter().enumerate() {
            for (j, column) in inputs.into_iter().enumerate() {
                total[(row, column)] += by_inputs[(i, j)];
            }
            for j in 0..total.ncols() {
                total[(row, j)] += beside[(i, j)];
                total[(j, row)] += beside[(i, j)];
            }
        }
    }
}
