//! The fewest measurements whose information suffices: of several kinds, each of which adds its Fisher information
//! A_kᵀA_k, how many n_k ≥ 0 make the variances of some parameters as small as is wanted?
//!
//!   min Σ n_k  subject to  [(Σ n_k A_kᵀA_k + PᵀP)⁻¹]_jj ≤ t_j   for every wanted j.
//!
//! Since cᵀM⁻¹c is the least Σ‖h_k‖²/n_k + ‖h_P‖² over all h with Σ A_kᵀh_k + Pᵀh_P = c (Gauss–Markov), this is a
//! second-order cone program, which Clarabel solves.
//!
//! - Sagnol, G. (2011), J. Stat. Plan. Inference 141, 1684–1708: optimal designs by second-order cone programming.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SolverStatus,
    SupportedConeT, ZeroConeT,
};
use nalgebra::DMatrix;

/// A share of all measurements below this is the interior point's distance from 0.
const NOTHING: f64 = 1e-6;

/// How many measurements of each kind, as real numbers. `roots` are the A_k, all of as many columns as there are
/// parameters, and `prior` is P; `wanted` holds parameters with the variances t_j > 0 that are wanted of them.
/// `None` where no number of measurements suffices, or Clarabel ends without a solution.
#[must_use]
pub fn fewest(roots: &[DMatrix<f64>], prior: &DMatrix<f64>, wanted: &[(usize, f64)]) -> Option<Vec<f64>> {
    let parameters = prior.ncols();
    // one kind alone, all other parameters known, needs at least 1/(I_jj t_j)
    let most = |j: usize| roots.iter().map(|a| a.column(j).norm_squared()).fold(0.0, f64::max);
    let unit = wanted.iter().map(|(j, t)| (most(*j) * t).recip()).fold(0.0, f64::max);
    if wanted.is_empty() || !unit.is_finite() || unit <= 0.0 {
        return None;
    }
    // every parameter in units of what is wanted of it, or of what so many measurements would tell
    let scale = |j: usize| {
        let target = wanted.iter().find(|(wanted, _)| *wanted == j).map(|(_, t)| t.sqrt());
        let told = (unit * most(j) + prior.column(j).norm_squared()).sqrt();
        target.unwrap_or(if told > 0.0 { told.recip() } else { 1.0 })
    };
    let scales: Vec<f64> = (0..parameters).map(scale).collect();
    let scaled = |a: &DMatrix<f64>, factor: f64| {
        // a row of zeros needs no h
        let rows: Vec<usize> = (0..a.nrows()).filter(|i| a.row(*i).amax() > 0.0).collect();
        DMatrix::from_fn(rows.len(), parameters, |i, j| factor * scales[j] * a[(rows[i], j)])
    };
    let mut blocks: Vec<DMatrix<f64>> = roots.iter().map(|a| scaled(a, unit.sqrt())).collect();
    blocks.push(scaled(prior, 1.0));
    let program = Program::new(&blocks, wanted, parameters);
    let counts = program.solve(roots.len())?;
    let total: f64 = counts.iter().sum();
    Some(counts.into_iter().map(|n| if n < NOTHING * total { 0.0 } else { n * unit }).collect())
}

