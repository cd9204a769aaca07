//! Confidence regions of pairs of parameters: contours of χ², minimised over the others, at a given
//! rise above its minimum, beside the ellipse of its curvature.

use nalgebra::{Matrix2, Vector2};
use schemars::JsonSchema;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use crate::fit::Estimate;
use crate::measurement::parameter::Parameter;
use crate::problem::{Estimates, Id, Solution};

/// The regions that are drawn: they hold the true pair with this probability.
pub(crate) const LEVELS: [f64; 2] = [0.68, 0.95];

/// The confidence regions of a pair of parameters.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Contour {
    /// Names of both parameters.
    pub(crate) parameters: [Parameter; 2],
    /// Estimates of both parameters, in their units.
    pub(crate) centre: [f64; 2],
    /// One region for each probability.
    pub(crate) levels: Vec<Level>,
}

/// A confidence region.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub(crate) struct Level {
    /// Probability that the region holds both true values, as 0.68 or 0.95.
    pub(crate) probability: f64,
    /// Rise of χ² above its minimum at the edge.
    pub(crate) chi2_rise: f64,
    /// Points of the closed edge, within the bounds: values of the first and of the second
    /// parameter.
    pub(crate) edge: Vec<[f64; 2]>,
}

/// Returns the regions of all pairs; `dof` are those of a noise that was estimated.
pub(in crate::fit) fn contours(
    solution: &Solution,
    covariance: &Estimates,
    estimates: &[&Estimate],
    dof: Option<f64>,
) -> Vec<Contour> {
    let contour = |pair: [&Estimate; 2]| {
        let ids = pair.map(|estimate| Id::from(estimate.parameter));
        let centre = pair.map(|estimate| estimate.value);
        let covariance = covariance.between(&ids);
        // without a covariance of both, from its interval or its bounds
        let reach = |i: usize| {
            pair[i].std_error.unwrap_or_else(|| {
                let [low, high] = pair[i].interval_95.unwrap_or(solution.problem.unknown(ids[i]).bounds);
                0.25 * (high - low)
            })
        };
        let root = Matrix2::from_fn(|i, j| covariance[(i, j)])
            .cholesky()
            .map_or_else(|| Matrix2::from_diagonal(&Vector2::new(reach(0), reach(1))), |root| root.l());
        // of films, whose χ² takes long, and of parabolas, to a tenth, the ellipse serves
        let is_ellipse = solution.is_film() || pair.iter().all(|estimate| estimate.is_in_the_middle());
        let level = |probability: f64| {
            let chi2_rise = rise(probability, dof)?;
            let edge = solution.region(ids.map(|id| id as usize), &root, (chi2_rise, is_ellipse))?;
            Some(Level { probability, chi2_rise, edge })
        };
        let levels: Option<Vec<Level>> = LEVELS.into_iter().map(level).collect();
        Some(Contour { parameters: pair.map(|estimate| estimate.parameter), centre, levels: levels? })
    };
    let after = |i: usize| estimates[i + 1..].iter().map(move |second| [estimates[i], second]);
    (0..estimates.len()).flat_map(after).filter_map(contour).collect()
}

/// χ² rises by this on the edge of the region of two parameters.
fn rise(probability: f64, dof: Option<f64>) -> Option<f64> {
    match dof {
        None => Some(ChiSquared::new(2.0).ok()?.inverse_cdf(probability)),
        Some(dof) => Some(2.0 * FisherSnedecor::new(2.0, dof).ok()?.inverse_cdf(probability)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_of_two_parameters() {
        // −2 ln(1 − p) for χ²(2)
        assert!((rise(0.95, None).unwrap() + 2.0 * 0.05_f64.ln()).abs() < 1e-9);
        assert!((rise(0.68, None).unwrap() + 2.0 * 0.32_f64.ln()).abs() < 1e-9);
        // 2 F(2, 10) at 95 %: scipy.stats.f.ppf(0.95, 2, 10) = 4.102 821
        assert!((rise(0.95, Some(10.0)).unwrap() - 2.0 * 4.102_821).abs() < 1e-5);
    }
}
