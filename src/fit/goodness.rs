//! Do model and noise describe the residuals? χ², trends, normality, and the shots that matter most.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};
use statrs::stats_tests::anderson_darling::anderson_darling;

use super::uncertainty::{Minimum, open_directions};
use crate::collision::Model;
use crate::dataset::{Before, Shot};
use crate::observable::{Axis, Observable};
use crate::optimise::Activity;
use crate::parameters::Parameter;
use crate::residuals::Fitted;
use crate::whitening::{EstimatedSd, covariance};

/// A trend this improbable, with all the trends that were looked for taken into account, is named.
const SIGNIFICANT: f64 = 0.05;

/// A χ² this improbable, at either end, means that the stated noise does not describe the residuals.
pub(super) const IMPROBABLE: f64 = 0.001;

/// A trend's variable must not be one that the fit already took up: this part of it must be left.
const OWN: f64 = 1e-6;

/// Shots that are listed whether they are influential or not, and at most.
const LISTED: [usize; 2] = [5, 20];

/// An Anderson-Darling statistic beyond which the formula for its probability no longer holds: there is none.
const HOPELESS: f64 = 13.0;

/// Fewer residuals say nothing of their distribution (D'Agostino and Stephens 1986, Table 4.9).
const ENOUGH: usize = 8;

/// How well model and noise describe the residuals.
#[derive(Clone, Debug, PartialEq)]
pub struct Goodness {
    /// Probability of a larger χ² were model and stated noise right; `None` where the noise was
    /// estimated from these residuals, or shots were down-weighted.
    pub p_value: Option<f64>,
    pub noise: NoiseVerdict,
    /// √(χ²/dof): by how much the stated standard deviations are too small.
    pub noise_factor: Option<f64>,
    /// All trends that were looked for, the surest first.
    pub trends: Vec<Trend>,
    /// `None` with fewer than eight residuals.
    pub normality: Option<Normality>,
    /// The most influential shots, first the most.
    pub influence: Vec<Influence>,
    /// Cook's distance above which a shot is influential: the median of F(p, n − p).
    pub influential_from: Option<f64>,
}

/// Whether the stated noise explains the residuals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoiseVerdict {
    /// There is nothing to compare: the noise was estimated from the residuals, or no degree of
    /// freedom is left.
    NotTested,
    Explains,
    /// The residuals are larger.
    TooSmall,
    /// The residuals are smaller.
    TooLarge,
}

impl NoiseVerdict {
    /// As in fit.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NotTested => "not-tested",
            Self::Explains => "explains-residuals",
            Self::TooSmall => "too-small",
            Self::TooLarge => "too-large",
        }
    }
}

/// How residuals change with something that the model should have taken care of.
#[derive(Clone, Debug, PartialEq)]
pub struct Trend {
    pub quantity: &'static str,
    pub variable: Variable,
    /// Standard deviations of the quantity per unit of the variable.
    pub slope: f64,
    /// Probability of a slope as far from 0 by chance.
    pub p_value: f64,
    /// The same, corrected for the number of trends looked for (Holm 1979).
    pub p_corrected: f64,
    pub significant: bool,
    /// In words, with what it may mean.
    pub words: String,
}

/// What residuals may change with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// Of the cue ball before the impact, m/s.
    Speed,
    /// Size of the cut angle, radians.
    Cut,
    /// Forward spin over that of natural roll.
    Roll,
    /// Rω_z/U.
    Side,
}

impl Variable {
    const ALL: [Self; 4] = [Self::Speed, Self::Cut, Self::Roll, Self::Side];

    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Cut => "cut angle",
            Self::Roll => "forward spin",
            Self::Side => "side spin",
        }
    }

    /// The unit of [`Trend::slope`]'s denominator.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Speed => "m/s",
            Self::Cut => "rad",
            Self::Roll => "natural roll",
            Self::Side => "U/R",
        }
    }
}

/// Anderson and Darling's test of the residuals, each over its own standard deviation, against a normal
/// distribution of their mean and standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normality {
    pub statistic: f64,
    pub p_value: f64,
}

/// What the fit owes to one shot.
#[derive(Clone, Debug, PartialEq)]
pub struct Influence {
    pub shot: String,
    /// Of all its observations together: they sum to the number of parameters over all shots.
    pub leverage: f64,
    /// How far the estimates move without the shot, in units of their joint error, squared and per
    /// parameter. Infinite for a shot without which something is not determined.
    pub cook: f64,
    /// How far each parameter would move without it, in its standard errors.
    pub shifts: Vec<(Parameter, f64)>,
}

