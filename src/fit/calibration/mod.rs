//! Films of discs, which calibrate their camera without a model of their collision.

mod adopted;
mod discs;

use super::camera::FoundCamera;
use crate::film::drops;
use crate::measurement::dataset::Dataset;

/// A correction is called for where −2 log L falls by as much with it, as for effects of an impact.
const CALLED_FOR: f64 = 6.0;

/// Corrects footage of discs for its camera, as far as the shots call for it. Any other data set is returned as it is.
pub(super) fn calibrated_discs(mut dataset: Dataset) -> (Dataset, Option<FoundCamera>) {
    let Some((tracks, facts)) = dataset.tracks.as_mut().and_then(|tracks| {
        let facts = tracks.discs?;
        Some((tracks, facts))
    }) else {
        return (dataset, None);
    };
    let drops: Vec<usize> = tracks.shots.iter_mut().map(drops::repair).filter(|count| *count > 0).collect();
    let dropped =
        FoundCamera { drops: [drops.len(), drops.iter().sum()], of_discs: true, ..FoundCamera::as_it_is() };
    tracks.notes.extend(dropped.sentences());
    let Some((found, shots)) = discs::Search::new(tracks, facts).map(discs::Search::best) else {
        return (dataset, None);
    };
    tracks.shots = shots;
    tracks.notes.extend(found.sentences());
    (dataset, Some(found))
}
