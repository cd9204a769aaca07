//! What explains residuals that the equations or the stated numbers leave.

use crate::measurement::correction::Correction;

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
            Self::MassRatio => "mass-ratio",
            Self::Compliance => "compliance",
            Self::FallingFriction => "falling-friction",
            Self::TiltX | Self::TiltY => "tilt",
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
    /// Change of −2 log L with it, below 0; of a prior that the data contradict the square of the conflict in
    /// standard deviations, with a minus.
    pub delta_2logl: f64,
    /// Whether the estimates include it.
    pub adopted: bool,
    /// The explanation as a sentence.
    pub sentence: String,
}
