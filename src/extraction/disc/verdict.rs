//! What speaks against the numbers of a shot: what must hold of any two rigid discs that collide, whatever the friction.

use super::{DiscImpact, Quantity};
use crate::extraction::unusable::{Bodies, Unusable};
use crate::film::discs::DISCS;
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::median;

/// So many standard errors are no chance.
const SURELY: f64 = 5.0;

/// A camera's calibration makes velocities wrong by this part of themselves: the distances between points on one puck, which cannot
/// change, differ by so much along its way in good laboratory films (data/pucks-qualisys).
const CALIBRATION: f64 = 0.005;

/// Residuals five times as large as the noise, χ²/dof of 25, are not those of straight paths that meet at one instant.
const BENT: f64 = 25.0;

/// An error of e that is larger leaves no more than a quarter of its range, 0 to 1, on either side.
const UNDETERMINED: f64 = 0.25;

/// Points whose distance changes by more than this part are not on one rigid body: ten times what the camera's calibration does…
const NOT_RIGID: f64 = 0.05;
/// …and from here on something is wrong, a marker that slipped or was mistaken for a while.
const HARDLY_RIGID: f64 = 0.03;
/// So many frames on either side of the impact are looked at.
const NEAR: f64 = 60.0;
/// Of the distances this part at either end is not counted, for frames in which a point was mistaken.
const TAIL: f64 = 0.1;
/// Fewer frames with both points say nothing.
const LEAST: usize = 8;

/// The same discs are as far apart at every contact, but for this part that a camera's scale may change over the table.
const DISTANCE: f64 = 0.01;
/// So many shots tell which distance is the odd one.
const SHOTS: usize = 3;

/// Adds what speaks against a shot.
pub(super) fn judge(impact: &mut DiscImpact) {
    let doubts = [momentum(impact), paths(impact), restitution(impact)];
    impact.doubts.extend(doubts.into_iter().flatten());
}

/// Momentum gained along and across the line of centres, over the normal impulse: value, stated error, the error that the camera's
/// calibration adds, and which way.
fn gained(impact: &DiscImpact) -> Option<Vec<(f64, f64, f64, &'static str)>> {
    let value = |quantity: Quantity| impact.get(quantity).map(|measured| measured.value);
    let square = |[x, y]: [Quantity; 2]| Some(value(x)?.powi(2) + value(y)?.powi(2));
    let first = square([Quantity::FirstVxBefore, Quantity::FirstVyBefore])?
        + square([Quantity::FirstVxAfter, Quantity::FirstVyAfter])?;
    let second = square([Quantity::SecondVxBefore, Quantity::SecondVyBefore])?
        + square([Quantity::SecondVxAfter, Quantity::SecondVyAfter])?;
    let change = (value(Quantity::FirstVxAfter)? - value(Quantity::FirstVxBefore)?)
        * value(Quantity::NormalX)?
        + (value(Quantity::FirstVyAfter)? - value(Quantity::FirstVyBefore)?) * value(Quantity::NormalY)?;
    let ratio = value(Quantity::MassRatio)?;
    let calibration = CALIBRATION * (first + ratio * ratio * second).sqrt() / change.abs();
    let sides = [(Quantity::MomentumAlong, "along"), (Quantity::MomentumAcross, "across")];
    let gained = sides.into_iter().filter_map(|(quantity, side)| {
        let gained = impact.get(quantity)?;
        Some((gained.value, gained.sd?, calibration, side))
    });
    Some(gained.collect())
}

/// Whether momentum is out of balance by more than its stated errors explain, though the shot is not doubtful for it.
pub(super) fn is_out_of_balance(impact: &DiscImpact) -> bool {
    let sides = gained(impact).unwrap_or_default();
    momentum(impact).is_none() && sides.iter().any(|(gained, sd, ..)| gained.abs() > SURELY * sd)
}

/// Momentum that is out of balance beyond its errors and half a percent of every velocity.
fn momentum(impact: &DiscImpact) -> Option<String> {
    let sides = gained(impact)?
        .into_iter()
        .map(|(gained, sd, calibration, side)| (gained, sd.hypot(calibration), side));
    let (gained, error, side) = sides.max_by(|a, b| (a.0.abs() / a.1).total_cmp(&(b.0.abs() / b.1)))?;
    (gained.abs() > SURELY * error).then(|| {
        format!(
            "its momentum is not conserved: {side} the line of centres both discs together {} {:.1} ± {:.1} % of the impulse (the \
             error includes half a percent of every velocity); the masses, the scale or the frames are wrong, or something else \
             pushed a disc",
            if gained < 0.0 { "lose" } else { "gain" },
            100.0 * gained.abs(),
            100.0 * error
        )
    })
}

