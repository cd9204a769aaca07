//! The search for the minimum: weights, optimiser, and again until the weights rest.

use nalgebra::DVector;

use super::effort::Effort;
use super::minimum::Minimum;
use super::noise::Group;
use super::robust;
use super::robust::Losses;
use super::samples::Search;
use super::slice::Slice;
use super::{FitError, noise, nonsmooth, side_spin};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::{Sample, Unknown, shared_columns};
use crate::likelihood::whitening::{At, Hold, Whitening, covariance};
use crate::measurement::dataset::{Measured, Shared};
use crate::measurement::loss::Loss;
use crate::measurement::values::Values;
use crate::numerics::least_squares::{self, Bounds, Solution, Termination};

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

/// Frames are minimised to a small part of a standard error: landings make χ² a little rough.
const FRAMES: least_squares::Options = least_squares::Options { max_iterations: 50, orthogonality: 1e-6 };
const ROUGH: &str = "converged: as far as landings between frames leave χ² smooth";

/// So are integrated collisions, which are as precise as their tolerance.
const ROUGH_INTEGRATED: &str = "converged: as far as the tolerance of integrated collisions leaves χ² smooth";

/// A shot's weight never vanishes, so that its distance can be told from its weighted residuals.
const LEAST_WEIGHT: f64 = 1e-12;

/// Where a minimisation with given weights ended.
#[derive(Clone, Copy, PartialEq)]
enum End {
    /// As the solution says.
    Smooth,
    /// At a kink.
    Kink,
    /// As near to the minimum as a χ² that is a little rough lets it.
    Rough,
}

impl End {
    fn in_words(self, solution: &Solution, filmed: bool) -> String {
        match self {
            Self::Kink => nonsmooth::TERMINATION.to_owned(),
            Self::Rough if filmed => ROUGH.to_owned(),
            Self::Rough => ROUGH_INTEGRATED.to_owned(),
            Self::Smooth => solution.termination.to_string(),
        }
    }
}

impl Slice<'_> {
    /// The minimum with the weights as they are.
    fn minimised(
        &self,
        x: &DVector<f64>,
        options: &least_squares::Options,
        crosses_kinks: bool,
    ) -> Result<(Solution, End), FitError> {
        if self.search.is_filmed() || self.search.is_rough() && crosses_kinks {
            let (solution, rests) =
                least_squares::minimise_with_restart(|| self.problem(), x, &self.bounds, options)?;
            let end = if rests && !solution.termination.converged() { End::Rough } else { End::Smooth };
            return Ok((solution, end));
        }
        if crosses_kinks {
            let (solution, at_kink) = nonsmooth::minimise(self, x, options)?;
            let stalls = solution.termination == Termination::Stalled && self.search.is_integrated();
            let end = if at_kink {
                End::Kink
            } else if stalls {
                End::Rough
            } else {
                End::Smooth
            };
            return Ok((solution, end));
        }
        Ok((least_squares::minimise(self.problem(), x, &self.bounds, options)?, End::Smooth))
    }
}

