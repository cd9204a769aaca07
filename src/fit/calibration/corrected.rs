//! Corrects films for their camera until nothing is left to correct, and leaves out what the frames do not call for.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::{CALLED_FOR, Search};
use crate::fit::camera::{FoundCamera, FoundCorrection};
use crate::fit::frames::filmed;
use crate::fit::minimum::Minimum;
use crate::fit::outlying::outlying;
use crate::fit::settled::Settled;
use crate::fit::{FilmUnknowns, footage, model_choice, samples};
use crate::likelihood::fitted::Fitted;
use crate::likelihood::frames::{Film, shared_unknowns};
use crate::likelihood::sample::Sample;
use crate::measurement::correction::Correction;
use crate::measurement::dataset::Shot;
use crate::measurement::loss::Loss;
use crate::measurement::track::TrackShot;
use crate::measurement::values::Values;
use crate::physics::collision::Fidelity;
use crate::trajectory::scene::{LiftPrior, Scene};

/// Rounds of fitting and correcting. Nothing is left to correct within this part of a standard error, or of what is usual of a
/// correction: its square is then far below a standard error.
const ROUNDS: usize = 8;
const AT_REST: f64 = 0.2;
const SMALL: f64 = 0.02;

/// A value that is further from that of a perfect camera than so many times what is usual is of no camera.
const FAR: f64 = 10.0;

/// What a joint fit says is left to correct, in the order of the free corrections.
struct Left {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Search<'_> {
    /// What the frames of the films as the camera corrects them say is left.
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
        let initial = footage::near(&scene).unwrap_or_else(|| Values::usual(&dataset.settings));
        let all: Vec<&Shot> = dataset.shots.iter().collect();
        let (fitted, _) = model_choice::plan(&all, &model, &initial);
        let fitted = filmed(&fitted, &films)?;
        let known = (&model, &dataset.settings, initial);
        let sample = Sample {
            shared_errors: Vec::new(),
            unknowns: shared_unknowns::of_fit(film.unknowns()),
            loss: Loss::Squares,
            ..Sample::of(&dataset, &fitted, known)
        };
        let mut settled =
            Settled::from_starts(&samples::Search::of(sample.clone()), &[vec![initial]]).ok()?;
        // shots that fit no collision tell nothing of the camera
        let odd = outlying(&fitted, settled.minimum.residuals.as_slice());
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
        (self.used, self.misfit) = (fitted.len() - odd.len(), settled.scale());
        self.unlikely = unlikely(&others, minimum);
        let covariance = minimum.covariance()?;
        // the noise may be stated too small, or what the camera does not explain be large
        let scale = settled.scale();
        let first = minimum.x.len() - free.len();
        let values = minimum.x.rows(first, free.len()).into_owned();
        let covariance = covariance.view((first, first), (free.len(), free.len())) * scale;
        // the lift of the next round is that of these coefficients
        let values_there = minimum.first();
        if let (LiftPrior::Model(model, _, sd), true) = (scene.lift, values_there.coefficients.mu > 0.0) {
            let lift = LiftPrior::Model(values_there.model(&model), values_there.coefficients, sd);
            self.scene = Some(Scene { lift, ..scene });
        }
        (values.iter().chain(covariance.iter()).all(|v| v.is_finite())).then_some(Left { values, covariance })
    }

    /// Corrects until nothing is left; the last covariance, and whether nothing is. None if this leads to what no camera does.
    fn converge(&mut self, free: &[Correction]) -> Option<(DMatrix<f64>, bool)> {
        let mut last = None;
        for _ in 0..ROUNDS {
            let Some(Left { values, covariance }) = self.left(free) else { break };
            for (which, by) in free.iter().zip(values.iter()) {
                self.camera = self.camera.with(*which, self.camera.get(*which) + by);
            }
            if free
                .iter()
                .any(|which| (self.camera.get(*which) - which.neutral()).abs() > FAR * which.usual())
            {
                return None;
            }
            let rests = (0..free.len()).all(|i| {
                values[i].abs() < (AT_REST * covariance[(i, i)].sqrt()).max(SMALL * free[i].usual())
            });
            last = Some((covariance, rests));
            if rests {
                break;
            }
        }
        last
    }

    pub(super) fn found(&mut self) -> Option<FoundCamera> {
        let all = self.free.clone();
        if all.is_empty() {
            let needs = self.unit != 1.0 || !self.camera.is_neutral();
            return needs.then(|| self.as_found(Vec::new(), true));
        }
        let Some((covariance, mut converged)) = self.converge(&all) else {
            // a film without a unit still has that of its balls
            return (self.unit != 1.0).then(|| self.as_found(Vec::new(), false));
        };
        let mut corrections: Vec<FoundCorrection> = all
            .iter()
            .enumerate()
            .map(|(i, which)| FoundCorrection {
                which: *which,
                value: self.camera.get(*which),
                std_error: covariance[(i, i)].sqrt(),
                adopted: false,
            })
            .collect();
        let mut adopted = self.called_for(&all, covariance);
        // what the frames call for may not be called for where others were left out
        loop {
            for found in &mut corrections {
                found.adopted = adopted.contains(&found.which);
                if !found.adopted {
                    self.camera = self.camera.with(found.which, found.which.neutral());
                }
            }
            if adopted.is_empty() {
                break;
            }
            let Some((covariance, rests)) = self.converge(&adopted) else {
                return Some(self.as_found(corrections, false));
            };
            converged = rests;
            for (i, which) in adopted.iter().enumerate() {
                if let Some(found) = corrections.iter_mut().find(|found| found.which == *which) {
                    (found.value, found.std_error) = (self.camera.get(*which), covariance[(i, i)].sqrt());
                }
            }
            let still = self.called_for(&adopted, covariance);
            if still.len() == adopted.len() {
                break;
            }
            adopted = still;
        }
        Some(self.as_found(corrections, converged))
    }

    /// The corrections without which −2 log L would be higher by as much as calls for them, one after the other left out; the camera
    /// goes where the others are then best.
    fn called_for(&mut self, all: &[Correction], mut covariance: DMatrix<f64>) -> Vec<Correction> {
        let mut kept: Vec<Correction> = all.to_vec();
        loop {
            let off = |which: &Correction| self.camera.get(*which) - which.neutral();
            // −2 log L rises by z² where a correction is left out
            let z2 = |i: usize, which: &Correction| off(which).powi(2) / covariance[(i, i)];
            // a scale that the balls gave is always needed
            let gave = self.from_balls || self.unit != 1.0;
            let needed = |which: &Correction| gave && *which == Correction::Scale;
            let least = kept.iter().enumerate().filter(|(_, which)| !needed(which));
            let least = least.map(|(i, which)| (i, z2(i, which))).min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((out, _)) = least.filter(|(_, z2)| *z2 < CALLED_FOR) else { return kept };
            let by = off(&kept[out]) / covariance[(out, out)];
            for (i, which) in kept.iter().enumerate() {
                self.camera = self.camera.with(*which, self.camera.get(*which) - covariance[(i, out)] * by);
            }
            let column = covariance.column(out).into_owned();
            let rest = &covariance - &column * column.transpose() / column[out];
            covariance = rest.remove_row(out).remove_column(out);
            kept.remove(out);
        }
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
