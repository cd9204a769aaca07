//! Shots whose frames fit no collision that fits those of the others.

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::Rejected;
use super::effort::Effort;
use super::minimum::Minimum;
use super::samples::Search;
use super::settled::Settled;
use crate::likelihood::fitted::{Fitted, SHARE};
use crate::likelihood::frames::shared_unknowns::{self, SharedUnknown};
use crate::likelihood::sample::Sample;
use crate::measurement::loss::Loss;
use crate::measurement::number::plain;
use crate::measurement::values::Values;
use crate::numerics::median;
use crate::physics::collision::Model;

/// χ²/dof over the usual one, with the noise that is usual of the other shots: a shot whose noise is estimated from its own
/// residuals hides a misfit in it. Below this the noise of a shot may well be twice that of the others.
pub(super) const WORSE: f64 = 6.0;

/// What a collision adds to χ², over what it usually adds. Where something is wrong with all shots, such as a topspin that nobody told, single ones
/// show it ten times as much as the usual one.
const FAR_WORSE: f64 = 20.0;

/// By chance less often than this.
pub(super) const NO_CHANCE: f64 = 1e-9;

/// At most this part of the shots: if there are more, the model may be wrong and not the shots…
pub(super) const FEW: f64 = 0.15;
/// …unless the others, without them, fit as well as their noise lets them.
pub(super) const MINORITY: f64 = 0.4;

/// What a collision adds to χ², of each number that it ties: about 1 where only noise does.
pub(super) const POOR: f64 = 3.0;

/// Rounds of weighting until gross errors no longer count.
pub(super) const ROUNDS: usize = 40;
const LEAST_SHOTS: usize = 8;

/// A shot that is left out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Odd {
    /// Its place among the shots.
    pub place: usize,
    /// Why it is left out.
    pub reason: String,
}

impl Odd {
    fn film(place: usize, how: &str) -> Self {
        Self { place, reason: format!("its frames do not fit the collision that the other shots fit: {how}") }
    }

    pub(crate) fn rejected(&self, shot: &str) -> Rejected {
        Rejected { shot: shot.to_owned(), reason: self.reason.clone() }
    }
}

/// What frames miss a collision by.
struct Misfit {
    place: usize,
    chi2: f64,
    dof: f64,
    /// What the collision adds to the χ² of the motion, which does not depend on how much noise there is, and how many numbers it
    /// ties.
    added: f64,
    tied: f64,
}

impl Misfit {
    fn of((place, shot): (usize, &Fitted), own: &[f64], weight: f64, noise: f64) -> Option<Self> {
        let film = shot.film.as_ref()?;
        let dof = film.observations().saturating_sub(film.unknowns()).max(1) as f64;
        let chi2 = own.iter().map(|r| r * r).sum::<f64>() / weight;
        let noisier = if film.states_noise || !(noise > 0.0) { 1.0 } else { film.position_sd / noise };
        let added = (chi2 - shot.least_chi2()).max(0.0);
        let tied = shot.plan.rows().len().max(1) as f64;
        chi2.is_finite().then_some(Self { place, chi2: chi2 * noisier * noisier, dof, added, tied })
    }

    /// How it differs, if it does, from shots of this χ²/dof to which the collision adds this for each number that it ties.
    fn odd(&self, usual: f64, usually_added: f64) -> Option<Odd> {
        let Self { place, chi2, dof, added, tied } = *self;
        let is_no_chance = |chi2: f64, dof: f64| {
            ChiSquared::new(dof).is_ok_and(|distribution| distribution.sf(chi2) < NO_CHANCE)
        };
        let how = if chi2 / dof > WORSE * usual && is_no_chance(chi2 / usual, dof) {
            format!("their χ²/dof is {}", plain(chi2 / dof, 3))
        } else if added / tied > FAR_WORSE * usually_added && is_no_chance(added / usually_added, tied) {
            format!(
                "it adds {} to the χ² of this shot, and about {} to that of each of the others",
                plain(added, 3),
                plain(usually_added * tied, 2)
            )
        } else {
            return None;
        };
        Some(Odd::film(place, &how))
    }
}

