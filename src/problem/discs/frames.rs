//! The frames of a shot of discs against their paths: residuals and derivatives, whitened for noise
//! that is correlated from frame to frame, and summed up to normal equations.

use nalgebra::DMatrix;

use super::lines::LEAST;
use super::motion::{COEFFICIENTS, Impact, MOVING, Paths, Piece, follow_discs};
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
    /// First place of the markers' unknowns of each disc, and the number of all own unknowns.
    pub marked: [usize; 3],
    /// What is known of own unknowns whatever is fitted.
    pub own_known: Vec<(usize, OwnPrior)>,
}

/// Noise of a shot: of each disc along x and along y.
pub(super) const NOISES: usize = 4;

/// Columns of a row of derivatives before the markers': coefficients of the piece, and the instant.
const MOTION: usize = COEFFICIENTS + 1;

/// A disc on one side of the impact. Rows of its frames have the derivatives by the coefficients of its
/// piece, the instant, its markers and the camera, and the residual.
struct Side<'a> {
    piece: &'a Piece,
    /// First place of the disc's markers among the own unknowns, and the first place after them.
    marked: [usize; 2],
}

impl Side<'_> {
    fn width(&self) -> usize {
        MOTION + self.marked[1] - self.marked[0] + CAMERA + 1
    }

    /// Returns the derivatives of the columns of a row by own and shared unknowns.
    fn columns(&self, own: usize) -> DMatrix<f64> {
        let mut by = DMatrix::zeros(self.width(), own + BORDERED);
        by.view_mut((0, 0), (COEFFICIENTS, CORE)).copy_from(&self.piece.by.fixed_columns::<CORE>(0));
        for (i, id) in MOVING.into_iter().enumerate() {
            let column = self.piece.by.column(CORE + i);
            by.view_mut((0, own + id as usize), (COEFFICIENTS, 1)).copy_from(&column);
        }
        by[(COEFFICIENTS, own::TIME)] = 1.0;
        for (i, place) in (self.marked[0]..self.marked[1]).enumerate() {
            by[(MOTION + i, place)] = 1.0;
        }
        let camera = self.width() - 1 - CAMERA;
        for i in 0..CAMERA {
            by[(camera + i, own + PHYSICS + i)] = 1.0;
        }
        by[(self.width() - 1, own + BORDERED - 1)] = 1.0;
        by
    }

    /// Returns the rows of both coordinates of a point of the disc in a frame, in units of the noise.
    fn see(
        &self,
        track: &PointTrack,
        frame: &Frame,
        own: &Own,
        camera: &Camera,
        sd: [f64; 2],
    ) -> [Vec<f64>; 2] {
        let at = &self.piece.at;
        let late = frame.time - own[own::TIME] + camera.delay(frame.seen);
        let rate = at[4];
        let stops = rate * late > 1.0;
        let moving = if stops { rate.recip() } else { late };
        let way = moving - 0.5 * rate * moving * moving;
        let (start, speed) = (Point::new(at[0], at[1]), Point::new(at[2], at[3]));
        let turned = |direction: f64| {
            let (sin, cos) = direction.sin_cos();
            [Point::new(cos, sin), Point::new(-sin, cos)]
        };
        let [arm, across] = turned(at[6] + at[7] * late);
        let mut place = start + speed * way + arm * at[5];
        let mut velocity = speed * (1.0 - rate * moving) + across * (at[5] * at[7]);
        let mut by = vec![Point::zeros(); self.width() - 1 - CAMERA];
        (by[0], by[1]) = (Point::x(), Point::y());
        (by[2], by[3]) = (Point::x() * way, Point::y() * way);
        by[4] = speed * (-0.5 * moving * moving);
        (by[5], by[6], by[7]) = (arm, across * at[5], across * (at[5] * late));
        if let Some([direction, radius]) = track.marker {
            let [marker, turning] = turned(own[direction] + at[8] * late + at[9]);
            place += marker * own[radius];
            velocity += turning * (own[radius] * at[8]);
            by[8] = turning * (own[radius] * late);
            by[9] = turning * own[radius];
            by[MOTION + direction - self.marked[0]] = turning * own[radius];
            by[MOTION + radius - self.marked[0]] = marker;
        }
        by[COEFFICIENTS] = -velocity;
        let mut seen = camera.look(place, 0.0);
        // a later reading sees the point further along its path
        let by_time = seen.by_place * velocity;
        seen.by_camera[Id::ShutterX as usize - PHYSICS] = by_time * frame.seen.x;
        seen.by_camera[Id::ShutterY as usize - PHYSICS] = by_time * frame.seen.y;
        [0, 1].map(|axis| {
            let scale = frame.weight[axis] / sd[axis];
            let of_motion = by.iter().map(|by| (seen.by_place.row(axis) * by)[0]);
            let of_camera = seen.by_camera.iter().map(|by| by[axis]);
            let residual = seen.place[axis] - frame.seen[axis];
            of_motion.chain(of_camera).chain([residual]).map(|value| value * scale).collect()
        })
    }
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
    rows: [Vec<f64>; 2],
    /// What the numbers of each coordinate add to the sums of its noise.
    sums: [NoiseSums; 2],
}