/// What the tests need of a fit.
pub(super) struct Context<'a> {
    pub shots: &'a [&'a Shot],
    pub fitted: &'a [Fitted],
    pub model: &'a Model,
    pub minimum: &'a Minimum,
    pub free: &'a [Parameter],
    pub sds: &'a EstimatedSd,
    pub dof: usize,
    /// Whether χ² tells model from noise: the noise is stated, and no shot is down-weighted.
    pub tests_noise: bool,
}

/// Tests the residuals of a fit.
pub(super) fn goodness(context: &Context) -> Goodness {
    let chi2 = 2.0 * context.minimum.cost;
    let dof = context.dof as f64;
    let p_value = ChiSquared::new(dof).ok().filter(|_| context.tests_noise).map(|d| d.sf(chi2));
    let noise = match p_value {
        None => NoiseVerdict::NotTested,
        Some(p) if p < IMPROBABLE => NoiseVerdict::TooSmall,
        Some(p) if p > 1.0 - IMPROBABLE => NoiseVerdict::TooLarge,
        Some(_) => NoiseVerdict::Explains,
    };
    let basis = Basis::new(context);
    let parameters = basis.fitted as f64;
    let influential_from =
        FisherSnedecor::new(parameters, dof).ok().map(|f| f.inverse_cdf(0.5)).filter(|x| x.is_finite());
    Goodness {
        p_value,
        noise,
        noise_factor: p_value.map(|_| (chi2 / dof).sqrt()),
        trends: trends(context, &basis),
        normality: normality(context, &basis),
        influence: influence(context, &basis, influential_from),
        influential_from,
    }
}

/// The directions in which the fit could move: the Jacobian of the parameters that are not at a bound,
/// and of what the shots share.
struct Basis {
    /// Orthonormal, in whitened units.
    q: DMatrix<f64>,
    /// From coordinates in `q` to the unknowns of `columns`: R⁻¹.
    back: DMatrix<f64>,
    columns: Vec<usize>,
    /// The parameters among `columns`, which come first.
    parameters: Vec<Parameter>,
    /// How many of them constraints leave to be fitted.
    fitted: usize,
    /// First row and number of rows of each shot.
    rows: Vec<(usize, usize)>,
}

impl Basis {
    fn new(context: &Context) -> Self {
        let Context { minimum, free, fitted, .. } = context;
        let columns: Vec<usize> = (0..minimum.jacobian.ncols())
            .filter(|j| minimum.active.get(*j).is_none_or(|a| *a == Activity::Free))
            .collect();
        let open = open_directions(&minimum.ties(true), &columns);
        let qr = (minimum.jacobian.select_columns(&columns) * &open).qr();
        let count = open.ncols();
        let inverse = qr.r().solve_upper_triangular(&DMatrix::identity(count, count));
        let back = inverse.map_or_else(|| DMatrix::zeros(columns.len(), count), |inverse| open * inverse);
        let mut first = 0;
        let rows = fitted.iter().map(|shot| {
            let count = shot.plan.rows().len();
            first += count;
            (first - count, count)
        });
        Self {
            q: qr.q(),
            back,
            parameters: columns.iter().filter_map(|j| free.get(*j).copied()).collect(),
            fitted: count.saturating_sub(minimum.shared),
            columns,
            rows: rows.collect(),
        }
    }
}

/// What may have a trend: how an error of 1 of it would move a shot's observations, in raw units.
struct Quantity {
    name: &'static str,
    moves: fn(&Shot, f64, Observable) -> f64,
}

/// Of impacts the velocities along and across the line of centres, of angles every observable.
fn quantities(context: &Context) -> Vec<(Quantity, Option<Observable>)> {
    /// n·axis and side·t·axis of the line of centres.
    fn axes(shot: &Shot, cut: f64, axis: Axis) -> [f64; 2] {
        let Before::Impact { normal: [x, y], .. } = shot.before else { return [0.0; 2] };
        let side = if cut < 0.0 { -1.0 } else { 1.0 };
        match axis {
            Axis::X => [x.value, -side * y.value],
            Axis::Y => [y.value, side * x.value],
            Axis::Z => [0.0; 2],
        }
    }
    fn object(shot: &Shot, cut: f64, observable: Observable, which: usize) -> f64 {
        if let Observable::ObjectVelocity(axis) = observable { axes(shot, cut, axis)[which] } else { 0.0 }
    }
    fn cue(shot: &Shot, cut: f64, observable: Observable, which: usize) -> f64 {
        if let Observable::CueVelocity(axis) = observable { axes(shot, cut, axis)[which] } else { 0.0 }
    }
    if context.shots.iter().any(|shot| matches!(shot.before, Before::Impact { .. })) {
        return vec![
            (Quantity { name: "throw", moves: |s, c, o| object(s, c, o, 1) }, None),
            (
                Quantity {
                    name: "object-ball velocity along the line of centres",
                    moves: |s, c, o| object(s, c, o, 0),
                },
                None,
            ),
            (
                Quantity {
                    name: "cue-ball velocity along the line of centres",
                    moves: |s, c, o| cue(s, c, o, 0),
                },
                None,
            ),
            (
                Quantity {
                    name: "cue-ball velocity across the line of centres",
                    moves: |s, c, o| cue(s, c, o, 1),
                },
                None,
            ),
        ];
    }
    let mut seen: Vec<Observable> = Vec::new();
    for row in context.fitted.iter().flat_map(|shot| shot.plan.rows()) {
        if !seen.contains(&row.observable) {
            seen.push(row.observable);
        }
    }
    seen.into_iter().map(|o| (Quantity { name: o.label(), moves: |_, _, _| 1.0 }, Some(o))).collect()
}

