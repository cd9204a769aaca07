//! Assumptions that may not hold, and what is said where one does not.

use crate::fit::camera::FoundCorrection;
use crate::fit::estimate::Estimate;
use crate::measurement::correction::Correction;
use crate::measurement::number::{plain, with_error};
use crate::measurement::parameter::Parameter;
use crate::problem::{Id, Solution};

/// Why residuals may be larger than their errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Cause {
    /// A camera that differs from what is stated.
    Film(Correction),
    /// A wrong frame rate: the true frames per second over those stated.
    FrameRate,
    /// A wrong radius: the balls' radius over the stated one.
    Radius,
    /// Topspin that is not stated, over the natural roll's.
    CueSpin,
    /// Side spin that was not seen: the standard deviation of Rω_z/U from shot to shot.
    SideSpin,
    /// Unequal balls: the mass of the cue ball over that of the object ball.
    MassRatio,
    /// A contact that gives way along its surface: κ.
    Compliance,
    /// Friction that falls with the slip: b of μ(v) = a + b exp(−c v).
    FallingFriction,
    /// A table that is not level: its fall along x of the film, m/m.
    TiltX,
    /// A table that is not level: its fall along y of the film, m/m.
    TiltY,
}

impl Cause {
    /// Those that are looked for beyond the film's, and that change all shots alike: all but side spin.
    pub(super) const OF_ALL_SHOTS: [Self; 7] = [
        Self::MassRatio,
        Self::Compliance,
        Self::FrameRate,
        Self::CueSpin,
        Self::FallingFriction,
        Self::TiltX,
        Self::TiltY,
    ];

    /// The name in fit.json.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Film(Correction::PerspectiveX | Correction::PerspectiveY) => "perspective",
            Self::Film(Correction::ShutterX | Correction::ShutterY) => "rolling-shutter",
            Self::Film(Correction::LensX | Correction::LensY) => Correction::Lens.name(),
            Self::Film(Correction::ParallaxX | Correction::ParallaxY | Correction::Nearness) => "parallax",
            Self::Film(correction) => correction.name(),
            Self::FrameRate => "frame-rate",
            Self::Radius => "radius",
            Self::CueSpin => "cue-spin",
            Self::SideSpin => "side-spin",
            Self::MassRatio => "mass-ratio",
            Self::Compliance => "compliance",
            Self::FallingFriction => "falling-friction",
            Self::TiltX | Self::TiltY => "tilt",
        }
    }

    /// Its value where what is assumed holds.
    pub(super) fn neutral(self) -> f64 {
        match self {
            Self::FrameRate | Self::Radius | Self::MassRatio => 1.0,
            _ => 0.0,
        }
    }

    /// Values where the search along it begins, each with a first step.
    pub(super) fn starts(self) -> &'static [(f64, f64)] {
        match self {
            Self::FrameRate => &[(1.0, 0.02)],
            Self::MassRatio => &[(1.03, 0.02), (0.97, 0.02)],
            // of Poisson's ratio 0.34
            Self::Compliance => &[(1.258, 0.5)],
            Self::CueSpin => &[(0.0, 0.02)],
            // of none there is no slope
            Self::SideSpin => &[(0.03, 0.01), (0.15, 0.05)],
            Self::FallingFriction => &[(0.04, 0.02)],
            _ => &[(0.0, 0.001)],
        }
    }

    /// Where it may be: beyond, it is no explanation.
    pub(super) fn range(self) -> [f64; 2] {
        match self {
            // films are played at a thirtieth of their rate or as fast as they were taken
            Self::FrameRate => [0.02, 50.0],
            Self::Radius | Self::MassRatio => [0.5, 2.0],
            Self::Compliance => [0.01, 20.0],
            Self::CueSpin => [-1.5, 1.5],
            // more is seen, and meant
            Self::SideSpin => [1e-4, 0.3],
            Self::FallingFriction => [0.0, 1.0],
            Self::TiltX | Self::TiltY => [-0.05, 0.05],
            Self::Film(_) => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }
}

/// A cause of residuals, with the value that explains them best.
#[derive(Clone, Debug, PartialEq)]
pub struct Explanation {
    /// The cause that is named.
    pub cause: Cause,
    /// The value of the cause, in its own unit.
    pub estimate: f64,
    /// The standard error of that value.
    pub std_error: f64,
    /// By how much −2 log L changes with it; negative, since it explains residuals.
    pub delta_2logl: f64,
    /// Whether the estimates of the fit already include it.
    pub adopted: bool,
    /// What the parameters would be with it: value and standard error; empty where it is adopted.
    pub with_it: Vec<(Parameter, f64, f64)>,
    /// χ²/dof without it and with it; `None` where it is adopted.
    pub reduced_chi2: Option<[f64; 2]>,
    /// The explanation as a sentence.
    pub sentence: String,
}

