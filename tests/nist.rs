//! The minimiser alone on the 27 certified problems of NIST StRD, each from both of its starts.

mod models;

use caromfit::numerics::bounded_step::step_within_bounds;
use caromfit::numerics::least_squares::{Descending, Descent, Step, SumOfSquares, descend};
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

/// First damping, in units of the largest squares of the columns: these starts are far away.
const FIRST_DAMPING: f64 = 1e3;

/// Rounding of a residual in units of ε |y|.
pub const ROUNDING: f64 = 4.0;

/// Residuals r (m) and their derivatives J (m × n).
pub type Residuals<'a> = Box<dyn Fn(&DVector<f64>) -> (DVector<f64>, DMatrix<f64>) + 'a>;

/// Residuals of unknowns with bounds, and the length of the numbers that they are differences of.
pub struct Dense<'a> {
    pub residuals: Residuals<'a>,
    pub bounds: Vec<[f64; 2]>,
    pub size: f64,
}

/// Unknowns, and the largest squares of the columns of J so far, by which steps are scaled (Moré
/// 1978).
#[derive(Clone)]
pub struct Scaled {
    pub x: DVector<f64>,
    squares: DVector<f64>,
}

/// Residuals and derivatives at a point.
#[derive(Clone)]
pub struct Linear {
    pub at: Scaled,
    pub residuals: DVector<f64>,
    pub jacobian: DMatrix<f64>,
}

impl Linear {
    pub fn sum(&self) -> f64 {
        self.residuals.norm_squared()
    }
}

impl Dense<'_> {
    /// Minimises from a start within the bounds.
    pub fn minimise(&self, start: &[f64], steps: usize) -> Descent<Linear> {
        let x = DVector::from_column_slice(start);
        let start = self.evaluate(Scaled { squares: DVector::zeros(x.len()), x });
        descend(self, start, Descending { damping: FIRST_DAMPING, steps, stall: 0.0 })
    }
}

impl SumOfSquares for Dense<'_> {
    type State = Scaled;
    type Evaluation = Linear;

    fn evaluate(&self, mut at: Scaled) -> Linear {
        let (residuals, jacobian) = (self.residuals)(&at.x);
        for (largest, column) in at.squares.iter_mut().zip(jacobian.column_iter()) {
            *largest = largest.max(column.norm_squared());
        }
        Linear { at, residuals, jacobian }
    }

    fn sum(&self, at: &Linear) -> f64 {
        let sum = at.sum();
        let is_finite = sum.is_finite() && at.jacobian.iter().all(|x| x.is_finite());
        if is_finite { sum } else { f64::INFINITY }
    }

    fn rounding(&self, at: &Linear) -> f64 {
        let norm = at.residuals.norm();
        ROUNDING * f64::EPSILON * norm * (norm + self.size)
    }

    /// Least squares by [J; √λ D] s = −[r; 0].
    fn step(&self, linear: &Linear, damping: f64) -> Option<Step<Scaled>> {
        let (m, n) = linear.jacobian.shape();
        let mut root = linear.jacobian.clone().insert_rows(m, n, 0.0);
        for (j, square) in linear.at.squares.iter().enumerate() {
            root[(m + j, j)] = (damping * square).sqrt();
        }
        let residual = linear.residuals.clone().insert_rows(m, n, 0.0);
        let at = &linear.at;
        let room: Vec<[f64; 2]> =
            self.bounds.iter().zip(at.x.iter()).map(|(bounds, x)| bounds.map(|bound| bound - x)).collect();
        let step = step_within_bounds(&root, &residual, &room)?;
        let change = &root * &step;
        let promise = -2.0 * residual.dot(&change) - change.norm_squared();
        Some(Step { end: Scaled { x: &at.x + step, squares: at.squares.clone() }, promise })
    }
}

/// Returns no bounds of n unknowns.
pub fn unbounded(n: usize) -> Vec<[f64; 2]> {
    vec![[f64::NEG_INFINITY, f64::INFINITY]; n]
}

/// Maximum number of steps: the hardest run takes 5 000.
const MAX_STEPS: usize = 20_000;

/// One certified problem with its model.
pub struct Regression {
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
    pub fn minimise(&self, start: &[f64], bounds: &[[f64; 2]]) -> Descent<Linear> {
        let residuals: Residuals = Box::new(|b| (self.residuals(b), self.jacobian(b)));
        let size = DVector::from_column_slice(&self.y).norm();
        Dense { residuals, bounds: bounds.to_vec(), size }.minimise(start, MAX_STEPS)
    }

    /// s √((JᵀJ)⁻¹_jj), s² = Σr²/(m − n).
    fn found_deviations(&self, solution: &Linear) -> Vec<f64> {
        let sum = if self.residual_sum < SMALLEST_SUM { self.residual_sum } else { solution.sum() };
        let (m, n) = solution.jacobian.shape();
        let r = solution.jacobian.clone().qr().r();
        let inverse = r.solve_upper_triangular(&DMatrix::identity(n, n)).unwrap();
        let s = (sum / (m - n) as f64).sqrt();
        inverse.row_iter().map(|row| s * row.norm()).collect()
    }

    fn residuals(&self, b: &DVector<f64>) -> DVector<f64> {
        let b: Vec<Dual64> = b.iter().map(|b| Dual64::from_re(*b)).collect();
        DVector::from_fn(self.y.len(), |i, _| (self.model)(&self.x[i], &b).re - self.y[i])
    }

    fn jacobian(&self, b: &DVector<f64>) -> DMatrix<f64> {
        let by = |j: usize| -> Vec<Dual64> {
            b.iter().enumerate().map(|(i, b)| Dual64::new(*b, f64::from(u8::from(i == j)))).collect()
        };
        let seeds: Vec<Vec<Dual64>> = (0..b.len()).map(by).collect();
        DMatrix::from_fn(self.y.len(), b.len(), |i, j| (self.model)(&self.x[i], &seeds[j]).eps)
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

/// All 54 runs.
#[test]
fn all_problems_are_solved_from_both_starts() {
    let (mut sum_of_digits, mut runs) = (0.0, 0.0);
    for (name, model) in MODELS {
        let problem = Regression::read(name, model);
        for start in &problem.starts {
            let descent = problem.minimise(start, &unbounded(start.len()));
            assert!(descent.converged, "{name}: {} steps", descent.steps);
            let solution = &descent.end;
            let parameters = worst_digits(solution.at.x.as_slice(), &problem.parameters);
            let deviations = worst_digits(&problem.found_deviations(solution), &problem.standard_deviations);
            let sum = worst_digits(&[solution.sum()], &[problem.residual_sum]);
            let is_exact = problem.residual_sum < SMALLEST_SUM || sum >= LEAST_DIGITS;
            let found = format!("{name}: {parameters} digits, {deviations} of deviations, {sum} of the sum");
            assert!(parameters.min(deviations) >= LEAST_DIGITS && is_exact, "{found}");
            (sum_of_digits, runs) = (sum_of_digits + parameters, runs + 1.0);
        }
    }
    assert!(sum_of_digits / runs >= MEAN_DIGITS, "mean {} digits", sum_of_digits / runs);
}
