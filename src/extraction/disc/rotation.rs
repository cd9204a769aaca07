//! How fast a disc turns before and after the impact, from the directions of its markers.

use nalgebra::{Matrix2, Matrix4, Vector4};

use super::lines::LEAST;
use crate::extraction::path_fit::repeated;
use crate::measurement::track::{Sample, TrackShot, TrackedBall};
use crate::numerics::wrap;
use crate::numerics::{median, robust_scale};

/// An angle is wrong that is this many standard deviations off.
const OUTLIER: f64 = 5.0;
const ROUNDS: usize = 6;

/// The angles of the two sides do not meet at the instant of the centres if −2 log L decreases by this much with a jump between them, as of
/// corrections of the camera.
const SIGNIFICANT: f64 = 12.0;

/// Angular velocities before and after, rad/s, with their covariance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub values: [f64; 2],
    pub covariance: Matrix2<f64>,
}

/// One marker in one frame: which, time from the impact, direction from the disc's centre.
struct Seen {
    marker: usize,
    late: f64,
    angle: f64,
}

/// θ = θ_m + ω τ before and θ_m + δ + ω' τ after the impact, θ_m of each marker: by least squares over the frames of the window. The jump δ
/// is 0 unless a contact that lasts calls for it: friction ends before it does where the discs grip each other. A disc must turn by less than
/// half a turn a frame. `None` without enough markers.
pub(super) fn turn(shot: &TrackShot, disc: usize, time: f64, [from, to]: [f64; 2]) -> Option<Turn> {
    let (ball, centres) = [(TrackedBall::Cue, &shot.cue), (TrackedBall::Object, &shot.object)][disc];
    let markers = shot.markers.iter().filter(|marker| marker.ball == ball);
    let mut seen = Vec::new();
    let mut count = 0;
    for (marker, tracked) in markers.enumerate() {
        count = marker + 1;
        let inside = tracked.samples.iter().filter(|s| (from..=to).contains(&s.t));
        seen.extend(inside.filter_map(|s| {
            let centre = at(centres, s.t)?;
            Some(Seen { marker, late: s.t - time, angle: (s.y - centre.y).atan2(s.x - centre.x) })
        }));
    }
    let mut rates = [0.0; 2];
    for (side, rate) in rates.iter_mut().enumerate() {
        *rate = first_rate(&seen, side == 1)?;
    }
    let mut phases: Vec<f64> = (0..count).map(|marker| phase(&seen, marker, rates)).collect();
    let after = seen.iter().filter(|seen| side(seen) == 1);
    let mut jump = median(after.map(|s| wrap(s.angle - phases[s.marker] - rates[1] * s.late)).collect());
    let mut fitted = None;
    for _ in 0..ROUNDS {
        let off = |seen: &Seen| {
            let jump = jump * side(seen) as f64;
            wrap(seen.angle - phases[seen.marker] - jump - rates[side(seen)] * seen.late)
        };
        let most = OUTLIER * robust_scale(seen.iter().map(off));
        let good: Vec<(&Seen, f64)> =
            seen.iter().map(|s| (s, off(s))).filter(|(_, off)| off.abs() <= most).collect();
        // the marker's own mean; the mean of all is part of the next step
        for (marker, phase) in phases.iter_mut().enumerate() {
            let own = good.iter().filter(|(seen, _)| seen.marker == marker).map(|(_, off)| *off);
            let (n, sum) = own.fold((0.0, 0.0), |(n, sum), off| (n + 1.0, sum + off));
            *phase += if n > 0.0 { sum / n } else { 0.0 };
        }
        let of_frames = frames(&good, &phases, rates);
        let free = lines(&of_frames, true)?;
        let step = if free.jump * free.jump > SIGNIFICANT * free.jump_variance {
            free
        } else {
            lines(&of_frames, false)?
        };
        for (side, rate) in rates.iter_mut().enumerate() {
            *rate += step.turn.values[side];
        }
        jump = step.jump;
        fitted = Some(step.turn);
    }
    fitted.map(|turn| Turn { values: rates, ..turn })
}

