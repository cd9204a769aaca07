//! Markers on a ball → its angular velocity just before or after the impact.
//!
//! A marker that is seen from above at (x, y) from the centre lies at d = (x, y, √(R² − x² − y²))/R
//! on the unit sphere. Between two frames a rotation with the angular velocity ω moves it so that,
//! exactly, d₂ − d₁ = g × (d₁ + d₂) with g = tan(|ω|Δt/2) ω/|ω|: linear in g, which makes a start
//! from all markers and frames at once. Then one least-squares fit of all marker positions, with ω
//! at the impact and each marker's place on the ball as unknowns, gives ω and its covariance.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3};

use crate::measurement::correction::Correction;
use crate::measurement::track::{Marker, Sample, TrackShot, TrackedBall};
use crate::numerics::dense::{Place, descend};
use crate::numerics::{EXACT, SIGNIFICANT};
use crate::physics::ball::Vec3;

/// Angular velocity of a ball at the impact, table frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rotation {
    /// The angular velocity, rad/s.
    pub(crate) spin: Vec3,
    /// Its covariance, from the noise of the markers and of the ball's centre.
    pub(crate) covariance: Matrix3<f64>,
    /// Mean time of the frames that show it from the impact, s.
    pub(crate) time: f64,
}

/// A marker in one frame.
#[derive(Clone, Copy)]
struct Seen {
    /// Time from the impact, s.
    time: f64,
    /// Place from the ball's centre over R.
    at: [f64; 2],
    /// Standard deviation over R.
    sd: f64,
}

impl Seen {
    /// Returns the point of the upper half of the unit sphere that is seen at the place.
    fn lifted(&self) -> Option<Vec3> {
        let [x, y] = self.at;
        let square = x * x + y * y;
        (square < MAX_RADIUS * MAX_RADIUS).then(|| Vec3::new(x, y, (1.0 - square).sqrt()))
    }
}

/// Frames on either side of the impact that are used: over these the cloth changes a spin evenly.
const ROTATION_FRAMES: f64 = 60.0;

/// Largest distance from the centre, over R, at which a marker's height can start the fit.
const MAX_RADIUS: f64 = 0.95;

/// Maximum number of rounds that leave out wrong positions.
const MAX_ROUNDS: usize = 6;

/// Maximum number of steps of a descent.
const MAX_STEPS: usize = 100;

/// Returns a rough angular velocity, rad/s, if the steps of markers from frame to frame determine
/// it.
fn rough(spots: &[Vec<Seen>]) -> Option<Vec3> {
    // least squares of d₂ − d₁ = (Δt/2) ω × (d₁ + d₂)
    let mut matrix = Matrix3::zeros();
    let mut right = Vec3::zeros();
    let step = |pair: &[Seen]| pair[1].time - pair[0].time;
    let pairs = || spots.iter().flat_map(|spot| spot.windows(2));
    // a marker that was hidden may have turned by any angle
    let shortest = pairs().map(step).fold(f64::INFINITY, f64::min);
    for pair in pairs().filter(|pair| step(pair) < 1.5 * shortest) {
        let [Some(first), Some(second)] = [pair[0].lifted(), pair[1].lifted()] else { continue };
        // ω × s = −[s]× ω
        let by_spin = -0.5 * step(pair) * (first + second).cross_matrix();
        matrix += by_spin.transpose() * by_spin;
        right += by_spin.transpose() * (second - first);
    }
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let sizes = matrix.symmetric_eigenvalues();
    (sizes.min() > EXACT * sizes.max()).then(|| Some(matrix.try_inverse()? * right))?
}

/// Number of unknowns that all markers of a ball share: its angular velocity at the impact, the
/// time derivatives of ω_x and ω_y, and how much larger it seems than its radius makes it, which is
/// as uncertain as a scale. The place of each marker follows.
const SHARED: usize = 6;

