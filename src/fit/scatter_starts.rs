//! Where fits of discs begin. By how much shots scatter is not known beforehand, and a scan with as much as all shots differ by sees one
//! wide valley where there are several narrow ones: which values of the friction are likely is therefore asked with the scatter that
//! is most likely at each of them.

use super::samples::Search;
use super::scatter::{Scatter, moves};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::prediction::difference;
use crate::likelihood::sample::Unknown;
use crate::measurement::observable::Observable;
use crate::measurement::parameter::{Parameter, Setting};
use crate::measurement::values::Values;
use crate::numerics::least_squares::scan;
use crate::physics::collision::Model;

/// Values in every factor of ten, of which the outcome follows no faster than by some percent from one to the next.
const PER_DECADE: f64 = 12.0;

/// Less friction hardly throws, and a stiffer contact is as good as rigid.
const LEAST_FRICTION: f64 = 0.01;

/// So many shots, spread evenly, tell where the minima are.
const MOST_SHOTS: usize = 40;

/// A start that is less likely by more than this in −2 log L is not descended from, nor are more than so many.
const LESS_LIKELY: f64 = 60.0;
const MOST: usize = 8;

/// Scatters that are tried, over as much as all shots differ by, from none on.
const TRIED: usize = 24;
const LEAST_TRIED: f64 = 1e-3;

/// The most promising values of μ and κ, as far as these are free; none if neither is, or if the friction falls.
pub(super) fn promising(raw: &[Fitted], search: &Search, free: &[Unknown]) -> Vec<Values> {
    let sample = search.first();
    let of = |p: Parameter| free.iter().copied().find(|unknown| unknown.parameter == p);
    let scanned: Vec<Unknown> = [Parameter::Kappa, Parameter::Mu].into_iter().filter_map(of).collect();
    if scanned.is_empty() || sample.settings.falls {
        return Vec::new();
    }
    let shots: Vec<&Fitted> = raw.iter().step_by(raw.len().div_ceil(MOST_SHOTS).max(1)).collect();
    let axes: Vec<Vec<f64>> = scanned.iter().map(|unknown| axis(&search.setting(*unknown))).collect();
    let mut initial = sample.initial;
    if of(Parameter::E).is_some() {
        initial[Parameter::E] = mean_restitution(&shots).unwrap_or(initial[Parameter::E]);
    }
    let minima = scan(&axes, |values| {
        let at = scanned
            .iter()
            .zip(values)
            .fold(initial, |at, (unknown, value)| at.with(unknown.parameter, *value));
        let (_, unlikely) = most_likely(&shots, sample.model, &at, f64::INFINITY)?;
        Some((at, unlikely))
    });
    let least = minima.first().map_or(f64::INFINITY, |(_, unlikely)| *unlikely);
    let near = minima.into_iter().filter(|(_, unlikely)| *unlikely <= least + LESS_LIKELY);
    near.take(MOST).map(|(at, _)| at).collect()
}

/// The scatter with which the search goes on from some values: no more than as much as all shots differ by.
pub(super) fn scatter_at(raw: &[Fitted], model: &Model, at: &Values, spread: Scatter) -> Scatter {
    let shots: Vec<&Fitted> = raw.iter().collect();
    match most_likely(&shots, model, at, spread.impulse_ratio) {
        Some((sd, _)) if spread.is_estimated => Scatter { impulse_ratio: sd, ..spread },
        _ => spread,
    }
}

fn axis(setting: &Setting) -> Vec<f64> {
    let (from, upper) = (setting.lower.max(LEAST_FRICTION).min(setting.upper), setting.upper);
    let steps = ((upper / from).log10() * PER_DECADE).ceil().max(1.0);
    (0..=steps as usize).map(|i| from * (upper / from).powf(i as f64 / steps)).collect()
}

fn mean_restitution(shots: &[&Fitted]) -> Option<f64> {
    let rows = shots.iter().flat_map(|shot| shot.plan.rows());
    let of: Vec<f64> =
        rows.filter(|row| row.observable == Observable::Restitution).map(|row| row.measured.value).collect();
    (!of.is_empty()).then(|| of.iter().sum::<f64>() / of.len() as f64)
}

/// The scatter of J_t/J_n that is most likely at some values, and −2 log L of J_t/J_n there up to a constant.
fn most_likely(shots: &[&Fitted], model: &Model, at: &Values, most: f64) -> Option<(f64, f64)> {
    let there = at.model(model);
    let of = |shot: &&Fitted| {
        let row = shot.plan.rows().iter().position(|row| row.observable == Observable::ImpulseRatio)?;
        let (prediction, _, covariance) = moves(shot, &there, at)?;
        let measured = &shot.plan.rows()[row];
        let off = difference(measured.observable, prediction.values[row], measured.measured.value);
        Some((off * off, covariance[(row, row)]))
    };
    let rows: Vec<(f64, f64)> = shots.iter().filter_map(of).collect();
    let widest = (rows.iter().map(|(square, _)| square).sum::<f64>() / rows.len().max(1) as f64).sqrt();
    let largest = widest.min(most);
    let sds = (0..TRIED).map(|i| match i {
        0 => 0.0,
        _ => largest * LEAST_TRIED.powf(1.0 - i as f64 / (TRIED - 1) as f64),
    });
    let unlikely = |sd: f64| {
        rows.iter()
            .map(|(square, variance)| square / (variance + sd * sd) + (variance + sd * sd).ln())
            .sum::<f64>()
    };
    let tried = sds.map(|sd| (sd, unlikely(sd))).filter(|(_, unlikely)| unlikely.is_finite());
    tried.min_by(|a, b| a.1.total_cmp(&b.1))
}
