//! The frames of one ball by their moments, so that the cost of a shot does not grow with the frame rate.
//!
//! Between two events (impact, landing, end of sliding) a path is a polynomial of degree 2 in time. With
//! u = (t − T)/h, the path p = A + Bu + Cu², the frames y at u with weights w = 1/σ², and ŷ = Â + B̂u + Ĉu² a reference
//! path near them, the sums
//!
//!   S_k = Σ w uᵏ (k = 0…4),   Y_k = Σ w (y − ŷ) uᵏ (k = 0…2),   Q = Σ w (y − ŷ)²
//!
//! over the frames of a stretch give χ² and its derivatives there exactly, with c = (A − Â, B − B̂, C − Ĉ), D = ∂c/∂z and
//! M the matrix of S_(i+k):
//!
//!   χ² = Q − 2c·Y + cᵀMc     Jᵀr = Dᵀ(Mc − Y)     JᵀJ = DᵀMD
//!
//! A path is continuous where stretches meet, so that the instants of the events need no derivative of their own.
//!
//! Where the camera is not known, its corrections δ move the frames by Σ δ_k b_k, which adds
//!
//!   B_ka = Σ w b_k uᵃ (a = 0…2),   G_k = Σ w b_k (y − ŷ),   H_kl = Σ w b_k b_l
//!
//! With Y_a + Σ δ_k B_ka in the place of Y_a, and Q + 2δ·G + δᵀHδ in that of Q:
//!
//!   Jᵀr by δ = G + Hδ − Bc     JᵀJ = H among the corrections, −DᵀBᵀ between them and the others

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::Frame;
use super::path_start::{FIRST, LOCAL, Local};
use super::sums::{CORRECTIONS, CameraSums, Off, Sums};
use crate::film::camera::Camera;
use crate::likelihood::small_products::{add_product, add_product_with_transpose};
use crate::measurement::correction::Correction;
use crate::physics::cloth_motion::Path;

/// A camera, and how high the ball is above the cloth at an instant (s), m.
type Watched<'a> = (&'a Camera, &'a dyn Fn(f64) -> f64);

/// How a frame follows the corrections: x and y, m by the unit of each.
type Shifts = [[f64; 2]; CORRECTIONS];

/// Sums are stored after each so many frames and completed from the frames, which keeps large data sets small.
const BLOCK: usize = 8;

/// Frames in the order of time that share one reference path.
#[derive(Clone, Debug)]
struct Part {
    frames: Vec<Frame>,
    /// How each frame follows the corrections of the camera, where these are not known, and the sums with these as in `blocks`.
    shifts: Vec<Shifts>,
    camera_blocks: Vec<[CameraSums; 2]>,
    /// T and h, seconds.
    centre: f64,
    scale: f64,
    /// Â, B̂, Ĉ of x and of y, metres.
    reference: [[f64; 3]; 2],
    /// The sums of x and of y over the first 0, [`BLOCK`], 2 [`BLOCK`], … frames.
    blocks: Vec<[Sums; 2]>,
}

impl Part {
    fn new(frames: Vec<Frame>, camera: Option<Watched>) -> Self {
        let ends = frames.first().zip(frames.last()).map_or([0.0; 2], |(first, last)| [first.t, last.t]);
        let centre = 0.5 * (ends[0] + ends[1]);
        let half = 0.5 * (ends[1] - ends[0]);
        let scale = if half > 0.0 { half } else { 1.0 };
        let mut part = Self {
            frames,
            shifts: Vec::new(),
            camera_blocks: Vec::new(),
            centre,
            scale,
            reference: [[0.0; 3]; 2],
            blocks: Vec::new(),
        };
        part.reference = part.parabolas();
        if let Some(camera) = camera {
            part.shifts = part.frames.iter().map(|frame| part.shifts_of(frame, camera)).collect();
            let mut sums = [CameraSums::zero(); 2];
            for i in 0..part.frames.len() {
                if i % BLOCK == 0 {
                    part.camera_blocks.push(sums);
                }
                part.add_shifts(&mut sums, i);
            }
            part.camera_blocks.push(sums);
        }
        let mut sums = [Sums::default(); 2];
        for (i, frame) in part.frames.iter().enumerate() {
            if i % BLOCK == 0 {
                part.blocks.push(sums);
            }
            part.add(&mut sums, frame);
        }
        part.blocks.push(sums);
        part
    }

