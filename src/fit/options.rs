//! Choices of a fit that are not part of the data set.

use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Parameter, Setting, Settings};
use crate::physics::collision::{Fidelity, MAX_TOLERANCE, MIN_TOLERANCE, Model};

/// Choices of a fit that are not part of the data set. The default is what `caromfit fit` does.
///
/// All fields are public: write `..Options::default()` behind those that you state, so that a
/// choice that is added later does not break your code.
///
/// ```
/// use caromfit::fit::{Depth, Options};
///
/// // some hundred times as fast: estimates and errors from the curvature of χ² alone
/// let options = Options { depth: Depth::Estimates, seed: 7, ..Options::default() };
/// assert!(options.faults().is_empty());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// How closely collisions are modelled; `None`: `full`, with a compliant contact and the weight
    /// of the balls if the data show them.
    pub fidelity: Option<Fidelity>,
    /// How the friction between the balls decreases with the slip.
    pub falling: Falling,
    /// The tolerance of the fidelities that integrate ([`Model::tolerance`]): in parts of the
    /// closing speed, from [`MIN_TOLERANCE`] to
    /// [`MAX_TOLERANCE`].
    pub tolerance: f64,
    /// How much the fit finds out about its own uncertainty.
    pub depth: Depth,
    /// How outlying shots count; `None`: as the data set states.
    pub loss: Option<Loss>,
    /// Number of samples of shots drawn and fitted for bootstrap intervals; 0 for no bootstrap.
    pub bootstrap: usize,
    /// The seed of all random numbers.
    pub seed: u64,
}

/// How the friction between the balls decreases with their slip v: μ(v) = a + b exp(−c v), its a
/// fitted as μ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Falling {
    /// The law that `[fit] friction` of the data set states.
    #[default]
    AsStated,
    /// The law with these values of b and c.
    Held {
        /// Difference of the friction without slip from that at large slip, dimensionless.
        b: f64,
        /// How fast the friction decreases with the slip, s/m.
        c: f64,
    },
    /// b and c are parameters of the fit, with the settings of the data set.
    Fitted,
}

impl Falling {
    /// The settings of a data set, with this instead of what they state of b and c.
    pub(crate) fn applied(self, mut settings: Settings) -> Settings {
        settings.falls |= self != Self::AsStated;
        if let Self::Held { b, c } = self {
            settings[Parameter::B] = Setting::held(b);
            settings[Parameter::C] = Setting::held(c);
        }
        settings
    }
}

/// How much a fit finds out about itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Depth {
    /// Estimates, errors from the curvature of χ², and tests of the residuals.
    Estimates,
    /// Estimates and the profiles of χ² for the intervals: some ten times as long.
    Intervals,
    /// Intervals and confidence regions of pairs of parameters: some hundred times as long.
    Everything,
}

impl Options {
    /// Returns the faults of the choices, each with its name, its value and what was expected. A
    /// fit refuses them.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        if !(MIN_TOLERANCE..=MAX_TOLERANCE).contains(&self.tolerance) {
            faults.push(format!(
                "tolerance is {:?}; expected {MIN_TOLERANCE:e} to {MAX_TOLERANCE:e}",
                self.tolerance
            ));
        }
        let law = self.falling.applied(Settings::default());
        for parameter in [Parameter::B, Parameter::C] {
            let name = parameter.name();
            let of_setting = law[parameter].faults(parameter);
            let fixed = of_setting.into_iter().filter(|fault| fault.key == format!("{name}.fixed"));
            faults.extend(fixed.map(|fault| {
                format!("{name} of a friction that decreases is {}; expected {}", fault.value, fault.expected)
            }));
        }
        faults
    }
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fidelity: None,
            falling: Falling::AsStated,
            tolerance: Model::TOLERANCE,
            depth: Depth::Everything,
            loss: None,
            bootstrap: 0,
            seed: 0,
        }
    }
}
