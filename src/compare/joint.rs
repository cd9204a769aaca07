//! The joint least-squares problem: every sample's own, with columns that several may share.

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector};

use super::layout::{Layout, Tie};
use super::{CompareError, Sample, noise};
use crate::fit::robust::{Losses, Part, Sandwich, distances};
use crate::fit::search::Effort;
use crate::fit::uncertainty::open_directions;
use crate::likelihood::problem::Problem;
use crate::likelihood::whitening::{At, EstimatedSd, Hold, Whitening, covariance};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::numerics::least_squares;
use crate::numerics::least_squares::Activity;
use crate::physics::collision::Coefficients;

/// Weights rest when no estimated standard deviation and no parameter moves by more than this part.
const AT_REST: f64 = 1e-9;
const MAX_ROUNDS: usize = 60;

/// The weights of a robust loss rest later: a shot at the edge of its loss makes each round gain less.
const ROBUST_AT_REST: f64 = 1e-8;
const MAX_ROBUST_ROUNDS: usize = 500;

/// A shot's weight never vanishes, so that its distance can be told from its weighted residuals.
const LEAST_WEIGHT: f64 = 1e-12;

/// Shots whose inputs have several minima stay with theirs from this round on.
const HOLD_FROM: usize = 4;

/// How the observations are weighted.
#[derive(Clone, Copy)]
pub(super) enum Weights<'a> {
    /// Where errors are not stated, by what the residuals say without bias.
    Unbiased,
    /// By the likeliest noise, to compare models by their likelihood.
    Likeliest,
    /// As where another fit ended.
    Of(&'a Solved),
}

/// Where the joint fit ended.
pub(super) struct Solved {
    /// One for each unknown of the layout.
    pub x: Vec<f64>,
    pub chi2: f64,
    /// What was minimised, to tell which of two minima is the lower: as [`chi2`](Self::chi2) with the losses of the
    /// samples, and 2 ln σ of each observation whose noise was estimated.
    pub objective: f64,
    /// Without the columns of what the shots of a sample share; with a robust loss from the scatter of the shots.
    pub covariance: Option<DMatrix<f64>>,
    /// Unknowns that no residual depends on where it ended, and no equality.
    pub silent: Vec<bool>,
    pub at_bound: Vec<bool>,
    /// The inequalities of the layout that hold with equality.
    pub active: Vec<usize>,
    pub observations: usize,
    pub converged: bool,
    pub termination: String,
    pub whitening: Vec<Whitening>,
    pub sds: Vec<EstimatedSd>,
    /// Of each sample's shots, where a loss is robust.
    pub shot_weights: Option<Vec<Vec<f64>>>,
}

