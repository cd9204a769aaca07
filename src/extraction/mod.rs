//! Tracks → impacts: for each shot one weighted least-squares fit of both bodies' positions at once,
//! through the instant of impact; from it velocities before and after with their covariance.
//!
//! The fit of the frames between two times is in `path_fit`, which frames are wrong in `wrong_frames`, how far a shot is used in
//! `window`, and why it cannot be used in `unusable`. How two balls move is in `ball_paths`, how two discs do in `disc::paths`.

mod ball_paths;
mod cushion;
pub mod disc;
mod drops_at_impact;
mod film;
mod initial_guess;
mod marker_rotation;
mod marker_spins;
mod near_model;
mod noise_correlation;
mod path_fit;
mod quantities;
pub mod shots;
mod spin_from_motion;
mod unusable;
mod window;
mod wrong_frames;

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use crate::film::frame_noise::noise;

pub(crate) use cushion::leave_out_before_cushion;
pub(crate) use initial_guess::{from_paths, object_speed};
pub use marker_rotation::Rotation;
pub(crate) use marker_rotation::turn;
pub(crate) use near_model::near_model;
pub use noise_correlation::NoiseCorrelation;
pub(crate) use noise_correlation::noise_correlation;
pub use unusable::{Bodies, Unusable};
pub(crate) use window::MOST as MOST_FRAMES;

pub use crate::trajectory::both_balls::Motion;
pub use crate::trajectory::shot_scene::Lifted;

use self::ball_paths::{BallPaths, TrackedBalls};
use crate::measurement::spin::Spin;
use crate::measurement::track::{TrackShot, isolated};
use crate::trajectory::scene::Scene;
use crate::trajectory::shot_scene::ShotScene;
use crate::trajectory::unknowns::{Unknowns, unknown};

/// The quantities of an [`Impact`], in the order of its values and covariance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// Direction of the line of centres in the table frame, rad.
    Direction,
    /// The cue ball's velocity along x just before the impact, m/s.
    CueVxBefore,
    /// The cue ball's velocity along y just before the impact, m/s.
    CueVyBefore,
    /// The cue ball's velocity along x just after the impact, m/s.
    CueVxAfter,
    /// The cue ball's velocity along y just after the impact, m/s.
    CueVyAfter,
    /// The object ball's velocity along x just after the impact, m/s.
    ObjVxAfter,
    /// The object ball's velocity along y just after the impact, m/s.
    ObjVyAfter,
    /// The upward velocity just after the impact of the ball that friction lifts, m/s; 0 for stun.
    Lift,
    /// The cloth's sliding friction μ_k, dimensionless.
    Sliding,
    /// Instant of impact, s.
    Time,
    /// The cue ball's spin about x before the impact, rad/s, where it is unknown and was found from the motion.
    CueSpinX,
    /// The cue ball's spin about y before the impact, rad/s, where it is unknown and was found from the motion.
    CueSpinY,
}

impl Quantity {
    /// The number of quantities.
    pub const COUNT: usize = 12;
}

/// The impact of a shot: values and covariance of its [`Quantity`]s, in the table frame.
#[derive(Clone, Debug)]
pub struct Impact {
    /// The values, in the order of [`Quantity`].
    pub values: [f64; Quantity::COUNT],
    /// Their covariance, in the same order.
    pub covariance: SMatrix<f64, { Quantity::COUNT }, { Quantity::COUNT }>,
    /// Which ball leaves the cloth after the impact.
    pub lifted: Lifted,
    /// The standard deviation of a coordinate, m: stated, or estimated from this shot's tracks.
    pub position_sd: f64,
    /// χ² per degree of freedom with the noise that second differences of the track show.
    pub reduced_chi2: f64,
    /// How many frames were used: of the cue ball before and after the impact, and of the object ball after it.
    pub frames: [usize; 3],
    /// How many frames were left out as wrong.
    pub outliers: usize,
    /// The first and the last instant that was used, s.
    pub window: [f64; 2],
    /// The cue ball's spin before the impact that was assumed, in the table frame: as stated, or as its markers show.
    /// Where it was unknown, it is natural roll if the motion agrees with that, and else remains unknown and is found
    /// from the motion.
    pub spin: Spin,
    /// The balls' angular velocities that markers show, where there are any.
    pub rotations: Option<Box<Rotations>>,
    unknowns: Unknowns,
    /// What the frames tell of μ_r.
    rolling: Rolling,
    /// Where the spin is unknown and the collision model known, what a joint fit of the frames starts from.
    at_model: Option<crate::likelihood::frames::Own>,
    /// Mean and standard deviation with which the collision model's lift was held.
    lift_held: Option<(f64, f64)>,
    /// Instants of the frames left out as wrong, of the cue ball and of the object ball.
    wrong: [Vec<f64>; 2],
    /// Standard deviation of a coordinate that the residuals show, over what the frames were weighted by.
    scale: f64,
    /// χ² of its frames with the noise that they show.
    chi2: f64,
    /// Noise from second differences, m.
    noise: f64,
}

