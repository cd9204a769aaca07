//! A first guess from straight lines on both sides of where the discs are nearest.

use super::lines::{LEAST, Line, distances};
use super::unknowns;
use super::unknowns::Unknowns;
use crate::extraction::unusable::{Bodies, Unusable};
use crate::measurement::track::TrackShot;

/// So many frames next to the impact give the guess.
const NEAR: usize = 12;

/// The relative velocity must change by this part of itself.
const CHANGE: f64 = 1e-3;

/// Where the discs part again.
pub(super) fn guess(shot: &TrackShot) -> Result<Unknowns, Unusable> {
    let discs = [&shot.cue, &shot.object];
    if discs.iter().any(|samples| samples.len() < 2 * LEAST) {
        return Err(Unusable::TooShort {
            bodies: Bodies::Discs,
            frames: [shot.cue.len(), shot.object.len()],
            least: 2 * LEAST,
        });
    }
    let nearest = nearest(shot).ok_or(Unusable::NoCollision(Bodies::Discs))?;
    let frame = 1.0 / shot.fps;
    let mut lines = [[Line::default(); 2]; 2];
    for (disc, samples) in discs.into_iter().enumerate() {
        let before = samples.partition_point(|s| s.t < nearest - 0.5 * frame);
        let after = samples.partition_point(|s| s.t < nearest + 0.5 * frame);
        let sides =
            [&samples[before.saturating_sub(NEAR)..before], &samples[after..samples.len().min(after + NEAR)]];
        for (side, near) in sides.into_iter().enumerate() {
            if near.len() < LEAST {
                return Err(Unusable::too_few(Bodies::Discs, [disc, side], near.len(), LEAST));
            }
            lines[disc][side] = Line::through(near, nearest);
        }
    }
    // relative position p + gτ on either side; the two lines are nearest to each other at τ = −Δp·Δg/|Δg|²
    let relative = |side: usize, pick: fn(&Line) -> [f64; 2]| {
        let [a, b] = [pick(&lines[0][side]), pick(&lines[1][side])];
        [b[0] - a[0], b[1] - a[1]]
    };
    let (p, q) = (relative(0, |l| l.position), relative(1, |l| l.position));
    let (g, h) = (relative(0, |l| l.velocity), relative(1, |l| l.velocity));
    let (dp, dg) = ([q[0] - p[0], q[1] - p[1]], [h[0] - g[0], h[1] - g[1]]);
    let square = dg[0] * dg[0] + dg[1] * dg[1];
    let approach = p[0] * g[0] + p[1] * g[1];
    let parting = q[0] * h[0] + q[1] * h[1];
    if !(approach < 0.0 && parting > 0.0 && square.sqrt() > CHANGE * g[0].hypot(g[1])) {
        return Err(Unusable::NoCollision(Bodies::Discs));
    }
    let late = (-(dp[0] * dg[0] + dp[1] * dg[1]) / square).clamp(-2.0 * frame, 2.0 * frame);
    let at = |disc: usize| [0, 1].map(|k| lines[disc][0].position[k] + lines[disc][0].velocity[k] * late);
    let (first, second) = (at(0), at(1));
    let across = [second[0] - first[0], second[1] - first[1]];
    let mut z = Unknowns::zeros();
    z[unknowns::TIME] = nearest + late;
    z[unknowns::PLACE] = first[0];
    z[unknowns::PLACE + 1] = first[1];
    z[unknowns::DIRECTION] = across[1].atan2(across[0]);
    z[unknowns::DISTANCE] = across[0].hypot(across[1]);
    for (disc, sides) in lines.iter().enumerate() {
        for (side, line) in sides.iter().enumerate() {
            for k in 0..2 {
                z[unknowns::velocity(disc, side) + k] = line.velocity[k];
            }
        }
    }
    Ok(z)
}

/// When the discs are nearest to each other. Of three neighbours the middle distance counts, so that a
/// frame in which a disc was mistaken for another does not.
fn nearest(shot: &TrackShot) -> Option<f64> {
    let distances = distances(shot);
    let least = distances.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(least.0)
}