/// Variables: n_k of every kind, then for each wanted parameter the h and the s ≥ ‖h‖²/n of every block, of which
/// the last is the prior with n = 1.
struct Program {
    variables: usize,
    /// Row, column, value.
    entries: Vec<(usize, usize, f64)>,
    right: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl Program {
    fn new(blocks: &[DMatrix<f64>], wanted: &[(usize, f64)], parameters: usize) -> Self {
        let kinds = blocks.len() - 1;
        let own: usize = blocks.iter().map(|a| a.nrows() + 1).sum();
        let mut program = Self {
            variables: kinds + own * wanted.len(),
            entries: Vec::new(),
            right: Vec::new(),
            cones: Vec::new(),
        };
        // Σ A_kᵀh_k + Pᵀh_P = c
        for (which, (j, _)) in wanted.iter().enumerate() {
            for i in 0..parameters {
                let row = program.row(f64::from(u8::from(i == *j)));
                let mut at = kinds + own * which;
                for a in blocks {
                    for h in 0..a.nrows() {
                        program.put(row, at + h, a[(h, i)]);
                    }
                    at += a.nrows() + 1;
                }
            }
        }
        program.cones.push(ZeroConeT(program.right.len()));
        let equalities = program.right.len();
        // Σ s ≤ 1, n ≥ 0
        for which in 0..wanted.len() {
            let row = program.row(1.0);
            let mut at = kinds + own * which;
            for a in blocks {
                program.put(row, at + a.nrows(), 1.0);
                at += a.nrows() + 1;
            }
        }
        for k in 0..kinds {
            let row = program.row(0.0);
            program.put(row, k, -1.0);
        }
        program.cones.push(NonnegativeConeT(program.right.len() - equalities));
        // ‖h‖² ≤ n s: ‖(2h, n − s)‖ ≤ n + s
        for which in 0..wanted.len() {
            let mut at = kinds + own * which;
            for (k, a) in blocks.iter().enumerate() {
                let s = at + a.nrows();
                for sign in [1.0, -1.0] {
                    // the slack is n ± s, n = 1 of the prior
                    let row = program.row(if k == kinds { 1.0 } else { 0.0 });
                    if k < kinds {
                        program.put(row, k, -1.0);
                    }
                    program.put(row, s, -sign);
                }
                for h in 0..a.nrows() {
                    let row = program.row(0.0);
                    program.put(row, at + h, -2.0);
                }
                program.cones.push(SecondOrderConeT(a.nrows() + 2));
                at = s + 1;
            }
        }
        program
    }

    fn row(&mut self, right: f64) -> usize {
        self.right.push(right);
        self.right.len() - 1
    }

    fn put(&mut self, row: usize, column: usize, value: f64) {
        if value != 0.0 {
            self.entries.push((row, column, value));
        }
    }

    /// The n_k.
    fn solve(&self, kinds: usize) -> Option<Vec<f64>> {
        let (rows, columns) = self.entries.iter().map(|(row, column, _)| (*row, *column)).unzip();
        let values = self.entries.iter().map(|(.., value)| *value).collect();
        let matrix = CscMatrix::new_from_triplets(self.right.len(), self.variables, rows, columns, values);
        let objective: Vec<f64> = (0..self.variables).map(|i| f64::from(u8::from(i < kinds))).collect();
        let nothing = CscMatrix::zeros((self.variables, self.variables));
        let settings =
            DefaultSettings { verbose: false, presolve_enable: false, ..DefaultSettings::default() };
        let mut solver =
            DefaultSolver::new(&nothing, &objective, &matrix, &self.right, &self.cones, settings).ok()?;
        solver.solve();
        let solution = &solver.solution;
        let solved = matches!(solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        solved.then(|| solution.x[..kinds].iter().map(|n| n.max(0.0)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clarabel's own tolerance is 1e-8 of the objective.
    const CLOSE: f64 = 1e-5;

    fn close(found: &[f64], expected: &[f64]) {
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < CLOSE * expected.iter().sum::<f64>(), "{found:?}, not {expected:?}");
        }
    }

    #[test]
    fn a_single_kind_is_a_division() {
        let root = DMatrix::from_row_slice(1, 1, &[2.0]);
        let none = DMatrix::zeros(0, 1);
        // 1/(4 n) = 1e-4
        close(&fewest(std::slice::from_ref(&root), &none, &[(0, 1e-4)]).unwrap(), &[2500.0]);
        // the prior already tells 5000 of the 10⁴
        let prior = DMatrix::from_row_slice(1, 1, &[5000_f64.sqrt()]);
        close(&fewest(&[root], &prior, &[(0, 1e-4)]).unwrap(), &[1250.0]);
    }

    #[test]
    fn a_straight_line_is_measured_at_its_ends() {
        // y = a + b x at x in [−1, 1]: b is told best by as many at either end, var b = 1/n
        let at = |x: f64| DMatrix::from_row_slice(1, 2, &[1.0, x]);
        let roots: Vec<_> = [-1.0, -0.5, 0.0, 0.5, 1.0].map(at).to_vec();
        let found = fewest(&roots, &DMatrix::zeros(0, 2), &[(1, 0.01)]).unwrap();
        close(&found, &[50.0, 0.0, 0.0, 0.0, 50.0]);
        // and both: var a = var b = 1/n
        let found = fewest(&roots, &DMatrix::zeros(0, 2), &[(0, 0.01), (1, 0.02)]).unwrap();
        assert!((found.iter().sum::<f64>() - 100.0).abs() < 100.0 * CLOSE, "{found:?}");
    }

    #[test]
    fn what_nothing_tells_cannot_be_had() {
        let root = DMatrix::from_row_slice(1, 2, &[1.0, 0.0]);
        assert!(fewest(std::slice::from_ref(&root), &DMatrix::zeros(0, 2), &[(1, 1.0)]).is_none());
        // nor the difference of two that only come together
        let both = DMatrix::from_row_slice(1, 2, &[1.0, 1.0]);
        assert!(fewest(&[both], &DMatrix::zeros(0, 2), &[(0, 1.0)]).is_none());
    }
}
