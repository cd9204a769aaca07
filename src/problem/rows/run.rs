//! The fit of a table from beginning to end.

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, Normal as Gauss, StudentsT};

use super::fidelity::{Effect, choose_effects};
use super::outliers::judge_rows;
use super::shot::RowShot;
use super::table::Table;
use crate::measurement::dataset::{Dataset, Shot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::Parameter;
use crate::physics::collision::FidelityChoice;
use crate::problem::descent::{Descent, descend_until};
use crate::problem::findings::Finding;
use crate::problem::identifiability::null_direction;
use crate::problem::loss::{ShotLoss, sandwich};
use crate::problem::minimise::descend_with_noise;
use crate::problem::policy::Policy;
use crate::problem::problem::{Evaluation, Problem};
use crate::problem::profile::End;
use crate::problem::solution::Solution;
use crate::problem::uncertainty::Estimates;
use crate::problem::unknowns::{Id, Mode};

/// Fall of χ² that ends the last descent, 1e-6 standard deviations, so that bounds are met exactly, and
/// its evaluations.
const STALL: f64 = 1e-12;
const MAX_STEPS: usize = 50;

/// Relative change of χ² within which nothing depends on an unknown, and halvings for the edge of such a
/// range.
const SAME: f64 = 1e-12;
const HALVINGS: usize = 45;

/// Degrees of freedom below which a noise is not estimated.
const LEAST_DOF: f64 = 0.5;

/// Noise over its least value at which residuals vanish.
const VANISHES: f64 = 1.0 + 1e-6;

/// Difference of an end of a profile from value ± t·error, as a part of t·error, from which on the
/// profile is the interval.
const DIFFERENT: f64 = 0.1;

/// Choices of the fit of a table that its data set does not state.
#[derive(Clone, Copy, Debug, Default)]
pub struct RowsChoices {
    /// How closely collisions are computed.
    pub fidelity: FidelityChoice,
    /// How outlying shots count; `None`: as the data set states.
    pub loss: Option<Loss>,
    /// Whether intervals of profiles are left out.
    pub without_profiles: bool,
}

/// Why a table cannot be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RowsError {
    /// No shot can be fitted.
    #[error("no shot can be used{}", .left_out.first().map_or(String::new(), |(shot, why)| format!(": shot {shot}: {why}")))]
    NoShot {
        /// Names of the shots, and reasons.
        left_out: Vec<(String, String)>,
    },
    /// There are fewer numbers than free unknowns.
    #[error("{numbers} observations for the free parameters {}; expected at least as many", .unknowns.iter().map(|id| id.name()).collect::<Vec<_>>().join(", "))]
    TooFewNumbers {
        /// Number of observations and priors.
        numbers: usize,
        /// The free unknowns.
        unknowns: Vec<Id>,
    },
    /// Some numbers of a column have a standard deviation and others none.
    #[error("{column} has a standard deviation in shot {with}, but none in shot {without}; give all or none")]
    MixedNoise {
        /// The column.
        column: &'static str,
        /// Names of the first shots with and without.
        with: String,
        without: String,
    },
    /// κ is stated, and the fidelity is of a rigid contact.
    #[error("kappa is stated, but with the fidelity {0} a contact is rigid along its surface")]
    Rigid(&'static str),
    /// No start of the search describes a collision.
    #[error("no values of the unknowns describe a collision that is like these shots")]
    NoStart,
}

/// Noise of the numbers of a table whose errors are not stated.
#[derive(Clone, Debug)]
pub struct TableNoise {
    /// The observables that have it.
    pub observables: Vec<Observable>,
    /// Standard deviation, SI or radians.
    pub sd: f64,
    /// Standard deviation of the rounding of the columns, which is the least that `sd` can be.
    pub rounding: f64,
    /// Number of numbers.
    pub count: f64,
    /// Sum of their squared residuals over the variance.
    pub square: f64,
    /// Numbers less what they spend on unknowns.
    pub dof: f64,
}

/// What is known of an unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Status {
    /// It was estimated.
    Free,
    /// It was held at a stated value.
    Fixed,
    /// It ended at its lower bound.
    AtLower,
    /// It ended at its upper bound.
    AtUpper,
    /// No number depends on it, or only together with others.
    NotIdentified,
}

