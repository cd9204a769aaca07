//! The request of a fit: its choices, and why it cannot be met.

use super::Rejected;
use crate::measurement::dataset::{Dataset, ON_REQUEST};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Parameter, Setting, Settings};
use crate::physics::collision::{Fidelity, Model, TOLERANCES};
use crate::problem::{FilmError, RowsError};

/// Choices of a fit that are not part of the data set. The default is what `caromfit fit` does.
/// State what you want, and the rest as `..Options::default()`.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// How closely collisions are modelled; `None`: `full`, with a compliant contact and the weight
    /// of the balls if the data show them.
    pub fidelity: Option<Fidelity>,
    /// How the friction between the balls decreases with the slip.
    pub falling: Falling,
    /// The tolerance of the fidelities that integrate ([`Model::tolerance`]): in parts of the
    /// closing speed, within [`TOLERANCES`].
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
    /// Returns the faults of the choices, which a fit refuses, with what was expected.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        if !TOLERANCES.contains(&self.tolerance) {
            let [least, most] = [TOLERANCES.start(), TOLERANCES.end()];
            faults.push(format!("tolerance is {:?}; expected {least:e} to {most:e}", self.tolerance));
        }
        let law = self.falling.applied(Settings::default());
        for parameter in [Parameter::B, Parameter::C] {
            let name = parameter.name();
            let faults_of_setting = law[parameter].faults(parameter);
            let fixed = faults_of_setting.into_iter().filter(|fault| fault.key == format!("{name}.fixed"));
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

/// Why a data set cannot be fitted. A search that does not converge is not an error:
/// [`Fit::converged`](super::Fit::converged) states it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// No shot can be used.
    #[error("{dataset}: no shot can be used{}", first_reason(.shots_rejected))]
    NoUsableShot {
        /// The name of the data set.
        dataset: String,
        /// Its shots with the reasons.
        shots_rejected: Vec<Rejected>,
    },
    /// A table cannot be fitted; with the name of the data set.
    #[error("{0}: {1}")]
    Rows(String, #[source] RowsError),
    /// The data set is wrong, as [`Dataset::faults`](crate::measurement::dataset::Dataset::faults)
    /// states it.
    #[error("{dataset}: {}", .faults.join("\n"))]
    Invalid {
        /// The name of the data set.
        dataset: String,
        /// The faults, in sentences.
        faults: Vec<String>,
    },
    /// A choice of the fit is wrong, as [`Options::faults`] states it.
    #[error("options of the fit: {}", .0.join("\n"))]
    Options(Vec<String>),
    /// The frames of a film cannot be fitted.
    #[error(
        "{0}: {1}. Check that the object ball lies still before the impact and the camera does not move, the radius, capture_fps \
             and which track is which ball"
    )]
    Film(String, #[source] FilmError),
}

impl FitError {
    /// Whether the input was wrong, rather than that it could not be fitted.
    pub fn is_bad_input(&self) -> bool {
        match self {
            Self::Invalid { .. } | Self::Options(_) => true,
            Self::Rows(_, error) => !matches!(error, RowsError::NoShot { .. } | RowsError::NoStart),
            Self::NoUsableShot { .. } | Self::Film(..) => false,
        }
    }
}

fn first_reason(rejected: &[Rejected]) -> String {
    // a shot that was left out on request needs no reason
    let first = rejected.iter().find(|r| r.reason != ON_REQUEST).or(rejected.first());
    first.map_or(String::new(), |r| format!(": shot {}: {}", r.shot, r.reason))
}

/// A data set, and how it is fitted.
#[derive(Clone, Copy)]
pub(super) struct Request<'a> {
    pub(crate) dataset: &'a Dataset,
    /// Column and label of the shots, if they are fitted separately.
    pub(crate) group: Option<&'a (String, String)>,
    pub(crate) options: &'a Options,
    /// Called after each sample of the bootstrap.
    pub(crate) done: &'a (dyn Fn() + Sync),
}

impl Request<'_> {
    /// Returns how an error names what is fitted.
    fn title(&self) -> String {
        match self.group {
            Some((column, label)) => format!("{} ({column} {label})", self.dataset.name),
            None => self.dataset.name.clone(),
        }
    }

    /// Returns the error of the fit of a table with the name of the data set.
    pub(crate) fn of_rows(&self, error: RowsError) -> FitError {
        match error {
            RowsError::NoShot { left_out } => self.without_shots(left_out),
            other => FitError::Rows(self.title(), other),
        }
    }

    /// Returns the error of the fit of a film with the name of the data set.
    pub(crate) fn of_film(&self, error: FilmError) -> FitError {
        match error {
            FilmError::NoImpact(reasons) => self.without_shots(reasons),
            other => FitError::Film(self.title(), other),
        }
    }

    fn without_shots(&self, reasons: Vec<(String, String)>) -> FitError {
        FitError::NoUsableShot { dataset: self.title(), shots_rejected: self.rejected(reasons) }
    }

    /// Returns the shots that are stated to be left out, then others, from names and reasons.
    pub(super) fn rejected(&self, others: impl IntoIterator<Item = (String, String)>) -> Vec<Rejected> {
        let stated = &self.dataset.left_out;
        let others = others.into_iter().filter(|other| !stated.contains(other));
        let all = stated.iter().cloned().chain(others);
        all.map(|(shot, reason)| Rejected { shot, reason }).collect()
    }
}
