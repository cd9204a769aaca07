//! Everything from a data set as it was loaded to its fits, as `caromfit fit` does it.

mod spins;

use std::sync::Arc;

use super::calibration::{calibrated, calibrated_discs as corrected_discs};
use super::footage::{extracted, films, finds_spins_from_paths, near, with_discs_calibrated};
use super::{FilmUnknowns, Fit, FitError, FoundCamera, Method, Options, check, fit_with};
use crate::extraction::Impact;
use crate::extraction::disc::DiscImpact;
use crate::film::discs::Calibrated;
use crate::likelihood::frames::Film;
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::{Compliance, Parameter, Setting};
use crate::measurement::track::TrackShot;
use crate::physics::collision::Fidelity;
use crate::trajectory::scene::Scene;

/// Frames of more shots than this take minutes to fit jointly.
const MOST_JOINT: usize = 20_000;

/// So many shots tell how much the frames could tell at best.
const BOUND_FROM: usize = 1000;

/// A data set that is ready to be fitted.
#[non_exhaustive]
pub struct Prepared {
    /// The data set with its impacts; footage as it was corrected.
    pub dataset: Dataset,
    /// The shots of footage whose impacts were found.
    pub extracted: Vec<(TrackShot, Impact)>,
    /// What was assumed of the balls and the cloth.
    pub scene: Scene,
    /// What the shots show of their camera; `None` where there is no footage, or too little of discs.
    pub camera: Option<FoundCamera>,
}

impl Prepared {
    /// Corrects footage for its camera and finds its impacts; other data, and footage whose impacts were found before, stay as they are. `done` is called after every shot that is extracted, from several threads.
    #[must_use]
    pub fn new(dataset: Dataset, done: &(dyn Fn() + Sync)) -> Self {
        Self::searched(dataset, (None, false), done)
    }

    /// The same, with the camera counted from where that of another film by the same camera is.
    pub(crate) fn filmed_like(
        dataset: Dataset,
        same: Option<&FoundCamera>,
        done: &(dyn Fn() + Sync),
    ) -> Self {
        Self::searched(dataset, (same, false), done)
    }

    /// The same; `quick`: with a search for the camera from one start, which may not be settled.
    fn searched(
        dataset: Dataset,
        (same, quick): (Option<&FoundCamera>, bool),
        done: &(dyn Fn() + Sync),
    ) -> Self {
        // what has its impacts was corrected before
        let (dataset, camera, learned) =
            if dataset.shots.is_empty() { calibrated(dataset, same, quick) } else { (dataset, None, None) };
        let (dataset, extracted, scene) =
            extracted(dataset, (learned.as_ref(), calibrated_by(camera.as_ref())), done);
        Self { dataset, extracted, scene, camera }
    }

    /// Whether the search for the camera ended.
    fn is_settled(&self) -> bool {
        self.camera.as_ref().is_none_or(|found| found.is_settled)
    }

    /// How it is best fitted: all frames at once use all information.
    #[must_use]
    pub fn best_method(&self) -> Method {
        let joint = !self.extracted.is_empty() && self.extracted.len() <= MOST_JOINT;
        if joint { Method::Joint } else { Method::TwoStage }
    }

    /// What a joint fit of its frames estimates besides the parameters.
    #[must_use]
    pub fn film_unknowns(&self) -> FilmUnknowns {
        // what discs tell of their camera is in the frames of their whole paths, which no fit of their impacts sees again
        let camera = self.camera.as_ref().filter(|found| !found.of_discs);
        camera.map(FoundCamera::unknowns).unwrap_or_default()
    }

    /// The frames of its shots, of at most about `most` of them, and how they follow the corrections of the camera.
    #[must_use]
    pub fn films(&self, most: usize) -> Vec<Option<Arc<Film>>> {
        let corrected = self.camera.as_ref().filter(|found| found.corrects()).map(|found| &found.camera);
        films(&self.extracted, &self.scene, corrected, most)
    }

    /// Whether spins are known from its paths alone, so that fits of its velocities may be biased.
    pub(crate) fn finds_spins_from_paths(&self) -> bool {
        finds_spins_from_paths(&self.extracted, &self.scene)
    }
}

/// Corrects footage of discs for its camera and extracts their impacts ([`super::footage::with_discs`]). Any other data set is returned as it is.
#[must_use]
pub fn calibrated_discs(dataset: Dataset) -> (Dataset, Vec<(TrackShot, DiscImpact)>) {
    let (dataset, camera) = corrected_discs(dataset);
    with_discs_calibrated(dataset, calibrated_by(camera.as_ref()))
}

fn calibrated_by(camera: Option<&FoundCamera>) -> Option<&Calibrated> {
    camera?.calibrated.as_ref()
}

