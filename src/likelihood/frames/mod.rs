//! One shot's frames through the whole chain: motion before → collision → flight, sliding, rolling →
//! frames. Its own unknowns (instant, place and direction of the contact, velocity and, where it is not
//! given, spin of the cue ball) are found by least squares for given shared parameters, and eliminated by
//! their Schur complement, so that a fit of many shots sees the shared parameters alone.
//!
//! - Golub, G. and Pereyra, V. (1973), SIAM J. Numer. Anal. 10, 413–432: variable projection.

mod known;
mod moments;
pub(crate) mod own_estimates;
pub(crate) mod own_unknowns;
mod path_start;
pub mod rows;
mod schur_reduced;
pub(crate) mod shared_unknowns;
mod sums;

pub(crate) use known::Extracted;
pub use known::Known;
use moments::Moments;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use num_dual::DualSVec64;
use schur_reduced::Normal;
use sums::Off;

use crate::likelihood::corrected::Corrected;
use crate::measurement::correction::Correction;
use crate::measurement::parameter::Parameter;
use crate::measurement::spin::Spin;
use crate::physics::ball::{BallState, Vec3};
use crate::physics::cloth_motion::{Launch, Number, Path};
use crate::physics::collision::{Coefficients, Input, OTHERS};
use crate::trajectory::both_balls::{Launches, Meeting, Side};
use crate::trajectory::shot_scene::{Departure, ROLL_PRIOR, ShotScene};

/// What the motion of all shots shares: μ, μ_s, e, the cloth's sliding friction μ_k, rolling resistance μ_r and bounce e_t…
const SHARED: usize = 6;
/// …and where outcomes depend on more ([`OTHERS`]), these, too.
const MORE_SHARED: usize = SHARED + OTHERS;

/// What all shots of a film share: the former, by how much each [`Correction`] of the camera is off, and the others.
pub const ALL_SHARED: usize = SHARED + Correction::COUNT + OTHERS;

/// Where a parameter stands among them.
#[must_use]
pub fn place_of(parameter: Parameter) -> usize {
    let place = parameter as usize;
    let coefficients = Parameter::COEFFICIENTS.len();
    if place < coefficients { place } else { FIRST_OTHER + place - coefficients }
}

/// Where the first of the others stands.
const FIRST_OTHER: usize = SHARED + Correction::COUNT;

/// Their values, in this order.
pub type Shared = [f64; ALL_SHARED];

/// A shot's own unknowns: instant (s), place of the object ball (m, 2), direction of the line of centres
/// (rad), velocity of the cue ball (m/s, collision frame, 2), in the order in which a path begins…
pub(crate) const OWN: usize = 6;
/// …and its spin (rad/s, table frame), where it is not exactly known.
const SPIN: usize = 3;

/// …or its topspin over the natural roll's, where nothing is known of it, or Rω_z/U where nobody saw the side spin.
const ROLL: usize = 1;

/// How many own unknowns a shot has whose spin is measured, is not known.
const MEASURED: usize = OWN + SPIN;
const UNKNOWN: usize = OWN + ROLL;

/// Rows that are left of a shot: one for each shared parameter, and what they cannot change.
pub const ROWS: usize = ALL_SHARED + 1;

/// A spin component without a stated error is this exact, rad/s.
const EXACT: f64 = 1e-6;

/// What is known of μ_k and μ_r beforehand, mean and standard deviation: nothing much of μ_k, and of μ_r,
/// which a few hundredths of a second hardly tell, what is published.
pub const CLOTH: [(f64, f64); 2] = [(0.2, 1.0), (0.01, 0.005)];

/// Where they may be.
pub const CLOTH_BOUNDS: [[f64; 2]; 2] = [[0.0, 1.0], [0.0, 0.1]];

/// A frame of a ball: instant, position, 1/sd.
#[derive(Clone, Copy, Debug)]
struct Frame {
    t: f64,
    position: [f64; 2],
    weight: [f64; 2],
}

/// What markers show of a spin after the impact: table frame, rad/s, and L⁻¹ of its covariance.
#[derive(Clone, Copy, Debug)]
struct Seen {
    spin: Vector3<f64>,
    whitening: Matrix3<f64>,
}

/// A shot's own unknowns; those that a shot does not have are 0.
pub type Own = SVector<f64, { OWN + SPIN }>;

/// How these follow the shared parameters where χ² of the shot is least.
pub type OwnByShared = SMatrix<f64, { OWN + SPIN }, ALL_SHARED>;