    fn add(&self, sums: &mut [Sums; 2], frame: &Frame) {
        let u = (frame.t - self.centre) / self.scale;
        for ((sums, reference), (y, weight)) in
            sums.iter_mut().zip(&self.reference).zip(frame.position.iter().zip(&frame.weight))
        {
            let [a, b, c] = reference;
            sums.add(u, y - (a + u * (b + u * c)), weight * weight);
        }
    }

    /// How a frame follows the corrections, where the reference path is: at its own position its noise would shrink with the film, and the
    /// scale that the frames tell be too large. What is read later by δ a metre shows where the ball was earlier.
    fn shifts_of(&self, frame: &Frame, (camera, height): Watched) -> Shifts {
        let u = (frame.t - self.centre) / self.scale;
        let position = self.reference.map(|[a, b, c]| a + u * (b + u * c));
        let velocity = self.reference.map(|[_, b, c]| (b + 2.0 * c * u) / self.scale);
        let film = camera.film(position);
        let mut shifts = camera.derivatives(film);
        let [by_x, by_y] = camera.delays(film, position);
        shifts[Correction::ShutterX as usize] = velocity.map(|v| -v * by_x);
        shifts[Correction::ShutterY as usize] = velocity.map(|v| -v * by_y);
        // seen h (s + (p − m)/H) too far
        let h = height(frame.t);
        shifts[Correction::ParallaxX as usize] = [-h, 0.0];
        shifts[Correction::ParallaxY as usize] = [0.0, -h];
        shifts[Correction::Nearness as usize] = [0, 1].map(|i| -h * (position[i] - camera.middle[i]));
        shifts
    }

    fn add_shifts(&self, sums: &mut [CameraSums; 2], i: usize) {
        let (frame, shifts) = (&self.frames[i], &self.shifts[i]);
        let u = (frame.t - self.centre) / self.scale;
        for (axis, sums) in sums.iter_mut().enumerate() {
            let [a, b, c] = self.reference[axis];
            let off = frame.position[axis] - (a + u * (b + u * c));
            let own = SVector::from_fn(|k, _| shifts[k][axis]);
            sums.add(&own, u, off, frame.weight[axis].powi(2));
        }
    }

    /// What the corrections add over the frames from `first` to `end`.
    fn camera_sums(&self, first: usize, end: usize) -> Option<[CameraSums; 2]> {
        let until = |count: usize| {
            let block = count / BLOCK;
            let mut sums = *self.camera_blocks.get(block)?;
            for i in block * BLOCK..count {
                self.add_shifts(&mut sums, i);
            }
            Some(sums)
        };
        let (skipped, until) = (until(first)?, until(end)?);
        Some([0, 1].map(|axis| until[axis].without(&skipped[axis])))
    }

    /// The parabola nearest to the frames in x and in y; a constant or a straight line where more is not determined.
    fn parabolas(&self) -> [[f64; 3]; 2] {
        let mut sums = [Sums::default(); 2];
        for frame in &self.frames {
            self.add(&mut sums, frame);
        }
        sums.map(|Sums { s, y, .. }| {
            let all = Matrix3::from_fn(|i, k| s[i + k]).cholesky().map(|m| m.solve(&Vector3::from(y)));
            match all {
                Some(found) if found.iter().all(|c| c.is_finite()) => found.into(),
                _ if s[0] > 0.0 => [y[0] / s[0], 0.0, 0.0],
                _ => [0.0; 3],
            }
        })
    }

