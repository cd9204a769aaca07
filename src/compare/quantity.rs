//! What is compared.

use crate::measurement::parameter::Parameter;
use crate::physics::name::by_name;
use crate::problem::Id;

/// A quantity that is compared: a parameter of the fit, or the cloth's sliding friction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// A parameter of the fit.
    Parameter(Parameter),
    /// The cloth's sliding friction μ_k, from the paths after the impacts.
    Sliding,
}

impl Quantity {
    /// All that can be compared, in the order in which they are reported.
    pub const ALL: [Self; 8] = [
        Self::Parameter(Parameter::Mu),
        Self::Parameter(Parameter::MuS),
        Self::Parameter(Parameter::E),
        Self::Sliding,
        Self::Parameter(Parameter::B),
        Self::Parameter(Parameter::C),
        Self::Parameter(Parameter::Kappa),
        Self::Parameter(Parameter::ESlope),
    ];

    /// Returns the unknown of a fit.
    pub(crate) fn id(self) -> Id {
        match self {
            Self::Sliding => Id::MuK,
            Self::Parameter(parameter) => Id::from(parameter),
        }
    }

    /// Returns the name on the command line and in compare.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.name(),
            Self::Sliding => "mu_k",
        }
    }

    /// Returns the symbol in tables and plots.
    #[must_use]
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.symbol(),
            Self::Sliding => "μ_k",
        }
    }

    /// Returns what it is, in a line.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.meaning(),
            Self::Sliding => "friction of the cloth on a sliding ball",
        }
    }
}

// By its name or its symbol.
by_name!(Quantity, "quantity", ALL, name, symbol);
