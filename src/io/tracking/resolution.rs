//! The grid that a tracker's coordinates lie on, such as whole pixels or few decimals.

use super::raw::{RawTrack, Row, sorted};

/// A grid needs so many different steps between neighbouring coordinates: fewer fit some grid by chance.
const LEAST_GAPS: usize = 8;

/// The smallest step between neighbouring coordinates is at most so many steps of the grid: balls that move fast skip some.
const MOST_SKIPPED: usize = 12;

/// A coordinate may be off the grid by this part of its step, where it was scaled and then printed with few decimals. Eight
/// random coordinates are all so near to one of the grids that are tried in 12·0.04⁸ = 8e-11 of all tracks.
const OFF: f64 = 0.02;

/// Relative to itself, a coordinate that is nearer to another one is the same, computed otherwise.
const ROUNDING: f64 = 1e-12;

/// The step of the grid on which all coordinates of some tracks lie, in the unit of the file. `None` where there is none, or too few
/// coordinates differ to tell. Whether it matters is for whoever knows the noise to say: seven decimals are a grid, too.
pub(super) fn step(tracks: &[&RawTrack]) -> Option<f64> {
    let mut gaps = Vec::new();
    for pick in [|row: &Row| row.x, |row: &Row| row.y] {
        let mut values = sorted(tracks.iter().flat_map(|track| track.seen()).map(pick));
        values.dedup_by(|later, earlier| *later - *earlier <= ROUNDING * later.abs());
        gaps.extend(values.windows(2).map(|two| two[1] - two[0]));
    }
    if gaps.len() < LEAST_GAPS {
        return None;
    }
    gaps.sort_unstable_by(f64::total_cmp);
    let smallest = *gaps.first()?;
    let found = (1..=MOST_SKIPPED).find_map(|parts| fitted(&gaps, smallest / parts as f64))?;
    (found > 0.0 && found.is_finite()).then_some(found)
}

/// The step near `guess` of which all these lengths (ascending) are multiples, if there is one.
fn fitted(gaps: &[f64], guess: f64) -> Option<f64> {
    // least squares of d = k·step, a longer length with what all shorter ones say
    let (mut products, mut squares) = (guess, 1.0);
    for gap in gaps {
        let step: f64 = products / squares;
        let multiple = (gap / step).round();
        if !((gap / step - multiple).abs() <= OFF && multiple >= 1.0) {
            return None;
        }
        products += multiple * gap;
        squares += multiple * multiple;
    }
    Some(products / squares)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A ball that moves 3.7 mm and 1.3 mm a frame, with a tenth of a millimetre of something like noise.
    fn found(written: impl Fn(f64) -> f64) -> Option<f64> {
        let mut track = RawTrack::new("a", None);
        for i in 0..60 {
            let t = i as f64;
            let wobble = 1e-4 * (12.9898 * t).sin();
            let place = [0.2 + 0.0037 * t + wobble, 0.5 - 0.0013 * t - wobble].map(&written);
            track.rows.push(Row::new(t, place, i + 1));
        }
        step(&[&track])
    }

    fn decimals(x: f64) -> f64 {
        format!("{x:.7}").parse().unwrap()
    }

    #[test]
    fn the_step_of_a_grid_is_found_whatever_it_was_scaled_by() {
        for grid in [1e-4, 3.4e-4, 5e-4, 1e-3, 3e-3] {
            let found = found(|x| decimals((x / grid).round() * grid)).unwrap();
            assert!((found / grid - 1.0).abs() < 1e-3, "{grid}: {found}");
        }
        assert!((found(|x| (x / 3.4e-4).round()).unwrap() - 1.0).abs() < 1e-9);
        // continuous ones have none but their decimals, nor has a ball that lies, nor one that is never seen
        assert!(found(decimals).is_none_or(|step| step < 1.1e-7));
        assert_eq!([found(|x| x), found(|_| 0.3), found(|_| f64::NAN)], [None; 3]);
    }
}
