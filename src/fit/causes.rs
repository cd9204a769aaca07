//! What explains residuals that the equations or the stated numbers leave.

use schemars::JsonSchema;
use serde::{Serialize, Serializer};

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

impl Serialize for Cause {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A cause of residuals.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Explanation {
    /// cue-spin, mass-ratio, compliance, falling-friction, frame-rate, radius, tilt, scale, aspect, shear, perspective, lens,
    /// rolling-shutter or parallax.
    #[schemars(with = "String")]
    pub cause: Cause,
    /// The value that explains the residuals best, as the true frame rate over the stated one.
    #[schemars(with = "Option<f64>")]
    pub estimate: f64,
    /// Its standard error, same unit.
    #[schemars(with = "Option<f64>")]
    pub std_error: f64,
    /// Change of −2 log L with it, below 0; of a contradicted prior minus the square of the conflict in standard deviations.
    #[schemars(with = "Option<f64>")]
    pub delta_2logl: f64,
    /// Whether the estimates include it.
    pub adopted: bool,
    /// The explanation for a reader, with what to do.
    pub sentence: String,
}
