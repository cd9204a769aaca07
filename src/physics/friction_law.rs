//! The friction between the balls as a function of their slip.

/// The dependence of the friction between the balls on their slip v, besides μ itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Law {
    /// μ is the same at every slip.
    #[default]
    Constant,
    /// μ(v) = μ + b exp(−c v), with v in m/s: μ at a large slip, μ + b at the end of the slip (D.
    /// Alciatore, TP A-14, fitted to W. Marlow's measurements).
    Exponential {
        /// The additional friction without slip, dimensionless.
        b: f64,
        /// The rate at which it decreases with the slip, s/m.
        c: f64,
    },
}

impl Law {
    /// Returns b and c; both are 0 for a constant friction.
    #[inline]
    pub fn numbers(self) -> [f64; 2] {
        match self {
            Self::Constant => [0.0; 2],
            Self::Exponential { b, c } => [b, c],
        }
    }

    /// Returns the friction at the slip `v` in m/s, if it is `mu` at a large slip.
    pub fn mu(self, mu: f64, v: f64) -> f64 {
        let [b, c] = self.numbers();
        mu + b * (-c * v).exp()
    }
}
