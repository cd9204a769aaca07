//! The fit of all samples together, and what it says besides the parameters.

use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::sample::{Apart, Group, search};
use super::sliding::Known;
use super::uninformed::{Informed, settle};
use super::verdict::{Tests, at_bounds};
use super::{COMPARED, CompareError, Compared, Comparison, Finding, LabelResidual, Options, Robust, warning};
use crate::fit::Method;
use crate::fit::fidelity_choice;
use crate::fit::minimum::Minimum;
use crate::fit::outlying::Odd;
use crate::fit::outlying_rows;
use crate::fit::robust::Sandwich;
use crate::fit::rows::residual_rows;
use crate::fit::samples::Search;
use crate::fit::settled::Settled;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::shared_columns;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::measurement::values::Values;

/// The fit of all samples together.
pub(super) struct FitOfAll<'a> {
    pub groups: &'a [Group<'a>],
    /// As it was before anything turned out not to be determined.
    pub before: Search<'a>,
    pub informed: Informed<'a>,
    /// Of what is tested: velocities, of frames those that were extracted from them.
    tested: Option<(Search<'a>, Minimum)>,
    pub covariance: Option<DMatrix<f64>>,
    pub tests: Tests,
    /// Whether what residuals are compared with was estimated from them: the noise, or what shots of discs scatter by.
    noise_estimated: bool,
}

impl<'a> FitOfAll<'a> {
    pub(super) fn new(
        groups: &'a [Group],
        shots: &'a [Vec<Fitted>],
        apart: &Apart,
        starts: &[Vec<Values>],
    ) -> Result<Self, CompareError> {
        let mut velocities = search(groups, shots, apart);
        let all: Vec<usize> = (0..groups.len()).collect();
        let mut informed = settle(&velocities, starts, all.clone())?;
        let Settled { search: found, minimum, estimated, .. } = &informed.settled;
        let unequal = found.unequal_noise(minimum, estimated);
        if unequal.iter().any(|units| !units.is_empty()) {
            for (place, units) in informed.places.iter().zip(unequal) {
                velocities.samples[*place].noise_apart = units;
            }
            informed = settle(&velocities, starts, all)?;
        }
        let before = velocities;
        let Settled { search, free, minimum, estimated, .. } = &informed.settled;
        let knows_noise = estimated.iter().all(|group| group.is_known());
        let sandwich = Sandwich::new(search, minimum, free.len());
        let covariance = if search.is_robust() && sandwich.is_none() || !knows_noise {
            None
        } else {
            match &sandwich {
                None => minimum.covariance(),
                Some(sandwich) => sandwich.covariance_of_all(),
            }
        };
        let scatters = groups.iter().any(|group| group.scatters);
        let tests = if search.is_robust() || scatters {
            // honest errors come of the scatter of the shots
            Tests { dof: search.count().saturating_sub(minimum.parameters()), estimated: true }
        } else {
            Tests { dof: search.dof(free, minimum.parameters()), estimated: !estimated.is_empty() }
        };
        let tested = None;
        let noise_estimated = !estimated.is_empty() || scatters;
        Ok(Self { groups, before, informed, tested, covariance, tests, noise_estimated })
    }

    /// Of each group, the shots of films and of tables that fit no collision that fits those of the others.
    pub(super) fn odd(&self) -> Vec<Vec<Odd>> {
        let mut found = vec![Vec::new(); self.groups.len()];
        let settled = &self.informed.settled;
        let are_tables = self.groups.iter().all(|group| group.dataset.tracks.is_none());
        let odd = if are_tables { outlying_rows::outlying(settled) } else { return found };
        for (place, odd) in self.informed.places.iter().zip(odd) {
            found[*place] = odd;
        }
        found
    }

    pub(super) fn minimum(&self) -> &Minimum {
        &self.informed.settled.minimum
    }

    /// What residuals are said of.
    fn tested(&self) -> (&Search<'a>, &Minimum) {
        let Settled { search, minimum, .. } = &self.informed.settled;
        self.tested.as_ref().map_or((search, minimum), |(search, minimum)| (search, minimum))
    }

    /// χ² and degrees of freedom of what is tested.
    pub(super) fn goodness(&self) -> (f64, usize) {
        let (search, minimum) = self.tested();
        (2.0 * minimum.cost, search.dof(&self.informed.settled.free, minimum.parameters()))
    }