fn paths(impact: &DiscImpact) -> Option<String> {
    (impact.reduced_chi2 > BENT).then(|| {
        format!(
            "its paths are not straight before and after one instant: they are off by {:.0} times the noise of the frames (χ²/dof is \
             {:.0}); the contact lasts for several frames, or points were mistaken",
            impact.reduced_chi2.sqrt(),
            impact.reduced_chi2
        )
    })
}

/// e is not that of an impact, or not determined at all.
fn restitution(impact: &DiscImpact) -> Option<String> {
    let e = impact.get(Quantity::Restitution)?;
    let sd = e.sd?;
    if sd > UNDETERMINED {
        return Some(format!(
            "its e of {:.1} ± {:.1} is not determined: the discs hardly come nearer before the impact, or it is none",
            e.value, sd
        ));
    }
    (e.value - 1.0 > SURELY * sd || -e.value > SURELY * sd).then(|| {
        format!(
            "its e of {:.3} ± {:.3} is not between 0 and 1, as that of any passive impact is",
            e.value, sd
        )
    })
}

/// Whether the points of either disc move as one rigid body, near the impact or else in all frames.
///
/// # Errors
/// They do not.
pub(crate) fn rigidity(shot: &TrackShot, impact: Option<f64>) -> Result<Option<String>, Unusable> {
    let reach = NEAR / shot.fps;
    let [from, to] = impact.map_or([f64::NEG_INFINITY, f64::INFINITY], |time| [time - reach, time + reach]);
    let mut doubt = None;
    for (ball, disc) in DISCS.into_iter().zip(Bodies::Discs.names()) {
        let own: Vec<_> = shot.markers.iter().filter(|marker| marker.ball == ball).collect();
        let pairs = own.iter().enumerate().flat_map(|(i, a)| own[i + 1..].iter().map(move |b| (a, b)));
        let worst = pairs
            .filter_map(|(a, b)| {
                let [least, most] = extent(&a.samples, &b.samples, [from, to])?;
                Some((2.0 * (most - least) / (most + least), [least, most], a, b))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((change, [least, most], a, b)) = worst else { continue };
        if change > NOT_RIGID {
            return Err(Unusable::NotRigid {
                disc,
                first: a.name.clone(),
                second: b.name.clone(),
                least_mm: 1e3 * least,
                most_mm: 1e3 * most,
            });
        }
        if change > HARDLY_RIGID {
            doubt = Some(format!(
                "the points \"{}\" and \"{}\" on the {disc} are {:.1} to {:.1} mm apart near the impact, though they should \
                 move as one rigid body",
                a.name,
                b.name,
                1e3 * least,
                1e3 * most
            ));
        }
    }
    Ok(doubt)
}

/// The least and the largest distance of two points in the frames that have both, without the tails.
fn extent(a: &[Sample], b: &[Sample], [from, to]: [f64; 2]) -> Option<[f64; 2]> {
    let mut distances = Vec::new();
    for sample in a.iter().filter(|sample| (from..=to).contains(&sample.t)) {
        let i = b.partition_point(|other| other.t < sample.t);
        if let Some(other) = b.get(i).filter(|other| other.t == sample.t) {
            distances.push((other.x - sample.x).hypot(other.y - sample.y));
        }
    }
    if distances.len() < LEAST {
        return None;
    }
    distances.sort_by(f64::total_cmp);
    let tail = (TAIL * distances.len() as f64) as usize;
    Some([distances[tail], distances[distances.len() - 1 - tail]])
}

/// The same discs touch at the same distance in every shot: a shot whose distance is another one is doubtful.
pub(super) fn compare_distances(impacts: &mut [Result<DiscImpact, Unusable>]) {
    let distance = |impact: &DiscImpact| impact.get(Quantity::ContactDistance);
    let all: Vec<f64> = impacts.iter().flatten().filter_map(|impact| Some(distance(impact)?.value)).collect();
    if all.len() < SHOTS {
        return;
    }
    let usual = median(all);
    for impact in impacts.iter_mut().flatten() {
        let Some(own) = distance(impact) else { continue };
        let error = own.sd.unwrap_or(0.0).hypot(DISTANCE * usual);
        if (own.value - usual).abs() > SURELY * error {
            impact.doubts.push(format!(
                "its discs are {:.1} mm apart at the contact, where the middle one of all shots says {:.1} mm: the same discs touch at \
                 the same distance, so that these are others, or the scale or the tracked points are",
                1e3 * own.value,
                1e3 * usual
            ));
        }
    }
}
