//! Lengths of films in m.

use crate::extraction::{Unusable, extract_all};
use crate::measurement::track::TrackShot;
use crate::numerics::median;
use crate::trajectory::scene::Scene;

/// A film with all lengths multiplied by the unit that they are in, m.
pub(super) fn in_metres(film: &TrackShot, unit: f64) -> TrackShot {
    let mut shot = film.clone();
    if unit == 1.0 {
        return shot;
    }
    for sample in shot.samples_mut() {
        (sample.x, sample.y) = (sample.x * unit, sample.y * unit);
        sample.sd = sample.sd.map(|sd| sd.map(|sd| sd * unit));
    }
    shot.resolution = shot.resolution.map(|step| step * unit);
    shot
}

/// The unit of films, m, where straight lines near the contacts gave a first one: fits of the whole paths tell the distance of the
/// centres at the contact far better, while lines miss how the paths bend between slow frames. Only contacts that are seen not to be at
/// 2R tell anything.
pub(super) fn finer_unit(films: &[TrackShot], first: f64, scene: &Scene) -> f64 {
    const ROUNDS: usize = 3;
    /// So many shots, spread evenly, tell it well enough: the search for the camera goes on from there.
    const SHOTS: usize = 16;
    /// Of these: fewer that are not at 2R are those that something else is wrong with.
    const FEW: f64 = 0.2;
    /// Where the unit changes by less than this part, the next round would only repeat it.
    const SAME: f64 = 0.02;
    let some: Vec<&TrackShot> = films.iter().step_by(films.len().div_ceil(SHOTS).max(1)).collect();
    let mut unit = first;
    for _ in 0..ROUNDS {
        let shots: Vec<TrackShot> = some.iter().map(|film| in_metres(film, unit)).collect();
        let off = extract_all(&shots, scene, &|| ()).into_iter().filter_map(|impact| match impact {
            Err(Unusable::Separation { measured, expected, .. }) => Some(expected / measured),
            _ => None,
        });
        let ratios: Vec<f64> = off.filter(|ratio| ratio.is_finite() && *ratio > 0.0).collect();
        if ratios.len() as f64 <= FEW * some.len() as f64 {
            break;
        }
        let finer = median(ratios);
        unit *= finer;
        if (finer - 1.0).abs() < SAME {
            break;
        }
    }
    unit
}
