//! Markers on a ball → its angular velocity just before or after the impact.
//!
//! A marker on a ball of radius R, whose centre is at p on the table, lies at R d from the centre,
//! |d| = 1; a camera sees it where it sees the place p + R (d_x, d_y) at the height R d_z. Between
//! two frames a rotation with the angular velocity ω moves it so that, exactly, d₂ − d₁ =
//! g × (d₁ + d₂) with g = tan(|ω|Δt/2) ω/|ω|: linear in g, which makes a start from all markers and
//! frames at once. Then one least-squares fit of all marker positions, with ω at the impact and each
//! marker's place on the ball as unknowns, gives ω, its covariance, and how it depends on the camera.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix3, Rotation3, RowDVector, SMatrix};

use super::camera::{Camera, Point, Seen};
use crate::measurement::correction::Correction;
use crate::numerics::dense::{Place, descend};
use crate::numerics::{EXACT, SIGNIFICANT};
use crate::physics::ball::Vec3;
use crate::problem::frames::Frame;
use crate::problem::unknowns::CAMERA;

/// Angular velocity of a ball at the impact, table frame.
#[derive(Clone, Debug)]
pub(super) struct Rotation {
    /// The angular velocity, rad/s.
    pub(super) spin: Vec3,
    /// Its covariance, from the noise of the markers and of the ball's centre.
    pub(super) covariance: Matrix3<f64>,
    /// Its derivatives by the unknowns of the camera.
    pub(super) by_camera: SMatrix<f64, 3, CAMERA>,
}

/// A point on a ball in the frames of a shot.
#[derive(Clone, Debug)]
pub(crate) struct MarkerTrack {
    /// 0 for the cue ball, 1 for the object ball.
    pub(crate) ball: usize,
    pub(crate) frames: Vec<Frame>,
    /// Noise of a frame of weight 1, m.
    pub(crate) noise: f64,
    /// Whether the noise of every frame is stated.
    pub(crate) states_noise: bool,
}

/// A camera, and the radius of a ball that it sees, m.
#[derive(Clone, Copy)]
pub(super) struct View {
    pub(super) camera: Camera,
    pub(super) radius: f64,
}

/// A marker in one frame.
#[derive(Clone, Copy)]
struct Spot {
    /// Time from the impact, s.
    time: f64,
    /// Place of the ball's centre on the table, m.
    centre: Point,
    /// Place of the marker in the picture, m.
    at: Point,
    /// Standard deviation of that place from the centre's, m.
    sd: f64,
}

impl View {
    /// Returns the picture of the point at R d from a ball's centre.
    fn look(&self, centre: Point, d: Vec3) -> Seen {
        self.camera.look(centre + d.xy() * self.radius, d.z * self.radius)
    }

    /// Returns the point d of the side of the unit sphere that the camera sees, at which a marker
    /// is.
    fn lifted(&self, spot: &Spot) -> Option<Vec3> {
        let seen = self.camera.look(spot.centre, 0.0);
        let to_table = seen.by_place.try_inverse()?;
        // m = (d_x, d_y) + a d_z, |d| = 1
        let (m, a) = (to_table * (spot.at - seen.place) / self.radius, to_table * seen.by_height);
        let square = 1.0 + a.norm_squared();
        let along = m.dot(&a);
        let root = along * along - square * (m.norm_squared() - 1.0);
        let z = (root > LEAST_HEIGHT * LEAST_HEIGHT).then(|| (along + root.sqrt()) / square)?;
        Some(Vec3::new(m.x - a.x * z, m.y - a.y * z, z))
    }
}

/// Frames on either side of the impact that are used: over these the cloth changes a spin evenly.
const ROTATION_FRAMES: f64 = 60.0;

/// Least height of a marker, over R, that can start the fit.
const LEAST_HEIGHT: f64 = 0.3;

/// Maximum number of rounds that leave out wrong positions.
const MAX_ROUNDS: usize = 6;

/// Maximum number of steps of a descent.
const MAX_STEPS: usize = 100;

