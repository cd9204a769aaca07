//! The frames of a shot against the paths of its balls: residuals and derivatives, whitened for
//! noise that is correlated from frame to frame, and summed up to normal equations.

use nalgebra::{DMatrix, SMatrix, SVector};

use super::camera::{Camera, Point};
use super::dual::{INPUTS, gradient};
use super::impact::{Contact, Correction};
use super::motion::{COEFFICIENTS, Piece, StatedSpin, Stretch, Struck, follow_balls};
use super::own::{self, OWN};
use crate::problem::sums::{Contribution, Noise, NoiseSums};
use crate::problem::unknowns::{CAMERA, Id, Own, PHYSICS, SHARED, Shared};

/// Own unknowns, shared unknowns, and the residual.
const COLUMNS: usize = OWN + SHARED + 1;

/// Length of a residual, in standard deviations of a coordinate, beyond which it counts linearly
/// (Huber 1964). A frame exceeds it by chance once in 3000.
const HUBER: f64 = 4.0;

/// A ball, or a point on a disc, in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// s
    pub time: f64,
    /// Place in the picture, m from its middle.
    pub seen: Point,
    /// Square root of the part of an observation that each coordinate is, over its standard
    /// deviation in units of the film's noise.
    pub weight: Point,
    /// Whether the frame is used.
    pub used: bool,
}

impl Frame {
    /// Returns whether the ball is seen but the frame is not used.
    pub fn is_left_out(&self) -> bool {
        !self.used && self.seen.x.is_finite() && self.seen.y.is_finite()
    }
}

/// The frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct ShotFrames {
    /// Of the cue ball and of the object ball.
    pub tracks: [Vec<Frame>; 2],
    /// Frames per second.
    pub fps: f64,
    /// Side spins of the balls just after the impact that markers show.
    pub spins: Vec<MeasuredSpin>,
}

/// The side spin of a ball just after the impact. Spins about horizontal axes change unevenly: the cloth does
/// not touch a ball that hops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredSpin {
    /// 0 for the cue ball, 1 for the object ball.
    pub ball: usize,
    /// rad/s.
    pub spin: f64,
    /// Its standard error, rad/s.
    pub sd: f64,
}

/// What the shots of a film have in common besides unknowns: the collision model, and the noise of
/// each ball.
#[derive(Clone, Copy, Debug)]
pub(crate) struct World {
    pub contact: Contact,
    pub noise: [Noise; 2],
}

/// The whitened residual of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Whitened {
    /// Index of the frame in its track.
    pub index: usize,
    /// s
    pub time: f64,
    /// Sum of the squares of both coordinates, in units of the noise.
    pub square: f64,
}

impl ShotFrames {
    /// Returns the sums of residuals and derivatives, in units of the noise of each ball.
    pub fn contribute(
        &self,
        values: &Own,
        shared: &Shared,
        spin: &StatedSpin,
        (world, correction): (&World, &Correction),
    ) -> Contribution {
        let World { contact, noise } = world;
        let Ok(paths) = follow_balls(values, shared, spin, (contact, correction)) else {
            return Contribution::impossible(OWN, 2);
        };
        let mut total = Contribution::empty(OWN, 2);
        total.sticks = paths.struck.sticks;
        for spin in &self.spins {
            add_spin(spin, &paths.struck, contact.object().radius, &mut total);
        }
        let camera = Camera::new(shared);
        for (body, pieces) in paths.pieces.iter().enumerate() {
            self.add_track(body, pieces, values[own::TIME], &camera, &noise[body], &mut total);
        }
        if !(total.cost.is_finite() && total.products.sum().is_finite()) {
            return Contribution::impossible(OWN, 2);
        }
        total
    }

    fn add_track(
        &self,
        body: usize,
        pieces: &[Piece],
        instant: f64,
        camera: &Camera,
        noise: &Noise,
        total: &mut Contribution,
    ) {
        let mut sums = Sums::new();
        let mut last: Option<Sight> = None;
        let mut of_body = NoiseSums::default();
        for frame in self.tracks[body].iter().filter(|frame| frame.used) {
            of_body.count += (frame.weight.component_mul(&frame.weight)).map(|w| w.min(1.0)).sum();
            let (rows, piece) = see(frame, instant, pieces, camera, noise.sd);
            let next = Sight { rows, piece, time: frame.time };
            let Some(Sight { rows: before, piece: on, time: then }) = last.replace(next) else {
                let (cost, weighted) = sums.add(&rows);
                total.cost += cost;
                of_body.weighted += weighted;
                continue;
            };
            let kept = correlation(noise.rho, frame.time - then, self.fps);
            let fresh = (1.0 - kept * kept).sqrt().recip();
            of_body.ln_determinant -= 4.0 * fresh.ln();
            for (row, before) in rows.iter().zip(&before) {
                of_body.lagged += row[LOCAL - 1] * before[LOCAL - 1];
                of_body.square += row[LOCAL - 1] * row[LOCAL - 1];
            }
            if piece != on {
                sums.add_to(&mut total.products, &pieces[on]);
                sums.clear();
            }
            let (cost, weighted) = if piece == on || kept == 0.0 {
                let whiten =
                    |axis: usize| std::array::from_fn(|j| (rows[axis][j] - kept * before[axis][j]) * fresh);
                sums.add(&[0, 1].map(whiten))
            } else {
                let innovation = [0, 1].map(|axis| {
                    (spread(&rows[axis], &pieces[piece]) - spread(&before[axis], &pieces[on]) * kept) * fresh
                });
                let (weight, cost) = weigh(innovation[0][COLUMNS - 1], innovation[1][COLUMNS - 1]);
                for row in &innovation {
                    total.products.ger(weight, row, row, 1.0);
                }
                let squares = innovation.iter().map(|row| row[COLUMNS - 1] * row[COLUMNS - 1]);
                (cost, weight * squares.sum::<f64>())
            };
            total.cost += cost;
            of_body.weighted += weighted;
        }
        if let Some(last) = last {
            sums.add_to(&mut total.products, &pieces[last.piece]);
        }
        total.noises[body] = of_body;
    }

