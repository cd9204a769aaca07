//! What `caromfit accuracy --json` prints.

use schemars::JsonSchema;
use serde::Serialize;

use super::{ByName, Made, finite};
use crate::measurement::written::ByParameter;
use crate::report::unit_of;
use crate::studies::accuracy::Row;
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
    pub ways: Vec<Row>,
    /// Fits to the shots without noise, computed by contact with all effects.
    pub biases: Vec<Bias>,
}

impl AccuracyDocument {
    /// Returns the document of both studies, of `shots` shots; `left_out` could not be used.
    #[must_use]
    pub fn new(rows: &[Row], biases: &[bias::Row], shots: usize, left_out: usize) -> Self {
        let biases = biases.iter().map(Bias::from).collect();
        Self { made: Made::default(), shots, left_out, ways: rows.to_vec(), biases }
    }
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
