//! The fit itself: shots to plans, weights, the optimiser, and again until the weights rest.

use std::time::Instant;

use nalgebra::DMatrix;

use super::diagnostics::{goodness, other_models};
use super::frames::{FittedFrames, bound, cloth_of, filmed, joint_fit, outlying};
use super::intervals::profile;
use super::intervals::{bootstrap, confidence_region};
use super::robust::{Robust, Sandwich};
use super::rows::{noise_rows, residual_rows};
use super::samples::Search;
use super::settled::Settled;
use super::slice::Slice;
use super::uncertainty;
use super::uncertainty::{Minimum, Quantiles};
use super::{
    Depth, Diagnostics, Estimate, Films, Fit, FitError, FrictionCurve, Intervals, Method, Options, Plateau,
    Rejected, Status, causes, fidelity_choice, scatter, starts,
};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::frames;
use crate::likelihood::frames::shared_unknowns;
use crate::likelihood::sample::Sample;
use crate::likelihood::whitening::EstimatedSd;
use crate::measurement::dataset::{Dataset, DiscShot, Shot};
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Compliance, Parameter, Settings};
use crate::measurement::relation::Relation;
use crate::measurement::values::Values;
use crate::physics::collision::{Effects, Model};
use crate::physics::friction_law::Law;

/// With more shots than this the profiles, the regions of pairs of parameters and the other models, some hundred fits,
/// would take longer than reading and extracting…
const MANY_SHOTS: usize = 20_000;
/// …with so many shots whose frames are fitted, which takes a hundred times as long, the regions and other models…
const MANY_FILMED: usize = 100;
/// …and with so many the profiles.
const MANY_PROFILED: usize = 500;

/// What a fit of so many shots can find out about itself in a time that is worth it.
fn affordable(depth: Depth, shots: usize, method: Method) -> Depth {
    let most = match method {
        Method::TwoStage if shots > MANY_SHOTS => Depth::Estimates,
        Method::Joint if shots > MANY_PROFILED => Depth::Estimates,
        Method::Joint if shots > MANY_FILMED => Depth::Intervals,
        _ => Depth::Everything,
    };
    depth.min(most)
}

/// What the shots of a data set are fitted with: model, settings, and where a search begins.
///
/// # Errors
/// A contact that is stated to give way, at a fidelity that takes it as rigid.
pub(crate) fn fitted_with(
    dataset: &Dataset,
    options: &Options,
) -> Result<(Model, Settings, Values), FitError> {
    let mut model = dataset.model(options.fidelity);
    model.tolerance = options.tolerance;
    model.effects = options.effects.unwrap_or(model.effects);
    let settings = options.falling.applied(dataset.settings_of_balls());
    let initial = Values::usual(&settings);
    if settings.falls {
        model.law = Law::Exponential { b: initial.b, c: initial.c };
    }
    if settings.compliance == Compliance::Stated {
        if !options.auto && !options.fidelity.effects().compliance {
            return Err(FitError::Rigid { dataset: dataset.name.clone(), fidelity: options.fidelity.name() });
        }
        model.kappa = initial.kappa;
    }
    Ok((model, settings, initial))
}

