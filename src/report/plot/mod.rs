//! Residual plots (in the making: both files are empty for now).

use super::ReportError;
use crate::fit::Fit;

/// residuals.svg.
pub fn svg(_fit: &Fit) -> Result<String, ReportError> {
    Ok(String::new())
}

/// residuals.png.
pub fn png(_fit: &Fit) -> Result<Vec<u8>, ReportError> {
    Ok(Vec::new())
}
