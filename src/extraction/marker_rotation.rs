//! Markers on a ball → its angular velocity just before or after the impact.
//!
//! A marker that is seen from above at (x, y) from the centre lies at d = (x, y, √(R² − x² − y²))/R on the
//! unit sphere. Between two frames a rotation with the angular velocity ω moves it so that, exactly,
//! d₂ − d₁ = g × (d₁ + d₂) with g = tan(|ω|Δt/2) ω/|ω|: linear in g, which makes a start from all markers
//! and frames at once. Then one least-squares fit of all marker positions, with ω at the impact and each
//! marker's place on the ball as unknowns, gives ω and its covariance.

use argmin::core::{Error, Jacobian, Operator};
use nalgebra::{DMatrix, DVector, Matrix3, SVector};
use num_dual::DualSVec64;

use crate::numerics::least_squares;
use crate::numerics::least_squares::{Bounds, Options};
use crate::physics::Number;
use crate::physics::ball::Vec3;

/// Angular velocity of a ball at the impact, table frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// The angular velocity, rad/s.
    pub spin: Vec3,
    /// Its covariance, (rad/s)²: from the noise of the markers and of the ball's centre.
    pub covariance: Matrix3<f64>,
    /// How many marker positions it rests on.
    pub positions: usize,
}

/// A marker's positions from the ball's centre over R, on one side of the impact.
pub(crate) struct Spot {
    /// Time from the impact (s), x/R and y/R, standard deviation over R.
    pub seen: Vec<(f64, [f64; 2], f64)>,
}

/// Nearer to the rim than this, the height of a marker is too uncertain to start from.
const RIM: f64 = 0.95;

/// A marker position this many standard deviations off is wrong.
const OUTLIER: f64 = 5.0;

/// Rounds of leaving out wrong positions.
const ROUNDS: usize = 6;

/// A fit stops within some millionths of a standard error of the minimum.
const ORTHOGONALITY: f64 = 1e-6;
const MAX_ITERATIONS: u32 = 100;

/// A scalar product of the start's matrix below this part of the largest leaves an axis open.
const OPEN: f64 = 1e-9;

/// A rough angular velocity, rad/s, if the markers' steps from frame to frame determine it.
pub(crate) fn rough(spots: &[Spot]) -> Option<Vec3> {
    // least squares of d₂ − d₁ = (Δt/2) ω × (d₁ + d₂)
    let mut matrix = Matrix3::zeros();
    let mut right = Vec3::zeros();
    for spot in spots {
        for pair in spot.seen.windows(2) {
            let [Some(first), Some(second)] = [lifted(pair[0].1), lifted(pair[1].1)] else { continue };
            let half = 0.5 * (pair[1].0 - pair[0].0);
            // ω × s = −[s]× ω
            let by_spin = -half * (first + second).cross_matrix();
            matrix += by_spin.transpose() * by_spin;
            right += by_spin.transpose() * (second - first);
        }
    }
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let svd = matrix.svd(true, true);
    let (most, least) = (svd.singular_values[0], svd.singular_values[2]);
    (most > 0.0 && least > OPEN * most).then(|| svd.solve(&right, 0.0).ok()).flatten()
}

/// On the upper half of the unit sphere.
fn lifted([x, y]: [f64; 2]) -> Option<Vec3> {
    let square = x * x + y * y;
    (square < RIM * RIM).then(|| Vec3::new(x, y, (1.0 - square).sqrt()))
}

/// Fits the angular velocity at the impact, and its constant change with time about horizontal axes.
/// `stated` says that the standard deviations are known, not to be estimated.
pub(crate) fn measure(spots: &[Spot], stated: bool) -> Option<Rotation> {
    let start = rough(spots)?;
    let mut problem = Problem { spots: spots.iter().filter_map(Placed::new).collect() };
    let mut x = DVector::zeros(SHARED + 2 * problem.spots.len());
    x.rows_mut(0, 3).copy_from(&start);
    for placed in &mut problem.spots {
        // where the marker nearest to the impact was, turned back to it
        let (time, place) = placed.nearest();
        placed.base = turn(place, start * -time);
    }
    let options = Options { orthogonality: ORTHOGONALITY, max_iterations: MAX_ITERATIONS };
    for _ in 0..ROUNDS {
        let positions: usize = problem.spots.iter().map(|placed| placed.seen.len()).sum();
        let dof = (2 * positions).checked_sub(x.len()).filter(|dof| *dof > 0)?;
        let free = Bounds::none(x.len());
        let solution = least_squares::minimise(&problem, &x, &free, &options).ok()?;
        x = solution.x;
        let scale = if stated { 1.0 } else { 2.0 * solution.cost / dof as f64 };
        // the worst first: they pull the others off
        let limit = (OUTLIER * scale.sqrt()).max(0.5 * solution.residuals.amax());
        if problem.leave_out(&solution.residuals, limit) {
            x = problem.without_empty(&x);
            continue;
        }
        let r = solution.jacobian.qr().r();
        let inverse = r.solve_upper_triangular(&DMatrix::identity(r.ncols(), r.ncols()))?;
        let normal = &inverse * inverse.transpose();
        let covariance: Matrix3<f64> = scale * normal.fixed_view::<3, 3>(0, 0).into_owned();
        let is_finite = covariance.iter().all(|entry| entry.is_finite());
        let spin = Vec3::new(x[0], x[1], x[2]);
        return is_finite.then_some(Rotation { spin, covariance, positions });
    }
    None
}

