//! The frames that an extraction uses, against where the balls should be in them.

use nalgebra::{DMatrix, DVector};
use num_dual::{Dual64, DualSVec64};

use super::both_balls::{Motion, with_derivatives};
use super::grid;
use super::shot_scene::ShotScene;
use super::unknowns::Unknowns;
use super::unknowns::unknown::{COUNT, ROLL, ROLLING};
use crate::measurement::spin::Spin;
use crate::measurement::track::{Sample, TrackShot};

/// The unknowns of a shot whose spin is known, and of one whose is not.
const KNOWN: usize = ROLL;
const UNKNOWN: usize = ROLLING;

/// A frame of a ball.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    pub sample: &'a Sample,
    /// Standard deviations of x and y, such that frames may be taken for independent.
    pub sd: [f64; 2],
    /// In how many frames the same error stands: see [`grid::repeats`]; and noise that lasts from frame to frame.
    repeats: [f64; 2],
}

/// The frames that a fit uses.
#[derive(Clone)]
pub(crate) struct Frames<'a> {
    pub cue: Vec<Frame<'a>>,
    pub object: Vec<Frame<'a>>,
}

impl<'a> Frames<'a> {
    /// All of a shot, with a common standard deviation where the track has none; none is below the error of rounding. `noise` is
    /// what the track shows.
    pub(crate) fn of(shot: &'a TrackShot, sd: f64, noise: f64) -> Self {
        let of = |samples: &'a [Sample], step: f64| {
            let least = grid::rounding(step);
            // noise that lasts adds up over so many frames
            let alike = shot.frames_alike();
            let frame = |(sample, repeats): (&'a Sample, [f64; 2])| {
                let repeats = repeats.map(|repeats| repeats * alike);
                let sd = sample.sd.unwrap_or([sd; 2]);
                Frame { sample, sd: [0, 1].map(|i| sd[i].max(least) * repeats[i].sqrt()), repeats }
            };
            samples.iter().zip(grid::repeats(samples, noise.max(least), step)).map(frame).collect()
        };
        let [cue, object] = shot.resolution;
        Self { cue: of(&shot.cue, cue), object: of(&shot.object, object) }
    }

    /// Those between two times, without those at the instants that are wrong.
    pub(crate) fn between(&self, from: f64, to: f64, [wrong_cue, wrong_object]: [&[f64]; 2]) -> Self {
        let of = |frames: &[Frame<'a>], wrong: &[f64]| {
            let used =
                |frame: &&Frame| (from..=to).contains(&frame.sample.t) && !wrong.contains(&frame.sample.t);
            frames.iter().filter(used).copied().collect()
        };
        Self { cue: of(&self.cue, wrong_cue), object: of(&self.object, wrong_object) }
    }

    /// How many coordinates there are.
    pub(crate) fn count(&self) -> usize {
        2 * (self.cue.len() + self.object.len())
    }

    /// How many of them tell something of their own: those that repeat one error count once.
    pub(crate) fn independent(&self) -> usize {
        let frames = self.cue.iter().chain(&self.object);
        frames.flat_map(|frame| frame.repeats).map(f64::recip).sum::<f64>().round() as usize
    }

    /// As [`Frames::residuals`], without derivatives.
    pub(crate) fn residuals_only(&self, scene: &ShotScene, z: &Unknowns) -> DVector<f64> {
        let plain: [f64; COUNT] = (*z).into();
        let motion = Motion::new(scene, &plain);
        let off = |predicted: [f64; 2], Frame { sample, sd, .. }: &Frame| {
            [(predicted[0] - sample.x) / sd[0], (predicted[1] - sample.y) / sd[1]]
        };
        let cue = self.cue.iter().flat_map(|frame| off(motion.cue(frame.sample.t), frame));
        let object = self.object.iter().flat_map(|frame| off(motion.object(frame.sample.t), frame));
        DVector::from_iterator(self.count(), cue.chain(object))
    }

    /// (predicted − measured)/sd: x and y of the cue ball's frames, then of the object ball's; and
    /// the derivatives by the unknowns.
    pub(crate) fn residuals(&self, scene: &ShotScene, z: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        match scene.spin {
            Spin::Unknown => self.with_jacobian::<UNKNOWN>(scene, z),
            _ => self.with_jacobian::<KNOWN>(scene, z),
        }
    }

    /// The derivatives of [`Frames::residuals`] by μ_r, which a single shot is given.
    pub(crate) fn by_rolling(&self, scene: &ShotScene, z: &Unknowns) -> DVector<f64> {
        let mut dual: [Dual64; COUNT] = std::array::from_fn(|i| Dual64::from_re(z[i]));
        dual[ROLLING] = dual[ROLLING].derivative();
        let motion = Motion::new(scene, &dual);
        let by = |predicted: [Dual64; 2], sd: &[f64; 2]| [predicted[0].eps / sd[0], predicted[1].eps / sd[1]];
        let cue = self.cue.iter().flat_map(|frame| by(motion.cue(frame.sample.t), &frame.sd));
        let object = self.object.iter().flat_map(|frame| by(motion.object(frame.sample.t), &frame.sd));
        DVector::from_iterator(self.count(), cue.chain(object))
    }

    fn with_jacobian<const N: usize>(&self, scene: &ShotScene, z: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        let motion = with_derivatives::<N>(scene, z);
        let mut residuals = DVector::zeros(self.count());
        let mut jacobian = DMatrix::zeros(self.count(), COUNT);
        let mut row = 0;
        let mut add = |predicted: [DualSVec64<N>; 2], sample: &Sample, sd: &[f64; 2]| {
            for (i, measured) in [sample.x, sample.y].into_iter().enumerate() {
                residuals[row] = (predicted[i].re - measured) / sd[i];
                if let Some(gradient) = predicted[i].eps.0 {
                    for (column, derivative) in gradient.iter().enumerate() {
                        jacobian[(row, column)] = derivative / sd[i];
                    }
                }
                row += 1;
            }
        };
        for Frame { sample, sd, .. } in &self.cue {
            add(motion.cue(sample.t), sample, sd);
        }
        for Frame { sample, sd, .. } in &self.object {
            add(motion.object(sample.t), sample, sd);
        }
        (residuals, jacobian)
    }
}
