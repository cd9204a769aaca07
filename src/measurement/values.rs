//! Values of all parameters of a fit: the coefficients of a collision, and what else its outcome
//! depends on.

use std::ops::{Index, IndexMut};

use super::parameter::{Parameter, Setting, Settings};
use crate::physics::ball::Ball;
use crate::physics::collision::{Coefficients, MIN_FITTED_KAPPA, Model};
use crate::physics::friction_law::Law;

/// The value of each parameter, in the order of [`Parameter::ALL`]. Those of effects that a model
/// does not have are 0, those of equal balls 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values([f64; Parameter::ALL.len()]);

impl Values {
    /// Returns the values at which parameters are held that are fixed or not determined by the
    /// data.
    #[must_use]
    pub fn initial(settings: &Settings) -> Self {
        Self(settings.each.map(|setting| setting.initial))
    }

    /// Returns typical values within the bounds, with fixed parameters where they are fixed: the
    /// start of a search, independent of the initial values.
    #[must_use]
    pub fn usual(settings: &Settings) -> Self {
        Self(Parameter::ALL.map(|parameter| {
            let Setting { initial, lower, upper, fixed, .. } = settings[parameter];
            if fixed { initial } else { parameter.default_setting().initial.clamp(lower, upper) }
        }))
    }

    /// Returns μ, μ_s and e.
    #[must_use]
    pub fn coefficients(&self) -> Coefficients {
        let [mu, mu_s, e, ..] = self.0;
        Coefficients { mu, mu_s, e }
    }

    /// Returns the model with these b and c, if its friction falls, this κ, if its contact is
    /// compliant, these ratios, if its balls are not equal, and this e₁, if its e falls.
    #[must_use]
    pub fn model(&self, model: &Model) -> Model {
        let [.., b, c, kappa, mass_ratio, radius_ratio, e_slope] = self.0;
        let law = match model.law {
            Law::Constant => Law::Constant,
            Law::Exponential { .. } => Law::Exponential { b, c },
        };
        let kappa = if model.kappa > 0.0 { kappa.max(MIN_FITTED_KAPPA) } else { 0.0 };
        let Ball { mass, radius, .. } = model.ball;
        let object = model.object.map(|object| Ball {
            mass: mass / mass_ratio,
            radius: radius / radius_ratio,
            ..object
        });
        Model { object, law, e_slope: model.e_slope.map(|_| e_slope), kappa, ..*model }
    }

    /// Returns the values with one of them changed.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self[parameter] = value;
        self
    }
}

impl Index<Parameter> for Values {
    type Output = f64;

    fn index(&self, parameter: Parameter) -> &f64 {
        &self.0[parameter as usize]
    }
}

impl IndexMut<Parameter> for Values {
    fn index_mut(&mut self, parameter: Parameter) -> &mut f64 {
        &mut self.0[parameter as usize]
    }
}
