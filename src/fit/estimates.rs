//! Estimates with their errors, intervals and correlations, from the minimum that a search settled at.

use nalgebra::DMatrix;

use super::intervals::confidence_region::{self, Contour};
use super::intervals::profile::{Profile, Profiles};
use super::noise::Group;
use super::robust::Sandwich;
use super::scatter::Scatter;
use super::settled::Settled;
use super::slice::Slice;
use super::uncertainty::{self, Quantiles, Uncertainty};
use super::{Depth, Estimate, Plateau, Status};
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;

/// What a fit of one sample says of its parameters.
pub(super) struct Estimates {
    /// Of the parameters that the fit has, in the order of [`Parameter::ALL`].
    pub all: Vec<Estimate>,
    /// A row and a column for each; NaN where there is no standard error.
    pub correlation: DMatrix<f64>,
    /// Regions of pairs.
    pub contours: Vec<Contour>,
    /// Of each parameter that is free.
    pub profiles: Vec<Profile>,
    /// The least cost that was met, which may be below that of the minimum.
    pub lowest: f64,
    /// Other minima that are nearly as likely, outside the intervals around the best one.
    pub rivals: Vec<Rival>,
    /// Whether the noise is stated, or could be estimated.
    pub knows_noise: bool,
}

/// Another minimum that is nearly as likely.
pub(super) struct Rival {
    /// The parameters that are outside their intervals around the best minimum.
    pub values: Vec<(Parameter, f64)>,
    /// By how much what is minimised is higher there.
    pub higher: f64,
    /// Whether it is within the 95 % rise, so that the intervals were extended to it.
    pub is_included: bool,
}