/// Returns a rough angular velocity, rad/s, if the steps of markers from frame to frame determine
/// it.
fn rough(spots: &[Vec<Spot>], view: View) -> Option<Vec3> {
    // least squares of d₂ − d₁ = (Δt/2) ω × (d₁ + d₂)
    let mut matrix = Matrix3::zeros();
    let mut right = Vec3::zeros();
    let step = |pair: &[Spot]| pair[1].time - pair[0].time;
    let pairs = || spots.iter().flat_map(|spot| spot.windows(2));
    // a marker that was hidden may have turned by any angle
    let shortest = pairs().map(step).fold(f64::INFINITY, f64::min);
    for pair in pairs().filter(|pair| step(pair) < 1.5 * shortest) {
        let [Some(first), Some(second)] = [0, 1].map(|i| view.lifted(&pair[i])) else { continue };
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
/// as uncertain as a scale. Distances of each marker from its approximate place along two directions
/// follow.
const SHARED: usize = 6;

/// Fits the angular velocity at the impact, and its constant change with time about horizontal
/// axes. `stated`: the standard deviations are known, not to be estimated.
fn measure(spots: &[Vec<Spot>], view: View, stated: bool) -> Option<Rotation> {
    let start = rough(spots, view)?;
    let mut markers: Vec<Placed> =
        spots.iter().filter_map(|spots| Placed::new(spots.clone(), &start, view)).collect();
    // the best step of central difference quotients: rounding and curvature err equally
    let step = EXACT.cbrt();
    for _ in 0..MAX_ROUNDS {
        let mut x = DVector::zeros(SHARED + 2 * markers.len());
        x.rows_mut(0, 3).copy_from(&start);
        let numbers = residuals_of(&markers, &x, view).len();
        let dof = numbers.checked_sub(x.len()).filter(|dof| *dof > 0)?;
        let jacobian = |x: &DVector<f64>| {
            let slope = |i: usize| {
                let at = |by: f64| {
                    let mut x = x.clone();
                    x[i] += by;
                    residuals_of(&markers, &x, view)
                };
                (at(step) - at(-step)) / (2.0 * step)
            };
            DMatrix::from_columns(&(0..x.len()).map(slope).collect::<Vec<_>>())
        };
        let Place { x, matrix, rest: residuals, .. } = descend(x, (MAX_STEPS, EXACT), |x| {
            let (jacobian, residuals) = (jacobian(&x), residuals_of(&markers, &x, view));
            let (matrix, gradient) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residuals));
            Place { x, sum: residuals.norm_squared(), matrix, gradient, rest: residuals }
        });
        let scale = if stated { 1.0 } else { residuals.norm_squared() / dof as f64 };
        // the worst first: they pull the others off
        let limit = (SIGNIFICANT * scale.sqrt()).max(0.5 * residuals.amax());
        if residuals.amax() <= limit {
            let inverse = matrix.cholesky()?.inverse();
            let covariance = inverse.fixed_view::<3, 3>(0, 0) * scale;
            // −(JᵀJ)⁻¹ Jᵀ ∂r/∂θ
            let by_camera = -inverse * jacobian(&x).tr_mul(&by_camera(&markers, &x, view));
            let by_camera = by_camera.fixed_view::<3, CAMERA>(0, 0).into_owned();
            let spin = Vec3::new(x[0], x[1], x[2]);
            let is_finite = covariance.iter().chain(&by_camera).all(|number| number.is_finite());
            return is_finite.then_some(Rotation { spin, covariance, by_camera });
        }
        let mut is_wrong = residuals.as_slice().chunks_exact(2).map(|xy| xy.iter().any(|r| r.abs() > limit));
        for marker in &mut markers {
            marker.spots.retain(|_| !is_wrong.next().unwrap_or(false));
        }
        markers.retain(|marker| !marker.spots.is_empty());
    }
    None
}

/// Returns predicted less seen places in standard deviations, and that of the size.
fn residuals_of(markers: &[Placed], x: &DVector<f64>, view: View) -> DVector<f64> {
    let moved = |(spot, d): (&Spot, Vec3)| {
        let off = (view.look(spot.centre, d).place - spot.at) / spot.sd;
        [off.x, off.y]
    };
    let size = x[SHARED - 1] / Correction::Scale.usual();
    DVector::from_vec(follow(markers, x).into_iter().flat_map(moved).chain([size]).collect())
}