/// Number of unknowns that all markers of a ball share: its angular velocity at the impact, and the
/// change of that with time about x and y.
const SHARED: usize = 5;

/// A marker in the fit: its frames in the order of their distance from the impact.
struct Placed {
    seen: Vec<(f64, [f64; 2], f64)>,
    /// About where it is at the impact.
    base: Vec3,
}

impl Placed {
    fn new(spot: &Spot) -> Option<Self> {
        let mut seen = spot.seen.clone();
        seen.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        seen.iter().any(|(_, at, _)| lifted(*at).is_some()).then_some(Self { seen, base: Vec3::z() })
    }

    /// The frame nearest to the impact whose height is known.
    fn nearest(&self) -> (f64, Vec3) {
        let mut known = self.seen.iter().filter_map(|(time, at, _)| Some((*time, lifted(*at)?)));
        known.next().unwrap_or((0.0, Vec3::z()))
    }

    /// x, y of all frames, for ω, its change with time, and the two angles by which the marker's place
    /// differs from `base`.
    fn predict<T: Number>(&self, spin: [T; 3], change: [T; 2], off: [T; 2]) -> Vec<[T; 2]> {
        let [first, second] = across(&self.base);
        let place = std::array::from_fn(|i| off[0] * first[i] + off[1] * second[i] + self.base[i]);
        let length = dot(&place, &place).sqrt();
        let mut place = place.map(|component| component / length);
        let mut now = 0.0;
        self.seen
            .iter()
            .map(|(time, ..)| {
                let middle = 0.5 * (now + time);
                let mean = [spin[0] + change[0] * middle, spin[1] + change[1] * middle, spin[2]];
                let step = mean.map(|component| component * (time - now));
                place = turned(&place, &step);
                now = *time;
                [place[0], place[1]]
            })
            .collect()
    }
}

/// The least-squares problem: ω and its change, then two small angles for every marker.
struct Problem {
    spots: Vec<Placed>,
}

impl Problem {
    /// Removes the positions that are this far off, standardized; whether there were any.
    fn leave_out(&mut self, residuals: &DVector<f64>, limit: f64) -> bool {
        let mut wrong = residuals.as_slice().chunks(2).map(|xy| xy.iter().any(|r| r.abs() > limit));
        let mut any = false;
        for placed in &mut self.spots {
            placed.seen.retain(|_| {
                let off = wrong.next().unwrap_or(false);
                any |= off;
                !off
            });
        }
        any
    }

    /// Removes the markers of which no position is left; the unknowns without theirs.
    fn without_empty(&mut self, x: &DVector<f64>) -> DVector<f64> {
        let own = |i: usize| [SHARED + 2 * i, SHARED + 1 + 2 * i];
        let kept = (0..self.spots.len()).filter(|i| !self.spots[*i].seen.is_empty()).flat_map(own);
        let columns: Vec<usize> = (0..SHARED).chain(kept).collect();
        self.spots.retain(|placed| !placed.seen.is_empty());
        DVector::from_iterator(columns.len(), columns.into_iter().map(|column| x[column]))
    }

    fn rows(&self) -> usize {
        2 * self.spots.iter().map(|placed| placed.seen.len()).sum::<usize>()
    }
}

/// A number with derivatives by what markers share and a marker's own two angles.
type Own = DualSVec64<{ SHARED + 2 }>;

impl Operator for &Problem {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        let mut residuals = Vec::with_capacity(self.rows());
        for (i, placed) in self.spots.iter().enumerate() {
            let off = [x[SHARED + 2 * i], x[SHARED + 1 + 2 * i]];
            let predicted = placed.predict([x[0], x[1], x[2]], [x[3], x[4]], off);
            for (place, (_, at, sd)) in predicted.iter().zip(&placed.seen) {
                residuals.extend([(place[0] - at[0]) / sd, (place[1] - at[1]) / sd]);
            }
        }
        Ok(DVector::from_vec(residuals))
    }
}

impl Jacobian for &Problem {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        let mut jacobian = DMatrix::zeros(self.rows(), x.len());
        let mut row = 0;
        for (i, placed) in self.spots.iter().enumerate() {
            let own = [0, 1, 2, 3, 4, SHARED + 2 * i, SHARED + 1 + 2 * i];
            let [a, b, c, d, e, f, g]: [Own; SHARED + 2] =
                std::array::from_fn(|k| Own::from_re(x[own[k]]).derivative(k));
            let predicted = placed.predict([a, b, c], [d, e], [f, g]);
            for (place, (_, _, sd)) in predicted.iter().zip(&placed.seen) {
                for component in place {
                    let gradient: SVector<f64, { SHARED + 2 }> =
                        component.eps.unwrap_generic(nalgebra::Const, nalgebra::U1);
                    for (k, column) in own.into_iter().enumerate() {
                        jacobian[(row, column)] = gradient[k] / sd;
                    }
                    row += 1;
                }
            }
        }
        Ok(jacobian)
    }
}