/// Those through whose frames no collision leads at these values: something is wrong with them, and no search can begin there.
pub(crate) fn impossible(
    fitted: &[Fitted],
    (model, values): (&Model, &Values),
    unknowns: &[SharedUnknown],
) -> Vec<Odd> {
    let model = values.model(model);
    let starts: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
    let shared = shared_unknowns::shared(values, unknowns, &starts);
    let is_possible = |shot: &Fitted| {
        let film = shot.film.as_ref()?;
        let reduced = film.reduced(&shot.plan.collision(&model), &shared, &film.start)?;
        let all = || reduced.residuals.iter().chain(reduced.jacobian.iter());
        all().all(|number| number.is_finite()).then_some(())
    };
    let how = "no collision leads from the frames before it to those after it";
    let all = fitted.par_iter().enumerate().with_min_len(SHARE);
    let impossible = all.filter(|(_, shot)| is_possible(shot).is_none());
    impossible.map(|(place, _)| Odd::film(place, how)).collect()
}

/// Of each sample, the shots whose frames fit the model far worse than those of the others, if they are few; or those that a robust fit
/// leaves aside, if the others then fit as well as their noise lets them. Without frames, and where a robust loss weighs shots, none.
pub(crate) fn outlying(settled: &Settled) -> Vec<Vec<Odd>> {
    let is_weighted = |sample: &Sample| sample.loss != Loss::Squares;
    let found = Found::of_all(&settled.search, &settled.minimum, is_weighted);
    if found.iter().all(|found| found.is_told_by(FEW)) {
        return found.into_iter().map(|found| found.odd).collect();
    }
    let robust = settled.search.from(&settled.minimum.values).with(|i, sample| {
        if !found[i].is_told_by(FEW) {
            sample.loss = Loss::Cauchy;
        }
    });
    let effort = Effort { rounds: ROUNDS, ..Effort::SCREEN };
    let consensus = robust.converge_with(&settled.free, effort);
    let consensus = consensus.map(|(minimum, _)| Found::of_all(&robust, &minimum, |_| false));
    let found = found.into_iter().enumerate().map(|(i, found)| match &consensus {
        Ok(of_others) if of_others[i].is_told_by(MINORITY) => of_others[i].odd.clone(),
        _ if found.is_few(FEW) => found.odd,
        _ => Vec::new(),
    });
    found.collect()
}

/// The odd ones of a sample, and how the others fit.
struct Found {
    odd: Vec<Odd>,
    shots: usize,
    /// What the collision usually adds to χ², of each number that it ties.
    added: f64,
}

impl Found {
    fn of_all(search: &Search, minimum: &Minimum, is_trusted: impl Fn(&Sample) -> bool) -> Vec<Self> {
        let (mut rest, mut weights) = (minimum.residuals.as_slice(), minimum.weights.as_slice());
        let of = |sample: &Sample| {
            let (own, others) = rest.split_at(sample.rows().min(rest.len()));
            let (of_shots, of_others) = weights.split_at(sample.fitted.len().min(weights.len()));
            (rest, weights) = (others, of_others);
            let tested = sample.is_filmed() && sample.fitted.len() >= LEAST_SHOTS && !is_trusted(sample);
            let none = Self { odd: Vec::new(), shots: sample.fitted.len(), added: 0.0 };
            if tested { Self::of(sample.fitted, own, of_shots) } else { none }
        };
        search.samples.iter().map(of).collect()
    }

    /// `residuals` are those of the shots, weighted with `weights`.
    fn of(fitted: &[Fitted], residuals: &[f64], weights: &[f64]) -> Self {
        let noises = fitted.iter().filter_map(|shot| Some(shot.film.as_ref()?.position_sd));
        let noise = median(noises.collect());
        let mut rest = residuals;
        let mut all: Vec<Misfit> = Vec::with_capacity(fitted.len());
        for ((place, shot), weight) in fitted.iter().enumerate().zip(weights) {
            let (own, others) = rest.split_at(shot.rows().min(rest.len()));
            rest = others;
            all.extend(Misfit::of((place, shot), own, *weight, noise));
        }
        let added = median(all.iter().map(|shot| shot.added / shot.tied).collect());
        let usual = median(all.iter().map(|shot| shot.chi2 / shot.dof).collect()).max(1.0);
        let odd = all.iter().filter_map(|shot| shot.odd(usual, added.max(1.0))).collect();
        Self { odd, shots: fitted.len(), added }
    }

    fn is_few(&self, part: f64) -> bool {
        self.odd.len() as f64 <= (part * self.shots as f64).max(1.0)
    }

    fn is_told_by(&self, part: f64) -> bool {
        self.is_few(part) && self.added < POOR
    }
}
