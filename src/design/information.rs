//! The Fisher information that filmed shots hold about their shared unknowns, and the standard
//! errors that follow from it with the priors of a fit.

use nalgebra::SMatrix;

use super::{Expected, PlayedKind, SpinFrom};
use crate::measurement::dataset::Dataset;
use crate::measurement::spin::Spin;
use crate::physics::ball::Vec3;
use crate::physics::collision::NotACollision;
use crate::physics::contact_frame::CollisionFrame;
use crate::problem::{self, Filming, Id, Mode, PlannedShot, Shared, Unknown, unknowns_of};
use crate::simulate::{Camera, between, cue_ball};

const SHARED: usize = Id::ALL.len();

/// The Fisher information of the unknowns that all shots share, in the order of [`Id`]: the inverse
/// of their covariance. Unknowns with a prior, but for μ, μ_s and e, are in its standard
/// deviations; the information of an unknown that is exact is 0.
pub(crate) type Information = SMatrix<f64, SHARED, SHARED>;

/// Shots over which a kind is averaged, and instants of the shutter for a single cut and speed:
/// doubling either moves standard errors by less than 1 %.
const SAMPLES: usize = 512;
const PHASES: usize = 16;

/// Returns coordinate `k` (from 1) of the i-th of points that fill a unit cube evenly: multiples of
/// g⁻ᵏ with g^(d + 1) = g + 1 in d dimensions (Roberts 2018; the golden ratio in one).
fn even(dimensions: i32, i: usize, k: i32) -> f64 {
    let g = (0..60).fold(1.0_f64, |g, _| (1.0 + g).powf(1.0 / f64::from(dimensions + 1)));
    (0.5 + i as f64 * g.powi(-k)).fract()
}

/// Returns the information of an average shot of a kind: spread evenly over its ranges, or at one
/// speed (m/s) and cut angle (degrees).
///
/// # Errors
/// A shot is not a collision.
pub(crate) fn average(
    expected: &Expected,
    kind: &PlayedKind,
    at: Option<[f64; 2]>,
) -> Result<Information, NotACollision> {
    let (unknowns, shared) = unknowns(expected);
    let Camera { fps, position_sd_m: sd, .. } = expected.camera;
    let [before, after] = expected.camera.frames();
    let topspin_sd = (kind.topspin[1] - kind.topspin[0]).abs() / 12_f64.sqrt();
    let filming = Filming { shots: kind.shots, topspin_sd, fps, frames: 1 + before + after, sd };
    let count = if at.is_some() { PHASES } else { SAMPLES };
    let shots: Vec<PlannedShot> = (0..count).map(|i| sample(expected, kind, i, at)).collect();
    let informations = problem::information(&shots, &filming, (&expected.model(), &unknowns, &shared))?;
    let unit = |unknown: &Unknown| match unknown.prior {
        _ if unknown.mode != Mode::Free => 0.0,
        Some(prior) if !Id::WANTED.contains(&unknown.id) => prior.sd,
        _ => 1.0,
    };
    let units: Vec<f64> = unknowns.iter().map(unit).collect();
    let sum = |i: usize, j: usize| informations.iter().flatten().map(|of_shot| of_shot[(i, j)]).sum::<f64>();
    Ok(Information::from_fn(|i, j| units[i] * sum(i, j) * units[j] / count as f64))
}

/// Returns the unknowns of a film of the expected experiment, and their expected values.
fn unknowns(expected: &Expected) -> (Vec<Unknown>, Shared) {
    let spins: Vec<Spin> = expected.kinds.iter().map(|kind| stated_spin(kind, kind.topspin[0])).collect();
    let mut dataset = Dataset::new("design", expected.ball, Vec::new());
    dataset.object = expected.object;
    let unknowns = unknowns_of(&dataset, &spins);
    let mut shared = Shared(unknowns.iter().map(|unknown| unknown.start).collect());
    let (truth, cloth) = (&expected.coefficients, &expected.cloth);
    (shared[Id::Mu], shared[Id::MuS], shared[Id::E]) = (truth.mu, truth.mu_s, truth.e);
    (shared[Id::MuK], shared[Id::MuR], shared[Id::Bounce]) = (cloth.sliding, cloth.rolling, cloth.bounce);
    (unknowns, shared)
}

