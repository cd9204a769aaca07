//! One least-squares fit of the frames of a shot between two times, through the instant of impact: the same for two balls on a cloth and
//! for two discs, whose motions are [`Paths`].

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector, SVector};

use super::unusable::{Bodies, Unusable};
use super::wrong_frames::{alone, off_the_fit};
use crate::measurement::track::TrackShot;
use crate::numerics::least_squares;
use crate::numerics::least_squares::{Bounds, Options};
use crate::trajectory::frames::Frames;

/// Rounds of leaving out wrong frames.
const ROUNDS: usize = 4;

/// A fit stops within some hundredths of a standard error of the minimum.
const ORTHOGONALITY: f64 = 3e-3;
const MAX_ITERATIONS: u32 = 100;

/// Neighbouring residuals are taken to be correlated by no more than this.
const MOST_REPEATED: f64 = 0.95;

/// Even next to the impact, χ²/dof above this is no collision.
pub(crate) const HOPELESS: f64 = 10.0;

/// So many frames on either side of the impact are enough to begin with.
pub(crate) const FIRST: usize = 8;

/// The instant of impact is the first unknown of all paths, s.
pub(crate) const TIME: usize = 0;

/// How two bodies move through an impact, by N unknowns.
pub(crate) trait Paths<const N: usize>: Sized {
    const BODIES: Bodies;

    /// Whether bodies wobble about their paths, so that what a fit leaves next to the impact is usual, and is alike from frame to frame.
    const WOBBLES: bool;

    /// By so much may a body accelerate before and after the impact, m/s².
    const ACCELERATION: f64;

    /// (predicted − measured)/sd of the frames.
    fn residuals(&self, frames: &Frames, z: &SVector<f64, N>) -> DVector<f64>;

    /// The same with the derivatives by the unknowns.
    fn with_derivatives(&self, frames: &Frames, z: &SVector<f64, N>) -> (DVector<f64>, DMatrix<f64>);

    /// What is free and what is known beforehand, of unknowns near these.
    fn freedom(&self, near: &SVector<f64, N>) -> Result<Freedom<N>, Unusable>;

    /// [`Paths::freedom`] may depend on the unknowns, and needs at least so many rounds to follow them.
    fn rounds(&self) -> usize {
        0
    }

    /// From when on the bodies are on their paths after an impact at a time, s.
    fn settled(&self, impact: f64) -> f64 {
        impact
    }

    /// How many frames on either side of the impact are enough to begin with.
    fn first_frames(&self) -> usize {
        FIRST
    }

    /// Why the motion next to the impact is no collision, where it is none. Asked where the fit leaves far more than the noise.
    fn misfits(tracked: &Tracked<Self, N>, fitted: &Fitted<N>) -> Option<Unusable>;
}

/// What a fit may change.
pub(crate) struct Freedom<const N: usize> {
    pub start: SVector<f64, N>,
    pub free: Vec<usize>,
    /// Unknown, mean, standard deviation.
    pub priors: Vec<(usize, f64, f64)>,
    /// Of all unknowns.
    pub bounds: [SVector<f64, N>; 2],
}

/// A shot with all that its fits share.
pub(crate) struct Tracked<'a, P, const N: usize> {
    pub shot: &'a TrackShot,
    pub paths: P,
    /// Noise from second differences, m.
    pub noise: f64,
    /// Instants of the frames of either body that fit none of their neighbours.
    alone: [Vec<f64>; 2],
    /// What stands for the noise where the track gives none: stated, else from second differences.
    pub sd: f64,
    /// All frames of the shot.
    all: Frames<'a>,
}

/// A fit of the frames between two times.
pub(crate) struct Fitted<const N: usize> {
    pub z: SVector<f64, N>,
    /// First and last instant, s.
    pub window: [f64; 2],
    /// Instants of the frames of either body left out as wrong.
    pub wrong: [Vec<f64>; 2],
    pub chi2: f64,
    pub dof: usize,
    pub converged: bool,
    pub termination: String,
    /// The unknowns that it changed, and the derivatives by them.
    pub free: Vec<usize>,
    pub jacobian: DMatrix<f64>,
    /// Of each body before and after the impact.
    pub frames: [[usize; 2]; 2],
}

/// How well a fit determines its free unknowns.
pub(crate) struct Errors {
    /// (JᵀJ)⁻¹, as if the frames' standard deviations were right.
    pub inverse: DMatrix<f64>,
    /// What variances are over that: noise that is not stated is estimated from the residuals.
    pub factor: f64,
}

impl<const N: usize> Fitted<N> {
    pub(crate) fn time(&self) -> f64 {
        self.z[TIME]
    }

    pub(crate) fn reduced(&self) -> f64 {
        self.chi2 / self.dof.max(1) as f64
    }

    pub(crate) fn outliers(&self) -> usize {
        self.wrong.iter().map(Vec::len).sum()
    }

