//! The joint least-squares problem: every sample's own, with columns that several may share.

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector};

use super::{CompareError, Sample};
use crate::collision::Coefficients;
use crate::observable::Observable;
use crate::optimise::{self, Activity, Constraints};
use crate::parameters::{Parameter, Settings};
use crate::predict::difference;
use crate::residuals::Problem;
use crate::values::Values;
use crate::whitening::{At, EstimatedSd, Hold, Whitening};

/// Weights rest when no estimated standard deviation and no parameter moves by more than this part.
const AT_REST: f64 = 1e-9;
const MAX_ROUNDS: usize = 60;

/// An estimated standard deviation below this part of its first value is an exact fit.
const EXACT: f64 = 1e-9;

/// Which unknown a sample's parameter is; `None`: held at its initial value.
pub(super) type Columns = [Option<usize>; Parameter::COEFFICIENTS.len()];

/// What is fitted together.
#[derive(Clone)]
pub(super) struct Layout {
    /// For each sample.
    pub columns: Vec<Columns>,
    pub start: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    /// The settings of each sample, a prior only where it counts.
    pub settings: Vec<Settings>,
}

impl Layout {
    pub(super) fn new(samples: &[Sample]) -> Self {
        Self {
            columns: vec![[None; 3]; samples.len()],
            start: Vec::new(),
            lower: Vec::new(),
            upper: Vec::new(),
            settings: samples.iter().map(|sample| sample.settings).collect(),
        }
    }

    /// One unknown for a parameter of some samples. A prior that they share counts once.
    pub(super) fn add(&mut self, parameter: Parameter, members: &[usize]) {
        let Some(first) = members.first() else { return };
        let column = self.start.len();
        let setting = |i: &usize| self.settings[*i][parameter];
        let lower = members.iter().map(|i| setting(i).lower).fold(f64::NEG_INFINITY, f64::max);
        let upper = members.iter().map(|i| setting(i).upper).fold(f64::INFINITY, f64::min).max(lower);
        let start = setting(first).initial.clamp(lower, upper);
        self.start.push(start);
        self.lower.push(lower);
        self.upper.push(upper);
        for member in members {
            self.columns[*member][parameter as usize] = Some(column);
        }
        for member in &members[1..] {
            self.settings[*member][parameter].prior = None;
        }
    }
}

/// Where the joint fit ended.
pub(super) struct Solved {
    /// One for each unknown of the layout.
    pub x: Vec<f64>,
    pub chi2: f64,
    /// Without the columns of what the shots of a sample share.
    pub covariance: Option<DMatrix<f64>>,
    /// Unknowns that no residual depends on where it ended.
    pub silent: Vec<bool>,
    pub at_bound: Vec<bool>,
    pub observations: usize,
    pub converged: bool,
    pub termination: String,
    pub whitening: Vec<Whitening>,
    pub sds: Vec<EstimatedSd>,
}

/// What is minimised.
struct Joint<'a> {
    problems: Vec<Problem<'a>>,
    /// For each sample, the unknown of each of its columns.
    columns: Vec<Vec<usize>>,
    count: usize,
}

impl Joint<'_> {
    fn evaluate(&self, x: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>) {
        let parts: Vec<_> = self
            .problems
            .iter()
            .zip(&self.columns)
            .map(|(problem, columns)| {
                let own = DVector::from_iterator(columns.len(), columns.iter().map(|c| x[*c]));
                problem.evaluate_at(&own)
            })
            .collect();
        let rows = parts.iter().map(|(residuals, _)| residuals.len()).sum();
        let (mut residuals, mut jacobian) = (DVector::zeros(rows), DMatrix::zeros(rows, self.count));
        let mut first = 0;
        for ((own, by), columns) in parts.into_iter().zip(&self.columns) {
            residuals.rows_mut(first, own.len()).copy_from(&own);
            for (i, column) in columns.iter().enumerate() {
                jacobian.view_mut((first, *column), (own.len(), 1)).copy_from(&by.column(i));
            }
            first += own.len();
        }
        (residuals, jacobian)
    }
}

impl Operator for Joint<'_> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        Ok(self.evaluate(x).0)
    }
}

impl Jacobian for Joint<'_> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        Ok(self.evaluate(x).1)
    }
}

/// The coefficients of a sample.
pub(super) fn coefficients(settings: &Settings, columns: &Columns, x: &[f64]) -> Coefficients {
    let mut values = Values::initial(settings);
    for parameter in Parameter::COEFFICIENTS {
        if let Some(column) = columns[parameter as usize] {
            values[parameter] = x[column];
        }
    }
    values.coefficients
}

