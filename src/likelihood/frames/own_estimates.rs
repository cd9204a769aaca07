//! A shot's own unknowns as estimates: their values in the frame of the table, with standard errors.

use nalgebra::{SMatrix, SVector};

use super::own_unknowns::is_at_end;
use super::schur_reduced::{Eliminated, place};
use super::{ALL_SHARED, Film, MEASURED, MORE_SHARED, OWN, Own, SHARED, SPIN, Shared, UNKNOWN};
use crate::likelihood::corrected::Corrected;

/// Covariance of what all shots share; 0 where something is held, NaN where it is not known.
pub type SharedCovariance = SMatrix<f64, ALL_SHARED, ALL_SHARED>;

/// Covariance of a shot's own unknowns; 0 where it does not have one, or it is at an end of where it may be.
type Covariance = SMatrix<f64, { OWN + SPIN }, { OWN + SPIN }>;

/// An estimate that a shot has of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OwnEstimate {
    /// Its column in tables, in the unit of its name; velocities m/s, angular velocities rad/s.
    pub column: &'static str,
    pub value: f64,
    /// Standard error, that of what all shots share carried over; NaN where that is not known.
    pub sd: f64,
}

impl Film {
    /// The shot's own unknowns at `own`, where χ² is least for what all shots share. Empty where there is no collision.
    pub(crate) fn own_estimates(
        &self,
        collision: &Corrected,
        shared: &Shared,
        own: &Own,
        errors: &SharedCovariance,
    ) -> Vec<OwnEstimate> {
        let Some(covariance) = self.own_covariance(collision, shared, own, errors) else { return Vec::new() };
        let estimate = |column, value: f64, by: Own| OwnEstimate {
            column,
            value,
            sd: by.dot(&(covariance * by)).sqrt(),
        };
        let itself = |column, i: usize| {
            let mut by = Own::zeros();
            by[i] = 1.0;
            estimate(column, own[i], by)
        };
        let mut estimates =
            vec![itself("impact_t_s", 0), itself("object_x_m", 1), itself("object_y_m", 2), {
                let mut by = Own::zeros();
                by[3] = 1_f64.to_degrees();
                estimate("normal_deg", own[3].to_degrees(), by)
            }];
        // along and across the line of centres, which turns
        let (sin, cos) = own[3].sin_cos();
        let velocity = [cos * own[4] - sin * own[5], sin * own[4] + cos * own[5]];
        for (column, value, by) in [
            ("cue_vx", velocity[0], [-velocity[1], cos, -sin]),
            ("cue_vy", velocity[1], [velocity[0], sin, cos]),
        ] {
            let mut all = Own::zeros();
            all.fixed_rows_mut::<3>(3).copy_from_slice(&by);
            estimates.push(estimate(column, value, all));
        }
        if self.spin.is_some() {
            let columns = ["cue_wx", "cue_wy", "cue_wz"].into_iter().enumerate();
            estimates.extend(columns.map(|(i, column)| itself(column, OWN + i)));
        } else if self.rolls_unknown() {
            estimates.push(itself("cue_topspin_of_roll", OWN));
        } else if self.one_unknown().is_some() {
            estimates.push(itself("cue_side_spin_of_speed", OWN));
        }
        estimates
    }

    fn own_covariance(
        &self,
        collision: &Corrected,
        shared: &Shared,
        own: &Own,
        errors: &SharedCovariance,
    ) -> Option<Covariance> {
        const MEASURED_MORE: usize = MEASURED + MORE_SHARED;
        const UNKNOWN_MORE: usize = UNKNOWN + MORE_SHARED;
        const KNOWN_MORE: usize = OWN + MORE_SHARED;
        let at = (shared, own, errors);
        match (self.unknowns(), collision.has_others()) {
            (MEASURED, false) => self.covariance_with::<{ MEASURED + SHARED }, SHARED>(collision, at),
            (UNKNOWN, false) => self.covariance_with::<{ UNKNOWN + SHARED }, SHARED>(collision, at),
            (_, false) => self.covariance_with::<{ OWN + SHARED }, SHARED>(collision, at),
            (MEASURED, true) => self.covariance_with::<MEASURED_MORE, MORE_SHARED>(collision, at),
            (UNKNOWN, true) => self.covariance_with::<UNKNOWN_MORE, MORE_SHARED>(collision, at),
            (_, true) => self.covariance_with::<KNOWN_MORE, MORE_SHARED>(collision, at),
        }
    }

    /// Cov(y) = A_yy⁻¹ + G·Cov(p)·Gᵀ with G = dy/dp = −A_yy⁻¹A_yp, of own unknowns y and shared parameters p.
    fn covariance_with<const N: usize, const S: usize>(
        &self,
        collision: &Corrected,
        (shared, own, errors): (&Shared, &Own, &SharedCovariance),
    ) -> Option<Covariance> {
        let unknowns = N - S;
        let mut all = SVector::<f64, N>::zeros();
        for i in 0..unknowns {
            all[i] = own[i];
        }
        for i in 0..S {
            all[unknowns + i] = shared[place(i)];
        }
        let normal = self.normal::<N, S>(collision, &all, &std::array::from_fn(|i| shared[SHARED + i]))?;
        let held = if self.rolls_unknown() && is_at_end(own[OWN]) { OWN } else { N };
        let Eliminated { by_shared, .. } = normal.reduce(held)?;
        let alone = normal.own_part(0.0, held)?.inverse();
        let carried = by_shared * errors * by_shared.transpose();
        let mut covariance = Covariance::zeros();
        for i in 0..unknowns.min(held) {
            for j in 0..unknowns.min(held) {
                covariance[(i, j)] = alone[(i, j)] + carried[(i, j)];
            }
        }
        Some(covariance)
    }
}