/// What the tests need of one shot.
struct View {
    /// L⁻¹ of its covariance, times √weight.
    whiten: DMatrix<f64>,
    covariance: DMatrix<f64>,
    cut: f64,
    /// In the order of [`Variable::ALL`]; NaN where it is unknown.
    variables: [f64; 4],
}

fn view(context: &Context, number: usize) -> Option<View> {
    let Fitted { plan, .. } = &context.fitted[number];
    let Minimum { whitening, values, .. } = context.minimum;
    let prediction = whitening.predict(number, plan, context.model, &values.coefficients).ok()?;
    let covariance = covariance(plan, &prediction, context.sds);
    let l = covariance.clone().cholesky()?.l();
    let weight = context.minimum.weights.get(number).map_or(1.0, |w| w.sqrt());
    let whiten = l.solve_lower_triangular(&DMatrix::identity(l.nrows(), l.nrows()))? * weight;
    let speed = if plan.knows_speed() { prediction.speed } else { f64::NAN };
    let [roll, side] = plan.spin_ratios(prediction.speed, context.model.ball.radius);
    let cut = plan.cut();
    Some(View { whiten, covariance, cut, variables: [speed, cut.abs(), roll, side] })
}

/// Added-variable tests: is there a slope in the residuals that the parameters cannot take up?
fn trends(context: &Context, basis: &Basis) -> Vec<Trend> {
    let views: Option<Vec<View>> = (0..context.fitted.len()).map(|i| view(context, i)).collect();
    let Some(views) = views else { return Vec::new() };
    let mut trends = Vec::new();
    for (quantity, only) in quantities(context) {
        // one standard deviation of the quantity in each shot, whitened
        let unit: Vec<Option<DVector<f64>>> = (views.iter().zip(context.fitted))
            .map(|(view, Fitted { index, plan, .. })| {
                let moves = plan.rows().iter().map(|row| {
                    let asked = only.is_none_or(|only| only == row.observable);
                    let own = (quantity.moves)(context.shots[*index], view.cut, row.observable);
                    if asked { own } else { 0.0 }
                });
                let moves = DVector::from_iterator(plan.rows().len(), moves);
                let square = moves.norm_squared();
                let sd = moves.dot(&(&view.covariance * &moves)).sqrt() / square;
                (square > 0.0).then(|| &view.whiten * moves * sd)
            })
            .collect();
        for (which, variable) in Variable::ALL.into_iter().enumerate() {
            if let Some((slope, p_value)) = slope(context, basis, &views, &unit, which) {
                let (significant, words) = (false, String::new());
                let quantity = quantity.name;
                trends.push(Trend {
                    quantity,
                    variable,
                    slope,
                    p_value,
                    p_corrected: p_value,
                    significant,
                    words,
                });
            }
        }
    }
    trends.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let count = trends.len();
    let mut largest = 0.0_f64;
    for (rank, trend) in trends.iter_mut().enumerate() {
        largest = largest.max(trend.p_value * (count - rank) as f64).min(1.0);
        trend.p_corrected = largest;
        trend.significant = largest < SIGNIFICANT;
        trend.words = words(trend, count);
    }
    trends
}