/// Fits some shots of a data set (all, or those of one label).
pub(super) fn fit_shots(
    dataset: &Dataset,
    shots: &[&Shot],
    films: &Films,
    group: Option<(String, String)>,
    options: &Options,
    done: &(dyn Fn() + Sync),
) -> Result<Fit, FitError> {
    let begun = Instant::now();
    let (mut model, mut settings, initial) = fitted_with(dataset, options)?;
    let discs = dataset.tracks.as_ref().and_then(|tracks| tracks.discs);
    let (mut fitted, mut shots_rejected) = plan(shots, &model, &initial);
    let left_out =
        dataset.left_out.iter().map(|(shot, reason)| Rejected { shot: shot.clone(), reason: reason.clone() });
    shots_rejected.splice(0..0, left_out);
    if fitted.is_empty() {
        return Err(FitError::NoUsableShot { dataset: title(dataset, group.as_ref()), shots_rejected });
    }
    check_noise(dataset, shots, &fitted)?;
    let depth = affordable(options.depth, fitted.len(), options.method);

    let loss = options.loss.unwrap_or(dataset.loss);
    let sample = Sample { loss, ..Sample::of(dataset, &[], (&model, &settings, initial)) };
    let search = Search::of(sample);
    let name = title(dataset, group.as_ref());
    let named = |error| named(error, dataset, &name);
    // what is fixed stays where it is
    let has = settings.parameters();
    let fixed = |p: &Parameter| settings[*p].fixed || !has.contains(p);
    let near = |near: Values| {
        Parameter::ALL.into_iter().filter(fixed).fold(near, |near, p| near.with(p, initial[p]))
    };
    let mut starts: Vec<Vec<Values>> = options.near.map(|start| vec![near(start)]).into_iter().collect();
    let (mut left_out, mut gives_way) = (Vec::new(), None);
    let mut scatter = None;
    let (mut of_discs, mut other_minima) = (None, Vec::new());
    if discs.is_some() {
        let chosen = scatter::choose(&fitted, &search, options.auto).map_err(named)?;
        (left_out, gives_way) = (chosen.notes, chosen.gives_way);
        starts = chosen.starts.into_iter().map(|start| vec![start]).collect();
        (fitted, scatter) = (chosen.fitted, Some(chosen.scatter));
        (of_discs, other_minima) = (Some((chosen.model, chosen.settings)), chosen.rivals);
    } else if options.auto {
        let chosen =
            fidelity_choice::choose(std::slice::from_mut(&mut fitted), &search, &starts).map_err(named)?;
        (starts, left_out, gives_way) = (chosen.starts, chosen.notes, chosen.gives_way);
    } else if model.fidelity.is_integrated() {
        starts = fidelity_choice::integrate(std::slice::from_mut(&mut fitted), &search).map_err(named)?;
    }
    if let Some(of_discs) = of_discs {
        (model, settings) = of_discs;
    } else if gives_way.is_some() {
        settings.compliance = Compliance::Stated;
        model.kappa = initial.kappa;
    }
    let settings = &settings;
    let sample = Sample { loss, ..Sample::of(dataset, &fitted, (&model, settings, initial)) };
    let search = Search::of(sample);
    let with_films;
    let joint;
    let (first, settled) = if options.method == Method::Joint {
        if search.is_robust() {
            return Err(FitError::JointLoss(name));
        }
        // from where the two stages end, and from their other minima: frames are too costly to be scanned
        let settled = Settled::near_starts(&search, &starts).map_err(named)?;
        with_films = filmed(&fitted, films).ok_or_else(|| FitError::NotFilmed(name.clone()))?;
        let mut unknowns = shared_unknowns::of_fit(options.film.unknowns());
        for (unknown, start) in unknowns.iter_mut().zip(cloth_of(&settled.minimum, dataset)) {
            unknown.start = start;
        }
        joint = Search::of(Sample { fitted: &with_films, unknowns, ..search.first().clone() });
        let minima = settled.starts_nearby();
        let of_frames = Settled::from_starts(&joint, &minima);
        let odd = of_frames.as_ref();
        let odd = odd.map_or(Vec::new(), |found| outlying(&with_films, found.minimum.residuals.as_slice()));
        if !odd.is_empty() {
            let odd: Vec<(usize, f64)> =
                odd.into_iter().map(|(place, reduced)| (with_films[place].index, reduced)).collect();
            return without(dataset, (shots, films), &odd, group, options, done);
        }
        (&joint, of_frames)
    } else {
        (&search, Settled::near_starts(&search, &starts))
    };
    let (settled, starts) = starts::settle(first, settled.map_err(named)?, options);
    let rivals = if discs.is_some() { other_minima } else { settled.rivals() };
    // weights that hold the scatter of one model compare no other
    let alternatives = if depth >= Depth::Everything && discs.is_none() {
        other_models::compare(first, &settled)
    } else {
        Vec::new()
    };
    let found = settled.clone();
    let Settled { search, free: unknowns, minimum, estimated, plateaus, identifiability, .. } = settled;
    let (sample, at) = (search.first(), minimum.first());
    let free: Vec<Parameter> = unknowns.iter().map(|unknown| unknown.parameter).collect();
    let plateaus: Vec<Plateau> = plateaus.into_iter().map(|(_, plateau)| plateau).collect();
    let is_filmed = search.is_filmed();
    let dof = search.dof(&unknowns, minimum.room());
    let knows_noise = estimated.iter().all(|group| group.estimable);
    let estimates_noise = !estimated.is_empty();
    let sandwich = Sandwich::new(&search, &minimum, free.len());
    let scatters = scatter.as_ref().is_some_and(|scatter| !scatter.is_none());
    // honest errors come of the scatter of the shots
    let estimated_dof = match &sandwich {
        _ if scatters => Some(fitted.len().saturating_sub(free.len()).max(1)),
        Some(_) => Some(fitted.len() - free.len()),
        None => estimates_noise.then_some(dof),
    };
    let quantiles = Quantiles::new(estimated_dof).filter(|_| knows_noise);
    let mut uncertainty = uncertainty::of(&minimum, &free, settings, quantiles.as_ref(), sandwich.as_ref());
    let mut lowest = minimum.cost;
    let mut contours = Vec::new();
    if let (true, None, Some(quantiles)) = (depth >= Depth::Intervals, &sandwich, &quantiles) {
        let constraints = minimum.constraints.clone();
        let slice = Slice { search: &search, free: &unknowns, constraints, whitening: &minimum.whitening };
        let profiles;
        (profiles, lowest) = profile::intervals(&slice, &minimum, &uncertainty.estimates, quantiles);
        for (estimate, profile) in uncertainty.estimates.iter_mut().zip(profiles) {
            estimate.choose_interval(profile);
        }
        if depth >= Depth::Everything {
            contours = confidence_region::contours(&slice, &minimum, estimated_dof);
        }
    }
    // what others hang on is not silent, even where it may be anywhere
    if uncertainty.estimates.iter().all(|estimate| estimate.std_error_at_bound.is_none()) {
        for estimate in &mut uncertainty.estimates {
            *estimate = estimate.unless_uninformed(&settings[estimate.parameter]);
        }
        let silent = uncertainty.estimates.iter().filter(|e| e.status == Status::NotIdentified);
        let silent: Vec<Parameter> = silent.map(|estimate| estimate.parameter).collect();
        contours.retain(|contour| !contour.parameters.iter().any(|p| silent.contains(p)));
    }
    let parameters = settings.parameters();
    let estimate = |&parameter: &Parameter| {
        let setting = &settings[parameter];
        let own = free.iter().position(|p| *p == parameter);
        let plateau = plateaus.iter().find(|plateau| plateau.parameter == parameter);
        match (own, plateau) {
            (Some(column), _) => uncertainty.estimates[column],
            (None, Some(plateau)) => Estimate {
                parameter,
                value: plateau.edge,
                std_error: None,
                interval_95: quantiles.as_ref().map(|quantiles| {
                    let t = quantiles.one_sided;
                    search.plateau_interval(plateau, &minimum, &estimated, t)
                }),
                intervals: Intervals::default(),
                std_error_at_bound: None,
                status: Status::Free,
            },
            (None, None) => Estimate {
                parameter,
                value: at[parameter],
                std_error: None,
                interval_95: None,
                intervals: Intervals::default(),
                std_error_at_bound: None,
                status: if setting.fixed { Status::Fixed } else { Status::NotIdentified },
            },
        }
    };
    let estimates = parameters.iter().map(estimate).collect();
    let mut correlation = DMatrix::from_element(parameters.len(), parameters.len(), f64::NAN);
    for (i, a) in free.iter().enumerate() {
        for (j, b) in free.iter().enumerate() {
            let place = |p: &Parameter| parameters.iter().position(|known| known == p);
            let (Some(row), Some(column)) = (place(a), place(b)) else { continue };
            correlation[(row, column)] = uncertainty.correlation[(i, j)];
        }
    }
    let at_minimum = at.model(&model);
    let sds: EstimatedSd = estimated.iter().map(|g| (g.observable, g.sd)).collect();
    // what is said of residuals is said of what was extracted, also where frames were fitted
    let plain = search.with(|_, sample| sample.fitted = &fitted);
    let cloth = [(dataset.sliding, dataset.rolling)];
    let of_velocities = if is_filmed { plain.at(&search, (&unknowns, &minimum), &cloth) } else { None };
    let seen = of_velocities.as_ref().unwrap_or(&minimum);
    let residuals = residual_rows((&plain, 0), |index| &shots[index].name, seen, &estimated);
    let noise = noise_rows(&fitted, &residuals, &estimated);
    let context = goodness::Context {
        shots,
        fitted: &fitted,
        model: &at_minimum,
        minimum: seen,
        free: &free,
        sds: &sds,
        dof: plain.dof(&unknowns, seen.room()),
        tests_noise: !estimates_noise && !scatters && !search.is_robust(),
    };
    let frames = is_filmed
        .then(|| FittedFrames::new(shots, sample.fitted, &model, &minimum, (&free, &sample.unknowns)));
    let measured = match &frames {
        Some(_) => frames::ROWS * fitted.len(),
        None => plain.observations(),
    };
    let kinks_from = minimum.residuals.len() - minimum.whitening[0].kink_rows();
    let priors_of_all = minimum.residuals.rows_range(measured..kinks_from).norm_squared();
    let prior_chi2 = priors_of_all + frames.as_ref().map_or(0.0, FittedFrames::prior_chi2);
    let resampled = options.bootstrap > 0 && !free.is_empty();
    let diagnostics = Diagnostics {
        computed: fidelity_choice::computed(&plain),
        identifiability,
        goodness: Some(goodness::goodness(&context)),
        robust: search.is_robust().then(|| robust_weights(&search, shots, &minimum)),
        relations: relations(&search, &minimum),
        starts,
        bootstrap: resampled.then(|| {
            bootstrap::bootstrap(&search, (&context, &unknowns), options.bootstrap, options.seed, done)
        }),
        contours,
        alternatives,
        joint: is_filmed
            .then(|| joint_fit(sample.fitted, &minimum, &sample.unknowns, (2.0 * minimum.cost, dof))),
        bound: bound(&search, &unknowns, &minimum, films, cloth_of(&minimum, dataset)),
        // what else lets doubt is found below
        ..Diagnostics::default()
    };
    // an effect is in the fit if it is in a shot
    let mut effects = Effects::NONE.list().to_vec();
    for of_shots in &diagnostics.computed {
        for ((_, all), (_, on)) in effects.iter_mut().zip(of_shots.effects.list()) {
            *all |= on;
        }
    }
    let in_groups = group.is_some();
    let mut fit = Fit {
        dataset: dataset.name.clone(),
        group,
        path: dataset.path.clone(),
        cloth: dataset.cloth.clone(),
        source: dataset.source.clone(),
        ball: dataset.ball,
        discs,
        sliding: dataset.sliding,
        rolling: dataset.rolling,
        fidelity: if options.auto { "auto" } else { options.fidelity.name() },
        method: options.method,
        footage: dataset.tracks.is_some(),
        effects,
        estimates,
        correlation,
        chi2: 2.0 * minimum.cost,
        prior_chi2,
        dof,
        noise,
        shots_used: fitted.len(),
        shots_rejected,
        shots_doubtful: doubtful(dataset, shots, &fitted),
        disc_shots: disc_shots(dataset, shots, in_groups),
        scatter,
        friction_curve: None,
        camera: None,
        explanations: Vec::new(),
        refuted: None,
        residuals,
        frames,
        termination: minimum.termination.clone(),
        converged: minimum.converged,
        iterations: minimum.iterations,
        seconds: 0.0,
        diagnostics,
        warnings: Vec::new(),
        notes: Vec::new(),
    };
    fit.friction_curve = friction_curve(&fit, &model, at);
    let used: Vec<&Shot> = fitted.iter().map(|shot| shots[shot.index]).collect();
    super::diagnostics::refuted::judge(&mut fit, &used);
    // footage is corrected anew for a contact that gives way, and looked at then
    let is_settled = gives_way.is_none() || !fit.footage || discs.is_some();
    let is_asked = options.explain || (options.depth >= Depth::Everything && causes::is_called_for(&fit));
    if is_settled && is_asked {
        fit.explanations = causes::explain(&found, &search, discs.is_some());
    }
    if is_settled && options.explain && fit.explanations.is_empty() {
        fit.notes.push(causes::none_found(&found, &search, discs.is_some()));
    }
    super::warnings::add(&mut fit, &fitted, knows_noise);
    if fit.refuted.is_none() {
        super::warnings::add_lower(&mut fit, 2.0 * lowest);
    }
    fit.notes.extend(left_out);
    super::warnings::add_plateaus(&mut fit, &plateaus);
    if fit.refuted.is_none() {
        super::doubts::add_rivals(&mut fit, &rivals);
    }
    super::doubts::add_below_bound(&mut fit);
    super::warnings::add_tracks(&mut fit, dataset, shots);
    if depth < options.depth {
        let profiles = match depth {
            Depth::Estimates => "the intervals are those of the curvature of χ²; its profiles, ",
            _ => "",
        };
        fit.notes.push(format!(
            "With so many shots {profiles}the regions of pairs of parameters and other models are left out."
        ));
    }
    let sentences = fit.explanations.iter().map(|explanation| explanation.sentence.clone());
    fit.warnings.splice(0..0, sentences.collect::<Vec<_>>());
    if let Some(lower) = gives_way {
        fit.adopt_compliance(lower);
    }
    fit.seconds = begun.elapsed().as_secs_f64();
    Ok(fit)
}

