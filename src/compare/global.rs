//! The least minimum of all samples together: as a single fit looks for it ([`crate::fit::global`]), each μ scanned with the
//! samples that have it.

use super::joint::{Solved, Weights, solve};
use super::layout::Layout;
use super::{CompareError, Sample};
use crate::fit::global::{friction_axis, promising, thinned};
use crate::fit::search::Effort;
use crate::measurement::parameter::{Parameter, Setting};
use crate::measurement::values::Values;
use crate::numerics::least_squares::scan;

/// The least minimum; each sample's μ may have several places to be descended from.
pub(super) fn solve_all(
    samples: &[Sample],
    layout: &Layout,
    weights: Weights,
) -> Result<Solved, CompareError> {
    let mut frictions: Vec<usize> =
        layout.columns.iter().filter_map(|columns| columns[Parameter::Mu as usize]).collect();
    frictions.sort_unstable();
    frictions.dedup();
    let mut layout = layout.clone();
    let mut others: Vec<(usize, f64)> = Vec::new();
    for column in frictions {
        let mut starts = starts_of(samples, &layout, column).into_iter();
        layout.start[column] = starts.next().unwrap_or(layout.start[column]);
        others.extend(starts.map(|start| (column, start)));
    }
    if !others.is_empty() {
        let screen =
            |layout: &Layout| solve(samples, layout, weights, Effort::SCREEN).map(|found| found.objective);
        let mut least = screen(&layout).unwrap_or(f64::INFINITY);
        for (column, start) in others {
            let other = layout.starting(column, start);
            if let Ok(objective) = screen(&other)
                && objective < least
            {
                (layout, least) = (other, objective);
            }
        }
    }
    solve(samples, &layout, weights, Effort::FULL)
}

/// Values of a μ near which the least minimum may be, the most promising first.
fn starts_of(samples: &[Sample], layout: &Layout, column: usize) -> Vec<f64> {
    let has = |i: &usize| layout.columns[*i][Parameter::Mu as usize] == Some(column);
    let members: Vec<usize> = (0..samples.len()).filter(has).collect();
    let part = layout.part(&members);
    let own: Vec<Sample> = members
        .iter()
        .map(|i| Sample { fitted: thinned(&samples[*i].fitted), ..samples[*i].clone() })
        .collect();
    let Some(column) = part.columns.first().and_then(|columns| columns[Parameter::Mu as usize]) else {
        return Vec::new();
    };
    let setting =
        Setting { lower: part.lower[column], upper: part.upper[column], ..Parameter::Mu.default_setting() };
    let Some(at) = own.first().map(|_| Values::from(part.coefficients(0, &part.start))) else {
        return Vec::new();
    };
    let shots = own.iter().flat_map(|sample| sample.fitted.iter().map(|shot| (&shot.plan, &sample.model)));
    let axis = friction_axis(&setting, shots, &at);
    let least = |mu: &[f64]| {
        let held = part.holding(column, mu[0]);
        let solved = solve(&own, &held, Weights::Unbiased, Effort::ROUGH).ok()?;
        Some(((mu[0], solved.chi2 / solved.observations as f64), solved.objective))
    };
    let minima = scan(&[axis], least);
    let scale = minima.first().map_or(1.0, |((_, scale), _)| *scale);
    promising(minima, scale).into_iter().map(|(mu, _)| mu).collect()
}