impl Estimates {
    /// `others`: other minima, with how much higher what is minimised is there.
    pub(super) fn of(
        settled: &Settled,
        (scatter, others): (Option<Scatter>, &[(Values, f64)]),
        depth: Depth,
    ) -> Self {
        let Settled { search, free: unknowns, minimum, estimated, .. } = settled;
        let sample = search.first();
        let (settings, shots) = (sample.settings, sample.fitted.len());
        let free: Vec<Parameter> = unknowns.iter().map(|unknown| unknown.parameter).collect();
        let knows_noise = estimated.iter().all(Group::is_known);
        let sandwich = Sandwich::new(search, minimum, free.len());
        // honest errors come of the scatter of the shots
        let estimated_dof = match &sandwich {
            _ if scatter.is_some_and(|scatter| !scatter.is_none()) => {
                Some(shots.saturating_sub(free.len()).max(1))
            }
            Some(sandwich) => Some((shots as f64 - sandwich.unknowns).round() as usize),
            None => (!estimated.is_empty()).then(|| search.dof(unknowns, minimum.parameters())),
        };
        let quantiles = Quantiles::new(estimated_dof).filter(|_| knows_noise);
        let mut uncertainty =
            uncertainty::of(minimum, &free, settings, quantiles.as_ref(), sandwich.as_ref());
        let mut rivals: Vec<Rival> = Vec::new();
        let mut lowest = minimum.cost;
        let (mut contours, mut curves) = (Vec::new(), Vec::new());
        if let (true, None, Some(quantiles)) = (depth >= Depth::Intervals, &sandwich, &quantiles) {
            let bounds = minimum.bounds.clone();
            let slice = Slice::new(search, unknowns, bounds, &minimum.whitening).near(&minimum.x);
            let mut profiles = Profiles::new(&slice, minimum, quantiles);
            for (column, estimate) in uncertainty.estimates.iter_mut().enumerate() {
                // along a ratio of the balls χ² is a parabola, by its prior or since frames determine it well
                let is_of_contact = !estimate.parameter.is_of_balls();
                let expected = estimate.interval_95;
                let profile = is_of_contact.then(|| profiles.interval(column, estimate.status, expected));
                estimate.choose_interval(profile.flatten());
            }
            let own_profiles: Vec<Option<[f64; 2]>> =
                uncertainty.estimates.iter().map(|estimate| estimate.intervals.profile).collect();
            for (values, higher) in others {
                let x = free.iter().enumerate().fold(minimum.x.clone(), |mut x, (column, parameter)| {
                    x[column] = values[*parameter];
                    x
                });
                let is_included = *higher <= quantiles.two_sided.powi(2) * settled.scale();
                let mut outside = Vec::new();
                for (column, estimate) in uncertainty.estimates.iter_mut().enumerate() {
                    if !estimate.holds(x[column]) {
                        outside.push((estimate.parameter, x[column]));
                        if is_included {
                            estimate.extend_interval(profiles.around(column, &x));
                        }
                    }
                }
                if !outside.is_empty() {
                    rivals.push(Rival { values: outside, higher: *higher, is_included });
                }
            }
            if depth >= Depth::Everything {
                let of = |(column, estimate): (usize, &Estimate)| {
                    let ends = own_profiles[column].filter(|_| estimate.status == Status::Free)?;
                    Some(Profile { parameter: estimate.parameter, points: profiles.curve(column, ends) })
                };
                curves = uncertainty.estimates.iter().enumerate().filter_map(of).collect();
            }
            lowest = profiles.lowest;
            if depth >= Depth::Everything {
                contours = confidence_region::contours(&slice, minimum, estimated_dof);
            }
        }
        // what others hang on is not silent, even where it may be anywhere
        if uncertainty.estimates.iter().all(|estimate| estimate.std_error_at_bound.is_none()) {
            for estimate in &mut uncertainty.estimates {
                *estimate = estimate.unless_uninformed(&settings[estimate.parameter]);
            }
            let silent = uncertainty.estimates.iter().filter(|e| e.status == Status::NotIdentified);
            let silent: Vec<Parameter> = silent.map(|estimate| estimate.parameter).collect();
            contours.retain(|contour| !contour.parameters.iter().any(|p| silent.contains(p)));
            curves.retain(|curve| !silent.contains(&curve.parameter));
        }
        let all = settings.parameters();
        let all = all.iter().map(|p| of_parameter(*p, settled, (&free, &uncertainty), quantiles.as_ref()));
        let all: Vec<Estimate> = all.collect();
        let place = |p: &Parameter| all.iter().position(|known| known.parameter == *p);
        let mut correlation = DMatrix::from_element(all.len(), all.len(), f64::NAN);
        for (i, a) in free.iter().enumerate() {
            for (j, b) in free.iter().enumerate() {
                let (Some(row), Some(column)) = (place(a), place(b)) else { continue };
                correlation[(row, column)] = uncertainty.correlation[(i, j)];
            }
        }
        Self { all, correlation, contours, profiles: curves, lowest, rivals, knows_noise }
    }
}

/// The estimate of a parameter: fitted, on a plateau, or where it is held.
fn of_parameter(
    parameter: Parameter,
    settled: &Settled,
    (free, uncertainty): (&[Parameter], &Uncertainty),
    quantiles: Option<&Quantiles>,
) -> Estimate {
    let Settled { search, minimum, estimated, plateaus, .. } = settled;
    if let Some(column) = free.iter().position(|p| *p == parameter) {
        return uncertainty.estimates[column];
    }
    let held = Estimate::bare(parameter, minimum.first()[parameter], Status::NotIdentified);
    let mut plateaus = plateaus.iter().map(|(_, plateau)| plateau);
    match plateaus.find(|plateau: &&Plateau| plateau.parameter == parameter) {
        Some(plateau) => Estimate {
            value: plateau.edge,
            interval_95: quantiles
                .map(|quantiles| search.plateau_interval(plateau, minimum, estimated, quantiles.one_sided)),
            status: Status::Free,
            ..held
        },
        None if search.first().settings[parameter].fixed => Estimate { status: Status::Fixed, ..held },
        None => held,
    }
}