/// Fits the angular velocity at the impact, and its constant change with time about horizontal
/// axes. `stated`: the standard deviations are known, not to be estimated.
fn measure(spots: &[Vec<Seen>], stated: bool) -> Option<Rotation> {
    let start = rough(spots)?;
    let mut markers: Vec<Placed> =
        spots.iter().filter_map(|spot| Placed::new(spot.clone(), &start)).collect();
    // the best step of central difference quotients: rounding and curvature err equally
    let step = EXACT.cbrt();
    for _ in 0..MAX_ROUNDS {
        let mut x = DVector::zeros(SHARED + 2 * markers.len());
        x.rows_mut(0, 3).copy_from(&start);
        let numbers = residuals_of(&markers, &x).len();
        let dof = numbers.checked_sub(x.len()).filter(|dof| *dof > 0)?;
        let Place { x, matrix, rest: residuals, .. } = descend(x, (MAX_STEPS, EXACT), |x| {
            let slope = |i: usize| {
                let at = |by: f64| {
                    let mut x = x.clone();
                    x[i] += by;
                    residuals_of(&markers, &x)
                };
                (at(step) - at(-step)) / (2.0 * step)
            };
            let jacobian = DMatrix::from_columns(&(0..x.len()).map(slope).collect::<Vec<_>>());
            let residuals = residuals_of(&markers, &x);
            let (matrix, gradient) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residuals));
            Place { x, sum: residuals.norm_squared(), matrix, gradient, rest: residuals }
        });
        let scale = if stated { 1.0 } else { residuals.norm_squared() / dof as f64 };
        // the worst first: they pull the others off
        let limit = (SIGNIFICANT * scale.sqrt()).max(0.5 * residuals.amax());
        if residuals.amax() <= limit {
            let inverse = matrix.cholesky()?.inverse();
            let covariance = inverse.fixed_view::<3, 3>(0, 0) * scale;
            let spin = Vec3::new(x[0], x[1], x[2]);
            let times: Vec<f64> = markers.iter().flat_map(|m| &m.seen).map(|seen| seen.time).collect();
            let time = times.iter().sum::<f64>() / times.len() as f64;
            return covariance.iter().all(|c| c.is_finite()).then_some(Rotation { spin, covariance, time });
        }
        let mut is_wrong = residuals.as_slice().chunks(2).map(|xy| xy.iter().any(|r| r.abs() > limit));
        for marker in &mut markers {
            marker.seen.retain(|_| !is_wrong.next().unwrap_or(false));
        }
        markers.retain(|marker| !marker.seen.is_empty());
    }
    None
}

/// Returns predicted less seen places in standard deviations, and that of the size.
fn residuals_of(markers: &[Placed], x: &DVector<f64>) -> DVector<f64> {
    let moved = |(i, marker): (usize, &Placed)| {
        marker.residuals(x, [SHARED, SHARED + 1].map(|place| x[place + 2 * i]))
    };
    let size = x[SHARED - 1] / Correction::Scale.usual();
    DVector::from_vec(markers.iter().enumerate().flat_map(moved).chain([size]).collect())
}

/// A marker in the fit: its frames in the order of their distance from the impact.
struct Placed {
    seen: Vec<Seen>,
    /// The rotation that brings the z axis to its approximate place on the ball at the impact.
    base: Rotation3<f64>,
}

impl Placed {
    /// Returns a marker with its place in the nearest frame in which its height is known, turned
    /// back to the impact.
    fn new(mut seen: Vec<Seen>, spin: &Vec3) -> Option<Self> {
        seen.sort_by(|a, b| a.time.abs().total_cmp(&b.time.abs()));
        let (time, place) = seen.iter().find_map(|seen| Some((seen.time, seen.lifted()?)))?;
        let base = Rotation3::rotation_between(&Vec3::z(), &(Rotation3::new(spin * -time) * place))?;
        Some(Self { seen, base })
    }

    /// Returns predicted less seen places in all frames, for ω and its change with time, and the
    /// marker's distances from its approximate place along two directions.
    fn residuals(&self, shared: &DVector<f64>, [first, second]: [f64; 2]) -> Vec<f64> {
        let spin = Vec3::new(shared[0], shared[1], shared[2]);
        let change = Vec3::new(shared[3], shared[4], 0.0);
        let mut place = self.base * Vec3::new(first, second, 1.0).normalize();
        let mut now = 0.0;
        let spot = |Seen { time, at, sd }: &Seen| {
            place = Rotation3::new((spin + change * (0.5 * (now + time))) * (time - now)) * place;
            now = *time;
            [0, 1].map(|axis| ((1.0 + shared[SHARED - 1]) * place[axis] - at[axis]) / sd)
        };
        self.seen.iter().flat_map(spot).collect()
    }
}

