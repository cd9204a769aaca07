//! A first guess from straight lines on both sides of where the discs are nearest.

use super::lines::{LEAST, Line, distances};
use super::unknowns;
use super::unknowns::Unknowns;
use crate::extraction::unusable::{Bodies, Unusable};
use crate::film::frame_noise::constant_axis;
use crate::measurement::track::{Sample, TrackShot};

/// So many frames next to the impact give the guess.
const NEAR: usize = 12;

/// The instant is that of the frame in which the discs are nearest, but for so many frames, or a gap in the tracks.
const FARTHEST: f64 = 2.0;
const ROUNDS: usize = 4;

/// The relative velocity must change by this part of itself.
const CHANGE: f64 = 1e-3;

/// Where the discs part again.
pub(super) fn guess(shot: &TrackShot) -> Result<Unknowns, Unusable> {
    let discs = [shot.cue.as_slice(), &shot.object];
    if discs.iter().any(|samples| samples.len() < 2 * LEAST) {
        return Err(Unusable::TooShort {
            bodies: Bodies::Discs,
            frames: [shot.cue.len(), shot.object.len()],
            least: 2 * LEAST,
        });
    }
    let mut instant = nearest(shot).ok_or(Unusable::NoCollision(Bodies::Discs))?;
    let frame = 1.0 / shot.fps;
    let farthest = discs.iter().flat_map(|samples| samples.windows(2)).map(|two| two[1].t - two[0].t);
    let farthest = farthest.fold(FARTHEST * frame, f64::max);
    let mut crossing = Crossing::near(discs, instant, frame)?;
    for _ in 0..ROUNDS {
        if crossing.late.abs() <= FARTHEST * frame {
            break;
        }
        // beyond a gap: the frames on either side are then others
        instant += crossing.late.clamp(-farthest, farthest);
        crossing = Crossing::near(discs, instant, frame)?;
    }
    let late = crossing.late.clamp(-FARTHEST * frame, FARTHEST * frame);
    let constant_axis = constant_axis(shot);
    let Crossing { lines, relative: [(p, g), (q, h)], .. } = crossing;
    let change = (h[0] - g[0]).hypot(h[1] - g[1]);
    let at = |place: [f64; 2], speed: [f64; 2]| [0, 1].map(|k| place[k] + speed[k] * late);
    let is_met = match constant_axis {
        // marks on the edges that touch are at no distance
        Some(_) => dot(g, h) < 0.0,
        None => dot(at(p, g), g) < 0.0 && dot(at(q, h), h) > 0.0,
    };
    if !(is_met && change > CHANGE * g[0].hypot(g[1])) {
        return Err(Unusable::NoCollision(Bodies::Discs));
    }
    let first = at(lines[0][0].position, lines[0][0].velocity);
    let across = at(p, g);
    let mut z = Unknowns::zeros();
    z[unknowns::TIME] = instant + late;
    z[unknowns::PLACE] = first[0];
    z[unknowns::PLACE + 1] = first[1];
    let along = if constant_axis.is_some() { g.map(|g| -g) } else { across };
    let (sin, cos) = along[1].atan2(along[0]).sin_cos();
    z[unknowns::DIRECTION] = sin.atan2(cos);
    z[unknowns::DISTANCE] = dot(across, [cos, sin]);
    for (disc, sides) in lines.iter().enumerate() {
        for (side, line) in sides.iter().enumerate() {
            for k in 0..2 {
                z[unknowns::velocity(disc, side) + k] = line.velocity[k];
            }
        }
    }
    Ok(z)
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Where the paths before and after an instant cross.
struct Crossing {
    /// Of each disc before and after.
    lines: [[Line; 2]; 2],
    /// The second disc's position and velocity relative to the first's at the instant, before and after.
    relative: [([f64; 2], [f64; 2]); 2],
    /// How much later than the instant they are nearest to each other, s.
    late: f64,
}

impl Crossing {
    fn near(discs: [&[Sample]; 2], instant: f64, frame: f64) -> Result<Self, Unusable> {
        let mut lines = [[Line::default(); 2]; 2];
        for (disc, samples) in discs.into_iter().enumerate() {
            let before = samples.partition_point(|s| s.t < instant - 0.5 * frame);
            let after = samples.partition_point(|s| s.t < instant + 0.5 * frame);
            let sides = [
                &samples[before.saturating_sub(NEAR)..before],
                &samples[after..samples.len().min(after + NEAR)],
            ];
            for (side, near) in sides.into_iter().enumerate() {
                if near.len() < LEAST {
                    return Err(Unusable::too_few(Bodies::Discs, [disc, side], near.len(), LEAST));
                }
                lines[disc][side] = Line::through(near, instant);
            }
        }
        let relative = [0, 1].map(|side| {
            let difference = |pick: fn(&Line) -> [f64; 2]| {
                let [a, b] = [pick(&lines[0][side]), pick(&lines[1][side])];
                [b[0] - a[0], b[1] - a[1]]
            };
            (difference(|line| line.position), difference(|line| line.velocity))
        });
        // p + gτ on either side: nearest to each other at τ = −Δp·Δg/|Δg|²
        let [(p, g), (q, h)] = relative;
        let (dp, dg) = ([q[0] - p[0], q[1] - p[1]], [h[0] - g[0], h[1] - g[1]]);
        let square = dot(dg, dg);
        let late = if square > 0.0 { -dot(dp, dg) / square } else { 0.0 };
        Ok(Self { lines, relative, late })
    }
}

/// When the discs are nearest to each other. Of three neighbours the middle distance counts, so that a
/// frame in which a disc was mistaken for another does not.
fn nearest(shot: &TrackShot) -> Option<f64> {
    let distances = distances(shot);
    let least = distances.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(least.0)
}
