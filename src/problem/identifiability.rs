//! What the data do not determine: directions in which χ² does not change.

use nalgebra::DMatrix;

use super::problem::{Evaluation, Problem, Reduced};
use super::unknowns::Id;

/// Eigenvalue of the normal matrix, scaled to a diagonal of 1, below which χ² does not change along its
/// direction: products of derivatives are exact to 1e-12.
const NULL: f64 = 1e-11;

/// Part of a direction from which on an unknown belongs to it.
const SHARE: f64 = 0.1;

/// Returns the free unknowns in a direction in which χ² does not change, each with its part; `None` if
/// the data determine all unknowns that they depend on and that are not at bounds.
pub(crate) fn null_direction(
    problem: &Problem,
    at: &Evaluation,
    reduced: &Reduced,
) -> Option<Vec<(Id, f64)>> {
    let is_inside = |column: &usize| {
        !problem.unknowns[*column].bounds.contains(&at.state.shared.0[*column]) && reduced.informs(*column)
    };
    let columns: Vec<usize> = problem.free().into_iter().filter(is_inside).collect();
    let matrix = reduced.matrix(&columns);
    let n = columns.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / (matrix[(i, i)] * matrix[(j, j)]).sqrt());
    if n == 0 || !scaled.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let eigen = scaled.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    if eigen.eigenvalues[least] > NULL {
        return None;
    }
    let parts = eigen.eigenvectors.column(least);
    let shares = columns.iter().zip(parts.iter()).filter(|(_, part)| part.abs() > SHARE);
    Some(shares.map(|(column, part)| (problem.unknowns[*column].id, *part)).collect())
}
