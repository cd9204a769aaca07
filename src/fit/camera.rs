//! The camera that the balls calibrate: they touch at 2R in every direction and everywhere in the picture, and move as the cloth lets
//! them; discs keep their shape and move straight. With it, what else is found of a film: noise that lasts, frames that were dropped.

use super::check::{self, capital};
use super::{FilmUnknowns, Fit, SharedKind};
use crate::extraction::NoiseCorrelation;
use crate::film::camera::Camera;
use crate::film::discs::Calibrated;
use crate::measurement::correction::Correction;
use crate::measurement::dataset::Dataset;
use crate::measurement::number;

/// A correction as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundCorrection {
    /// Which correction it is.
    pub which: Correction,
    /// Its value, as a correction of what the data set states, in the unit that [`Correction::words`] names: a scale that was wrong by a
    /// factor has that factor.
    pub value: f64,
    /// Its standard error, in the same unit.
    pub std_error: f64,
    /// Whether the frames call for it; if not, it is not applied.
    pub adopted: bool,
}

/// With fewer shots only a scale that nobody stated is looked for; the rest of the camera is taken as stated.
pub(super) const LEAST_SHOTS: usize = 6;

/// The camera as the shots of a film show it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundCamera {
    /// The camera for which the positions were corrected.
    pub camera: Camera,
    /// The corrections that were tried.
    pub corrections: Vec<FoundCorrection>,
    /// The factor by which all lengths were multiplied beforehand, the unit of the film in m; 1 where the stated one
    /// was right to a tenth.
    pub unit: f64,
    /// How many shots it was found from.
    pub shots: usize,
    /// The positions in the films where the balls of these shots touched, m.
    pub contacts: Vec<[f64; 2]>,
    /// Whether nothing was left to correct at the end.
    pub converged: bool,
    /// The correlation of the noise of neighbouring frames; `None` where the frames do not determine it.
    pub noise_correlation: Option<NoiseCorrelation>,
    /// The coarsest step of the grid to which positions were rounded, m; 0 where they were not.
    pub resolution: f64,
    /// The number of shots in which frames were dropped without a sign in their numbers, and the number of such
    /// drops.
    pub drops: [usize; 2],
    /// The noise of neighbouring frames over what is stated of it; `None` where nothing is stated.
    pub over_stated_noise: Option<f64>,
    /// How many frames before and after the impacts were left out, as their positions are off in all shots; the first of each is less
    /// than half a frame away.
    pub spoiled: Option<[usize; 2]>,
    /// Whether discs calibrate it, and not balls.
    pub of_discs: bool,
    /// Whether the search for it ended: with a good camera, or with the best of all starts.
    pub(crate) is_settled: bool,
    /// How far it may be off, where discs calibrate it.
    pub(crate) calibrated: Option<Calibrated>,
}

impl FoundCamera {
    /// The films are taken as they are.
    pub(super) fn as_it_is() -> Self {
        Self {
            camera: Camera::neutral([0.0; 2]),
            corrections: Vec::new(),
            unit: 1.0,
            shots: 0,
            contacts: Vec::new(),
            converged: true,
            noise_correlation: None,
            resolution: 0.0,
            drops: [0; 2],
            over_stated_noise: None,
            spoiled: None,
            of_discs: false,
            is_settled: true,
            calibrated: None,
        }
    }

    /// What remains to be estimated in a joint fit of the corrected films.
    #[must_use]
    pub fn unknowns(&self) -> FilmUnknowns {
        let mut unknowns = FilmUnknowns::default();
        for found in self.corrections.iter().filter(|found| found.adopted) {
            let which = found.which;
            unknowns.corrections[which as usize] = Some(which.neutral() - self.camera.get(which));
        }
        unknowns
    }

    /// Adopts a correction: one that another film by the same camera calls for.
    pub(crate) fn adopt(&mut self, which: Correction) {
        match self.corrections.iter_mut().find(|found| found.which == which) {
            Some(found) => found.adopted = true,
            None => {
                let value = self.camera.get(which);
                let correction = FoundCorrection { which, value, std_error: which.usual(), adopted: true };
                self.corrections.push(correction);
            }
        }
    }

    /// The corrections that were adopted.
    pub(crate) fn adopted(&self) -> impl Iterator<Item = Correction> {
        self.corrections.iter().filter(|found| found.adopted).map(|found| found.which)
    }