/// Angular velocities just before and after the impact, of balls with markers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rotations {
    /// The cue ball's angular velocity just before the impact.
    pub cue_before: Option<Rotation>,
    /// The cue ball's angular velocity just after the impact.
    pub cue_after: Option<Rotation>,
    /// The object ball's angular velocity just after the impact.
    pub object_after: Option<Rotation>,
    /// The joint covariance of the three, x, y and z of each, (rad/s)²; 0 for those that were not measured.
    pub covariance: SMatrix<f64, 9, 9>,
    /// How they move with μ_r.
    by_rolling: SVector<f64, 9>,
    /// Their covariance with the [`Quantity`]s of the impact.
    pub with_path: SMatrix<f64, 9, { Quantity::COUNT }>,
}

/// What a shot's frames tell of the cloth's rolling resistance μ_r, with which they were reckoned.
#[derive(Clone, Copy, Debug)]
struct Rolling {
    /// Which was assumed…
    assumed: f64,
    /// …what agrees best with the frames, and 1/variance of that.
    best: f64,
    information: f64,
    /// How the [`Quantity`]s move with it.
    by: SVector<f64, { Quantity::COUNT }>,
}

/// Covariance of the unknowns of a path, how they move with μ_r, and how the [`Quantity`]s follow from them.
struct PathErrors {
    by_rolling: Unknowns,
    unknowns: SMatrix<f64, { unknown::COUNT }, { unknown::COUNT }>,
    quantities: SMatrix<f64, { Quantity::COUNT }, { unknown::COUNT }>,
}

impl Impact {
    /// The cue ball's topspin before the impact over the natural roll's, where it was found from the motion alone.
    #[must_use]
    pub fn roll(&self) -> Option<f64> {
        let roll =
            self.at_model.map_or(self.unknowns[unknown::ROLL], |own| own[crate::likelihood::frames::OWN]);
        (self.spin == Spin::Unknown).then_some(roll)
    }

    /// The motion that was fitted to a shot.
    #[must_use]
    pub fn motion(&self, scene: &Scene) -> Motion<f64> {
        let scene = ShotScene::of(self.spin, scene);
        Motion::new(&scene, &self.unknowns.into())
    }
}

/// Finds the impact of a shot.
///
/// # Errors
/// Why the shot cannot be used.
pub fn extract(shot: &TrackShot, scene: &Scene) -> Result<Impact, Unusable> {
    let noise = noise(shot);
    let guess = initial_guess::guess(shot, scene, noise)?;
    let with_spin = |spin: Spin| {
        let tracked = TrackedBalls::new(shot, BallPaths::new(scene, spin), noise);
        let chosen = window::choose(&tracked, &guess)?;
        tracked.impact(&chosen)
    };
    if shot.markers.is_empty() {
        return match shot.spin {
            Spin::Unknown => spin_from_motion::from_motion(shot, scene, &guess, noise),
            spin => Ok(with_spin(spin)?.0),
        };
    }
    // the motion needs the spin and the exact spin needs the motion
    let (first, errors) = with_spin(marker_spins::rough(shot, &scene.ball, guess[unknown::TIME], noise))?;
    let rotations = marker_spins::measure(shot, &first, &errors, scene);
    let (impact, errors) = with_spin(marker_spins::before(shot, &rotations))?;
    let rotations = marker_spins::measure(shot, &impact, &errors, scene);
    // the spin as it was last measured
    Ok(Impact {
        spin: marker_spins::before(shot, &rotations),
        rotations: Some(Box::new(rotations)),
        ..impact
    })
}

/// Finds the impacts of many shots in parallel; `done` is called after each. However a shot fails, the others go on.
pub fn extract_all(
    shots: &[TrackShot],
    scene: &Scene,
    done: &(dyn Fn() + Sync),
) -> Vec<Result<Impact, Unusable>> {
    let one = |shot| {
        let impact = isolated(|| extract(shot, scene)).unwrap_or_else(|panic| Err(Unusable::Failed(panic)));
        done();
        impact
    };
    shots.par_iter().map(one).collect()
}
