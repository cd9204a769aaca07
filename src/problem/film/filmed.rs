//! Films of balls as data.

use std::sync::Arc;

use super::camera::Point;
use super::impact::{Contact, Correction};
use super::marker_rotation::MarkerTrack;
use super::own::SCATTERED;
use super::spins::{ShotSpin, Through};
use crate::problem::frames::Frame;
use crate::problem::loss::ShotLoss;
use crate::problem::sums::Variation;
use crate::problem::unknowns::{Own, Shared};

/// A shot as it was filmed.
#[derive(Clone, Debug)]
pub(crate) struct FilmedShot {
    /// The frames of the cue ball and of the object ball.
    pub(crate) tracks: Arc<[Vec<Frame>; 2]>,
    /// Points on the balls.
    pub(crate) markers: Arc<Vec<MarkerTrack>>,
    /// Frames per second.
    pub(crate) fps: f64,
    /// Side spins of the balls just after the impact that markers show.
    pub(crate) side_spins: Vec<SideSpin>,
    pub(crate) spin: ShotSpin,
    /// The correction of the outcome by a finer model of the impact; `None`: there is none.
    pub(crate) correction: Option<Arc<Correction>>,
}

/// Sets the directions of two balls of this radius from each other in their frames.
pub(super) fn set_apart([cue, object]: &mut [Vec<Frame>; 2], fps: f64, radius: f64) {
    /// Distance in radii beyond which less than a hundredth of the length is left.
    const MAX_RADII: f64 = 7.0;
    let half = 0.5 / fps;
    let apart = |frame: &Frame, others: &[Frame]| {
        let place = others.partition_point(|other| other.time < frame.time - half);
        let same = others.get(place).filter(|other| other.time < frame.time + half);
        let between = same.map_or(Point::zeros(), |other| frame.seen - other.seen);
        let distance = between.norm();
        // a ball that is not seen has no distance
        if !(distance > 0.0 && distance < MAX_RADII * radius) {
            return Point::zeros();
        }
        // e^(2 − d/R)
        between * ((2.0 - distance / radius).exp() / distance)
    };
    for frame in &mut *cue {
        frame.apart = apart(frame, object);
    }
    for frame in object {
        frame.apart = apart(frame, cue);
    }
}

/// The side spin of a ball just after the impact. Spins about horizontal axes change unevenly: the
/// cloth does not touch a ball that hops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SideSpin {
    /// 0 for the cue ball, 1 for the object ball.
    pub(crate) ball: usize,
    /// rad/s.
    pub(crate) spin: f64,
    /// Its standard error, rad/s.
    pub(crate) sd: f64,
    /// The camera that shows it.
    pub(crate) through: Through,
}

/// Frames of balls.
#[derive(Clone)]
pub(crate) struct FilmBlock {
    pub(crate) shots: Arc<Vec<FilmedShot>>,
    /// The noise of each ball; the spreads of topspin, side spin, and what else scatters.
    pub(crate) variation: Variation,
    pub(crate) contact: Contact,
    /// Which of [`SCATTERED`] differ from shot to shot.
    pub(crate) scatters: [bool; SCATTERED.len()],
    /// How outlying shots count; `None`: by least squares.
    pub(crate) loss: Option<ShotLoss>,
}

/// A shot at values of its own unknowns and of the shared ones.
#[derive(Clone, Copy)]
pub(crate) struct ShotAt<'a> {
    pub(crate) film: &'a FilmBlock,
    pub(crate) shot: &'a FilmedShot,
    pub(crate) own: &'a Own,
    pub(crate) shared: &'a Shared,
}
