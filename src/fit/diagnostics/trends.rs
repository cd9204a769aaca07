//! Do residuals change with something that the model should have taken care of?

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::basis::{Basis, Context, OWN};
use crate::fit::minimum::Minimum;
use crate::likelihood::fitted::{Fitted, SHARE};
use crate::likelihood::whitening::covariance;
use crate::measurement::dataset::{Before, Shot};
use crate::measurement::number::plain;
use crate::measurement::observable::{Axis, Observable};
use crate::physics::name::worded;

/// A trend this improbable, with all the trends that were looked for taken into account, is named.
const SIGNIFICANT: f64 = 0.05;

/// The mean square of standardized residuals below which they are rounding of the search.
pub(super) const ROUNDING: f64 = 1e-12;

/// How residuals change with something that the model should have taken care of.
#[derive(Clone, Debug, PartialEq)]
pub struct Trend {
    /// The quantity whose residuals are looked at.
    pub quantity: &'static str,
    /// The variable with which they may change.
    pub variable: Variable,
    /// The change of the residuals, in standard deviations of the quantity, per unit of the variable.
    pub slope: f64,
    /// The probability of a slope as far from 0 by chance.
    pub p_value: f64,
    /// The same, corrected for the number of trends that were looked for (Holm 1979).
    pub p_corrected: f64,
    /// Whether the trend is no chance, with all others taken into account.
    pub significant: bool,
    /// The trend in words, with what it may mean.
    pub words: String,
}

impl Trend {
    /// A likely reason for the trend, in words.
    #[must_use]
    pub fn meaning(&self) -> &'static str {
        match (self.quantity, self.variable) {
            ("throw", Variable::Speed) => "friction is not constant",
            ("throw", Variable::Cut) => "friction is not constant, or the cut angles err",
            ("e", Variable::Speed) => "e is not constant",
            ("J_t/J_n", Variable::Slip) => {
                "the friction that is fitted does not describe how J_t/J_n follows the slip"
            }
            (_, Variable::Slip) => "it is not the same for discs that slide on each other",
            (_, Variable::Cut) => "the model leaves something out, or the cut angles err",
            (_, Variable::Roll | Variable::Side) => {
                "the model leaves something out, or the spin is not as stated"
            }
            (_, Variable::Speed) => "the model leaves something out that depends on speed",
        }
    }
}

worded! {
    /// A variable with which residuals may change.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Variable {
        /// The cue ball's speed before the impact, m/s.
        Speed = "speed" | "m/s",
        /// The size of the cut angle, rad.
        Cut = "cut angle" | "rad",
        /// The cue ball's forward spin over that of natural roll.
        Roll = "forward spin" | "natural roll",
        /// The cue ball's side spin Rω_z/U.
        Side = "side spin" | "U/R",
        /// Of discs, in the place of the cut angle and the spin: the size of the slip over the closing speed.
        Slip = "the slip over the closing speed" | "closing speed",
    }
    /// The name in reports.
    pub fn name;
    /// The unit of [`Trend::slope`]'s denominator.
    pub fn unit;
}

/// How an error of 1 of what may have a trend would move an observation of a shot with this cut angle, in raw units.
type Moves = Box<dyn Fn(&Shot, f64, Observable) -> f64 + Sync>;

/// Of impacts the velocities along and across the line of centres, of angles every observable.
fn quantities(context: &Context) -> Vec<(&'static str, Moves)> {
    let velocity = |of: fn(Axis) -> Observable, across: bool| -> Moves {
        Box::new(move |shot, cut, observable| {
            let Before::Impact { normal: [x, y], .. } = shot.before else { return 0.0 };
            let side = if cut < 0.0 { -1.0 } else { 1.0 };
            let axes = if across { [-side * y.value, side * x.value] } else { [x.value, y.value] };
            let which = [Axis::X, Axis::Y].into_iter().position(|axis| of(axis) == observable);
            which.map_or(0.0, |which| axes[which])
        })
    };
    let of_discs = context.fitted.iter().any(|shot| shot.plan.is_of_discs());
    if !of_discs && context.shots.iter().any(|shot| matches!(shot.before, Before::Impact { .. })) {
        return vec![
            ("throw", velocity(Observable::ObjectVelocity, true)),
            ("object-ball velocity along the line of centres", velocity(Observable::ObjectVelocity, false)),
            ("cue-ball velocity along the line of centres", velocity(Observable::CueVelocity, false)),
            ("cue-ball velocity across the line of centres", velocity(Observable::CueVelocity, true)),
        ];
    }
    let mut seen: Vec<Observable> = Vec::new();
    for row in context.fitted.iter().flat_map(|shot| shot.plan.rows()) {
        if !seen.contains(&row.observable) {
            seen.push(row.observable);
        }
    }
    let moves = |only: Observable| -> Moves {
        Box::new(move |_, side, observable| match observable {
            _ if observable != only => 0.0,
            // friction has the sign of the cut angle, or of the slip
            Observable::ImpulseRatio => side.signum(),
            _ => 1.0,
        })
    };
    seen.into_iter().map(|observable| (observable.label(), moves(observable))).collect()
}

