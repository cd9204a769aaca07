//! Which frames around the impact the model is valid for: chosen from the data. A later cushion, a
//! second collision or a ball leaving the picture ends it, and so does what came before.

use super::Unusable;
use super::window_fit::{Fitted, Tracked};
use crate::trajectory::unknowns::{Unknowns, unknown};

/// The most frames on either side.
pub const MOST: usize = 120;

/// The fewest: below this the next ones are taken unseen.
const FIRST: usize = 8;

/// A window grows by this factor.
const GROWTH: f64 = 1.4;

/// A fit is good whose χ²/dof exceeds 1 by less than this many of its standard deviations √(2/dof)…
const SPREADS: f64 = 5.0;
/// …and this, which the noise estimate's own error allows.
const SLACK: f64 = 0.3;

/// Even next to the impact, χ²/dof above this is no collision of two balls on a cloth.
const HOPELESS: f64 = 10.0;

/// What frames add to χ² may exceed their number by this many standard deviations √2n…
const ADDED: f64 = 4.0;
/// …in so many that follow each other at the end of a window, and wherever it grows: a small collision at the
/// end of a long window would be lost in the rest of it.
const PART: usize = 10;
/// A little that frames already used may be worse off.
const REST: f64 = 4.0;

fn good(tracked: &Tracked, fitted: &Fitted) -> bool {
    let spread = (2.0 / fitted.dof.max(1) as f64).sqrt();
    if !(fitted.converged && tracked.misfit(fitted) < 1.0 + SLACK + SPREADS * spread) {
        return false;
    }
    let frames = tracked.frames(fitted);
    let residuals = frames.residuals_only(&tracked.model, &fitted.z);
    let (cue, object) = residuals.as_slice().split_at(2 * frames.cue.len());
    let mut ends = [cue, object].into_iter().filter_map(|ball| ball.rchunks(2 * PART).next());
    ends.all(|end| is_likely(squares(end), end.len(), fitted))
}

/// Whether a larger window's fit is as good in its new frames as a smaller one's, for either ball.
fn grows(tracked: &Tracked, small: &Fitted, large: &Fitted) -> bool {
    let of_balls = |fitted: &Fitted| {
        let frames = tracked.frames(fitted);
        let residuals = frames.residuals_only(&tracked.model, &fitted.z);
        let (cue, object) = residuals.as_slice().split_at(2 * frames.cue.len());
        [cue, object].map(|ball| (squares(ball), ball.len()))
    };
    let mut both = of_balls(small).into_iter().zip(of_balls(large));
    both.all(|((old, n), (new, m))| is_likely(new - old - REST, m.saturating_sub(n), small))
}

fn squares(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// Whether n residuals may have this sum of squares, with noise as a fit shows it.
fn is_likely(squares: f64, n: usize, fitted: &Fitted) -> bool {
    let n = n as f64;
    squares < fitted.reduced().max(1.0) * (n + ADDED * (2.0 * n).sqrt()) || n == 0.0 && squares <= 0.0
}

/// The fit of all frames, and whether it is good.
pub(crate) fn whole(tracked: &Tracked, guess: &Unknowns) -> Option<(Fitted, bool)> {
    let frame = 1.0 / tracked.shot.fps;
    let time = guess[unknown::TIME];
    let [from, to] = extent(tracked, time, frame).map(|frames| reach(frames, frame));
    let fitted = tracked.fit(guess, [time - from, time + to]).ok()?;
    let is_good = good(tracked, &fitted);
    Some((fitted, is_good))
}

/// How far so many frames reach from the impact, s.
fn reach(frames: usize, frame: f64) -> f64 {
    (frames as f64 + 0.5) * frame
}

/// The widest window whose fit is good: all of it, or what grows from the impact.
pub(crate) fn choose(tracked: &Tracked, guess: &Unknowns) -> Result<Fitted, Unusable> {
    match whole(tracked, guess) {
        Some((fitted, true)) => Ok(fitted),
        _ => grown(tracked, guess),
    }
}

/// The widest window whose fit is good and that grows from the impact.
pub(crate) fn grown(tracked: &Tracked, guess: &Unknowns) -> Result<Fitted, Unusable> {
    let frame = 1.0 / tracked.shot.fps;
    let time = guess[unknown::TIME];
    let fit = |start: &Unknowns, before: usize, after: usize| {
        tracked.fit(start, [time - reach(before, frame), time + reach(after, frame)])
    };
    let [ends_before, ends_after] = extent(tracked, time, frame);
    let first = fit(guess, FIRST, FIRST)?;
    let misfit = tracked.misfit(&first);
    if misfit > HOPELESS {
        return Err(match tracked.separation(&first) {
            Some((wrong, reduced)) if reduced * misfit / first.reduced() < HOPELESS => wrong,
            _ => Unusable::BadFit { reduced_chi2: misfit },
        });
    }
    // grow one side at a time until its next frames no longer fit
    let mut best = first;
    let mut sides = [FIRST, FIRST];
    for (side, end) in [(1, ends_after), (0, ends_before)] {
        while sides[side] < end {
            let mut wider = sides;
            wider[side] = ((sides[side] as f64 * GROWTH) as usize).min(end);
            let Ok(next) = fit(&best.z, wider[0], wider[1]) else { break };
            if !(good(tracked, &next) && grows(tracked, &best, &next)) {
                break;
            }
            (best, sides) = (next, wider);
        }
    }
    Ok(best)
}

/// Frames that there are on either side, at most [`MOST`].
fn extent(tracked: &Tracked, time: f64, frame: f64) -> [usize; 2] {
    let all = tracked.shot.cue.iter().chain(&tracked.shot.object);
    let (first, last) = all.fold((time, time), |(first, last), s| (first.min(s.t), last.max(s.t)));
    [time - first, last - time].map(|span| ((span / frame).ceil() as usize).clamp(FIRST, MOST))
}