/// Returns the derivatives of the residuals by the unknowns of the camera, which sees the centres
/// where they are seen.
fn by_camera(markers: &[Placed], x: &DVector<f64>, view: View) -> DMatrix<f64> {
    let moved = |(spot, d): (&Spot, Vec3)| {
        let (seen, centre) = (view.look(spot.centre, d), view.camera.look(spot.centre, 0.0));
        let carried =
            centre.by_place.try_inverse().map_or_else(Matrix2::zeros, |inverse| seen.by_place * inverse);
        let by = |i: usize| (seen.by_camera[i] - carried * centre.by_camera[i]) / spot.sd;
        [0, 1].map(|axis| RowDVector::from_fn(CAMERA, |_, i| by(i)[axis]))
    };
    let size = RowDVector::zeros(CAMERA);
    DMatrix::from_rows(&follow(markers, x).into_iter().flat_map(moved).chain([size]).collect::<Vec<_>>())
}

/// Returns where each marker is on its ball in each of its frames, times how large the ball seems.
fn follow<'a>(markers: &'a [Placed], x: &DVector<f64>) -> Vec<(&'a Spot, Vec3)> {
    let (spin, change) = (Vec3::new(x[0], x[1], x[2]), Vec3::new(x[3], x[4], 0.0));
    let mut all = Vec::new();
    for (i, marker) in markers.iter().enumerate() {
        let off = Vec3::new(x[SHARED + 2 * i], x[SHARED + 2 * i + 1], 1.0);
        let (mut place, mut now) = (marker.base * off.normalize(), 0.0);
        for spot in &marker.spots {
            let turn = (spin + change * (0.5 * (now + spot.time))) * (spot.time - now);
            place = Rotation3::new(turn) * place;
            now = spot.time;
            all.push((spot, place * (1.0 + x[SHARED - 1])));
        }
    }
    all
}

/// A marker in the fit: its frames in the order of their distance from the impact.
struct Placed {
    spots: Vec<Spot>,
    /// The rotation that brings the z axis to its approximate place on the ball at the impact.
    base: Rotation3<f64>,
}

impl Placed {
    /// Returns a marker with its place in the nearest frame in which its height is known, turned
    /// back to the impact.
    fn new(mut spots: Vec<Spot>, spin: &Vec3, view: View) -> Option<Self> {
        spots.sort_by(|a, b| a.time.abs().total_cmp(&b.time.abs()));
        let (time, place) = spots.iter().find_map(|spot| Some((spot.time, view.lifted(spot)?)))?;
        let base = Rotation3::rotation_between(&Vec3::z(), &(Rotation3::new(spin * -time) * place))?;
        Some(Self { spots, base })
    }
}

/// Returns the rotations of the cue ball just before the impact and of both balls just after it, as
/// far as markers show them, from the frames of both balls and their rate.
pub(super) fn rotations(
    markers: &[MarkerTrack],
    tracks: &[Vec<Frame>; 2],
    (impact, fps): (f64, f64),
    view: View,
) -> [Option<Rotation>; 3] {
    let near = ROTATION_FRAMES / fps;
    let (before, after) = ([impact - near, impact], [impact, impact + near]);
    [(0, before), (0, after), (1, after)].map(|(ball, window)| {
        let markers = || markers.iter().filter(|marker| marker.ball == ball);
        let spots = |marker| list_spots(marker, &tracks[ball], (window, impact), view.camera);
        let spots: Vec<Vec<Spot>> = markers().map(spots).collect();
        measure(&spots, view, markers().all(|marker| marker.states_noise))
    })
}

