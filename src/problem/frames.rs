//! Frames of bodies against their paths, of balls as of discs: residuals and derivatives, whitened
//! for noise that is correlated from frame to frame, and summed up to normal equations.
//!
//! A row has the derivatives of a coordinate by the coefficients of the piece of the path that its
//! body is on, those by other unknowns, and the residual, in units of the noise.

use nalgebra::{Const, DMatrix, DVector, Dyn, OMatrix, SMatrix, SVector};
use num_dual::DualSVec64;

use super::film::camera::{Camera, Point, Seen};
use super::film::dual::gradient;
use super::sums::{Contribution, NoiseSums};
use super::unknowns::{Id, PHYSICS};

/// Length of a residual, in standard deviations of a coordinate, beyond which it counts linearly
/// (Huber 1964). A frame exceeds it by chance once in 3000.
const HUBER: f64 = 4.0;

/// A ball, or a point on a disc, in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// s
    pub(crate) time: f64,
    /// Place in the picture, m from its middle.
    pub(crate) seen: Point,
    /// Square root of the part of an observation that each coordinate is, over its standard
    /// deviation in units of the film's noise.
    pub(crate) weight: Point,
    /// Direction in the picture from the other ball in the same frame, of a length that decreases
    /// with their distance: 1 if they touch; 0 of points on discs.
    pub(crate) apart: Point,
    pub(crate) used: bool,
}

/// A part of a body's path: coefficients with their derivatives by the inputs of the motion.
#[derive(Clone, Debug)]
pub(crate) struct Piece<const C: usize, const I: usize> {
    /// s
    pub(crate) start: f64,
    pub(crate) at: SVector<f64, C>,
    /// Derivatives of each coefficient, as a column.
    pub(crate) by: SMatrix<f64, I, C>,
}

impl<const C: usize, const I: usize> Piece<C, I> {
    pub fn new(start: f64, coefficients: &[DualSVec64<I>]) -> Self {
        let mut piece = Self { start, at: SVector::zeros(), by: SMatrix::zeros() };
        for (i, coefficient) in coefficients.iter().enumerate() {
            piece.at[i] = coefficient.re;
            piece.by.set_column(i, &gradient(coefficient));
        }
        piece
    }
}

/// A frame as the model predicts it, whitened.
pub(crate) struct Sight<const R: usize> {
    pub(crate) index: usize,
    /// s
    pub(crate) time: f64,
    /// Index of the piece that its body is on.
    pub(crate) piece: usize,
    pub(crate) rows: [SVector<f64, R>; 2],
    /// Derivatives by another piece, which the frame before is on, with its index.
    carried: Option<(usize, Box<[SVector<f64, R>; 2]>)>,
    /// The contribution of each coordinate to the sums of its noise.
    sums: [NoiseSums; 2],
}

impl<const R: usize> Sight<R> {
    /// Returns the whitened residuals of both coordinates, in units of the noise.
    pub fn residuals(&self) -> Point {
        Point::new(self.rows[0][R - 1], self.rows[1][R - 1])
    }

    /// Returns the square of the residuals.
    pub fn square(&self) -> f64 {
        self.residuals().norm_squared()
    }
}

