//! The Fisher information that filmed shots hold about μ, μ_s, e, the cloth, the balls, the frame rate, the mean spins, the tilt and
//! the camera, each shot's own unknowns eliminated; and the standard errors that follow from it with the priors of a fit.

use nalgebra::{DMatrix, SMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::{Expected, PlayedKind, SpinFrom};
use crate::extraction::{Rotation, Rotations};
use crate::measurement::dataset::Dataset;
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::physics::ball::{BallState, Vec3};
use crate::physics::collision::{Model, NotACollision};
use crate::physics::contact_frame::cue_velocity;
use crate::problem::{self, Filming, Id, PlannedShot, Shared, Unknown, unknowns_of};
use crate::simulate::{self, Camera};

/// The unknowns: μ, μ_s, e, μ_k, μ_r, the ratios of the balls, and what else a film shares.
const IDS: [Id; 26] = [
    Id::Mu,
    Id::MuS,
    Id::E,
    Id::MuK,
    Id::MuR,
    Id::MassRatio,
    Id::RadiusRatio,
    Id::Bounce,
    Id::Rate,
    Id::Roll,
    Id::Slide,
    Id::TiltX,
    Id::TiltY,
    Id::Scale,
    Id::Aspect,
    Id::Shear,
    Id::PerspectiveX,
    Id::PerspectiveY,
    Id::Lens,
    Id::LensX,
    Id::LensY,
    Id::ShutterX,
    Id::ShutterY,
    Id::ParallaxX,
    Id::ParallaxY,
    Id::Nearness,
];
const SHARED: usize = IDS.len();

/// What stands in its own unit; the others are in parts of the standard deviation of their prior.
pub(crate) const COMMON: usize = 5;

/// Standard deviations of what is known beforehand of μ_k and μ_r.
const CLOTH_SD: [f64; 2] = [1.0, 0.005];

/// The ratios of the balls, behind the others.
pub(crate) const RATIOS: [Parameter; 2] = [Parameter::MassRatio, Parameter::RadiusRatio];

/// The Fisher information of μ, μ_s, e, μ_k, μ_r, m_cue/m_object, R_cue/R_object, e_t, the frame rate,
/// the mean topspins, the tilt and the camera, in this order: the inverse of the covariance that they are
/// determined to. Those behind μ_r are in parts of the standard deviation of what is known of them; of one
/// that is exact it is 0.
pub type Information = SMatrix<f64, SHARED, SHARED>;

/// Shots over which a kind is averaged, and instants of the shutter for a single cut and speed: doubling either moves
/// standard errors by less than 1 %.
pub(crate) const SAMPLES: usize = 512;
const PHASES: usize = 16;

/// Shots with markers that tell how well markers show spins: doubling moves the errors by a few per cent.
const MARKED: usize = 96;

/// The standard error of a spin that markers do not show, rad/s: ten times that of any shot.
pub(crate) const UNSEEN: f64 = 1e4;

/// An eigenvalue of the information, scaled to a diagonal of 1, that is rounding: the fit's own limit, 1e-5 of
/// the largest singular value, squared.
const ROUNDING: f64 = 1e-10;

/// All parameters are between 0 and 1: what would leave one open by a million even if all others were known is rounding.
const LEAST: f64 = 1e-12;

/// A parameter that has more than this in an undetermined direction is undetermined.
const SHARE: f64 = 1e-6;

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
    /// Speed, m/s, cut angle, rad, topspin in parts of the natural roll's.
    play: [f64; 3],
    /// Impact, in parts of a frame after the last one before it.
    phase: f64,
    /// Direction of the line of centres, rad, and place of the object ball, m from the middle of the film.
    direction: f64,
    place: [f64; 2],
}

fn between([from, to]: [f64; 2], part: f64) -> f64 {
    from + (to - from) * part
}

/// An average shot of a kind, spread evenly over its ranges.
///
/// # Errors
/// A shot of it is no collision.
pub(crate) fn of_kind(expected: &Expected, kind: &PlayedKind) -> Result<Average, NotACollision> {
    average(expected, kind, &(0..SAMPLES).map(|i| spread(kind, i)).collect::<Vec<_>>())
}