    /// Returns the whitened residuals of the used frames of each ball; empty if the unknowns
    /// describe no collision.
    pub fn residuals(
        &self,
        values: &Own,
        shared: &Shared,
        spin: &StatedSpin,
        (world, correction): (&World, &Correction),
    ) -> [Vec<Whitened>; 2] {
        let World { contact, noise } = world;
        let Ok(paths) = follow_balls(values, shared, spin, (contact, correction)) else {
            return [Vec::new(), Vec::new()];
        };
        let camera = Camera::new(shared);
        [0, 1].map(|body| {
            let mut last: Option<(Point, f64)> = None;
            let mut found = Vec::with_capacity(self.tracks[body].len());
            for (index, frame) in self.tracks[body].iter().enumerate().filter(|(_, frame)| frame.used) {
                let rows = see(frame, values[own::TIME], &paths.pieces[body], &camera, noise[body].sd).0;
                let now = Point::new(rows[0][LOCAL - 1], rows[1][LOCAL - 1]);
                let fresh = match last.replace((now, frame.time)) {
                    None => now,
                    Some((before, then)) => {
                        let kept = correlation(noise[body].rho, frame.time - then, self.fps);
                        (now - before * kept) / (1.0 - kept * kept).sqrt()
                    }
                };
                found.push(Whitened { index, time: frame.time, square: fresh.norm_squared() });
            }
            found
        })
    }
}

/// Adds what markers show of a side spin after the impact.
fn add_spin(measured: &MeasuredSpin, struck: &Struck, radius: f64, total: &mut Contribution) {
    let predicted = struck.after[measured.ball].spin[2] / radius;
    let last = total.products.ncols() - 1;
    let by = gradient(&predicted) / measured.sd;
    let off = (predicted.re - measured.spin) / measured.sd;
    let mut block = total.products.fixed_view_mut::<INPUTS, INPUTS>(0, 0);
    block += by * by.transpose();
    let mut beside = total.products.fixed_view_mut::<INPUTS, 1>(0, last);
    beside += by * off;
    total.products[(last, last)] += off * off;
    total.cost += off * off;
}

/// Returns the correlation of errors `seconds` apart.
pub(crate) fn correlation(rho: f64, seconds: f64, fps: f64) -> f64 {
    let frames = (seconds * fps).round().clamp(1.0, 1e6);
    rho.powi(frames as i32)
}

/// One frame as the model predicts it.
struct Sight {
    rows: [Row; 2],
    /// Index.
    piece: usize,
    /// s
    time: f64,
}

/// Coefficients of a piece, camera, residual.
const LOCAL: usize = COEFFICIENTS + CAMERA + 1;
/// The same, rounded up to whole groups of eight.
const PADDED: usize = 24;
/// Camera and residual.
const REST: usize = CAMERA + 1;

/// Derivatives of a coordinate by the coefficients of a piece and by the camera, and its residual.
type Row = [f64; PADDED];

/// Returns where on the table a ball is so long after the first guess of the impact, and how high.
pub(super) fn locate(stretches: &[Stretch], time: f64) -> (Point, f64) {
    let index = stretches.partition_point(|stretch| stretch.start <= time).saturating_sub(1);
    let powers = [1.0, time, 0.5 * time * time];
    let of = |i: usize| (0..3).map(|j| powers[j] * stretches[index].at[3 * i + j]).sum::<f64>();
    (Point::new(of(0), of(1)), of(2))
}