/// A step of the rates, and the jump of the angle at the impact.
struct Step {
    turn: Turn,
    jump: f64,
    jump_variance: f64,
}

/// Time from the impact, mean angle off over the markers but for the jump, and how many they are.
type Turned = (f64, f64, f64);

/// One angle a frame: those of its markers hang together, where they give the centre, too.
fn frames(good: &[(&Seen, f64)], phases: &[f64], rates: [f64; 2]) -> Vec<Turned> {
    let mut sorted: Vec<Turned> = good
        .iter()
        .map(|(s, _)| (s.late, wrap(s.angle - phases[s.marker] - rates[side(s)] * s.late), 1.0))
        .collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut frames: Vec<Turned> = Vec::new();
    for (late, off, _) in sorted {
        match frames.last_mut() {
            Some(last) if last.0 == late => *last = (late, last.1 + off, last.2 + 1.0),
            _ => frames.push((late, off, 1.0)),
        }
    }
    frames.into_iter().map(|(late, sum, n)| (late, sum / n, n)).collect()
}

/// A common angle, both rates and the jump, by least squares; `jumps`: whether the jump is free or 0.
fn lines(frames: &[Turned], jumps: bool) -> Option<Step> {
    /// Holds the jump at 0, in parts of a frame's weight.
    const HELD: f64 = 1e12;
    let split = frames.partition_point(|frame| frame.0 < 0.0);
    if split < LEAST || frames.len() - split < LEAST {
        return None;
    }
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    let span = frames.iter().map(|frame| frame.0.abs()).fold(0.0, f64::max);
    let row = |late: f64| match late / span {
        late if late < 0.0 => Vector4::new(1.0, late, 0.0, 0.0),
        late => Vector4::new(1.0, 0.0, late, 1.0),
    };
    if !jumps {
        normal[(3, 3)] = HELD;
    }
    for (late, off, weight) in frames {
        normal += row(*late) * row(*late).transpose() * *weight;
        right += row(*late) * (off * weight);
    }
    let inverse = normal.cholesky()?.inverse();
    let step = inverse * right;
    let left: Vec<f64> =
        frames.iter().map(|(late, off, weight)| (off - row(*late).dot(&step)) * weight.sqrt()).collect();
    let square = left.iter().map(|r| r * r).sum::<f64>() / (frames.len() - 3 - usize::from(jumps)) as f64;
    let factor = square * repeated(&[left[..split].to_vec(), left[split..].to_vec()]);
    let covariance = inverse.fixed_view::<2, 2>(1, 1) * (factor / (span * span));
    let turn = Turn { values: [step[1] / span, step[2] / span], covariance };
    Some(Step { turn, jump: step[3], jump_variance: inverse[(3, 3)] * factor })
}

fn side(seen: &Seen) -> usize {
    usize::from(seen.late >= 0.0)
}

fn at(samples: &[Sample], t: f64) -> Option<&Sample> {
    let i = samples.partition_point(|s| s.t < t);
    samples.get(i).filter(|s| s.t == t)
}

/// The median rate between frames that follow each other.
fn first_rate(seen: &[Seen], after: bool) -> Option<f64> {
    let pairs = seen.windows(2).filter(|two| {
        let same = two[0].marker == two[1].marker;
        same && two.iter().all(|seen| (side(seen) == 1) == after)
    });
    let rates: Vec<f64> =
        pairs.map(|two| wrap(two[1].angle - two[0].angle) / (two[1].late - two[0].late)).collect();
    (rates.len() + 1 >= LEAST).then(|| median(rates))
}

/// The direction of a marker at the impact: the one that most frames before it agree about, or after it if the marker was not seen before.
fn phase(seen: &[Seen], marker: usize, rates: [f64; 2]) -> f64 {
    let on = |which: usize| -> Vec<f64> {
        let own = seen.iter().filter(|seen| seen.marker == marker && side(seen) == which);
        own.map(|seen| seen.angle - rates[which] * seen.late).collect()
    };
    let all = Some(on(0)).filter(|before| !before.is_empty()).unwrap_or_else(|| on(1));
    let distance = |a: &f64| median(all.iter().map(|b| wrap(a - b).abs()).collect());
    all.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0.0)
}
