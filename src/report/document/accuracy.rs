//! What `caromfit accuracy --json` prints.

use super::{ByName, Made, document, finite};
use crate::measurement::written::ByParameter;
use crate::report::unit_of;
use crate::studies::accuracy::Row;
use crate::studies::bias;

document! {
    /// What caromfit accuracy --json prints
    ///
    /// Errors against time of every fidelity, and the bias of fits. Keys may be added; none is renamed or dropped. null stands for what
    /// is not known.
    AccuracyDocument(rows: &[Row], found: &[bias::Row], computed: usize, unusable: usize) {
        /// What made it.
        #[serde(flatten)]
        made: Made = Made::default(),
        /// Number of shots that were computed.
        shots: usize = computed,
        /// Number of shots of the data set that could not be used.
        left_out: usize = unusable,
        /// Ways to compute a collision.
        ways: Vec<Row> = rows.to_vec(),
        /// Fits to the shots without noise, computed by contact with all effects.
        biases: Vec<Bias> = found.iter().map(Bias::new).collect(),
    }

    /// A fit to shots without noise.
    Bias(row: &bias::Row) {
        /// The fidelity that was fitted, or auto.
        fidelity: &'static str = row.way.name(),
        /// Tangential compliance κ of the contact that computed the shots.
        kappa: Option<f64> = finite(row.kappa),
        /// By parameter.
        #[schemars(with = "ByParameter<BiasedParameter>")]
        parameters: ByName<BiasedParameter> = {
            row.found.iter().map(|found| (found.parameter.name().to_owned(), BiasedParameter::new(found))).collect()
        },
        /// χ² of data without noise over their number: what the noise would have to hide.
        chi2_per_observation: Option<f64> = finite(row.chi2_per_observation),
        /// Duration of the fit, s.
        seconds: f64 = row.seconds,
    }

    /// A parameter of such a fit.
    BiasedParameter(found: &bias::Found) {
        /// Unit of the numbers: 1 for a ratio, or s/m.
        unit: &'static str = unit_of(found.parameter),
        /// The value that the data were made with.
        truth: f64 = found.truth,
        /// The estimate.
        estimate: Option<f64> = found.bias().map(|_| found.estimate),
        /// Estimate less truth.
        bias: Option<f64> = found.bias(),
        /// Standard error of the fit for the noise that is stated.
        std_error: Option<f64> = found.std_error,
    }
}
