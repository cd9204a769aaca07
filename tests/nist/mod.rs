//! The optimiser alone on the 27 certified problems of NIST StRD, each from both of its starts.
use std::fmt::Write as _;

use argmin::core::{Error, Jacobian, Operator};
use caromfit::numerics::least_squares::{Bounds, Options, Solution, minimise};
use nalgebra::{DMatrix, DVector};

pub mod data;
pub mod models;

use data::Problem;
use models::{MODELS, Model, response};

/// The certified values have this many digits: no agreement beyond means anything.
const CERTIFIED_DIGITS: f64 = 11.0;

/// Every parameter and standard deviation, from every start: NIST's own criterion of a good solution.
const LEAST_DIGITS: f64 = 6.0;

/// Mean over the runs of the digits of the worst parameter: exact Jacobians, minimised to rounding.
const MEAN_DIGITS: f64 = 10.0;

/// The residuals of Lanczos1 are the thirteenth digits of its data: in double precision the sum is good to
/// three digits. It is not compared, and its standard deviations are computed from the certified sum.
const SMALLEST_SUM: f64 = 1e-16;

/// The regression of one data set on one model.
pub struct Regression<'a> {
    pub problem: &'a Problem,
    pub model: Model,
}

impl Operator for Regression<'_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, b: &DVector<f64>) -> Result<DVector<f64>, Error> {
        let mut derivatives = vec![0.0; b.len()];
        Ok(DVector::from_fn(self.problem.y.len(), |i, _| {
            (self.model)(&self.problem.x[i], b.as_slice(), &mut derivatives)
                - response(self.problem.name, self.problem.y[i])
        }))
    }
}

impl Jacobian for Regression<'_> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, b: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        let mut jacobian = DMatrix::zeros(self.problem.y.len(), b.len());
        let mut derivatives = vec![0.0; b.len()];
        for (i, x) in self.problem.x.iter().enumerate() {
            (self.model)(x, b.as_slice(), &mut derivatives);
            jacobian.row_mut(i).copy_from_slice(&derivatives);
        }
        Ok(jacobian)
    }
}

/// Digits to which `computed` agrees with `certified`.
pub fn digits(computed: f64, certified: f64) -> f64 {
    let error = ((computed - certified) / certified).abs();
    if error.is_nan() { 0.0 } else { (-error.log10()).clamp(0.0, CERTIFIED_DIGITS) }
}

/// The digits of the worst of them.
pub fn worst_digits(computed: &[f64], certified: &[f64]) -> f64 {
    computed.iter().zip(certified).map(|(b, c)| digits(*b, *c)).fold(CERTIFIED_DIGITS, f64::min)
}

/// s √((JᵀJ)⁻¹_jj), s² = Σr²/(m − n).
fn standard_deviations(solution: &Solution, residual_sum: f64) -> Vec<f64> {
    let (m, n) = solution.jacobian.shape();
    let inverse =
        solution.jacobian.clone().qr().r().solve_upper_triangular(&DMatrix::identity(n, n)).unwrap();
    let s = (residual_sum / (m - n) as f64).sqrt();
    inverse.row_iter().map(|row| s * row.norm()).collect()
}

fn model(name: &str) -> (&'static str, Model) {
    *MODELS.iter().find(|(known, _)| *known == name).unwrap()
}

/// Digits of the parameters, the standard deviations and the residual sum, and the solution.
fn run(problem: &Problem, model: Model, start: usize) -> ([f64; 3], Solution) {
    let start = DVector::from_column_slice(&problem.starts[start]);
    let bounds = Bounds::none(start.len());
    let solution = minimise(Regression { problem, model }, &start, &bounds, &Options::default()).unwrap();
    let smallest = problem.residual_sum < SMALLEST_SUM;
    let sum = if smallest { problem.residual_sum } else { 2.0 * solution.cost };
    let digits = [
        worst_digits(solution.x.as_slice(), &problem.parameters),
        worst_digits(&standard_deviations(&solution, sum), &problem.standard_deviations),
        digits(2.0 * solution.cost, problem.residual_sum),
    ];
    (digits, solution)
}