/// The estimate of one unknown of the contact.
#[derive(Clone, Copy, Debug)]
pub struct RowsEstimate {
    /// The unknown.
    pub id: Id,
    /// Its value; at the edge of a range of values between which nothing changes.
    pub value: f64,
    /// Its standard error; `None` at a bound, on such a range, or if the noise is not known.
    pub std_error: Option<f64>,
    /// Its 95 % interval: of the profile if that differs from value ± t·error by a tenth.
    pub interval: Option<[f64; 2]>,
    /// The ends of its profile.
    pub profile: Option<[End; 2]>,
    /// What is known of it.
    pub status: Status,
}

/// The fit of a table.
pub struct RowsFit {
    /// The minimum.
    pub solution: Solution,
    /// Estimates of the unknowns of the contact.
    pub estimates: Vec<RowsEstimate>,
    /// Noises that were estimated.
    pub noises: Vec<TableNoise>,
    /// Degrees of freedom of Student's t; `None` if all errors are stated.
    pub dof: Option<f64>,
    /// Weight of each shot by the loss.
    pub weights: Vec<f64>,
    /// Effects that were tried beyond those of the chosen fidelity.
    pub effects: Vec<Effect>,
}

/// Fits some shots of a table.
///
/// # Errors
/// See [`RowsError`].
pub fn fit_rows(
    dataset: &Dataset,
    shots: &[&Shot],
    choices: &RowsChoices,
    policy: &Policy,
) -> Result<RowsFit, RowsError> {
    let mut table = Table::new(dataset, shots, choices)?;
    let mut descent = table.descend()?;
    let mut findings = Vec::new();
    let keep = judge_rows(&table.problem, &descent.end.state, policy);
    if keep.contains(&false) {
        findings.push(Finding::LostShots { names: table.leave_out(&keep) });
        descent = table.descend()?;
    }
    if table.split_noise(&descent.end, policy) {
        descent = descend_with_noise(&mut table.problem, descent.end.state);
    }
    let of_table = (&table.settings, dataset.ball);
    let effects = choose_effects(&mut table.problem, &mut descent, choices.fidelity, of_table, policy);
    let free = table.problem.free();
    let converged = descent.converged;
    let descent =
        Descent { converged, ..descend_until(&table.problem, descent.end, &free, MAX_STEPS, STALL) };
    Ok(finish(table, descent, findings, effects, choices))
}

/// Quantiles of the deviations of estimates in their standard errors.
#[derive(Clone, Copy)]
struct Quantiles {
    /// Half width of a 95 % interval.
    two_sided: f64,
    /// Width of a 95 % interval from a bound.
    one_sided: f64,
}

impl Quantiles {
    /// Returns those of Student's t, or of the normal distribution if the noise is stated.
    fn new(dof: Option<f64>) -> Option<Self> {
        let of =
            |quantile: &dyn Fn(f64) -> f64| Self { two_sided: quantile(0.975), one_sided: quantile(0.95) };
        match dof {
            None => Some(of(&|p| Gauss::standard().inverse_cdf(p))),
            Some(dof) => StudentsT::new(0.0, 1.0, dof).ok().map(|t| of(&|p| t.inverse_cdf(p))),
        }
    }
}

