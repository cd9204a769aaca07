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

/// Returns the number of measurements of each kind, as real numbers. `roots` are the A_k, all of as many columns as there are
/// parameters, and `prior` is P; `wanted` holds parameters with the variances t_j > 0 that are wanted of them.
/// `None` if no number of measurements suffices, or Clarabel ends without a solution.
#[must_use]
pub fn fewest(roots: &[DMatrix<f64>], prior: &DMatrix<f64>, wanted: &[(usize, f64)]) -> Option<Vec<f64>> {
    let parameters = prior.ncols();
    // one kind alone, all other parameters known, needs at least 1/(I_jj t_j)
    let most = |j: usize| roots.iter().map(|a| a.column(j).norm_squared()).fold(0.0, f64::max);
    let unit = wanted.iter().map(|(j, t)| (most(*j) * t).recip()).fold(0.0, f64::max);
    if wanted.is_empty() || !unit.is_finite() || unit <= 0.0 {
        return None;
    }
    // every parameter in units of what is wanted of it, or of its error after that number of measurements
    let scale = |j: usize| {
        let target = wanted.iter().find(|(wanted, _)| *wanted == j).map(|(_, t)| t.sqrt());
        let information = unit * most(j) + prior.column(j).norm_squared();
        target.unwrap_or(if information > 0.0 { information.sqrt().recip() } else { 1.0 })
    };
    let scales: Vec<f64> = (0..parameters).map(scale).collect();
    let scaled = |a: &DMatrix<f64>, factor: f64| {
        // a row of zeros needs no h
        let rows: Vec<usize> = (0..a.nrows()).filter(|i| a.row(*i).amax() > 0.0).collect();
        DMatrix::from_fn(rows.len(), parameters, |i, j| factor * scales[j] * a[(rows[i], j)])
    };
    let mut blocks: Vec<DMatrix<f64>> = roots.iter().map(|a| scaled(a, unit.sqrt())).collect();
    blocks.push(scaled(prior, 1.0));
    let targets: Vec<usize> = wanted.iter().map(|(j, _)| *j).collect();
    let counts = Program::new(&blocks, &targets).solve(roots.len())?;
    // a small share of all measurements is the distance of the interior point from 0
    let least = 1e-6 * counts.iter().sum::<f64>();
    Some(counts.into_iter().map(|n| if n < least { 0.0 } else { n * unit }).collect())
}

/// The program in Clarabel's form: A x + slack = b with the slacks in cones. Its variables are n_k of every kind, then for each target
/// and block h and a bound s ≥ ‖h‖²/n; the last block is the prior with n = 1.
#[derive(Default)]
struct Program {
    variables: usize,
    /// Rows, columns and values of A.
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    /// b.
    right: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl Program {
    /// Returns the program of blocks, the last of which is the prior, and parameters whose variances are to be at most 1.
    fn new(blocks: &[DMatrix<f64>], targets: &[usize]) -> Self {
        let kinds = blocks.len() - 1;
        let mut program = Self { variables: kinds, ..Self::default() };
        // the first h of each target and block
        let mut starts: Vec<Vec<usize>> = Vec::new();
        for _ in targets {
            let mut own = Vec::new();
            for a in blocks {
                own.push(program.variables);
                program.variables += a.nrows() + 1;
            }
            starts.push(own);
        }
        // Σ A_kᵀh_k + Pᵀh_P = c
        for (target, starts) in targets.iter().zip(&starts) {
            for i in 0..blocks[kinds].ncols() {
                program.add_row(f64::from(u8::from(i == *target)));
                for (a, start) in blocks.iter().zip(starts) {
                    (0..a.nrows()).for_each(|h| program.put(start + h, a[(h, i)]));
                }
            }
        }
        let equalities = program.right.len();
        program.cones.push(ZeroConeT(equalities));
        // Σ s ≤ 1, n ≥ 0
        for starts in &starts {
            program.add_row(1.0);
            blocks.iter().zip(starts).for_each(|(a, start)| program.put(start + a.nrows(), 1.0));
        }
        for k in 0..kinds {
            program.add_row(0.0);
            program.put(k, -1.0);
        }
        program.cones.push(NonnegativeConeT(program.right.len() - equalities));
        // ‖h‖² ≤ n s: ‖(2h, n − s)‖ ≤ n + s
        for starts in &starts {
            for (k, (a, start)) in blocks.iter().zip(starts).enumerate() {
                for sign in [1.0, -1.0] {
                    // the slack is n ± s
                    program.add_row(if k == kinds { 1.0 } else { 0.0 });
                    if k < kinds {
                        program.put(k, -1.0);
                    }
                    program.put(start + a.nrows(), -sign);
                }
                for h in 0..a.nrows() {
                    program.add_row(0.0);
                    program.put(start + h, -2.0);
                }
                program.cones.push(SecondOrderConeT(a.nrows() + 2));
            }
        }
        program
    }

    fn add_row(&mut self, right: f64) {
        self.right.push(right);
    }

    /// Puts a value into the last row.
    fn put(&mut self, column: usize, value: f64) {
        if value != 0.0 {
            self.rows.push(self.right.len() - 1);
            self.columns.push(column);
            self.values.push(value);
        }
    }

    /// Returns the n_k.
    fn solve(self, kinds: usize) -> Option<Vec<f64>> {
        let Self { variables, rows, columns, values, right, cones } = self;
        let matrix = CscMatrix::new_from_triplets(right.len(), variables, rows, columns, values);
        let objective: Vec<f64> = (0..variables).map(|i| f64::from(u8::from(i < kinds))).collect();
        let quadratic = CscMatrix::zeros((variables, variables));
        let settings =
            DefaultSettings { verbose: false, presolve_enable: false, ..DefaultSettings::default() };
        let mut solver =
            DefaultSolver::new(&quadratic, &objective, &matrix, &right, &cones, settings).ok()?;
        solver.solve();
        let solution = &solver.solution;
        let is_solved = matches!(solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        is_solved.then(|| solution.x[..kinds].iter().map(|n| n.max(0.0)).collect())
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
