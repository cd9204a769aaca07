//! The frames that an extraction uses, against where the bodies should be in them.

use nalgebra::{DMatrix, DVector};
use num_dual::DualSVec64;

use crate::film::grid;
use crate::measurement::track::{Sample, TrackShot};

/// A frame of a body.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a> {
    pub sample: &'a Sample,
    /// Standard deviations of x and y, such that frames may be taken for independent.
    pub sd: [f64; 2],
    /// In how many frames the same error stands: see [`grid::repeats`]; and noise that lasts from frame to frame.
    repeats: [f64; 2],
}

/// The frames that a fit uses, of the cue ball and of the object ball, or of two discs.
#[derive(Clone)]
pub(crate) struct Frames<'a> {
    pub of: [Vec<Frame<'a>>; 2],
}

/// A coordinate in a frame.
struct Coordinate<T> {
    predicted: T,
    measured: f64,
    sd: f64,
}

impl<'a> Frames<'a> {
    /// All of a shot, with a common standard deviation where the track has none; none is below the error of rounding. `noise` is
    /// what the track shows.
    pub(crate) fn of(shot: &'a TrackShot, sd: f64, noise: f64, are_balls: bool) -> Self {
        // a stated noise is that of every frame, and a place that repeats is then of one frame
        let may_be_held = are_balls && !shot.states_noise();
        let of = |samples: &'a [Sample], step: f64| {
            let least = grid::rounding(step);
            // noise that lasts adds up over so many frames
            let alike = shot.frames_alike();
            let frame = |(sample, repeats): (&'a Sample, [f64; 2])| {
                let repeats = repeats.map(|repeats| repeats * alike);
                let sd = sample.sd.unwrap_or([sd; 2]);
                Frame { sample, sd: [0, 1].map(|i| sd[i].max(least) * repeats[i].sqrt()), repeats }
            };
            let repeats = grid::repeats(samples, noise.max(least), step, may_be_held);
            samples.iter().zip(repeats).map(frame).collect()
        };
        let [first, second] = shot.resolution;
        Self { of: [of(&shot.cue, first), of(&shot.object, second)] }
    }

    /// Those between two times, without those at the instants that are wrong.
    pub(crate) fn between(&self, [from, to]: [f64; 2], wrong: [&[f64]; 2]) -> Self {
        let of = |body: usize| {
            let used = |frame: &&Frame| {
                (from..=to).contains(&frame.sample.t) && !wrong[body].contains(&frame.sample.t)
            };
            self.of[body].iter().filter(used).copied().collect()
        };
        Self { of: [0, 1].map(of) }
    }

    /// How many coordinates there are.
    pub(crate) fn count(&self) -> usize {
        2 * (self.of[0].len() + self.of[1].len())
    }

    /// How many of them tell something of their own: those that repeat one error count once.
    pub(crate) fn independent(&self) -> usize {
        let frames = self.of.iter().flatten();
        frames.flat_map(|frame| frame.repeats).map(f64::recip).sum::<f64>().round() as usize
    }

    /// Calls `each` for x and y of the first body's frames, then of the second's, with the row of the coordinate. `place`: where a body (0 or
    /// 1) is at a time.
    fn coordinates<T>(
        &self,
        place: impl Fn(usize, f64) -> [T; 2],
        mut each: impl FnMut(usize, &Coordinate<T>),
    ) {
        let mut row = 0;
        for (body, frames) in self.of.iter().enumerate() {
            for Frame { sample, sd, .. } in frames {
                let [x, y] = place(body, sample.t);
                each(row, &Coordinate { predicted: x, measured: sample.x, sd: sd[0] });
                each(row + 1, &Coordinate { predicted: y, measured: sample.y, sd: sd[1] });
                row += 2;
            }
        }
    }

    /// (predicted − measured)/sd: x and y of the first body's frames, then of the second's.
    pub(crate) fn residuals(&self, place: impl Fn(usize, f64) -> [f64; 2]) -> DVector<f64> {
        let mut residuals = DVector::zeros(self.count());
        self.coordinates(place, |row, of| residuals[row] = (of.predicted - of.measured) / of.sd);
        residuals
    }

    /// A movement of the bodies (body, time → x and y, m) in standard deviations, in the same order.
    pub(crate) fn over_sd(&self, moves: impl Fn(usize, f64) -> [f64; 2]) -> DVector<f64> {
        let mut parts = DVector::zeros(self.count());
        self.coordinates(moves, |row, of| parts[row] = of.predicted / of.sd);
        parts
    }

    /// The residuals with the derivatives, in `columns` columns of which the first N are told.
    pub(crate) fn with_derivatives<const N: usize>(
        &self,
        columns: usize,
        place: impl Fn(usize, f64) -> [DualSVec64<N>; 2],
    ) -> (DVector<f64>, DMatrix<f64>) {
        let mut residuals = DVector::zeros(self.count());
        let mut jacobian = DMatrix::zeros(self.count(), columns);
        self.coordinates(place, |row, of| {
            residuals[row] = (of.predicted.re - of.measured) / of.sd;
            if let Some(gradient) = &of.predicted.eps.0 {
                for (column, derivative) in gradient.iter().enumerate() {
                    jacobian[(row, column)] = derivative / of.sd;
                }
            }
        });
        (residuals, jacobian)
    }
}