/// A data set and its fits.
#[non_exhaustive]
pub struct Analysis {
    /// The data set with its impacts; footage as it was corrected.
    pub dataset: Dataset,
    /// The shots of footage whose impacts were found.
    pub extracted: Vec<(TrackShot, Impact)>,
    /// What was assumed of the balls and the cloth.
    pub scene: Scene,
    /// What the shots show of their camera; `None` where there is no footage, or too little of discs.
    pub camera: Option<FoundCamera>,
    /// The fit, or one for each label that is fitted apart.
    pub fits: Result<Vec<Fit>, FitError>,
}

/// Fits a data set of any kind, as `caromfit fit` does: footage is corrected for its camera and its impacts are found first.
#[must_use]
pub fn analyse(dataset: &Dataset, options: &Options) -> Analysis {
    analyse_watched(dataset, options, &|| ())
}

/// As [`analyse`], for those who show how far it is: `done` is called after every shot that is extracted and every replicate of a
/// bootstrap, from several threads.
#[must_use]
pub fn analyse_watched(dataset: &Dataset, options: &Options, done: &(dyn Fn() + Sync)) -> Analysis {
    if let Err(error) = check(dataset, options) {
        let scene = Scene::of(&dataset.model(Fidelity::Full));
        return Analysis {
            dataset: dataset.clone(),
            extracted: Vec::new(),
            scene,
            camera: None,
            fits: Err(error),
        };
    }
    let with_settings = || {
        let mut own = dataset.clone();
        own.settings = options.falling.applied(own.settings);
        own
    };
    let first = spins::analyse(with_settings(), options, done);
    // discs are corrected without a model of their contact, and their κ is fitted
    if dataset.tracks.as_ref().is_none_or(|tracks| tracks.discs.is_some()) {
        return first;
    }
    let Some(lower) = gives_way(&first) else { return first };
    drop(first);
    // the film is to be corrected, and the impacts extracted, with the contact that gives way, too
    let mut compliant = with_settings();
    state_compliance(&mut compliant);
    let mut again = analyse_once(compliant, options, done);
    for fit in again.fits.iter_mut().flatten() {
        fit.adopt_compliance(lower);
    }
    again
}

/// States that the contact gives way, with the κ of its setting.
pub(crate) fn state_compliance(dataset: &mut Dataset) {
    dataset.settings.compliance = Compliance::Stated;
    let kappa = &mut dataset.settings[Parameter::Kappa];
    *kappa = Setting::held(kappa.initial);
}

/// By how much −2 log L is lower with a contact that gives way, where all fits call for it.
fn gives_way(analysis: &Analysis) -> Option<f64> {
    let fits = analysis.fits.as_ref().ok()?;
    let lower = fits.iter().map(Fit::compliance_lowers).collect::<Option<Vec<f64>>>()?;
    lower.into_iter().min_by(f64::total_cmp)
}

fn analyse_once(dataset: Dataset, options: &Options, done: &(dyn Fn() + Sync)) -> Analysis {
    Prepared::new(dataset, done).analysed(options, done)
}

impl Prepared {
    /// Its fits. Causes of residuals are not looked for where the spins are suspect, if that is done `spins_first`.
    fn fits(
        &self,
        options: &Options,
        spins_first: bool,
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<Fit>, FitError> {
        let is_free = options.method.is_none();
        let mut method = options.method.unwrap_or_else(|| self.best_method());
        let film = FilmUnknowns { bounce: options.film.bounce, ..self.film_unknowns() };
        // labels that are fitted apart may lie elsewhere
        let near = near(&self.scene).filter(|_| self.dataset.by.is_none());
        let near = near.or(options.near);
        let options = Options { method: Some(method), near, film, ..*options };
        let filmed = self.films(if method == Method::Joint { usize::MAX } else { BOUND_FROM });
        let mut fits = fit_with(&self.dataset, &filmed, (&options, spins_first), done);
        if is_free && matches!(fits, Err(FitError::NoStart(..))) {
            // frames through which no collision leads: what was extracted from them says what is wrong
            method = Method::TwoStage;
            let options = Options { method: Some(method), ..options };
            fits = fit_with(&self.dataset, &filmed, (&options, spins_first), done);
        }
        for fit in fits.iter_mut().flatten() {
            if method == Method::TwoStage && self.finds_spins_from_paths() {
                fit.warn_of_spins_from_paths();
            }
            if let Some(found) = &self.camera {
                fit.set_camera(found);
                fit.compare_scale(&self.dataset);
                super::causes::of_film(fit);
            }
        }
        fits
    }

    fn with(self, fits: Result<Vec<Fit>, FitError>) -> Analysis {
        let Self { dataset, extracted, scene, camera } = self;
        Analysis { dataset, extracted, scene, camera, fits }
    }

    fn analysed(self, options: &Options, done: &(dyn Fn() + Sync)) -> Analysis {
        let fits = self.fits(options, false, done);
        self.with(fits)
    }
}