impl Search<'_> {
    /// With the inputs of the shots estimated anew from where they were; `x`: where the errors that shots share are, behind the
    /// free unknowns.
    pub(super) fn whitening(
        &self,
        at: &[Values],
        groups: &[Group],
        (free, x): (usize, &DVector<f64>),
        (before, hold): (Option<&[Whitening]>, Hold),
    ) -> Result<Vec<Whitening>, FitError> {
        let (columns, _) = shared_columns(&self.samples, free);
        let of = |(i, sample): (usize, &Sample)| {
            if sample.is_filmed() {
                return Ok(Whitening::default());
            }
            let shared: Vec<f64> = columns[i].iter().map(|column| x[*column]).collect();
            let at = At {
                model: &at[i].model(sample.model),
                coefficients: &at[i].coefficients(),
                estimated: &noise::of_dataset(groups, sample.dataset),
                hold,
                shared_errors: &sample.shared_errors,
                shared: &shared,
            };
            Whitening::new(sample.fitted, &at, before.and_then(|before| before.get(i)))
                .ok_or(FitError::NoWeights)
        };
        self.samples.iter().enumerate().map(of).collect()
    }

    /// With a weight for each shot's part of χ².
    pub(super) fn weighted(&self, whitening: Vec<Whitening>, weights: &[f64]) -> Vec<Whitening> {
        let mut rest = weights;
        let weighted = |(whitening, sample): (Whitening, &Sample)| {
            let (own, others) = rest.split_at(sample.fitted.len());
            rest = others;
            whitening.weighted(sample.fitted, own)
        };
        whitening.into_iter().zip(&self.samples).map(weighted).collect()
    }

    /// These shots, of which velocities are fitted, at a minimum of their frames, μ_k and μ_r being the first of their film's unknowns.
    /// `cloths`: μ_k and μ_r with which the velocities of each sample were extracted.
    pub(crate) fn at(
        &self,
        filmed: &Self,
        (free, minimum): (&[Unknown], &Minimum),
        cloths: &[(Option<Measured>, Option<Measured>)],
    ) -> Option<Minimum> {
        let further =
            |value: f64, known: Option<Measured>, sd: f64| (value - known.map_or(value, |k| k.value)) / sd;
        let (places, columns) = shared_columns(&self.samples, free.len());
        let (films, _) = shared_columns(&filmed.samples, free.len());
        let mut x = DVector::zeros(columns);
        x.rows_mut(0, free.len()).copy_from(&minimum.x.rows(0, free.len()));
        let shared = columns - free.len();
        for (i, (sample, (sliding, rolling))) in self.samples.iter().zip(cloths).enumerate() {
            for (k, (which, sd)) in sample.shared_errors.iter().enumerate() {
                x[places[i][k]] = match which {
                    Shared::Sliding => further(minimum.x[*films[i].first()?], *sliding, *sd),
                    Shared::Rolling => further(minimum.x[*films[i].get(1)?], *rolling, *sd),
                    // the model's own, and the camera's as it was found
                    Shared::Lift | Shared::Camera(_) => 0.0,
                };
            }
        }
        let whitening = self.whitening(&minimum.values, &[], (free.len(), &x), (None, Hold::None)).ok()?;
        let (residuals, jacobian) = self.problem(free, &whitening).evaluate_at(&x);
        Some(Minimum {
            cost: 0.5 * residuals.norm_squared(),
            gradient: jacobian.tr_mul(&residuals),
            bounds: self.bounds(free),
            x,
            shared,
            filmed: false,
            residuals,
            jacobian,
            whitening,
            ..minimum.clone()
        })
    }

    /// What a fit minimises, to tell which of two minima is the lower: the cost of all shots' distances, the squares of
    /// priors, and 2 ln σ of each observation whose noise was estimated.
    pub(super) fn objective(&self, minimum: &Minimum, groups: &[Group]) -> f64 {
        let of_velocities = || self.samples.iter().filter(|sample| !sample.is_filmed());
        if of_velocities().next().is_none() && !self.is_robust() {
            return 2.0 * minimum.cost;
        }
        let losses: Vec<Losses> = self.samples.iter().map(|sample| Losses::new(sample.loss)).collect();
        let (mut of_shots, mut row) = (0.0, 0);
        let mut weights = minimum.weights.as_slice();
        for (sample, losses) in self.samples.iter().zip(&losses) {
            let (own, others) = weights.split_at(sample.fitted.len());
            weights = others;
            let residuals = &minimum.residuals.as_slice()[row..row + sample.rows()];
            row += sample.rows();
            if sample.is_filmed() && sample.loss == Loss::Squares {
                of_shots += residuals.iter().map(|r| r * r).sum::<f64>();
                continue;
            }
            let distances = robust::distances(sample.fitted.iter(), residuals, own);
            let cost = |(shot, distance): (&Fitted, f64)| losses.of(shot).cost(distance) + shot.least_chi2();
            of_shots += sample.fitted.iter().zip(distances).map(cost).sum::<f64>();
        }
        let others = minimum.residuals.rows(row, minimum.residuals.len() - row).norm_squared();
        let of_noise = of_velocities()
            .flat_map(|sample| {
                sample.fitted.iter().flat_map(|shot| shot.plan.rows()).map(|row| (sample.dataset, row))
            })
            .filter_map(|(dataset, row)| {
                let group = groups.iter().find(|group| group.is_of(dataset, row.observable))?;
                // as many numbers as unknowns are met exactly, wherever that began
                let sd = if group.estimable { group.sd } else { noise::EXACT };
                row.measured.sd.is_none().then(|| 2.0 * sd.ln())
            });
        of_shots + others + of_noise.sum::<f64>()
    }

    /// Fits the free unknowns, the others at their initial values, until the weights rest.
    pub(super) fn converge(&self, free: &[Unknown]) -> Result<(Minimum, Vec<Group>), FitError> {
        self.converge_with(free, Effort::FULL)
    }

    pub(super) fn converge_with(
        &self,
        free: &[Unknown],
        effort: Effort,
    ) -> Result<(Minimum, Vec<Group>), FitError> {
        // behind the free unknowns, what shots share besides
        let (_, columns) = shared_columns(&self.samples, free.len());
        let shared = columns - free.len();
        let filmed = self.is_filmed();
        let bounds = self.bounds(free);
        let mut x = bounds.clamp(&self.start(free));
        let mut values = self.values(free, &x);
        let mut groups = self.first_noise(&values);
        let uncertain = |shot: &Fitted| shot.plan.joint().is_some() || shot.plan.variance_in().amax() > 0.0;
        let robust = self.is_robust() && !x.is_empty();
        let mut velocities = self.samples.iter().filter(|sample| !sample.is_filmed());
        let side_spins = self.shots().any(Fitted::has_side_spin);
        let weights_move =
            robust || side_spins || velocities.any(|s| !groups.is_empty() || s.fitted.iter().any(uncertain));
        let is_rough = self.is_rough();
        let options = match is_rough {
            true if filmed => FRAMES,
            true => effort.options.at_most(&FRAMES),
            false => effort.options,
        };
        let (at_rest, max_rounds) =
            if robust { (ROBUST_AT_REST, MAX_ROBUST_ROUNDS) } else { (AT_REST, MAX_ROUNDS) };
        let max_rounds = max_rounds.min(effort.rounds);
        // Cauchy's loss has many minima: the one that is meant is near Huber's
        let mut softly = robust && self.samples.iter().any(|sample| sample.loss == Loss::Cauchy);
        let mut losses = self.losses(robust, softly);
        let mut weights = vec![1.0; self.count()];
        let mut iterations = 0;
        let mut before: Option<Vec<Whitening>> = None;
        let mut last: Option<Solution> = None;
        // a scan of integrated shots looks for their inputs where they were measured
        let mut hold = if is_rough && !effort.crosses_kinks { Hold::Near } else { Hold::None };
        let mut at_kinks = 0;
        for round in 0.. {
            let mut whitening =
                self.whitening(&values, &groups, (free.len(), &x), (before.as_deref(), hold))?;
            if robust {
                whitening = self.weighted(whitening, &weights);
            }
            if x.is_empty() {
                let minimum = self.all_held(values, (weights, whitening), bounds, shared);
                let Minimum { values, whitening, jacobian, weights, .. } = &minimum;
                self.reweigh(&mut groups, values, whitening, jacobian, &losses, weights);
                return Ok((minimum, groups));
            }
            if let Some(last) = last.as_ref().filter(|_| side_spins) {
                whitening = side_spin::integrated_over(self, free, (whitening, &groups), last);
            }
            let slice = Slice::new(self, free, bounds.clone(), &whitening);
            let (solution, end) = slice.minimised(&x, &options, effort.crosses_kinks)?;
            let (at_kink, rough) = (end == End::Kink, end == End::Rough);
            iterations += solution.iterations as usize;
            let step = &solution.x - &x;
            let (moved, in_errors) = (step.amax(), (&solution.jacobian * &step).norm());
            x = solution.x.clone();
            values = self.values(free, &x);
            let mut changed =
                self.reweigh(&mut groups, &values, &whitening, &solution.jacobian, &losses, &weights);
            let used = weights.clone();
            if robust {
                changed = changed.max(self.reweigh_shots(&mut weights, &losses, &solution.residuals));
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
                if is_rough || side_spins { (0, ROUGH_AT_REST) } else { (PATIENCE, SLOW_AT_REST) };
            let slow = round >= patience && in_errors.max(changed) < slow_at_rest;
            let rests = moved.max(changed) < at_rest || by_turns || slow;
            let rest = !weights_move || rests && (round > 0 || !side_spins);
            if rest && softly {
                softly = false;
                losses = self.losses(robust, softly);
                before = Some(whitening);
                continue;
            }
            if rest || round + 1 >= max_rounds || at_kinks >= MOST_AT_KINK {
                let converged = (solution.termination.converged() || at_kink || rough) && rest;
                let how = end.in_words(&solution, filmed);
                let unrest = format!("the weights did not come to rest in {} rounds; {how}", round + 1);
                let minimum = Minimum {
                    values,
                    x: solution.x,
                    shared,
                    filmed,
                    cost: solution.cost,
                    gradient: solution.jacobian.tr_mul(&solution.residuals),
                    residuals: solution.residuals,
                    jacobian: solution.jacobian,
                    active: solution.active,
                    bounds,
                    weights: used,
                    whitening,
                    termination: if rest { how } else { unrest },
                    converged,
                    iterations,
                };
                return Ok((minimum, groups));
            }
            before = Some(whitening);
            last = Some(solution);
        }
        Err(FitError::NoWeights)
    }

    /// Where nothing is to be fitted.
    fn all_held(
        &self,
        values: Vec<Values>,
        (weights, whitening): (Vec<f64>, Vec<Whitening>),
        bounds: Bounds,
        shared: usize,
    ) -> Minimum {
        let x = DVector::zeros(0);
        let (residuals, jacobian) = self.problem(&[], &whitening).evaluate_at(&x);
        Minimum {
            values,
            cost: 0.5 * residuals.norm_squared(),
            gradient: x.clone(),
            x,
            shared,
            filmed: self.is_filmed(),
            residuals,
            jacobian,
            active: Vec::new(),
            bounds,
            weights,
            whitening,
            termination: "nothing to fit: every parameter is fixed or silent".to_string(),
            converged: true,
            iterations: 0,
        }
    }

    /// The losses of all samples: none where there is nothing to be robust for, and Huber's in the place of Cauchy's while that is taken
    /// softly.
    fn losses(&self, robust: bool, softly: bool) -> Vec<Losses> {
        let of = |sample: &Sample| match sample.loss {
            _ if !robust => Loss::Squares,
            Loss::Cauchy if softly => Loss::Huber,
            loss => loss,
        };
        self.samples.iter().map(|sample| Losses::new(of(sample))).collect()
    }

    /// Weighs the shots anew by their distances; how much the weight that changed most did.
    fn reweigh_shots(&self, weights: &mut [f64], losses: &[Losses], residuals: &DVector<f64>) -> f64 {
        let distances = robust::distances(self.shots(), residuals.as_slice(), weights);
        let of_shots = self.samples.iter().zip(losses);
        let of_shots = of_shots.flat_map(|(sample, losses)| sample.fitted.iter().map(move |s| losses.of(s)));
        let mut changed: f64 = 0.0;
        for ((weight, loss), distance) in weights.iter_mut().zip(of_shots).zip(distances) {
            let new = loss.weight(distance).max(LEAST_WEIGHT);
            changed = changed.max((new - *weight).abs());
            *weight = new;
        }
        changed
    }

    /// −2 log L up to a constant: χ² and the logarithms of the variances.
    pub(super) fn minus_two_log_likelihood(&self, minimum: &Minimum, groups: &[Group]) -> f64 {
        let mut log_det = 0.0;
        for (i, sample) in self.samples.iter().enumerate().filter(|(_, sample)| !sample.is_filmed()) {
            let sds = noise::of_dataset(groups, sample.dataset);
            let values = &minimum.values[i];
            let model = values.model(sample.model);
            let of = |(number, Fitted { plan, .. }): (usize, &Fitted)| {
                let whitening = &minimum.whitening[i];
                let prediction = whitening.predict(number, plan, &model, &values.coefficients()).ok()?;
                let l = covariance(plan, &prediction, &sds).cholesky()?.l();
                Some(2.0 * l.diagonal().iter().map(|d| d.ln()).sum::<f64>())
            };
            log_det += sample.fitted.iter().enumerate().map(|shot| of(shot).unwrap_or(f64::NAN)).sum::<f64>();
        }
        minimum.chi2() + log_det
    }
}
