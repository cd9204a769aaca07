//! What `caromfit accuracy --json` prints.

use schemars::JsonSchema;
use serde::Serialize;

use super::{ByName, Made, finite};
use crate::measurement::written::ByParameter;
use crate::physics::collision::Fidelity;
use crate::report::unit_of;
use crate::studies::accuracy::{self, Includes, QUANTITIES};
use crate::studies::bias;

/// What caromfit accuracy --json prints
///
/// Errors against time of every fidelity, and the bias of fits. Keys may be added; none is renamed or dropped. null stands for what
/// is not known.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct AccuracyDocument {
    /// What made it.
    #[serde(flatten)]
    pub made: Made,
    /// Number of shots that were computed.
    pub shots: usize,
    /// Number of shots of the data set that could not be used.
    pub left_out: usize,
    /// Ways to compute a collision.
    pub ways: Vec<Way>,
    /// Fits to the shots without noise, computed by contact with all effects.
    pub biases: Vec<Bias>,
}

impl AccuracyDocument {
    /// Returns the document of both studies, of `shots` shots; `left_out` could not be used.
    #[must_use]
    pub fn new(rows: &[accuracy::Row], biases: &[bias::Row], shots: usize, left_out: usize) -> Self {
        let ways = rows.iter().map(Way::from).collect();
        let biases = biases.iter().map(Bias::from).collect();
        Self { made: Made::default(), shots, left_out, ways, biases }
    }
}

/// A way to compute a collision.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Way {
    /// Name of the fidelity.
    pub fidelity: Fidelity,
    /// Effects that are on: all that the fidelity has, those of full, or those of a compliant contact.
    pub effects: Includes,
    /// Tolerance of ode and contact.
    pub tolerance: Option<f64>,
    /// Duration of one collision on one core, s.
    pub seconds: f64,
    /// Number of shots that it could not compute.
    pub failed: usize,
    /// Errors of throw_deg, and of speed, spin times radius and jump (vertical speed) in parts of the cue ball's speed, against
    /// the same equations solved closely.
    pub numerical_error: Option<ByName<Spread>>,
    /// The same errors against contact with all effects.
    pub model_error: Option<ByName<Spread>>,
}

impl From<&accuracy::Row> for Way {
    fn from(row: &accuracy::Row) -> Self {
        Self {
            fidelity: row.fidelity,
            effects: row.includes,
            tolerance: row.tolerance,
            seconds: row.seconds,
            failed: row.failed,
            numerical_error: row.numerical.map(errors),
            model_error: Some(errors(row.model)),
        }
    }
}

/// Units of [`QUANTITIES`]: speeds, spins times radius and vertical speeds are in parts of the cue ball's speed.
const UNITS: [&str; 4] = ["deg", "1", "1", "1"];

fn errors(errors: [accuracy::Spread; 4]) -> ByName<Spread> {
    let spreads = UNITS.into_iter().zip(errors).map(|(unit, spread)| Spread { unit, spread });
    QUANTITIES.map(str::to_owned).into_iter().zip(spreads).collect()
}

/// The distribution of an error over the shots.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Spread {
    /// Unit of the numbers: deg, or 1 for a ratio.
    pub unit: &'static str,
    /// The numbers.
    #[serde(flatten)]
    pub spread: accuracy::Spread,
}

/// A fit to shots without noise.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Bias {
    /// The fidelity that was fitted, or auto.
    pub fidelity: &'static str,
    /// Tangential compliance κ of the contact that computed the shots.
    pub kappa: Option<f64>,
    /// By parameter.
    #[schemars(with = "ByParameter<BiasedParameter>")]
    pub parameters: ByName<BiasedParameter>,
    /// χ² of data without noise over their number: what the noise would have to hide.
    pub chi2_per_observation: Option<f64>,
    /// Duration of the fit, s.
    pub seconds: f64,
}

impl From<&bias::Row> for Bias {
    fn from(row: &bias::Row) -> Self {
        let parameter = |found: &bias::Found| {
            let bias = found.bias();
            let document = BiasedParameter {
                unit: unit_of(found.parameter),
                truth: found.truth,
                estimate: bias.map(|_| found.estimate),
                bias,
                std_error: found.std_error,
            };
            (found.parameter.name().to_owned(), document)
        };
        Self {
            fidelity: row.way.name(),
            kappa: finite(row.kappa),
            parameters: row.found.iter().map(parameter).collect(),
            chi2_per_observation: finite(row.chi2_per_observation),
            seconds: row.seconds,
        }
    }
}

/// A parameter of such a fit.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct BiasedParameter {
    /// Unit of the numbers: 1 for a ratio, or s/m.
    pub unit: &'static str,
    /// The value that the data were made with.
    pub truth: f64,
    /// The estimate.
    pub estimate: Option<f64>,
    /// Estimate less truth.
    pub bias: Option<f64>,
    /// Standard error of the fit for the noise that is stated.
    pub std_error: Option<f64>,
}
