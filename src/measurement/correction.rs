//! Distortions of a film by its camera and its tracker that are stated or estimated.

use crate::name::worded;

worded! {
    /// Distortions of a film by its camera and its tracker (src/problem/film/camera.rs).
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    #[non_exhaustive]
    pub enum Correction {
        /// Lengths in the film at its stated scale over lengths on the table: 1 for a right scale.
        Scale = "scale" | "scale",
        /// The scale along y over the scale along x: 1 for square pixels.
        Aspect = "aspect" | "aspect (y over x)",
        /// Change of x per y: 0 for an upright camera.
        Shear = "shear" | "shear",
        /// Relative decrease of the scale per metre along x, 1/m.
        PerspectiveX = "perspective_x" | "perspective along x (1/m)",
        /// Relative decrease of the scale per metre along y, 1/m.
        PerspectiveY = "perspective_y" | "perspective along y (1/m)",
        /// Relative change of a length at 0.5 m by the lens: negative for a barrel distortion.
        Lens = "lens" | "lens (at 0.5 m)",
        /// Position of the lens's axis along x from the middle of the film, m.
        LensX = "lens_x_m" | "axis of the lens along x (m)",
        /// Position of the lens's axis along y, m.
        LensY = "lens_y_m" | "axis of the lens along y (m)",
        /// Delay of a rolling shutter per metre along x in the middle of the picture, s/m.
        ShutterX = "shutter_x_s_per_m" | "rolling shutter along x (s/m)",
        /// Delay of a rolling shutter per metre along y in the middle of the picture, s/m.
        ShutterY = "shutter_s_per_m" | "rolling shutter along y (s/m)",
        /// Displacement along x of a raised ball over its height: tan of the camera's angle.
        ParallaxX = "parallax_x" | "parallax along x (per height)",
        /// Displacement along y of a raised ball over its height.
        ParallaxY = "parallax_y" | "parallax along y (per height)",
        /// Increase of the parallax with the distance from the middle, 1/m: 1/height of the camera.
        Nearness = "nearness_per_m" | "nearness of the camera (1/height, 1/m)",
        /// Frames by which the object ball is shown later: some trackers smooth or predict.
        Late = "late_frames" | "object ball late (frames)",
        /// Displacement of touching balls away from each other, m: trackers mix up their edges.
        Push = "push_m" | "touching balls seen apart (m)",
        /// Displacement of the object ball along x, m, less the cue ball's: by light and shade.
        AsideX = "aside_x_m" | "object ball seen aside along x (m)",
        /// Displacement of the object ball along y, m, less the cue ball's.
        AsideY = "aside_y_m" | "object ball seen aside along y (m)",
        /// Scale of the object ball's path over the cue ball's: not 1 if a highlight is tracked.
        ObjectScale = "object_scale" | "scale of the object ball's path",
    }
    /// The name in fit.json.
    pub fn name;
    /// The name for a reader, with its unit.
    pub fn words;
}

impl Correction {
    /// The number of corrections.
    pub const COUNT: usize = Self::ALL.len();

    /// Returns the value of a camera without this distortion.
    pub fn neutral(self) -> f64 {
        match self {
            Self::Scale | Self::Aspect | Self::ObjectScale => 1.0,
            _ => 0.0,
        }
    }

    /// Returns whether only one camera's picture shows it, not positions measured by several.
    pub fn is_of_one_camera(self) -> bool {
        !matches!(self, Self::Scale | Self::Aspect | Self::Shear)
    }

    /// Returns the standard deviation of its prior about the neutral value.
    pub fn usual(self) -> f64 {
        match self {
            Self::Scale | Self::Aspect | Self::Shear | Self::Lens | Self::Late => 0.05,
            Self::PerspectiveX | Self::PerspectiveY => 0.3,
            Self::LensX | Self::LensY => 0.2,
            Self::ShutterX | Self::ShutterY => 0.01,
            Self::ParallaxX | Self::ParallaxY => 0.5,
            Self::Nearness => 1.0,
            Self::Push => 1e-4,
            Self::AsideX | Self::AsideY => 2e-4,
            // a ball 0.2 m from under the lamp is seen aside by 0.2 mm
            Self::ObjectScale => 1e-3,
        }
    }
}
