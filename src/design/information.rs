//! The Fisher information that filmed shots hold about the unknowns that all shots of a film share, as the problem of a fit has it
//! ([`crate::problem`]), and the standard errors that follow from it with the priors of a fit.

use nalgebra::{Const, DMatrix, SMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::{Expected, PlayedKind, SpinFrom};
use crate::extraction::{Rotation, Rotations};
use crate::measurement::dataset::Dataset;
use crate::measurement::spin::Spin;
use crate::physics::ball::{BallState, Vec3};
use crate::physics::collision::{Model, NotACollision};
use crate::physics::contact_frame::{CollisionFrame, cue_velocity};
use crate::problem::{self, Filming, Id, Mode, PlannedShot, Shared, Unknown, unknowns_of};
use crate::simulate::{self, Camera, between};

const SHARED: usize = Id::ALL.len();

/// The unknowns whose information is in their own units, each with the standard deviation of its prior if it has one. The others
/// are in standard deviations of their priors.
pub(crate) const IN_UNITS: [(Id, Option<f64>); 5] =
    [(Id::Mu, None), (Id::MuS, None), (Id::E, None), (Id::MuK, Some(1.0)), (Id::MuR, Some(0.005))];

/// The Fisher information of the unknowns that all shots share, in the order of [`Id`]: the inverse of their covariance. That of
/// an unknown that is exact is 0.
pub type Information = SMatrix<f64, SHARED, SHARED>;

/// Shots over which a kind is averaged, and instants of the shutter for a single cut and speed: doubling either moves
/// standard errors by less than 1 %.
const SAMPLES: usize = 512;
const PHASES: usize = 16;

/// Shots with markers over which the errors of spins are averaged: doubling moves the errors by a few per cent.
const MARKED: usize = 96;

/// The standard error of a spin that markers do not show, rad/s: ten times that of any shot.
pub(crate) const UNSEEN: f64 = 1e4;

/// Information of an average shot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Average {
    /// The Fisher information.
    pub information: Information,
    /// Fraction of the shots whose frames do not determine their own motion.
    pub unusable: f64,
}

/// How one shot is played.
#[derive(Clone, Copy, Debug)]
struct Shot {
    /// Speed, m/s.
    speed: f64,
    /// Cut angle, degrees.
    cut_deg: f64,
    /// Topspin, as a fraction of the natural roll's.
    topspin: f64,
    /// Instant of the impact, in frames after the last one before it.
    phase: f64,
    /// Direction of the line of centres, rad.
    direction: f64,
    /// Place of the object ball, m from the middle of the film.
    place: [f64; 2],
}

/// Returns coordinate `k` (from 1) of the i-th of points that fill a unit cube evenly: multiples of g⁻ᵏ, where g^(d + 1) = g + 1
/// in d dimensions (Roberts 2018; the golden ratio in one).
fn even(dimensions: i32, i: usize, k: i32) -> f64 {
    let g = (0..60).fold(1.0_f64, |g, _| (1.0 + g).powf(1.0 / f64::from(dimensions + 1)));
    (0.5 + i as f64 * g.powi(-k)).fract()
}

/// Returns the i-th of shots that are spread evenly over the ranges of a kind.
fn spread(kind: &PlayedKind, i: usize) -> Shot {
    let part = |k: i32| even(7, i, k);
    Shot {
        speed: between(kind.speed_m_s, part(1)),
        cut_deg: between(kind.cut_deg, part(2)),
        topspin: between(kind.topspin, part(3)),
        phase: part(4),
        direction: std::f64::consts::TAU * part(5),
        place: [6, 7].map(|k| (part(k) - 0.5) * (Camera::FIELD_M[1] - Camera::FIELD_M[0])),
    }
}

/// Returns the information of an average shot of a kind, spread evenly over its ranges.
///
/// # Errors
/// A shot is not a collision.
pub(crate) fn of_kind(expected: &Expected, kind: &PlayedKind) -> Result<Average, NotACollision> {
    average(expected, kind, &(0..SAMPLES).map(|i| spread(kind, i)).collect::<Vec<_>>())
}

