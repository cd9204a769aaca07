//! The minimum, and all that is known there, as a [`Fit`].

use super::diagnostics::{goodness, refuted};
use super::estimates::Estimates;
use super::intervals::bootstrap;
use super::model_choice::ModelChoice;
use super::request::Request;
use super::robust::Robust;
use super::rows::{noise_rows, residual_rows};
use super::settled::Settled;
use super::{
    Alternative, Depth, Diagnostics, Fit, FrictionCurve, Method, Plateau, Rejected, Starts, causes, check,
    doubts, fidelity_choice, warnings,
};
use crate::likelihood::whitening::EstimatedSd;
use crate::measurement::dataset::{DiscShot, Shot};
use crate::measurement::parameter::Parameter;
use crate::physics::collision::Effects;

/// A fit that has found its minimum.
pub(super) struct Finished<'a> {
    request: &'a Request<'a>,
    choice: &'a ModelChoice,
    settled: &'a Settled<'a>,
    estimates: Estimates,
    free: Vec<Parameter>,
}

impl<'a> Finished<'a> {
    pub(super) fn new(
        request: &'a Request<'a>,
        choice: &'a ModelChoice,
        settled: &'a Settled<'a>,
        estimates: Estimates,
    ) -> Self {
        let free = settled.free.iter().map(|unknown| unknown.parameter).collect();
        Self { request, choice, settled, estimates, free }
    }

    /// What priors, and errors that all shots share, add to χ².
    fn prior_chi2(&self) -> f64 {
        let minimum = &self.settled.minimum;
        let measured = self.settled.search.observations();
        let kinks_from = minimum.residuals.len() - minimum.whitening[0].kink_rows();
        minimum.residuals.rows_range(measured..kinks_from).norm_squared()
    }

    /// How far the fit can be trusted; what its residuals and tracks let doubt is found afterwards.
    fn diagnostics(&self, starts: Option<Starts>, alternatives: Vec<Alternative>) -> Diagnostics {
        let Request { dataset, shots, options, done, .. } = *self.request;
        let Settled { search, free: unknowns, minimum, estimated, identifiability, .. } = self.settled;
        let sample = search.first();
        let at_minimum = minimum.first().model(sample.model);
        let sds: EstimatedSd = estimated.iter().map(|g| (g.observable, g.sd)).collect();
        let scatters = self.choice.scatter.is_some_and(|scatter| !scatter.is_none());
        let context = goodness::Context {
            shots,
            fitted: &self.choice.fitted,
            model: &at_minimum,
            minimum,
            free: &self.free,
            sds: &sds,
            dof: search.dof(unknowns, minimum.parameters()),
            states_noise: self.choice.scatter.is_none() && dataset.tracks.is_none(),
            tests_noise: estimated.is_empty() && !scatters && !search.is_robust(),
        };
        let resampled = options.bootstrap > 0 && !unknowns.is_empty();
        let bootstrap =
            || bootstrap::bootstrap(search, (&context, unknowns), options.bootstrap, options.seed, done);
        Diagnostics {
            computed: fidelity_choice::computed(search),
            identifiability: identifiability.clone(),
            goodness: Some(goodness::goodness(&context)),
            robust: search.is_robust().then(|| Robust::of(search, shots, minimum)),
            starts,
            bootstrap: resampled.then(bootstrap),
            contours: self.estimates.contours.clone(),
            profiles: self.estimates.profiles.clone(),
            alternatives,
            ..Diagnostics::default()
        }
    }

    /// The fit, without what is to be said of it.
    pub(super) fn fit(
        &self,
        shots_rejected: Vec<Rejected>,
        starts: Option<Starts>,
        alternatives: Vec<Alternative>,
    ) -> Fit {
        let Request { dataset, shots, options, group, .. } = *self.request;
        let Settled { search, free: unknowns, minimum, estimated, .. } = self.settled;
        let (sample, fitted) = (search.first(), &self.choice.fitted);
        let name = |index: usize| &shots[index].name;
        let residuals = residual_rows((search, 0), name, minimum, estimated);
        let noise = noise_rows(fitted, &residuals, estimated);
        let prior_chi2 = self.prior_chi2();
        let diagnostics = self.diagnostics(starts, alternatives);
        // an effect is in the fit if it is in a shot
        let mut effects = Effects::NONE.list().to_vec();
        for of_shots in &diagnostics.computed {
            for ((_, all), (_, on)) in effects.iter_mut().zip(of_shots.effects.list()) {
                *all |= on;
            }
        }
        let mut fit = Fit {
            dataset: dataset.name.clone(),
            group: group.cloned(),
            path: dataset.path.clone(),
            cloth: dataset.cloth.clone(),
            source: dataset.source.clone(),
            ball: dataset.ball,
            object: dataset.object,
            discs: dataset.tracks.as_ref().and_then(|tracks| tracks.discs),
            sliding: dataset.sliding,
            rolling: dataset.rolling,
            fidelity: options.fidelity.name(),
            method: Method::TwoStage,
            footage: dataset.tracks.is_some(),
            effects,
            estimates: self.estimates.all.clone(),
            correlation: self.estimates.correlation.clone(),
            chi2: 2.0 * minimum.cost,
            prior_chi2,
            dof: search.dof(unknowns, minimum.parameters()),
            noise,
            shots_used: fitted.len(),
            shots_rejected,
            shots_doubtful: self.doubtful(),
            disc_shots: self.disc_shots(),
            scatter: self.choice.scatter,
            friction_curve: None,
            camera: None,
            explanations: Vec::new(),
            refuted: None,
            residuals,
            frames: None,
            findings: Vec::new(),
            stated_scale_sd: 0.0,
            unknowns: Vec::new(),
            budget: Vec::new(),
            termination: minimum.termination.clone(),
            converged: minimum.converged,
            iterations: minimum.iterations,
            seconds: 0.0,
            diagnostics,
            warnings: Vec::new(),
            notes: Vec::new(),
        };
        fit.friction_curve = FrictionCurve::of_fit(&fit, sample.model, minimum.first());
        let used: Vec<&Shot> = fitted.iter().map(|shot| shots[shot.index]).collect();
        refuted::judge(&mut fit, &used);
        fit
    }

