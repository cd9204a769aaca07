//! Shots whose frames fit no collision that fits those of the others.

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::Rejected;
use crate::likelihood::fitted::{Fitted, SHARE};
use crate::likelihood::frames::shared_unknowns::{self, SharedUnknown};
use crate::measurement::number::plain;
use crate::measurement::values::Values;
use crate::numerics::median;
use crate::physics::collision::Model;

/// χ²/dof over the usual one, with the noise that is usual of the other shots: a shot whose noise is estimated from its own
/// residuals hides a misfit in it. Below this the noise of a shot may well be twice that of the others.
const WORSE: f64 = 6.0;

/// What a collision adds to χ², over what it usually adds. Where something is wrong with all shots, such as a topspin that nobody told, single ones
/// show it ten times as much as the usual one.
const FAR_WORSE: f64 = 20.0;

/// By chance less often than this.
const NO_CHANCE: f64 = 1e-9;

/// At most this part of the shots: if there are more, the model is wrong and not the shots.
const FEW: f64 = 0.15;
const LEAST_SHOTS: usize = 8;

/// A shot that is left out.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Odd {
    /// Its place among the shots.
    pub place: usize,
    /// How it differs from the others.
    pub how: String,
}

impl Odd {
    /// Why it is left out.
    pub(crate) fn rejected(&self, shot: &str) -> Rejected {
        let reason = format!("its frames do not fit the collision that the other shots fit: {}", self.how);
        Rejected { shot: shot.to_owned(), reason }
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
    fn of(place: usize, shot: &Fitted, own: &[f64], noise: f64) -> Option<Self> {
        let film = shot.film.as_ref()?;
        let dof = film.observations().saturating_sub(film.unknowns()).max(1) as f64;
        let chi2 = own.iter().map(|r| r * r).sum::<f64>();
        let noisier = if film.states_noise || !(noise > 0.0) { 1.0 } else { film.position_sd / noise };
        let added = (chi2 - shot.least_chi2()).max(0.0);
        let tied = shot.plan.rows().len().max(1) as f64;
        chi2.is_finite().then_some(Self { place, chi2: chi2 * noisier * noisier, dof, added, tied })
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
    let how = || "no collision leads from the frames before it to those after it".to_owned();
    let all = fitted.par_iter().enumerate().with_min_len(SHARE);
    let impossible = all.filter(|(_, shot)| is_possible(shot).is_none());
    impossible.map(|(place, _)| Odd { place, how: how() }).collect()
}

/// Those whose frames fit the model far worse than those of the others, if they are few. `residuals` begin with theirs.
pub(crate) fn outlying(fitted: &[Fitted], residuals: &[f64]) -> Vec<Odd> {
    if fitted.len() < LEAST_SHOTS {
        return Vec::new();
    }
    let noises = fitted.iter().filter_map(|shot| Some(shot.film.as_ref()?.position_sd));
    let noise = median(noises.collect());
    let mut rest = residuals;
    let mut all: Vec<Misfit> = Vec::with_capacity(fitted.len());
    for (place, shot) in fitted.iter().enumerate() {
        let (own, others) = rest.split_at(shot.rows().min(rest.len()));
        rest = others;
        all.extend(Misfit::of(place, shot, own, noise));
    }
    let usual = median(all.iter().map(|shot| shot.chi2 / shot.dof).collect()).max(1.0);
    let usually_added = median(all.iter().map(|shot| shot.added / shot.tied).collect()).max(1.0);
    let is_no_chance = |chi2: f64, dof: f64| {
        ChiSquared::new(dof).is_ok_and(|distribution| distribution.sf(chi2) < NO_CHANCE)
    };
    let odd = |shot: &Misfit| {
        let Misfit { place, chi2, dof, added, tied } = *shot;
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
        Some(Odd { place, how })
    };
    let odd: Vec<Odd> = all.iter().filter_map(odd).collect();
    if odd.len() as f64 > (FEW * fitted.len() as f64).max(1.0) { Vec::new() } else { odd }
}
