//! Products of small matrices whose sizes are known when they are compiled: unrolled, and without what is multiplied by 0.
//! nalgebra's own go through routines for any size, which take twice as many instructions here.

use nalgebra::SMatrix;

/// C += s·A·B
pub(crate) fn add_product<const R: usize, const K: usize, const C: usize>(
    to: &mut SMatrix<f64, R, C>,
    s: f64,
    a: &SMatrix<f64, R, K>,
    b: &SMatrix<f64, K, C>,
) {
    for (to, b) in to.data.0.iter_mut().zip(&b.data.0) {
        for (a, factor) in a.data.0.iter().zip(b) {
            add_scaled(to, s * factor, a);
        }
    }
}

/// C += A·Bᵀ
pub(crate) fn add_product_with_transpose<const R: usize, const K: usize, const C: usize>(
    to: &mut SMatrix<f64, R, C>,
    a: &SMatrix<f64, R, K>,
    b: &SMatrix<f64, C, K>,
) {
    for (a, b) in a.data.0.iter().zip(&b.data.0) {
        for (to, factor) in to.data.0.iter_mut().zip(b) {
            add_scaled(to, *factor, a);
        }
    }
}

fn add_scaled<const R: usize>(to: &mut [f64; R], factor: f64, from: &[f64; R]) {
    if factor != 0.0 {
        for (to, from) in to.iter_mut().zip(from) {
            *to += factor * from;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_nalgebra() {
        let a = SMatrix::<f64, 5, 3>::from_fn(|i, j| (i * i + 2 * j) as f64 - 4.0);
        let b = SMatrix::<f64, 3, 2>::from_fn(|i, j| (i + j) as f64 - 1.0);
        let mut c = SMatrix::<f64, 5, 2>::from_element(1.0);
        add_product(&mut c, 2.0, &a, &b);
        assert_eq!(c, SMatrix::<f64, 5, 2>::from_element(1.0) + 2.0 * a * b);
        let mut c = SMatrix::<f64, 5, 2>::from_element(-1.0);
        add_product_with_transpose(&mut c, &a, &b.transpose());
        assert_eq!(c, SMatrix::<f64, 5, 2>::from_element(-1.0) + a * b);
    }
}
