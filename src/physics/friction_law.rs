//! The friction between the balls as a function of their slip.

/// A friction law: μ at a slip speed v = |v_∥| in m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// μ whatever the slip.
    Constant(f64),
    /// μ(v) = a + b exp(−c v): a at high speed, a + b where the slip ends, c in s/m
    /// (D. Alciatore, TP A-14, fitted to W. Marlow's measurements).
    Exponential { a: f64, b: f64, c: f64 },
}

impl Friction {
    /// Alciatore's fit to Marlow's data for clean pool balls.
    pub const ALCIATORE: Self = Self::Exponential { a: 9.951e-3, b: 0.108, c: 1.088 };

    /// μ at slip speed `v`, m/s.
    #[must_use]
    pub fn mu(&self, v: f64) -> f64 {
        match *self {
            Self::Constant(mu) => mu,
            // μ(v) = a + b exp(−c v)
            Self::Exponential { a, b, c } => a + b * (-c * v).exp(),
        }
    }

    /// dμ/dv, s/m.
    #[must_use]
    pub fn slope(&self, v: f64) -> f64 {
        match *self {
            Self::Constant(_) => 0.0,
            Self::Exponential { b, c, .. } => -b * c * (-c * v).exp(),
        }
    }

    /// Its largest value, at no slip for a friction that falls.
    #[must_use]
    pub fn largest(&self) -> f64 {
        match *self {
            Self::Constant(mu) => mu,
            Self::Exponential { a, b, .. } => a + b.max(0.0),
        }
    }

    /// Whether it depends on the slip.
    #[must_use]
    pub fn falls(&self) -> bool {
        matches!(self, Self::Exponential { b, c, .. } if *b != 0.0 && *c != 0.0)
    }
}

/// How μ changes with the slip, for a μ that is given apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Law {
    #[default]
    Constant,
    /// μ + b exp(−c v): the μ given is the a of [`Friction::Exponential`].
    Exponential { b: f64, c: f64 },
}

impl Law {
    #[must_use]
    pub fn friction(self, mu: f64) -> Friction {
        match self {
            Self::Constant => Friction::Constant(mu),
            Self::Exponential { b, c } => Friction::Exponential { a: mu, b, c },
        }
    }
}

impl From<f64> for Friction {
    fn from(mu: f64) -> Self {
        Self::Constant(mu)
    }
}
