//! The camera that balls and discs calibrate: they touch at the same distance in every direction
//! and everywhere in the picture, and move as the cloth lets them.

use std::sync::Arc;

use minijinja::context;

use super::film_words::words_of;
use crate::measurement::correction::Correction;
use crate::measurement::dataset::{Dataset, Measured};
use crate::problem::{Camera, Id, Solution};

/// The camera as the shots of a film show it.
#[derive(Clone, Debug)]
pub struct FoundCamera {
    solution: Arc<Solution>,
    /// Step of the coarsest grid to which positions were rounded, m.
    pub(crate) resolution: f64,
}

impl FoundCamera {
    pub(super) fn of_film(solution: &Arc<Solution>, dataset: &Dataset) -> Self {
        let shots = dataset.tracks.iter().flat_map(|tracks| &tracks.shots);
        let coarsest = shots.flat_map(|shot| shot.resolution).fold(0.0, f64::max);
        Self { solution: Arc::clone(solution), resolution: coarsest * solution.record.unit }
    }

    /// Returns the corrections that were free.
    pub(crate) fn corrections(&self) -> Vec<(Correction, Measured)> {
        let correction = |which: Correction| Some((which, self.found(which)?));
        Correction::ALL.into_iter().filter_map(correction).collect()
    }

    /// Returns a correction that was free, in the unit that [`Correction::words`] names: the axis of
    /// a lens stands for its decentring, and a scale that was wrong by a factor has that factor.
    pub fn found(&self, which: Correction) -> Option<Measured> {
        // both lists have the same order
        self.solution.measured(Id::ALL[Id::Scale as usize + which as usize])
    }

    /// Returns the value of a correction, stated or found; of the axis of a lens its decentring.
    pub fn get(&self, correction: Correction) -> f64 {
        Camera::new(&self.solution.state().shared).get(correction as usize)
    }

    /// Returns the middle of the film, x and y in m, from which the corrections count.
    pub fn middle(&self) -> [f64; 2] {
        self.solution.origin()
    }

    /// Returns the unit of the film in m; 1 if the stated one was right to a tenth.
    pub fn unit(&self) -> f64 {
        self.solution.record.unit
    }

    /// Returns whether the corrections converged.
    pub fn converged(&self) -> bool {
        self.solution.converged
    }

    /// Returns the correlation of the noise of neighbouring frames, if the frames determine it.
    pub(crate) fn noise_correlation(&self) -> Option<f64> {
        Some(self.solution.problem.film()?.variation.noises[1].rho).filter(|rho| *rho > 0.0)
    }

    /// Returns the corrections as a sentence; `None` if all were held.
    pub fn sentence(&self) -> Option<String> {
        let in_words = |(which, found): (Correction, Measured)| (which.words(), found.value, found.sd);
        let corrections: Vec<_> = self.corrections().into_iter().map(in_words).collect();
        let shots = self.solution.names().len();
        (!corrections.is_empty()).then(|| words_of("camera", context! { shots, corrections }))
    }
}