/// Returns the rows of both coordinates of a frame, and the index of the piece that its ball is on.
fn see(frame: &Frame, instant: f64, pieces: &[Piece], camera: &Camera, sd: f64) -> ([Row; 2], usize) {
    let time = frame.time - instant + camera.delay(frame.seen);
    let index = pieces.partition_point(|piece| piece.start <= time).saturating_sub(1);
    let piece = &pieces[index];
    let powers = [1.0, time, 0.5 * time * time];
    let [x, y, height] = [0, 1, 2].map(|i| (0..3).map(|j| powers[j] * piece.at[3 * i + j]).sum::<f64>());
    let [v_x, v_y, v_h] = [0, 1, 2].map(|i| piece.at[3 * i + 1] + piece.at[3 * i + 2] * time);
    let mut seen = camera.look(Point::new(x, y), height);
    // a later reading sees the ball further along its path
    let by_time = seen.by_place * Point::new(v_x, v_y) + seen.by_height * v_h;
    seen.by_camera[Id::ShutterX as usize - PHYSICS] = by_time * frame.seen.x;
    seen.by_camera[Id::ShutterY as usize - PHYSICS] = by_time * frame.seen.y;
    let rows = [0, 1].map(|axis| {
        let scale = frame.weight[axis] / sd;
        let mut row = [0.0; PADDED];
        let by = [seen.by_place[(axis, 0)], seen.by_place[(axis, 1)], seen.by_height[axis]];
        for i in 0..COEFFICIENTS {
            row[i] = by[i / 3] * powers[i % 3] * scale;
        }
        for i in 0..CAMERA {
            row[COEFFICIENTS + i] = seen.by_camera[i][axis] * scale;
        }
        row[LOCAL - 1] = (seen.place[axis] - frame.seen[axis]) * scale;
        row
    });
    (rows, index)
}

/// Returns a row by own and shared unknowns.
fn spread(row: &Row, piece: &Piece) -> SVector<f64, COLUMNS> {
    let mut all = SVector::<f64, COLUMNS>::zeros();
    let coefficients = SVector::<f64, COEFFICIENTS>::from_column_slice(&row[..COEFFICIENTS]);
    all.fixed_rows_mut::<INPUTS>(0).copy_from(&piece.by.tr_mul(&coefficients));
    all.fixed_rows_mut::<CAMERA>(INPUTS).copy_from_slice(&row[COEFFICIENTS..LOCAL - 1]);
    all[COLUMNS - 1] = row[LOCAL - 1];
    all
}

/// Returns the weight of a frame with these residuals, and its cost.
pub(crate) fn weigh(x: f64, y: f64) -> (f64, f64) {
    let square = x * x + y * y;
    let length = square.sqrt();
    if length <= HUBER { (1.0, square) } else { (HUBER / length, HUBER * (2.0 * length - HUBER)) }
}

/// Products of derivatives by a piece's coefficients and by the camera, summed over the frames on
/// the piece (upper triangle).
struct Sums {
    products: [[f64; PADDED]; LOCAL],
    frames: usize,
}

impl Sums {
    fn new() -> Self {
        Self { products: [[0.0; PADDED]; LOCAL], frames: 0 }
    }

    fn clear(&mut self) {
        self.products.as_flattened_mut().fill(0.0);
        self.frames = 0;
    }

    /// Adds both coordinates of a frame; returns their cost and their weighted square.
    fn add(&mut self, [x, y]: &[Row; 2]) -> (f64, f64) {
        let (weight, cost) = weigh(x[LOCAL - 1], y[LOCAL - 1]);
        for i in 0..LOCAL {
            let (a, b) = (x[i] * weight, y[i] * weight);
            // whole groups of eight from the one with the diagonal on
            for j in i / 8 * 8..PADDED {
                self.products[i][j] += a * x[j] + b * y[j];
            }
        }
        self.frames += 1;
        (cost, weight * (x[LOCAL - 1] * x[LOCAL - 1] + y[LOCAL - 1] * y[LOCAL - 1]))
    }

    /// Adds the sums by own and shared unknowns.
    fn add_to(&self, total: &mut DMatrix<f64>, piece: &Piece) {
        if self.frames == 0 {
            return;
        }
        let sums = SMatrix::<f64, LOCAL, LOCAL>::from_fn(|i, j| self.products[i.min(j)][i.max(j)]);
        let by_inputs = piece.by.transpose();
        let mut block = total.fixed_view_mut::<INPUTS, INPUTS>(0, 0);
        block += by_inputs * (sums.fixed_view::<COEFFICIENTS, COEFFICIENTS>(0, 0) * piece.by);
        // the camera, and the residual, between which others have their columns
        let beside = by_inputs * sums.fixed_view::<COEFFICIENTS, REST>(0, COEFFICIENTS);
        let rest = sums.fixed_view::<REST, REST>(COEFFICIENTS, COEFFICIENTS);
        let mut block = total.fixed_view_mut::<INPUTS, CAMERA>(0, INPUTS);
        block += beside.fixed_columns::<CAMERA>(0);
        let mut block = total.fixed_view_mut::<INPUTS, 1>(0, COLUMNS - 1);
        block += beside.fixed_columns::<1>(CAMERA);
        let mut block = total.fixed_view_mut::<CAMERA, CAMERA>(INPUTS, INPUTS);
        block += rest.fixed_view::<CAMERA, CAMERA>(0, 0);
        let mut block = total.fixed_view_mut::<CAMERA, 1>(INPUTS, COLUMNS - 1);
        block += rest.fixed_view::<CAMERA, 1>(0, CAMERA);
        total[(COLUMNS - 1, COLUMNS - 1)] += rest[(CAMERA, CAMERA)];
    }
}
