//! Discs that slow down evenly, as friction makes them: one deceleration for all shots of a film, which is an unknown.
//!
//! Along its way a disc is at s(t) = s₀ + v t − ½ a t², t from the impact. Each shot is first fitted with an `a` of each disc on either side
//! and a prior. What all shots determine together is then held, and how far it may be off is an error that the shots share. If the sides
//! differ by more than their errors (a hand still pushes, or the table is not level), each keeps its own with the spread as its prior.

use nalgebra::{SMatrix, SVector};

use super::DiscImpact;
use super::unknowns::SIDES;
use crate::measurement::dataset::Measured;
use crate::numerics::{median, robust_scale};

/// Prior standard deviation of the deceleration about 0, m/s²: a hundredth of gravity, what pucks on ice or on a poor air table have.
const PRIOR_SD: f64 = 0.1;

/// The slowest common frame rate, frames/s: if the rate is unknown, the prior is that of this one, so that it is not narrower than of others.
const SLOWEST_RATE: f64 = 30.0;

/// A shot whose deceleration is this many standard errors from the median of all is left out of the mean.
const MAX_OFF: f64 = 6.0;
/// Fewer shots show neither which one is off nor by how much sides differ.
const LEAST_SHOTS: usize = 3;

/// The deceleration is reported if −2 log L decreases by this much with it, as of corrections of the camera.
const SIGNIFICANT: f64 = 12.0;

/// Sides differ if the sum of their squared standardised differences exceeds its mean n by this many of its standard deviations √(2n).
const DIFFER: f64 = 3.0;

/// The deceleration as the fit of one shot has it, m/s².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slowing {
    pub mean: f64,
    /// Standard deviation of each disc's own deceleration on either side about the mean; 0 if all are held at it.
    pub shot_sd: f64,
    /// Standard deviation of the mean, which all shots share.
    pub shared_sd: f64,
}

type Sides = SVector<f64, SIDES>;
type Information = SMatrix<f64, SIDES, SIDES>;

/// What the frames of one shot determine of its decelerations without the prior: the inverse of their covariance, and its product with their
/// estimates.
#[derive(Clone, Copy, Debug)]
pub(super) struct OwnSlowing {
    information: Information,
    pulled: Sides,
}

impl OwnSlowing {
    /// The information about a common deceleration, and its product with the estimate, of sides that scatter by a variance.
    fn common(&self, spread: f64) -> [f64; 2] {
        // (C + s² 1)⁻¹ = (1 + s² M)⁻¹ M, M = C⁻¹
        let scattered = Information::identity() + self.information * spread;
        let Some(inverse) = scattered.try_inverse() else { return [0.0; 2] };
        [(inverse * self.information).sum(), (inverse * self.pulled).sum()]
    }

    /// The sum of the squared standardised differences from a common deceleration, and their number: those that the frames determine better
    /// than the prior does, which has the information `prior`.
    fn differences(&self, common: f64, prior: f64) -> [f64; 2] {
        let left = self.pulled - self.information.column_sum() * common;
        let eigen = self.information.symmetric_eigen();
        let mut sums = [0.0; 2];
        for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > prior {
                sums[0] += direction.dot(&left).powi(2) / value;
                sums[1] += 1.0;
            }
        }
        sums
    }
}

impl Slowing {
    /// Discs with constant velocities.
    pub(super) const NONE: Self = Self { mean: 0.0, shot_sd: 0.0, shared_sd: 0.0 };

    /// The prior of a film; without a frame rate in m per frame².
    pub(super) fn prior(in_seconds: bool) -> Self {
        let unit = if in_seconds { 1.0 } else { SLOWEST_RATE.powi(-2) };
        Self { shot_sd: PRIOR_SD * unit, ..Self::NONE }
    }

    /// Takes the prior away from the estimates of a shot, whose covariance is `factor` times `inverse`.
    pub(super) fn of_shot(&self, values: Sides, inverse: Information, factor: f64) -> Option<OwnSlowing> {
        if !(self.shot_sd > 0.0) {
            return None;
        }
        let prior = self.shot_sd.powi(-2);
        let all = inverse.cholesky()?.inverse();
        let information = (all - Information::identity() * prior) / factor;
        let pulled = (all * values - Sides::repeat(self.mean * prior)) / factor;
        Some(OwnSlowing { information, pulled })
    }

    /// The deceleration that all shots of a film determine together with its prior.
    pub(super) fn of_film<'a>(&self, impacts: impl Iterator<Item = &'a DiscImpact>) -> Self {
        let mut all: Vec<OwnSlowing> = impacts.filter_map(|impact| impact.own_slowing).collect();
        all.retain(|own| own.common(0.0)[0] > 0.0);
        if all.len() >= LEAST_SHOTS {
            let of_shot = |own: &OwnSlowing| {
                let [weight, sum] = own.common(0.0);
                (sum / weight, weight.sqrt())
            };
            let middle = median(all.iter().map(|own| of_shot(own).0).collect());
            let off = |own: &OwnSlowing| {
                let (value, precision) = of_shot(own);
                (value - middle).abs() * precision
            };
            let typical = robust_scale(all.iter().map(off)).max(1.0);
            all.retain(|own| off(own) < MAX_OFF * typical);
        }
        let prior = self.shot_sd.powi(-2);
        let spread = spread(&all, prior);
        let [weight, pulled] = sums(&all, spread);
        let weight = weight + prior;
        Self { mean: pulled / weight, shot_sd: spread.sqrt(), shared_sd: weight.recip().sqrt() }
    }

    /// The mean, if the shots show that their discs slow down.
    pub(super) fn significant(&self) -> Option<Measured> {
        let Self { mean, shared_sd, .. } = *self;
        (mean > 0.0 && mean * mean > SIGNIFICANT * shared_sd * shared_sd)
            .then_some(Measured { value: mean, sd: Some(shared_sd) })
    }
}

/// The information about a common deceleration and its product with the estimate, of all shots.
fn sums(all: &[OwnSlowing], spread: f64) -> [f64; 2] {
    all.iter().map(|own| own.common(spread)).fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]])
}

/// The variance of the decelerations from side to side beyond their errors, by moments (DerSimonian and Laird 1986, Control. Clin. Trials 7,
/// 177), with full covariances.
fn spread(all: &[OwnSlowing], prior: f64) -> f64 {
    let [weight, pulled] = sums(all, 0.0);
    if !(all.len() >= LEAST_SHOTS && weight > 0.0) {
        return 0.0;
    }
    let [square, count] = all
        .iter()
        .map(|own| own.differences(pulled / weight, prior))
        .fold([0.0; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]]);
    let dof = count - 1.0;
    if square <= dof + DIFFER * (2.0 * dof.max(0.0)).sqrt() {
        return 0.0;
    }
    let trace: f64 = all.iter().map(|own| own.information.trace()).sum();
    let of_mean: f64 = all.iter().map(|own| own.information.column_sum().norm_squared()).sum();
    ((square - dof) / (trace - of_mean / weight)).max(0.0)
}