/// Inputs of shots that are best at a kink are held on one side of it from this round on.
const HOLD_FROM: usize = 4;

/// Fits until the weights rest; with given weights, once.
pub(super) fn solve(
    samples: &[Sample],
    layout: &Layout,
    weights: Option<(&[Whitening], &[EstimatedSd])>,
) -> Result<Solved, CompareError> {
    let count = layout.start.len();
    let mut total = count;
    let own_errors = |sample: &Sample| {
        let first = total;
        total += sample.shared_errors.len();
        first..total
    };
    let shared: Vec<std::ops::Range<usize>> = samples.iter().map(own_errors).collect();
    let observations: usize =
        samples.iter().flat_map(|sample| &sample.fitted).map(|shot| shot.plan.rows().len()).sum();
    if observations < count || count == 0 {
        return Err(CompareError::TooFewObservations { observations, parameters: count });
    }
    let pad = |values: &[f64], other: f64| {
        DVector::from_iterator(total, values.iter().copied().chain(std::iter::repeat_n(other, total - count)))
    };
    let constraints =
        Constraints::bounds(pad(&layout.lower, f64::NEG_INFINITY), pad(&layout.upper, f64::INFINITY));
    let free: Vec<Vec<Parameter>> = layout
        .columns
        .iter()
        .map(|columns| {
            Parameter::COEFFICIENTS.into_iter().filter(|p| columns[*p as usize].is_some()).collect()
        })
        .collect();
    let columns: Vec<Vec<usize>> = samples
        .iter()
        .enumerate()
        .map(|(i, _)| {
            let own = free[i].iter().filter_map(|p| layout.columns[i][*p as usize]);
            own.chain(shared[i].clone()).collect()
        })
        .collect();
    let mut x = pad(&layout.start, 0.0);
    let mut sds = weights.map_or_else(|| first_noise(samples, layout, x.as_slice()), |(_, sds)| sds.to_vec());
    let mut before: Vec<Whitening> = Vec::new();
    for round in 0.. {
        let held: Vec<Coefficients> = (0..samples.len())
            .map(|i| coefficients(&layout.settings[i], &layout.columns[i], x.as_slice()))
            .collect();
        let whitening: Vec<Whitening> = match weights {
            Some((whitening, _)) => whitening.to_vec(),
            None => (0..samples.len())
                .map(|i| {
                    let sample = &samples[i];
                    let at = At {
                        model: &sample.model,
                        coefficients: &held[i],
                        estimated: &sds[i],
                        hold: if round >= HOLD_FROM { Hold::AtKinks } else { Hold::None },
                        shared_errors: &sample.shared_errors,
                        shared: &x.as_slice()[shared[i].clone()],
                    };
                    Whitening::new(&sample.fitted, &at, before.get(i))
                })
                .collect::<Option<_>>()
                .ok_or(CompareError::NoWeights)?,
        };
        let problems = (0..samples.len())
            .map(|i| {
                let sample = &samples[i];
                Problem::new(
                    &sample.fitted,
                    &sample.model,
                    &layout.settings[i],
                    &free[i],
                    held[i].into(),
                    &whitening[i],
                )
            })
            .collect();
        let joint = Joint { problems, columns: columns.clone(), count: total };
        let solution = optimise::minimise(joint, &x, &constraints, &optimise::Options::default())?;
        let mut moved = (&solution.x - &x).amax();
        x = solution.x.clone();
        if weights.is_none() {
            moved = moved.max(reweigh(samples, layout, x.as_slice(), &whitening, &mut sds, count));
        }
        let rest = moved < AT_REST || weights.is_some();
        if rest || round + 1 >= MAX_ROUNDS {
            let jacobian = solution.jacobian;
            let silent: Vec<bool> =
                (0..count).map(|j| jacobian.column(j).iter().all(|d| *d == 0.0)).collect();
            return Ok(Solved {
                x: x.as_slice()[..count].to_vec(),
                chi2: 2.0 * solution.cost,
                covariance: covariance(&jacobian, &silent, count),
                at_bound: solution.active[..count].iter().map(|a| *a != Activity::Free).collect(),
                silent,
                observations,
                converged: solution.termination.converged(),
                termination: solution.termination.to_string(),
                whitening,
                sds,
            });
        }
        before = whitening;
    }
    Err(CompareError::NoWeights)
}