    /// Whether it converged.
    ///
    /// # Errors
    /// Why not.
    pub(crate) fn converged(&self) -> Result<(), Unusable> {
        if self.converged { Ok(()) } else { Err(Unusable::NotConverged(self.termination.clone())) }
    }
}

impl<'a, const N: usize, P: Paths<N>> Tracked<'a, P, N> {
    /// `noise` is that of a coordinate, m.
    pub(crate) fn new(shot: &'a TrackShot, paths: P, noise: f64) -> Self {
        let alone = [&shot.cue, &shot.object].map(|samples| alone(samples, noise, P::ACCELERATION));
        let sd = shot.position_sd.unwrap_or(noise);
        let all = Frames::of(shot, sd, noise, P::BODIES == Bodies::Balls);
        Self { shot, paths, noise, alone, sd, all }
    }

    /// Without the frames inside these times.
    pub(crate) fn outside(mut self, [from, to]: [f64; 2]) -> Self {
        for frames in &mut self.all.of {
            frames.retain(|frame| !(frame.sample.t > from && frame.sample.t < to));
        }
        self
    }

    /// Fits the frames between two instants, without those that stand out alone.
    pub(crate) fn fit(&self, start: &SVector<f64, N>, window: [f64; 2]) -> Result<Fitted<N>, Unusable> {
        let [from, to] = window;
        let mut wrong = self.alone.clone();
        let mut z = *start;
        let all = self.all.between(window, [&[], &[]]);
        for round in 0.. {
            let frames = self.without(window, &wrong);
            let fitted = self.fit_frames(&z, &frames, window)?;
            z = fitted.z;
            let residuals = self.paths.residuals(&all, &z);
            let now = off_the_fit(&all, residuals.as_slice(), self.noise / self.sd);
            let same = now.iter().zip(&wrong).all(|(now, before)| now.iter().all(|t| before.contains(t)))
                && (all.count() - frames.count()) / 2 == now.iter().map(Vec::len).sum::<usize>();
            if (same && round >= self.paths.rounds()) || round == ROUNDS {
                let inside =
                    |wrong: Vec<f64>| wrong.into_iter().filter(|t| (from..=to).contains(t)).collect();
                return Ok(Fitted { wrong: wrong.map(inside), ..fitted });
            }
            wrong = now;
        }
        Err(Unusable::NoCollision(P::BODIES))
    }

    fn fit_frames(
        &self,
        start: &SVector<f64, N>,
        frames: &Frames,
        window: [f64; 2],
    ) -> Result<Fitted<N>, Unusable> {
        let Freedom { start, free, priors, bounds } = self.paths.freedom(start)?;
        let of_free =
            |all: &SVector<f64, N>| DVector::from_iterator(free.len(), free.iter().map(|i| all[*i]));
        let bounds = Bounds::new(of_free(&bounds[0]), of_free(&bounds[1]));
        let x = bounds.clamp(&of_free(&start));
        let problem = || Problem { frames, paths: &self.paths, start, free: &free, priors: &priors };
        let options = Options { orthogonality: ORTHOGONALITY, max_iterations: MAX_ITERATIONS };
        // where a landing or the impact itself crosses a frame, the residuals have a kink
        let (solution, converged) = least_squares::minimise_with_restart(problem, &x, &bounds, &options)
            .map_err(|error| Unusable::NotConverged(error.to_string()))?;
        let z = problem().unknowns(&solution.x);
        Ok(Fitted {
            z,
            window,
            wrong: Default::default(),
            chi2: 2.0 * solution.cost,
            dof: problem().dof(),
            converged,
            termination: solution.termination.to_string(),
            jacobian: solution.jacobian,
            frames: sides(frames, z[TIME]),
            free,
        })
    }

    /// How well a fit determines its free unknowns.
    ///
    /// # Errors
    /// It does not.
    pub(crate) fn errors(&self, fitted: &Fitted<N>) -> Result<Errors, Unusable> {
        let factor = if self.states_noise() { 1.0 } else { fitted.reduced() };
        let r = fitted.jacobian.clone().qr().r();
        let inverse = r
            .solve_upper_triangular(&DMatrix::identity(r.ncols(), r.ncols()))
            .ok_or_else(|| Unusable::NotConverged("its unknowns are not determined".to_string()))?;
        let inverse = &inverse * inverse.transpose();
        // symmetric, whatever the roundings
        let inverse = 0.5 * (&inverse + inverse.transpose());
        Ok(Errors { inverse, factor: factor * self.wobble(fitted) })
    }

    /// χ² per degree of freedom with the noise that second differences show, where more was not stated: what the
    /// motion is judged by.
    pub(crate) fn misfit(&self, fitted: &Fitted<N>) -> f64 {
        fitted.reduced() * (self.sd / self.noise).powi(2).min(1.0)
    }

