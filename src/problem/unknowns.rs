//! Unknowns that the shots of a sample share, with what is known of each before the data are seen.

use nalgebra::DVector;
use serde::{Serialize, Serializer};

use crate::measurement::parameter::Parameter;
use crate::name::worded;

/// Values of the unknowns that a shot has of its own.
pub(crate) type Own = DVector<f64>;

/// Number of shared unknowns that move the balls: [`Id::Mu`] to [`Id::ObjectAcross`].
pub(crate) const PHYSICS: usize = 22;
/// Number of shared unknowns of camera and tracker: [`Id::Scale`] to [`Id::ObjectScale`].
pub(crate) const CAMERA: usize = 18;
/// Number of shared unknowns of films of discs alone: [`Id::Slowing`] to [`Id::ContactDistance`].
pub(crate) const DISCS: usize = 3;
/// Number of shared unknowns of a sample.
pub(crate) const SHARED: usize = PHYSICS + CAMERA + DISCS;

worded! {
    /// An unknown that all shots of a sample share.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Id {
        /// Friction between the balls μ; its limit at a large slip if it decreases with the slip.
        Mu = "mu" | "",
        /// Friction of the cloth on the object ball during the impact μ_s.
        MuS = "mu_s" | "",
        /// Coefficient of restitution e.
        E = "e" | "",
        /// b of a friction μ + b·exp(−c·v) that decreases with the slip v.
        FallB = "mu_b" | "falling-friction",
        /// c of a friction μ + b·exp(−c·v) that decreases with the slip v, s/m.
        FallC = "mu_c" | "falling-friction",
        /// Tangential compliance κ of the contact.
        Kappa = "kappa" | "compliance",
        /// e₁ of a restitution e − e₁·v that decreases with the closing speed v, s/m.
        ESlope = "e_slope" | "falling-restitution",
        /// Mass of the cue ball over that of the object ball.
        MassRatio = "mass_ratio" | "mass-ratio",
        /// Radius of the cue ball over that of the object ball.
        RadiusRatio = "radius_ratio" | "radius",
        /// Mean topspin of shots stated as natural roll, over natural roll.
        Roll = "roll" | "cue-spin",
        /// Mean topspin of shots that slide before the impact, over natural roll.
        Slide = "topspin" | "cue-spin",
        /// Sliding friction of the cloth μ_k.
        MuK = "mu_k" | "",
        /// Rolling resistance of the cloth μ_r.
        MuR = "mu_r" | "",
        /// Restitution e_t of balls that land on the cloth.
        Bounce = "bounce" | "",
        /// True frame rate over the stated one.
        Rate = "frame_rate" | "frame-rate",
        /// Approach of the balls from touching to the instant of the impact, over that of a contact
        /// which lasts 280 µs at 1 m/s.
        Approach = "approach" | "contact-time",
        /// Slope of the table along x, down towards +x.
        TiltX = "tilt_x" | "tilt",
        /// Slope of the table along y, down towards +y.
        TiltY = "tilt_y" | "tilt",
        /// Outcome offset: velocity of the cue ball after the impact along the line of centres,
        /// less the model's, m/s.
        CueAlong = "cue_along_m_s" | "",
        /// Outcome offset of the cue ball across the line of centres.
        CueAcross = "cue_across_m_s" | "",
        /// Outcome offset of the object ball along the line of centres.
        ObjectAlong = "object_along_m_s" | "",
        /// Outcome offset of the object ball across the line of centres.
        ObjectAcross = "object_across_m_s" | "",
        /// Lengths in the picture over lengths on the table.
        Scale = "scale" | "radius",
        /// Scale along y over that along x.
        Aspect = "aspect" | "aspect",
        /// Shear of the picture along x.
        Shear = "shear" | "shear",
        /// Perspective along x, 1/m.
        PerspectiveX = "perspective_x" | "perspective",
        /// Perspective along y, 1/m.
        PerspectiveY = "perspective_y" | "perspective",
        /// Radial distortion of the lens at 0.5 m from the middle.
        Lens = "lens" | "lens",
        /// Decentring of the lens along x at 0.5 m from the middle, m (Brown 1971).
        LensX = "decentring_x" | "lens",
        /// Decentring of the lens along y.
        LensY = "decentring_y" | "lens",
        /// Delay of a rolling shutter along x, s/m.
        ShutterX = "shutter_x_s_per_m" | "rolling-shutter",
        /// Delay of a rolling shutter along y, s/m.
        ShutterY = "shutter_s_per_m" | "rolling-shutter",
        /// Displacement along x of a ball above the cloth, over its height.
        ParallaxX = "parallax_x" | "parallax",
        /// Displacement along y of a ball above the cloth, over its height.
        ParallaxY = "parallax_y" | "parallax",
        /// One over the height of the camera above the table, 1/m.
        Nearness = "nearness_per_m" | "parallax",
        /// How much later than the first body the film shows the second, frames.
        Late = "late_frames" | "late-ball",
        /// How far balls that touch are seen from their places, away from each other, m.
        Push = "push_m" | "near-balls",
        /// How far the second body is seen along x from its place, m.
        AsideX = "aside_x_m" | "aside",
        /// How far the second body is seen along y from its place, m.
        AsideY = "aside_y_m" | "aside",
        /// Scale of the second body's path over that of the first's.
        ObjectScale = "object_scale" | "aside",
        /// Deceleration of discs on the table at any speed, m/s².
        Slowing = "slowing_m_s2" | "",
        /// Deceleration of discs on the table over their speed, 1/s.
        Drag = "drag_per_s" | "",
        /// Distance of the discs' centres at the impact, m.
        ContactDistance = "contact_distance_m" | "",
    }
    /// The name in output.
    pub fn name;
    /// The name in fit.json as a cause of residuals, if it is one.
    pub(crate) fn cause;
}

