//! The camera that balls and discs calibrate: they touch at the same distance in every direction
//! and everywhere in the picture, and move as the cloth lets them.

use minijinja::context;

use super::film_words::words_of;
use crate::measurement::correction::Correction;
use crate::problem::{Camera, Finding, Id, Solution};

/// A correction as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub(crate) struct FoundCorrection {
    /// Which correction it is; the axis of a lens stands for its decentring.
    pub(crate) which: Correction,
    /// Its value, as a correction of what the data set states, in the unit that
    /// [`Correction::words`] names: a scale that was wrong by a factor has that factor.
    pub(crate) value: f64,
    /// Its standard error, in the same unit.
    pub(crate) std_error: f64,
}

/// The camera as the shots of a film show it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundCamera {
    /// The middle of the film, x and y in m, from which the camera counts.
    pub(crate) middle: [f64; 2],
    picture: Camera,
    /// Its corrections that were free.
    pub(crate) corrections: Vec<FoundCorrection>,
    /// The factor by which all lengths were multiplied before the fit, the unit of the film in m; 1
    /// if the stated one was right to a tenth.
    pub(crate) unit: f64,
    /// How many shots it was found from.
    pub(crate) shots: usize,
    pub(crate) converged: bool,
    /// The correlation of the noise of neighbouring frames; `None` if the frames do not determine
    /// it.
    pub(crate) noise_correlation: Option<f64>,
    /// The number of shots in which frames were dropped without a sign in their numbers, and the
    /// number of such drops.
    pub(crate) drops: [usize; 2],
    /// How many frames before and after the impacts were left out, as their positions are off in
    /// all shots; the first of each is less than half a frame away.
    pub(crate) spoiled: Option<[usize; 2]>,
}

impl FoundCamera {
    /// Returns the camera as the fit of a film has it.
    pub(super) fn of_film(solution: &Solution) -> Self {
        // both lists have the same order
        let unknown_of = |which: Correction| Id::ALL[Id::Scale as usize + which as usize];
        let correction = |which: Correction| {
            let found = solution.get(unknown_of(which))?;
            Some(FoundCorrection { which, value: found.value, std_error: found.std_error? })
        };
        let shots = solution.names.first().map_or(0, Vec::len);
        let noise = solution.frame_noise().map(|noises| noises[1].rho);
        let findings = || solution.findings.iter();
        let drops = findings().find_map(|finding| match *finding {
            Finding::Drops { shots, drops } => Some([shots, drops]),
            _ => None,
        });
        let spoiled = findings().find_map(|finding| match *finding {
            Finding::Spoiled { before, after } => Some([before, after]),
            _ => None,
        });
        Self {
            middle: solution.middle.map(|x| x * solution.unit),
            picture: Camera::new(&solution.state().shared),
            corrections: Correction::ALL.into_iter().filter_map(correction).collect(),
            unit: solution.unit,
            shots,
            converged: solution.converged,
            noise_correlation: noise.filter(|rho| *rho > 0.0),
            drops: drops.unwrap_or_default(),
            spoiled,
        }
    }

    /// Returns the value of a correction, stated or found; of the axis of a lens that of its
    /// decentring.
    #[must_use]
    pub fn get(&self, correction: Correction) -> f64 {
        self.picture.get(correction as usize)
    }

    /// Returns the corrections as a sentence; `None` if all were held.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let corrections = self.corrections.iter();
        let corrections: Vec<(&str, f64, f64)> =
            corrections.map(|found| (found.which.words(), found.value, found.std_error)).collect();
        let is_found = !corrections.is_empty();
        is_found.then(|| words_of("camera", context! { shots => self.shots, corrections }))
    }
}
