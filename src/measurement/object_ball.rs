//! The object ball beside the cue ball, and how well their masses and radii are known.

use super::parameter::{Parameter, Prior, Settings};
use crate::physics::ball::Ball;
use crate::physics::collision::{Fidelity, Model};

/// The standard deviation of m_cue/m_object of balls that were not weighed, as a fraction: balls of
/// one set differ by 0.5 to 3 %. With ± 1, 2 and 5 % films of 15 natural-roll shots gave the same
/// errors, as their frames determine the ratio to 0.3 %.
pub const UNWEIGHED: f64 = 0.02;

/// The standard deviation of a mass that is stated without one, kg: that of a kitchen scale, which
/// shows full grams.
pub const WEIGHED_KG: f64 = 5e-4;

/// The object ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectBall {
    /// Its radius, mass and moment of inertia.
    pub ball: Ball,
    /// The standard deviations of the cue ball's and of its own mass, kg; 0 for a mass that is
    /// exact, or whose error both balls share. `None`: the masses are not both stated, and their
    /// ratio has the standard deviation [`UNWEIGHED`].
    pub mass_sd: Option<[f64; 2]>,
    /// The standard deviations of the cue ball's and of its own radius, m; 0 for a radius that is
    /// exact, or whose error both balls share.
    pub radius_sd: [f64; 2],
}

impl ObjectBall {
    /// Returns an object ball whose properties are exact.
    #[must_use]
    pub fn exact(ball: Ball) -> Self {
        Self { ball, mass_sd: Some([0.0; 2]), radius_sd: [0.0; 2] }
    }

    /// Returns an object ball like the cue ball, as far as is known of two balls that were not
    /// weighed.
    #[must_use]
    pub fn unweighed(cue: Ball) -> Self {
        Self { mass_sd: None, ..Self::exact(cue) }
    }

    /// Returns the standard deviation of m_cue/m_object; `None` if the ratio counts as exact.
    #[must_use]
    pub fn mass_ratio_sd(&self, cue: Ball) -> Option<f64> {
        let masses = [cue.mass, self.ball.mass];
        match self.mass_sd {
            Some(sd) => sd_of_ratio(masses, sd),
            None => Some(UNWEIGHED * masses[0] / masses[1]),
        }
    }

    /// Returns the standard deviation of R_cue/R_object; `None` if the ratio counts as exact.
    #[must_use]
    pub fn radius_ratio_sd(&self, cue: Ball) -> Option<f64> {
        sd_of_ratio([cue.radius, self.ball.radius], self.radius_sd)
    }

    /// Returns the settings of a fit with the ratios of masses and radii of the balls: fixed if
    /// they are exact, else with a prior.
    #[must_use]
    pub fn settings(&self, cue: Ball, mut settings: Settings) -> Settings {
        let model = Model { object: Some(self.ball), ..Model::new(Fidelity::Full, cue) };
        for (parameter, mean, sd) in [
            (Parameter::MassRatio, model.mass_ratio(), self.mass_ratio_sd(cue)),
            (Parameter::RadiusRatio, model.radius_ratio(), self.radius_ratio_sd(cue)),
        ] {
            let setting = &mut settings[parameter];
            (setting.initial, setting.fixed) = (mean, sd.is_none());
            setting.prior = sd.map(|sd| Prior { mean, sd });
        }
        settings
    }
}

/// Returns the standard deviation of the ratio of two values with these errors; `None` if both are
/// exact.
fn sd_of_ratio([first, second]: [f64; 2], sd: [f64; 2]) -> Option<f64> {
    let sd = first / second * (sd[0] / first).hypot(sd[1] / second);
    (sd != 0.0).then_some(sd)
}