    /// Whether any correction was adopted.
    #[must_use]
    pub fn corrects(&self) -> bool {
        self.corrections.iter().any(|found| found.adopted)
    }

    /// Sentences that say what was done to the films.
    #[must_use]
    pub fn sentences(&self) -> Vec<String> {
        let [shots, drops] = self.drops;
        let dropped = (drops > 0).then(|| {
            format!(
                "The camera dropped frames that the frame numbers do not show ({drops} times, in {}): {} go several steps \
                 at once there. The frames after them were moved in time.",
                number::count_of(shots, "shot"),
                if self.of_discs { "discs" } else { "balls" }
            )
        });
        let lasts = self.noise_correlation.filter(|found| found.adopted).map(|found| {
            format!(
                "The noise of the positions lasts from frame to frame: neighbouring frames are correlated by {}. Errors take it \
                 into account.",
                number::with_error(found.value, found.std_error)
            )
        });
        let spoiled = self.spoiled.map(|[before, after]| {
            format!(
                "Next to the impacts the positions are off in all shots, as where balls hide each other or an exposure lasts: {} before and \
                 {after} after were left out.",
                number::count_of(before, "frame")
            )
        });
        let scaled = (self.unit != 1.0).then(|| {
            format!(
                "The scale is that of the balls, which touch at a distance of 2R: about {:.4} units of the film are 1 m.",
                self.unit.recip()
            )
        });
        let unfinished = (!self.converged).then(|| {
            format!(
                "The search for the camera did not converge: what is left to correct may bias the estimates. Check the radius, \
                 the frame rate and which track is which {}, or state what is known under [camera].",
                if self.of_discs { "disc" } else { "ball" }
            )
        });
        scaled
            .into_iter()
            .chain(self.sentence())
            .chain(unfinished)
            .chain(lasts)
            .chain(dropped)
            .chain(spoiled)
            .collect()
    }

    /// Which corrections were adopted, as a sentence; `None` where none was.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let adopted: Vec<String> = self
            .corrections
            .iter()
            .filter(|found| found.adopted)
            .map(|found| {
                format!("{} {}", found.which.words(), number::with_error(found.value, found.std_error))
            })
            .collect();
        (!adopted.is_empty()).then(|| {
            format!(
                "The positions were corrected for the camera, which the {} themselves calibrate ({}): {}.",
                if self.of_discs { "discs" } else { "balls" },
                number::count_of(self.shots, "shot"),
                adopted.join(", ")
            )
        })
    }
}

/// A quantity is in conflict with what was stated of it beyond so many standard deviations of both.
pub(super) const CONFLICT: f64 = 3.0;

/// Relative standard deviation of a stated radius of balls: new ones differ by 0.05 mm from their nominal size.
const RADIUS_SD: f64 = 0.05 / 28.575;

impl Fit {
    /// Notes where the balls contradict the scale and the radius that are stated, which only together have a size in the film.
    pub(super) fn compare_scale(&mut self, dataset: &Dataset) {
        let Some(tracks) = &dataset.tracks else { return };
        let Some(stated_sd) = tracks.scale_sd else { return };
        let Some(found) = self.camera.as_ref().filter(|found| !found.of_discs) else { return };
        let scale = found.corrections.iter().find(|found| found.adopted && found.which == Correction::Scale);
        let Some(scale) = scale.filter(|_| found.unit == 1.0 || tracks.states_unit) else { return };
        let sd = stated_sd.hypot(RADIUS_SD);
        if (scale.value - 1.0).abs() > CONFLICT * sd.hypot(scale.std_error) {
            let finding = check::scale(scale.value, dataset.ball.radius, sd);
            self.warnings.insert(0, format!("{}.", capital(&finding.text)));
            self.diagnostics.suspicious.insert(0, finding);
        }
    }

    /// Notes the camera for which the films were corrected, as the fit of their frames has it where they were fitted jointly.
    pub(crate) fn set_camera(&mut self, found: &FoundCamera) {
        let mut found = found.clone();
        for correction in found.corrections.iter_mut().filter(|correction| correction.adopted) {
            let joint = self.diagnostics.joint.as_ref();
            let Some(left) = joint.and_then(|joint| joint.get(SharedKind::Camera(correction.which))) else {
                continue;
            };
            let unit = if correction.which == Correction::Scale { found.unit } else { 1.0 };
            correction.value = (found.camera.get(correction.which) + left.value) / unit;
            correction.std_error = left.std_error / unit;
        }
        self.camera = Some(found);
    }
}