    /// The sums over the first `count` frames.
    fn first(&self, count: usize) -> [Sums; 2] {
        let block = count / BLOCK;
        let mut sums = self.blocks[block];
        for frame in &self.frames[block * BLOCK..count] {
            self.add(&mut sums, frame);
        }
        sums
    }

    /// How many frames are earlier than an instant.
    fn before(&self, time: f64) -> usize {
        self.frames.partition_point(|frame| frame.t < time)
    }
}

/// The frames of one ball: those before about the impact, and those after it.
#[derive(Clone, Debug)]
pub(super) struct Moments([Part; 2]);

impl Moments {
    /// Of frames in the order of time; `impact` is about when the balls meet.
    pub(super) fn new(mut frames: Vec<Frame>, impact: f64, camera: Option<Watched>) -> Self {
        let after = frames.split_off(frames.partition_point(|frame| frame.t < impact));
        Self([Part::new(frames, camera), Part::new(after, camera)])
    }

    /// The frames themselves, in the order of time, and by how much corrections of the camera that are off move them, m.
    pub(super) fn frames(&self) -> impl Iterator<Item = (&Frame, impl Fn(&Off) -> [f64; 2])> {
        self.0.iter().flat_map(|part| {
            part.frames.iter().enumerate().map(|(i, frame)| {
                let shifts = part.shifts.get(i);
                let moved = move |off: &Off| {
                    let sum = |axis: usize| {
                        shifts.map_or(0.0, |shifts| off.iter().zip(shifts).map(|(by, b)| by * b[axis]).sum())
                    };
                    [sum(0), sum(1)]
                };
                (frame, moved)
            })
        })
    }

    /// What the frames at instants in [from, to) say of a path, moved by corrections of the camera that are off.
    pub(super) fn along(&self, path: &Path<Local>, [from, to]: [f64; 2], off: &Off) -> Along {
        let camera = self.0.iter().any(|part| !part.shifts.is_empty()).then(|| AlongCamera {
            coupling: SMatrix::zeros(),
            gradient: SVector::zeros(),
            matrix: SMatrix::zeros(),
        });
        let mut sums = Along { square: 0.0, gradient: SVector::zeros(), matrix: SMatrix::zeros(), camera };
        for (stretch, [begins, ends]) in path.stretches() {
            for part in &self.0 {
                let [first, end] = [from.max(begins), to.min(ends)].map(|time| part.before(time));
                if first >= end {
                    continue;
                }
                let (skipped, until) = (part.first(first), part.first(end));
                let polynomial = stretch.about(part.centre, part.scale);
                let camera = part.camera_sums(first, end);
                for axis in 0..2 {
                    let of_frames = until[axis].without(&skipped[axis]);
                    let camera = camera.as_ref().map(|camera| (&camera[axis], off));
                    sums.add(
                        axis,
                        &polynomial[axis],
                        (&part.reference[axis], part.scale),
                        &of_frames,
                        camera,
                    );
                }
            }
        }
        sums
    }
}

/// χ² of frames along a path, and Jᵀr and JᵀJ by what the path starts with.
pub(super) struct Along {
    pub square: f64,
    pub gradient: SVector<f64, LOCAL>,
    pub matrix: SMatrix<f64, LOCAL, LOCAL>,
    /// Where the camera is not known.
    pub camera: Option<AlongCamera>,
}

/// JᵀJ between what a path starts with and the corrections of the camera, and among these; and their part of Jᵀr.
pub(super) struct AlongCamera {
    pub coupling: SMatrix<f64, LOCAL, CORRECTIONS>,
    pub gradient: SVector<f64, CORRECTIONS>,
    pub matrix: SMatrix<f64, CORRECTIONS, CORRECTIONS>,
}

