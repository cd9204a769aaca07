//! What moved since a stored fit, as a table.

use super::aligned::aligned;
use super::regression::Moved;

/// A row for each thing that moved, `title` naming its fit.
#[must_use]
pub fn render(moved: &[(String, Moved)]) -> String {
    let header = ["data set", "what", "baseline", "now", "moved by"].map(str::to_owned).to_vec();
    let row = |(title, moved): &(String, Moved)| {
        let by = moved.standard_errors.map_or("–".to_owned(), |by| format!("{by:+.3} standard errors"));
        vec![title.clone(), moved.what.clone(), moved.before.clone(), moved.now.clone(), by]
    };
    let rows: Vec<_> = std::iter::once(header).chain(moved.iter().map(row)).collect();
    aligned(&rows, "  ")
}
