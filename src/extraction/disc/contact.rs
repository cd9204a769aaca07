//! Frames in which the discs still touch: in a contact that lasts for several frames they are neither on the paths before it nor on those
//! after it.

use super::paths::{FittedDiscs, TrackedDiscs};
use super::unknowns::{TIME, Unknowns};
use crate::extraction::unusable::Unusable;
use crate::extraction::window;

/// The longest contact that is left out, frames on either side of the instant of impact.
const MOST: usize = 6;

/// The frames next to the impact, or to what was left out, that are tested on either side.
const TESTED: f64 = 2.0;

/// The sum of n squared residuals may exceed n by this many of its standard deviations √(2n), as where a window grows.
const EXCESS: f64 = 4.0;

/// Fits both discs without the frames about the impact that neither path describes; returns how many those are on either side.
///
/// # Errors
/// Why no fit describes the shot.
pub(super) fn fit<'a>(
    tracked: impl Fn(usize, f64) -> TrackedDiscs<'a>,
    guess: &Unknowns,
    parts: bool,
) -> Result<(TrackedDiscs<'a>, FittedDiscs, usize), Unusable> {
    let mut time = guess[TIME];
    let mut best = None;
    let mut why = None;
    for touching in 0..=if parts { MOST } else { 0 } {
        let tracked = tracked(touching, time);
        let fitted = match window::choose(&tracked, guess) {
            Ok(fitted) => fitted,
            Err(error) => {
                why = why.or(Some(error));
                continue;
            }
        };
        if fitted.converged {
            time = fitted.time();
            if !parts || is_described(&tracked, &fitted, touching) {
                return Ok((tracked, fitted, touching));
            }
        }
        best = best.or(Some((tracked, fitted, touching)));
    }
    best.ok_or_else(|| why.unwrap_or_else(|| Unusable::NotConverged(String::new())))
}

/// Whether the frames next to the impact are as near to the paths as others.
fn is_described(tracked: &TrackedDiscs, fitted: &FittedDiscs, touching: usize) -> bool {
    let reach = (touching as f64 + TESTED) / tracked.shot.fps;
    let frames = tracked.frames(fitted);
    let (mut sum, mut count) = (0.0, 0.0);
    for (frames, residuals) in frames.of.iter().zip(tracked.residuals(fitted)) {
        for (frame, of_frame) in frames.iter().zip(residuals.chunks(2)) {
            if (frame.sample.t - fitted.time()).abs() <= reach {
                sum += of_frame.iter().map(|r| r * r).sum::<f64>();
                count += of_frame.len() as f64;
            }
        }
    }
    sum <= fitted.reduced().max(1.0) * (count + EXCESS * f64::sqrt(2.0 * count))
}
