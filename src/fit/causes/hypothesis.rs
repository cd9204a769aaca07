//! A fit with some assumptions given up.

use std::cell::Cell;
use std::sync::Arc;

use super::NAMED;
use super::cause::{Cause, Explanation};
use super::profile::{Profile, least};
use crate::fit::Falling;
use crate::fit::diagnostics::goodness::IMPROBABLE;
use crate::fit::samples::Search;
use crate::fit::settled::Settled;
use crate::likelihood::fitted::Fitted;
use crate::likelihood::sample::Sample;
use crate::measurement::number::with_error;
use crate::measurement::parameter::{Parameter, Settings};
use crate::measurement::values::Values;
use crate::physics::cloth_motion::GRAVITY;
use crate::physics::collision::Model;
use crate::physics::friction_law::Law;
use crate::trajectory::shot_scene::Departure;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// What is assumed in the place of what is stated.
#[derive(Clone, Debug, Default)]
pub(super) struct Departures(Vec<(Cause, f64)>);

impl Departures {
    pub(super) fn contains(&self, cause: Cause) -> bool {
        self.0.iter().any(|(known, _)| *known == cause)
    }

    pub(super) fn with(&self, cause: Cause, value: f64) -> Self {
        let others = self.0.iter().copied().filter(|(known, _)| *known != cause);
        Self(others.chain([(cause, value)]).collect())
    }

    pub(super) fn without(&self, cause: Cause) -> Self {
        Self(self.0.iter().copied().filter(|(known, _)| *known != cause).collect())
    }

    fn get(&self, cause: Cause) -> f64 {
        self.0.iter().find(|(known, _)| *known == cause).map_or(cause.neutral(), |(_, value)| *value)
    }
}

/// Shots and model as they would be under other assumptions.
pub(super) struct Altered {
    shots: Vec<Fitted>,
    model: Model,
    settings: Settings,
    initial: Values,
}

impl Altered {
    /// The same sample with these.
    pub(super) fn of<'a>(&'a self, sample: &Sample<'a>) -> Sample<'a> {
        let Self { shots, model, settings, initial } = self;
        Sample { fitted: shots, model, settings, initial: *initial, ..sample.clone() }
    }
}

/// A fit that is tried under other assumptions.
pub(super) struct Trial<'a> {
    pub sample: &'a Sample<'a>,
    pub start: Values,
    pub discs: bool,
}

/// What came of it.
pub(super) struct Tried {
    pub minus_two_log: f64,
    pub values: Values,
    /// Estimates and their standard errors, with the scatter that is left.
    pub parameters: Vec<(Parameter, f64, f64)>,
    /// How many velocities there are, less the parameters.
    pub velocities: usize,
    /// χ²/dof where that is above 1.
    pub scale: f64,
    /// χ² and degrees of freedom of what was fitted.
    pub fitted: (f64, usize),
    /// Whether the noise of all that was fitted is stated.
    pub states_noise: bool,
}

impl Tried {
    /// χ²/dof of what was fitted. Where each shot tells the noise of its frames by itself, what they leave beyond that noise counts
    /// over as many velocities as are extracted from them.
    pub(super) fn reduced(&self) -> f64 {
        let (chi2, dof) = self.fitted;
        if self.states_noise {
            chi2 / dof.max(1) as f64
        } else {
            1.0 + (chi2 - dof as f64) / self.velocities.max(1) as f64
        }
    }

    /// By how much χ² is beyond what the noise explains.
    pub(super) fn excess(&self) -> f64 {
        let (chi2, dof) = self.fitted;
        (chi2 - dof as f64).max(0.0)
    }

    /// Whether what is left is improbable.
    pub(super) fn is_unexplained(&self) -> bool {
        let dof = self.dof().max(1) as f64;
        ChiSquared::new(dof).is_ok_and(|distribution| distribution.sf(self.reduced() * dof) < IMPROBABLE)
    }

    /// What χ²/dof has its distribution by.
    fn dof(&self) -> usize {
        if self.states_noise { self.fitted.1 } else { self.velocities }
    }
}

