//! The shots of a table as a block.

use std::sync::Arc;

use nalgebra::DVector;
use rayon::prelude::*;

use super::prediction::{Approach, Residual, Residuals};
use super::shot::{OWN, Row, RowShot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::problem::film::impact::{Contact, Correction};
use crate::problem::loss::ShotLoss;
use crate::problem::sums::{Contribution, Noise, OwnPrior, settle};
use crate::problem::unknowns::{Mode, Own, PHYSICS, Shared, Unknown};

/// Topspin over closing speed within which own unknowns are at the kink of their outcome.
const AT_KINK: f64 = 1e-10;

/// Stiffness against leaving a kink, over that of the residuals.
const STIFF: f64 = 1e9;

/// Steps of a shot's own descent, and fall of χ² after which it ends: 1e-3 standard deviations.
const STEPS: usize = 30;
const SHOT_STALL: f64 = 1e-6;

/// Distance of another side of a kink, in standard errors, beyond which it is not tried.
const REACH: f64 = 6.0;

/// Observables whose numbers have noise of one size.
#[derive(Clone, Debug)]
pub(crate) struct Pool {
    pub observables: Vec<Observable>,
    /// What the rounding of the columns leaves, SI or radians; 0 if they are not rounded.
    pub rounding: f64,
    /// Size so small that residuals vanish.
    pub exact: f64,
}

impl Pool {
    /// Returns the least size of the noise.
    pub fn least(&self) -> f64 {
        self.rounding.max(self.exact)
    }
}

/// Shots of a table.
#[derive(Clone)]
pub(crate) struct RowsBlock {
    pub shots: Arc<Vec<RowShot>>,
    pub contact: Contact,
    /// Number of shared unknowns that normal equations hold: the last that is not held, and those before it.
    width: usize,
    /// Noises of numbers whose errors are not stated: of each pool.
    pub noises: Vec<Noise>,
    /// The observables of a unit, unless their noises differ.
    pub pools: Vec<Pool>,
    pub loss: Loss,
    /// The losses of shots of 0, 1, 2, … numbers.
    pub losses: Vec<ShotLoss>,
}

impl RowsBlock {
    /// Values of μ that descents start from: a contact that sticks does not depend on μ, so that thick
    /// shots of slippery balls have minima between small values.
    pub const GRID: [f64; 9] = [0.002, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15, 0.25, 0.4];

    /// Returns a block of shots by least squares, without noises.
    pub fn new(shots: Vec<RowShot>, contact: &Contact, unknowns: &[Unknown]) -> Self {
        let block = Self {
            shots: Arc::new(shots),
            contact: *contact,
            width: 0,
            noises: Vec::new(),
            pools: Vec::new(),
            loss: Loss::Squares,
            losses: Vec::new(),
        };
        block.with_unknowns(unknowns)
    }

    /// Returns the same shots with the effects that the unknowns of the sample have.
    pub fn with_unknowns(self, unknowns: &[Unknown]) -> Self {
        let last = unknowns[..PHYSICS].iter().rposition(|unknown| unknown.mode != Mode::Fixed);
        Self { contact: self.contact.with(unknowns), width: last.map_or(0, |last| last + 1), ..self }
    }

    /// Returns the same shots with a loss.
    pub fn with_loss(mut self, loss: Loss) -> Self {
        let most = self.shots.iter().map(|shot| shot.rows.len()).max().unwrap_or(0);
        self.losses = (0..=most).map(|numbers| ShotLoss::new(loss, numbers)).collect();
        self.loss = loss;
        self
    }

    /// Takes shots in the place of all, one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
    }

    /// Gives the shots whose speed is known the difference of the outcome with the balls' weight as their
    /// offset.
    pub fn weigh(&mut self, own: &[Own], shared: &Shared) {
        let heavy = if self.contact.is_corrected() { self.contact } else { self.contact.with_weight() };
        let offset = |(shot, own): (&mut RowShot, &Own)| {
            let cue = shot.approach(own).state(shot.radius);
            let offset = heavy.correct(&cue, shared).ok().filter(|_| shot.knows_speed);
            shot.offset = offset.unwrap_or_else(Correction::zeros);
        };
        Arc::make_mut(&mut self.shots).par_iter_mut().zip(own).for_each(offset);
    }

    /// Returns the standard deviation of a number.
    pub fn sd(&self, row: &Row) -> f64 {
        row.noise.map_or(row.sd, |noise| self.noises[noise].sd)
    }

    /// Returns the residuals of shot `i`, independent of each other and in units of their errors.
    pub fn predict(&self, i: usize, own: &Own, shared: &Shared) -> Option<Residuals> {
        let shot = &self.shots[i];
        let mut residuals = shot.differences(own, shared, &self.contact).ok()?;
        for (Residual { value, by }, row) in residuals.rows.iter_mut().zip(&shot.rows) {
            let weight = 1.0 / self.sd(row);
            *value *= weight;
            *by *= weight;
        }
        Some(residuals)
    }

    /// Returns the distance of shot `i` from its prediction: the length of its residuals and of the
    /// errors of its inputs in units of their standard deviations.
    pub fn distance(&self, i: usize, own: &Own, predicted: &Residuals) -> f64 {
        let residuals = predicted.rows.iter().map(|residual| residual.value.powi(2)).sum::<f64>();
        let is_stated = |place: &usize| matches!(self.shots[i].priors[*place], Some(OwnPrior::Stated(_)));
        let errors = (0..OWN).filter(is_stated).map(|place| own[place].powi(2)).sum::<f64>();
        (residuals + errors).sqrt()
    }

    /// Returns the sums of shot `i`.
    pub fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        let Some(predicted) = self.predict(i, own, shared) else {
            return Contribution::impossible(OWN, self.width, self.noises.len());
        };
        let mut sums = self.add_up(i, own, &predicted, self.width, true);
        let loss = &self.losses[predicted.rows.len()];
        let distance = sums.cost.sqrt();
        let weight = loss.weight(distance);
        if weight != 1.0 {
            sums.products *= weight;
        }
        sums.cost = loss.cost(distance);
        for (residual, row) in predicted.rows.iter().zip(&self.shots[i].rows) {
            if let Some(noise) = row.noise {
                sums.noises[noise].weighted += (weight * residual.value).powi(2) / loss.consistency;
                sums.noises[noise].count += 1.0;
            }
        }
        sums.or_impossible()
    }

    /// Returns the sums of a shot by least squares over its own unknowns and the first `width` shared ones;
    /// own unknowns that are at the kink between topspin and draw stay on it if they are `pinned`.
    fn add_up(&self, i: usize, own: &Own, predicted: &Residuals, width: usize, pinned: bool) -> Contribution {
        let mut sums = Contribution::empty(OWN, width, self.noises.len());
        sums.sticks = predicted.sticks;
        let last = OWN + width;
        for Residual { value, by } in &predicted.rows {
            let by = &by.as_slice()[..last];
            for (column, factor) in by.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
                for (row, other) in by[..=column].iter().enumerate() {
                    sums.products[(row, column)] += other * factor;
                }
                sums.products[(column, last)] += factor * value;
            }
            sums.products[(last, last)] += value * value;
            sums.cost += value * value;
        }
        let (topspin, normal) = self.topspin(i, &predicted.approach);
        if pinned && topspin.abs() < AT_KINK && normal.norm() > 0.0 {
            let stiffness = STIFF * (1.0 + sums.products.view((0, 0), (OWN, OWN)).trace());
            let mut of_own = sums.products.view_mut((0, 0), (OWN, OWN));
            of_own += &normal * normal.transpose() * (stiffness / normal.norm_squared());
        }
        for (place, prior) in self.shots[i].priors.iter().enumerate() {
            if let Some(prior) = prior {
                sums.add_prior(place, prior.normal(&[]), own[place]);
            }
        }
        sums
    }

    /// Returns topspin over closing speed of shot `i` and its derivatives by the own unknowns.
    fn topspin(&self, i: usize, approach: &Approach) -> (f64, Own) {
        let (topspin, by_inputs) = approach.topspin();
        let by = self.shots[i].sds.component_mul(&by_inputs);
        (topspin, DVector::from_column_slice(by.as_slice()))
    }

    /// Returns the own unknowns of shot `i` that fit best near `start`, on either side of the kink
    /// between topspin and draw or on it. Those far from the kink, which the steps of all unknowns find,
    /// stay, unless a speed is unknown: a speed afterwards determines it too well for linear steps.
    pub fn settle(&self, i: usize, start: Own, shared: &Shared) -> Own {
        let shot = &self.shots[i];
        let has_speed = shot.own_unknowns_without_prior() == 0;
        if shot.is_exact() || has_speed && self.way_to_kink(i, &start).is_none() {
            return start;
        }
        let here = self.descend_own(i, start, shared, false);
        let Some(way) = self.way_to_kink(i, &here.0) else { return here.0 };
        let mut best = here.clone();
        let mut keep = |other: (Own, Contribution)| {
            if other.1.cost < best.1.cost {
                best = other;
            }
        };
        // the other side is tried if its parabola is lower
        let across = &here.0 + &way * 2.0;
        let there = self.sum_own(i, &across, shared, false);
        if there.cost - promise(&there) < here.1.cost {
            keep(self.descend_own(i, across, shared, false));
        }
        // a descent that came to no minimum of its side is held up by the kink
        if promise(&here.1) > SHOT_STALL
            && let Some(onto) = self.onto_kink(i, &here.0 + way)
        {
            keep(self.descend_own(i, onto, shared, true));
        }
        best.0
    }

    /// Returns the shortest way to the kink; `None` if it is beyond the reach of the errors.
    fn way_to_kink(&self, i: usize, own: &Own) -> Option<Own> {
        let (topspin, normal) = self.topspin(i, &self.shots[i].approach(own));
        let is_near = topspin.abs() < REACH * normal.norm();
        is_near.then(|| &normal * (-topspin / normal.norm_squared()))
    }

    /// Returns own unknowns moved on to the kink.
    fn onto_kink(&self, i: usize, mut own: Own) -> Option<Own> {
        for _ in 0..4 {
            let (topspin, normal) = self.topspin(i, &self.shots[i].approach(&own));
            if topspin.abs() < 0.01 * AT_KINK {
                return Some(own);
            }
            own -= &normal * (topspin / normal.norm_squared());
        }
        None
    }

    /// Descends in the own unknowns of shot `i`, along the kink if they are on it.
    fn descend_own(&self, i: usize, own: Own, shared: &Shared, on_kink: bool) -> (Own, Contribution) {
        let at = self.sum_own(i, &own, shared, on_kink);
        if promise(&at) < SHOT_STALL {
            return (own, at);
        }
        let contribute = |own: &Own| self.sum_own(i, own, shared, on_kink);
        let bounded = |own: Own| if on_kink { self.onto_kink(i, own) } else { Some(own) };
        settle(own, &[], (STEPS, SHOT_STALL), contribute, bounded)
    }

    /// Returns the sums of shot `i` over its own unknowns alone.
    fn sum_own(&self, i: usize, own: &Own, shared: &Shared, on_kink: bool) -> Contribution {
        match self.predict(i, own, shared) {
            Some(predicted) => self.add_up(i, own, &predicted, 0, on_kink),
            None => Contribution::impossible(OWN, 0, self.noises.len()),
        }
    }
}

/// Returns the fall of χ² that its parabola at a place has to its minimum.
fn promise(at: &Contribution) -> f64 {
    let step = at.own_step(&[], 0.0);
    step.map_or(f64::INFINITY, |step| (0..OWN).map(|place| step[place] * at.slope(place)).sum())
}
