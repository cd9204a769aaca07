//! The shots of a table as a block.

use std::sync::Arc;

use rayon::prelude::*;

use super::prediction::Residuals;
use super::shot::{Row, RowShot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::problem::film::dual::gradient;
use crate::problem::film::impact::{Contact, Correction};
use crate::problem::film::own::OWN;
use crate::problem::loss::ShotLoss;
use crate::problem::sums::{Contribution, Noise, SHOT_STOP, settle};
use crate::problem::unknowns::{Mode, Own, PHYSICS, Shared, Unknown};

/// Observables whose numbers have noise of one size.
#[derive(Clone, Debug)]
pub(crate) struct Pool {
    pub(crate) observables: Vec<Observable>,
    /// Noise of the rounding of the columns, SI or radians; 0 if they are not rounded.
    pub(crate) rounding: f64,
    /// Size so small that residuals vanish.
    pub(crate) exact: f64,
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
    pub(crate) shots: Arc<Vec<RowShot>>,
    pub(crate) contact: Contact,
    /// Number of shared unknowns that normal equations hold: the last that is not held, and those
    /// before it.
    width: usize,
    /// Noises of numbers whose errors are not stated: of each pool.
    pub(crate) noises: Vec<Noise>,
    /// The observables of a unit, unless their noises differ.
    pub(crate) pools: Vec<Pool>,
    pub(crate) loss: Loss,
    /// The losses of shots of 0, 1, 2, … numbers.
    pub(crate) losses: Vec<ShotLoss>,
}

impl RowsBlock {
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
    pub(crate) fn with_unknowns(self, unknowns: &[Unknown]) -> Self {
        let last = unknowns[..PHYSICS].iter().rposition(|unknown| unknown.mode != Mode::Fixed);
        Self { contact: self.contact.with(unknowns), width: last.map_or(0, |last| last + 1), ..self }
    }

    /// Returns the same shots with a loss.
    pub(crate) fn with_loss(mut self, loss: Loss) -> Self {
        let most = self.shots.iter().map(|shot| shot.rows.len()).max().unwrap_or(0);
        self.losses = (0..=most).map(|numbers| ShotLoss::new(loss, numbers)).collect();
        self.loss = loss;
        self
    }

    /// Takes shots instead of all; one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
    }

    /// Gives the shots whose speed is known the difference of the outcome with the balls' weight as
    /// their offset.
    pub fn weigh(&mut self, own: &[Own], shared: &Shared) {
        let heavy = self.contact.with_weight();
        self.contact = heavy;
        let offset = |(shot, own): (&mut RowShot, &Own)| {
            let offset = heavy.correct(&shot.approach(own).cue, shared).filter(|_| shot.knows_speed);
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
        for (residual, row) in residuals.rows.iter_mut().zip(&shot.rows) {
            *residual /= self.sd(row);
        }
        Some(residuals)
    }

    /// Returns the sums of shot `i`.
    pub(crate) fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        let predicted = self.predict(i, own, shared);
        let squares = predicted.iter().flat_map(|found| &found.rows).map(|row| row.re * row.re);
        let squares: Vec<f64> = squares.collect();
        let mut sums = self.add_up(i, own, predicted, self.width);
        let loss = self.losses[self.shots[i].rows.len()];
        sums.weigh(loss, sums.cost.sqrt());
        let weight = sums.weight();
        for (square, row) in squares.iter().zip(&self.shots[i].rows) {
            if let Some(noise) = row.noise {
                sums.noises[noise].weighted += weight * weight * square / loss.consistency;
                sums.noises[noise].count += 1.0;
            }
        }
        sums.or_impossible()
    }

    /// Returns the sums of a shot by least squares over its own unknowns and the first `width`
    /// shared ones.
    fn add_up(&self, i: usize, own: &Own, predicted: Option<Residuals>, width: usize) -> Contribution {
        let noises = self.noises.len();
        let Some(predicted) = predicted else { return Contribution::impossible(OWN, width, noises) };
        let mut sums = Contribution::empty(OWN, width, noises);
        sums.sticks = predicted.sticks;
        for residual in &predicted.rows {
            sums.add_number(residual.re, &gradient(residual).as_slice()[..OWN + width]);
        }
        for (place, prior) in self.shots[i].own_priors() {
            sums.add_prior((place, prior), own[place], &[]);
        }
        sums
    }

    /// Returns the own unknowns of shot `i` that fit best near `start` if its speed is not
    /// measured: a speed afterwards determines it too well for linear steps. Those of other shots
    /// stay.
    pub(crate) fn settle(&self, i: usize, start: Own, shared: &Shared) -> Own {
        if self.shots[i].own_unknowns_without_prior() == 0 {
            return start;
        }
        let contribute = |own: &Own| self.add_up(i, own, self.predict(i, own, shared), 0);
        settle(start, &[], SHOT_STOP, contribute, std::convert::identity).0
    }
}
