//! The frames of an impact that was extracted, for the likelihood of frames.

use super::Impact;
use crate::film::camera::Camera;
use crate::likelihood::frames::{Extracted, Film};
use crate::measurement::track::TrackShot;
use crate::trajectory::scene::Scene;

impl Impact {
    /// The frames that the extraction used; the shot's own unknowns start where it found them. With `camera`, by which the frames
    /// were corrected, also how they follow its corrections.
    #[must_use]
    pub fn film(&self, shot: &TrackShot, scene: &Scene, camera: Option<&Camera>) -> Film {
        let spins = self.rotations.as_deref().map_or([None; 2], |rotations| {
            [rotations.cue_after, rotations.object_after]
                .map(|rotation| rotation.map(|r| (r.spin, r.covariance)))
        });
        let extracted = Extracted {
            window: self.window,
            position_sd: self.position_sd,
            scale: self.scale,
            chi2: self.chi2,
            noise: self.noise,
            wrong: &self.wrong,
            unknowns: &self.unknowns,
            spin: self.spin,
            at_model: self.at_model,
            spins_after: spins,
        };
        Film::new(shot, &extracted, scene, camera)
    }
}