/// Returns the information of an average shot of a kind at one cut angle (degrees) and one speed.
///
/// # Errors
/// It is not a collision.
pub(crate) fn of_cell(
    expected: &Expected,
    kind: &PlayedKind,
    speed: f64,
    cut_deg: f64,
) -> Result<Average, NotACollision> {
    let shot = |i: usize| Shot {
        speed,
        cut_deg,
        topspin: between(kind.topspin, even(1, i, 1)),
        phase: (i as f64 + 0.5) / PHASES as f64,
        ..spread(kind, i)
    };
    average(expected, kind, &(0..PHASES).map(shot).collect::<Vec<_>>())
}

/// Returns the standard errors (rad/s) to which two markers on each ball show the side spins of the cue ball and of the
/// object ball, as the extraction states them for such shots without noise: by the frame rate, the noise, and the time and place of
/// each marker. It is the mean of 1/variance over shots, so that those whose markers are well placed count most. `None` if the markers
/// of no shot show a spin.
///
/// # Errors
/// A shot of the kind is not a collision.
pub fn shown_by_markers(expected: &Expected, kind: &PlayedKind) -> Result<Option<[f64; 2]>, NotACollision> {
    let Expected { coefficients, cloth, camera, ball, .. } = expected;
    let measure = |i: usize| {
        let shot = spread(kind, i);
        let (cue, model) = played(expected, kind, [shot.speed, shot.cut_deg, shot.topspin]);
        let markers = (shot.phase, &places(i));
        let (track, truth) = simulate::noise_free(&model, coefficients, (camera, cloth), &cue, markers)?;
        Ok(Rotations::of(&track, truth.time, ball.radius, camera.position_sd_m))
    };
    let measured: Vec<Rotations> =
        (0..MARKED).into_par_iter().map(measure).collect::<Result<_, NotACollision>>()?;
    let error = |pick: fn(&Rotations) -> Option<Rotation>| {
        let rotations = measured.iter().filter_map(pick);
        let weights: Vec<f64> = rotations.map(|r| r.covariance[(2, 2)].recip()).collect();
        (!weights.is_empty()).then(|| (weights.len() as f64 / weights.iter().sum::<f64>()).sqrt())
    };
    Ok(error(|r| r.cue_after).zip(error(|r| r.object_after)).map(|(cue, object)| [cue, object]))
}

/// Returns the places of the two markers of the i-th shot at the impact, on the cue ball and on the object ball, spread evenly over
/// all shots.
fn places(i: usize) -> [Vec<Vec3>; 2] {
    [[1, 3], [5, 7]].map(|ks| ks.map(|k| simulate::on_top(even(8, i, k), even(8, i, k + 1))).to_vec())
}

/// Returns the cue ball just before the impact of a shot of this speed, cut angle (degrees) and topspin, and the model of the
/// collision.
pub(super) fn played(
    expected: &Expected,
    kind: &PlayedKind,
    [speed, cut_deg, topspin]: [f64; 3],
) -> (BallState, Model) {
    let velocity = cue_velocity(speed, cut_deg.to_radians());
    let rolling = BallState::natural_roll(velocity, expected.ball.radius).spin;
    let spin = topspin * rolling + Vec3::z() * (kind.side * rolling.norm());
    (BallState { velocity, spin }, expected.model())
}

fn average(expected: &Expected, kind: &PlayedKind, shots: &[Shot]) -> Result<Average, NotACollision> {
    let (unknowns, shared) = unknowns(expected);
    let of_shot = |shot: &Shot| of_shot(expected, kind, *shot, (&unknowns, &shared));
    let found: Vec<Option<Information>> = shots.par_iter().map(of_shot).collect::<Result<_, _>>()?;
    let count = shots.len() as f64;
    let usable = found.iter().flatten().count() as f64;
    Ok(Average {
        information: found.iter().flatten().sum::<Information>() / count,
        unusable: 1.0 - usable / count,
    })
}

