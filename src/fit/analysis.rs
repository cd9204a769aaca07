//! Everything from a data set as it was loaded to its fits, as `caromfit fit` does it.

use super::calibration::calibrated;
use super::footage::{films, finds_spins_from_paths, near, with_impacts};
use super::{FilmUnknowns, Fit, FitError, FoundCamera, Method, Options, fit_watched};
use crate::extraction::Impact;
use crate::measurement::dataset::Dataset;
use crate::measurement::loss::Loss;
use crate::measurement::parameter::{Compliance, Parameter, Setting};
use crate::measurement::track::TrackShot;
use crate::trajectory::scene::Scene;

/// Frames of more shots than this take minutes to fit jointly.
const MOST_JOINT: usize = 20_000;

/// So many shots tell how much the frames could tell at best.
const BOUND_FROM: usize = 1000;

/// A data set and what was found of it.
pub struct Analysis {
    /// With its impacts; footage as it was corrected.
    pub dataset: Dataset,
    /// The shots of footage whose impacts were found.
    pub extracted: Vec<(TrackShot, Impact)>,
    pub scene: Scene,
    /// What the shots tell of their camera; `None` where there is none.
    pub camera: Option<FoundCamera>,
    /// One, or one for each label that is fitted apart.
    pub fits: Result<Vec<Fit>, FitError>,
}

/// Corrects footage for its camera, finds its impacts and fits. `method` `None`: all frames at once where that can be done.
/// `done` is called after every shot that is extracted and every replicate of a bootstrap, from several threads.
#[must_use]
pub fn analyse(
    mut dataset: Dataset,
    options: &Options,
    method: Option<Method>,
    done: &(dyn Fn() + Sync),
) -> Analysis {
    dataset.settings = options.falling.applied(dataset.settings);
    // discs need no correction of a film, and their κ is fitted
    if dataset.tracks.as_ref().is_none_or(|tracks| tracks.discs.is_some()) {
        return analyse_once(dataset, options, method, done);
    }
    let first = analyse_once(dataset.clone(), options, method, done);
    let Some(lower) = gives_way(&first) else { return first };
    // the film is to be corrected, and the impacts extracted, with the contact that gives way, too
    dataset.settings.compliance = Compliance::Stated;
    let kappa = &mut dataset.settings[Parameter::Kappa];
    *kappa = Setting::held(kappa.initial);
    let mut again = analyse_once(dataset, options, method, done);
    for fit in again.fits.iter_mut().flatten() {
        fit.adopt_compliance(lower);
    }
    again
}

/// By how much −2 log L is lower with a contact that gives way, where all fits call for it.
fn gives_way(analysis: &Analysis) -> Option<f64> {
    let fits = analysis.fits.as_ref().ok()?;
    let lower = fits.iter().map(Fit::compliance_lowers).collect::<Option<Vec<f64>>>()?;
    lower.into_iter().min_by(f64::total_cmp)
}

fn analyse_once(
    dataset: Dataset,
    options: &Options,
    method: Option<Method>,
    done: &(dyn Fn() + Sync),
) -> Analysis {
    let (dataset, camera) = calibrated(dataset);
    let (dataset, extracted, scene) = with_impacts(dataset, done);
    let method = method.unwrap_or_else(|| best(&dataset, &extracted, options));
    let found = camera.as_ref().map(FoundCamera::unknowns).unwrap_or_default();
    let film = FilmUnknowns { bounce: options.film.bounce, ..found };
    // labels that are fitted apart may lie elsewhere
    let near = near(&scene).filter(|_| dataset.by.is_none());
    let options = Options { method, near, film, ..*options };
    let most = if method == Method::Joint { usize::MAX } else { BOUND_FROM };
    let corrected = camera.as_ref().filter(|found| found.corrects()).map(|found| &found.camera);
    let filmed = films(&extracted, &scene, corrected, most);
    let mut fits = fit_watched(&dataset, &filmed, &options, done);
    for fit in fits.iter_mut().flatten() {
        if method == Method::TwoStage && finds_spins_from_paths(&extracted, &scene) {
            fit.warn_of_spins_from_paths();
        }
        if let Some(found) = &camera {
            fit.set_camera(found);
        }
    }
    Analysis { dataset, extracted, scene, camera, fits }
}

/// All frames at once use all that they tell; a robust loss is known only to fits of velocities.
fn best(dataset: &Dataset, extracted: &[(TrackShot, Impact)], options: &Options) -> Method {
    let squares = options.loss.unwrap_or(dataset.loss) == Loss::Squares;
    let joint = !extracted.is_empty() && extracted.len() <= MOST_JOINT && squares;
    if joint { Method::Joint } else { Method::TwoStage }
}
