//! Which frames around the impact the model is valid for: chosen from the data. A later cushion, a
//! second collision or a ball leaving the picture ends it, and so does what came before.

use super::Unusable;
use super::fit::{Fitted, Tracked};
use super::model::{Unknowns, unknown};

/// The most frames on either side.
const MOST: usize = 120;

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

fn good(fitted: &Fitted) -> bool {
    let spread = (2.0 / fitted.dof.max(1) as f64).sqrt();
    fitted.converged && fitted.reduced() < 1.0 + SLACK + SPREADS * spread
}

/// The widest window whose fit is good: all of it, or what grows from the impact.
pub(super) fn choose(tracked: &Tracked, guess: &Unknowns) -> Result<Fitted, Unusable> {
    let frame = 1.0 / tracked.shot.fps;
    let time = guess[unknown::TIME];
    let reach = |frames: usize| (frames as f64 + 0.5) * frame;
    let fit = |start: &Unknowns, before: usize, after: usize| {
        tracked.fit(start, time - reach(before), time + reach(after))
    };
    let [ends_before, ends_after] = extent(tracked, time, frame);
    if let Ok(whole) = fit(guess, ends_before, ends_after)
        && good(&whole)
    {
        return Ok(whole);
    }
    let first = fit(guess, FIRST, FIRST)?;
    if first.reduced() > HOPELESS {
        return Err(Unusable::BadFit { reduced_chi2: first.reduced() });
    }
    // grow one side at a time until its next frames no longer fit
    let mut best = first;
    let mut sides = [FIRST, FIRST];
    for (side, end) in [(1, ends_after), (0, ends_before)] {
        while sides[side] < end {
            let mut wider = sides;
            wider[side] = ((sides[side] as f64 * GROWTH) as usize).min(end);
            let Ok(next) = fit(&best.z, wider[0], wider[1]) else { break };
            if !good(&next) {
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
