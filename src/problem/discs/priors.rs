//! What is known of the shared unknowns of discs before their frames are seen.

use crate::measurement::dataset::{Dataset, Tracks};
use crate::physics::disc::Discs;
use crate::problem::film::priors::{known, list_camera, list_contact};
use crate::problem::unknowns::{Id, Mode, Unknown};

/// Relative standard deviation of the sum of stated radii: rubber bands and the give of rims included.
const RADII_SD: f64 = 0.01;

/// Relative standard deviation of the ratio of stated masses.
const MASS_SD: f64 = 0.01;

/// Standard deviation of the deceleration at any speed, m/s²: a hundredth of gravity, what pucks on ice
/// or on a poor air table have.
const SLOWING_SD: f64 = 0.1;

/// Standard deviation of the deceleration over the speed, 1/s.
const DRAG_SD: f64 = 1.0;

/// Slowest common frame rate, frames/s: if the rate is unknown, priors are those of this one, so that
/// they are not narrower than of others.
const SLOWEST_RATE: f64 = 30.0;

/// Number of shots that determine a camera, or how a deceleration depends on speed, at least.
pub(super) const LEAST_SHOTS: usize = 3;

/// Returns the unit of time of a film in seconds: a frame if its rate is unknown.
pub(super) fn unit_of_time(discs: &Discs) -> f64 {
    if discs.in_seconds { 1.0 } else { SLOWEST_RATE.recip() }
}

/// Returns every shared unknown in the order of [`Id`]. `guessed`: the median distance of the centres at
/// the impacts, m, and the median mass ratio that momentum gives.
pub(super) fn list_unknowns(
    dataset: &Dataset,
    tracks: &Tracks,
    discs: &Discs,
    [distance, mass_ratio]: [f64; 2],
    (shots, is_one_dimensional): (usize, bool),
) -> Vec<Unknown> {
    let mut all = Unknown::list();
    list_contact(&mut all, &dataset.settings);
    let fixed = [Id::MuS, Id::RadiusRatio];
    for id in fixed {
        all[id as usize].mode = Mode::Fixed;
    }
    match discs.masses {
        Some([first, second]) => known(&mut all, Id::MassRatio, first / second, MASS_SD * first / second),
        None => {
            let unknown = &mut all[Id::MassRatio as usize];
            (unknown.start, unknown.prior, unknown.mode) = (mass_ratio, None, Mode::Free);
        }
    }
    let second = unit_of_time(discs);
    known(&mut all, Id::Slowing, 0.0, SLOWING_SD * second * second);
    // a table slows discs down
    all[Id::Slowing as usize].bounds[0] = 0.0;
    all[Id::Drag as usize].bounds[0] = 0.0;
    // few shots do not tell it from a deceleration at any speed
    if shots >= LEAST_SHOTS {
        known(&mut all, Id::Drag, 0.0, DRAG_SD * second);
    }
    match discs.radii {
        Some([first, second]) => {
            known(&mut all, Id::ContactDistance, first + second, RADII_SD * (first + second));
        }
        None => {
            let unknown = &mut all[Id::ContactDistance as usize];
            unknown.start = distance;
            unknown.mode = if is_one_dimensional { Mode::Fixed } else { Mode::Free };
        }
    }
    list_camera(&mut all, tracks);
    for unknown in &mut all[Id::Scale as usize..=Id::Nearness as usize] {
        let is_shown = match unknown.id {
            _ if is_one_dimensional || shots < LEAST_SHOTS => false,
            Id::Scale => discs.radii.is_some(),
            // a delay means nothing without a unit of time
            Id::ShutterX | Id::ShutterY => discs.in_seconds,
            // discs do not hop
            Id::ParallaxX | Id::ParallaxY | Id::Nearness => false,
            _ => true,
        };
        if !is_shown {
            unknown.mode = Mode::Fixed;
        }
    }
    all
}
