//! The least of a function of one number that costs a fit each: bracketed, then by parabolas through three points.

/// Where it is least.
#[derive(Clone, Copy, Debug)]
pub(super) struct Profile {
    pub at: f64,
    pub lowest: f64,
    /// Where it rises by 1, from the curvature.
    pub error: f64,
}

/// So many points at most: to bracket the minimum, and then to find it.
const MOST: usize = 16;

/// A minimum is found where the next step would be this part of its error…
const AT_REST: f64 = 0.1;
/// …and the points that its curvature is taken from lie within so many errors.
const NEAR: f64 = 3.0;

/// An end that is this many times as far away as the other is drawn nearer.
const LOPSIDED: f64 = 9.0;

/// By how much each step is longer than the one before until the function rises.
const FURTHER: f64 = 2.5;

type Point = (f64, f64);

/// Looked for from `start` with a first step of `step`; `None` where there is none inside the range in which the function has
/// values.
pub(super) fn least(f: impl Fn(f64) -> Option<f64>, start: f64, step: f64) -> Option<Profile> {
    let value = |at: f64| (at, f(at).filter(|value| value.is_finite()).unwrap_or(f64::INFINITY));
    let mut between = bracket(value, start, step)?;
    for _ in 0..MOST {
        let [low, best, high] = between;
        let smooth = low.1.is_finite() && high.1.is_finite();
        let curvature = if smooth { curvature(low, best, high) } else { 0.0 };
        let error = if curvature > 0.0 { curvature.sqrt().recip() } else { f64::INFINITY };
        let [below, above] = [best.0 - low.0, high.0 - best.0];
        let [nearer, farther] = [below.min(above), below.max(above)];
        // the lowest point of the parabola
        let parabola = 0.5 * (low.0 + best.0) - 0.5 * (best.1 - low.1) / below / curvature;
        let mut at = if curvature > 0.0 && farther > LOPSIDED * nearer {
            // steps from one side only creep towards the minimum: the other end is drawn nearer
            let step = (LOPSIDED.sqrt() * nearer).max(AT_REST * error).min(0.5 * farther);
            if below > above { best.0 - step } else { best.0 + step }
        } else if curvature > 0.0 {
            parabola
        } else if below > above {
            best.0 - 0.5 * below
        } else {
            best.0 + 0.5 * above
        };
        let near = curvature > 0.0 && farther < NEAR * error;
        let is_there = curvature > 0.0 && (parabola - best.0).abs() < AT_REST * error;
        if near && is_there {
            let lowest = best.1 - curvature * (parabola - best.0).powi(2);
            return Some(Profile { at: parabola, lowest, error });
        }
        if !near && is_there {
            // the minimum is there; its curvature is seen from nearer
            at =
                if below > above { best.0 - error.min(0.5 * below) } else { best.0 + error.min(0.5 * above) };
        }
        let new = value(at);
        between = match (new.0 < best.0, new.1 < best.1) {
            (true, true) => [low, new, best],
            (true, false) => [new, best, high],
            (false, true) => [best, new, high],
            (false, false) => [low, best, new],
        };
    }
    None
}

/// Three points, the middle one the lowest.
fn bracket(value: impl Fn(f64) -> Point, start: f64, step: f64) -> Option<[Point; 3]> {
    let [mut low, mut middle, mut high] = [start - step, start, start + step].map(&value);
    let mut step = step;
    for _ in 0..MOST {
        if middle.1 <= low.1 && middle.1 <= high.1 {
            return middle.1.is_finite().then_some([low, middle, high]);
        }
        step *= FURTHER;
        if low.1 < high.1 {
            (low, middle, high) = (value(low.0 - step), low, middle);
        } else {
            (low, middle, high) = (middle, high, value(high.0 + step));
        }
    }
    None
}

/// Half the second derivative of the parabola through three points.
fn curvature(a: Point, b: Point, c: Point) -> f64 {
    let slope = |p: Point, q: Point| (q.1 - p.1) / (q.0 - p.0);
    (slope(a, c) - slope(a, b)) / (c.0 - b.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_found_with_its_width() {
        let found = least(|x| Some(3.0 + ((x - 0.7) / 0.01).powi(2)), 0.0, 0.02).unwrap();
        assert!((found.at - 0.7).abs() < 1e-9 && (found.error - 0.01).abs() < 1e-9, "{found:?}");
        assert!((found.lowest - 3.0).abs() < 1e-6);
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let f = |x: f64| (x - 1.0).powi(2) * 1e4 + (x - 1.0).powi(4) * 1e5;
        let found = least(|x| Some(f(x)), 0.0, 0.02).unwrap();
        assert!((found.at - 1.0).abs() < 1e-3 && (found.error - 0.01).abs() < 1e-3, "{found:?}");
    }

    /// As χ² that falls to the fourth power of an error from one side: its minimum is 1000 errors from where it begins.
    #[test]
    fn a_steep_side_does_not_hold_it_up() {
        let f = |x: f64| {
            if x < 1.0 { (x - 1.0).powi(2) * 1e8 } else { (x - 1.0).powi(2) * 1e6 + (x - 1.0).powi(4) * 1e10 }
        };
        let found = least(|x| Some(f(x)), 0.98, 0.02).unwrap();
        assert!((found.at - 1.0).abs() < 1e-3 && found.lowest < 1.0, "{found:?}");
    }

    #[test]
    fn what_is_flat_has_no_minimum() {
        assert!(least(|_| Some(1.0), 0.0, 0.1).is_none());
        assert!(least(|_| None, 0.0, 0.1).is_none());
    }
}