impl Id {
    /// The unknowns that users want to know.
    pub(crate) const WANTED: [Self; 3] = [Self::Mu, Self::MuS, Self::E];
    /// Velocities after the impact less the model's, which each shot may have of its own.
    pub(crate) const OFFSETS: [Self; 4] =
        [Self::CueAlong, Self::CueAcross, Self::ObjectAlong, Self::ObjectAcross];

    /// Returns whether it is an unknown of camera and tracker.
    pub(crate) fn is_of_camera(self) -> bool {
        self as usize >= PHYSICS
    }
}

impl Serialize for Id {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl From<Parameter> for Id {
    fn from(parameter: Parameter) -> Self {
        // unknowns begin with the parameters, in their order
        Self::ALL[parameter as usize]
    }
}

/// How an unknown takes part in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    Free,
    /// Held at its start.
    Fixed,
    /// Held at its start; only its score is computed.
    Tested,
}

/// A normal distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Normal {
    pub(crate) mean: f64,
    pub(crate) sd: f64,
}

impl Normal {
    /// Returns the deviation of `x` from the mean in standard deviations.
    pub(crate) fn pull(&self, x: f64) -> f64 {
        (x - self.mean) / self.sd
    }
}

/// A shared unknown: the start of a search, its bounds, its prior, and how it takes part.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unknown {
    pub(crate) id: Id,
    pub(crate) start: f64,
    pub(crate) bounds: [f64; 2],
    pub(crate) prior: Option<Normal>,
    pub(crate) mode: Mode,
}

impl Unknown {
    /// Returns every unknown in the order of [`Id`], held at 0.
    pub(crate) fn list() -> Vec<Self> {
        let bounds = [f64::NEG_INFINITY, f64::INFINITY];
        let held = |id: Id| Self { id, start: 0.0, bounds, prior: None, mode: Mode::Fixed };
        Id::ALL.into_iter().map(held).collect()
    }

    /// Returns the prior if it counts.
    pub(crate) fn active_prior(&self) -> Option<Normal> {
        self.prior.filter(|_| self.mode == Mode::Free)
    }
}

/// Values of shared unknowns: of a sample in the order of [`Id`], of a problem in that of its
/// columns, which is the same if it has one sample.
#[derive(Clone, Debug)]
pub(crate) struct Shared(pub(crate) Vec<f64>);

impl Shared {
    /// Returns the values at which searches begin.
    pub(crate) fn starts(unknowns: &[Unknown]) -> Self {
        Self(unknowns.iter().map(|unknown| unknown.start).collect())
    }
}

impl std::ops::Index<Id> for Shared {
    type Output = f64;

    fn index(&self, id: Id) -> &f64 {
        &self.0[id as usize]
    }
}

impl std::ops::IndexMut<Id> for Shared {
    fn index_mut(&mut self, id: Id) -> &mut f64 {
        &mut self.0[id as usize]
    }
}