impl Trial<'_> {
    /// Whether the shots can tell this cause.
    pub(super) fn knows(&self, cause: Cause) -> bool {
        let Sample { fitted, model, settings, .. } = self.sample;
        let filmed = self.sample.is_filmed();
        match cause {
            Cause::FrameRate | Cause::TiltX | Cause::TiltY => filmed,
            Cause::SideSpin => {
                filmed
                    && fitted.iter().all(|shot| shot.film.as_ref().is_some_and(|film| !film.has_side_spin()))
                    && fitted.iter().all(|shot| shot.plan.states_spin())
            }
            Cause::CueSpin => fitted.iter().all(|shot| {
                shot.plan.states_spin() && shot.film.as_ref().is_none_or(|film| film.states_spin())
            }),
            Cause::FallingFriction => {
                let mu = &settings[Parameter::Mu];
                model.law == Law::Constant && !mu.fixed && fitted.iter().all(|shot| shot.plan.knows_speed())
            }
            // of discs, masses are stated or follow from the momentum
            Cause::MassRatio => !settings.parameters().contains(&Parameter::MassRatio) && !self.discs,
            // integrated, which fits of velocities with errors of their inputs repeat too often
            Cause::Compliance => {
                let is_free = model.kappa > 0.0 && !settings[Parameter::Kappa].fixed;
                filmed && !is_free && !settings[Parameter::Mu].fixed
            }
            Cause::Film(_) | Cause::Radius => false,
        }
    }

    /// What is assumed of a cause as the data set stands.
    pub(super) fn assumed(&self, cause: Cause) -> f64 {
        match cause {
            Cause::MassRatio => self.sample.model.mass_ratio(),
            Cause::Compliance => self.sample.model.kappa,
            _ => cause.neutral(),
        }
    }

    /// The fit with these assumptions; `None` where there is none.
    pub(super) fn fit(&self, departures: &Departures) -> Option<Tried> {
        self.fit_from(departures, self.start)
    }

    /// The fit with a cause where −2 log L is least along it: the errors of the parameters include that of the cause, by how far they
    /// follow it.
    pub(super) fn fit_with_errors(
        &self,
        held: &Departures,
        (cause, profile): (Cause, &Profile),
    ) -> Option<Tried> {
        let mut there = self.fit(&held.with(cause, profile.at))?;
        let error = profile.error * there.scale.sqrt();
        let [low, high] = cause.range();
        let beside =
            if profile.at + error <= high { profile.at + error } else { (profile.at - error).max(low) };
        if let Some(beside) = self.fit_from(&held.with(cause, beside), there.values) {
            for (parameter, value, error) in &mut there.parameters {
                *error = error.hypot(beside.values[*parameter] - *value);
            }
        }
        Some(there)
    }

    /// The shots and the model under other assumptions, and where a search begins.
    pub(super) fn altered(&self, departures: &Departures, start: Values) -> Altered {
        let rate = departures.get(Cause::FrameRate);
        let topspin = departures.get(Cause::CueSpin);
        let side_sd = departures.get(Cause::SideSpin);
        let departure = Departure {
            gravity: rate.powi(-2),
            topspin,
            // the acceleration leads downwards
            tilt: [Cause::TiltX, Cause::TiltY].map(|cause| GRAVITY * departures.get(cause)),
        };
        let compliant = departures.contains(Cause::Compliance);
        let plan = |shot: &Fitted| {
            let plan = shot.plan.clone().with_topspin(topspin);
            if compliant { plan.plain() } else { plan }
        };
        let shots: Vec<Fitted> = self
            .sample
            .fitted
            .iter()
            .map(|shot| Fitted {
                index: shot.index,
                plan: plan(shot),
                film: shot.film.as_ref().map(|film| Arc::new(film.departing(departure, side_sd))),
            })
            .collect();
        let (mut model, mut settings, mut initial) = (*self.sample.model, *self.sample.settings, start);
        if departures.contains(Cause::MassRatio) {
            model = model.with_mass_ratio(departures.get(Cause::MassRatio));
            initial[Parameter::MassRatio] = model.mass_ratio();
        }
        if compliant {
            model = model.giving_way(departures.get(Cause::Compliance));
            initial[Parameter::Kappa] = model.kappa;
        }
        if departures.contains(Cause::FallingFriction) {
            let (b, c) = (departures.get(Cause::FallingFriction), Parameter::C.default_setting().initial);
            settings = Falling::Held { b, c }.applied(settings);
            initial = initial.with(Parameter::B, b).with(Parameter::C, c);
            model.law = Law::Exponential { b, c };
        }
        Altered { shots, model, settings, initial }
    }

    fn fit_from(&self, departures: &Departures, start: Values) -> Option<Tried> {
        let altered = self.altered(departures, start);
        let Altered { shots, initial, .. } = &altered;
        let settled =
            Settled::from_starts(&Search::of(altered.of(self.sample)).likeliest(), &[vec![*initial]]).ok()?;
        let Settled { search, minimum, .. } = &settled;
        // ln det C of velocities has it already
        let volume = if search.is_filmed() && search.shots().any(Fitted::has_side_spin) {
            search.problem(&settled.free, &minimum.whitening).log_volume(&minimum.x, &[Vec::new()])
        } else {
            0.0
        };
        let minus_two_log =
            settled.search.minus_two_log_likelihood(&settled.minimum, &settled.estimated) + volume;
        let values = settled.minimum.first();
        let parameters = settled.free.iter();
        let parameters =
            parameters.map(|u| (u.parameter, values[u.parameter], settled.error_of(*u))).collect();
        let scale = settled.scale();
        let rows: usize = shots.iter().map(|shot| shot.plan.rows().len()).sum();
        let velocities = rows.saturating_sub(settled.free.len());
        let dof = settled.search.observations().saturating_sub(settled.minimum.parameters());
        let fitted = (2.0 * settled.minimum.cost, dof);
        let states_noise = shots.iter().all(|shot| shot.film.as_ref().is_none_or(|film| film.states_noise));
        minus_two_log.is_finite().then_some(Tried {
            values: *values,
            states_noise,
            minus_two_log,
            parameters,
            velocities,
            scale,
            fitted,
        })
    }

    /// Where −2 log L is least along a cause, with these assumptions given up, too; `None` where that is nowhere within its range.
    /// Each fit begins where the best so far ended.
    pub(super) fn along(&self, cause: Cause, held: &Departures) -> Option<Profile> {
        let [low, high] = cause.range();
        let best = Cell::new((f64::INFINITY, self.start));
        let of = |value: f64| {
            let departures = (low..=high).contains(&value).then(|| held.with(cause, value))?;
            let fit = self.fit_from(&departures, best.get().1)?;
            if fit.minus_two_log < best.get().0 {
                best.set((fit.minus_two_log, fit.values));
            }
            Some(fit.minus_two_log)
        };
        let unit = self.assumed(cause);
        let starts: Vec<(f64, f64)> = match cause {
            // masses that differ from those stated by a few percent
            Cause::MassRatio => {
                cause.starts().iter().map(|(start, step)| (start * unit, step * unit)).collect()
            }
            Cause::Compliance if unit > 0.0 => vec![(unit, 0.25 * unit)],
            // stun that is stated to roll, or the other way round
            Cause::CueSpin => {
                let here = of(0.0).unwrap_or(f64::INFINITY);
                let far =
                    [1.0, -1.0].into_iter().filter(|other| of(*other).is_some_and(|there| there < here));
                cause.starts().iter().copied().chain(far.map(|other| (other, 0.1))).collect()
            }
            _ => cause.starts().to_vec(),
        };
        let found = starts.into_iter().filter_map(|(start, step)| least(of, start, step));
        found.min_by(|a, b| a.lowest.total_cmp(&b.lowest)).filter(|found| (low..=high).contains(&found.at))
    }

    /// Whether a cause whose fits are slow is worth looking along: −2 log L is lower at its usual value, and of side spins, which
    /// explain the more the further they spread, the largest leave nothing to explain.
    pub(super) fn is_worth_it(&self, cause: Cause, held: &Departures, before: &Tried) -> bool {
        let at = |value: f64| self.fit(&held.with(cause, value));
        match cause {
            Cause::Compliance => {
                let lower = |kappa: f64| {
                    at(kappa).is_some_and(|there| before.minus_two_log - there.minus_two_log > NAMED)
                };
                match self.assumed(cause) {
                    0.0 => lower(Model::KAPPA),
                    kappa => lower(0.75 * kappa) || lower(1.25 * kappa),
                }
            }
            Cause::SideSpin => at(cause.range()[1]).is_some_and(|largest| !largest.is_unexplained()),
            _ => true,
        }
    }

    /// Side spin of its own lets every shot go its own way, so that it takes up part of whatever is wrong: it is believed only where
    /// it leaves nothing to explain.
    pub(super) fn is_believable(&self, cause: Cause, profile: &Profile, held: &Departures) -> bool {
        let Cause::SideSpin = cause else { return true };
        self.fit(&held.with(cause, profile.at)).is_some_and(|with_it| !with_it.is_unexplained())
    }

    /// `reduced`: χ²/dof before, as the fit has it or as [`Tried::reduced`].
    pub(super) fn explanation(
        &self,
        cause: Cause,
        profile: &Profile,
        (before, reduced): (&Tried, f64),
        after: &Tried,
    ) -> Explanation {
        let (estimate, std_error) = (profile.at, profile.error * after.scale.sqrt());
        let (explains, reduced) = (!after.is_unexplained(), [reduced, after.reduced()]);
        let values: Vec<String> = after
            .parameters
            .iter()
            .map(|(p, value, error)| format!("{} = {}", p.symbol(), with_error(*value, *error)))
            .collect();
        let delta_2logl = profile.lowest - before.minus_two_log;
        let sentence = Explanation::sentence(
            (cause, self.assumed(cause)),
            (estimate, std_error),
            (reduced, delta_2logl),
            (explains, values.join(", ")),
        );
        Explanation {
            cause,
            estimate,
            std_error,
            delta_2logl,
            adopted: false,
            with_it: after.parameters.clone(),
            reduced_chi2: Some(reduced),
            sentence,
        }
    }
}
