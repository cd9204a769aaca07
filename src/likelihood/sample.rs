//! What is fitted together: one sample or several, each the shots of a data set or of one of its labels, and the map of columns: which
//! value of each parameter is that of which sample.
//!
//! A fit is one sample, a comparison several. The columns of a fit are the free [`Unknown`]s in their order, and behind them what the
//! shots of each data set share besides: unknowns of its film, or errors of its extraction.

use nalgebra::DVector;

use super::fitted::Fitted;
use super::frames;
use super::frames::shared_unknowns::{Kind, SharedUnknown};
use crate::film::camera::Camera;
use crate::measurement::correction::Correction;
use crate::measurement::dataset::{Dataset, Shared};
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::values::Values;
use crate::physics::collision::Model;

/// A value of a parameter that is free.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Unknown {
    pub parameter: Parameter,
    /// Its number among the values that the parameter has in several samples.
    pub number: usize,
}

/// Which value of each parameter is a sample's, in the order of [`Parameter::ALL`]: samples of the same number share it.
pub type Numbers = [usize; Parameter::ALL.len()];

/// Shots that have all their parameters in common.
#[derive(Clone)]
pub struct Sample<'a> {
    /// Whose shots these are, where there are several samples.
    pub title: &'a str,
    /// Number of its data set: samples of one share noise that is estimated, errors of the extraction and unknowns of the film.
    pub dataset: usize,
    pub fitted: &'a [Fitted],
    pub model: &'a Model,
    pub settings: &'a Settings,
    pub loss: Loss,
    /// Standard errors that all shots share.
    pub shared_errors: Vec<(Shared, f64)>,
    /// What all shots share besides the parameters, where their frames are fitted.
    pub unknowns: Vec<SharedUnknown>,
    /// The camera from which its corrections are counted, where samples of other data sets were filmed by the same one.
    pub camera: Option<Camera>,
    pub numbers: Numbers,
    /// Parameters that are not free although they are not fixed: the data do not determine them.
    pub undetermined: Vec<Parameter>,
    /// Units in which each observable has a noise of its own where that is estimated; in the others one noise is that of all.
    pub noise_apart: Vec<&'static str>,
    /// Where the fit starts, and what parameters that are not free are held at.
    pub initial: Values,
}

impl<'a> Sample<'a> {
    /// Shots of a data set with a model and settings for them, fitted alone, by velocities and as the data set says.
    pub fn of(
        dataset: &'a Dataset,
        fitted: &'a [Fitted],
        (model, settings, initial): (&'a Model, &'a Settings, Values),
    ) -> Self {
        Self {
            title: "",
            dataset: 0,
            fitted,
            model,
            settings,
            loss: dataset.loss,
            shared_errors: dataset.shared_errors(),
            unknowns: Vec::new(),
            camera: None,
            numbers: Numbers::default(),
            undetermined: Vec::new(),
            noise_apart: Vec::new(),
            initial,
        }
    }

    /// Whether its frames are fitted.
    pub fn is_filmed(&self) -> bool {
        self.fitted.first().is_some_and(|shot| shot.film.is_some())
    }

    /// Whether an unknown is its value of the parameter.
    pub fn has(&self, unknown: Unknown) -> bool {
        let Unknown { parameter, number } = unknown;
        self.numbers[parameter as usize] == number && self.is_free(parameter)
    }

    /// Whether a parameter is neither stated nor undetermined.
    pub fn is_free(&self, parameter: Parameter) -> bool {
        self.settings.has(parameter)
            && !self.settings[parameter].fixed
            && !self.undetermined.contains(&parameter)
    }

    /// The columns that are its parameters, each with its parameter.
    pub fn columns(&self, free: &[Unknown]) -> Vec<(usize, Parameter)> {
        let own = free.iter().enumerate().filter(|(_, unknown)| self.has(**unknown));
        own.map(|(column, unknown)| (column, unknown.parameter)).collect()
    }

    /// Its values with the free unknowns at x, the others as they are held.
    pub fn values(&self, free: &[Unknown], x: &DVector<f64>) -> Values {
        let own = free.iter().zip(x.iter()).filter(|(unknown, _)| self.has(**unknown));
        own.fold(self.initial, |values, (unknown, value)| values.with(unknown.parameter, *value))
    }

    /// Residuals of its shots.
    pub fn rows(&self) -> usize {
        if self.is_filmed() {
            return frames::ROWS * self.fitted.len();
        }
        self.fitted.iter().map(|shot| shot.plan.rows().len()).sum()
    }

    /// Which correction of a camera that samples share an unknown is, by its place among those of the film.
    pub fn shared_correction(&self, place: usize) -> Option<Correction> {
        if !self.is_filmed() || self.camera.is_none() {
            return None;
        }
        match self.unknowns.get(place)?.kind {
            Kind::Camera(which) => Some(which),
            _ => None,
        }
    }

    /// How many unknowns its shots share besides the parameters.
    pub fn shared(&self) -> usize {
        if self.is_filmed() { self.unknowns.len() } else { self.shared_errors.len() }
    }
}

/// The columns that are not parameters: those of what the shots of each sample share, and how many columns there are in all. Samples of one
/// data set have the same, and so have corrections of one camera.
pub fn shared_columns(samples: &[Sample], free: usize) -> (Vec<Vec<usize>>, usize) {
    let (mut columns, mut next): (Vec<Vec<usize>>, usize) = (Vec::new(), free);
    let mut of_camera: Vec<(Correction, usize)> = Vec::new();
    for (i, sample) in samples.iter().enumerate() {
        if let Some(known) = samples[..i].iter().position(|other| other.dataset == sample.dataset) {
            columns.push(columns[known].clone());
            continue;
        }
        let mut column = |place: usize| {
            let which = sample.shared_correction(place);
            let known = which.and_then(|which| of_camera.iter().find(|(known, _)| *known == which));
            if let Some((_, column)) = known {
                return *column;
            }
            of_camera.extend(which.map(|which| (which, next)));
            next += 1;
            next - 1
        };
        columns.push((0..sample.shared()).map(&mut column).collect());
    }
    (columns, next)
}

/// By how much more what the shots of a sample share is off than its columns say: corrections of a camera that samples share are counted from
/// where the first has it.
pub fn offsets(samples: &[Sample], sample: &Sample) -> Vec<f64> {
    let from = samples.iter().find_map(|first| first.camera);
    let offset = |place: usize| match (sample.shared_correction(place), from, sample.camera) {
        (Some(which), Some(from), Some(own)) => from.get(which) - own.get(which),
        _ => 0.0,
    };
    (0..sample.shared()).map(offset).collect()
}
