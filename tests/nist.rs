//! The optimiser alone on the 27 certified problems of NIST StRD, each from both of its starts.

mod models;

use argmin::core::{Error, Jacobian, Operator};
use caromfit::numerics::least_squares::{Bounds, Options, Solution, minimise};
use num_dual::Dual64;

pub use models::{MODELS, Model, mgh09, saturation};

use crate::prelude::*;

/// The certified values have this many digits: no agreement beyond means anything.
const CERTIFIED_DIGITS: f64 = 11.0;

/// Every parameter and standard deviation, from every start: NIST's own criterion of a good solution.
const LEAST_DIGITS: f64 = 6.0;

/// Mean over the runs of the digits of the worst parameter: exact Jacobians, minimised to rounding.
const MEAN_DIGITS: f64 = 10.0;

/// The residuals of Lanczos1 are the thirteenth digits of its data: in double precision the sum is good to
/// three digits. It is not compared, and its standard deviations are computed from the certified sum.
const SMALLEST_SUM: f64 = 1e-16;

/// One certified problem with its model.
pub struct Regression {
    pub name: &'static str,
    pub starts: [Vec<f64>; 2],
    pub parameters: Vec<f64>,
    pub standard_deviations: Vec<f64>,
    pub y: Vec<f64>,
    residual_sum: f64,
    /// One row of predictors per observation.
    x: Vec<Vec<f64>>,
    model: Model,
}

fn file(name: &str) -> PathBuf {
    root().join("tests/reference/nist").join(name)
}

impl Regression {
    /// Reads `name`.dat. Panics on a file that is not as NIST wrote it.
    pub fn read(name: &'static str, model: Model) -> Self {
        let text = fs::read_to_string(file(&format!("{name}.dat"))).unwrap();
        let numbers = |line: &str| -> Vec<f64> {
            line.split_whitespace().filter_map(|word| word.parse().ok()).collect()
        };
        let header: Vec<&str> = text.lines().take(60).collect();
        // "  b1 =   500         250           2.3894212918E+02  2.7070075241E+00"
        let is_parameter = |line: &&&str| line.trim_start().starts_with('b') && line.contains(" = ");
        let rows = header.iter().filter(is_parameter).map(|line| numbers(line.split_once(" = ").unwrap().1));
        let table: Vec<Vec<f64>> = rows.filter(|row| row.len() == 4).collect();
        let column = |k: usize| table.iter().map(|row| row[k]).collect::<Vec<f64>>();
        let stated = |key: &str| -> f64 {
            header.iter().find_map(|line| line.strip_prefix(key)).unwrap().trim().parse().unwrap()
        };
        let data: Vec<Vec<f64>> = text.lines().skip(60).map(numbers).filter(|row| !row.is_empty()).collect();
        assert_eq!(data.len() as f64, stated("Number of Observations:"), "{name}");
        // log y is regressed on for Nelson
        let response = |y: f64| if name == "Nelson" { y.ln() } else { y };
        Self {
            name,
            starts: [column(0), column(1)],
            parameters: column(2),
            standard_deviations: column(3),
            y: data.iter().map(|row| response(row[0])).collect(),
            residual_sum: stated("Residual Sum of Squares:"),
            x: data.iter().map(|row| row[1..].to_vec()).collect(),
            model,
        }
    }

    /// Minimises from a start within bounds.
    pub fn minimise(&self, start: &[f64], bounds: &Bounds) -> Solution {
        minimise(self, &DVector::from_column_slice(start), bounds, &Options::default()).unwrap()
    }

    /// s √((JᵀJ)⁻¹_jj), s² = Σr²/(m − n).
    fn found_deviations(&self, solution: &Solution) -> Vec<f64> {
        let sum = if self.residual_sum < SMALLEST_SUM { self.residual_sum } else { 2.0 * solution.cost };
        let (m, n) = solution.jacobian.shape();
        let r = solution.jacobian.clone().qr().r();
        let inverse = r.solve_upper_triangular(&DMatrix::identity(n, n)).unwrap();
        let s = (sum / (m - n) as f64).sqrt();
        inverse.row_iter().map(|row| s * row.norm()).collect()
    }
}

impl Operator for &Regression {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, b: &DVector<f64>) -> Result<DVector<f64>, Error> {
        let b: Vec<Dual64> = b.iter().map(|b| Dual64::from_re(*b)).collect();
        Ok(DVector::from_fn(self.y.len(), |i, _| (self.model)(&self.x[i], &b).re - self.y[i]))
    }
}

impl Jacobian for &Regression {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, b: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        let by = |j: usize| -> Vec<Dual64> {
            b.iter().enumerate().map(|(i, b)| Dual64::new(*b, f64::from(u8::from(i == j)))).collect()
        };
        let seeds: Vec<Vec<Dual64>> = (0..b.len()).map(by).collect();
        Ok(DMatrix::from_fn(self.y.len(), b.len(), |i, j| (self.model)(&self.x[i], &seeds[j]).eps))
    }
}

/// Digits to which the worst of some numbers agrees with the certified ones.
fn worst_digits(computed: &[f64], certified: &[f64]) -> f64 {
    let digits = |(computed, certified): (&f64, &f64)| {
        let error = ((computed - certified) / certified).abs();
        if error.is_nan() { 0.0 } else { (-error.log10()).clamp(0.0, CERTIFIED_DIGITS) }
    };
    computed.iter().zip(certified).map(digits).fold(CERTIFIED_DIGITS, f64::min)
}

/// All 54 runs. The numbers of iterations are compared with iterations.txt, so that a change that makes the optimiser
/// slower does not go unnoticed; `UPDATE_NIST_ITERATIONS` rewrites it.
#[test]
fn all_problems_are_solved_from_both_starts() {
    let mut iterations = String::from("# problem, start, iterations\n");
    let (mut sum_of_digits, mut runs) = (0.0, 0.0);
    for (name, model) in MODELS {
        let problem = Regression::read(name, model);
        for (number, start) in problem.starts.iter().enumerate() {
            let solution = problem.minimise(start, &Bounds::none(start.len()));
            assert!(solution.termination.converged(), "{name}: {}", solution.termination);
            let parameters = worst_digits(solution.x.as_slice(), &problem.parameters);
            let deviations = worst_digits(&problem.found_deviations(&solution), &problem.standard_deviations);
            let sum = worst_digits(&[2.0 * solution.cost], &[problem.residual_sum]);
            let is_exact = problem.residual_sum < SMALLEST_SUM || sum >= LEAST_DIGITS;
            let found = format!("{name}: {parameters} digits, {deviations} of deviations, {sum} of the sum");
            assert!(parameters.min(deviations) >= LEAST_DIGITS && is_exact, "{found}");
            iterations.push_str(&format!("{name} {} {}\n", number + 1, solution.iterations));
            (sum_of_digits, runs) = (sum_of_digits + parameters, runs + 1.0);
        }
    }
    assert!(sum_of_digits / runs >= MEAN_DIGITS, "mean {} digits", sum_of_digits / runs);
    let path = file("iterations.txt");
    if std::env::var_os("UPDATE_NIST_ITERATIONS").is_some() {
        fs::write(&path, &iterations).unwrap();
    }
    assert_eq!(iterations, fs::read_to_string(&path).unwrap());
}
