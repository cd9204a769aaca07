//! The camera that balls and discs calibrate: they touch at the same distance in every direction and
//! everywhere in the picture, and move as the cloth lets them. With it, what else is found of a film:
//! noise that lasts, frames that were dropped.

use crate::extraction::NoiseCorrelation;
use crate::film::camera::Camera;
use crate::film::discs::Calibrated;
use crate::measurement::correction::Correction;
use crate::measurement::number;
use crate::problem::{Finding, Id, Solution};

/// A correction as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundCorrection {
    /// Which correction it is; the axis of a lens stands for its decentring.
    pub which: Correction,
    /// Its value, as a correction of what the data set states, in the unit that [`Correction::words`] names: a scale that was wrong by a
    /// factor has that factor.
    pub value: f64,
    /// Its standard error, in the same unit.
    pub std_error: f64,
    /// Whether it is applied: that of a fit always, that of extracted discs if the frames call for it.
    pub adopted: bool,
}

/// The unknowns of a camera as corrections.
const CORRECTIONS: [(Id, Correction); 13] = [
    (Id::Scale, Correction::Scale),
    (Id::Aspect, Correction::Aspect),
    (Id::Shear, Correction::Shear),
    (Id::PerspectiveX, Correction::PerspectiveX),
    (Id::PerspectiveY, Correction::PerspectiveY),
    (Id::Lens, Correction::Lens),
    (Id::LensX, Correction::LensX),
    (Id::LensY, Correction::LensY),
    (Id::ShutterX, Correction::ShutterX),
    (Id::ShutterY, Correction::ShutterY),
    (Id::ParallaxX, Correction::ParallaxX),
    (Id::ParallaxY, Correction::ParallaxY),
    (Id::Nearness, Correction::Nearness),
];

/// Distance of the axis of a lens from the middle of the film, m, beyond which a picture shows none.
const MOST_AXIS: f64 = 2.0;

/// Number of shots below which discs are extracted with the camera as stated, but for its scale.
pub(super) const LEAST_SHOTS: usize = 6;

/// The camera as the shots of a film show it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct FoundCamera {
    /// The camera.
    pub camera: Camera,
    /// Its corrections that were free.
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
    /// Returns the camera as the fit of a film has it.
    pub(super) fn of_film(solution: &Solution) -> Self {
        let correction = |(id, which): (Id, Correction)| {
            let found = solution.get(id)?;
            Some(FoundCorrection { which, value: found.value, std_error: found.std_error?, adopted: true })
        };
        let corrections: Vec<FoundCorrection> = CORRECTIONS.into_iter().filter_map(correction).collect();
        let value = |id: Id| solution.value(id);
        let middle = solution.middle.map(|x| x * solution.unit);
        let mut camera = Camera::neutral(middle);
        for (id, which) in CORRECTIONS {
            camera = camera.with(which, value(id));
        }
        // a decentring d bends the picture as a lens l whose axis is at −d/l
        for (id, which) in [(Id::LensX, Correction::LensX), (Id::LensY, Correction::LensY)] {
            let axis = -value(id) / value(Id::Lens);
            camera = camera.with(which, if axis.abs() < MOST_AXIS { axis } else { 0.0 });
        }
        let shots = solution.names.first().map_or(0, Vec::len);
        let noise = solution.frame_noise().map(|noises| noises[1].rho);
        Self {
            camera,
            corrections,
            unit: solution.unit,
            shots,
            contacts: (0..shots)
                .filter_map(|i| solution.contact(i))
                .map(|[x, y]| [x + middle[0], y + middle[1]])
                .collect(),
            noise_correlation: noise.filter(|rho| *rho > 0.0).map(|value| NoiseCorrelation {
                value,
                std_error: f64::NAN,
                adopted: true,
            }),
            drops: solution
                .findings
                .iter()
                .find_map(|f| match f {
                    Finding::Drops { shots, drops } => Some([*shots, *drops]),
                    _ => None,
                })
                .unwrap_or_default(),
            spoiled: solution.findings.iter().find_map(|f| match f {
                Finding::Spoiled { before, after } => Some([*before, *after]),
                _ => None,
            }),
            ..Self::as_it_is()
        }
    }

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
            spoiled: None,
            of_discs: false,
            is_settled: true,
            calibrated: None,
        }
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
                "The estimates include the camera, which the {} themselves calibrate ({}): {}.",
                if self.of_discs { "discs" } else { "balls" },
                number::count_of(self.shots, "shot"),
                adopted.join(", ")
            )
        })
    }
}