fn check(problem: &Problem, [parameters, deviations, sum]: [f64; 3], solution: &Solution) {
    let name = problem.name;
    assert!(solution.termination.converged(), "{name}: {}", solution.termination);
    assert!(parameters >= LEAST_DIGITS, "{name}: {parameters} digits");
    assert!(deviations >= LEAST_DIGITS, "{name}: {deviations} digits of the standard deviations");
    if problem.residual_sum > SMALLEST_SUM {
        assert!(sum >= LEAST_DIGITS, "{name}: {sum} digits of the residual sum");
    }
}

fn certified(name: &str) {
    let (name, model) = model(name);
    let problem = data::read(name);
    for start in 0..2 {
        let (digits, solution) = run(&problem, model, start);
        check(&problem, digits, &solution);
    }
}

#[test]
fn misra1a() {
    certified("Misra1a");
}

#[test]
fn thurber() {
    certified("Thurber");
}

#[test]
fn mgh09() {
    certified("MGH09");
}

/// All 54 runs; `-- --nocapture` shows the table. The numbers of iterations are compared with
/// iterations.txt, so that a change that makes the optimiser slower does not go unnoticed.
#[test]
fn all_problems_from_both_starts() {
    let mut table = format!(
        "{:<10} {:>5} {:>10} {:>10} {:>10} {:>10}  termination\n",
        "problem", "start", "parameters", "deviations", "sum", "iterations"
    );
    let mut iterations = String::from("# problem, start, iterations\n");
    let mut runs = Vec::new();
    for (name, model) in MODELS {
        let problem = data::read(name);
        for start in 0..2 {
            let (digits, solution) = run(&problem, model, start);
            let [parameters, deviations, sum] = digits;
            let count = solution.iterations;
            let line =
                format!("{name:<10} {:>5} {parameters:>10.2} {deviations:>10.2} {sum:>10.2}", start + 1);
            writeln!(table, "{line} {count:>10}  {}", solution.termination).unwrap();
            writeln!(iterations, "{name} {} {count}", start + 1).unwrap();
            runs.push((data::read(name), digits, solution));
        }
    }
    let mean = runs.iter().map(|(_, digits, _)| digits[0]).sum::<f64>() / runs.len() as f64;
    let least = runs.iter().map(|(_, digits, _)| digits[0]).fold(CERTIFIED_DIGITS, f64::min);
    println!("{table}{} runs, mean {mean:.2} digits, worst {least:.2}", runs.len());
    for (problem, digits, solution) in &runs {
        check(problem, *digits, solution);
    }
    assert!(mean >= MEAN_DIGITS, "mean {mean} digits");

    let path = data::directory().join("iterations.txt");
    if std::env::var_os("UPDATE_NIST_ITERATIONS").is_some() {
        std::fs::write(&path, &iterations).unwrap();
    }
    assert_eq!(iterations, std::fs::read_to_string(&path).unwrap());
}

/// The analytic Jacobians against central differences, at the certified parameters.
#[test]
fn jacobians_of_the_models() {
    /// Central differences with this relative step are good to about its square.
    const STEP: f64 = 1e-5;
    /// Share of the largest entry of a column: the square of the step with room for third derivatives.
    const TOLERANCE: f64 = 1e-6;
    for (name, model) in MODELS {
        let problem = data::read(name);
        let regression = Regression { problem: &problem, model };
        let b = DVector::from_column_slice(&problem.parameters);
        let jacobian = regression.jacobian(&b).unwrap();
        for j in 0..b.len() {
            let step = STEP * b[j].abs();
            let (mut above, mut below) = (b.clone(), b.clone());
            above[j] += step;
            below[j] -= step;
            let difference = regression.apply(&above).unwrap() - regression.apply(&below).unwrap();
            let error = (difference / (2.0 * step) - jacobian.column(j)).amax();
            assert!(error <= TOLERANCE * jacobian.column(j).amax(), "{name}, b{}: {error}", j + 1);
        }
    }
}