/// The i-th of shots that are spread evenly over a kind's ranges.
fn spread(kind: &PlayedKind, i: usize) -> Shot {
    /// The additive recurrence that fills seven dimensions most evenly: powers of 1/g, g⁸ = g + 1.
    const G: f64 = 1.096_981_557_798_559_8;
    let part = |power: i32| (0.5 + i as f64 * G.powi(-power)).fract();
    let [speed, cut_deg] = [between(kind.speed_m_s, part(1)), between(kind.cut_deg, part(2))];
    Shot {
        play: [speed, cut_deg.to_radians(), between(kind.topspin, part(3))],
        phase: part(4),
        direction: std::f64::consts::TAU * part(5),
        place: [6, 7].map(|power| (part(power) - 0.5) * (Camera::FIELD_M[1] - Camera::FIELD_M[0])),
    }
}

/// The standard errors (rad/s) to which two markers on each ball show the side spins of the cue ball and of the
/// object ball: those that the extraction states for such shots without noise, from the frame rate, the noise, how long
/// each marker is filmed and where it sits. The mean of 1/variance over shots: shots whose markers sit well
/// count most. `None` where no shot's markers show a spin.
///
/// # Errors
/// A shot of the kind is no collision.
pub fn shown_by_markers(expected: &Expected, kind: &PlayedKind) -> Result<Option<[f64; 2]>, NotACollision> {
    let measured: Result<Vec<Rotations>, NotACollision> = (0..MARKED)
        .into_par_iter()
        .map(|i| {
            let Shot { play, phase, .. } = spread(kind, i);
            let (cue, model) = played(expected, kind, play);
            let Expected { coefficients, cloth, camera, .. } = expected;
            let (track, truth) =
                simulate::noise_free(&model, coefficients, (camera, cloth), &cue, (phase, &places(i)))?;
            Ok(Rotations::of(&track, truth.time, expected.ball.radius, camera.position_sd_m))
        })
        .collect();
    let measured = measured?;
    let of = |pick: fn(&Rotations) -> Option<Rotation>| {
        let rotations = measured.iter().filter_map(pick);
        let weights: Vec<f64> = rotations.map(|r| r.covariance[(2, 2)].recip()).collect();
        (!weights.is_empty()).then(|| (weights.len() as f64 / weights.iter().sum::<f64>()).sqrt())
    };
    Ok(of(|r| r.cue_after).zip(of(|r| r.object_after)).map(|(cue, object)| [cue, object]))
}

/// Where the two markers of the i-th shot sit at the impact, on the cue ball and on the object ball: on the upper quarter of
/// the ball, evenly spread over all shots, as [`crate::simulate`] draws them.
fn places(i: usize) -> [Vec<Vec3>; 2] {
    /// As of [`spread`], in eight dimensions: g⁹ = g + 1.
    const G: f64 = 1.085_070_245_491_451;
    let part = |power: i32| (0.5 + i as f64 * G.powi(-power)).fract();
    let place = |power: i32| {
        let height = between([0.5, 0.95], part(power));
        let angle = between([0.0, std::f64::consts::TAU], part(power + 1));
        let across = (1.0 - height * height).sqrt();
        Vec3::new(across * angle.cos(), across * angle.sin(), height)
    };
    [[1, 3], [5, 7]].map(|powers| powers.map(place).to_vec())
}

/// The cue ball just before the impact of a shot, and the model of the collision.
pub(super) fn played(
    expected: &Expected,
    kind: &PlayedKind,
    [speed, cut, topspin]: [f64; 3],
) -> (BallState, Model) {
    let velocity = cue_velocity(speed, cut);
    let rolling = BallState::natural_roll(velocity, expected.ball.radius).spin;
    let spin = topspin * rolling + Vec3::z() * (kind.side * rolling.norm());
    (BallState { velocity, spin }, expected.model())
}