/// Slope and its probability by chance; `None` where the variable does not vary, or the parameters can
/// take any slope up.
fn slope(
    context: &Context,
    basis: &Basis,
    views: &[View],
    unit: &[Option<DVector<f64>>],
    which: usize,
) -> Option<(f64, f64)> {
    let minimum = context.minimum;
    let total = minimum.residuals.len();
    let used = |i: usize| unit[i].as_ref().filter(|_| views[i].variables[which].is_finite());
    let values: Vec<f64> =
        (0..views.len()).filter(|i| used(*i).is_some()).map(|i| views[i].variables[which]).collect();
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let spread = values.iter().map(|v| (v - mean).abs()).fold(0.0, f64::max);
    if spread <= OWN * mean.abs().max(1e-3) {
        return None;
    }
    let (mut level, mut rise) = (DVector::zeros(total), DVector::zeros(total));
    for (i, (first, count)) in basis.rows.iter().enumerate() {
        if let Some(unit) = used(i) {
            level.rows_mut(*first, *count).copy_from(unit);
            rise.rows_mut(*first, *count).copy_from(&(unit * (views[i].variables[which] - mean)));
        }
    }
    let out = |v: &DVector<f64>| v - &basis.q * basis.q.tr_mul(v);
    let size = rise.norm();
    let mut level = out(&level);
    if level.norm() > OWN * (values.len() as f64).sqrt() {
        level /= level.norm();
    } else {
        level.fill(0.0);
    }
    let own = |v: &DVector<f64>| {
        let v = out(v);
        &v - &level * level.dot(&v)
    };
    let rise = own(&rise);
    // measured less predicted
    let residual = -own(&minimum.residuals);
    let square = rise.norm_squared();
    if square.sqrt() <= OWN * size {
        return None;
    }
    let slope = rise.dot(&residual) / square;
    let t = slope * square.sqrt();
    if context.tests_noise {
        let p = 2.0 * Normal::standard().sf(t.abs());
        return p.is_finite().then_some((slope, p));
    }
    // against the scatter of the same observations
    let left = &residual - &rise * slope;
    let (mut sum, mut dof) = (0.0, 0.0);
    for (i, (first, count)) in basis.rows.iter().enumerate() {
        let Some(unit) = used(i) else { continue };
        for row in (*first..first + count).filter(|row| unit[row - first] != 0.0) {
            sum += left[row].powi(2);
            let taken = basis.q.row(row).norm_squared() + level[row].powi(2) + rise[row].powi(2) / square;
            dof += 1.0 - taken;
        }
    }
    if dof < 1.0 {
        return None;
    }
    let p = 2.0 * StudentsT::new(0.0, 1.0, dof).ok()?.sf((t / (sum / dof).sqrt()).abs());
    p.is_finite().then_some((slope, p))
}

fn words(trend: &Trend, count: usize) -> String {
    let verb = if trend.slope < 0.0 { "fall" } else { "rise" };
    let meaning = match (trend.quantity, trend.variable) {
        ("throw", Variable::Speed) => "friction is not constant",
        ("throw", Variable::Cut) => "friction is not constant, or the cut angles err",
        (_, Variable::Cut) => "the model leaves something out, or the cut angles err",
        (_, Variable::Roll | Variable::Side) => {
            "the model leaves something out, or the spin is not as stated"
        }
        (_, Variable::Speed) => "the model leaves something out that depends on speed",
    };
    format!(
        "{} residuals {verb} with {} ({:+.2} sd per {}; by chance with probability {:.1e}, {count} trends looked \
         for): {meaning}",
        trend.quantity,
        trend.variable.name(),
        trend.slope,
        trend.variable.unit(),
        trend.p_corrected
    )
}

fn normality(context: &Context, basis: &Basis) -> Option<Normality> {
    let observations: usize = basis.rows.iter().map(|(_, count)| count).sum();
    let standardized: Vec<f64> = (0..observations)
        .filter_map(|row| {
            let left = 1.0 - basis.q.row(row).norm_squared();
            (left > OWN).then(|| context.minimum.residuals[row] / left.sqrt())
        })
        .filter(|value| value.is_finite())
        .collect();
    let n = standardized.len();
    if n < ENOUGH {
        return None;
    }
    let mean = standardized.iter().sum::<f64>() / n as f64;
    let variance = standardized.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    let normal = Normal::new(mean, variance.sqrt()).ok()?;
    let (statistic, p_value) = anderson_darling(&standardized, &normal).ok()?;
    let p_value = if statistic < HOPELESS { p_value.clamp(0.0, 1.0) } else { 0.0 };
    Some(Normality { statistic: if statistic.is_finite() { statistic } else { f64::MAX }, p_value })
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
        let rest = (DMatrix::identity(count, count) - h).cholesky().map(|c| c.solve(&residual));
        (leverage, rest.map(|rest| q.tr_mul(&rest)))
    };
    basis.rows.iter().map(of_shot).collect()
}

/// How far the unknowns move without each shot, to first order.
pub(super) fn shifts_without(context: &Context) -> Vec<Option<DVector<f64>>> {
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
fn influence(context: &Context, basis: &Basis, influential_from: Option<f64>) -> Vec<Influence> {
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
    let mut all: Vec<Influence> =
        deletions(context, basis).into_iter().zip(context.fitted).map(of_shot).collect();
    all.sort_by(|a, b| b.cook.total_cmp(&a.cook));
    let influential = all.iter().filter(|i| influential_from.is_some_and(|from| i.cook > from)).count();
    all.truncate(influential.clamp(LISTED[0], LISTED[1]));
    all
}
