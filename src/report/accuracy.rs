//! The studies of [`crate::studies::accuracy`] and [`crate::studies::bias`] as tables and as a figure.

use std::path::Path;

use super::ReportError;
use super::content::{self, Section, Table};
use super::plot::{self, Pick, way_name};
use super::write::Staged;
use crate::physics::collision::Fidelity;
use crate::studies::accuracy::{Row, Spread};
use crate::studies::bias;

/// Returns tables for the terminal: median, 95th percentile and worst of the errors, to a digit.
pub(crate) fn table(rows: &[Row]) -> String {
    let heads = ["", "tolerance", "time", "of linear", "throw, °", "speed/U", "spin R/U", "jump/U"];
    let linear = rows.iter().find(|row| row.fidelity == Fidelity::Linear).map_or(f64::NAN, |row| row.seconds);
    let parts: [(&str, Pick); 2] = [
        (
            "Numerical error (median, 95 %, worst) against full (full: a table of 25 digits; compliant: itself to 1e-12)",
            |row| row.numerical,
        ),
        ("Model error (median, 95 %, worst) against contact, to 1e-12", |row| Some(row.model)),
    ];
    let sections = parts.map(|(title, pick)| {
        let rows = rows.iter().filter_map(|row| {
            let errors = pick(row)?.each();
            let shown = |(_, Spread { median, p95, worst })| format!("{median:.0e} {p95:.0e} {worst:.0e}");
            let tolerance = row.tolerance.map_or(String::new(), |tolerance| format!("{tolerance:.0e}"));
            let time = match row.seconds {
                short if short < 1e-6 => format!("{:.1} ns", 1e9 * short),
                long => format!("{:.1} µs", 1e6 * long),
            };
            let first = [way_name(row), tolerance, time, format!("{:.1}", row.seconds / linear)];
            Some(first.into_iter().chain(errors.map(shown)).collect())
        });
        Section::new(title, "", [Table::new(heads, rows).into()])
    });
    content::sections(&sections)
}

/// Writes the figure of the study.
pub(crate) fn write(rows: &[Row], out: &Path) -> Result<(), ReportError> {
    Staged::new(out)?.figure("accuracy", &plot::accuracy(rows))?.put()
}

/// Returns a table for the terminal: bias ± standard error of each parameter, and their ratio.
pub(crate) fn bias_table(rows: &[bias::Row], shots: usize) -> String {
    let row = |row: &bias::Row| {
        let cells = row.found.iter().flat_map(|found| match (found.bias(), found.std_error) {
            (Some(bias), Some(error)) => {
                // a ratio that rounds to 0 has no sign
                let ratio = 0.1 * (10.0 * bias / error).round() + 0.0;
                [format!("{bias:+.5} ± {error:.5}"), format!("{ratio:+.1} se")]
            }
            _ => ["–".to_owned(), String::new()],
        });
        let last = [format!("{:.2}", row.chi2_per_observation), format!("{:.2} s", row.seconds)];
        [row.way.name.to_owned()].into_iter().chain(cells).chain(last).collect()
    };
    let kappa = rows.first().map_or(f64::NAN, |row| row.kappa);
    let title = format!(
        "Bias of a fit to {shots} shots without noise, computed by contact with κ = {kappa:.3}, ± standard error, and in standard \
         errors"
    );
    let heads = ["fitted with", "μ", "", "μ_s", "", "e", "", "χ²/n", "time"];
    content::sections(&[Section::new(title, "", [Table::new(heads, rows.iter().map(row)).into()])])
}