/// An average shot of a kind at one cut angle (degrees) and one speed.
///
/// # Errors
/// It is no collision.
pub(crate) fn of_cell(
    expected: &Expected,
    kind: &PlayedKind,
    speed: f64,
    cut_deg: f64,
) -> Result<Average, NotACollision> {
    /// The golden ratio's part spreads the spins evenly over the instants.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let shot = |i: usize| {
        let topspin = between(kind.topspin, (0.5 + i as f64 * GOLDEN).fract());
        let spread = spread(kind, i);
        let phase = (i as f64 + 0.5) / PHASES as f64;
        Shot { play: [speed, cut_deg.to_radians(), topspin], phase, ..spread }
    };
    average(expected, kind, &(0..PHASES).map(shot).collect::<Vec<_>>())
}

fn average(expected: &Expected, kind: &PlayedKind, shots: &[Shot]) -> Result<Average, NotACollision> {
    let (unknowns, shared) = unknowns(expected);
    let of_shot = |shot: &Shot| of_shot(expected, kind, *shot, (&unknowns, &shared));
    let found: Result<Vec<Option<Information>>, NotACollision> = shots.par_iter().map(of_shot).collect();
    let found = found?;
    let count = shots.len() as f64;
    let told: Vec<&Information> = found.iter().flatten().collect();
    let unusable = 1.0 - told.len() as f64 / count;
    Ok(Average { information: told.into_iter().sum::<Information>() / count, unusable })
}

/// The unknowns of a film of what is expected, with values that are expected of them.
fn unknowns(expected: &Expected) -> (Vec<Unknown>, Shared) {
    let spins: Vec<Spin> = expected.kinds.iter().map(|kind| spin_of(kind, kind.topspin[0])).collect();
    let mut dataset = Dataset::new("design", expected.ball, Vec::new());
    dataset.object = expected.object;
    let unknowns = unknowns_of(&dataset, &spins);
    let mut shared = Shared(unknowns.iter().map(|unknown| unknown.start).collect());
    let (truth, cloth) = (&expected.coefficients, &expected.cloth);
    let values = [
        (Id::Mu, truth.mu),
        (Id::MuS, truth.mu_s),
        (Id::E, truth.e),
        (Id::MuK, cloth.mu_k),
        (Id::MuR, cloth.mu_r),
        (Id::Bounce, cloth.bounce),
    ];
    for (id, value) in values {
        shared[id] = value;
    }
    (unknowns, shared)
}

/// What whoever fits a shot of a kind knows of its spin, but for what was measured.
fn spin_of(kind: &PlayedKind, topspin: f64) -> Spin {
    match kind.from {
        SpinFrom::Known if kind.side == 0.0 && topspin == 1.0 => Spin::NaturalRoll,
        SpinFrom::Known if kind.side == 0.0 && topspin == 0.0 => Spin::Stun,
        SpinFrom::Known | SpinFrom::Markers { .. } => Spin::Measured { spin: Vec3::zeros(), sd: [None; 3] },
        SpinFrom::Motion => Spin::Unknown,
    }
}

/// The information of one shot's frames; `None` where they do not tell the shot's own unknowns.
fn of_shot(
    expected: &Expected,
    kind: &PlayedKind,
    shot: Shot,
    (unknowns, shared): (&[Unknown], &Shared),
) -> Result<Option<Information>, NotACollision> {
    let (cue, model) = played(expected, kind, shot.play);
    let camera = &expected.camera;
    let shown = match kind.from {
        SpinFrom::Markers { sd } => Some(sd.unwrap_or([UNSEEN; 2])),
        _ => None,
    };
    // from the frame of the collision to that of the table
    let (sin, cos) = shot.direction.sin_cos();
    let turned =
        Vec3::new(cos * cue.spin.x - sin * cue.spin.y, sin * cue.spin.x + cos * cue.spin.y, cue.spin.z);
    let spin = match spin_of(kind, shot.play[2]) {
        Spin::Measured { .. } => {
            // about horizontal axes it turns the height of markers, too, which is not seen
            let horizontal = shown.map(|[cue, _]| 2.0 * cue);
            Spin::Measured { spin: turned, sd: [horizontal, horizontal, shown.map(|[cue, _]| cue)] }
        }
        stated => stated,
    };
    let [before, after] = camera.frames();
    let planned = PlannedShot {
        velocity: [cue.velocity.x, cue.velocity.y],
        direction: shot.direction,
        place: shot.place,
        instant: (before as f64 + shot.phase) / camera.fps,
        topspin: shot.play[2],
        shots: kind.shots,
        topspin_sd: (kind.topspin[1] - kind.topspin[0]) / 12_f64.sqrt(),
        spin,
        after_sd: shown,
    };
    let filming = Filming { fps: camera.fps, frames: 1 + before + after, sd: camera.position_sd_m };
    let found = problem::information(&planned, &filming, (&model, unknowns, shared))?;
    // what is exact is not told, and what has a prior is in its unit
    let unit = |i: usize| {
        let unknown = &unknowns[IDS[i] as usize];
        match unknown.prior {
            _ if unknown.mode != problem::Mode::Free => 0.0,
            Some(prior) if i >= COMMON => prior.sd,
            _ => 1.0,
        }
    };
    let units: [f64; SHARED] = std::array::from_fn(unit);
    Ok(found.map(|all| {
        let at = |i: usize, j: usize| units[i] * all[(IDS[i] as usize, IDS[j] as usize)] * units[j];
        Information::from_fn(at)
    }))
}