/// Returns the used frames of a track whitened, each as `see` has it: the index of a piece, and
/// rows. Noise has the correlations `rho`; errors on other pieces count as independent unless they
/// carry over.
pub(crate) fn whiten<const R: usize>(
    frames: &[Frame],
    (rho, fps): ([f64; 2], f64),
    carries: bool,
    see: impl Fn(&Frame) -> (usize, [SVector<f64, R>; 2]),
) -> Vec<Sight<R>> {
    let used = frames.iter().enumerate().filter(|(_, frame)| frame.used);
    let raw = |(index, frame): (usize, &Frame)| {
        let (piece, rows) = see(frame);
        Sight { index, time: frame.time, piece, rows, carried: None, sums: Default::default() }
    };
    let mut sights = Vec::with_capacity(frames.len());
    sights.extend(used.map(raw));
    // from the end, so that the frame before is not whitened yet
    for place in (0..sights.len()).rev() {
        let (earlier, later) = sights.split_at_mut(place);
        let sight = &mut later[0];
        let weight = &frames[sight.index].weight;
        let before = earlier.last().filter(|before| carries || before.piece == sight.piece);
        for axis in 0..2 {
            let (sums, row) = (&mut sight.sums[axis], &mut sight.rows[axis]);
            sums.count = weight[axis].powi(2).min(1.0);
            let Some(before) = before.filter(|_| weight[axis] > 0.0) else { continue };
            let row_before = &before.rows[axis];
            sums.lagged = row[R - 1] * row_before[R - 1];
            sums.square = row[R - 1].powi(2);
            let frames = ((sight.time - before.time) * fps).round().clamp(1.0, 1e6);
            let kept = rho[axis].powi(frames as i32);
            if !(kept > 0.0) {
                continue;
            }
            let fresh = (1.0 - kept * kept).sqrt().recip();
            sums.ln_determinant = -2.0 * sums.count * fresh.ln();
            *row *= fresh;
            if before.piece == sight.piece {
                row.axpy(-kept * fresh, row_before, 1.0);
            } else {
                row[R - 1] -= kept * fresh * row_before[R - 1];
                let zeros = || (before.piece, Box::new([SVector::zeros(); 2]));
                let carried = &mut sight.carried.get_or_insert_with(zeros).1[axis];
                *carried = row_before * (-kept * fresh);
                carried[R - 1] = 0.0;
            }
        }
    }
    sights
}

/// Returns the rows of both coordinates of a frame in units of its noise from the body as it is
/// predicted, with the derivatives of its place in the picture by other numbers and by time. `late`
/// is the duration of a frame, s, of the second body, and 0 of the first.
#[inline]
pub(crate) fn rows<const R: usize>(
    frame: &Frame,
    mut seen: Seen,
    by: &[Point],
    (by_time, late): (Point, f64),
    sd: Point,
) -> [SVector<f64, R>; 2] {
    // a later reading sees the body further along its path
    seen.by_camera[Id::ShutterX as usize - PHYSICS] = by_time * frame.seen.x;
    seen.by_camera[Id::ShutterY as usize - PHYSICS] = by_time * frame.seen.y;
    seen.by_camera[Id::Late as usize - PHYSICS] = -by_time * late;
    let scale = frame.weight.component_div(&sd);
    let residual = seen.place - frame.seen;
    let mut rows = [SVector::zeros(); 2];
    let columns = by.iter().chain(&seen.by_camera).chain([&residual]);
    columns.enumerate().for_each(|(i, column)| {
        (rows[0][i], rows[1][i]) = (column.x * scale.x, column.y * scale.y);
    });
    rows
}

/// Returns a row by all unknowns of a shot and the residual.
fn expand<const R: usize, const C: usize, const I: usize>(
    row: &SVector<f64, R>,
    piece: &Piece<C, I>,
    columns: &[usize],
    length: usize,
) -> DVector<f64> {
    let mut all = DVector::zeros(length);
    let by_inputs = piece.by * row.fixed_rows::<C>(0);
    for (column, by) in columns.iter().zip(by_inputs.iter().chain(row.rows_range(C..).iter())) {
        all[*column] += by;
    }
    all
}

