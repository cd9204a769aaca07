//! Which frames around the impact the model is valid for: chosen from the data. A later cushion, a
//! second collision or a body leaving the picture ends it, and so does what came before.

use nalgebra::SVector;

use super::path_fit::{Fitted, HOPELESS, Paths, TIME, Tracked};
use super::unusable::Unusable;

/// The most frames on either side.
pub const MOST: usize = 120;

/// A window grows by this factor.
const GROWTH: f64 = 1.4;

/// A fit is good whose χ²/dof exceeds what is usual by less than this many of its standard deviations √(2/dof)…
const SPREADS: f64 = 5.0;
/// …and this, which the noise estimate's own error allows.
const SLACK: f64 = 0.3;

/// What frames add to χ² may exceed their number by this many standard deviations √2n…
const ADDED: f64 = 4.0;
/// …in so many that follow each other at the end of a window, and wherever it grows: a small collision at the
/// end of a long window would be lost in the rest of it.
const PART: usize = 10;
/// A little that frames already used may be worse off.
const REST: f64 = 4.0;

/// Whether a fit leaves no more than is usual, as χ²/dof, anywhere.
fn good<const N: usize, P: Paths<N>>(tracked: &Tracked<P, N>, fitted: &Fitted<N>, usual: f64) -> bool {
    let spread = (2.0 / fitted.dof.max(1) as f64).sqrt();
    if !(fitted.converged && tracked.misfit(fitted) < usual * (1.0 + SLACK + SPREADS * spread)) {
        return false;
    }
    let residuals = tracked.residuals(fitted);
    let mut ends = residuals.iter().filter_map(|body| body.rchunks(2 * PART).next());
    ends.all(|end| is_likely(squares(end), end.len(), fitted))
}

/// Whether a larger window's fit is as good in its new frames as a smaller one's, for either body.
fn grows<const N: usize, P: Paths<N>>(tracked: &Tracked<P, N>, small: &Fitted<N>, large: &Fitted<N>) -> bool {
    let of_bodies = |fitted| tracked.residuals(fitted).map(|body| (squares(&body), body.len()));
    let mut both = of_bodies(small).into_iter().zip(of_bodies(large));
    both.all(|((old, n), (new, m))| is_likely(new - old - REST, m.saturating_sub(n), small))
}

fn squares(residuals: &[f64]) -> f64 {
    residuals.iter().map(|r| r * r).sum()
}

/// Whether n residuals may have this sum of squares, with noise as a fit shows it.
fn is_likely<const N: usize>(squares: f64, n: usize, fitted: &Fitted<N>) -> bool {
    let n = n as f64;
    squares < fitted.reduced().max(1.0) * (n + ADDED * (2.0 * n).sqrt()) || n == 0.0 && squares <= 0.0
}

/// So many frames before an impact about this time and after it, as a window.
fn window<const N: usize, P: Paths<N>>(
    tracked: &Tracked<P, N>,
    time: f64,
    [before, after]: [usize; 2],
) -> [f64; 2] {
    let reach = |frames: usize| (frames as f64 + 0.5) / tracked.shot.fps;
    [time - reach(before), tracked.paths.settled(time) + reach(after)]
}

/// The fit of all frames, and whether it is good.
pub(crate) fn whole<const N: usize, P: Paths<N>>(
    tracked: &Tracked<P, N>,
    guess: &SVector<f64, N>,
) -> Option<(Fitted<N>, bool)> {
    let time = guess[TIME];
    let fitted = tracked.fit(guess, window(tracked, time, extent(tracked, time))).ok()?;
    let is_good = good(tracked, &fitted, 1.0);
    Some((fitted, is_good))
}

/// The widest window whose fit is good: all of it, or what grows from the impact.
pub(crate) fn choose<const N: usize, P: Paths<N>>(
    tracked: &Tracked<P, N>,
    guess: &SVector<f64, N>,
) -> Result<Fitted<N>, Unusable> {
    match whole(tracked, guess) {
        Some((fitted, true)) => Ok(fitted),
        _ => grown(tracked, guess),
    }
}

/// The widest window whose fit is good and that grows from the impact.
pub(crate) fn grown<const N: usize, P: Paths<N>>(
    tracked: &Tracked<P, N>,
    guess: &SVector<f64, N>,
) -> Result<Fitted<N>, Unusable> {
    let time = guess[TIME];
    let fit = |start: &SVector<f64, N>, sides| tracked.fit(start, window(tracked, time, sides));
    let [ends_before, ends_after] = extent(tracked, time);
    let mut sides = [tracked.paths.first_frames(); 2];
    let mut best = fit(guess, sides)?;
    let misfit = tracked.misfit(&best);
    if let Some(why) = (misfit > HOPELESS).then(|| P::misfits(tracked, &best)).flatten() {
        return Err(why);
    }
    let usual = if P::WOBBLES { misfit.max(1.0) } else { 1.0 };
    // grow one side at a time until its next frames no longer fit
    for (side, end) in [(1, ends_after), (0, ends_before)] {
        while sides[side] < end {
            let mut wider = sides;
            wider[side] = ((sides[side] as f64 * GROWTH) as usize).min(end);
            let Ok(next) = fit(&best.z, wider) else { break };
            if !(good(tracked, &next, usual) && grows(tracked, &best, &next)) {
                break;
            }
            (best, sides) = (next, wider);
        }
    }
    Ok(best)
}

/// Frames that there are on either side, at most [`MOST`].
fn extent<const N: usize, P: Paths<N>>(tracked: &Tracked<P, N>, time: f64) -> [usize; 2] {
    let frame = 1.0 / tracked.shot.fps;
    let all = tracked.shot.cue.iter().chain(&tracked.shot.object);
    let (first, last) = all.fold((time, time), |(first, last), s| (first.min(s.t), last.max(s.t)));
    [time - first, last - tracked.paths.settled(time)]
        .map(|span| ((span / frame).ceil() as usize).clamp(tracked.paths.first_frames(), MOST))
}
