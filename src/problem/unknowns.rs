//! Unknowns of a film: those that each shot has of its own, and those that all shots share, with
//! what is known of each before the frames are seen.

use nalgebra::SVector;

use crate::physics::name::worded;

/// Number of unknowns that each shot has of its own.
pub(crate) const OWN: usize = 8;

/// Places of a shot's own unknowns. Velocities are in the collision frame of that shot, m/s.
pub(crate) mod own {
    /// Instant of the impact, s.
    pub const TIME: usize = 0;
    /// Coordinates x and y of the object ball at rest, m.
    pub const X: usize = 1;
    pub const Y: usize = 2;
    /// Direction of the line of centres on the table, rad.
    pub const DIRECTION: usize = 3;
    /// Velocity of the cue ball along the line of centres.
    pub const ALONG: usize = 4;
    /// Velocity of the cue ball across the line of centres.
    pub const ACROSS: usize = 5;
    /// Topspin over that of natural roll, less what shots of this kind share.
    pub const TOPSPIN: usize = 6;
    /// Side spin Rω_z/U.
    pub const SIDE: usize = 7;
}

/// Values of a shot's own unknowns.
pub(crate) type Own = SVector<f64, OWN>;

/// Number of shared unknowns that move the balls: [`Id::Mu`] to [`Id::TiltY`].
pub(crate) const PHYSICS: usize = 17;
/// Number of shared unknowns of the camera: [`Id::Scale`] to [`Id::Nearness`].
pub(crate) const CAMERA: usize = 13;
/// Number of shared unknowns.
pub(crate) const SHARED: usize = PHYSICS + CAMERA;

worded! {
    /// An unknown that all shots of a film share.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Id {
        /// Friction between the balls μ; its limit at a large slip if it falls with the slip.
        Mu = "mu",
        /// Friction of the cloth on the object ball during the impact μ_s.
        MuS = "mu_s",
        /// Coefficient of restitution e.
        E = "e",
        /// b of a friction μ + b·exp(−c·v) that falls with the slip v.
        FallB = "mu_b",
        /// c of that friction, s/m.
        FallC = "mu_c",
        /// Tangential compliance κ of the contact.
        Kappa = "kappa",
        /// e₁ of a restitution e − e₁·v that falls with the closing speed v, s/m.
        ESlope = "e_slope",
        /// Mass of the cue ball over that of the object ball.
        MassRatio = "mass_ratio",
        /// Radius of the cue ball over that of the object ball.
        RadiusRatio = "radius_ratio",
        /// Mean topspin of shots stated as natural roll, over natural roll.
        Roll = "roll",
        /// Mean topspin of shots that slide before the impact, over natural roll.
        Slide = "topspin",
        /// Sliding friction of the cloth μ_k.
        MuK = "mu_k",
        /// Rolling resistance of the cloth μ_r.
        MuR = "mu_r",
        /// Restitution e_t of balls that land on the cloth.
        Bounce = "bounce",
        /// True frame rate over the stated one.
        Rate = "frame_rate",
        /// Slope of the table along x, down towards +x.
        TiltX = "tilt_x",
        /// Slope of the table along y, down towards +y.
        TiltY = "tilt_y",
        /// Lengths in the picture over lengths on the table.
        Scale = "scale",
        /// Scale along y over that along x.
        Aspect = "aspect",
        /// Shear of the picture along x.
        Shear = "shear",
        /// Perspective along x, 1/m.
        PerspectiveX = "perspective_x",
        /// Perspective along y, 1/m.
        PerspectiveY = "perspective_y",
        /// Radial distortion of the lens at 0.5 m from the middle.
        Lens = "lens",
        /// Decentring of the lens along x at 0.5 m from the middle, m (Brown 1971).
        LensX = "decentring_x",
        /// Decentring of the lens along y.
        LensY = "decentring_y",
        /// Delay of a rolling shutter along x, s/m.
        ShutterX = "shutter_x_s_per_m",
        /// Delay of a rolling shutter along y, s/m.
        ShutterY = "shutter_s_per_m",
        /// Displacement along x of a ball above the cloth, over its height.
        ParallaxX = "parallax_x",
        /// Displacement along y of a ball above the cloth, over its height.
        ParallaxY = "parallax_y",
        /// One over the height of the camera above the table, 1/m.
        Nearness = "nearness_per_m",
    }
    /// The name in output.
    pub fn name;
}

impl Id {
    /// The unknowns that users want to know.
    pub const WANTED: [Self; 3] = [Self::Mu, Self::MuS, Self::E];
}

/// How an unknown takes part in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Estimated.
    Free,
    /// Held at its start.
    Fixed,
    /// Held at its start; only its score is computed.
    Tested,
}

/// A normal distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normal {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sd: f64,
}

impl Normal {
    /// Returns the deviation of `x` from the mean in standard deviations.
    pub(crate) fn pull(&self, x: f64) -> f64 {
        (x - self.mean) / self.sd
    }
}

/// A shared unknown: where a search begins, its bounds, what is known of it, and how it takes part.
#[derive(Clone, Copy, Debug)]
pub struct Unknown {
    pub id: Id,
    pub start: f64,
    pub bounds: [f64; 2],
    pub prior: Option<Normal>,
    pub mode: Mode,
}

impl Unknown {
    /// Returns the prior if it counts.
    pub(crate) fn active_prior(&self) -> Option<Normal> {
        self.prior.filter(|_| self.mode == Mode::Free)
    }
}

/// Values of all shared unknowns.
#[derive(Clone, Copy, Debug)]
pub struct Shared(pub(crate) [f64; SHARED]);

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
