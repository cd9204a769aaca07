//! The quantities of a comparison, and its choices.

use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::measurement::written::written_by_name;
use crate::physics::collision::Fidelity;
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
    pub fn name(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.name(),
            Self::Sliding => "mu_k",
        }
    }

    /// Returns the symbol in tables and plots.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.symbol(),
            Self::Sliding => "μ_k",
        }
    }

    /// Returns what it is, in a line.
    pub(crate) fn meaning(self) -> &'static str {
        match self {
            Self::Parameter(parameter) => parameter.meaning(),
            Self::Sliding => "friction of the cloth on a sliding ball",
        }
    }
}

// By its name or its symbol.
by_name!(Quantity, "quantity", ALL, name, symbol);
written_by_name!(Quantity);

/// Choices of a comparison. The default is what `caromfit compare` does; state what you want, and
/// the rest as `..Options::default()`.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// How closely collisions are modelled; `None` as of a fit.
    pub fidelity: Option<Fidelity>,
    /// How outlying shots count; `None`: as the data sets state.
    pub loss: Option<Loss>,
    /// The quantities that have one value for all data sets instead of the default.
    pub share: Vec<Quantity>,
    /// The quantities that have a value for each label instead of the default.
    pub per_dataset: Vec<Quantity>,
}

impl Options {
    /// Returns whether a quantity has a value for each label: as asked for, else by what the labels
    /// can differ in, which are cloths or not. A cloth has no part in what happens between the
    /// balls.
    pub(crate) fn is_separate(&self, quantity: Quantity, by_cloth: bool) -> bool {
        let by_default = match quantity {
            Quantity::Parameter(Parameter::MuS) | Quantity::Sliding => by_cloth,
            Quantity::Parameter(Parameter::Mu | Parameter::B) => !by_cloth,
            Quantity::Parameter(_) => false,
        };
        !self.share.contains(&quantity) && (by_default || self.per_dataset.contains(&quantity))
    }
}
