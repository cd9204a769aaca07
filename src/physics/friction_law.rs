//! The friction between the balls as a function of their slip.

/// A friction law: μ at a slip speed v = |v_∥| in m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Friction {
    /// The same μ at every slip.
    Constant(f64),
    /// μ(v) = a + b exp(−c v), with v in m/s: a at a large slip, a + b where the slip ends
    /// (D. Alciatore, TP A-14, fitted to W. Marlow's measurements).
    Exponential {
        /// The friction at a large slip, dimensionless.
        a: f64,
        /// By how much the friction is larger without slip, dimensionless.
        b: f64,
        /// How fast the friction falls with the slip, s/m.
        c: f64,
    },
}

impl Friction {
    /// The friction μ at slip speed `v`, m/s.
    #[must_use]
    pub fn mu(&self, v: f64) -> f64 {
        match *self {
            Self::Constant(mu) => mu,
            // μ(v) = a + b exp(−c v)
            Self::Exponential { a, b, c } => a + b * (-c * v).exp(),
        }
    }

    /// The derivative dμ/dv at slip speed `v` (m/s), in s/m.
    #[must_use]
    pub fn slope(&self, v: f64) -> f64 {
        match *self {
            Self::Constant(_) => 0.0,
            Self::Exponential { b, c, .. } => -b * c * (-c * v).exp(),
        }
    }

    /// The largest friction at any slip.
    #[must_use]
    pub fn largest(&self) -> f64 {
        match *self {
            Self::Constant(mu) => mu,
            Self::Exponential { a, b, .. } => a + b.max(0.0),
        }
    }

    /// Whether the friction depends on the slip.
    #[must_use]
    pub fn falls(&self) -> bool {
        matches!(self, Self::Exponential { b, c, .. } if *b != 0.0 && *c != 0.0)
    }
}

/// How the friction between the balls changes with their slip, where μ itself is given apart, as in
/// [`Coefficients`](super::collision::Coefficients).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Law {
    /// μ is the same at every slip.
    #[default]
    Constant,
    /// μ(v) = μ + b exp(−c v): the given μ is the a of [`Friction::Exponential`].
    Exponential {
        /// By how much the friction is larger without slip, dimensionless.
        b: f64,
        /// How fast the friction falls with the slip, s/m.
        c: f64,
    },
}

impl Law {
    /// The friction as a function of the slip, for the given μ.
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
