//! Choices of a comparison.

use super::quantity::Quantity;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::physics::collision::FidelityChoice;

/// Choices of a comparison. The default is what `caromfit compare` does; state what you want, and the rest as
/// `..Options::default()`.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// How closely collisions are modelled.
    pub fidelity: FidelityChoice,
    /// How outlying shots count; `None`: as the data sets state.
    pub loss: Option<Loss>,
    /// The quantities that have one value for all data sets instead of the default.
    pub share: Vec<Quantity>,
    /// The quantities that have a value for each label instead of the default.
    pub per_dataset: Vec<Quantity>,
    /// Whether one camera, which did not move, filmed all data sets: its corrections are then the same. Only with the frames.
    pub same_camera: bool,
}

impl Options {
    /// Returns whether a quantity has a value for each label: as asked for, else by what the labels can
    /// differ in, which are cloths or not. A cloth has no part in what happens between the balls.
    #[must_use]
    pub fn is_apart(&self, quantity: Quantity, by_cloth: bool) -> bool {
        let by_default = match quantity {
            Quantity::Parameter(Parameter::MuS) | Quantity::Sliding => by_cloth,
            Quantity::Parameter(Parameter::Mu | Parameter::B) => !by_cloth,
            Quantity::Parameter(_) => false,
        };
        !self.share.contains(&quantity) && (by_default || self.per_dataset.contains(&quantity))
    }
}
