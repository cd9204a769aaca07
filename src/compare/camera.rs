//! One camera for all data sets, where it filmed all of them and was not moved: what one film calls for is then corrected in all, by the
//! same amount.

use super::CompareError;
use super::joint_fit::FitOfAll;
use crate::fit::Prepared;
use crate::fit::settled::Settled;
use crate::likelihood::sample::shared_columns;
use crate::measurement::correction::Correction;
use crate::measurement::number::with_error;

/// Adopts in every film what any of them calls for.
///
/// # Errors
/// A data set without a camera that is calibrated, and films that are not by one camera.
pub(super) fn share(prepared: &mut [Prepared]) -> Result<(), CompareError> {
    let mut adopted: Vec<Correction> = Vec::new();
    let mut first: Option<(String, f64)> = None;
    for own in prepared.iter() {
        let name = &own.dataset.name;
        let camera = own.camera.as_ref().filter(|camera| camera.shots > 0 && !camera.of_discs);
        let camera = camera.ok_or_else(|| CompareError::NoCamera(name.clone()))?;
        let (other, unit) = first.get_or_insert_with(|| (name.clone(), camera.unit));
        if *unit != camera.unit {
            let factor = *unit / camera.unit;
            return Err(CompareError::OtherCamera { first: other.clone(), other: name.clone(), factor });
        }
        adopted.extend(camera.adopted());
    }
    for camera in prepared.iter_mut().filter_map(|own| own.camera.as_mut()) {
        for which in &adopted {
            camera.adopt(*which);
        }
    }
    Ok(())
}

/// A sentence that says what the camera is, where one filmed all.
pub(super) fn sentence(fit: &FitOfAll) -> Option<String> {
    let Settled { search, free, minimum, .. } = &fit.informed.settled;
    let (columns, _) = shared_columns(&search.samples, free.len());
    let (sample, columns) = search.samples.iter().zip(columns).find(|(sample, _)| sample.camera.is_some())?;
    // all are in the same unit
    let unit = fit.groups.iter().find_map(|group| group.camera.as_ref())?.unit;
    let (from, covariance) = (sample.camera?, minimum.covariance()?);
    let of = |(place, column): (usize, usize)| {
        let which = sample.shared_correction(place)?;
        // film over table
        let unit = if which == Correction::Scale { unit } else { 1.0 };
        let (value, error) = (from.get(which) + minimum.x[column], covariance[(column, column)].sqrt());
        let value = with_error(value / unit, error / unit);
        Some(format!("{} {value}", which.words()))
    };
    let all: Vec<String> = columns.into_iter().enumerate().filter_map(of).collect();
    let said = if all.is_empty() { "it needs no correction".to_owned() } else { all.join(", ") };
    Some(format!("One camera filmed all data sets: {said}."))
}