/// The fit of the other shots, where the frames of some fit no collision that fits theirs: places among `shots`, and χ²/dof.
fn without(
    dataset: &Dataset,
    (shots, films): (&[&Shot], &Films),
    odd: &[(usize, f64)],
    group: Option<(String, String)>,
    options: &Options,
    done: &(dyn Fn() + Sync),
) -> Result<Fit, FitError> {
    let is_odd = |i: &usize| odd.iter().any(|(place, _)| place == i);
    let kept: Vec<usize> = (0..shots.len()).filter(|i| !is_odd(i)).collect();
    let kept_shots: Vec<&Shot> = kept.iter().map(|i| shots[*i]).collect();
    let kept_films: Vec<_> = kept.iter().map(|i| films.get(*i).cloned().flatten()).collect();
    let mut fit = fit_shots(dataset, &kept_shots, &kept_films, group, options, done)?;
    let rejected = odd.iter().map(|(place, reduced)| fits_no_collision(&shots[*place].name, *reduced));
    fit.shots_rejected.extend(rejected);
    Ok(fit)
}

/// Why a shot is left out whose frames have this χ²/dof.
pub(crate) fn fits_no_collision(shot: &str, reduced: f64) -> Rejected {
    let reduced = super::warnings::to_digits(reduced, 3);
    let reason = format!("its frames fit no collision that fits the other shots: their χ²/dof is {reduced}");
    Rejected { shot: shot.to_owned(), reason }
}