impl Solved {
    /// −2 log L up to a constant: χ² and the logarithms of the variances.
    pub(super) fn minus_two_log_likelihood(&self, samples: &[Sample], layout: &Layout) -> f64 {
        let mut sum = self.chi2;
        for (i, sample) in samples.iter().enumerate() {
            let at = layout.coefficients(i, &self.x);
            for (number, shot) in sample.fitted.iter().enumerate() {
                let prediction = self.whitening[i].predict(number, &shot.plan, &sample.model, &at);
                let log_det = prediction.ok().and_then(|prediction| {
                    let l = covariance(&shot.plan, &prediction, &self.sds[i]).cholesky()?.l();
                    Some(2.0 * l.diagonal().iter().map(|d| d.ln()).sum::<f64>())
                });
                sum += log_det.unwrap_or(f64::NAN);
            }
        }
        sum
    }
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

fn observations(sample: &Sample) -> usize {
    sample.fitted.iter().map(|shot| shot.plan.rows().len()).sum()
}

/// Fits from the start of the layout until the weights rest; with those of another fit, once.
pub(super) fn solve(
    samples: &[Sample],
    layout: &Layout,
    weights: Weights,
    effort: Effort,
) -> Result<Solved, CompareError> {
    let count = layout.start.len();
    let mut total = count;
    let own_errors = |sample: &Sample| {
        let first = total;
        total += sample.shared_errors.len();
        first..total
    };
    let shared: Vec<std::ops::Range<usize>> = samples.iter().map(own_errors).collect();
    let all: usize = samples.iter().map(observations).sum();
    if all < layout.room() || count == 0 {
        return Err(CompareError::TooFewObservations { observations: all, parameters: count });
    }
    let constraints = layout.constraints(total - count);
    let free: Vec<Vec<Parameter>> = layout
        .columns
        .iter()
        .map(|columns| {
            Parameter::COEFFICIENTS.into_iter().filter(|p| columns[*p as usize].is_some()).collect()
        })
        .collect();
    let columns: Vec<Vec<usize>> = (0..samples.len())
        .map(|i| {
            let own = free[i].iter().filter_map(|p| layout.columns[i][*p as usize]);
            own.chain(shared[i].clone()).collect()
        })
        .collect();
    let start = layout.start.iter().copied().chain(std::iter::repeat_n(0.0, total - count));
    let start = DVector::from_iterator(total, start);
    let mut x = constraints.nearest(&start).ok_or_else(|| layout.contradiction(None))?;
    let given = match weights {
        Weights::Of(other) => Some(other),
        Weights::Unbiased | Weights::Likeliest => None,
    };
    let robust = samples.iter().any(|sample| sample.loss != Loss::Squares);
    let of_losses = Loss::ALL.map(|loss| Losses::new(if robust { loss } else { Loss::Squares }));
    // Cauchy's loss has many minima: the one that is meant is near Huber's
    let mut softly = samples.iter().any(|sample| sample.loss == Loss::Cauchy);
    let (at_rest, max_rounds) =
        if robust { (ROBUST_AT_REST, MAX_ROBUST_ROUNDS) } else { (AT_REST, MAX_ROUNDS) };
    let max_rounds = max_rounds.min(effort.rounds);
    let mut shot_weights: Vec<Vec<f64>> =
        samples.iter().map(|sample| vec![1.0; sample.fitted.len()]).collect();
    let mut sds =
        given.map_or_else(|| noise::first(samples, layout, x.as_slice()), |other| other.sds.clone());
    let mut before: Vec<Whitening> = Vec::new();
    for round in 0.. {
        let losses: Vec<&Losses> = samples
            .iter()
            .map(|sample| match sample.loss {
                Loss::Cauchy if softly => &of_losses[Loss::Huber as usize],
                loss => &of_losses[loss as usize],
            })
            .collect();
        let held: Vec<Coefficients> =
            (0..samples.len()).map(|i| layout.coefficients(i, x.as_slice())).collect();
        let whitening: Vec<Whitening> = match given {
            Some(other) => other.whitening.clone(),
            None => (0..samples.len())
                .map(|i| {
                    let sample = &samples[i];
                    let at = At {
                        model: &sample.model,
                        coefficients: &held[i],
                        estimated: &sds[i],
                        hold: if round >= HOLD_FROM { Hold::Near } else { Hold::None },
                        shared_errors: &sample.shared_errors,
                        shared: &x.as_slice()[shared[i].clone()],
                    };
                    let whitening = Whitening::new(&sample.fitted, &at, before.get(i))?;
                    Some(if robust {
                        whitening.weighted(&sample.fitted, &shot_weights[i])
                    } else {
                        whitening
                    })
                })
                .collect::<Option<_>>()
                .ok_or(CompareError::NoWeights)?,
        };
        let problems = (0..samples.len())
            .map(|i| {
                let (sample, settings) = (&samples[i], &layout.settings[i]);
                let columns = (free[i].as_slice(), &[][..]);
                Problem::new(&sample.fitted, &sample.model, settings, columns, held[i].into(), &whitening[i])
            })
            .collect();
        let joint = Joint { problems, columns: columns.clone(), count: total };
        let solution = least_squares::minimise(joint, &x, &constraints, &effort.options)?;
        let mut moved = (&solution.x - &x).amax();
        x = solution.x.clone();
        let used = shot_weights.clone();
        if given.is_none() {
            let parameters = if matches!(weights, Weights::Likeliest) { 0 } else { layout.room() };
            let by_loss = robust.then_some((losses.as_slice(), shot_weights.as_slice()));
            moved = moved.max(noise::reweigh(
                samples,
                layout,
                x.as_slice(),
                &whitening,
                &mut sds,
                parameters,
                by_loss,
            ));
        }
        if robust && given.is_none() {
            let mut first = 0;
            for (i, sample) in samples.iter().enumerate() {
                let of_sample = &solution.residuals.as_slice()[first..];
                let distances = distances(&sample.fitted, of_sample, &shot_weights[i]);
                let own = shot_weights[i].iter_mut().zip(&sample.fitted);
                for ((weight, shot), distance) in own.zip(distances) {
                    let new = losses[i].of(shot).weight(distance).max(LEAST_WEIGHT);
                    moved = moved.max((new - *weight).abs());
                    *weight = new;
                }
                first += observations(sample) + layout.priors_of(i) + sample.shared_errors.len();
            }
        }
        let rest = moved < at_rest || given.is_some();
        if rest && softly {
            softly = false;
            before = whitening;
            continue;
        }
        if rest || round + 1 >= max_rounds {
            let jacobian = solution.jacobian;
            let is_tied = |j: usize| layout.equalities.iter().any(|tie| tie.row[j] != 0.0);
            let silent: Vec<bool> =
                (0..count).map(|j| jacobian.column(j).iter().all(|d| *d == 0.0) && !is_tied(j)).collect();
            let sandwich = if robust {
                let parts = parts(samples, layout, &losses, &used);
                Errors::Scatter(Sandwich::of(&jacobian, &solution.residuals, &parts, layout.room()))
            } else {
                Errors::Curvature
            };
            return Ok(Solved {
                objective: objective(samples, layout, &losses, &used, &solution.residuals, &sds),
                x: x.as_slice()[..count].to_vec(),
                chi2: 2.0 * solution.cost,
                covariance: of_unknowns(&jacobian, &silent, &layout.equalities, &sandwich),
                at_bound: solution.active[..count].iter().map(|a| *a != Activity::Free).collect(),
                silent,
                active: solution.active_inequalities,
                observations: all,
                converged: solution.termination.converged(),
                termination: solution.termination.to_string(),
                whitening,
                sds,
                shot_weights: robust.then_some(used),
            });
        }
        before = whitening;
    }
    Err(CompareError::NoWeights)
}

/// [`Solved::objective`]; the distances of shots are those of residuals weighted with `weights`.
fn objective(
    samples: &[Sample],
    layout: &Layout,
    losses: &[&Losses],
    weights: &[Vec<f64>],
    residuals: &DVector<f64>,
    sds: &[EstimatedSd],
) -> f64 {
    let (mut sum, mut rest) = (0.0, residuals.as_slice());
    for (i, sample) in samples.iter().enumerate() {
        let distances = distances(&sample.fitted, rest, &weights[i]);
        sum += sample.fitted.iter().zip(distances).map(|(shot, d)| losses[i].of(shot).cost(d)).sum::<f64>();
        rest = &rest[observations(sample)..];
        let (others, next) = rest.split_at(layout.priors_of(i) + sample.shared_errors.len());
        sum += others.iter().map(|r| r * r).sum::<f64>();
        rest = next;
        for row in sample.fitted.iter().flat_map(|shot| shot.plan.rows()).filter(|r| r.measured.sd.is_none())
        {
            let sd = sds[i].iter().find(|(observable, _)| *observable == row.observable);
            sum += sd.map_or(0.0, |(_, sd)| 2.0 * sd.ln());
        }
    }
    sum
}

/// The rows of every shot.
fn parts(samples: &[Sample], layout: &Layout, losses: &[&Losses], weights: &[Vec<f64>]) -> Vec<Part> {
    let (mut parts, mut first) = (Vec::new(), 0);
    for (i, sample) in samples.iter().enumerate() {
        for (shot, weight) in sample.fitted.iter().zip(&weights[i]) {
            let rows = shot.plan.rows().len();
            parts.push(Part { first, rows, weight: *weight, loss: *losses[i].of(shot) });
            first += rows;
        }
        first += layout.priors_of(i) + sample.shared_errors.len();
    }
    parts
}

/// What standard errors come of.
enum Errors {
    Curvature,
    /// `None` without a degree of freedom.
    Scatter(Option<Sandwich>),
}

/// The covariance of what is not silent, at its place, within what the equalities leave open; NaN elsewhere. `None`
/// if it is singular.
fn of_unknowns(
    jacobian: &DMatrix<f64>,
    silent: &[bool],
    equalities: &[Tie],
    errors: &Errors,
) -> Option<DMatrix<f64>> {
    let count = silent.len();
    let told: Vec<usize> =
        (0..jacobian.ncols()).filter(|j| !silent.get(*j).copied().unwrap_or(false)).collect();
    let own = jacobian.select_columns(&told);
    // a column that only an equality tells has no length of its own
    let length = |c: nalgebra::DVectorView<f64>| if c.norm() > 0.0 { c.norm() } else { 1.0 };
    let scale: Vec<f64> = own.column_iter().map(length).collect();
    let scaled = DMatrix::from_fn(own.nrows(), own.ncols(), |i, j| own[(i, j)] / scale[j]);
    let ties = DMatrix::from_fn(equalities.len(), told.len(), |i, j| {
        equalities[i].row.get(told[j]).map_or(0.0, |a| a / scale[j])
    });
    let columns: Vec<usize> = (0..told.len()).collect();
    let basis = open_directions(&ties, &columns);
    let r = (scaled * &basis).qr().r();
    let smallest = r.diagonal().iter().fold(f64::INFINITY, |a, b| a.min(b.abs()));
    // columns of length 1: smaller is not determined
    if !(smallest > 1e-8) {
        return None;
    }
    let own = match errors {
        Errors::Curvature => {
            let inverse = &basis * r.solve_upper_triangular(&DMatrix::identity(r.ncols(), r.ncols()))?;
            let of_scaled = &inverse * inverse.transpose();
            DMatrix::from_fn(told.len(), told.len(), |i, j| of_scaled[(i, j)] / (scale[i] * scale[j]))
        }
        Errors::Scatter(sandwich) => {
            let unscaled = DMatrix::from_fn(ties.nrows(), told.len(), |i, j| ties[(i, j)] * scale[j]);
            sandwich.as_ref()?.covariance(&told, &open_directions(&unscaled, &columns))?
        }
    };
    let mut all = DMatrix::from_element(count, count, f64::NAN);
    for (i, a) in told.iter().enumerate().filter(|(_, a)| **a < count) {
        for (j, b) in told.iter().enumerate().filter(|(_, b)| **b < count) {
            all[(*a, *b)] = own[(i, j)];
        }
    }
    Some(all)
}