/// Returns what a fit of a shot of a kind knows of its spin, without measured numbers.
fn stated_spin(kind: &PlayedKind, topspin: f64) -> Spin {
    match kind.source() {
        SpinFrom::Known if kind.side == 0.0 && topspin == 1.0 => Spin::NaturalRoll,
        SpinFrom::Known if kind.side == 0.0 && topspin == 0.0 => Spin::Stun,
        SpinFrom::Known | SpinFrom::Markers => Spin::Measured { spin: Vec3::zeros(), sd: [None; 3] },
        SpinFrom::Motion => Spin::Unknown,
    }
}

/// Returns the i-th of shots of a kind, spread evenly over its ranges or at one speed and cut
/// angle.
fn sample(expected: &Expected, kind: &PlayedKind, i: usize, at: Option<[f64; 2]>) -> PlannedShot {
    let part = |k: i32| even(7, i, k);
    let [speed, cut_deg] = at.unwrap_or([between(kind.speed_m_s, part(1)), between(kind.cut_deg, part(2))]);
    let (of_topspin, phase) = match at {
        Some(_) => (even(1, i, 1), (i as f64 + 0.5) / PHASES as f64),
        None => (part(3), part(4)),
    };
    let topspin = between(kind.topspin, of_topspin);
    let direction = std::f64::consts::TAU * part(5);
    let cue = cue_ball(speed, cut_deg.to_radians(), [topspin, kind.side], expected.ball.radius);
    let shown = kind.spin_sd_rad_s.filter(|_| kind.source() == SpinFrom::Markers);
    let spin = match stated_spin(kind, topspin) {
        Spin::Measured { .. } => {
            // the height of markers is not seen
            let horizontal = shown.map(|[cue, _]| 2.0 * cue);
            let sd = [horizontal, horizontal, shown.map(|[cue, _]| cue)];
            Spin::Measured { spin: CollisionFrame::from_direction(direction).to_table(cue.spin), sd }
        }
        stated => stated,
    };
    PlannedShot {
        velocity: [cue.velocity.x, cue.velocity.y],
        direction,
        place: [6, 7].map(|k| (part(k) - 0.5) * (Camera::FIELD_M[1] - Camera::FIELD_M[0])),
        instant: (expected.camera.frames()[0] as f64 + phase) / expected.camera.fps,
        topspin,
        spin,
        after_sd: shown,
    }
}

/// Returns the covariance of the unknowns with the priors; NaN if they are not determined.
pub(crate) fn covariance(information: &Information) -> Information {
    let mut information = *information;
    for id in Id::ALL.into_iter().filter(|id| !Id::WANTED.contains(id)) {
        information[(id as usize, id as usize)] += 1.0;
    }
    // of coefficients between 0 and 1 a standard error of a million is rounding
    let scale: [f64; SHARED] = std::array::from_fn(|i| {
        let information_alone = information[(i, i)];
        if information_alone > 1e-12 { information_alone.sqrt().recip() } else { 0.0 }
    });
    let eigen = Information::from_fn(|i, j| scale[i] * information[(i, j)] * scale[j]).symmetric_eigen();
    let mut covariance = Information::zeros();
    let mut undetermined = [0.0; SHARED];
    for (k, value) in eigen.eigenvalues.iter().enumerate() {
        let vector = eigen.eigenvectors.column(k);
        // less is rounding: the limit of fits, 1e-5 of the largest singular value, squared
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

/// Returns the standard errors of μ, μ_s and e with this information, if it determines them.
pub fn std_errors(information: &Information) -> [Option<f64>; 3] {
    let covariance = covariance(information);
    Id::WANTED.map(|id| Some(covariance[(id as usize, id as usize)].sqrt()).filter(|error| error.is_finite()))
}