impl Explanation {
    /// Whether its value differs from what is `assumed` by more than its error with the scatter that is left allows.
    pub(super) fn is_sure(&self, assumed: f64) -> bool {
        /// Standard errors.
        const SURELY: f64 = 3.0;
        (self.estimate - assumed).abs() > SURELY * self.std_error
    }

    /// Whether it is an explanation of a model that is far off: one that leaves nearly all of χ²/dof is none.
    pub(super) fn is_some(&self) -> bool {
        /// χ²/dof, and the part of it that is left at most.
        const FAR_OFF: f64 = 5.0;
        const LEFT: f64 = 0.9;
        self.reduced_chi2.is_none_or(|[before, after]| before < FAR_OFF || after < LEFT * before)
    }

    /// What a correction of the camera explained.
    pub(super) fn of_correction(found: &FoundCorrection) -> Self {
        let cause = Cause::Film(found.which);
        let off = (found.value - found.which.neutral()) / found.std_error;
        let value = with_error(found.value, found.std_error);
        Self {
            cause,
            estimate: found.value,
            std_error: found.std_error,
            delta_2logl: -off * off,
            adopted: true,
            with_it: Vec::new(),
            reduced_chi2: None,
            sentence: format!(
                "The film has a {} of {value}; the positions were corrected for it.",
                found.which.words()
            ),
        }
    }

    /// That the spins of the cue balls are not as stated: `film` is the fit with spins that were found, by which −2 log L falls; the
    /// spins differ by the median `difference` with its error; what they `were` found to be, and the word that states it.
    pub(in crate::fit) fn of_spins(
        (difference, error): (f64, f64),
        (film, fall): (&Solution, f64),
        (were, assume): (&str, &str),
    ) -> Self {
        let contact = [(Parameter::Mu, Id::Mu), (Parameter::MuS, Id::MuS), (Parameter::E, Id::E)];
        let found = contact.into_iter().filter_map(|(parameter, id)| {
            let estimate = film.get(id).filter(|_| !film.is_undetermined(id))?;
            Some((parameter, estimate.value, estimate.std_error?))
        });
        let with_it: Vec<(Parameter, f64, f64)> = found.collect();
        let values: Vec<String> = with_it
            .iter()
            .map(|(p, value, error)| format!("{} = {}", p.symbol(), with_error(*value, *error)))
            .collect();
        Self {
            cause: Cause::CueSpin,
            estimate: difference,
            std_error: error,
            delta_2logl: -fall,
            adopted: false,
            with_it,
            reduced_chi2: None,
            sentence: format!(
                "The cue balls do not spin as stated: {were}, which explains the residuals. With that {}. [cue_spin] assume = \"{assume}\" \
                 states it.",
                values.join(", ")
            ),
        }
    }

    /// That the contact gives way, with κ held, where the data call for it.
    pub(super) fn of_compliance(kappa: Option<&Estimate>, discs: bool, lower: f64) -> Self {
        let value = kappa.map_or(f64::NAN, |kappa| kappa.value);
        let (bodies, from) =
            if discs { ("discs", "fitted") } else { ("balls", "as follows from Poisson's ratio") };
        Self {
            cause: Cause::Compliance,
            estimate: value,
            std_error: kappa.and_then(|kappa| kappa.std_error).unwrap_or(f64::NAN),
            delta_2logl: -lower,
            adopted: true,
            with_it: Vec::new(),
            reduced_chi2: None,
            sentence: format!(
                "The contact between the {bodies} gives way along its surface (κ = {value:.3}, {from}): −2 log L is \
                 {lower:.1} lower than with a rigid contact, which kappa = {{ fixed = 0 }} under [fit] asks for."
            ),
        }
    }