/// An error of a search, with the name of the data set.
fn named(error: FitError, dataset: &Dataset, name: &str) -> FitError {
    match error {
        FitError::TooFewObservations { observations, parameters, .. } => {
            FitError::TooFewObservations { dataset: name.to_string(), observations, parameters }
        }
        FitError::Relations(what) => {
            FitError::Relations(format!("{}: [fit] constraints: {what}", dataset.path.display()))
        }
        other => other,
    }
}

fn robust_weights(search: &Search, shots: &[&Shot], minimum: &Minimum) -> Robust {
    let weights = search.shots().zip(&minimum.weights);
    let mut weights: Vec<(String, f64)> = weights
        .filter(|(_, weight)| **weight < 1.0)
        .map(|(shot, weight)| (shots[shot.index].name.clone(), *weight))
        .collect();
    weights.sort_by(|a, b| a.1.total_cmp(&b.1));
    Robust { loss: search.first().loss, weights }
}

/// The constraints between parameters, and whether they hold with equality.
fn relations(search: &Search, minimum: &Minimum) -> Vec<(String, bool)> {
    /// Of the terms of a sum that is held exactly.
    const ROUNDING: f64 = 1e-9;
    let state = |relation: &Relation| {
        let terms = Parameter::ALL.map(|p| relation.coefficients[p as usize] * minimum.first()[p]);
        let size = relation.limit.abs() + terms.iter().map(|t| t.abs()).sum::<f64>();
        let slack = relation.limit - terms.iter().sum::<f64>();
        (relation.text.clone(), slack.abs() <= ROUNDING * size)
    };
    search.first().relations.iter().map(state).collect()
}