/// Adds the frames of a track to the sums of a shot, each coordinate to the sums of its noise.
/// `columns` are places among the unknowns of the shot and the residual: of the inputs of the motion,
/// and of what stands behind the coefficients of a row.
pub(crate) fn add_track<const R: usize, const C: usize, const I: usize>(
    total: &mut Contribution,
    mut sights: Vec<Sight<R>>,
    pieces: &[Piece<C, I>],
    columns: &[usize],
    noises: [usize; 2],
) {
    let length = total.products.ncols();
    let others = R - C;
    let mut products = DMatrix::zeros(I + others, I + others);
    for sights in sights.chunk_by_mut(|a, b| a.piece == b.piece) {
        let piece = &pieces[sights[0].piece];
        let mut rows = Vec::with_capacity(2 * R * sights.len());
        for sight in sights {
            let residuals = sight.residuals();
            let (weight, cost) = weigh(residuals);
            total.sums.cost += cost;
            for axis in 0..2 {
                sight.sums[axis].weighted = weight * residuals[axis].powi(2);
                total.sums.noises[noises[axis]].add(&sight.sums[axis]);
                let row = &sight.rows[axis];
                match &sight.carried {
                    None if weight == 1.0 => rows.extend_from_slice(row.as_slice()),
                    None => rows.extend_from_slice((row * weight.sqrt()).as_slice()),
                    Some((on, carried)) => {
                        let by = expand(row, piece, columns, length)
                            + expand(&carried[axis], &pieces[*on], columns, length);
                        total.products.ger(weight, &by, &by, 1.0);
                    }
                }
            }
        }
        let rows = OMatrix::<f64, Const<R>, Dyn>::from_vec(rows);
        let row_products = &rows * rows.transpose();
        // products of dynamic size use vector instructions
        let by = piece.by.columns_range(..C);
        let by_rows = by * row_products.rows_range(..C);
        let mut by_inputs = products.view_mut((0, 0), (I, I));
        by_inputs.gemm(1.0, &by_rows.columns_range(..C), &by.transpose(), 1.0);
        let mut beside = products.view_mut((0, I), (I, others));
        beside += by_rows.columns_range(C..);
        let mut by_others = products.view_mut((I, I), (others, others));
        by_others += row_products.view((C, C), (others, others));
    }
    for (j, column) in columns.iter().enumerate() {
        for (i, row) in columns[..=j].iter().enumerate() {
            total.products[(*row.min(column), *row.max(column))] += products[(i, j)];
        }
    }
}

/// Returns the weight of a frame with these residuals, and its cost.
fn weigh(residuals: Point) -> (f64, f64) {
    let length = residuals.norm();
    if length <= HUBER { (1.0, length * length) } else { (HUBER / length, HUBER * (2.0 * length - HUBER)) }
}

/// Paths of two bodies through the picture.
#[derive(Clone, Debug)]
pub(crate) struct PicturePaths {
    /// Start and coefficients of the pieces of each.
    pieces: [Vec<(f64, Vec<f64>)>; 2],
    /// Place on the table and height by the coefficients and the time since the impact.
    locate: fn(&[f64], f64) -> (Point, f64),
    instant: f64,
    camera: Camera,
    fps: f64,
}

impl PicturePaths {
    pub(super) fn new<const C: usize, const I: usize>(
        pieces: [&[Piece<C, I>]; 2],
        locate: fn(&[f64], f64) -> (Point, f64),
        instant: f64,
        camera: Camera,
        fps: f64,
    ) -> Self {
        let coefficients = |piece: &Piece<C, I>| (piece.start, piece.at.as_slice().to_vec());
        let pieces = pieces.map(|pieces| pieces.iter().map(coefficients).collect());
        Self { pieces, locate, instant, camera, fps }
    }

    /// Returns the place of the first body (0) or the second (1) in the picture at a time, m from
    /// the middle of the film.
    pub fn place(&self, body: usize, time: f64) -> [f64; 2] {
        let pieces = &self.pieces[body.min(1)];
        let at = |delay: f64| {
            let since = time - self.instant + delay;
            let index = pieces.partition_point(|(start, _)| *start <= since).saturating_sub(1);
            let (table, height) = (self.locate)(&pieces[index].1, since);
            self.camera.find_tracked(body, self.camera.look(table, height)).place
        };
        // the shutter reads it at a time that depends on its place in the picture
        at(self.camera.delay(at(0.0), body as f64 / self.fps)).into()
    }
}
