//! What the data determine: the singular values of the Jacobian, and in words the combination of
//! parameters that they tell worst.

use nalgebra::{DMatrix, DVector};

use crate::fit::minimum::RANK;
use crate::measurement::parameter::Parameter;

/// From this condition number on, a combination is hardly determined (Belsley, Kuh and Welsch,
/// Regression Diagnostics, 1980, ch. 3: strong dependence from 30 on).
const WEAK: f64 = 30.0;

/// Parameters with at least this share in a direction are named.
const SHARE: f64 = 0.1;

/// Relative changes that are equal and opposite to this part leave a product as it is.
const PRODUCT: f64 = 0.15;

/// What the data determine of the free parameters, at the minimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Identifiability {
    /// The free parameters that some observation depends on.
    pub parameters: Vec<Parameter>,
    /// The singular values of the whitened Jacobian, the largest first. Its columns are scaled to length 1 (and made
    /// orthogonal to errors that the shots share), so that all are 1 where the parameters do not interfere.
    pub singular_values: Vec<f64>,
    /// Largest over smallest singular value.
    pub condition: f64,
    /// The direction of the smallest singular value. `None` with fewer than two parameters.
    pub worst: Option<Combination>,
    /// Free parameters that no observation depends on.
    pub silent: Vec<Parameter>,
}

/// A direction in which the residuals change least.
#[derive(Clone, Debug, PartialEq)]
pub struct Combination {
    /// How far each parameter goes for one standard error along it; undetermined: for a step of some
    /// length.
    pub terms: Vec<(Parameter, f64)>,
    /// Whether the condition number is beyond 30, so that the direction is hardly determined.
    pub weak: bool,
    /// Whether no residual changes along it at all.
    pub undetermined: bool,
    /// What the data do determine of it, where that has a name: name, value, standard error.
    pub determined: Option<(String, f64, f64)>,
    /// The direction in words.
    pub words: String,
}

/// `jacobian`: whitened; its columns are the free parameters at `x` and, behind them, unknowns that
/// the shots share.
pub(in crate::fit) fn identify(
    jacobian: &DMatrix<f64>,
    free: &[Parameter],
    x: &DVector<f64>,
    silent: Vec<Parameter>,
) -> Option<Identifiability> {
    let count = free.len();
    if count == 0 || jacobian.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let own = without_shared(jacobian, count);
    let x = x.rows(0, count).into_owned();
    let norms = DVector::from_iterator(count, own.column_iter().map(|c| c.norm()));
    if norms.min() == 0.0 {
        return None;
    }
    let scaled = DMatrix::from_fn(own.nrows(), count, |i, j| own[(i, j)] / norms[j]);
    let svd = scaled.qr().r().svd(false, true);
    let v_t = svd.v_t?;
    let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
    order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
    let singular_values: Vec<f64> = order.iter().map(|i| svd.singular_values[*i]).collect();
    let (&largest, &smallest) = (singular_values.first()?, singular_values.last()?);
    let worst = (count > 1).then(|| {
        let undetermined = smallest <= RANK * largest;
        let direction = v_t.row(*order.last().unwrap_or(&0)).transpose();
        // covariance Σ v vᵀ/σ² of the scaled parameters, without what is undetermined
        let known = order.len() - usize::from(undetermined);
        let variance = |gradient: &DVector<f64>| -> f64 {
            let along = |i: &usize| v_t.row(*i).transpose().dot(gradient) / svd.singular_values[*i];
            order[..known].iter().map(|i| along(i).powi(2)).sum()
        };
        let sign = if direction[direction.iamax()] < 0.0 { -1.0 } else { 1.0 };
        let length = sign / if undetermined { direction.component_div(&norms).amax() } else { smallest };
        let named = (0..count).filter(|j| direction[*j].abs() > SHARE);
        let terms: Vec<(usize, f64)> = named.map(|j| (j, length * direction[j] / norms[j])).collect();
        let determined = invariant(&terms, free, &x)
            .map(|(name, value, gradient)| (name, value, variance(&gradient.component_div(&norms)).sqrt()));
        let terms: Vec<(Parameter, f64)> = terms.iter().map(|(j, step)| (free[*j], *step)).collect();
        let weak = largest > WEAK * smallest;
        let words = words(&terms, weak, undetermined, determined.as_ref());
        Combination { terms, weak, undetermined, determined, words }
    });
    let parameters = free.to_vec();
    let condition = largest / smallest;
    Some(Identifiability { parameters, singular_values, condition, worst, silent })
}

/// The first `count` columns, orthogonal to the others.
fn without_shared(jacobian: &DMatrix<f64>, count: usize) -> DMatrix<f64> {
    let own = jacobian.columns(0, count).into_owned();
    if jacobian.ncols() == count {
        return own;
    }
    let q = jacobian.columns(count, jacobian.ncols() - count).into_owned().qr().q();
    &own - &q * (q.transpose() * &own)
}

