//! The shots that matter most: leverage, and where the estimates go without one.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::basis::{Basis, Context, OWN};
use crate::likelihood::fitted::{Fitted, SHARE};
use crate::measurement::parameter::Parameter;

/// Shots that are listed whether they are influential or not, and at most.
const LISTED: [usize; 2] = [5, 20];

/// How much a fit depends on one shot.
#[derive(Clone, Debug, PartialEq)]
pub struct Influence {
    /// The name of the shot.
    pub shot: String,
    /// The leverage of all its observations together; over all shots, leverages sum to the number of parameters.
    pub leverage: f64,
    /// Cook's distance: how far the estimates move without the shot, in units of their joint error, squared and per
    /// parameter. Infinite for a shot without which something is not determined.
    pub cook: f64,
    /// How far each parameter would move without the shot, in its standard errors.
    pub shifts: Vec<(Parameter, f64)>,
}

/// Leverage of each shot, and how far the fit moves without it, in coordinates of the basis; `None` for a
/// shot without which something is not determined.
fn deletions(context: &Context, basis: &Basis) -> Vec<(f64, Option<DVector<f64>>)> {
    let of_shot = |&(first, count): &(usize, usize)| {
        let q = basis.q.rows(first, count).into_owned();
        let h = &q * q.transpose();
        let leverage = h.trace();
        let residual = context.minimum.residuals.rows(first, count).into_owned();
        // R δθ = Qᵢᵀ(1 − H)⁻¹rᵢ
        // what only this shot determines leaves nothing but roundings
        let told = |l: &DMatrix<f64>| l.diagonal().iter().all(|pivot| pivot * pivot > OWN);
        let rest = (DMatrix::identity(count, count) - h).cholesky().filter(|c| told(c.l_dirty()));
        let rest = rest.map(|c| c.solve(&residual));
        (leverage, rest.map(|rest| q.tr_mul(&rest)))
    };
    basis.rows.par_iter().with_min_len(SHARE).map(of_shot).collect()
}

/// How far the unknowns move without each shot, to first order.
pub(in crate::fit) fn shifts_without(context: &Context) -> Vec<Option<DVector<f64>>> {
    let basis = Basis::new(context);
    let unknowns = context.minimum.x.len();
    let of_shot = |(_, moved): (f64, Option<DVector<f64>>)| {
        let own = &basis.back * moved?;
        let mut all = DVector::zeros(unknowns);
        for (value, column) in own.iter().zip(&basis.columns) {
            all[*column] = *value;
        }
        Some(all)
    };
    deletions(context, &basis).into_iter().map(of_shot).collect()
}

/// Cook (1977), for all observations of a shot at once.
pub(in crate::fit) fn influence(
    context: &Context,
    basis: &Basis,
    influential_from: Option<f64>,
) -> Vec<Influence> {
    if basis.fitted == 0 {
        return Vec::new();
    }
    let error = |j: usize| basis.back.row(j).norm();
    let of_shot = |((leverage, moved), fitted): ((f64, Option<DVector<f64>>), &Fitted)| {
        let shot = context.shots[fitted.index].name.clone();
        let Some(moved) = moved else {
            return Influence { shot, leverage, cook: f64::INFINITY, shifts: Vec::new() };
        };
        let shift = &basis.back * &moved;
        let told = (0..basis.parameters.len()).filter(|j| error(*j) > 0.0);
        let shifts = told.map(|j| (basis.parameters[j], shift[j] / error(j))).collect();
        Influence { shot, leverage, cook: moved.norm_squared() / basis.fitted as f64, shifts }
    };
    let of_shots =
        deletions(context, basis).into_par_iter().zip(context.fitted).with_min_len(SHARE).map(of_shot);
    // shots that matter alike keep their order, whatever the last digits say
    let mut all: Vec<(f64, Influence)> = of_shots.map(|own| (rounded(own.cook), own)).collect();
    all.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let mut all: Vec<Influence> = all.into_iter().map(|(_, own)| own).collect();
    let influential = all.iter().filter(|i| influential_from.is_some_and(|from| i.cook > from)).count();
    all.truncate(influential.clamp(LISTED[0], LISTED[1]));
    all
}

/// To six significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