/// (JᵀJ)⁻¹ of what is not silent, at its place; NaN elsewhere. `None` if it is singular.
fn covariance(jacobian: &DMatrix<f64>, silent: &[bool], count: usize) -> Option<DMatrix<f64>> {
    let told: Vec<usize> =
        (0..jacobian.ncols()).filter(|j| !silent.get(*j).copied().unwrap_or(false)).collect();
    let own = jacobian.select_columns(&told);
    let scale: Vec<f64> = own.column_iter().map(|c| c.norm()).collect();
    let scaled = DMatrix::from_fn(own.nrows(), own.ncols(), |i, j| own[(i, j)] / scale[j]);
    let r = scaled.qr().r();
    let smallest = r.diagonal().iter().fold(f64::INFINITY, |a, b| a.min(b.abs()));
    // columns of length 1: smaller is not determined
    if !(smallest > 1e-8) {
        return None;
    }
    let inverse = r.solve_upper_triangular(&DMatrix::identity(told.len(), told.len()))?;
    let own = &inverse * inverse.transpose();
    let mut all = DMatrix::from_element(count, count, f64::NAN);
    for (i, a) in told.iter().enumerate().filter(|(_, a)| **a < count) {
        for (j, b) in told.iter().enumerate().filter(|(_, b)| **b < count) {
            all[(*a, *b)] = own[(i, j)] / (scale[i] * scale[j]);
        }
    }
    Some(all)
}

/// Sums over the observations without stated errors: of squares, of what the inputs add, and how many; of all
/// samples of a data set together.
fn sums(
    samples: &[Sample],
    layout: &Layout,
    x: &[f64],
    whitening: &[Whitening],
) -> Vec<Vec<(Observable, f64, f64, usize)>> {
    let plain = Whitening::none();
    let datasets = samples.iter().map(|sample| sample.dataset + 1).max().unwrap_or(0);
    let mut all: Vec<Vec<(Observable, f64, f64, usize)>> = vec![Vec::new(); datasets];
    for (i, sample) in samples.iter().enumerate() {
        let at = coefficients(&layout.settings[i], &layout.columns[i], x);
        let whitening = whitening.get(i).unwrap_or(&plain);
        for (number, shot) in sample.fitted.iter().enumerate() {
            let predicted = whitening.predict(number, &shot.plan, &sample.model, &at);
            let Ok(prediction) = predicted else { continue };
            for (row, measurement) in shot.plan.rows().iter().enumerate() {
                if measurement.measured.sd.is_some() {
                    continue;
                }
                let observable = measurement.observable;
                let d = difference(observable, prediction.values[row], measurement.measured.value);
                let g = prediction.by_inputs.row(row).transpose();
                let from_inputs = g.component_mul(&g).dot(shot.plan.variance_in());
                let own = &mut all[sample.dataset];
                match own.iter_mut().find(|(known, ..)| *known == observable) {
                    Some(sum) => *sum = (observable, sum.1 + d * d, sum.2 + from_inputs, sum.3 + 1),
                    None => own.push((observable, d * d, from_inputs, 1)),
                }
            }
        }
    }
    all
}

fn first_noise(samples: &[Sample], layout: &Layout, x: &[f64]) -> Vec<EstimatedSd> {
    let of_dataset: Vec<EstimatedSd> = sums(samples, layout, x, &[])
        .into_iter()
        .map(|sums| {
            let sd = |square: f64, n: usize| if square > 0.0 { (square / n as f64).sqrt() } else { 1.0 };
            sums.into_iter().map(|(o, square, _, n)| (o, sd(square, n))).collect()
        })
        .collect();
    samples.iter().map(|sample| of_dataset[sample.dataset].clone()).collect()
}

/// σ² = Σd²/(n − p) less what the inputs add, the parameters p counted to the observations in proportion. Returns
/// the largest relative change.
fn reweigh(
    samples: &[Sample],
    layout: &Layout,
    x: &[f64],
    whitening: &[Whitening],
    sds: &mut [EstimatedSd],
    parameters: usize,
) -> f64 {
    let all = sums(samples, layout, x, whitening);
    let total: usize = samples.iter().flat_map(|s| &s.fitted).map(|shot| shot.plan.rows().len()).sum();
    let left = 1.0 - parameters as f64 / total as f64;
    let mut changed = 0.0_f64;
    for (sample, sds) in samples.iter().zip(sds) {
        for (observable, sd) in sds.iter_mut() {
            let sum = all[sample.dataset].iter().find(|(known, ..)| known == observable);
            let Some((_, square, from_inputs, n)) = sum else { continue };
            let n = *n as f64;
            let variance = square / (n * left).max(f64::MIN_POSITIVE) - from_inputs / n;
            let new = variance.max((EXACT * *sd).powi(2)).sqrt();
            changed = changed.max((new / *sd - 1.0).abs());
            *sd = new;
        }
    }
    changed
}
