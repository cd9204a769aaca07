//! A scan: the local minima of an objective on a grid, where local searches begin.
use rayon::prelude::*;

/// Share of a value below which a difference is rounding: the objective is constant between such
/// points.
const FLAT: f64 = 1e-9;

/// Returns the local minima of an objective on the grid of some axes, the least first. An axis
/// holds the ascending values of one scanned unknown. `least` minimises over all other unknowns and
/// returns a point and the objective there, or `None` if the objective has no value. Only the first
/// point of a flat part on each axis counts, so that a saturated objective gives its edge.
pub fn scan<S: Send>(axes: &[Vec<f64>], least: impl Fn(&[f64]) -> Option<(S, f64)> + Sync) -> Vec<(S, f64)> {
    let count = axes.iter().map(Vec::len).product();
    let evaluate = |number: usize| {
        let places = places(axes, number);
        let values: Vec<f64> = axes.iter().zip(places).map(|(axis, place)| axis[place]).collect();
        least(&values).filter(|(_, value)| value.is_finite())
    };
    let mut points: Vec<Option<(S, f64)>> = (0..count).into_par_iter().map(evaluate).collect();
    let value = |number: usize| points[number].as_ref().map_or(f64::INFINITY, |(_, value)| *value);
    let is_minimum = |number: &usize| {
        let here = value(*number);
        let margin = FLAT * here.abs();
        let mut stride = count;
        here.is_finite()
            && axes.iter().zip(places(axes, *number)).all(|(axis, place)| {
                stride /= axis.len();
                let decreases_before = place == 0 || value(number - stride) > here + margin;
                let increases_after = place + 1 == axis.len() || value(number + stride) >= here - margin;
                decreases_before && increases_after
            })
    };
    let minima: Vec<usize> = (0..count).filter(is_minimum).collect();
    let mut found: Vec<(S, f64)> = minima.into_iter().filter_map(|number| points[number].take()).collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    found
}

/// Returns the place on each axis of a point of the grid, the last axis running fastest.
fn places(axes: &[Vec<f64>], mut number: usize) -> Vec<usize> {
    let mut places = vec![0; axes.len()];
    for (place, axis) in places.iter_mut().zip(axes).rev() {
        *place = number % axis.len();
        number /= axis.len();
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(count: usize) -> Vec<f64> {
        (0..count).map(|i| i as f64).collect()
    }

    #[test]
    fn all_local_minima_are_found_the_least_first() {
        // minima at 2 (value 1) and 7 (value 0)
        let of = |x: f64| if x < 5.0 { 1.0 + (x - 2.0).powi(2) } else { (x - 7.0).powi(2) };
        let found = scan(&[axis(10)], |x| Some((x[0], of(x[0]))));
        assert_eq!(found, [(7.0, 0.0), (2.0, 1.0)]);
    }

    #[test]
    fn a_flat_part_counts_at_its_edge() {
        let found = scan(&[axis(10)], |x| Some((x[0], (5.0 - x[0]).max(0.0))));
        assert_eq!(found, [(5.0, 0.0)]);
    }

    #[test]
    fn two_axes_and_points_without_a_value() {
        let of = |x: &[f64]| {
            let value = (x[0] - 1.0).powi(2) + (x[1] - 3.0).powi(2);
            (x[0] < 4.0).then(|| (x.to_vec(), value))
        };
        assert_eq!(scan(&[axis(6), axis(5)], of), [(vec![1.0, 3.0], 0.0)]);
        assert!(scan(&[axis(3)], |_| None::<((), f64)>).is_empty());
    }
}
