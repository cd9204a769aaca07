//! Shots of tables that fit no collision that fits the others, as [`super::outlying`] finds those of films.
//!
//! A robust fit, in which gross errors hardly count, gives every shot its distance d² = χ² of its k observations. Shots whose d²/k is
//! above [`WORSE`] times the typical one are candidates. Each is compared with the shots that are no candidates: with their mean
//! s² = Σd²/(Σk − p), p being the number of parameters, d²/(k s²) follows F(k, Σk − p). What is stated of the noise, or the rounding of
//! the readings, is the least that s² can be.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::effort::Effort;
use super::minimum::Minimum;
use super::noise::{self, Group};
use super::outlying::{FEW, MINORITY, NO_CHANCE, Odd, POOR, ROUNDS, WORSE};
use super::robust::distances;
use super::samples::Search;
use super::settled::Settled;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::difference;
use crate::likelihood::sample::Sample;
use crate::likelihood::whitening::covariance;
use crate::measurement::loss::Loss;
use crate::measurement::number::plain;
use crate::numerics::median;

/// Returns the shots of each sample that fit the model far worse than the others, if they are few: at most [`MINORITY`] of them, or
/// [`FEW`] if the others do not fit as well as their stated noise lets them. Where a robust loss weighs shots, none.
pub(crate) fn outlying(settled: &Settled) -> Vec<Vec<Odd>> {
    let Settled { search, minimum, free, estimated, .. } = settled;
    let has_candidates =
        || Distances::of_all(search, minimum, estimated).iter().any(Distances::has_candidates);
    if search.is_robust() || !has_candidates() {
        return vec![Vec::new(); search.samples.len()];
    }
    let robust = search.from(&minimum.values).with(|_, sample| sample.loss = Loss::Cauchy);
    let effort = Effort { rounds: ROUNDS, ..Effort::SCREEN };
    let converged = robust.converge_with(free, effort).ok();
    let (minimum, groups) =
        converged.as_ref().map_or((minimum, estimated), |(minimum, groups)| (minimum, groups));
    let all = Distances::of_all(&robust, minimum, groups);
    let odd = |(number, distances): (usize, &Distances)| {
        let places = distances.outlying(free.len());
        let reason = |place: usize| Odd {
            place,
            reason: reason(&robust.samples[number], (number, place), minimum, groups),
        };
        places.into_iter().map(reason).collect()
    };
    all.iter().enumerate().map(odd).collect()
}

/// How far the shots of a sample are from a fit.
struct Distances {
    /// d² and k of each shot.
    shots: Vec<(f64, f64)>,
    /// s² as the median of the shots gives it.
    typical: f64,
    /// The least s².
    least: f64,
}

impl Distances {
    fn of_all(search: &Search, minimum: &Minimum, groups: &[Group]) -> Vec<Self> {
        let (mut residuals, mut weights) = (minimum.residuals.as_slice(), minimum.weights.as_slice());
        let of = |sample: &Sample| {
            let (own, others) = residuals.split_at(sample.rows().min(residuals.len()));
            let (of_shots, of_others) = weights.split_at(sample.fitted.len().min(weights.len()));
            (residuals, weights) = (others, of_others);
            Self::new(sample, distances(sample.fitted.iter(), own, of_shots), groups)
        };
        search.samples.iter().map(of).collect()
    }

    fn new(sample: &Sample, distances: Vec<f64>, groups: &[Group]) -> Self {
        let count = |shot: &Fitted| shot.plan.rows().len() as f64;
        let shots: Vec<(f64, f64)> =
            sample.fitted.iter().zip(distances).map(|(shot, d)| (d * d, count(shot))).collect();
        let scale = |(square, count): &(f64, f64)| {
            ChiSquared::new(*count).map_or(f64::NAN, |chi2| square / chi2.inverse_cdf(0.5))
        };
        let rows = sample.fitted.iter().flat_map(|shot| shot.plan.rows());
        let least = rows.map(|row| {
            let estimated = groups.iter().find(|group| group.is_of(sample.dataset, row.observable));
            match (row.measured.sd, estimated) {
                (None, Some(group)) => (group.rounding / group.sd).powi(2),
                _ => 1.0,
            }
        });
        let least = least.sum::<f64>() / shots.iter().map(|(_, count)| count).sum::<f64>();
        Self { typical: median(shots.iter().map(scale).collect()), shots, least }
    }

    fn is_candidate(&self, (square, count): &(f64, f64)) -> bool {
        square / count > WORSE * self.typical.max(self.least)
    }

    fn has_candidates(&self) -> bool {
        self.shots.iter().any(|shot| self.is_candidate(shot))
    }

    /// Returns the places of the shots that are left out where so many parameters are fitted.
    fn outlying(&self, parameters: usize) -> Vec<usize> {
        let others = self.shots.iter().filter(|shot| !self.is_candidate(shot));
        let (squares, counts) =
            others.fold((0.0, 0.0), |(squares, counts), (square, count)| (squares + square, counts + count));
        let dof = counts - parameters as f64;
        let scale = (squares / dof).max(self.least);
        if !(dof >= 1.0 && scale > 0.0) {
            return Vec::new();
        }
        let is_outlying = |shot: &(f64, f64)| {
            let (square, count) = *shot;
            let ratio = (square / count / scale).min(f64::MAX);
            self.is_candidate(shot)
                && FisherSnedecor::new(count, dof)
                    .is_ok_and(|distribution| distribution.sf(ratio) < NO_CHANCE)
        };
        let places: Vec<usize> =
            (0..self.shots.len()).filter(|place| is_outlying(&self.shots[*place])).collect();
        let is_poor = self.least >= 1.0 && self.typical > POOR;
        let most = (if is_poor { FEW } else { MINORITY } * self.shots.len() as f64).max(1.0);
        if places.len() as f64 <= most { places } else { Vec::new() }
    }
}

/// Says which observation of a shot is farthest from what the fit of the others predicts.
fn reason(sample: &Sample, (number, place): (usize, usize), minimum: &Minimum, groups: &[Group]) -> String {
    let plan = &sample.fitted[place].plan;
    let (whitening, values) = (&minimum.whitening[number], &minimum.values[number]);
    let without_model = "it does not fit the collision that the other shots fit".to_owned();
    let predicted = whitening.predict(place, plan, &values.model(sample.model), &values.coefficients());
    let Ok(prediction) = predicted else { return without_model };
    let covariance = covariance(plan, &prediction, &noise::of_dataset(groups, sample.dataset));
    let off = plan.rows().iter().enumerate().map(|(i, row)| {
        let difference = difference(row.observable, prediction.values[i], row.measured.value);
        (row, difference, difference.abs() / covariance[(i, i)].sqrt())
    });
    let Some((row, difference, errors)) = off.max_by(|a, b| a.2.total_cmp(&b.2)) else {
        return without_model;
    };
    let in_unit = |value: f64| plain(value / row.observable.unit_si(), 4);
    format!(
        "{without_model}: most of all its {} is {}, where {} is expected ({} standard deviations off)",
        row.observable.column(),
        in_unit(row.measured.value),
        in_unit(row.measured.value + difference),
        plain(errors, 2)
    )
}