    /// What explains a wrong scale as well: the film measures lengths in radii of the balls.
    pub(super) fn of_radius(scale: &FoundCorrection) -> Self {
        let Self { delta_2logl, adopted, with_it, reduced_chi2, .. } = Self::of_correction(scale);
        let (radius, error) = (scale.value.recip(), scale.std_error / scale.value.powi(2));
        let percent = with_error(100.0 * (scale.value - 1.0).abs(), 100.0 * scale.std_error);
        let [scale_is, radius_is] = if scale.value > 1.0 { ["large", "large"] } else { ["small", "small"] };
        Self {
            cause: Cause::Radius,
            estimate: radius,
            std_error: error,
            delta_2logl,
            adopted,
            with_it,
            reduced_chi2,
            sentence: format!(
                "Either the lengths of the film are {percent} % too {scale_is}, or the stated radius is as much too {radius_is}: the \
                 film alone does not tell which. μ, μ_s and e are the same in both cases."
            ),
        }
    }

    /// What is said of a cause that is not adopted, and of which something else is assumed; `parameters` as in "μ = 0.05 ± 0.01, …".
    pub(super) fn sentence(
        (cause, assumed): (Cause, f64),
        (value, error): (f64, f64),
        ([before, after], delta_2logl): ([f64; 2], f64),
        (explains, parameters): (bool, String),
    ) -> String {
        let what = match cause {
            Cause::Film(which) => format!("A {} of {}", which.words(), with_error(value, error)),
            Cause::FrameRate => format!("A frame rate of {} times the stated one", with_error(value, error)),
            Cause::Radius => format!("A radius of {} times the stated one", with_error(value, error)),
            Cause::CueSpin if value >= 0.0 => {
                format!("Topspin of {} % of the natural roll's besides what is stated", percent(value, error))
            }
            Cause::CueSpin => {
                format!(
                    "Topspin that is less than stated by {} % of the natural roll's",
                    percent(-value, error)
                )
            }
            Cause::MassRatio if assumed != cause.neutral() => format!(
                "A mass of the cue ball that is {} times the object ball's, and not {} times as stated,",
                with_error(value, error),
                plain(assumed, 4)
            ),
            Cause::MassRatio => format!(
                "A cue ball {} % {} than the object ball",
                percent((value - 1.0).abs(), error),
                if value > 1.0 { "heavier" } else { "lighter" }
            ),
            Cause::Compliance if assumed > 0.0 => format!(
                "A contact that gives way along the surface by κ = {}, and not {},",
                with_error(value, error),
                plain(assumed, 4)
            ),
            Cause::Compliance => {
                format!("A contact that gives way along the surface, κ = {},", with_error(value, error))
            }
            Cause::SideSpin => format!(
                "Side spin that nobody saw, of {} % of the speed over the radius from shot to shot,",
                percent(value, error)
            ),
            Cause::FallingFriction => {
                format!(
                    "Friction between the balls that falls with their slip, by {} from slow to fast,",
                    with_error(value, error)
                )
            }
            Cause::TiltX | Cause::TiltY => format!(
                "A table that falls by {} mm/m along {} of the film",
                with_error(1e3 * value, 1e3 * error),
                if cause == Cause::TiltX { "x" } else { "y" }
            ),
        };
        let verb = if explains { "explains the residuals" } else { "explains part of the residuals" };
        let then = match cause {
            Cause::Film(_) => "Leave [camera] at \"auto\" to correct for it.",
            Cause::FrameRate => {
                "Check [video] capture_fps: what the camera recorded at, not what it is played at."
            }
            Cause::Radius => "Measure the balls; [ball] radius_m takes it.",
            Cause::CueSpin => "[cue_spin] assume = \"unknown\" lets every shot tell its own spin.",
            Cause::MassRatio => "Weigh both; mass_kg under [ball] and [object] takes it.",
            Cause::Compliance => "kappa under [fit] takes it.",
            Cause::SideSpin => "side_sd under [cue_spin] takes it.",
            Cause::FallingFriction => "friction = \"exponential\" under [fit] takes it, or --falling fit.",
            Cause::TiltX | Cause::TiltY => {
                "Level the table, unless the nap of the cloth does it; a fit does not take it."
            }
        };
        // noise that the frames tell by themselves hides much of what a cause explains
        let misfit = if after < before {
            format!("χ²/dof {} → {}, ", digits(before), digits(after))
        } else {
            String::new()
        };
        format!("{what} {verb} ({misfit}−2 log L lower by {:.0}). With it {parameters}. {then}", -delta_2logl)
    }
}

fn percent(value: f64, error: f64) -> String {
    with_error(100.0 * value, 100.0 * error)
}

fn digits(value: f64) -> String {
    /// Noise that is told by residuals that the cause had inflated leaves next to nothing.
    const LITTLE: f64 = 0.5;
    if value < LITTLE {
        "below 1".to_owned()
    } else if value < 10.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.1}")
    }
}
