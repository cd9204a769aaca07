//! Where a function falls through 0, for what costs a step each time it is looked at.

/// It is found to this part of the step.
const LOCATED: f64 = 1e-9;
pub(super) const MOST_TRIALS: usize = 60;

/// Where a function falls through 0 between two ends, and what else it has there: `None` at the end itself. By regula falsi (Illinois);
/// with `about`, a place near the root and the slope there, by secants as long as these stay within what encloses it.
pub(super) fn root<S>(
    [mut low, mut high]: [(f64, f64); 2],
    about: Option<(f64, f64)>,
    length: f64,
    mut f: impl FnMut(f64) -> (f64, S),
) -> (f64, Option<S>) {
    let mut last = (high.0, None);
    let mut next = about.map(|(at, _)| at);
    let mut slope = about.map(|(_, slope)| slope);
    let mut before: Option<(f64, f64)> = None;
    for _ in 0..MOST_TRIALS {
        if high.0 - low.0 <= LOCATED * length || high.1 == 0.0 {
            break;
        }
        let falsi = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        let middle = next.take().unwrap_or(falsi);
        let middle = if middle > low.0 && middle < high.0 { middle } else { 0.5 * (low.0 + high.0) };
        let (value, state) = f(middle);
        let moved = (middle - last.0).abs();
        last = (middle, Some(state));
        if moved <= LOCATED * length {
            break;
        }
        if let Some(known) = &mut slope {
            if let Some((at, other)) = before.replace((middle, value)) {
                *known = (value - other) / (middle - at);
            }
            let newton = middle - value / *known;
            if (newton - middle).abs() <= LOCATED * length {
                break;
            }
            next = Some(newton);
        }
        if value > 0.0 {
            low = (middle, value);
            high.1 *= 0.5;
        } else {
            high = (middle, value);
            low.1 *= 0.5;
        }
    }
    last
}