/// Returns a marker in the frames of a window that show its ball, too.
fn list_spots(
    marker: &MarkerTrack,
    centres: &[Frame],
    ([from, to], impact): ([f64; 2], f64),
    camera: Camera,
) -> Vec<Spot> {
    let sd_of = |frame: &Frame| marker.noise / frame.weight.mean();
    let inside = marker.frames.iter().filter(|frame| frame.used && (from..=to).contains(&frame.time));
    let spot = inside.filter_map(|frame| {
        let at = centres.partition_point(|centre| centre.time < frame.time - 1e-9);
        let centre = centres.get(at).filter(|centre| (centre.time - frame.time).abs() < 1e-9)?;
        let sd = sd_of(frame).hypot(sd_of(centre));
        Some(Spot { time: frame.time - impact, centre: camera.find(centre.seen)?, at: frame.seen, sd })
    });
    spot.collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::SVector;

    use super::*;
    use crate::physics::ball::Ball;
    use crate::problem::unknowns::{Id, Shared, Unknown};

    const SPIN: Vec3 = Vec3::new(20.0, -60.0, 35.0);

    /// A camera 1.5 m above the table that looks from the side with this tangent of its angle.
    fn camera(parallax: f64) -> Camera {
        let mut shared = Shared::starts(&Unknown::list());
        let aspect = 1.0 / parallax.hypot(1.0);
        for (id, value) in [
            (Id::Scale, 1.0),
            (Id::Aspect, aspect),
            (Id::PerspectiveY, -parallax / 1.5),
            (Id::ParallaxY, parallax),
            (Id::Nearness, 1.0 / 1.5),
        ] {
            shared[id] = value;
        }
        Camera::new(&shared)
    }

    /// Exact positions of a marker on a ball that spins with [`SPIN`] + slowing·t.
    fn spots(view: View) -> Vec<Spot> {
        let at = |i: usize| {
            let time = 1e-3 * (i as f64 + 0.4);
            let step = time / 200.0;
            let spin = |n: u32| SPIN + Vec3::new(30.0, 150.0, 0.0) * step * (f64::from(n) + 0.5);
            let start = Vec3::new(0.3, 0.4, 0.75_f64.sqrt());
            let place = (0..200).fold(start, |place, n| Rotation3::new(spin(n) * step) * place);
            let centre = Point::new(0.1 + 2.0 * time, 0.2 - time);
            (place, Spot { time, centre, at: view.look(centre, place).place, sd: 1e-4 * Ball::POOL.radius })
        };
        (0..40).map(at).filter(|(place, _)| place.z > 0.1).map(|(_, spot)| spot).collect()
    }

    /// One marker gives the whole angular velocity, seen from above or from the side, also beside
    /// one of which every position is wrong: within 1 ms the ball carries that by 0.052 R, and not
    /// by 0.022 R.
    #[test]
    fn one_marker_gives_the_whole_angular_velocity() {
        for camera in [camera(0.0), camera(0.4)] {
            let view = View { camera, radius: Ball::POOL.radius };
            let wrong = [(1.4e-3, 0.5), (2.4e-3, 0.478)].map(|(time, x)| {
                let centre = Point::zeros();
                let at = view.look(centre, Vec3::new(x, 0.0, 0.8)).place;
                Spot { time, centre, at, sd: 1e-4 * Ball::POOL.radius }
            });
            for spots in [vec![spots(view)], vec![spots(view), wrong.to_vec()]] {
                let rotation = measure(&spots, view, true).unwrap();
                // steps of a frame, midpoint rule: (slowing × spin) Δt² / 12 per second
                assert!((rotation.spin - SPIN).norm() < 1e-3, "{}", rotation.spin);
                assert!(rotation.covariance.diagonal().iter().all(|c| (1e-6..10.0).contains(c)));
            }
        }
    }

    /// Seen through a camera that is known wrongly, a ball turns as the derivatives say.
    #[test]
    fn spins_depend_on_the_camera_as_their_derivatives_say() {
        let (right, wrong) = (camera(0.3), camera(0.301));
        let through = |camera: Camera| {
            // the picture stays, with the centres where they are seen
            let view = View { camera: right, radius: Ball::POOL.radius };
            let refound = spots(view).into_iter().map(|spot| {
                let centre = camera.find(right.look(spot.centre, 0.0).place).unwrap();
                Spot { centre, ..spot }
            });
            measure(&[refound.collect()], View { camera, radius: Ball::POOL.radius }, true).unwrap()
        };
        let [as_right, as_wrong] = [through(right), through(wrong)];
        let change = SVector::<f64, CAMERA>::from_fn(|i, _| wrong.get(i) - right.get(i));
        let expected = as_right.by_camera * change;
        let off = as_wrong.spin - as_right.spin - expected;
        assert!(off.norm() < 0.02 * expected.norm() && expected.norm() > 0.01, "{off} {expected}");
    }

    #[test]
    fn a_marker_on_the_axis_and_two_frames_do_not_determine_a_spin() {
        let view = View { camera: camera(0.0), radius: Ball::POOL.radius };
        let spot = |i: i32, x: f64| Spot {
            time: 1e-3 * f64::from(i),
            centre: Point::zeros(),
            at: Point::new(x * Ball::POOL.radius, 0.0),
            sd: 1e-4 * Ball::POOL.radius,
        };
        let (on_axis, two) = ((0..20).map(|i| spot(i, 0.0)).collect(), vec![spot(0, 0.3), spot(1, 0.31)]);
        assert!(measure(&[on_axis], view, true).is_none() && measure(&[two], view, true).is_none());
    }
}
