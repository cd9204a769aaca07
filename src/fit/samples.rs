//! What a search is of: one sample, or several that are compared, and how their unknowns enter it.

use nalgebra::DVector;

use crate::likelihood::fitted::Fitted;
use crate::likelihood::problem::Problem;
use crate::likelihood::sample::{Sample, Unknown, shared_columns};
use crate::likelihood::whitening::Whitening;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Parameter, Setting};
use crate::measurement::values::Values;
use crate::numerics::least_squares::Bounds;

/// What is fitted, and how.
#[derive(Clone)]
pub(crate) struct Search<'a> {
    /// One, or several that are compared: never none.
    pub samples: Vec<Sample<'a>>,
    /// Whether noise is estimated by maximum likelihood, for comparing models, rather than without bias.
    pub maximum_likelihood: bool,
}

impl<'a> Search<'a> {
    /// Of one sample.
    pub(super) fn of(sample: Sample<'a>) -> Self {
        Self { samples: vec![sample], maximum_likelihood: false }
    }

    /// The sample of a fit of one.
    pub(super) fn first(&self) -> &Sample<'a> {
        &self.samples[0]
    }

    /// With every sample changed.
    pub(crate) fn with(&self, change: impl Fn(usize, &mut Sample<'a>)) -> Self {
        let mut search = self.clone();
        search.samples.iter_mut().enumerate().for_each(|(i, sample)| change(i, sample));
        search
    }

    /// With the shots of each sample, one after the other, in the place of its own.
    pub(super) fn with_shots(&self, shots: &'a [Vec<Fitted>]) -> Self {
        self.with(|i, sample| sample.fitted = &shots[i])
    }

    /// From other values, and with what is not free held there.
    pub(super) fn from(&self, values: &[Values]) -> Self {
        self.with(|i, sample| sample.initial = values[i])
    }

    /// As likelihoods are compared.
    pub(super) fn likeliest(&self) -> Self {
        Self { maximum_likelihood: true, ..self.clone() }
    }

    /// Where the fit starts.
    pub(crate) fn initial(&self) -> Vec<Values> {
        self.samples.iter().map(|sample| sample.initial).collect()
    }

    /// The shots of all samples.
    pub(super) fn shots(&self) -> impl Iterator<Item = &'a Fitted> + '_ {
        self.samples.iter().flat_map(|sample| sample.fitted)
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.samples.iter().map(|sample| sample.fitted.len()).sum()
    }

    /// Whether frames are fitted.
    pub(crate) fn is_filmed(&self) -> bool {
        self.samples.iter().any(Sample::is_filmed)
    }

    /// Whether χ² is a little rough: that of frames, by landings between them, and that of collisions that are integrated to a tolerance.
    pub(super) fn is_rough(&self) -> bool {
        self.is_filmed() || self.shots().any(|shot| shot.plan.is_direct())
    }

    /// Whether the model itself is integrated, to a tolerance that the search may come to feel in the end.
    pub(super) fn is_integrated(&self) -> bool {
        self.samples.iter().any(|sample| sample.model.fidelity.is_integrated())
    }

    /// Whether outlying shots count less.
    pub(crate) fn is_robust(&self) -> bool {
        self.samples.iter().any(|sample| sample.loss != Loss::Squares)
    }

    /// Numbers that are fitted, less the unknowns of each shot where its frames are.
    pub(crate) fn observations(&self) -> usize {
        let of = |shot: &Fitted| match &shot.film {
            Some(film) => film.observations().saturating_sub(film.unknowns()),
            None => shot.plan.rows().len(),
        };
        self.shots().map(of).sum()
    }

    /// Degrees of freedom where so many parameters are fitted.
    pub(crate) fn dof(&self, free: &[Unknown], fitted: usize) -> usize {
        (self.observations() + self.priors(free)).saturating_sub(fitted)
    }

    /// How an unknown enters the fit: within the bounds of all samples that it belongs to, with a prior that these share counted once.
    pub(crate) fn setting(&self, unknown: Unknown) -> Setting {
        let parameter = unknown.parameter;
        let mut own = self.members(unknown).map(|i| self.samples[i].settings[parameter]);
        let mut setting = own.next().unwrap_or(Setting::held(f64::NAN));
        for other in own {
            setting.lower = setting.lower.max(other.lower);
            setting.upper = setting.upper.min(other.upper).max(setting.lower);
            setting.prior = setting.prior.or(other.prior);
        }
        setting
    }

    /// Returns the start of a search, in the columns of the fit.
    pub(super) fn start(&self, free: &[Unknown]) -> DVector<f64> {
        let (shared, columns) = shared_columns(&self.samples, free.len());
        let mut start = DVector::zeros(columns);
        let initial = self.initial();
        for (column, unknown) in free.iter().enumerate() {
            start[column] = self.value(&initial, *unknown);
        }
        for (sample, own) in self.samples.iter().zip(&shared).filter(|(sample, _)| sample.is_filmed()) {
            for (column, unknown) in own.iter().zip(&sample.unknowns) {
                start[*column] = unknown.start;
            }
        }
        start
    }

    /// Returns the bounds of the free unknowns and of what the shots share, in the columns of the fit.
    pub(crate) fn bounds(&self, free: &[Unknown]) -> Bounds {
        let (shared, columns) = shared_columns(&self.samples, free.len());
        let mut bounds = Bounds::none(columns);
        for (column, unknown) in free.iter().enumerate() {
            let setting = self.setting(*unknown);
            (bounds.lower[column], bounds.upper[column]) = (setting.lower, setting.upper);
        }
        for (sample, own) in self.samples.iter().zip(&shared).filter(|(sample, _)| sample.is_filmed()) {
            for (column, unknown) in own.iter().zip(&sample.unknowns) {
                [bounds.lower[*column], bounds.upper[*column]] = unknown.bounds;
            }
        }
        bounds
    }

    /// The samples that an unknown belongs to.
    pub(crate) fn members(&self, unknown: Unknown) -> impl Iterator<Item = usize> + '_ {
        (0..self.samples.len()).filter(move |i| self.samples[*i].has(unknown))
    }

    /// An unknown among the values of all samples.
    pub(crate) fn value(&self, values: &[Values], unknown: Unknown) -> f64 {
        self.members(unknown).next().map_or(f64::NAN, |i| values[i][unknown.parameter])
    }

    /// The values with an unknown changed.
    pub(crate) fn set(&self, values: &[Values], unknown: Unknown, value: f64) -> Vec<Values> {
        let mut values = values.to_vec();
        for i in self.members(unknown) {
            values[i][unknown.parameter] = value;
        }
        values
    }

    /// How many of the unknowns have a prior.
    pub(crate) fn priors(&self, free: &[Unknown]) -> usize {
        free.iter().filter(|unknown| self.setting(**unknown).prior.is_some()).count()
    }

    /// The problem that is minimised.
    pub(super) fn problem(&'a self, free: &[Unknown], whitening: &'a [Whitening]) -> Problem<'a> {
        let priors: Vec<_> = free.iter().map(|unknown| (*unknown, self.setting(*unknown).prior)).collect();
        Problem::new(&self.samples, &priors, whitening)
    }

    /// What is estimated of all samples with the free unknowns at x.
    pub(super) fn values(&self, free: &[Unknown], x: &DVector<f64>) -> Vec<Values> {
        self.samples.iter().map(|sample| sample.values(free, x)).collect()
    }

    /// Everything that is neither stated nor undetermined.
    pub(super) fn free(&self) -> Vec<Unknown> {
        let of = |parameter: Parameter| {
            let own = self.samples.iter().filter(move |sample| sample.is_free(parameter));
            own.map(move |sample| Unknown { parameter, number: sample.numbers[parameter as usize] })
        };
        let mut free: Vec<Unknown> = Parameter::ALL.into_iter().flat_map(of).collect();
        free.sort_unstable();
        free.dedup();
        free
    }

    /// Free parameters of a sample that none of its observations depends on, whatever the friction, and that have no prior.
    pub(crate) fn silent(sample: &Sample) -> Vec<Parameter> {
        let mut informed = [false; Parameter::ALL.len()];
        for at in sample.initial.across_friction(sample.settings) {
            for shot in sample.fitted {
                let predicted = shot.plan.predict(&at.model(sample.model), &at.coefficients());
                let Ok(prediction) = predicted else { continue };
                for (informed, depends) in informed.iter_mut().zip(shot.plan.depends(&prediction)) {
                    *informed |= depends;
                }
            }
        }
        let silent = |p: &Parameter| {
            let setting = &sample.settings[*p];
            !setting.fixed && !informed[*p as usize] && setting.prior.is_none()
        };
        sample.settings.parameters().into_iter().filter(silent).collect()
    }
}