    pub(super) fn compared(
        &self,
        labels: &[String],
        (options, method): (&Options, Method),
        stage: &dyn Fn(&str),
    ) -> Result<Comparison, CompareError> {
        let Settled { search, free, minimum, .. } = &self.informed.settled;
        let present = |parameter: &Parameter| self.groups.iter().any(|g| g.settings.has(*parameter));
        let mut quantities = Vec::new();
        for parameter in COMPARED.into_iter().filter(present) {
            stage(&format!("one {} or several", parameter.symbol()));
            quantities.push(self.quantity(labels.len(), parameter)?);
        }
        let warnings = self.warnings(&quantities);
        Ok(Comparison {
            labels: Vec::new(),
            told_by: String::new(),
            fidelity: options.fidelity.name(),
            method,
            computed: fidelity_choice::computed(search),
            samples: Vec::new(),
            quantities,
            chi2: 2.0 * minimum.cost,
            dof: search.dof(free, minimum.parameters()),
            noise_estimated: self.noise_estimated,
            converged: minimum.converged,
            residuals: self.residuals(),
            robust: self.robust(),
            findings: warnings,
        })
    }

    fn warnings(&self, quantities: &[Compared]) -> Vec<Finding> {
        let Settled { search, minimum, .. } = &self.informed.settled;
        let mut warnings = Vec::new();
        if !minimum.converged {
            warnings.push(Finding::NotConverged);
        }
        if self.covariance.is_none() {
            warnings.push(Finding::Undetermined);
        }
        let (chi2, dof) = self.goodness();
        if !self.noise_estimated && !search.is_robust() && dof > 0 {
            let p = ChiSquared::new(dof as f64).map_or(f64::NAN, |d| d.sf(chi2));
            if p < 1e-3 {
                warnings.push(warning(format!(
                    "The residuals are larger than the stated standard deviations explain (χ²/dof = {:.2}, \
                     probability {p:.1e}): what looks like a difference may be noise that is larger than stated.",
                    chi2 / dof as f64
                )));
            }
        }
        for compared in quantities {
            warnings.extend(at_bounds(compared));
        }
        warnings
    }

    /// How robust losses weighed the shots.
    fn robust(&self) -> Option<Robust> {
        let Settled { search, minimum, .. } = &self.informed.settled;
        if !search.is_robust() {
            return None;
        }
        let mut losses: Vec<&'static str> = Vec::new();
        let mut low: Vec<(usize, String, f64)> = Vec::new();
        let mut weights = minimum.weights.iter();
        for (place, sample) in self.informed.places.iter().zip(&search.samples) {
            let group = &self.groups[*place];
            if sample.loss != Loss::Squares && !losses.contains(&sample.loss.name()) {
                losses.push(sample.loss.name());
            }
            for (shot, weight) in sample.fitted.iter().zip(weights.by_ref()).filter(|(_, w)| **w < 1.0) {
                low.push((group.number, group.dataset.shots[shot.index].name.clone(), *weight));
            }
        }
        low.sort_by(|a, b| a.2.total_cmp(&b.2));
        Some(Robust { losses, weights: low })
    }

    fn residuals(&self) -> Vec<LabelResidual> {
        let (search, minimum) = self.tested();
        let estimated = &self.informed.settled.estimated;
        let mut all = Vec::new();
        for (i, place) in self.informed.places.iter().enumerate() {
            let group = &self.groups[*place];
            let name = |index: usize| &group.dataset.shots[index].name;
            let of = |of_shot| LabelResidual { label: group.label, sample: group.number, of_shot };
            all.extend(residual_rows((search, i), name, minimum, estimated).into_iter().map(of));
        }
        all
    }

    /// μ_k of the data sets as their frames tell it; `None` where velocities were fitted.
    pub(super) fn sliding(&self) -> Option<Known> {
        let Settled { search, free, .. } = &self.informed.settled;
        let covariance = self.covariance.as_ref().filter(|_| search.is_filmed())?;
        let (films, _) = shared_columns(&search.samples, free.len());
        let count = self.groups.iter().map(|group| group.dataset_number + 1).max().unwrap_or(0);
        let place = |dataset: usize| search.samples.iter().position(|sample| sample.dataset == dataset);
        let columns: Vec<Option<usize>> = (0..count).map(|i| films[place(i)?].first().copied()).collect();
        Some(Known {
            values: columns.iter().map(|column| column.map(|column| self.minimum().x[column])).collect(),
            covariance: DMatrix::from_fn(count, count, |i, j| match (columns[i], columns[j]) {
                (Some(i), Some(j)) => covariance[(i, j)],
                _ => 0.0,
            }),
        })
    }
}
