//! The ladder of models, from the cheapest to the most exact.

use super::Effects;
use crate::physics::name::{by_name, worded};

worded! {
    /// How closely the collision is modelled, from the cheapest to the most exact.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
    #[non_exhaustive]
    pub enum Fidelity {
        /// Neither friction nor loss of energy.
        Elastic = "elastic" | "no friction, no loss",
        /// Restitution without friction.
        Inelastic = "inelastic" | "restitution, no friction",
        /// The approximation of first order in μ (Kim 2024, Eqs. 50–54), in which the contact never
        /// sticks.
        Linear = "linear" | "first order in μ, no stick",
        /// The exact solution of the equations of motion, stick included.
        Full = "full" | "the exact solution, stick included",
        /// The equations of motion of [`Fidelity::Full`], or with κ those of a compliant contact,
        /// integrated to [`Model::tolerance`](super::Model::tolerance).
        Ode = "ode" | "the same equations integrated, to a tolerance",
        /// The contact resolved in time to [`Model::tolerance`](super::Model::tolerance), with
        /// gravity and the cloth's friction on both balls.
        Contact = "contact" | "the contact resolved in time, with gravity and the cloth, to a tolerance",
    }
    /// The name on the command line and in fit.json.
    pub fn name;
    /// The model in a line.
    pub fn meaning;
}

by_name!(Fidelity, "fidelity", ALL, name);

impl Fidelity {
    /// Returns whether the equations of motion are integrated step by step.
    #[must_use]
    pub fn is_integrated(self) -> bool {
        matches!(self, Self::Ode | Self::Contact)
    }

    /// Returns all effects that this fidelity can simulate.
    #[must_use]
    #[inline]
    pub fn effects(self) -> Effects {
        let inelastic = Effects { inelasticity: true, ..Effects::NONE };
        let linear = Effects { friction: true, cloth: true, ..inelastic };
        match self {
            Self::Elastic => Effects::NONE,
            Self::Inelastic => inelastic,
            Self::Linear => linear,
            Self::Full => Effects { stick: true, turning: true, falling_friction: true, ..linear },
            Self::Ode => Effects { compliance: true, ..Self::Full.effects() },
            Self::Contact => Effects::ALL,
        }
    }
}