/// Computes what is known at a minimum.
fn finish(
    table: Table,
    descent: Descent,
    mut findings: Vec<Finding>,
    effects: Vec<Effect>,
    choices: &RowsChoices,
) -> RowsFit {
    let Table { problem, names, left_out, settings, observables, silent } = table;
    let at = descent.end;
    let (mut estimates, undetermined) = determine(&problem, &at);
    let distances = distances(&problem, &at);
    let weights = problem.rows().map_or_else(Vec::new, |rows| rows.weights(distances.iter().copied()));
    let noises = list_noises(&problem, &at, &estimates, observables);
    let is_robust = problem.rows().is_some_and(|rows| rows.loss != Loss::Squares);
    let losses: Vec<(ShotLoss, f64)> = problem.rows().map_or_else(Vec::new, |rows| {
        let of = |(shot, distance): (&RowShot, &f64)| (rows.losses[shot.rows.len()], *distance);
        rows.shots.iter().zip(&distances).map(of).collect()
    });
    let mut dof = (!noises.is_empty()).then(|| noises.iter().map(|noise| noise.dof).sum::<f64>());
    if is_robust && let Some(covariance) = sandwich(&problem, &at, &estimates, &losses) {
        estimates.covariance = covariance;
        dof = Some((names.len() as f64 - estimates.columns.len() as f64).max(1.0));
    }
    let is_known = |(which, noise): (usize, &TableNoise)| {
        let least = problem.rows().map_or(0.0, |rows| rows.least_noises[which]);
        noise.dof >= LEAST_DOF && (noise.rounding > 0.0 || noise.sd > VANISHES * least)
    };
    let knows_noise = noises.iter().enumerate().all(is_known);
    let quantiles = Quantiles::new(dof).filter(|_| knows_noise);
    let converged = descent.converged;
    if !converged {
        findings.push(Finding::NotConverged);
    }
    let names = vec![names];
    let mut solution = Solution {
        problem,
        at,
        covariance: estimates,
        findings,
        names,
        left_out,
        misfit: f64::NAN,
        evaluations: descent.evaluations,
        converged,
        unit: 1.0,
        middle: [0.0; 2],
    };
    let profiles = !(choices.without_profiles || is_robust);
    let estimate = |parameter| {
        let id = id_of(parameter)?;
        let known = if silent.contains(&id) { vec![id] } else { undetermined.clone() };
        Some(estimate(&solution, id, &known, quantiles, profiles))
    };
    let estimates: Vec<RowsEstimate> = settings.parameters().into_iter().filter_map(estimate).collect();
    for estimate in &estimates {
        match estimate.status {
            Status::NotIdentified => {
                solution.findings.push(Finding::Undetermined { id: estimate.id, sd: f64::INFINITY });
            }
            Status::AtLower | Status::AtUpper => {
                solution.findings.push(Finding::AtBound { id: estimate.id, bound: estimate.value });
            }
            Status::Free | Status::Fixed => {}
        }
    }
    RowsFit { solution, estimates, noises, dof, weights, effects }
}

/// Returns the unknown that stands for a parameter.
fn id_of(parameter: Parameter) -> Option<Id> {
    Id::ALL.into_iter().find(|id| id.name() == parameter.name())
}

/// Returns the estimate of an unknown with its intervals.
fn estimate(
    solution: &Solution,
    id: Id,
    undetermined: &[Id],
    quantiles: Option<Quantiles>,
    profiles: bool,
) -> RowsEstimate {
    let column = id as usize;
    let unknown = solution.problem.unknown(id);
    let [low, high] = unknown.bounds;
    let mut found = RowsEstimate {
        id,
        value: solution.value(id),
        std_error: None,
        interval: None,
        profile: None,
        status: Status::Fixed,
    };
    if undetermined.contains(&id) {
        return RowsEstimate { status: Status::NotIdentified, ..found };
    }
    if unknown.mode != Mode::Free {
        return found;
    }
    if let Some(edge) = edge_of_saturation(&solution.problem, &solution.at, column) {
        found.value = edge;
    }
    found.status = match found.value {
        value if value == low => Status::AtLower,
        value if value == high => Status::AtUpper,
        _ => Status::Free,
    };
    let Some(Quantiles { two_sided, one_sided }) = quantiles else { return found };
    found.std_error = solution.covariance.sd(column);
    let t = if found.status == Status::Free && found.std_error.is_some() { two_sided } else { one_sided };
    let of_error = found.std_error.map(|sd| [found.value - t * sd, found.value + t * sd]);
    let of_error = of_error.map(|ends| ends.map(|end| end.clamp(low, high)));
    let is_of_balls = matches!(id, Id::MassRatio | Id::RadiusRatio);
    // along a ratio of the balls χ² is a parabola
    found.profile = if profiles && !is_of_balls { solution.profile(column, t) } else { None };
    let of_profile = found.profile.map(|ends| ends.map(|end| end.value));
    found.interval = match (of_error, of_profile) {
        (Some(of_error), Some(of_profile)) => {
            let half = 0.5 * (of_error[1] - of_error[0]);
            let differs = (0..2).any(|side| (of_error[side] - of_profile[side]).abs() > DIFFERENT * half);
            Some(if differs { of_profile } else { of_error })
        }
        (of_error, of_profile) => of_profile.or(of_error),
    };
    let is_anywhere = found.interval.is_some_and(|ends| ends[0] <= low && ends[1] >= high);
    if is_anywhere && found.status != Status::Free {
        found = RowsEstimate { status: Status::NotIdentified, interval: None, profile: None, ..found };
    }
    found
}