impl Along {
    /// Adds a stretch of the path: a polynomial of x (`axis` 0) or y in u = (t − T)/h, what ŷ is there with h, and the sums over
    /// the frames.
    fn add(
        &mut self,
        axis: usize,
        polynomial: &[Local; 3],
        (reference, scale): (&[f64; 3], f64),
        of_frames: &Sums,
        of_camera: Option<(&CameraSums, &Off)>,
    ) {
        let moved;
        let Sums { s, y, q } = match of_camera {
            Some((camera, off)) => {
                moved = camera.moved(of_frames, off);
                &moved
            }
            None => of_frames,
        };
        let [_, b, c] = polynomial;
        let mut by = SMatrix::<f64, LOCAL, 3>::zeros();
        // later by δ: p(t − δ), so that ∂p/∂δ = −(B + 2Cu)/h
        by[(0, 0)] = -b.re / scale;
        by[(0, 1)] = -2.0 * c.re / scale;
        by[(1 + axis, 0)] = 1.0;
        for (k, coefficient) in polynomial.iter().enumerate() {
            if let Some(derivatives) = &coefficient.eps.0 {
                by.fixed_view_mut::<{ LOCAL - FIRST }, 1>(FIRST, k).copy_from(derivatives);
            }
        }
        let c = Vector3::from_fn(|k, _| polynomial[k].re - reference[k]);
        let moments = Matrix3::from_fn(|i, k| s[i + k]);
        let y = Vector3::from(*y);
        // χ² = Q − 2c·Y + cᵀMc, its halved derivatives Dᵀ(Mc − Y) and DᵀMD
        let pull = moments * c - y;
        self.square += q + c.dot(&(pull - y));
        add_product(&mut self.gradient, 1.0, &by, &pull);
        let mut half = SMatrix::zeros();
        add_product(&mut half, 1.0, &by, &moments);
        add_product_with_transpose(&mut self.matrix, &half, &by);
        if let (Some(sums), Some((CameraSums { b, g, h }, off))) = (&mut self.camera, of_camera) {
            let b = SMatrix::<f64, 3, CORRECTIONS>::from_fn(|a, k| b[k][a]);
            // G + Hδ − Bc, −DᵀBᵀ and H
            sums.gradient += g + h * SVector::from(*off) - b.tr_mul(&c);
            add_product(&mut sums.coupling, -1.0, &by, &b);
            sums.matrix += h;
        }
    }
}

#[cfg(test)]
mod tests {
    use num_dual::DualSVec64;

    use super::*;
    use crate::likelihood::frames::path_start;
    use crate::likelihood::frames::schur_reduced::Normal;
    use crate::physics::cloth_motion::{Cloth, Launch};

    /// Frames that corrections of the camera have moved are those frames, and the derivatives by the corrections are differences.
    #[test]
    fn corrections_of_the_camera_move_the_frames() {
        /// Differences of numbers some 1e4 times as large, over 2e-4 of a usual error.
        const DIFFERENCE: f64 = 1e-5;
        let (launch, cloth) = start();
        let path = Path::after(&launch, &cloth);
        let camera = Camera::neutral([0.2, 0.1]).with(Correction::Lens, 0.01);
        let frames: Vec<Frame> = (0..100)
            .map(|i| {
                let t = 0.012 + f64::from(i) / 500.0;
                let [x, y] = path.position(t).map(|p| p.re);
                Frame { t, position: [x + 1e-4, y - 1e-4 * f64::from(i % 3)], weight: [1e4, 0.5e4] }
            })
            .collect();
        let height = |t: f64| 0.1 * t;
        let moments = Moments::new(frames, 0.1, Some((&camera, &height)));
        let (own, own_cloth) = path_start::launch(&launch, [0.2, 0.01, 0.5]);
        let along = |off: &Off| {
            moments.along(&Path::after(&own, &own_cloth), [f64::NEG_INFINITY, f64::INFINITY], off)
        };
        let mut off: Off = Correction::ALL.map(|c| 2e-3 * c.usual());
        let here = along(&off);
        // χ² frame by frame
        let square: f64 = moments
            .frames()
            .map(|(frame, moved)| {
                let (at, shift) = (path.position(frame.t), moved(&off));
                (0..2)
                    .map(|i| ((at[i].re - frame.position[i] - shift[i]) * frame.weight[i]).powi(2))
                    .sum::<f64>()
            })
            .sum();
        assert!((here.square / square - 1.0).abs() < ROUNDING, "{} {square}", here.square);
        let camera = here.camera.as_ref().unwrap();
        for correction in Correction::ALL {
            let (k, step) = (correction as usize, 1e-4 * correction.usual());
            let value = off[k];
            off[k] = value + step;
            let up = along(&off);
            off[k] = value - step;
            let down = along(&off);
            off[k] = value;
            let slope = (up.square - down.square) / (4.0 * step);
            assert!(
                (slope - camera.gradient[k]).abs() < DIFFERENCE * camera.gradient[k].abs(),
                "{correction:?}"
            );
            let coupling = (up.gradient - down.gradient) / (2.0 * step);
            let most = camera.coupling.column(k).amax();
            assert!((coupling - camera.coupling.column(k)).amax() < DIFFERENCE * most, "{correction:?}");
        }
    }

