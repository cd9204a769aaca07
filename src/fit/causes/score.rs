//! By how much −2 log L would fall if an assumption were given up, from its slope and curvature where it is not: Rao's score test, which
//! takes two evaluations more for each, in the place of some ten fits.
//!
//! With C = ½χ² of the frames, least over each shot's own unknowns, x what the shots share and δ the assumption:
//!
//!   S = C_δδ − C_δx C_xx⁻¹ C_xδ,  g = C_δ − C_δx C_xx⁻¹ C_x:  χ² falls by g²/S
//!
//! - C. R. Rao (1948), Proc. Camb. Phil. Soc. 44, 50.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::cause::Cause;
use super::hypothesis::{Departures, Trial};
use crate::fit::samples::Search;
use crate::fit::settled::Settled;
use crate::likelihood::whitening::Hold;

/// Causes that χ² follows smoothly and that are computed fast, each with a step over which differences are taken: about a standard error
/// of 40 good shots.
const STEPS: [(Cause, f64); 5] = [
    (Cause::FrameRate, 0.005),
    (Cause::MassRatio, 0.001),
    (Cause::FallingFriction, 0.003),
    (Cause::TiltX, 5e-4),
    (Cause::TiltY, 5e-4),
];

/// A frame rate that is wrong is so by more, over which χ² is no parabola: what the other unknowns would leave of it is looked at there.
const FRAME_RATES: [f64; 4] = [0.88, 0.94, 1.06, 1.12];

/// A fit as it is, about which each assumption is moved.
pub(super) struct Score<'a> {
    trial: &'a Trial<'a>,
    settled: &'a Settled<'a>,
    cost: f64,
    gradient: DVector<f64>,
    curvature: Cholesky<f64, Dyn>,
}

impl<'a> Score<'a> {
    /// `None` where the minimum does not curve upwards, or cannot be had.
    pub(super) fn of(trial: &'a Trial<'a>, settled: &'a Settled<'a>) -> Option<Self> {
        let (cost, gradient, jacobian) = evaluated(trial, settled, &Departures::default())?;
        let curvature = jacobian.tr_mul(&jacobian).cholesky()?;
        Some(Self { trial, settled, cost, gradient, curvature })
    }

    /// Assumptions without which χ² would fall by more than this.
    pub(super) fn suspects(&self, least: f64) -> Vec<Cause> {
        let near = STEPS.into_iter().filter(|(cause, _)| self.trial.knows(*cause));
        let near = near.filter_map(|(cause, step)| Some((cause, self.fall(cause, step)?)));
        let far = FRAME_RATES
            .into_iter()
            .filter_map(|rate| Some((Cause::FrameRate, self.fall_at(Cause::FrameRate, rate)?)));
        let mut suspects: Vec<Cause> = Vec::new();
        for (cause, fall) in near.chain(far) {
            if fall > least && !suspects.contains(&cause) {
                suspects.push(cause);
            }
        }
        suspects
    }

    /// By how much χ² would be lower with this value: C − C′ + ½ gᵀ H⁻¹ g, with C′, g and H = JᵀJ there. What the shots share moves by one
    /// step.
    fn fall_at(&self, cause: Cause, value: f64) -> Option<f64> {
        let (cost, gradient, jacobian) =
            evaluated(self.trial, self.settled, &Departures::default().with(cause, value))?;
        let curvature = jacobian.tr_mul(&jacobian).cholesky()?;
        let promised = 0.5 * gradient.dot(&curvature.solve(&gradient));
        Some(2.0 * (self.cost - cost + promised))
    }

    /// By how much χ² would fall; `None` where it does not curve upwards, or cannot be had.
    fn fall(&self, cause: Cause, step: f64) -> Option<f64> {
        let at = |value| evaluated(self.trial, self.settled, &Departures::default().with(cause, value));
        let assumed = self.trial.assumed(cause);
        let (low, by_low, _) = at(assumed - step)?;
        let (high, by_high, _) = at(assumed + step)?;
        let curvature = (high + low - 2.0 * self.cost) / (step * step);
        let coupling = (by_high - by_low) / (2.0 * step);
        let carried = self.curvature.solve(&coupling);
        let slope = (high - low) / (2.0 * step) - carried.dot(&self.gradient);
        let left = curvature - carried.dot(&coupling);
        (left > 0.0).then(|| slope * slope / left)
    }
}

/// ½χ² at the minimum of the fit, its gradient and the Jacobian of the residuals.
fn evaluated(
    trial: &Trial,
    settled: &Settled,
    departures: &Departures,
) -> Option<(f64, DVector<f64>, DMatrix<f64>)> {
    let x = &settled.minimum.x;
    let altered = trial.altered(departures, trial.start);
    let search = Search::of(altered.of(trial.sample));
    let at = std::slice::from_ref(&trial.start);
    let whitening = search.whitening(at, &[], (settled.free.len(), x), (None, Hold::None)).ok()?;
    let (residuals, jacobian) = search.problem(&settled.free, &whitening).evaluate_at(x);
    let gradient = jacobian.tr_mul(&residuals);
    let cost = 0.5 * residuals.norm_squared();
    cost.is_finite().then_some((cost, gradient, jacobian))
}
