//! The grid of a tracker's coordinates, such as whole pixels or few decimals.

use super::raw::{RawTrack, sorted};

/// Least number of different steps between neighbouring coordinates: fewer fit some grid by chance.
const MIN_GAPS: usize = 8;
/// Largest ratio of the smallest step between coordinates to the grid: fast balls skip steps.
const MAX_SKIPPED: usize = 12;
/// Largest deviation of coordinates from the grid, in steps, if they were scaled and printed with
/// few decimals. Eight random coordinates fit one of the grids tried in 12·0.04⁸ = 8e-11 of tracks.
const MAX_DEVIATION: f64 = 0.02;
/// Relative difference below which two coordinates are the same number, computed differently.
const SAME_NUMBER: f64 = 1e-12;

/// Returns the step of the grid on which all coordinates of some tracks lie, in the unit of the
/// file. `None` without a grid, or if too few coordinates differ. Its effect depends on the noise:
/// seven decimals are a grid, too.
pub(super) fn step(tracks: &[&RawTrack]) -> Option<f64> {
    let mut gaps = Vec::new();
    for axis in [0, 1] {
        let mut values = sorted(tracks.iter().flat_map(|track| track.seen()).map(|row| row.place()[axis]));
        values.dedup_by(|later, earlier| *later - *earlier <= SAME_NUMBER * later.abs());
        gaps.extend(values.windows(2).map(|two| two[1] - two[0]));
    }
    if gaps.len() < MIN_GAPS {
        return None;
    }
    gaps.sort_unstable_by(f64::total_cmp);
    let smallest = *gaps.first()?;
    let step = (1..=MAX_SKIPPED).find_map(|parts| fitted(&gaps, smallest / parts as f64))?;
    (step > 0.0 && step.is_finite()).then_some(step)
}

/// Returns the step near `guess` of which all these lengths (ascending) are multiples.
fn fitted(gaps: &[f64], guess: f64) -> Option<f64> {
    // least squares of d = k·step, each length with the step from all shorter ones
    let (mut products, mut squares) = (guess, 1.0);
    for gap in gaps {
        let step: f64 = products / squares;
        let multiple = (gap / step).round();
        if !((gap / step - multiple).abs() <= MAX_DEVIATION && multiple >= 1.0) {
            return None;
        }
        products += multiple * gap;
        squares += multiple * multiple;
    }
    Some(products / squares)
}
