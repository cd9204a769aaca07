//! The studies of [`crate::studies::accuracy`] and [`crate::studies::bias`] as tables and as a
//! figure.

use std::path::Path;

use super::ReportError;
use super::content::{self, Section, Table};
use super::document::AccuracyDocument;
use super::plot;
use super::write::Staged;
use crate::studies::accuracy::Row;

/// Returns tables for the terminal: errors against time, and the bias of fits.
pub(crate) fn table(document: &AccuracyDocument) -> String {
    let errors = |title: &str, of: &str| {
        let each = ["throw_deg", "speed", "spin", "jump"].map(|name| format!("/{of}/{name}/p95"));
        let columns = [
            ("", "/fidelity"),
            ("effects", "/effects"),
            ("tolerance", "/tolerance"),
            ("time, s", "/seconds"),
            ("throw, °", &each[0]),
            ("speed/U", &each[1]),
            ("spin R/U", &each[2]),
            ("jump/U", &each[3]),
        ];
        Section::new(title, "95 % of the shots err by less", [Table::of(&document.ways, &columns)])
    };
    let kappa = document.biases.first().map_or(f64::NAN, |bias| bias.kappa);
    let title = format!(
        "Bias of a fit to {} shots without noise, computed by contact with κ = {kappa:.3}, and the standard error of the fit",
        document.shots
    );
    let columns = [
        ("fitted with", "/fidelity"),
        ("μ", "/parameters/mu/bias"),
        ("±", "/parameters/mu/std_error"),
        ("μ_s", "/parameters/mu_s/bias"),
        ("±", "/parameters/mu_s/std_error"),
        ("e", "/parameters/e/bias"),
        ("±", "/parameters/e/std_error"),
        ("χ²/n", "/chi2_per_observation"),
        ("time, s", "/seconds"),
    ];
    content::sections(&[
        errors(
            "Numerical error against full (full: a table of 25 digits; compliant: itself to 1e-12)",
            "numerical_error",
        ),
        errors("Model error against contact, to 1e-12", "model_error"),
        Section::new(title, "", [Table::of(&document.biases, &columns)]),
    ])
}

/// Writes the figure of the study.
pub(crate) fn write(rows: &[Row], out: &Path) -> Result<(), ReportError> {
    Staged::new(out)?.figure("accuracy", &plot::accuracy(rows))?.put()
}
