//! The shots of a table as a block.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::prediction::{Approach, Deviations, Residuals, input_error};
use super::shot::{INPUTS, Row, RowShot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::problem::film::dual::gradient;
use crate::problem::film::impact::Contact;
use crate::problem::film::own::MOVING;
use crate::problem::loss::ShotLoss;
use crate::problem::sums::{Contribution, Noise};
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
    pub(crate) width: usize,
    /// Noises of numbers whose errors are not stated: of each pool.
    pub(crate) noises: Vec<Noise>,
    /// The observables of a unit, unless their noises differ.
    pub(crate) pools: Vec<Pool>,
    pub(crate) loss: Loss,
    /// The losses of shots of 0, 1, 2, … numbers.
    pub(crate) losses: Vec<ShotLoss>,
}

impl RowsBlock {
    /// Returns a block of shots with a loss, without noises.
    pub fn new(shots: Vec<RowShot>, contact: &Contact, unknowns: &[Unknown], loss: Loss) -> Self {
        let (noises, pools, losses) = (Vec::new(), Vec::new(), Vec::new());
        let (shots, contact) = (Arc::new(shots), *contact);
        let block = Self { shots, contact, width: 0, noises, pools, loss, losses };
        block.with_unknowns(unknowns).with_loss(loss)
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

    /// Returns the number of measured numbers after the impacts.
    pub(crate) fn count_numbers(&self) -> usize {
        self.shots.iter().map(|shot| shot.rows.len()).sum()
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
            let before = shot.differences(own, shared, &heavy).ok().filter(|_| shot.knows_speed);
            let offset = before.and_then(|before| heavy.correct(&before.approach.cue, shared));
            shot.offset = offset.map(Arc::new);
        };
        Arc::make_mut(&mut self.shots).par_iter_mut().zip(own).for_each(offset);
    }

    /// Returns the standard deviation of a number.
    fn sd(&self, row: &Row) -> f64 {
        row.noise.map_or(row.number.measured.sd.unwrap_or(0.0), |noise| self.noises[noise].sd)
    }

    /// Returns the residuals of shot `i`, independent of each other and in units of their errors;
    /// those of inputs that count as numbers stand behind the others.
    pub fn predict(&self, i: usize, own: &Own, shared: &Shared) -> Option<Residuals> {
        let shot = &self.shots[i];
        let mut residuals = shot.differences(own, shared, &self.contact).ok()?;
        for (residual, row) in residuals.rows.iter_mut().zip(&shot.rows) {
            *residual /= self.sd(row);
        }
        let noisy = shot.inputs.iter().enumerate().filter(|(_, input)| input.noise.is_some());
        residuals.rows.extend(noisy.map(|(place, input)| input_error(own, place) / self.sd(input)));
        Some(residuals)
    }

    /// Returns the sums of shot `i`.
    pub(crate) fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        let (shot, noises) = (&self.shots[i], self.noises.len());
        let Some(predicted) = self.predict(i, own, shared) else {
            return Contribution::impossible(MOVING, self.width, noises);
        };
        let mut sums = Contribution::empty(MOVING, self.width, noises);
        sums.sums.sticks = predicted.sticks;
        for residual in &predicted.rows {
            sums.add_number(residual.re, &gradient(residual).as_slice()[..MOVING + self.width]);
        }
        for (place, prior) in shot.priors() {
            sums.add_prior((place, prior), own[place], &[]);
        }
        let loss = self.losses[shot.rows.len()];
        sums.weigh(loss, sums.sums.cost.sqrt());
        let weight = sums.sums.weight();
        for (residual, noise) in predicted.rows.iter().zip(shot.noises()) {
            if let Some(noise) = noise {
                sums.sums.noises[noise].weighted += weight * weight * residual.re.powi(2) / loss.consistency;
                sums.sums.noises[noise].count += 1.0;
            }
        }
        sums.or_impossible()
    }

    /// Returns the numbers of shot `i` less their prediction from its measured inputs.
    pub(crate) fn deviations(&self, i: usize, shared: &Shared) -> Option<Deviations> {
        let shot = &self.shots[i];
        let Residuals { rows, approach, .. } =
            shot.differences(&Own::zeros(MOVING), shared, &self.contact).ok()?;
        let sds = shot.inputs.map(|input| self.sd(&input));
        let by: Vec<_> = rows.iter().map(gradient).collect();
        let inputs = DMatrix::from_fn(rows.len(), INPUTS, |row, place| sds[place] * by[row][place]);
        let mut covariance = &inputs * inputs.transpose();
        for (i, row) in shot.rows.iter().enumerate() {
            covariance[(i, i)] += self.sd(row).powi(2);
        }
        let Approach { cut, speed, cue, cos, sin } = approach;
        let (cut, speed, spin) = (cut.re, speed.re, cue.spin);
        let topspin = spin[1].re * cut.cos() - spin[0].re * cut.sin();
        Some(Deviations {
            observables: shot.rows.iter().map(|row| row.number.observable).collect(),
            measured: shot.rows.iter().map(|row| row.number.measured.value).collect(),
            values: DVector::from_iterator(rows.len(), rows.iter().map(|row| -row.re)),
            covariance,
            by: DMatrix::from_fn(rows.len(), PHYSICS, |row, id| by[row][MOVING + id]),
            normal: [cos.re, sin.re],
            cut,
            speed: shot.knows_speed.then_some(speed),
            spins: [topspin / speed, spin[2].re / speed],
        })
    }
}