/// The frames of one shot.
#[derive(Clone, Debug)]
pub struct Film {
    cue: Moments,
    object: Moments,
    /// How many of their coordinates tell something of their own.
    independent: usize,
    scene: ShotScene,
    /// Where the search for the shot's own unknowns begins.
    pub(crate) start: Own,
    /// And from where else, since they have several minima.
    others: Vec<Own>,
    /// Mean and standard deviation of the spin's components, where it is an unknown.
    spin: Option<(Vec3, Vec3)>,
    /// Spins after the impact, of the cue ball and of the object ball.
    seen: [Option<Seen>; 2],
    /// Whether the noise of the positions is stated.
    pub(crate) states_noise: bool,
    /// Standard deviation of a coordinate, m: stated, or what the shot's own residuals show; 0 where positions state their own.
    pub(crate) position_sd: f64,
    /// χ² of its motion, whatever the collision.
    pub(crate) least_chi2: f64,
}

/// A shot at given shared parameters, its own unknowns eliminated.
#[derive(Clone, Copy, Debug)]
pub struct Reduced {
    /// As residuals: their squares sum to χ² of the shot.
    pub residuals: SVector<f64, ROWS>,
    /// And by the shared parameters.
    pub jacobian: SMatrix<f64, ROWS, ALL_SHARED>,
    /// Where its own unknowns are.
    pub own: Own,
    /// Their derivatives by the shared parameters, as far as these are small.
    pub own_by_shared: OwnByShared,
    /// ln(σ²/p) of an unknown side spin of prior variance σ² and posterior variance p: what −2 log L has besides χ² where σ is
    /// varied. 0 where there is none.
    pub log_volume: f64,
}

impl Reduced {
    /// χ² of the shot.
    #[must_use]
    pub fn chi2(&self) -> f64 {
        self.residuals.norm_squared()
    }
}

impl Film {
    /// The same film of a shot that differs so from what is stated, with side spin of this standard deviation where that is not 0.
    pub(crate) fn departing(&self, departure: Departure, side_sd: f64) -> Self {
        let side_sd = if side_sd > 0.0 { side_sd } else { self.scene.side_sd };
        Self { scene: ShotScene { side_sd, departure, ..self.scene }, ..self.clone() }
    }

    /// Whether its side spin is an unknown.
    pub(crate) fn has_side_spin(&self) -> bool {
        self.scene.side_sd > 0.0
    }

    /// Whether the cue ball's spin is stated, as stun or natural roll.
    pub(crate) fn states_spin(&self) -> bool {
        matches!(self.scene.spin, Spin::Stun | Spin::NaturalRoll)
    }

    /// Measured numbers: coordinates, and components of spins.
    pub(crate) fn observations(&self) -> usize {
        let spins = self.seen.iter().flatten().count() + usize::from(self.spin.is_some());
        let one = usize::from(self.one_unknown().is_some());
        self.independent + SPIN * spins + one
    }

