//! What tests of the residuals need of a fit, and the directions in which the fit could move.

use nalgebra::DMatrix;

use crate::fit::minimum::Minimum;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::whitening::EstimatedSd;
use crate::measurement::dataset::Shot;
use crate::measurement::parameter::Parameter;
use crate::numerics::least_squares::Activity;
use crate::physics::collision::Model;

/// A direction of which less than this part is left has been taken up by the fit.
pub(in crate::fit) const OWN: f64 = 1e-6;

/// What the tests need of a fit.
pub(in crate::fit) struct Context<'a> {
    pub shots: &'a [&'a Shot],
    pub fitted: &'a [Fitted],
    pub model: &'a Model,
    pub minimum: &'a Minimum,
    pub free: &'a [Parameter],
    pub sds: &'a EstimatedSd,
    pub dof: usize,
    /// Whether somebody stated the noise; that of frames is estimated where nobody did.
    pub states_noise: bool,
    /// Whether χ² tells model from noise: the noise is stated, and no shot is down-weighted.
    pub tests_noise: bool,
}

/// The directions in which the fit could move: the Jacobian of the parameters that are not at a bound,
/// and of what the shots share.
pub(in crate::fit) struct Basis {
    /// Orthonormal, in whitened units.
    pub q: DMatrix<f64>,
    /// From coordinates in `q` to the unknowns of `columns`: R⁻¹.
    pub back: DMatrix<f64>,
    pub columns: Vec<usize>,
    /// The parameters among `columns`, which come first.
    pub parameters: Vec<Parameter>,
    /// Number of parameters that are fitted.
    pub fitted: usize,
    /// First row and number of rows of each shot.
    pub rows: Vec<(usize, usize)>,
}

impl Basis {
    pub(in crate::fit) fn new(context: &Context) -> Self {
        let Context { minimum, free, fitted, .. } = context;
        let columns: Vec<usize> = (0..minimum.jacobian.ncols())
            .filter(|j| minimum.active.get(*j).is_none_or(|a| *a == Activity::Free))
            .collect();
        let qr = minimum.jacobian.select_columns(&columns).qr();
        let count = columns.len();
        let inverse = qr.r().solve_upper_triangular(&DMatrix::identity(count, count));
        let back = inverse.unwrap_or_else(|| DMatrix::zeros(count, count));
        let mut first = 0;
        let rows = fitted.iter().map(|shot| {
            let count = shot.plan.rows().len();
            first += count;
            (first - count, count)
        });
        Self {
            q: qr.q(),
            back,
            parameters: columns.iter().filter_map(|j| free.get(*j).copied()).collect(),
            fitted: count.saturating_sub(minimum.shared),
            columns,
            rows: rows.collect(),
        }
    }
}
