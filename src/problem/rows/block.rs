//! The shots of a table as a block.

use std::sync::Arc;

use super::shot::{OWN, Predicted, Residual, RowShot};
use crate::measurement::loss::Loss;
use crate::measurement::observable::Observable;
use crate::problem::film::dual::{Gradient, gradient};
use crate::problem::film::impact::Contact;
use crate::problem::film::own;
use crate::problem::loss::ShotLoss;
use crate::problem::sums::{Contribution, Noise, OwnPrior};
use crate::problem::unknowns::{Own, PHYSICS, Shared};

/// Place of the residual in the sums of a shot.
const LAST: usize = OWN + PHYSICS;

/// Topspin over closing speed within which own unknowns are at the kink of their outcome.
pub(super) const AT_KINK: f64 = 1e-10;

/// Stiffness against leaving a kink, over that of the residuals.
const STIFF: f64 = 1e9;

/// Observables whose numbers have noise of one size.
#[derive(Clone, Debug)]
pub(crate) struct Pool {
    pub observables: Vec<Observable>,
    /// What the rounding of the columns leaves, SI or radians; 0 if they are not rounded.
    pub rounding: f64,
    /// The least size: the rounding, or so small that residuals vanish.
    pub least: f64,
}

/// Shots of a table.
#[derive(Clone)]
pub(crate) struct RowsBlock {
    pub shots: Arc<Vec<RowShot>>,
    pub contact: Contact,
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

    /// Returns the same shots with a loss.
    pub fn with_loss(mut self, loss: Loss) -> Self {
        let most = self.shots.iter().map(|shot| shot.rows.len()).max().unwrap_or(0);
        self.losses = (0..=most).map(|numbers| ShotLoss::new(loss, numbers)).collect();
        self.loss = loss;
        self
    }

    /// Returns the prediction of shot `i` with residuals in units of their errors.
    pub fn predict(&self, i: usize, own: &Own, shared: &Shared) -> Option<Predicted> {
        let mut predicted = self.shots[i].predict(own, shared, &self.contact).ok()?;
        for residual in &mut predicted.residuals {
            if let Some(noise) = residual.noise {
                let sd = self.noises[noise].sd;
                residual.value /= sd;
                residual.by /= sd;
            }
        }
        Some(predicted)
    }

    /// Returns the sums of shot `i`.
    pub fn contribute(&self, i: usize, own: &Own, shared: &Shared) -> Contribution {
        let Some(predicted) = self.predict(i, own, shared) else {
            return Contribution::impossible(OWN, PHYSICS, self.noises.len());
        };
        let mut sums = self.add_up(i, own, &predicted, true);
        let loss = &self.losses[predicted.residuals.len()];
        let distance = sums.cost.sqrt();
        let weight = loss.weight(distance);
        sums.products *= weight;
        sums.cost = loss.cost(distance);
        for residual in &predicted.residuals {
            if let Some(noise) = residual.noise {
                sums.noises[noise].weighted += (weight * residual.value).powi(2) / loss.consistency;
                sums.noises[noise].count += 1.0;
            }
        }
        sums.or_impossible()
    }

    /// Returns the sums of a shot by least squares; own unknowns that are at the kink between topspin and
    /// draw stay on it if they are `pinned`.
    pub fn add_up(&self, i: usize, own: &Own, predicted: &Predicted, pinned: bool) -> Contribution {
        let mut sums = Contribution::empty(OWN, PHYSICS, self.noises.len());
        sums.sticks = predicted.sticks;
        for residual in &predicted.residuals {
            add(&mut sums, residual);
        }
        let by = gradient(&predicted.topspin);
        let normal = by.fixed_rows::<OWN>(0).into_owned();
        if pinned && predicted.topspin.re.abs() < AT_KINK && normal.norm() > 0.0 {
            let stiffness = STIFF * (1.0 + sums.products.view((0, 0), (OWN, OWN)).trace());
            let mut of_own = sums.products.fixed_view_mut::<OWN, OWN>(0, 0);
            of_own += normal * normal.transpose() * (stiffness / normal.norm_squared());
        }
        for (place, prior) in self.shots[i].priors.iter().enumerate() {
            if let Some(prior) = prior {
                sums.add_prior(place, prior.normal(&[]), own[place]);
            }
        }
        sums
    }

    /// Returns the distance of shot `i` from its prediction: the length of its residuals and of the
    /// errors of its inputs in units of their standard deviations.
    pub fn distance(&self, i: usize, own: &Own, predicted: &Predicted) -> f64 {
        let residuals = predicted.residuals.iter().map(|residual| residual.value.powi(2)).sum::<f64>();
        let stated = |place: &usize| matches!(self.shots[i].priors[*place], Some(OwnPrior::Stated(_)));
        let errors = (0..OWN).filter(stated).map(|place| own[place].powi(2)).sum::<f64>();
        (residuals + errors).sqrt()
    }

    /// Takes shots in the place of all, one may be taken several times.
    pub fn take(&mut self, indices: &[usize]) {
        self.shots = Arc::new(indices.iter().map(|i| self.shots[*i].clone()).collect());
    }
}

/// Adds the products of a residual and its derivatives.
fn add(sums: &mut Contribution, residual: &Residual) {
    let derivative = |by: &Gradient, column: usize| match column {
        LAST => residual.value,
        // the inputs of a film have more own unknowns
        shared if shared >= OWN => by[shared - OWN + own::OWN],
        place => by[place],
    };
    let columns: Vec<(usize, f64)> = (0..=LAST)
        .map(|column| (column, derivative(&residual.by, column)))
        .filter(|(_, by)| *by != 0.0)
        .collect();
    for (place, (i, by)) in columns.iter().enumerate() {
        for (j, other) in &columns[place..] {
            sums.products[(*i, *j)] += by * other;
        }
    }
    sums.cost += residual.value * residual.value;
}