impl ShotFrames {
    /// Returns the number of own unknowns.
    pub fn own(&self) -> usize {
        self.marked[2]
    }

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

    pub(super) fn known<'a>(&self, impact: &'a Impact, discs: &'a Discs) -> Known<'a> {
        let &Self { turns, knows_slip, flat, .. } = self;
        Known { impact, discs, turns, is_seen_across: flat.is_none(), knows_slip }
    }

    fn sides<'a>(&self, paths: &'a Paths, disc: usize) -> [Side<'a>; 2] {
        let marked = [self.marked[disc], self.marked[disc + 1]];
        paths.pieces[disc].each_ref().map(|piece| Side { piece, marked })
    }

    /// Returns the used frames of a track, whitened. Errors before the impact and after it count as
    /// independent: the frames between are left out.
    fn look(
        &self,
        track: &PointTrack,
        sides: &[Side; 2],
        values: &Own,
        camera: &Camera,
        noise: &[Noise],
    ) -> Vec<Sight> {
        let sd = [noise[0].sd, noise[1].sd];
        let mut last: Option<([Vec<f64>; 2], usize, f64)> = None;
        let mut sights = Vec::with_capacity(track.frames.len());
        for (index, frame) in track.frames.iter().enumerate().filter(|(_, frame)| frame.used) {
            let side = usize::from(frame.time > values[own::TIME]);
            let mut rows = sides[side].see(track, frame, values, camera, sd);
            let before = last.replace((rows.clone(), side, frame.time)).filter(|before| before.1 == side);
            let mut sums = [NoiseSums::default(); 2];
            for axis in 0..2 {
                sums[axis].count = frame.weight[axis].powi(2).min(1.0);
                let before = before.as_ref().filter(|_| frame.weight[axis] > 0.0);
                let Some((before, _, then)) = before else { continue };
                let kept = correlation(noise[axis].rho, frame.time - then, self.fps);
                let fresh = (1.0 - kept * kept).sqrt().recip();
                let end = rows[axis].len() - 1;
                sums[axis].ln_determinant = -2.0 * fresh.ln();
                sums[axis].lagged = rows[axis][end] * before[axis][end];
                sums[axis].square = rows[axis][end] * rows[axis][end];
                for (now, then) in rows[axis].iter_mut().zip(&before[axis]) {
                    *now = (*now - kept * then) * fresh;
                }
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
        let own = self.own();
        let Some(paths) = self.follow(values, shared, discs) else {
            return Contribution::impossible(own, noise.len());
        };
        let mut total = Contribution::empty(own, noise.len());
        total.sticks = self.settling.is_some();
        let camera = Camera::new(shared);
        for disc in 0..2 {
            let sides = self.sides(&paths, disc);
            let mut rows = [Vec::new(), Vec::new()];
            let place = first + 2 * disc;
            for track in self.tracks.iter().filter(|track| track.disc == disc) {
                for mut sight in self.look(track, &sides, values, &camera, &noise[place..place + 2]) {
                    let residuals = sight.residuals();
                    let (weight, cost) = weigh(residuals.x, residuals.y);
                    total.cost += cost;
                    for axis in 0..2 {
                        sight.sums[axis].weighted = weight * residuals[axis].powi(2);
                        total.noises[place + axis].add(&sight.sums[axis]);
                        rows[sight.side].extend(sight.rows[axis].iter().map(|x| x * weight.sqrt()));
                    }
                }
            }
            for (side, rows) in sides.iter().zip(rows) {
                let rows = DMatrix::from_vec(side.width(), rows.len() / side.width(), rows);
                let by = side.columns(own);
                total.products += by.tr_mul(&(&rows * rows.transpose() * &by));
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
            let sides = self.sides(&paths, track.disc);
            let sights = self.look(track, &sides, values, &camera, &noise[2 * track.disc..]);
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
        let last = |row: &Vec<f64>| row.last().copied().unwrap_or(0.0);
        Point::new(last(&self.rows[0]), last(&self.rows[1]))
    }
}