    /// Sums of some hundred terms that are as large as (10 mm / 0.1 mm)², in χ² and its derivatives.
    const ROUNDING: f64 = 1e-10;

    type Dual = DualSVec64<6>;

    /// A lifted ball that bounces, slides and rolls, with derivatives by a velocity, the slip, the rise, the instant, a
    /// coordinate and μ_k.
    fn start() -> (Launch<Dual>, Cloth<Dual>) {
        let unknown = |i, value| Dual::from_re(value).derivative(i);
        let launch = Launch {
            time: unknown(3, 0.01),
            position: [unknown(4, 0.1), Dual::from_re(-0.2)],
            velocity: [unknown(0, 1.5), Dual::from_re(-0.4)],
            slip: [unknown(1, 0.3), Dual::from_re(0.1)],
            up: unknown(2, 0.06),
            inertia: 0.4,
        };
        let cloth =
            Cloth { sliding: unknown(5, 0.2), rolling: Dual::from_re(0.01), bounce: Dual::from_re(0.5) };
        (launch, cloth)
    }

    #[test]
    fn moments_give_the_normal_equations_of_the_frames_one_by_one() {
        let (launch, cloth) = start();
        let path = Path::after(&launch, &cloth);
        for rate in [240.0, 1000.0, 4000.0] {
            let frames = (0..(0.3 * rate) as usize).map(|i| {
                let t = 0.01 + i as f64 / rate;
                let [x, y] = path.position(t).map(|p| p.re);
                // as uneven as noise, and the same every time
                let off = 1e-4 * (i as f64 * 1.7).sin();
                Frame { t, position: [x + off, y - 2.0 * off], weight: [1e4, 0.5e4] }
            });
            let frames: Vec<Frame> = frames.collect();
            let mut one_by_one = Normal::<6, 0>::zero();
            for frame in &frames {
                for (i, predicted) in path.position(frame.t).into_iter().enumerate() {
                    one_by_one.add((predicted - frame.position[i]) * frame.weight[i]);
                }
            }
            // the reference paths meet in the middle of a slide
            let moments = Moments::new(frames, 0.1, None);
            let (own, own_cloth) = path_start::launch(&launch, [0.2, 0.01, 0.5]);
            let off = [0.0; CORRECTIONS];
            let sums =
                moments.along(&Path::after(&own, &own_cloth), [f64::NEG_INFINITY, f64::INFINITY], &off);
            let mut together = Normal::<6, 0>::zero();
            together.add_path(
                &sums,
                &path_start::by_unknowns(&launch, &[cloth.sliding, cloth.rolling, cloth.bounce]),
            );
            assert!((together.square / one_by_one.square - 1.0).abs() < ROUNDING, "{rate}");
            let most = one_by_one.gradient.amax();
            assert!((together.gradient - one_by_one.gradient).amax() < ROUNDING * most, "{rate}");
            assert!(together.differs_from(&one_by_one) < ROUNDING, "{rate}");
        }
    }
}