    pub(crate) fn states_noise(&self) -> bool {
        self.shot.states_noise()
    }

    /// The standard deviation of a coordinate, m: stated, or as a fit shows it.
    pub(crate) fn position_sd(&self, fitted: &Fitted<N>) -> f64 {
        self.sd * if self.states_noise() { 1.0 } else { fitted.reduced().sqrt() }
    }

    /// The frames that a fit used.
    pub(crate) fn frames(&self, fitted: &Fitted<N>) -> Frames<'a> {
        self.without(fitted.window, &fitted.wrong)
    }

    /// What a fit leaves of either body's frames: x and y in the order of time, in standard deviations.
    pub(crate) fn residuals(&self, fitted: &Fitted<N>) -> [Vec<f64>; 2] {
        let frames = self.frames(fitted);
        let mut first = self.paths.residuals(&frames, &fitted.z).as_slice().to_vec();
        let second = first.split_off(2 * frames.of[0].len());
        [first, second]
    }

    /// So much larger than those of independent errors are variances where bodies wobble about their paths, or a push is not quite over.
    fn wobble(&self, fitted: &Fitted<N>) -> f64 {
        if !P::WOBBLES {
            return 1.0;
        }
        let sides = self.residuals(fitted).into_iter().zip(fitted.frames).flat_map(|(all, [before, _])| {
            let (before, after) = all.split_at(2 * before);
            [before, after].map(|side| [0, 1].map(|k| side.iter().copied().skip(k).step_by(2).collect()))
        });
        repeated(&sides.flatten().collect::<Vec<Vec<f64>>>())
    }

    /// That no single collision explains the motion.
    pub(crate) fn bad_fit(&self, fitted: &Fitted<N>) -> Unusable {
        let rms_mm = 1e3 * fitted.reduced().sqrt() * self.sd;
        Unusable::BadFit { reduced_chi2: self.misfit(fitted), rms_mm }
    }

    /// The frames between two instants but for those that are wrong.
    fn without(&self, window: [f64; 2], wrong: &[Vec<f64>; 2]) -> Frames<'a> {
        self.all.between(window, wrong.each_ref().map(Vec::as_slice))
    }
}

/// Of each body before and after the impact.
fn sides(frames: &Frames, time: f64) -> [[usize; 2]; 2] {
    frames.of.each_ref().map(|frames| {
        let before = frames.iter().filter(|frame| frame.sample.t < time).count();
        [before, frames.len() - before]
    })
}

/// (1 + ρ)/(1 − ρ), ρ the correlation of neighbouring residuals in runs of them.
pub(crate) fn repeated(runs: &[Vec<f64>]) -> f64 {
    let products: f64 = runs.iter().flat_map(|run| run.windows(2).map(|two| two[0] * two[1])).sum();
    let squares: f64 = runs.iter().flatten().map(|r| r * r).sum();
    let rho = if squares > 0.0 { (products / squares).clamp(0.0, MOST_REPEATED) } else { 0.0 };
    (1.0 + rho) / (1.0 - rho)
}

/// The least-squares problem in the free unknowns.
struct Problem<'a, P, const N: usize> {
    frames: &'a Frames<'a>,
    paths: &'a P,
    start: SVector<f64, N>,
    free: &'a [usize],
    priors: &'a [(usize, f64, f64)],
}

impl<P, const N: usize> Problem<'_, P, N> {
    fn unknowns(&self, x: &DVector<f64>) -> SVector<f64, N> {
        let mut z = self.start;
        for (i, value) in self.free.iter().zip(x.iter()) {
            z[*i] = *value;
        }
        z
    }

    fn dof(&self) -> usize {
        (self.frames.independent() + self.priors.len()).saturating_sub(self.free.len())
    }
}

impl<P: Paths<N>, const N: usize> Operator for Problem<'_, P, N> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        let z = self.unknowns(x);
        let residuals = self.paths.residuals(self.frames, &z);
        let priors = self.priors.iter().map(|(i, mean, sd)| (z[*i] - mean) / sd);
        let all = residuals.iter().copied().chain(priors);
        Ok(DVector::from_iterator(residuals.len() + self.priors.len(), all))
    }
}

impl<P: Paths<N>, const N: usize> Jacobian for Problem<'_, P, N> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        let (residuals, full) = self.paths.with_derivatives(self.frames, &self.unknowns(x));
        let mut jacobian = DMatrix::zeros(residuals.len() + self.priors.len(), self.free.len());
        for (column, i) in self.free.iter().enumerate() {
            jacobian.view_mut((0, column), (full.nrows(), 1)).copy_from(&full.column(*i));
            for (row, (prior, _, sd)) in self.priors.iter().enumerate() {
                if prior == i {
                    jacobian[(residuals.len() + row, column)] = 1.0 / sd;
                }
            }
        }
        Ok(jacobian)
    }
}