    /// What is to be said of the fit: causes of its residuals, warnings and notes.
    pub(super) fn comment(&self, fit: &mut Fit, depth: Depth) {
        let Request { dataset, shots, options, .. } = *self.request;
        let search = &self.settled.search;
        let (of_discs, gives_way) = (fit.discs.is_some(), self.choice.gives_way);
        let looks = !check::are_mixed_up(shots) && options.depth >= Depth::Everything;
        let is_called_for = causes::is_called_for(fit);
        let is_asked = options.explain || (looks && is_called_for);
        let suspects = if looks && !is_asked { causes::suspects(self.settled, of_discs) } else { Vec::new() };
        if is_asked || !suspects.is_empty() {
            let reduced = fit.diagnostics.goodness.as_ref().filter(|goodness| goodness.dof > 0);
            let reduced = reduced.map(|goodness| goodness.chi2 / goodness.dof as f64);
            let first = (!is_asked).then_some(suspects.as_slice());
            fit.explanations = causes::explain(self.settled, search, (of_discs, reduced), first);
        }
        fit.explanations.extend(fit.conflict_of_masses());
        fit.explanations.sort_by(|a, b| a.delta_2logl.total_cmp(&b.delta_2logl));
        if looks && !is_called_for && fit.explanations.is_empty() {
            causes::compare_rate(fit, self.settled, of_discs);
        }
        if options.explain && fit.explanations.is_empty() {
            fit.notes.push(causes::none_found(self.settled, search, of_discs));
        }
        let plans = || self.choice.fitted.iter().map(|shot| &shot.plan);
        let topspin = plans().any(|plan| plan.has_topspin());
        warnings::add(fit, topspin, self.estimates.knows_noise);
        if plans().any(|plan| !plan.knows_speed()) {
            fit.notes.push(
                "Some shots have no speed. Only angles and ratios were asked of them, which do not depend on it."
                    .to_string(),
            );
        }
        if fit.refuted.is_none() {
            warnings::add_lower(fit, 2.0 * self.estimates.lowest);
        }
        fit.notes.extend(self.choice.notes.iter().cloned());
        let plateaus: Vec<Plateau> = self.settled.plateaus.iter().map(|(_, plateau)| *plateau).collect();
        warnings::add_plateaus(fit, &plateaus);
        if fit.refuted.is_none() {
            doubts::add_rivals(fit, &self.estimates.rivals);
        }
        doubts::add_below_bound(fit);
        warnings::add_tracks(fit, dataset, shots);
        if depth < options.depth {
            let profiles = match depth {
                Depth::Estimates => "the intervals are those of the curvature of χ²; its profiles, ",
                _ => "",
            };
            fit.notes.push(format!(
                "With so many shots {profiles}the regions of pairs of parameters and other models are left out."
            ));
        }
        let sentences = fit.explanations.iter().map(|explanation| explanation.sentence.clone());
        fit.warnings.splice(0..0, sentences.collect::<Vec<_>>());
        if let Some(lower) = gives_way {
            fit.adopt_compliance(lower);
        }
    }

    /// The shots that are used though something about them is wrong.
    fn doubtful(&self) -> Vec<Rejected> {
        let Request { dataset, shots, .. } = *self.request;
        let named = |name: &str| self.choice.fitted.iter().any(|shot| shots[shot.index].name == name);
        let all = dataset.tracks.iter().flat_map(|tracks| &tracks.doubtful).filter(|(name, _)| named(name));
        all.map(|(shot, reason)| Rejected { shot: shot.clone(), reason: reason.clone() }).collect()
    }

    /// What was measured of the discs of every shot, or of those of a label.
    fn disc_shots(&self) -> Vec<DiscShot> {
        let Request { dataset, shots, group, .. } = *self.request;
        let own = |shot: &&DiscShot| group.is_none() || shots.iter().any(|known| known.name == shot.name);
        dataset.tracks.iter().flat_map(|tracks| &tracks.disc_shots).filter(own).cloned().collect()
    }
}
