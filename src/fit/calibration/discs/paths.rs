//! A centre moves straight on before and after the impact, while friction slows it evenly; at the impact the centres are as far apart as
//! the discs touch.

use nalgebra::{Matrix3, Vector3};

use super::sums::{Row, Sums, derivatives, repeated};
use crate::film::camera::Camera;
use crate::film::discs::{DISCS, centre};
use crate::measurement::track::{Sample, TrackShot};
use crate::numerics::robust_scale;

/// Frames that tell a parabola and its noise.
const LEAST: usize = 8;

/// Frames nearer to the impact than this many may see the discs touch.
const TOUCHING: f64 = 0.5;

/// A frame is wrong where it is off by this many standard deviations.
const OUTLIER: f64 = 5.0;

/// Of one disc on one side of the impact: at the instant of the impact.
#[derive(Clone, Copy, Debug)]
struct Side {
    /// Position and velocity, x and y.
    value: [[f64; 2]; 2],
    /// How they follow the corrections.
    by: [[Row; 2]; 2],
    /// The covariance of position and velocity, of either coordinate: of the position, of both, of the velocity.
    covariance: [f64; 3],
}

/// How far apart the centres are at the impact.
#[derive(Clone, Debug)]
pub(super) struct Contact {
    pub distance: f64,
    pub by: Row,
    pub variance: f64,
}

/// What the paths of the centres tell between two times, and the contact, where the paths determine it.
pub(super) fn paths(
    shot: &TrackShot,
    camera: &Camera,
    impact: f64,
    window: [f64; 2],
) -> (Sums, Option<Contact>) {
    let mut sums = Sums::zero();
    let mut sides = Vec::new();
    for disc in DISCS {
        let samples = centre(shot, disc);
        let near = TOUCHING / shot.fps;
        for [from, to] in [[window[0], impact - near], [impact + near, window[1]]] {
            let inside: Vec<Sample> =
                samples.iter().filter(|s| (from..=to).contains(&s.t)).copied().collect();
            sides.extend(side(&inside, camera, impact, &mut sums));
        }
    }
    let sides: Option<[Side; 4]> = sides.try_into().ok();
    (sums, sides.and_then(|sides| contact(&sides)))
}

/// Adds what is left of a parabola through some frames, and says where it leads at the impact.
fn side(samples: &[Sample], camera: &Camera, impact: f64, sums: &mut Sums) -> Option<Side> {
    let mut good: Vec<Sample> = samples.to_vec();
    let (mut fitted, mut left) = parabola(&good, impact)?;
    let most = OUTLIER * robust_scale(left.iter().flatten().copied());
    let before = good.len();
    let mut of_frame = left.iter();
    good.retain(|_| of_frame.next().is_some_and(|r| r.iter().all(|r| r.abs() <= most)));
    if good.len() < before {
        (fitted, left) = parabola(&good, impact)?;
    }
    let Parabola { coefficients, inverse, scale } = fitted;
    let runs = [0, 1].map(|axis| left.iter().map(|r| r[axis]).collect::<Vec<f64>>());
    let dof = 2.0 * (good.len() - 3) as f64;
    let square =
        runs.iter().flatten().map(|r| r * r).sum::<f64>() / dof * repeated(runs.iter().map(Vec::as_slice));
    if !(square > 0.0) {
        return None;
    }
    // at the parabola: at the frames themselves their noise would shrink with the film
    let basis: Vec<Vector3<f64>> = good.iter().map(|s| powers((s.t - impact) / scale)).collect();
    let by: Vec<[Row; 2]> = basis
        .iter()
        .map(|u| {
            let place = coefficients.map(|c| c.dot(u));
            let velocity = coefficients.map(|c| (c[1] + 2.0 * c[2] * u[1]) / scale);
            derivatives(camera, place, velocity)
        })
        .collect();
    // the parabolas through how the frames follow each correction
    let of = |axis: usize, power: usize| -> Row {
        basis
            .iter()
            .zip(&by)
            .map(|(u, by)| by[axis] * (0..3).map(|k| inverse[(power, k)] * u[k]).sum::<f64>())
            .sum()
    };
    let through = [0, 1].map(|axis| [0, 1, 2].map(|power| of(axis, power)));
    for (i, u) in basis.iter().enumerate() {
        for axis in 0..2 {
            let parabola = (0..3).map(|k| through[axis][k] * u[k]).sum::<Row>();
            sums.add(&(by[i][axis] - parabola), left[i][axis], 1.0 / square);
        }
    }
    Some(Side {
        value: [coefficients.map(|c| c[0]), coefficients.map(|c| c[1] / scale)],
        by: [through.map(|t| t[0]), through.map(|t| t[1] / scale)],
        covariance: [inverse[(0, 0)], inverse[(0, 1)] / scale, inverse[(1, 1)] / (scale * scale)]
            .map(|c| c * square),
    })
}

