//! The minimum, and all that is known there, as a [`Fit`].

use super::camera::LEAST_SHOTS;
use super::diagnostics::{goodness, lag, refuted};
use super::estimates::Estimates;
use super::frames::{FittedFrames, are_explained, bound, cloth_of, joint_fit};
use super::intervals::bootstrap;
use super::minimum::Minimum;
use super::model_choice::ModelChoice;
use super::request::Request;
use super::robust::Robust;
use super::rows::{noise_rows, residual_rows};
use super::samples::Search;
use super::settled::Settled;
use super::{
    Alternative, Depth, Diagnostics, Fit, FrictionCurve, Plateau, Rejected, Starts, causes, check, doubts,
    fidelity_choice, warnings,
};
use crate::likelihood::frames::ROWS;
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
    /// What is said of residuals is said of the velocities that were extracted, also where frames were fitted.
    velocities: Search<'a>,
    /// The minimum of frames as it is for the velocities.
    of_velocities: Option<Minimum>,
    free: Vec<Parameter>,
}

impl<'a> Finished<'a> {
    pub(super) fn new(
        request: &'a Request<'a>,
        choice: &'a ModelChoice,
        settled: &'a Settled<'a>,
        estimates: Estimates,
    ) -> Self {
        let Settled { search, free: unknowns, minimum, .. } = settled;
        let free = unknowns.iter().map(|unknown| unknown.parameter).collect();
        let velocities = search.with(|_, sample| sample.fitted = &choice.fitted);
        let cloth = [(request.dataset.sliding, request.dataset.rolling)];
        let of_velocities = search.is_filmed().then(|| velocities.at(search, (unknowns, minimum), &cloth));
        let of_velocities = of_velocities.flatten();
        Self { request, choice, settled, estimates, velocities, of_velocities, free }
    }

    /// Where the fit ends for the velocities.
    fn seen(&self) -> &Minimum {
        self.of_velocities.as_ref().unwrap_or(&self.settled.minimum)
    }

    /// What priors, and errors that all shots share, add to χ².
    fn prior_chi2(&self, frames: Option<&FittedFrames>) -> f64 {
        let minimum = &self.settled.minimum;
        let measured = match frames {
            Some(_) => ROWS * self.choice.fitted.len(),
            None => self.velocities.observations(),
        };
        let kinks_from = minimum.residuals.len() - minimum.whitening[0].kink_rows();
        let of_all = minimum.residuals.rows_range(measured..kinks_from).norm_squared();
        of_all + frames.map_or(0.0, FittedFrames::prior_chi2)
    }

    /// How far the fit can be trusted; what its residuals and tracks let doubt is found afterwards.
    fn diagnostics(&self, starts: Option<Starts>, alternatives: Vec<Alternative>) -> Diagnostics {
        let Request { dataset, shots, films, options, done, .. } = *self.request;
        let Settled { search, free: unknowns, minimum, estimated, identifiability, .. } = self.settled;
        let sample = search.first();
        let at_minimum = minimum.first().model(sample.model);
        let sds: EstimatedSd = estimated.iter().map(|g| (g.observable, g.sd)).collect();
        let scatters = self.choice.scatter.is_some_and(|scatter| !scatter.is_none());
        let chi2 = (2.0 * minimum.cost, search.dof(unknowns, minimum.parameters()));
        let context = goodness::Context {
            shots,
            fitted: &self.choice.fitted,
            model: &at_minimum,
            minimum: self.seen(),
            free: &self.free,
            sds: &sds,
            dof: self.velocities.dof(unknowns, self.seen().parameters()),
            explained: Some(chi2).filter(|_| are_explained(search, minimum)),
            // the noise of films is estimated where it is not stated
            states_noise: self.choice.scatter.is_none()
                && (dataset.tracks.is_none()
                    || !films.is_empty()
                        && films.iter().all(|film| film.as_ref().is_some_and(|f| f.states_noise))),
            tests_noise: estimated.is_empty() && !scatters && !search.is_robust(),
        };
        let resampled = options.bootstrap > 0 && !unknowns.is_empty();
        let bootstrap =
            || bootstrap::bootstrap(search, (&context, unknowns), options.bootstrap, options.seed, done);
        Diagnostics {
            computed: fidelity_choice::computed(&self.velocities),
            identifiability: identifiability.clone(),
            goodness: Some(goodness::goodness(&context)),
            robust: search.is_robust().then(|| Robust::of(search, shots, minimum)),
            starts,
            bootstrap: resampled.then(bootstrap),
            contours: self.estimates.contours.clone(),
            profiles: self.estimates.profiles.clone(),
            alternatives,
            joint: search
                .is_filmed()
                .then(|| joint_fit(search, minimum, (chi2, &self.estimates.shared_intervals))),
            bound: bound(search, unknowns, minimum, films, cloth_of(minimum, dataset)),
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
        let residuals = residual_rows((&self.velocities, 0), name, self.seen(), estimated);
        let noise = noise_rows(fitted, &residuals, estimated);
        let frames = search.is_filmed().then(|| {
            let columns = (self.free.as_slice(), sample.unknowns.as_slice());
            FittedFrames::new(shots, sample.fitted, sample.model, minimum, columns)
        });
        let prior_chi2 = self.prior_chi2(frames.as_ref());
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
            method: self.request.method(),
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
            frames,
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
        let Request { dataset, shots, options, spins_first, .. } = *self.request;
        let search = &self.settled.search;
        let (of_discs, gives_way) = (fit.discs.is_some(), self.choice.gives_way);
        // footage is corrected anew for a contact that gives way, and looked at then
        let is_settled = gives_way.is_none() || !fit.footage || of_discs;
        // too few to show whether the camera looks askew, which other causes would stand in for
        let is_few = fit.footage && !of_discs && shots.len() < LEAST_SHOTS;
        // a tracker that lags leaves what no cause explains
        let lags = fit.frames.as_ref().is_some_and(lag::lags);
        let is_mixed_up = check::are_mixed_up(shots);
        let looks = is_settled && !lags && !is_few && !is_mixed_up && options.depth >= Depth::Everything;
        let is_called_for = causes::is_called_for(fit);
        fit.diagnostics.suspects_spins =
            spins_first && is_called_for && causes::are_spins_suspect(self.settled, of_discs);
        let looks = looks && !fit.diagnostics.suspects_spins;
        let is_asked = options.explain || (looks && is_called_for);
        let suspects = if looks && !is_asked { causes::suspects(self.settled, of_discs) } else { Vec::new() };
        if is_settled && !lags && (is_asked || !suspects.is_empty()) {
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
        if is_settled && options.explain && fit.explanations.is_empty() {
            fit.notes.push(causes::none_found(self.settled, search, of_discs));
        }
        warnings::add(fit, &self.choice.fitted, self.estimates.knows_noise);
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
        warnings::add_tracks(fit, dataset, shots, lags);
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