/// How an error names what is fitted.
fn title(dataset: &Dataset, group: Option<&(String, String)>) -> String {
    match group {
        Some((column, label)) => format!("{} ({column} {label})", dataset.name),
        None => dataset.name.clone(),
    }
}

/// The shots that are used though something about them is wrong.
fn doubtful(dataset: &Dataset, shots: &[&Shot], fitted: &[Fitted]) -> Vec<Rejected> {
    let named = |name: &str| fitted.iter().any(|shot| shots[shot.index].name == name);
    let all = dataset.tracks.iter().flat_map(|tracks| &tracks.doubtful).filter(|(name, _)| named(name));
    all.map(|(shot, reason)| Rejected { shot: shot.clone(), reason: reason.clone() }).collect()
}

/// What was measured of the discs of every shot, or of those of a label.
fn disc_shots(dataset: &Dataset, shots: &[&Shot], in_groups: bool) -> Vec<DiscShot> {
    let own = |shot: &&DiscShot| !in_groups || shots.iter().any(|known| known.name == shot.name);
    dataset.tracks.iter().flat_map(|tracks| &tracks.disc_shots).filter(own).cloned().collect()
}

/// How J_t/J_n of discs follows from the slip, where the shots determine it.
fn friction_curve(fit: &Fit, model: &Model, at: &Values) -> Option<FrictionCurve> {
    fit.get(Parameter::Mu).filter(|mu| mu.status != Status::NotIdentified)?;
    let slips = fit.disc_shots.iter().filter_map(|shot| shot.slip_ratio);
    let largest = slips.map(|slip| slip.value.abs()).fold(0.0, f64::max);
    let speeds: Vec<f64> = fit.disc_shots.iter().filter_map(|shot| Some(shot.closing_speed?.value)).collect();
    let closing = speeds.iter().sum::<f64>() / speeds.len().max(1) as f64;
    (largest > 0.0).then(|| FrictionCurve::of(model, at, largest, closing)).flatten()
}

