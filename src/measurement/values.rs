//! Values of all parameters of a fit: the coefficients of a collision, and what else its outcome depends on.

use std::ops::{Index, IndexMut};

use super::parameter::{Parameter, Setting, Settings};
use crate::physics::ball::Ball;
use crate::physics::collision::{Coefficients, Model};
use crate::physics::friction_law::Law;

/// The value of each parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values {
    /// μ, μ_s and e.
    pub coefficients: Coefficients,
    /// b of μ(v) = a + b exp(−c v), dimensionless; 0 for a friction that does not fall with the slip v.
    pub b: f64,
    /// c of the same law, s/m.
    pub c: f64,
    /// The tangential compliance κ, dimensionless; 0 for a contact that is rigid along its surface.
    pub kappa: f64,
    /// m_cue/m_object.
    pub mass_ratio: f64,
    /// R_cue/R_object.
    pub radius_ratio: f64,
    /// e₁ of e(v) = e − e₁v, s/m; 0 for a restitution that does not fall with the closing speed v.
    pub e_slope: f64,
}

/// A contact is computed as giving way at least so far while κ is fitted: 0 is another model, whose outcome this one's nears as √κ.
const LEAST_KAPPA: f64 = 1e-3;

impl Values {
    /// What parameters that are not fitted are held at: those that are fixed, and those that the data say nothing of.
    #[must_use]
    pub fn initial(settings: &Settings) -> Self {
        Self::each(|parameter| settings[parameter].initial)
    }

    /// Usual values within the bounds, and fixed parameters where they are fixed: where a search begins, whatever the
    /// initial values are.
    #[must_use]
    pub fn usual(settings: &Settings) -> Self {
        Self::each(|parameter| {
            let Setting { initial, lower, upper, fixed, .. } = settings[parameter];
            if fixed { initial } else { parameter.default_setting().initial.clamp(lower, upper) }
        })
    }

    fn each(of: impl Fn(Parameter) -> f64) -> Self {
        Self {
            coefficients: Coefficients {
                mu: of(Parameter::Mu),
                mu_s: of(Parameter::MuS),
                e: of(Parameter::E),
            },
            b: of(Parameter::B),
            c: of(Parameter::C),
            kappa: of(Parameter::Kappa),
            mass_ratio: of(Parameter::MassRatio),
            radius_ratio: of(Parameter::RadiusRatio),
            e_slope: of(Parameter::ESlope),
        }
    }

    /// The values of a model with these coefficients.
    #[must_use]
    pub fn of(model: &Model, coefficients: Coefficients) -> Self {
        let (b, c) = match model.law {
            Law::Constant => (0.0, 0.0),
            Law::Exponential { b, c } => (b, c),
        };
        let (mass_ratio, radius_ratio) = (model.mass_ratio(), model.radius_ratio());
        let e_slope = model.e_slope.unwrap_or(0.0);
        Self { coefficients, b, c, kappa: model.kappa, mass_ratio, radius_ratio, e_slope }
    }

    /// These values with little friction, with that which they have, and with much, as far as bounds allow: what no
    /// observation depends on at any of them none depends on at all. With much friction every contact sticks, with little
    /// all slide.
    #[must_use]
    pub fn across_friction(&self, settings: &Settings) -> [Self; 3] {
        /// Of the way from the lower bound to the upper one.
        const LITTLE: f64 = 1e-3;
        let at = |part: f64| {
            let mut values = *self;
            for parameter in [Parameter::Mu, Parameter::B] {
                let Setting { lower, upper, fixed, .. } = settings[parameter];
                if !fixed {
                    values[parameter] = lower + part * (upper - lower);
                }
            }
            values
        };
        [at(LITTLE), *self, at(1.0)]
    }

    /// The model with these b and c, if its friction falls, this κ, if its contact gives way, these ratios, if its balls are not
    /// equal, and this e₁, if its e falls.
    #[must_use]
    pub fn model(&self, model: &Model) -> Model {
        let law = match model.law {
            Law::Constant => Law::Constant,
            Law::Exponential { .. } => Law::Exponential { b: self.b, c: self.c },
        };
        let kappa = if model.kappa > 0.0 { self.kappa.max(LEAST_KAPPA) } else { 0.0 };
        let object = model.object.map(|object| Ball {
            mass: model.ball.mass / self.mass_ratio,
            radius: model.ball.radius / self.radius_ratio,
            ..object
        });
        let e_slope = model.e_slope.map(|_| self.e_slope);
        Model { object, law, e_slope, kappa, ..*model }
    }

    /// The same values with one of them changed.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self[parameter] = value;
        self
    }
}

/// With a friction and an e that do not fall, between equal balls that are rigid along their surface.
impl From<Coefficients> for Values {
    fn from(coefficients: Coefficients) -> Self {
        Self { coefficients, b: 0.0, c: 0.0, kappa: 0.0, mass_ratio: 1.0, radius_ratio: 1.0, e_slope: 0.0 }
    }
}

impl Index<Parameter> for Values {
    type Output = f64;

    fn index(&self, parameter: Parameter) -> &f64 {
        match parameter {
            Parameter::Mu => &self.coefficients.mu,
            Parameter::MuS => &self.coefficients.mu_s,
            Parameter::E => &self.coefficients.e,
            Parameter::B => &self.b,
            Parameter::C => &self.c,
            Parameter::Kappa => &self.kappa,
            Parameter::MassRatio => &self.mass_ratio,
            Parameter::RadiusRatio => &self.radius_ratio,
            Parameter::ESlope => &self.e_slope,
        }
    }
}

impl IndexMut<Parameter> for Values {
    fn index_mut(&mut self, parameter: Parameter) -> &mut f64 {
        match parameter {
            Parameter::Mu => &mut self.coefficients.mu,
            Parameter::MuS => &mut self.coefficients.mu_s,
            Parameter::E => &mut self.coefficients.e,
            Parameter::B => &mut self.b,
            Parameter::C => &mut self.c,
            Parameter::Kappa => &mut self.kappa,
            Parameter::MassRatio => &mut self.mass_ratio,
            Parameter::RadiusRatio => &mut self.radius_ratio,
            Parameter::ESlope => &mut self.e_slope,
        }
    }
}
