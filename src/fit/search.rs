//! The search for the minimum: weights, optimiser, and again until the weights rest.

use nalgebra::DVector;

use super::intervals::profile::Slice;
use super::noise::Group;
use super::robust;
use super::robust::Losses;
use super::uncertainty::Minimum;
use super::{FitError, noise, nonsmooth};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::frames::shared_unknowns::SharedUnknown;
use crate::likelihood::prediction::{Plan, Prediction, Unpredictable};
use crate::likelihood::problem;
use crate::likelihood::problem::{Problem, are_filmed};
use crate::likelihood::whitening::{At, EstimatedSd, Hold, Whitening, covariance};
use crate::measurement::dataset::{Dataset, Measured, Shared};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Parameter, Setting, Settings};
use crate::measurement::relation::{Relation, Sense};
use crate::measurement::values::Values;
use crate::numerics::least_squares;
use crate::numerics::least_squares::{Constraints, Linear};
use crate::physics::collision::Model;

/// Re-weighting converges by a factor of ten or more a round.
const MAX_ROUNDS: usize = 60;

/// Weights rest when no estimated standard deviation and no parameter moves by more than this part.
const AT_REST: f64 = 1e-10;

/// Where errors of the inputs are large and collisions curved, rounds gain less: from this one on shots with several minima stay
/// with theirs, and the weights rest within this part of a standard error.
const PATIENCE: usize = 15;
const SLOW_AT_REST: f64 = 1e-5;

/// Integrated collisions let them rest no nearer than within this part of a standard error.
const ROUGH_AT_REST: f64 = 1e-4;

/// At a kink the weights differ from one side to the other, and the last digit says which round has which: the
/// parameters then rest within this part of a standard error, estimated standard deviations within the other.
const ERRORS_AT_KINK: f64 = 0.01;
const CHANGE_AT_KINK: f64 = 1e-4;

/// Or after so many rounds at a kink within this part of a standard error; after so many more the search gives up.
const ROUNDS_AT_KINK: usize = 8;
const MORE_ERRORS_AT_KINK: f64 = 0.1;
const MOST_AT_KINK: usize = 16;

/// The weights of a robust loss rest later: a shot at the edge of its loss makes each round gain less.
const ROBUST_AT_REST: f64 = 1e-8;
const MAX_ROBUST_ROUNDS: usize = 500;

/// The gradient vanishes to this part of what it might be, some 1e-9 standard errors from the minimum. Further on steps follow
/// roundings, and how many there are depends on the processor.
const VELOCITIES: least_squares::Options =
    least_squares::Options { max_iterations: 1000, orthogonality: 1e-11 };

/// Frames are minimised to a small part of a standard error: landings make χ² a little rough.
const FRAMES: least_squares::Options = least_squares::Options { max_iterations: 50, orthogonality: 1e-6 };
const ROUGH: &str = "converged: as far as landings between frames leave χ² smooth";

/// So are integrated collisions, which are as precise as their tolerance.
const ROUGH_INTEGRATED: &str = "converged: as far as the tolerance of integrated collisions leaves χ² smooth";

/// How thoroughly a minimum is looked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Rounds of weighting and minimising.
    pub rounds: usize,
    pub options: least_squares::Options,
    /// Whether a search that stalls at a kink goes on across it.
    crosses_kinks: bool,
}

impl Effort {
    /// To the digits that the data have.
    pub(crate) const FULL: Self = Self { rounds: usize::MAX, options: VELOCITIES, crosses_kinks: true };

    /// Near enough to tell which of several minima is the least.
    pub(crate) const SCREEN: Self = Self {
        rounds: 6,
        options: least_squares::Options { max_iterations: 50, orthogonality: 1e-6 },
        crosses_kinks: true,
    };

    /// Near enough to tell which of several regions holds the least minimum: within some hundredths of the
    /// objective's standard error.
    pub(crate) const ROUGH: Self = Self {
        rounds: 2,
        options: least_squares::Options { max_iterations: 8, orthogonality: 1e-3 },
        crosses_kinks: false,
    };
}

/// A shot's weight never vanishes, so that its distance can be told from its weighted residuals.
const LEAST_WEIGHT: f64 = 1e-12;

