//! Errors of a shot's inputs and observations that were extracted together, taken apart.

use nalgebra::{DMatrix, SMatrix};

use crate::measurement::dataset::Joint;

/// Inputs of a shot.
const INPUTS: usize = Joint::BEFORE;

/// A variance of which less than this part is left, given the inputs before it, follows from these.
const DEPENDENT: f64 = 1e-12;

/// Errors that inputs and observations have together: inputs err by F t, observations by A t and a rest of their own,
/// with t independent and of variance 1. Partial Cholesky factor of the joint covariance.
#[derive(Clone, Debug)]
pub struct Together {
    pub(super) factor: SMatrix<f64, INPUTS, INPUTS>,
    pub(super) carried: DMatrix<f64>,
    /// L⁻¹ of the rest's covariance.
    pub(super) rest: DMatrix<f64>,
}

impl Together {
    /// `None` where an observation's errors leave nothing of its own.
    pub fn new(joint: &Joint) -> Option<Self> {
        let sigma = &joint.covariance;
        let all = sigma.nrows();
        let mut l = DMatrix::zeros(all, Joint::BEFORE);
        for column in 0..Joint::BEFORE {
            let own = l.row(column).norm_squared();
            let pivot: f64 = sigma[(column, column)] - own;
            if !(pivot > DEPENDENT * sigma[(column, column)]) {
                continue;
            }
            for row in column..all {
                let known = l.row(row).dot(&l.row(column));
                l[(row, column)] = (sigma[(row, column)] - known) / pivot.sqrt();
            }
        }
        let carried = l.rows(Joint::BEFORE, all - Joint::BEFORE).into_owned();
        let after = sigma.view((Joint::BEFORE, Joint::BEFORE), (carried.nrows(), carried.nrows()));
        let rest: DMatrix<f64> = after - &carried * carried.transpose();
        let rest = rest.cholesky()?.l();
        let rest = rest.solve_lower_triangular(&DMatrix::identity(rest.nrows(), rest.nrows()))?;
        Some(Self { factor: l.fixed_view::<INPUTS, INPUTS>(0, 0).into_owned(), carried, rest })
    }
}
