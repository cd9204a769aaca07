//! The true inputs of a shot that fit best at given shared unknowns.

use nalgebra::{DVector, SMatrix, SVector};

use super::block::{AT_KINK, RowsBlock, kink_normal};
use super::shot::OWN;
use crate::problem::film::dual::gradient;
use crate::problem::sums::OwnPrior;
use crate::problem::unknowns::{Own, Shared};

/// Steps of a shot's own descent.
const STEPS: usize = 30;

/// Fall of χ² below which a step is not made: 1e-4 standard deviations.
const STALL: f64 = 1e-8;

/// Damping at which a descent gives up.
const MAX_DAMPING: f64 = 1e8;

/// Distance of another side of a kink, in standard errors, beyond which it is not tried.
const REACH: f64 = 6.0;

/// A shot at some own unknowns.
struct Point {
    own: Own,
    cost: f64,
    /// Topspin over closing speed, with its derivatives.
    topspin: f64,
    normal: DVector<f64>,
    matrix: SMatrix<f64, OWN, OWN>,
    gradient: SVector<f64, OWN>,
}

impl RowsBlock {
    /// Returns the own unknowns of shot `i` that fit best near `start`, on either side of the kink
    /// between topspin and draw or on it. Those far from the kink, which the steps of all unknowns find,
    /// stay, unless a speed is unknown: a speed afterwards determines it too well for linear steps.
    pub fn settle(&self, i: usize, start: Own, shared: &Shared) -> Own {
        let shot = &self.shots[i];
        let has_speed = shot.own_unknowns_without_prior() == 0;
        if shot.is_exact() || has_speed && !self.is_near_kink(i, &start, shared) {
            return start;
        }
        let Some(mut best) = self.descend_own(i, start.clone(), shared, false) else { return start };
        for on_kink in [false, true] {
            let Some(other) = self.beyond(i, &best, shared, on_kink) else { continue };
            if let Some(other) = self.descend_own(i, other, shared, on_kink)
                && other.cost < best.cost
            {
                best = other;
            }
        }
        best.own
    }

    /// Returns whether the kink is within reach of the errors of shot `i`.
    fn is_near_kink(&self, i: usize, own: &Own, shared: &Shared) -> bool {
        let (cue, _) = self.shots[i].approach(own, shared);
        let topspin = cue.spin[1] / cue.velocity.x;
        let normal = gradient(&topspin).fixed_rows::<OWN>(0).norm();
        topspin.re.abs() < REACH * normal
    }

    /// Returns own unknowns with the opposite topspin, or on the kink; `None` if they are too far away.
    fn beyond(&self, i: usize, from: &Point, shared: &Shared, on_kink: bool) -> Option<Own> {
        let square = from.normal.norm_squared();
        if !(from.topspin.abs() < REACH * square.sqrt()) || square == 0.0 {
            return None;
        }
        let to_kink = &from.normal * (-from.topspin / square);
        if !on_kink {
            return Some(&from.own + to_kink * 2.0);
        }
        self.onto_kink(i, &from.own + to_kink, shared)
    }

    /// Returns own unknowns moved on to the kink.
    fn onto_kink(&self, i: usize, mut own: Own, shared: &Shared) -> Option<Own> {
        for _ in 0..4 {
            let (cue, _) = self.shots[i].approach(&own, shared);
            let topspin = cue.spin[1] / cue.velocity.x;
            if topspin.re.abs() < 0.01 * AT_KINK {
                return Some(own);
            }
            let by = gradient(&topspin);
            let normal = DVector::from_fn(OWN, |place, _| by[place]);
            own -= &normal * (topspin.re / normal.norm_squared());
        }
        None
    }

    /// Descends in the own unknowns of shot `i`, along the kink if they are on it.
    fn descend_own(&self, i: usize, own: Own, shared: &Shared, on_kink: bool) -> Option<Point> {
        let mut at = self.point(i, own, shared, on_kink)?;
        let mut damping = 0.0;
        for _ in 0..STEPS {
            let mut matrix = at.matrix;
            for place in 0..OWN {
                matrix[(place, place)] *= 1.0 + damping;
            }
            let step = matrix.cholesky()?.solve(&at.gradient);
            if !(at.gradient.dot(&step) > STALL) {
                break;
            }
            let mut trial = &at.own - DVector::from_column_slice(step.as_slice());
            if on_kink {
                trial = self.onto_kink(i, trial, shared)?;
            }
            match self.point(i, trial, shared, on_kink) {
                Some(there) if there.cost < at.cost => {
                    at = there;
                    damping *= 0.1;
                }
                _ => damping = (10.0 * damping).max(1e-2),
            }
            if damping > MAX_DAMPING {
                break;
            }
        }
        Some(at)
    }

    fn point(&self, i: usize, own: Own, shared: &Shared, on_kink: bool) -> Option<Point> {
        let predicted = self.predict(i, &own, shared)?;
        let mut cost = 0.0;
        let mut matrix = SMatrix::<f64, OWN, OWN>::zeros();
        let mut slope = SVector::<f64, OWN>::zeros();
        for residual in &predicted.residuals {
            let by = residual.by.fixed_rows::<OWN>(0);
            matrix += by * by.transpose();
            slope += by * residual.value;
            cost += residual.value * residual.value;
        }
        if let Some(normal) = kink_normal(&predicted).filter(|_| on_kink) {
            let normal = SVector::<f64, OWN>::from_column_slice(normal.as_slice());
            matrix += normal * normal.transpose() * (1e9 * (1.0 + matrix.trace()));
        }
        for (place, prior) in self.shots[i].priors.iter().enumerate() {
            if let Some(prior) = prior {
                matrix[(place, place)] += 1.0;
                if *prior != OwnPrior::Held {
                    slope[place] += own[place];
                    cost += own[place] * own[place];
                }
            }
        }
        let by = gradient(&predicted.topspin);
        let normal = DVector::from_fn(OWN, |place, _| by[place]);
        cost.is_finite().then_some(Point {
            own,
            cost,
            topspin: predicted.topspin.re,
            normal,
            matrix,
            gradient: slope,
        })
    }
}
