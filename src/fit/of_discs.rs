//! The fit of films of discs as a [`Fit`].

use minijinja::context;
use nalgebra::{DMatrix, DVector};

use super::deviations::chance;
use super::request::Request;
use super::{Depth, Fit, FitError, Remark, Scatter, doubts, film_words};
use crate::measurement::observable::{Measured, Observable};
use crate::measurement::parameter::Parameter;
use crate::problem::{Component, Deviations, DiscFit, FitEnd, Id, MUS, ShiftScore, Slope, fit_discs};

/// Number of shots that show how much shots differ.
const LEAST_SHOTS: usize = 3;

/// Fits films of discs.
pub(super) fn fit(request: Request) -> Result<Fit, FitError> {
    let mut dataset = request.dataset.clone();
    let mu = &mut dataset.settings[Parameter::Mu];
    if *mu == Parameter::Mu.default_setting() {
        // rubber on rubber seldom has more than the last start
        mu.upper = MUS[MUS.len() - 1];
    }
    let disc_fit = fit_discs(&dataset).map_err(|error| request.of_film(error))?;
    let DiscFit { solution, impacts, .. } = &disc_fit;
    let shots = solution.names().len();
    // a single shot shows no scatter
    let dof = (shots > 1).then_some(shots as f64 - 1.0);
    let (settings, profiles) = (&dataset.settings, request.options.depth >= Depth::Intervals);
    let end = FitEnd::of_frames(solution.clone(), settings, (dof, disc_fit.others.clone()), profiles);
    let deviations = deviations(&disc_fit, end.undetermined.contains(&Id::Mu));
    let request = Request { dataset: &dataset, ..request };
    let mut fit = Fit::new(request, &end, &deviations, chance_of);
    let ([e, ..], impulse_ratio) = (disc_fit.scatter(), disc_fit.scatter_of_ratio());
    fit.scatter = (shots >= LEAST_SHOTS).then_some(Scatter { e, impulse_ratio });
    fit.disc_shots.clone_from(impacts);
    doubts::comment(&mut fit, &dataset, false, notes(&disc_fit));
    Ok(fit)
}

/// Returns e and J_t/J_n of the shots that were fitted, less the law; the tangent of a cut angle is
/// the slip over the closing speed, 0 if that is not known.
fn deviations(found: &DiscFit, is_friction_unknown: bool) -> Vec<Option<Deviations>> {
    let DiscFit { solution, impacts, .. } = found;
    let [of_e, of_ratio, .., of_mu] = found.scatter();
    let deviations = |name: &String| {
        let impact = impacts.iter().find(|impact| impact.name == *name)?;
        let closing = impact.get("closing_speed")?.value;
        let slip = impact.get("slip_ratio").map(|slip| slip.value);
        let e = solution.value(Id::E) - solution.value(Id::ESlope) * closing;
        // a single shot does not show the law that J_t/J_n would deviate from
        let slip_of_law = slip.filter(|_| !is_friction_unknown);
        let ratio = slip_of_law.and_then(|slip| solution.impulse_ratio([closing, slip * closing]));
        let [ratio, by_mu] = [0, 1].map(|place| ratio.map(|ratio| ratio[place]));
        let of_ratio = of_ratio.hypot(of_mu * by_mu.unwrap_or(0.0));
        let all = [
            (Observable::Restitution, "e", of_e, Some(e)),
            (Observable::ImpulseRatio, "impulse_ratio", of_ratio, ratio),
        ];
        let rows = all.into_iter().filter_map(|(observable, quantity, scatter, law)| {
            let Measured { value, sd } = impact.get(quantity)?;
            Some((observable, [value, value - law?, sd?.hypot(scatter).powi(2)]))
        });
        let (observables, rows): (Vec<_>, Vec<[f64; 3]>) = rows.unzip();
        let column = |place: usize| DVector::from_iterator(rows.len(), rows.iter().map(|row| row[place]));
        let cut = slip.unwrap_or(0.0).atan();
        Some(Deviations {
            by: DMatrix::zeros(rows.len(), 0),
            observables,
            measured: column(0).as_slice().to_vec(),
            values: column(1),
            covariance: DMatrix::from_diagonal(&column(2)),
            normal: [1.0, 0.0],
            cut,
            speed: Some(closing / cut.cos()),
            spins: [f64::NAN; 2],
        })
    };
    solution.names().iter().map(deviations).collect()
}

/// Returns the probability of a slope by chance: the scatter that is stated includes a trend, that
/// about the line does not.
fn chance_of(slope: &Slope, scores: &[Option<ShiftScore>]) -> Option<f64> {
    let along: Vec<f64> = scores.iter().flatten().map(|score| score.along).collect();
    let mean = along.iter().sum::<f64>() / along.len() as f64;
    let square = along.iter().map(|along| (along - mean).powi(2)).sum::<f64>();
    chance(slope, square, along.len() as f64 - 2.0)
}

/// Returns what is good to know of the fit of discs.
fn notes(found: &DiscFit) -> Vec<Remark> {
    let DiscFit { solution, impacts, .. } = found;
    let stuck = impacts.iter().filter(|impact| impact.stuck.is_some()).count();
    let unseen = impacts.iter().filter(|impact| impact.get("slip").is_none()).count();
    let others = Component::ALL.iter().zip(found.scatter()).skip(2).filter(|(_, sd)| *sd > 0.0);
    let quantities: Vec<String> = others.map(|(of, sd)| format!("{} {sd:.2e}", of.name)).collect();
    let differ = !quantities.is_empty();
    let all = [
        film_words::of_shots("measured/sticking", stuck, impacts.len()),
        film_words::of_shots("measured/unseen-rotation", unseen, impacts.len()),
        film_words::slowing(solution),
        differ.then(|| film_words::note("measured/scatter-of-shots", context! { quantities })),
    ];
    all.into_iter().flatten().collect()
}