/// What the tests need of one shot.
struct View {
    /// L⁻¹ of its covariance, times √weight.
    whiten: DMatrix<f64>,
    covariance: DMatrix<f64>,
    /// The cut angle; of discs, the side of the friction on the second.
    cut: f64,
    /// In the order of [`Variable::ALL`]; NaN where it is unknown.
    variables: [f64; 5],
}

fn view(context: &Context, number: usize) -> Option<View> {
    let Fitted { plan, .. } = &context.fitted[number];
    let Minimum { whitening, .. } = context.minimum;
    let at = &context.minimum.first().coefficients();
    let prediction = whitening[0].predict(number, plan, context.model, at).ok()?;
    let covariance = covariance(plan, &prediction, context.sds);
    let l = covariance.clone().cholesky()?.l();
    let weight = context.minimum.weights.get(number).map_or(1.0, |w| w.sqrt());
    let whiten = l.solve_lower_triangular(&DMatrix::identity(l.nrows(), l.nrows()))? * weight;
    let speed = if plan.knows_speed() { prediction.speed } else { f64::NAN };
    let [roll, side] = plan.spin_ratios(prediction.speed, context.model.ball.radius);
    let cut = plan.cut();
    let none = f64::NAN;
    if plan.is_of_discs() {
        // of equal discs (U sin φ + Rω_z)/(U cos φ)
        let slip = cut.tan() + side / cut.cos();
        let variables = [speed * cut.cos(), none, none, none, slip.abs()];
        return Some(View { whiten, covariance, cut: slip, variables });
    }
    Some(View { whiten, covariance, cut, variables: [speed, cut.abs(), roll, side, none] })
}

/// Added-variable tests: is there a slope in the residuals that the parameters cannot take up?
pub(in crate::fit) fn trends(context: &Context, basis: &Basis) -> Vec<Trend> {
    let all = (0..context.fitted.len()).into_par_iter().with_min_len(SHARE);
    let views: Option<Vec<View>> = all.map(|i| view(context, i)).collect();
    let Some(views) = views else { return Vec::new() };
    let mut trends = Vec::new();
    for (quantity, moves) in quantities(context) {
        // one standard deviation of the quantity in each shot, whitened
        let unit: Vec<Option<DVector<f64>>> = (views.par_iter().zip(context.fitted).with_min_len(SHARE))
            .map(|(view, Fitted { index, plan, .. })| {
                let shot = context.shots[*index];
                let moves = plan.rows().iter().map(|row| moves(shot, view.cut, row.observable));
                let moves = DVector::from_iterator(plan.rows().len(), moves);
                let square = moves.norm_squared();
                let sd = moves.dot(&(&view.covariance * &moves)).sqrt() / square;
                (square > 0.0).then(|| &view.whiten * moves * sd)
            })
            .collect();
        for (which, variable) in Variable::ALL.into_iter().enumerate() {
            if let Some((slope, p_value)) = slope(context, basis, &views, &unit, which) {
                let (significant, words) = (false, String::new());
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
    // residuals that are all 0 have no trend
    if dof < 1.0 || !(sum > ROUNDING * dof) {
        return None;
    }
    let p = 2.0 * StudentsT::new(0.0, 1.0, dof).ok()?.sf((t / (sum / dof).sqrt()).abs());
    p.is_finite().then_some((slope, p))
}

fn words(trend: &Trend, count: usize) -> String {
    let verb = if trend.slope < 0.0 { "fall" } else { "rise" };
    let meaning = trend.meaning();
    format!(
        "{} residuals {verb} with {} ({:+.2} sd per {}; by chance with probability {}, {count} trends looked \
         for): {meaning}",
        trend.quantity,
        trend.variable.name(),
        trend.slope,
        trend.variable.unit(),
        plain(trend.p_corrected, 2)
    )
}
