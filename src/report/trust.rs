//! How far a fit can be trusted, in words.

use super::number::plain;
use crate::fit::{Fit, Identifiability};

/// Sections of the text report, each a title and its lines.
pub(super) fn sections(fit: &Fit) -> Vec<(String, Vec<String>)> {
    let found = &fit.diagnostics;
    let mut sections = Vec::new();
    sections.extend(found.identifiability.as_ref().map(identifiability));
    sections
}

fn identifiability(found: &Identifiability) -> (String, Vec<String>) {
    let values: Vec<String> = found.singular_values.iter().map(|value| plain(*value, 3)).collect();
    let mut lines = vec![format!(
        "singular values {} (no unit; of the Jacobian by parameters, columns scaled to 1), condition number {} (1: \
         the parameters do not interfere; above 30: hardly told apart)",
        values.join(", "),
        plain(found.condition, 3)
    )];
    lines.extend(found.worst.as_ref().map(|worst| worst.words.clone()));
    if !found.silent.is_empty() {
        let names: Vec<_> = found.silent.iter().map(|parameter| parameter.symbol()).collect();
        lines.push(format!("the data are silent on {}", names.join(", ")));
    }
    ("What the data determine".to_owned(), lines)
}