/// Two directions across another.
fn across(direction: &Vec3) -> [Vec3; 2] {
    let other = if direction.z.abs() < 0.9 { Vec3::z() } else { Vec3::x() };
    let first = direction.cross(&other).normalize();
    [first, direction.cross(&first)]
}

/// A place on the ball after a rotation by a vector of angles (Rodrigues).
pub(crate) fn turn(place: Vec3, angles: Vec3) -> Vec3 {
    turned(&place.into(), &angles.into()).into()
}

/// d cos θ + (θ × d) sin θ/θ + θ (θ·d)(1 − cos θ)/θ².
fn turned<T: Number>(place: &[T; 3], angles: &[T; 3]) -> [T; 3] {
    /// Below this θ², the next terms of the series are rounding.
    const SMALL: f64 = 1e-5;
    let square = dot(angles, angles);
    let (sine, versine) = if square.re() < SMALL {
        // sin θ/θ = 1 − θ²/6 + θ⁴/120, (1 − cos θ)/θ² = 1/2 − θ²/24 + θ⁴/720
        let fourth = square * square;
        (fourth / 120.0 - square / 6.0 + 1.0, fourth / 720.0 - square / 24.0 + 0.5)
    } else {
        let angle = square.sqrt();
        (angle.sin() / angle, (-angle.cos() + 1.0) / square)
    };
    let cosine = -versine * square + 1.0;
    let along = dot(angles, place) * versine;
    let cross = cross(angles, place);
    std::array::from_fn(|i| place[i] * cosine + cross[i] * sine + angles[i] * along)
}

fn dot<T: Number>(a: &[T; 3], b: &[T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross<T: Number>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Roundings of some dozen rotations.
    const ROUNDING: f64 = 1e-9;

    #[test]
    fn a_turn_about_z_by_a_right_angle() {
        let turned = turn(Vec3::x(), Vec3::z() * std::f64::consts::FRAC_PI_2);
        assert!((turned - Vec3::y()).norm() < ROUNDING);
        // the series joins the closed form
        for angle in [3.1e-3, 3.2e-3] {
            let turned = turn(Vec3::x(), Vec3::z() * angle);
            assert!((turned - Vec3::new(angle.cos(), angle.sin(), 0.0)).norm() < 1e-15);
        }
    }

    /// Exact positions of a marker on a ball that spins with `spin` + `slowing`·t.
    fn spot(place: Vec3, spin: Vec3, slowing: Vec3) -> Spot {
        let at = |i: usize| {
            let steps = 200;
            let time = 1e-3 * (i as f64 + 0.4);
            let step = time / f64::from(steps);
            let place = (0..steps)
                .fold(place, |place, n| turn(place, (spin + slowing * step * (f64::from(n) + 0.5)) * step));
            (place, (time, [place.x, place.y], 1e-4))
        };
        let seen = (0..40).map(at).filter(|(place, _)| place.z > 0.1).map(|(_, seen)| seen);
        Spot { seen: seen.collect() }
    }

    #[test]
    fn one_marker_gives_the_whole_angular_velocity() {
        let (spin, slowing) = (Vec3::new(20.0, -60.0, 35.0), Vec3::new(30.0, 150.0, 0.0));
        let spots = [spot(Vec3::new(0.3, 0.4, 0.75_f64.sqrt()), spin, slowing)];
        let found = measure(&spots, true).unwrap();
        // steps of a frame, midpoint rule: (slowing × spin) Δt² / 12 per second
        assert!((found.spin - spin).norm() < 1e-3, "{}", found.spin);
        assert!(found.covariance.diagonal().iter().all(|variance| (1e-6..10.0).contains(variance)));
    }

    /// Within 1 ms the ball carries such a marker by 0.052 R, and not by 0.022 R.
    #[test]
    fn a_marker_of_which_every_position_is_wrong_is_left_out() {
        let (spin, slowing) = (Vec3::new(20.0, -60.0, 35.0), Vec3::new(30.0, 150.0, 0.0));
        let good = spot(Vec3::new(0.3, 0.4, 0.75_f64.sqrt()), spin, slowing);
        let wrong = Spot { seen: vec![(1.4e-3, [0.5, 0.0], 1e-4), (2.4e-3, [0.478, 0.0], 1e-4)] };
        let positions = good.seen.len();
        let found = measure(&[good, wrong], true).unwrap();
        assert!((found.spin - spin).norm() < 1e-3, "{}", found.spin);
        assert_eq!(found.positions, positions);
    }

    #[test]
    fn a_marker_on_the_axis_tells_nothing_and_two_frames_are_too_few() {
        let on_axis = Spot { seen: (0..20).map(|i| (1e-3 * f64::from(i), [0.0, 0.0], 1e-4)).collect() };
        assert!(measure(&[on_axis], true).is_none());
        let two = Spot { seen: vec![(0.0, [0.3, 0.0], 1e-4), (1e-3, [0.31, 0.0], 1e-4)] };
        assert!(measure(&[two], true).is_none());
    }
}