/// Returns the unknowns of a film of what is expected, and the values that are expected of them.
fn unknowns(expected: &Expected) -> (Vec<Unknown>, Shared) {
    let spins: Vec<Spin> = expected.kinds.iter().map(|kind| spin_of(kind, kind.topspin[0])).collect();
    let mut dataset = Dataset::new("design", expected.ball, Vec::new());
    dataset.object = expected.object;
    let unknowns = unknowns_of(&dataset, &spins);
    let mut shared = Shared(unknowns.iter().map(|unknown| unknown.start).collect());
    let (truth, cloth) = (&expected.coefficients, &expected.cloth);
    (shared[Id::Mu], shared[Id::MuS], shared[Id::E]) = (truth.mu, truth.mu_s, truth.e);
    (shared[Id::MuK], shared[Id::MuR], shared[Id::Bounce]) = (cloth.mu_k, cloth.mu_r, cloth.bounce);
    (unknowns, shared)
}

/// Returns what a fit of a shot of a kind knows of its spin, without measured numbers.
fn spin_of(kind: &PlayedKind, topspin: f64) -> Spin {
    match kind.from {
        SpinFrom::Known if kind.side == 0.0 && topspin == 1.0 => Spin::NaturalRoll,
        SpinFrom::Known if kind.side == 0.0 && topspin == 0.0 => Spin::Stun,
        SpinFrom::Known | SpinFrom::Markers { .. } => Spin::Measured { spin: Vec3::zeros(), sd: [None; 3] },
        SpinFrom::Motion => Spin::Unknown,
    }
}

/// Returns the information of the frames of one shot; `None` if they do not determine its own unknowns.
fn of_shot(
    expected: &Expected,
    kind: &PlayedKind,
    shot: Shot,
    (unknowns, shared): (&[Unknown], &Shared),
) -> Result<Option<Information>, NotACollision> {
    let (cue, model) = played(expected, kind, [shot.speed, shot.cut_deg, shot.topspin]);
    let camera = &expected.camera;
    let shown = match kind.from {
        SpinFrom::Markers { sd } => Some(sd.unwrap_or([UNSEEN; 2])),
        SpinFrom::Known | SpinFrom::Motion => None,
    };
    let spin = match spin_of(kind, shot.topspin) {
        Spin::Measured { .. } => {
            // a rotation about a horizontal axis also changes the height of markers, which is not seen
            let horizontal = shown.map(|[cue, _]| 2.0 * cue);
            let sd = [horizontal, horizontal, shown.map(|[cue, _]| cue)];
            Spin::Measured { spin: CollisionFrame::from_direction(shot.direction).to_table(cue.spin), sd }
        }
        stated => stated,
    };
    let [before, after] = camera.frames();
    let planned = PlannedShot {
        velocity: [cue.velocity.x, cue.velocity.y],
        direction: shot.direction,
        place: shot.place,
        instant: (before as f64 + shot.phase) / camera.fps,
        topspin: shot.topspin,
        shots: kind.shots,
        topspin_sd: (kind.topspin[1] - kind.topspin[0]) / 12_f64.sqrt(),
        spin,
        after_sd: shown,
    };
    let filming = Filming { fps: camera.fps, frames: 1 + before + after, sd: camera.position_sd_m };
    let found = problem::information(&planned, &filming, (&model, unknowns, shared))?;
    let unit = |unknown: &Unknown| match unknown.prior {
        _ if unknown.mode != Mode::Free => 0.0,
        Some(prior) if IN_UNITS.iter().all(|(id, _)| *id != unknown.id) => prior.sd,
        _ => 1.0,
    };
    let units: Vec<f64> = unknowns.iter().map(unit).collect();
    Ok(found.map(|all| Information::from_fn(|i, j| units[i] * all[(i, j)] * units[j])))
}

/// Returns the priors as information.
pub(crate) fn prior() -> Information {
    let mut prior = Information::identity();
    for (id, sd) in IN_UNITS {
        prior[(id as usize, id as usize)] = sd.map_or(0.0, |sd| sd.powi(-2));
    }
    prior
}