    /// The shot's own unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        match self.spin {
            Some(_) => OWN + SPIN,
            None if self.one_unknown().is_some() => OWN + ROLL,
            None => OWN,
        }
    }

    /// Mean and standard deviation of the one number of the spin that is an unknown: topspin over the natural roll's, or Rω_z/U.
    fn one_unknown(&self) -> Option<(f64, f64)> {
        match (self.rolls_unknown(), self.scene.side_sd) {
            (true, _) => Some(ROLL_PRIOR),
            (false, side_sd) if side_sd > 0.0 => Some((0.0, side_sd)),
            _ => None,
        }
    }

    fn rolls_unknown(&self) -> bool {
        self.scene.spin == Spin::Unknown
    }

    /// JᵀJ, Jᵀr and rᵀr by the shot's own unknowns and S numbers that all shots share; `off` is by how much each correction of the
    /// camera is off.
    fn normal<const N: usize, const S: usize>(
        &self,
        collision: &Corrected,
        all: &SVector<f64, N>,
        off: &Off,
    ) -> Option<Normal<N, S>> {
        let own = N - S;
        let duals: [DualSVec64<N>; N] = std::array::from_fn(|i| DualSVec64::from_re(all[i]).derivative(i));
        let one = if own == UNKNOWN { duals[OWN] } else { DualSVec64::from_re(0.0) };
        let spins = (own == MEASURED).then(|| [duals[OWN], duals[OWN + 1], duals[OWN + 2]]);
        let shared = &duals[own..];
        let others = &shared[SHARED..];
        let collide = |inputs: &_| collide(collision, inputs, others);
        let (Launches { before, cue, object }, after) =
            self.launches(&duals[..OWN], (spins, one), shared, collide)?;
        let cloth = [shared[3], shared[4], shared[5]];
        let time = before.time.re;
        let tilt = self.scene.departure.tilt;
        let mut normal = Normal::<N, S>::zero();
        let mut add =
            |frames: &Moments, launch: &Launch<DualSVec64<N>>, path: fn(&_, &_) -> Path<_>, during| {
                let (own, own_cloth) = path_start::launch(launch, cloth.map(|of| of.re));
                let path = self.scene.seen(path(&own, &own_cloth));
                let level = tilt == [0.0; 2];
                let path = if level { path } else { path.tilted(tilt, launch.inertia) };
                let sums = frames.along(&path, during, off);
                normal.add_path(&sums, &path_start::by_unknowns(launch, &cloth));
            };
        let (until, from) = ([f64::NEG_INFINITY, time], [time, f64::INFINITY]);
        add(&self.cue, &before, Path::before, until);
        add(&self.cue, &cue, Path::after, from);
        add(&self.object, &object, |launch, _| Path::at_rest(launch), until);
        add(&self.object, &object, Path::after, from);
        if let (Some(spin), Some((mean, sd))) = (spins, self.spin) {
            for (i, component) in spin.into_iter().enumerate() {
                normal.add((component - mean[i]) / sd[i]);
            }
        }
        if let (UNKNOWN, Some((mean, sd))) = (own, self.one_unknown()) {
            normal.add((one - mean) / sd);
        }
        for (spin, seen) in after.into_iter().zip(&self.seen) {
            let Some(seen) = seen else { continue };
            for row in 0..SPIN {
                let terms = (0..=row).map(|i| (spin[i] - seen.spin[i]) * seen.whitening[(row, i)]);
                normal.add(terms.fold(DualSVec64::from_re(0.0), |sum, term| sum + term));
            }
        }
        normal.square.is_finite().then_some(normal)
    }

    /// Both balls at the impact, and their spins just after it in the table frame.
    fn launches<T: Number>(
        &self,
        own: &[T],
        (spin, one): (Option<[T; SPIN]>, T),
        shared: &[T],
        collide: impl FnOnce(&[T; 8]) -> Option<[T; 12]>,
    ) -> Option<(Launches<T>, [[T; SPIN]; 2])> {
        let zero = T::from(0.0);
        let radii = [self.scene.ball.radius, self.scene.object.radius];
        let (sin, cos) = own[3].sin_cos();
        let before = [own[4], own[5]];
        let to_frame = |w: [T; 3]| [cos * w[0] + sin * w[1], cos * w[1] - sin * w[0], w[2]];
        let to_table = |w: [T; 3]| [cos * w[0] - sin * w[1], sin * w[0] + cos * w[1], w[2]];
        let spin = match spin {
            Some(spin) => to_frame(spin),
            None => self.scene.spin([cos, sin], before, one),
        };
        let mut inputs = [zero; 8];
        for (input, value) in [
            (Input::Mu, shared[0]),
            (Input::MuS, shared[1]),
            (Input::E, shared[2]),
            (Input::VelocityX, before[0]),
            (Input::VelocityY, before[1]),
            (Input::SpinX, spin[0]),
            (Input::SpinY, spin[1]),
            (Input::SpinZ, spin[2]),
        ] {
            inputs[input as usize] = value;
        }
        let after = collide(&inputs)?;
        let side = |first: usize, radius: f64| {
            let (velocity, spin) = ([after[first], after[first + 1]], [after[first + 3], after[first + 4]]);
            Side::new(velocity, spin, after[first + 2], radius)
        };
        let meeting = Meeting {
            time: own[0],
            normal: [cos, sin],
            object: [own[1], own[2]],
            distance: T::from(self.scene.contact_distance()),
        };
        let before = Side::new(before, [spin[0], spin[1]], zero, radii[0]);
        let after_it = [&side(0, radii[0]), &side(6, radii[1])];
        let launches = Launches::new(&self.scene, &meeting, &before, after_it);
        let spins = [3, 9].map(|first| to_table([after[first], after[first + 1], after[first + 2]]));
        Some((launches, spins))
    }
}

/// The cue ball and the coefficients that the inputs of a collision are.
fn before_impact(inputs: &[f64; 8]) -> (BallState, Coefficients) {
    let value = |input: Input| inputs[input as usize];
    let cue = BallState {
        velocity: Vec3::new(value(Input::VelocityX), value(Input::VelocityY), 0.0),
        spin: Vec3::new(value(Input::SpinX), value(Input::SpinY), value(Input::SpinZ)),
    };
    (cue, Coefficients { mu: value(Input::Mu), mu_s: value(Input::MuS), e: value(Input::E) })
}

/// The collision with its derivatives carried on; `others` are what it depends on besides, or none.
fn collide<const N: usize>(
    collision: &Corrected,
    inputs: &[DualSVec64<N>; 8],
    others: &[DualSVec64<N>],
) -> Option<[DualSVec64<N>; 12]> {
    let (cue, coefficients) = before_impact(&inputs.each_ref().map(|input| input.re));
    let (outcome, jacobian, by_others) = collision.collide_with_all(&cue, &coefficients).ok()?;
    let components = outcome.components();
    Some(std::array::from_fn(|row| {
        let mut component = DualSVec64::from_re(components[row]);
        let of_others = by_others.iter().flat_map(|by| others.iter().zip(by.row(row).into_iter().copied()));
        let of_inputs = inputs.iter().zip(jacobian.row(row).into_iter().copied());
        for (number, by) in of_inputs.chain(of_others) {
            if by != 0.0 {
                component += (*number - number.re) * by;
            }
        }
        component
    }))
}