/// The shots that can be predicted at usual values of the parameters, and the others with the reason.
pub(crate) fn plan(shots: &[&Shot], model: &Model, usual: &Values) -> (Vec<Fitted>, Vec<Rejected>) {
    let (mut fitted, mut rejected) = (Vec::new(), Vec::new());
    for (index, shot) in shots.iter().enumerate() {
        let planned = crate::likelihood::prediction::Plan::new(shot).and_then(|plan| {
            plan.predict(model, &usual.coefficients).map(|_| Fitted { index, plan, film: None })
        });
        match planned {
            Ok(shot) => fitted.push(shot),
            Err(error) => {
                rejected.push(Rejected { shot: shot.name.clone(), reason: error.to_string() });
            }
        }
    }
    (fitted, rejected)
}

/// Each observable has standard deviations everywhere or nowhere.
fn check_noise(dataset: &Dataset, shots: &[&Shot], fitted: &[Fitted]) -> Result<(), FitError> {
    let mut seen: Vec<(Observable, bool, usize)> = Vec::new();
    for (index, row) in fitted.iter().flat_map(|shot| shot.plan.rows().iter().map(|row| (shot.index, row))) {
        let has = row.measured.sd.is_some();
        match seen.iter().find(|(observable, ..)| *observable == row.observable) {
            Some((_, other, first)) if *other != has => {
                let place = |index: usize| {
                    let shot = shots[index];
                    (format!("{}:{}", shot.file.display(), shot.line), shot.name.clone())
                };
                let (with, without) = if has { (index, *first) } else { (*first, index) };
                return Err(FitError::MixedNoise {
                    dataset: dataset.name.clone(),
                    column: row.observable.column(),
                    with: Box::new(place(with)),
                    without: Box::new(place(without)),
                });
            }
            Some(_) => {}
            None => seen.push((row.observable, has, index)),
        }
    }
    Ok(())
}
