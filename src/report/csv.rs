//! residuals.csv: one row per observation, in the unit of the observable's column.

use std::borrow::Cow;
use std::fmt::Write;

use super::unit_name;
use crate::fit::Fit;

/// The columns: `measured`, `predicted` and `sd` are in `unit`, `cut_deg` in degrees, `speed_m_s`
/// in m/s, `standardized` has none. `model` is `refuted` where the data rule the model out, else empty.
pub const HEADER: &str = "shot,observable,unit,measured,predicted,sd,standardized,cut_deg,speed_m_s,model";

/// residuals.csv as text. A cell whose number is unknown is empty.
#[must_use]
pub fn render(fit: &Fit) -> String {
    let mut text = String::with_capacity(100 * (fit.residuals.len() + 1));
    text.push_str(HEADER);
    text.push('\n');
    for residual in &fit.residuals {
        let unit_si = residual.observable.unit_si();
        // Writing into a String cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},{},{},{},{},{}",
            quoted(&residual.shot),
            residual.observable.column(),
            unit_name(residual.observable),
            number(residual.measured / unit_si),
            number(residual.predicted / unit_si),
            number(residual.sd / unit_si),
            number(residual.standardized),
            number(residual.cut.to_degrees()),
            number(residual.speed.unwrap_or(f64::NAN)),
            if fit.refuted.is_some() { "refuted" } else { "" },
        );
    }
    text
}

/// A cell as RFC 4180 wants it.
pub(super) fn quoted(cell: &str) -> Cow<'_, str> {
    let special = |c: char| matches!(c, ',' | '"' | '\n' | '\r' | '#');
    if cell.contains(special) || cell.trim() != cell {
        Cow::Owned(format!("\"{}\"", cell.replace('"', "\"\"")))
    } else {
        Cow::Borrowed(cell)
    }
}

/// 15 significant digits: all that a number holds whose last bits the change of unit has touched,
/// so that 30° stays 30.
fn number(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    let rounded = format!("{value:.14e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-6..1e15).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}