#[derive(Clone)]
pub(super) struct Search<'a> {
    /// Standard errors that all shots share.
    pub shared_errors: Vec<(Shared, f64)>,
    /// What all shots share besides the parameters, where their frames are fitted.
    pub unknowns: Vec<SharedUnknown>,
    pub fitted: &'a [Fitted],
    pub model: &'a Model,
    pub settings: &'a Settings,
    pub relations: &'a [Relation],
    pub loss: Loss,
    /// Whether noise is estimated by maximum likelihood, for comparing models, rather than without bias.
    pub maximum_likelihood: bool,
    /// Parameters that are not free although they are not fixed: the data do not tell them.
    pub untold: Vec<Parameter>,
    /// Where the fit starts, and what parameters that are not free are held at.
    pub initial: Values,
}

impl Search<'_> {
    /// What is predicted of a shot at these values.
    pub(super) fn predict(&self, plan: &Plan, at: &Values) -> Result<Prediction, Unpredictable> {
        plan.predict(&at.model(self.model), &at.coefficients)
    }

    /// Free parameters that no observation depends on, whatever the friction, and that have no prior.
    pub(super) fn silent(&self) -> Vec<Parameter> {
        let mut informed = [false; Parameter::ALL.len()];
        for at in self.initial.across_friction(self.settings) {
            for shot in self.fitted {
                let Ok(prediction) = self.predict(&shot.plan, &at) else { continue };
                for (informed, depends) in informed.iter_mut().zip(shot.plan.depends(&prediction)) {
                    *informed |= depends;
                }
            }
        }
        let tied = |p: Parameter| {
            self.relations.iter().any(|r| r.sense == Sense::Equal && r.coefficients[p as usize] != 0.0)
        };
        let silent = |p: &Parameter| {
            let setting = &self.settings[*p];
            !setting.fixed && !informed[*p as usize] && setting.prior.is_none() && !tied(*p)
        };
        self.settings.parameters().into_iter().filter(silent).collect()
    }

    /// How many unknowns all shots share besides the parameters.
    fn shared(&self) -> usize {
        if are_filmed(self.fitted) { self.unknowns.len() } else { self.shared_errors.len() }
    }

    fn start_of(&self, parameter: Parameter) -> f64 {
        self.initial[parameter]
    }

    /// Bounds of the free parameters and of what the shots share, and the relations between them with
    /// what is not free put in.
    ///
    /// # Errors
    /// A relation among parameters none of which is free, and that does not hold.
    pub(super) fn constraints(&self, free: &[Parameter]) -> Result<Constraints, FitError> {
        /// Decimal numbers are not exact.
        const ROUNDING: f64 = 1e-12;
        let (shared, filmed) = (self.shared(), are_filmed(self.fitted));
        let bounds = |pick: fn(&Setting) -> f64, side: usize| {
            let of_shared = |i: usize| {
                if filmed { self.unknowns[i].bounds[side] } else { [f64::NEG_INFINITY, f64::INFINITY][side] }
            };
            DVector::from_iterator(
                free.len() + shared,
                free.iter().map(|p| pick(&self.settings[*p])).chain((0..shared).map(of_shared)),
            )
        };
        let mut constraints = Constraints::bounds(bounds(|s| s.lower, 0), bounds(|s| s.upper, 1));
        let mut add = |linear: fn(&mut Constraints) -> &mut Linear, row: &DVector<f64>, limit: f64| {
            let linear = linear(&mut constraints);
            let rows = linear.matrix.nrows();
            linear.matrix = linear.matrix.clone().insert_row(rows, 0.0);
            linear.matrix.set_row(rows, &row.transpose());
            linear.limit = linear.limit.clone().push(limit);
        };
        for relation in self.relations {
            let involves = |p: Parameter| relation.coefficients[p as usize] != 0.0;
            // what the data do not tell may be whatever the relation asks for
            if relation.sense == Sense::AtMost && self.untold.iter().any(|p| involves(*p)) {
                continue;
            }
            let held = Parameter::ALL.into_iter().filter(|p| involves(*p) && !free.contains(p));
            let held: f64 = held.map(|p| relation.coefficients[p as usize] * self.start_of(p)).sum();
            let mut row = DVector::zeros(free.len() + shared);
            for (column, parameter) in free.iter().enumerate() {
                row[column] = relation.coefficients[*parameter as usize];
            }
            let limit = relation.limit - held;
            if row.amax() > 0.0 {
                match relation.sense {
                    Sense::AtMost => add(|c| &mut c.inequalities, &row, limit),
                    Sense::Equal => add(|c| &mut c.equalities, &row, limit),
                }
                continue;
            }
            let excess = if relation.sense == Sense::Equal { limit.abs() } else { -limit };
            if excess > ROUNDING * (1.0 + held.abs()) {
                return Err(FitError::Relations(format!(
                    "\"{}\" does not hold for the values at which its parameters are held",
                    relation.text
                )));
            }
        }
        Ok(constraints)
    }

    /// With the inputs of the shots estimated anew from where they were; `shared` are the errors that they share.
    pub(super) fn whitening(
        &self,
        at: &Values,
        sds: &EstimatedSd,
        shared: &[f64],
        (before, hold): (Option<&Whitening>, Hold),
    ) -> Result<Whitening, FitError> {
        if are_filmed(self.fitted) {
            return Ok(Whitening::none());
        }
        let at = At {
            model: &at.model(self.model),
            coefficients: &at.coefficients,
            estimated: sds,
            hold,
            shared_errors: &self.shared_errors,
            shared,
        };
        Whitening::new(self.fitted, &at, before).ok_or(FitError::NoWeights)
    }

    /// These shots, of which velocities are fitted, at a minimum of their frames.
    pub(super) fn at(&self, free: &[Parameter], minimum: &Minimum, dataset: &Dataset) -> Option<Minimum> {
        let further =
            |value: f64, known: Option<Measured>, sd: f64| (value - known.map_or(value, |k| k.value)) / sd;
        let shift = |(which, sd): &(Shared, f64)| match which {
            Shared::Sliding => further(minimum.sliding(None), dataset.sliding, *sd),
            Shared::Rolling => minimum.rolling().map_or(0.0, |value| further(value, dataset.rolling, *sd)),
            // the model's own
            Shared::Lift => 0.0,
        };
        let own = minimum.x.rows(0, free.len());
        let shared = self.shared();
        let shifts = self.shared_errors.iter().map(shift);
        let x = DVector::from_iterator(free.len() + shared, own.iter().copied().chain(shifts));
        let shared_values = &x.as_slice()[free.len()..];
        let whitening =
            self.whitening(&minimum.values, &Vec::new(), shared_values, (None, Hold::None)).ok()?;
        let Self { fitted, model, settings, initial, .. } = *self;
        let problem = Problem::new(fitted, model, settings, (free, &self.unknowns), initial, &whitening);
        let (residuals, jacobian) = problem.evaluate_at(&x);
        Some(Minimum {
            cost: 0.5 * residuals.norm_squared(),
            gradient: jacobian.tr_mul(&residuals),
            constraints: self.constraints(free).ok()?,
            x,
            shared,
            residuals,
            jacobian,
            whitening,
            ..minimum.clone()
        })
    }

    /// What a fit minimises, to tell which of two minima is the lower: the cost of all shots' distances, the squares of
    /// priors, and 2 ln σ of each observation whose noise was estimated.
    pub(super) fn objective(&self, minimum: &Minimum, groups: &[Group]) -> f64 {
        if are_filmed(self.fitted) {
            return 2.0 * minimum.cost;
        }
        let Minimum { residuals, weights, .. } = minimum;
        let losses = Losses::new(self.loss);
        let distances = robust::distances(self.fitted, residuals.as_slice(), weights);
        let of_shots: f64 =
            self.fitted.iter().zip(distances).map(|(shot, distance)| losses.of(shot).cost(distance)).sum();
        let rows: usize = self.fitted.iter().map(|shot| shot.plan.rows().len()).sum();
        let others = residuals.rows(rows, residuals.len() - rows).norm_squared();
        let of_noise = self.fitted.iter().flat_map(|shot| shot.plan.rows()).filter_map(|row| {
            let group = groups.iter().find(|group| group.observable == row.observable)?;
            // as many numbers as unknowns are met exactly, wherever that began
            let sd = if group.estimable { group.sd } else { noise::EXACT };
            row.measured.sd.is_none().then(|| 2.0 * sd.ln())
        });
        of_shots + others + of_noise.sum::<f64>()
    }

    /// Fits the free parameters, the others at their initial values, until the weights rest.
    pub(super) fn converge(&self, free: &[Parameter]) -> Result<(Minimum, Vec<Group>), FitError> {
        self.converge_with(free, Effort::FULL)
    }

    pub(super) fn converge_with(
        &self,
        free: &[Parameter],
        effort: Effort,
    ) -> Result<(Minimum, Vec<Group>), FitError> {
        // behind the free parameters, the error that all shots share
        let shared = self.shared();
        let filmed = are_filmed(self.fitted);
        let constraints = self.constraints(free)?;
        let of_shared = |i: usize| if filmed { self.unknowns[i].start } else { 0.0 };
        let start = DVector::from_iterator(
            free.len() + shared,
            free.iter().map(|p| self.start_of(*p)).chain((0..shared).map(of_shared)),
        );
        let mut x = constraints.nearest(&start).ok_or_else(|| {
            let texts: Vec<_> = self.relations.iter().map(|r| format!("\"{}\"", r.text)).collect();
            FitError::Relations(format!("no values within the bounds satisfy {}", texts.join(" and ")))
        })?;
        let mut values = problem::values(&self.initial, free, &x);
        let mut groups = if filmed { Vec::new() } else { self.first_noise(&values) };
        let uncertain = |shot: &Fitted| shot.plan.joint().is_some() || shot.plan.variance_in().amax() > 0.0;
        let robust = self.loss != Loss::Squares && !x.is_empty();
        let weights_move = !filmed && (!groups.is_empty() || robust || self.fitted.iter().any(uncertain));
        let is_rough = problem::is_rough(self.fitted);
        let options = match is_rough {
            true if filmed => FRAMES,
            true => effort.options.at_most(&FRAMES),
            false => effort.options,
        };
        let (at_rest, max_rounds) =
            if robust { (ROBUST_AT_REST, MAX_ROBUST_ROUNDS) } else { (AT_REST, MAX_ROUNDS) };
        let max_rounds = max_rounds.min(effort.rounds);
        // Cauchy's loss has many minima: the one that is meant is near Huber's
        let last = if robust { self.loss } else { Loss::Squares };
        let mut loss = if last == Loss::Cauchy { Loss::Huber } else { last };
        let mut losses = Losses::new(loss);
        let mut weights = vec![1.0; self.fitted.len()];
        let mut iterations = 0;
        let mut before: Option<Whitening> = None;
        // a scan of integrated shots looks for their inputs where they were measured
        let mut hold = if is_rough && !effort.crosses_kinks { Hold::Near } else { Hold::None };
        let mut at_kinks = 0;
        for round in 0.. {
            let sds: EstimatedSd = groups.iter().map(|g| (g.observable, g.sd)).collect();
            let shared_values = &x.as_slice()[free.len()..];
            let mut whitening = self.whitening(&values, &sds, shared_values, (before.as_ref(), hold))?;
            if robust {
                whitening = whitening.weighted(self.fitted, &weights);
            }
            if x.is_empty() {
                let Self { fitted, model, settings, initial, .. } = *self;
                let problem =
                    Problem::new(fitted, model, settings, (free, &self.unknowns), initial, &whitening);
                let (residuals, jacobian) = problem.evaluate_at(&x);
                self.reweigh(&mut groups, &values, &whitening, &jacobian, &losses, &weights);
                let minimum = Minimum {
                    values,
                    cost: 0.5 * residuals.norm_squared(),
                    gradient: x.clone(),
                    x,
                    shared,
                    residuals,
                    jacobian,
                    active: Vec::new(),
                    active_inequalities: Vec::new(),
                    constraints,
                    weights,
                    whitening,
                    termination: "nothing to fit: every parameter is fixed or silent".to_string(),
                    converged: true,
                    iterations: 0,
                };
                return Ok((minimum, groups));
            }
            let slice = Slice { search: self, free, constraints: constraints.clone(), whitening: &whitening };
            let (solution, at_kink, rough) = if filmed || is_rough && effort.crosses_kinks {
                let (solution, rests) =
                    least_squares::minimise_rough(|| slice.problem(), &x, &constraints, &options)?;
                let rough = rests && !solution.termination.converged();
                (solution, false, rough)
            } else if effort.crosses_kinks {
                let (solution, at_kink) = nonsmooth::minimise(&slice, &x, &options)?;
                (solution, at_kink, false)
            } else {
                (least_squares::minimise(slice.problem(), &x, &constraints, &options)?, false, false)
            };
            iterations += solution.iterations as usize;
            let step = &solution.x - &x;
            let (moved, in_errors) = (step.amax(), (&solution.jacobian * &step).norm());
            x = solution.x.clone();
            values = problem::values(&self.initial, free, &x);
            let mut changed =
                self.reweigh(&mut groups, &values, &whitening, &solution.jacobian, &losses, &weights);
            let used = weights.clone();
            if robust {
                let distances = robust::distances(self.fitted, solution.residuals.as_slice(), &weights);
                for ((weight, shot), distance) in weights.iter_mut().zip(self.fitted).zip(distances) {
                    let new = losses.of(shot).weight(distance).max(LEAST_WEIGHT);
                    changed = changed.max((new - *weight).abs());
                    *weight = new;
                }
            }
            if round >= PATIENCE {
                hold = hold.max(Hold::Near);
            }
            if round >= MAX_ROUNDS / 2 {
                hold = Hold::All;
            }
            at_kinks += usize::from(at_kink);
            let by_turns = at_kink
                && (in_errors < ERRORS_AT_KINK && changed < CHANGE_AT_KINK
                    || at_kinks >= ROUNDS_AT_KINK && in_errors < MORE_ERRORS_AT_KINK);
            let (patience, slow_at_rest) =
                if is_rough { (0, ROUGH_AT_REST) } else { (PATIENCE, SLOW_AT_REST) };
            let slow = round >= patience && in_errors.max(changed) < slow_at_rest;
            let rest = !weights_move || moved.max(changed) < at_rest || by_turns || slow;
            if rest && loss != last {
                loss = last;
                losses = Losses::new(loss);
                before = Some(whitening);
                continue;
            }
            if rest || round + 1 >= max_rounds || at_kinks >= MOST_AT_KINK {
                let converged = (solution.termination.converged() || at_kink || rough) && rest;
                let mut termination = solution.termination.to_string();
                if rough {
                    termination = if filmed { ROUGH } else { ROUGH_INTEGRATED }.to_string();
                }
                if at_kink {
                    termination = nonsmooth::TERMINATION.to_string();
                }
                if !rest {
                    termination =
                        format!("the weights did not come to rest in {} rounds; {termination}", round + 1);
                }
                let minimum = Minimum {
                    values,
                    x: solution.x,
                    shared,
                    cost: solution.cost,
                    gradient: solution.jacobian.tr_mul(&solution.residuals),
                    residuals: solution.residuals,
                    jacobian: solution.jacobian,
                    active: solution.active,
                    active_inequalities: solution.active_inequalities,
                    constraints,
                    weights: used,
                    whitening,
                    termination,
                    converged,
                    iterations,
                };
                return Ok((minimum, groups));
            }
            before = Some(whitening);
        }
        Err(FitError::NoWeights)
    }

    /// −2 log L up to a constant: χ² and the logarithms of the variances.
    pub(super) fn minus_two_log_likelihood(&self, minimum: &Minimum, groups: &[Group]) -> f64 {
        if are_filmed(self.fitted) {
            return 2.0 * minimum.cost;
        }
        let sds: EstimatedSd = groups.iter().map(|g| (g.observable, g.sd)).collect();
        let Minimum { values, whitening, .. } = minimum;
        let model = values.model(self.model);
        let log_det = |(number, Fitted { plan, .. }): (usize, &Fitted)| {
            let prediction = whitening.predict(number, plan, &model, &values.coefficients).ok()?;
            let l = covariance(plan, &prediction, &sds).cholesky()?.l();
            Some(2.0 * l.diagonal().iter().map(|d| d.ln()).sum::<f64>())
        };
        let shots = self.fitted.iter().enumerate();
        let log_det = shots.map(|shot| log_det(shot).unwrap_or(f64::NAN)).sum::<f64>();
        2.0 * minimum.cost + log_det
    }
}