/// A parabola in time from the impact, in units of `scale`.
struct Parabola {
    coefficients: [Vector3<f64>; 2],
    inverse: Matrix3<f64>,
    scale: f64,
}

fn powers(u: f64) -> Vector3<f64> {
    Vector3::new(1.0, u, u * u)
}

/// The parabola through frames and what it leaves of them.
fn parabola(samples: &[Sample], impact: f64) -> Option<(Parabola, Vec<[f64; 2]>)> {
    if samples.len() < LEAST {
        return None;
    }
    let scale = samples.iter().map(|s| (s.t - impact).abs()).fold(0.0, f64::max);
    let (mut normal, mut right) = (Matrix3::zeros(), [Vector3::zeros(); 2]);
    for s in samples {
        let u = powers((s.t - impact) / scale);
        normal += u * u.transpose();
        right[0] += u * s.x;
        right[1] += u * s.y;
    }
    let inverse = normal.cholesky()?.inverse();
    let coefficients = right.map(|right| inverse * right);
    let left = samples.iter().map(|s| {
        let u = powers((s.t - impact) / scale);
        [s.x - coefficients[0].dot(&u), s.y - coefficients[1].dot(&u)]
    });
    let left = left.collect();
    Some((Parabola { coefficients, inverse, scale }, left))
}

/// The first disc before and after, the second before and after: position and velocity.
type Values = [[[f64; 2]; 2]; 4];

/// How far apart the centres are when each disc is nearest to changing from one path to the other.
fn apart(values: &Values) -> f64 {
    let (mut along, mut square) = (0.0, 0.0);
    for two in values.chunks(2) {
        for k in 0..2 {
            let (jump, change) = (two[1][0][k] - two[0][0][k], two[1][1][k] - two[0][1][k]);
            along += jump * change;
            square += change * change;
        }
    }
    let late = if square > 0.0 { -along / square } else { 0.0 };
    let place = |two: &[[[f64; 2]; 2]]| {
        [0, 1].map(|k| 0.5 * (two[0][0][k] + two[1][0][k] + late * (two[0][1][k] + two[1][1][k])))
    };
    let (a, b) = (place(&values[..2]), place(&values[2..]));
    (b[0] - a[0]).hypot(b[1] - a[1])
}

fn contact(sides: &[Side; 4]) -> Option<Contact> {
    /// Metres and metres a second: the distance is smooth over far more.
    const STEP: f64 = 1e-6;
    let values = sides.map(|side| side.value);
    let distance = apart(&values);
    let mut by = Row::zeros();
    let mut variance = 0.0;
    for (i, side) in sides.iter().enumerate() {
        let slope = |what: usize, axis: usize| {
            let at = |step: f64| {
                let mut moved = values;
                moved[i][what][axis] += step;
                apart(&moved)
            };
            (at(STEP) - at(-STEP)) / (2.0 * STEP)
        };
        for axis in 0..2 {
            let [place, velocity] = [slope(0, axis), slope(1, axis)];
            by += side.by[0][axis] * place + side.by[1][axis] * velocity;
            let [a, b, c] = side.covariance;
            variance += place * place * a + 2.0 * place * velocity * b + velocity * velocity * c;
        }
    }
    (distance > 0.0 && variance.is_finite()).then_some(Contact { distance, by, variance })
}