/// Returns A with AᵀA the information.
pub(crate) fn root(information: &Information) -> DMatrix<f64> {
    let (scale, eigen) = scaled(information);
    DMatrix::from_fn(SHARED, SHARED, |i, j| {
        let value = eigen.eigenvalues[i].max(0.0).sqrt() * eigen.eigenvectors[(j, i)];
        if scale[j] > 0.0 { value / scale[j] } else { 0.0 }
    })
}

/// Returns the information scaled to a diagonal of 1 as eigenvalues and eigenvectors, and the scales; both 0 for an unknown that
/// is not determined.
fn scaled(information: &Information) -> ([f64; SHARED], SymmetricEigen<f64, Const<SHARED>>) {
    // coefficients are between 0 and 1: a standard error of a million, if all others were known, is rounding
    let scale: [f64; SHARED] = std::array::from_fn(|i| {
        let own = information[(i, i)];
        if own > 1e-12 { own.sqrt().recip() } else { 0.0 }
    });
    let matrix = Information::from_fn(|i, j| scale[i] * information[(i, j)] * scale[j]);
    (scale, matrix.symmetric_eigen())
}

/// Returns the covariance of the unknowns after shots with this information, with the priors; NaN for unknowns that are not
/// determined.
pub(crate) fn covariance(information: &Information) -> Information {
    let (scale, eigen) = scaled(&(information + prior()));
    let mut covariance = Information::zeros();
    let mut undetermined = [0.0; SHARED];
    for (k, value) in eigen.eigenvalues.iter().enumerate() {
        let vector = eigen.eigenvectors.column(k);
        // a smaller eigenvalue is rounding: the limit of fits, 1e-5 of the largest singular value, squared
        if *value > 1e-10 {
            covariance += vector * vector.transpose() / *value;
        } else {
            undetermined.iter_mut().zip(&vector).for_each(|(share, part)| *share += part.powi(2));
        }
    }
    Information::from_fn(|i, j| {
        // a larger part in undetermined directions is more than rounding
        let is_determined = undetermined[i].max(undetermined[j]) <= 1e-6;
        if is_determined { scale[i] * covariance[(i, j)] * scale[j] } else { f64::NAN }
    })
}

/// Returns the standard errors of μ, μ_s and e with this information; `None` if it does not determine one.
#[must_use]
pub fn std_errors(information: &Information) -> [Option<f64>; 3] {
    let covariance = covariance(information);
    Id::WANTED.map(|id| Some(covariance[(id as usize, id as usize)].sqrt()).filter(|error| error.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_undetermined_unknown_has_no_error_and_leaves_the_others() {
        let mut information = Information::zeros();
        assert_eq!(std_errors(&information), [None; 3]);
        (information[(0, 0)], information[(2, 2)]) = (4.0e6, 1.0e8);
        let [mu, mu_s, e] = std_errors(&information);
        assert!(mu_s.is_none());
        assert!((mu.unwrap() - 5e-4).abs() < 1e-12 && (e.unwrap() - 1e-4).abs() < 1e-12);
        // only μ − μ_s
        for (i, j, sign) in [(0, 0, 1.0), (0, 1, -1.0), (1, 0, -1.0), (1, 1, 1.0)] {
            information[(i, j)] = sign * 1e6;
        }
        let [mu, mu_s, e] = std_errors(&information);
        assert!(mu.is_none() && mu_s.is_none() && e.is_some());
        // a rounding error is not information
        information = Information::zeros();
        (information[(0, 0)], information[(1, 1)]) = (1e6, 1e-100);
        assert!(std_errors(&information)[0].is_some() && std_errors(&information)[1].is_none());
        assert_eq!(root(&information)[(1, 1)], 0.0);
    }

    #[test]
    fn the_root_of_the_information_squares_to_it() {
        let a = Information::from_fn(|i, j| 10_f64.powi(i as i32) * ((i + 2 * j) as f64).sin());
        let information = a.transpose() * a;
        let root = root(&information);
        assert!((root.tr_mul(&root) - information).amax() < 1e-9 * information.amax());
    }
}
