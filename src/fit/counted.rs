//! What χ², degrees of freedom and residuals count.

use super::Fit;
use crate::measurement::observable::Observable;
use crate::measurement::written::written_by_name;
use crate::physics::name::worded;

worded! {
    /// The kind of the measured numbers whose squared residuals are summed.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Counted {
        /// Coordinates of the balls in the frames, and components of spins that markers show.
        Coordinates = "coordinates" | "the frames' coordinates",
        /// Components of velocities, and of spins, after the impact.
        Velocities = "velocities" | "the velocities",
        /// Angles, speeds and their ratios.
        Angles = "angles" | "the angles and speeds",
        /// Of discs: the restitution and the ratio of the impulses of each shot.
        Impulses = "impulses" | "e and J_t/J_n of the shots",
    }
    /// The name in fit.json.
    pub fn name;
    /// The name in a sentence.
    pub fn words;
}

written_by_name!(Counted);

impl Counted {
    /// The kind of some observables.
    pub(crate) fn of<'a>(observables: impl Iterator<Item = &'a Observable>) -> Self {
        let mut kind = Self::Angles;
        for observable in observables {
            if Observable::IMPACTS.contains(observable) {
                return Self::Velocities;
            }
            if Observable::DISCS.contains(observable) {
                kind = Self::Impulses;
            }
        }
        kind
    }
}

impl Fit {
    /// The kind of the numbers that `chi2` and `dof` count.
    #[must_use]
    pub fn counted(&self) -> Counted {
        let is_film = self.frames.is_some() || self.camera.is_some();
        if is_film { Counted::Coordinates } else { self.tested() }
    }

    /// The kind of the numbers that `residuals` lists and [`super::Goodness`] tests.
    #[must_use]
    pub fn tested(&self) -> Counted {
        Counted::of(self.residuals.iter().map(|residual| &residual.observable))
    }
}