/// What is known beforehand, as information.
pub(crate) fn prior() -> Information {
    let mut prior = Information::identity();
    prior.fixed_view_mut::<COMMON, COMMON>(0, 0).fill(0.0);
    for (i, sd) in CLOTH_SD.into_iter().enumerate() {
        let place = COMMON - CLOTH_SD.len() + i;
        prior[(place, place)] = sd.powi(-2);
    }
    prior
}

/// A with AᵀA the information.
pub(crate) fn root(information: &Information) -> DMatrix<f64> {
    let (scale, eigen) = scaled(information);
    DMatrix::from_fn(SHARED, SHARED, |i, j| {
        let told = eigen.eigenvalues[i].max(0.0).sqrt() * eigen.eigenvectors[(j, i)];
        if scale[j] > 0.0 { told / scale[j] } else { 0.0 }
    })
}

/// The information scaled to a diagonal of 1 as eigenvalues and -vectors, and the scales; both 0 for a parameter that is
/// not told.
fn scaled(information: &Information) -> ([f64; SHARED], SymmetricEigen<f64, nalgebra::Const<SHARED>>) {
    let scale: [f64; SHARED] = std::array::from_fn(|i| {
        let own = information[(i, i)];
        if own > LEAST { own.sqrt().recip() } else { 0.0 }
    });
    let matrix = Information::from_fn(|i, j| scale[i] * information[(i, j)] * scale[j]);
    (scale, matrix.symmetric_eigen())
}

/// Covariance of what [`Information`] is of after shots with this much of it, with what is known beforehand; NaN for what is not
/// determined.
pub(crate) fn covariance(information: &Information) -> Information {
    let (scale, eigen) = scaled(&(information + prior()));
    let mut covariance = Information::zeros();
    let mut undetermined = [0.0; SHARED];
    for (k, value) in eigen.eigenvalues.iter().enumerate() {
        let vector = eigen.eigenvectors.column(k);
        if *value > ROUNDING {
            covariance += vector * vector.transpose() / *value;
        } else {
            for (i, share) in undetermined.iter_mut().enumerate() {
                *share += vector[i].powi(2);
            }
        }
    }
    Information::from_fn(|i, j| {
        let told = undetermined[i] <= SHARE && undetermined[j] <= SHARE;
        if told { scale[i] * covariance[(i, j)] * scale[j] } else { f64::NAN }
    })
}

/// The standard errors of μ, μ_s and e that this information gives; `None` for what it does not determine.
#[must_use]
pub fn std_errors(information: &Information) -> [Option<f64>; 3] {
    let covariance = covariance(information);
    std::array::from_fn(|i| Some(covariance[(i, i)].sqrt()).filter(|error| error.is_finite()))
}

/// The standard errors of both ratios that this information gives, stated to these standard deviations; `None` of one that is exact.
pub(crate) fn ratio_errors(information: &Information, stated: [f64; 2]) -> [Option<f64>; 2] {
    let covariance = covariance(information);
    std::array::from_fn(|i| {
        Some(stated[i] * covariance[(COMMON + i, COMMON + i)].sqrt()).filter(|error| *error > 0.0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nothing_tells_has_no_error_and_leaves_the_others() {
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
        // a rounding error is no information
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