/// The product or ratio of two parameters that stays the same along a direction: name, value and
/// gradient.
fn invariant(
    terms: &[(usize, f64)],
    free: &[Parameter],
    x: &DVector<f64>,
) -> Option<(String, f64, DVector<f64>)> {
    let &[(i, step_i), (j, step_j)] = terms else { return None };
    if !(x[i] > 0.0 && x[j] > 0.0) {
        return None;
    }
    let ratio = (step_i / x[i]) / (step_j / x[j]);
    let (first, second) = (free[i].symbol(), free[j].symbol());
    let mut gradient = DVector::zeros(x.len().min(free.len()));
    if (ratio + 1.0).abs() < PRODUCT {
        (gradient[i], gradient[j]) = (x[j], x[i]);
        Some((format!("the product {first}·{second}"), x[i] * x[j], gradient))
    } else if (ratio - 1.0).abs() < PRODUCT {
        (gradient[i], gradient[j]) = (1.0 / x[j], -x[i] / x[j].powi(2));
        Some((format!("the ratio {first}/{second}"), x[i] / x[j], gradient))
    } else {
        None
    }
}

fn words(
    terms: &[(Parameter, f64)],
    weak: bool,
    undetermined: bool,
    determined: Option<&(String, f64, f64)>,
) -> String {
    let names: Vec<_> = terms.iter().map(|(parameter, _)| parameter.symbol()).collect();
    let names = names.join(" and ");
    let moves: Vec<_> = terms
        .iter()
        .map(|(parameter, step)| {
            let verb = if *step > 0.0 { "rises" } else { "falls" };
            format!("{} {verb} by {:.2e}", parameter.symbol(), step.abs())
        })
        .collect();
    let moves = moves.join(" and ");
    match (undetermined, weak, determined) {
        (true, _, Some((name, ..))) => format!("only {name} is determined by these shots"),
        (true, _, None) if terms.len() > 1 => format!(
            "only a combination of {names} is determined by these shots: nothing changes when {moves} in \
             proportion"
        ),
        (_, true, Some((name, value, error))) => format!(
            "these shots hardly tell {names} apart: {name} = {value:.4} ± {error:.1e} is known far better than \
             either"
        ),
        (_, true, None) if terms.len() > 1 => {
            format!("these shots hardly tell {names} apart: little changes when {moves}")
        }
        (_, _, _) if terms.len() > 1 => {
            format!("worst determined together: {names}; within one standard error {moves}")
        }
        _ => format!("worst determined: {names} alone; the others do not depend on it"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MU_AND_MU_S: [Parameter; 2] = [Parameter::Mu, Parameter::MuS];

    /// Observations a·(μμ_s) + b·μ: with b = 0 only the product is determined.
    fn product(b: f64) -> Combination {
        let x = DVector::from_row_slice(&[0.05, 0.3]);
        let slope = |i: usize| 1.0 + i as f64;
        let jacobian = DMatrix::from_fn(6, 2, |i, j| {
            let other = if i % 2 == 0 { b } else { 0.0 };
            if j == 0 { slope(i) * x[1] + other } else { slope(i) * x[0] }
        });
        identify(&jacobian, &MU_AND_MU_S, &x, vec![]).unwrap().worst.unwrap()
    }

    #[test]
    fn only_the_product_is_named() {
        let worst = product(0.0);
        assert!(worst.undetermined && worst.weak);
        assert_eq!(worst.words, "only the product μ·μ_s is determined by these shots");
        let (_, value, error) = worst.determined.unwrap();
        // Σ slope² = 91: the error of the product is 1/√91
        assert!((value - 0.015).abs() < 1e-15 && (error - 91_f64.sqrt().recip()).abs() < 1e-12);
    }

    #[test]
    fn a_weak_product_is_named_and_a_strong_one_is_not() {
        let weak = product(1e-3);
        assert!(
            weak.weak && !weak.undetermined && weak.words.contains("the product μ·μ_s = 0.0150"),
            "{weak:?}"
        );
        let strong = product(1.0);
        assert!(!strong.weak && strong.words.starts_with("worst determined"), "{strong:?}");
    }

    #[test]
    fn independent_columns_have_condition_one() {
        let jacobian = DMatrix::from_diagonal(&DVector::from_row_slice(&[3.0, 500.0]));
        let x = DVector::from_row_slice(&[0.05, 0.3]);
        let found = identify(&jacobian, &MU_AND_MU_S, &x, vec![Parameter::E]).unwrap();
        assert!((found.condition - 1.0).abs() < 1e-12);
        assert_eq!(found.silent, [Parameter::E]);
    }

    /// One standard error along the worst direction of a straight line: the larger half axis of its ellipse.
    #[test]
    fn terms_are_one_standard_error_long() {
        let jacobian = DMatrix::from_fn(4, 2, |i, j| if j == 0 { 1.0 } else { i as f64 });
        let x = DVector::from_row_slice(&[1.0, 2.0]);
        let worst = identify(&jacobian, &MU_AND_MU_S, &x, vec![]).unwrap().worst.unwrap();
        let step = DVector::from_iterator(2, worst.terms.iter().map(|(_, step)| *step));
        assert!(((&jacobian * step).norm() - 1.0).abs() < 1e-12);
    }
}
