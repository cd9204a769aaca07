//! What is left to correct in films of balls, by a joint fit of their frames.

use std::sync::Arc;

use super::adopted::{Calibrates, Left};
use super::contact_frames::spoiled;
use super::{CALLED_FOR, Search};
use crate::film::camera::Camera;
use crate::fit::camera::{FoundCamera, FoundCorrection};
use crate::fit::frames::filmed;
use crate::fit::minimum::Minimum;
use crate::fit::outlying::outlying;
use crate::fit::settled::Settled;
use crate::fit::{FilmUnknowns, FittedFrames, footage, model_choice, samples};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::frames::{Film, shared_unknowns};
use crate::likelihood::sample::Sample;
use crate::measurement::correction::Correction;
use crate::measurement::dataset::Shot;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::Parameter;
use crate::measurement::track::TrackShot;
use crate::measurement::values::Values;
use crate::physics::collision::Fidelity;
use crate::trajectory::scene::{LiftPrior, Scene};

impl Calibrates for Search<'_> {
    /// What a joint fit of the corrected films says is left.
    fn left(&mut self, free: &[Correction]) -> Option<Left> {
        let shots: Vec<TrackShot> = self.films.iter().map(|film| self.camera.shot(film)).collect();
        let scene = match self.scene {
            Some(scene) => scene,
            None => {
                let side_sd = self.dataset.side_sd;
                let gap_sd = self.gap_sd;
                let scene = Scene { side_sd, gap_sd, ..Scene::of(&self.dataset.model(Fidelity::Full)) };
                footage::learned(self.dataset, &shots, &scene).0
            }
        };
        let scene = Scene { viewpoint: self.camera.viewpoint(), ..scene };
        let (dataset, films) = footage::filmed_with(self.dataset, &shots, (scene, &self.camera));
        if 2 * dataset.shots.len() < self.films.len() {
            return None;
        }
        let mut film = FilmUnknowns::default();
        for which in free {
            film.corrections[*which as usize] = Some(which.neutral() - self.camera.get(*which));
        }
        let mut model = dataset.model_of_contact();
        if let LiftPrior::Model(of_lift, ..) = scene.lift {
            model.law = of_lift.law;
        }
        let settings = dataset.settings_of_balls();
        let initial = footage::near(&scene).unwrap_or_else(|| Values::usual(&settings));
        let all: Vec<&Shot> = dataset.shots.iter().collect();
        let (fitted, _) = model_choice::plan(&all, &model, &initial);
        let fitted = filmed(&fitted, &films)?;
        let known = (&model, &settings, initial);
        let sample = Sample {
            shared_errors: Vec::new(),
            unknowns: shared_unknowns::of_fit(film.unknowns()),
            loss: Loss::Squares,
            ..Sample::of(&dataset, &fitted, known)
        };
        let mut settled =
            Settled::from_starts(&samples::Search::of(sample.clone()), &[vec![initial]]).ok()?;
        // shots that fit no collision tell nothing of the camera
        let odd = outlying(&settled).remove(0);
        let others: Vec<_> = (0..fitted.len())
            .filter(|i| odd.iter().all(|odd| odd.place != *i))
            .map(|i| fitted[i].clone())
            .collect();
        if !odd.is_empty() {
            let start = settled.minimum.values.clone();
            settled =
                Settled::from_starts(&samples::Search::of(Sample { fitted: &others, ..sample }), &[start])
                    .ok()?;
        }
        let minimum = &settled.minimum;
        let parameters: Vec<_> = settled.free.iter().map(|unknown| unknown.parameter).collect();
        let of_frames = FittedFrames::new(
            &all,
            &others,
            &model,
            minimum,
            (&parameters, &settled.search.first().unknowns),
        );
        self.spoiled = spoiled(&of_frames);
        (self.used, self.odd, self.misfit) = (others.len(), odd.len(), settled.scale());
        self.unlikely = unlikely(&others, minimum);
        let covariance = minimum.covariance()?;
        // the noise may be stated too small, or what the camera does not explain be large
        let scale = settled.scale();
        let first = minimum.x.len() - free.len();
        let values = minimum.x.rows(first, free.len()).into_owned();
        let covariance = covariance.view((first, first), (free.len(), free.len())) * scale;
        // the lift of the next round is that of these coefficients
        let values_there = minimum.first();
        if let (LiftPrior::Model(model, _, sd), true) = (scene.lift, values_there[Parameter::Mu] > 0.0) {
            let lift = LiftPrior::Model(values_there.model(&model), values_there.coefficients(), sd);
            self.scene = Some(Scene { lift, ..scene });
        }
        (values.iter().chain(covariance.iter()).all(|v| v.is_finite())).then_some(Left { values, covariance })
    }

    fn camera(&mut self) -> &mut Camera {
        &mut self.camera
    }

    /// A scale that the balls gave is always needed.
    fn needs(&self, which: Correction) -> bool {
        which == Correction::Scale && (self.from_balls || self.unit != 1.0)
    }

    fn called_for(&self) -> f64 {
        CALLED_FOR
    }

    /// The frames follow corrections that are so small as lines, whichever are left out.
    fn shows_within(&self) -> f64 {
        3.0
    }

    fn as_found(&self, mut corrections: Vec<FoundCorrection>, converged: bool) -> FoundCamera {
        for found in &mut corrections {
            if found.which == Correction::Scale {
                // film over table: of lengths in the film's own unit
                found.value /= self.unit;
                found.std_error /= self.unit;
            }
        }
        let (camera, unit, shots) = (self.camera, self.unit, self.contacts.len());
        let contacts = self.contacts.iter().map(|[a, b]| [0, 1].map(|i| 0.5 * (a[i] + b[i]))).collect();
        let spoiled = self.spoiled;
        FoundCamera {
            camera,
            corrections,
            unit,
            shots,
            contacts,
            converged,
            spoiled,
            ..FoundCamera::as_it_is()
        }
    }
}

impl Search<'_> {
    pub(super) fn found(&mut self) -> Option<FoundCamera> {
        let all = self.free.clone();
        if all.is_empty() {
            let needs = self.unit != 1.0 || !self.camera.is_neutral();
            return needs.then(|| self.as_found(Vec::new(), true));
        }
        let found = self.adopted(&all);
        // a film without a unit still has that of its balls
        found.or_else(|| (self.unit != 1.0).then(|| self.as_found(Vec::new(), false)))
    }
}

/// −2 log L of a coordinate of the frames, up to a constant: noise that is estimated is the lower the better the paths fit.
fn unlikely(fitted: &[Fitted], minimum: &Minimum) -> f64 {
    let films = || fitted.iter().filter_map(|shot| shot.film.as_ref());
    let count: usize = films().map(|film| film.observations()).sum();
    let of_noise = |film: &Arc<Film>| match film.position_sd {
        sd if sd > 0.0 => 2.0 * sd.ln() * film.observations() as f64,
        _ => 0.0,
    };
    (films().map(of_noise).sum::<f64>() + minimum.chi2()) / count.max(1) as f64
}