/// Returns the edge of the range of values of an unknown on which χ² does not depend, next to the
/// values on which it does; `None` if χ² depends on the unknown at the minimum.
fn edge_of_saturation(problem: &Problem, at: &Evaluation, column: usize) -> Option<f64> {
    if at.shots.iter().flatten().any(|shot| shot.slopes_by(column)) {
        return None;
    }
    let is_flat = |value: f64| {
        let mut state = at.state.clone();
        state.shared.0[column] = value;
        (problem.evaluate(state).cost - at.cost).abs() <= SAME * (1.0 + at.cost)
    };
    let edge = |mut off: f64| {
        let mut on = at.state.shared.0[column];
        if is_flat(off) {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (on + off);
            if is_flat(middle) { on = middle } else { off = middle }
        }
        Some(on)
    };
    let [low, high] = problem.unknowns[column].bounds;
    edge(low).or_else(|| edge(high))
}

/// Returns the distance of each shot from its prediction.
fn distances(problem: &Problem, at: &Evaluation) -> Vec<f64> {
    let Some(rows) = problem.rows() else { return Vec::new() };
    let shared = problem.samples[0].gather(&at.state.shared);
    let of_shot = |(i, own)| Some(rows.distance(i, own, &rows.predict(i, own, &shared)?));
    at.state.own[0].iter().enumerate().map(|shot| of_shot(shot).unwrap_or(f64::INFINITY)).collect()
}

fn list_noises(
    problem: &Problem,
    at: &Evaluation,
    estimates: &Estimates,
    observables: Vec<Vec<Observable>>,
) -> Vec<TableNoise> {
    let (Some(rows), Some(reduced)) = (problem.rows(), at.eliminate(problem, 0.0)) else { return Vec::new() };
    let spent = rows.leverages(&problem.samples[0], &at.state, (&reduced, estimates), 0);
    let sums = at.noises(0);
    let of = |(which, observables): (usize, Vec<Observable>)| TableNoise {
        observables,
        sd: rows.noises[which].sd,
        rounding: if rows.is_rounded[which] { rows.least_noises[which] } else { 0.0 },
        count: sums[which].count,
        square: sums[which].weighted,
        dof: sums[which].count - spent[which],
    };
    observables.into_iter().enumerate().map(of).collect()
}

/// Returns what the data determine, and the unknowns of which they determine only combinations; one of
/// these is then held.
fn determine(problem: &Problem, at: &Evaluation) -> (Estimates, Vec<Id>) {
    let mut held = problem.clone();
    let mut undetermined: Vec<Id> = Vec::new();
    for _ in 0..problem.free().len() {
        let direction = at.eliminate(&held, 0.0).and_then(|reduced| null_direction(&held, at, &reduced));
        let Some(direction) = direction else { break };
        let Some(largest) = direction.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else { break };
        undetermined.extend(direction.iter().map(|(id, _)| *id));
        held.unknown_mut(largest.0).mode = Mode::Fixed;
    }
    let none = Estimates { columns: Vec::new(), covariance: DMatrix::zeros(0, 0) };
    (Estimates::new(&held, at).unwrap_or(none), undetermined)
}