/// Returns the rotations of the cue ball just before the impact and of both balls just after it, of
/// balls with markers and this radius (m) in the unit of the film; `noise` is that of the positions
/// unless another is stated.
pub(crate) fn rotations(shot: &TrackShot, impact: f64, radius: f64, noise: f64) -> [Option<Rotation>; 3] {
    let near = ROTATION_FRAMES / shot.fps;
    let (before, after) = ([impact - near, impact], [impact, impact + near]);
    let rotation = |ball: TrackedBall, window: [f64; 2]| {
        let centres = if ball == TrackedBall::Cue { &shot.cue } else { &shot.object };
        let own = || shot.markers.iter().filter(|marker| marker.ball == ball);
        let spot = |marker: &Marker| spot(&marker.samples, centres, (window, impact), (radius, noise));
        let spots: Vec<Vec<Seen>> = own().map(spot).collect();
        let is_known = |marker: &Marker| marker.samples.iter().all(|sample| sample.sd.is_some());
        let stated = shot.position_sd.is_some() || own().all(is_known);
        measure(&spots, stated)
    };
    [
        rotation(TrackedBall::Cue, before),
        rotation(TrackedBall::Cue, after),
        rotation(TrackedBall::Object, after),
    ]
}

/// Returns a marker's places from the centre of its ball in the frames of a window that show both.
fn spot(
    samples: &[Sample],
    centres: &[Sample],
    ([from, to], impact): ([f64; 2], f64),
    (radius, noise): (f64, f64),
) -> Vec<Seen> {
    let sd_of = |sample: &Sample| sample.sd.map_or(noise, |[x, y]| 0.5 * (x + y));
    let inside = samples.iter().filter(|sample| (from..=to).contains(&sample.t));
    let seen = inside.filter_map(|sample| {
        let at = centres.partition_point(|centre| centre.t < sample.t - 1e-9);
        let centre = centres.get(at).filter(|centre| (centre.t - sample.t).abs() < 1e-9)?;
        let sd = sd_of(sample).hypot(sd_of(centre)) / radius;
        let at = [(sample.x - centre.x) / radius, (sample.y - centre.y) / radius];
        Some(Seen { time: sample.t - impact, at, sd })
    });
    seen.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPIN: Vec3 = Vec3::new(20.0, -60.0, 35.0);

    /// Exact positions of a marker on a ball that spins with [`SPIN`] + slowing·t.
    fn spot() -> Vec<Seen> {
        let at = |i: usize| {
            let time = 1e-3 * (i as f64 + 0.4);
            let step = time / 200.0;
            let spin = |n: u32| SPIN + Vec3::new(30.0, 150.0, 0.0) * step * (f64::from(n) + 0.5);
            let start = Vec3::new(0.3, 0.4, 0.75_f64.sqrt());
            let place = (0..200).fold(start, |place, n| Rotation3::new(spin(n) * step) * place);
            (place, Seen { time, at: [place.x, place.y], sd: 1e-4 })
        };
        (0..40).map(at).filter(|(place, _)| place.z > 0.1).map(|(_, seen)| seen).collect()
    }

    /// One marker gives the whole angular velocity, also beside one of which every position is
    /// wrong: within 1 ms the ball carries that by 0.052 R, and not by 0.022 R.
    #[test]
    fn one_marker_gives_the_whole_angular_velocity() {
        let wrong = [(1.4e-3, 0.5), (2.4e-3, 0.478)].map(|(time, x)| Seen { time, at: [x, 0.0], sd: 1e-4 });
        for spots in [vec![spot()], vec![spot(), wrong.to_vec()]] {
            let rotation = measure(&spots, true).unwrap();
            // steps of a frame, midpoint rule: (slowing × spin) Δt² / 12 per second
            assert!((rotation.spin - SPIN).norm() < 1e-3, "{}", rotation.spin);
            assert!(rotation.covariance.diagonal().iter().all(|c| (1e-6..10.0).contains(c)));
        }
    }

    #[test]
    fn a_marker_on_the_axis_and_two_frames_do_not_determine_a_spin() {
        let seen = |i: i32, x: f64| Seen { time: 1e-3 * f64::from(i), at: [x, 0.0], sd: 1e-4 };
        let (on_axis, two) = ((0..20).map(|i| seen(i, 0.0)).collect(), vec![seen(0, 0.3), seen(1, 0.31)]);
        assert!(measure(&[on_axis], true).is_none() && measure(&[two], true).is_none());
    }
}
