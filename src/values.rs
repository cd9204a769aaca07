//! Values of all parameters of a fit: the coefficients of a collision, and b and c of a friction that falls with the
//! slip.

use std::ops::{Index, IndexMut};

use crate::collision::{Coefficients, Model};
use crate::friction::Law;
use crate::parameters::{Parameter, Settings};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Values {
    pub coefficients: Coefficients,
    /// Of μ(v) = a + b exp(−c v), where the friction falls; c in s/m.
    pub b: f64,
    pub c: f64,
}

impl Values {
    /// Where a fit starts.
    #[must_use]
    pub fn initial(settings: &Settings) -> Self {
        let of = |parameter: Parameter| settings[parameter].initial;
        Self {
            coefficients: Coefficients {
                mu: of(Parameter::Mu),
                mu_s: of(Parameter::MuS),
                e: of(Parameter::E),
            },
            b: of(Parameter::B),
            c: of(Parameter::C),
        }
    }

    /// The model with these b and c, if its friction falls.
    #[must_use]
    pub fn model(&self, model: &Model) -> Model {
        let law = match model.law {
            Law::Constant => Law::Constant,
            Law::Exponential { .. } => Law::Exponential { b: self.b, c: self.c },
        };
        Model { law, ..*model }
    }

    /// With one of them changed.
    #[must_use]
    pub fn with(mut self, parameter: Parameter, value: f64) -> Self {
        self[parameter] = value;
        self
    }
}

/// With a friction that does not fall.
impl From<Coefficients> for Values {
    fn from(coefficients: Coefficients) -> Self {
        Self { coefficients, b: 0.0, c: 0.0 }
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
        }
    }
}
