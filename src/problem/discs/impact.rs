//! The measured impact of two discs: quantities that follow from own and shared unknowns, with exact
//! derivatives, and doubts.

use num_dual::DualNum;
use statrs::distribution::{ContinuousCDF, Normal};

use super::block::ShotFrames;
use super::lines::Stuck;
use super::motion::{Dual, Motion};
use super::own::{self, DISTANCE_SD, LEAST_SHOTS};
use crate::extraction::Unusable;
use crate::measurement::dataset::Measured;
use crate::measurement::number::with_error;
use crate::name::worded;
use crate::numerics::median;
use crate::physics::disc::Discs;
use crate::problem::film::camera::Point;
use crate::problem::frames::PicturePaths;
use crate::problem::policy::Policy;

/// Part of the distance of the centres by which the frames of a collision are off the paths at
/// most.
const MAX_FRAME_DEVIATION: f64 = 0.02;

/// The measured impact of a shot, without a law of friction. Velocities are in m/s and
/// spins in rad/s in the frame of the table; if the frame rate is not known, per frame.
#[derive(Clone, Debug)]
pub struct DiscImpact {
    /// Name of the shot.
    pub(crate) name: String,
    /// Value of each [`Quantity`]; `None` if the tracks do not determine it.
    pub(crate) values: [Option<Measured>; Quantity::COUNT],
    /// Standard deviation of a coordinate of the disc that is followed worse, m.
    pub(crate) position_sd: f64,
    /// Variance of the frames about the paths over that of their noise before anything was fitted.
    pub(crate) misfit: f64,
    /// Number of frames that were used, of both discs.
    pub(crate) frames: usize,
    /// Number of frames that were left out as wrong.
    pub(crate) outliers: usize,
    /// First and last instant that was used, s.
    pub(crate) window: [f64; 2],
    /// Number of frames on either side of the impact in which the discs still touch; 0 if the
    /// frames next to it are on the paths.
    pub(crate) touching: usize,
    /// Radii of the discs; if they are not stated, half the distance of the centres at the impact,
    /// m.
    pub(crate) radii: [f64; 2],
    /// How the discs stick together after the impact, if they do.
    pub(crate) stuck: Option<Stuck>,
    /// Doubts of the measurements.
    pub(crate) doubts: Vec<Doubt>,
    pub(super) paths: PicturePaths,
    /// Metres in a unit of length of the film, and its middle in that unit.
    pub(super) film: (f64, Point),
}

/// A doubt of the measurements of a shot, as a clause.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub(crate) enum Doubt {
    /// Momentum is out of balance by more than its errors.
    #[error(
        "its momentum is not conserved: {} the line of centres both discs together {} {:.1} ± {:.1} % of the impulse; the masses, \
         the scale or the frames are wrong, or something else pushed a disc",
        if *.across { "across" } else { "along" }, if *gained < 0.0 { "lose" } else { "gain" }, 100.0 * gained.abs(), 100.0 * sd
    )]
    Momentum {
        /// Whether it is that across the line of centres.
        across: bool,
        /// Momentum gained over the normal impulse.
        gained: f64,
        /// Its standard error.
        sd: f64,
    },
    /// The frames are off the paths: their variance about the paths, over the variance of their
    /// noise.
    #[error(
        "its paths are not straight before and after one instant: they are off by {:.0} times the noise of the frames (χ²/dof is \
         {:.0}); the contact lasts for several frames, or points were mistaken", .0.sqrt(), .0
    )]
    Bent(f64),
    /// e, with this standard error, is not that of an impact.
    #[error("its e of {} is not between 0 and 1, as that of any passive impact is", with_error(*.0, *.1))]
    Impossible(f64, f64),
    /// The distance at the contact is not that of the other shots.
    #[error(
        "its discs are {:.1} mm apart at the contact, where the median of all shots is {:.1} mm: the same discs touch at the same \
         distance, so that these are others, or the scale or the tracked points are", 1e3 * distance, 1e3 * typical
    )]
    Distance {
        /// Distance of the centres, m.
        distance: f64,
        /// Median of all shots, m.
        typical: f64,
    },
}

impl DiscImpact {
    /// Returns the value of a quantity if the tracks determine it.
    #[must_use]
    pub fn get(&self, quantity: Quantity) -> Option<Measured> {
        self.values[quantity as usize]
    }

    /// Returns the place of the centre of a disc (0 or 1) in the film at a time (s), in its unit.
    #[must_use]
    pub fn place(&self, disc: usize, time: f64) -> [f64; 2] {
        let (unit, middle) = self.film;
        (Point::from(self.paths.place(disc, time)) / unit + middle).into()
    }

    /// Returns the reason for which no law can be fitted to the shot, if there is one.
    pub(crate) fn find_fault(&self, policy: &Policy) -> Option<String> {
        if self.stuck.is_some() {
            return Some("the discs stick together".to_owned());
        }
        let misfit = self.find_misfit().map(|misfit| misfit.to_string());
        misfit.or_else(|| self.find_impossible_restitution(policy).map(|doubt| doubt.to_string()))
    }

    /// Returns the reason for which the frames show no single collision, if they do not.
    pub(super) fn find_misfit(&self) -> Option<Unusable> {
        let distance = self.get(Quantity::ContactDistance)?.value.abs();
        let is_seen_across = self.get(Quantity::ImpulseRatio).is_some();
        let is_off = distance > 0.0 && is_seen_across && self.position_sd > MAX_FRAME_DEVIATION * distance;
        is_off.then_some(Unusable::BadFit { reduced_chi2: self.misfit, rms_mm: 1e3 * self.position_sd })
    }

    /// Returns the reason for which the discs are others than those with these radii, if their
    /// distance shows it.
    pub(super) fn find_separation(&self, radii: [f64; 2], policy: &Policy) -> Option<Unusable> {
        self.get(Quantity::ImpulseRatio)?;
        let expected = radii[0] + radii[1];
        let Measured { value: measured, sd } = self.find_other_distance(expected, policy)?;
        Some(Unusable::Separation { measured, expected, error: sd? })
    }

    /// Returns the distance at the contact if it differs from another significantly.
    fn find_other_distance(&self, expected: f64, policy: &Policy) -> Option<Measured> {
        let found = self.get(Quantity::ContactDistance)?;
        let sd = found.sd.unwrap_or(0.0).hypot(DISTANCE_SD * expected);
        is_significant(found.value - expected, sd, policy).then_some(found)
    }

    /// Returns the doubt of an e that is not that of an impact.
    pub(crate) fn find_impossible_restitution(&self, policy: &Policy) -> Option<Doubt> {
        let Measured { value: e, sd } = self.get(Quantity::Restitution)?;
        let (outside, sd) = ((e - 1.0).max(-e), sd?);
        (outside > 0.0 && is_significant(outside, sd, policy)).then_some(Doubt::Impossible(e, sd))
    }

    fn find_imbalance(&self, policy: &Policy) -> Option<Doubt> {
        let gains = [(false, Quantity::MomentumAlong), (true, Quantity::MomentumAcross)];
        gains.into_iter().find_map(|(across, quantity)| {
            let Measured { value: gained, sd } = self.get(quantity)?;
            let sd = sd.filter(|sd| is_significant(gained, *sd, policy))?;
            Some(Doubt::Momentum { across, gained, sd })
        })
    }
}

/// Returns whether a number with this standard error differs from 0 as seldom as an outlying shot
/// does.
fn is_significant(value: f64, sd: f64, policy: &Policy) -> bool {
    Normal::new(0.0, sd).is_ok_and(|normal| normal.sf(value.abs()) < policy.shot_tail)
}

/// Adds what speaks against the impacts of a film.
pub(super) fn find_doubts(impacts: &mut [DiscImpact], policy: &Policy) {
    let distance = |impact: &DiscImpact| Some(impact.get(Quantity::ContactDistance)?.value);
    let all: Vec<f64> = impacts.iter().filter_map(distance).collect();
    let typical = (all.len() >= LEAST_SHOTS).then(|| median(all));
    for impact in impacts {
        let other = typical.and_then(|typical| {
            let distance = impact.find_other_distance(typical, policy)?.value;
            Some(Doubt::Distance { distance, typical })
        });
        let bent = (impact.misfit > policy.refuted).then_some(Doubt::Bent(impact.misfit));
        let all = [impact.find_imbalance(policy), bent, impact.find_impossible_restitution(policy), other];
        impact.doubts.extend(all.into_iter().flatten());
    }
}

worded! {
    /// The quantities of a [`DiscImpact`], in the order of the columns that report them.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    #[non_exhaustive]
    pub enum Quantity {
        /// The coefficient of restitution e, dimensionless.
        Restitution = "e",
        /// J_t/J_n on the second disc, t 90° counter-clockwise from the line of centres.
        ImpulseRatio = "impulse_ratio",
        /// J_t/J_n from the change of the first disc's spin.
        ImpulseRatioByFirstSpin = "impulse_ratio_by_cue_spin",
        /// J_t/J_n from the change of the second disc's spin.
        ImpulseRatioBySecondSpin = "impulse_ratio_by_obj_spin",
        /// m₂/m₁: stated, or from the balance of momentum along the line of centres.
        MassRatio = "mass_ratio",
        /// Momentum gained along the line of centres, over the normal impulse.
        MomentumAlong = "momentum_along",
        /// Momentum gained across the line of centres, over the normal impulse.
        MomentumAcross = "momentum_across",
        /// Angular momentum gained about the contact point, over the normal impulse times the
        /// distance of the centres.
        AngularMomentum = "angular_momentum",
        /// Loss of kinetic energy, of motion and rotation, as a fraction of the energy before the
        /// impact.
        EnergyLost = "energy_lost",
        /// How fast the discs approach along the line of centres, m/s.
        ClosingSpeed = "closing_speed",
        /// Slip before the impact over the closing speed.
        SlipRatio = "slip_ratio",
        /// Slip of the second disc's contact point against the first's along t before the impact,
        /// m/s.
        SlipBefore = "slip",
        /// Slip of the second disc's contact point against the first's along t after the impact,
        /// m/s.
        SlipAfter = "slip_after",
        /// x of the line of centres, a unit vector from the first disc to the second.
        NormalX = "nx",
        /// y of the line of centres, a unit vector from the first disc to the second.
        NormalY = "ny",
        /// Distance of the centres at the impact, m.
        ContactDistance = "contact_distance_mm",
        /// Velocity of the first disc along x before the impact, m/s.
        FirstVxBefore = "cue_vx",
        /// Velocity of the first disc along y before the impact, m/s.
        FirstVyBefore = "cue_vy",
        /// Velocity of the second disc along x before the impact, m/s.
        SecondVxBefore = "obj_vx",
        /// Velocity of the second disc along y before the impact, m/s.
        SecondVyBefore = "obj_vy",
        /// Velocity of the first disc along x after the impact, m/s.
        FirstVxAfter = "cue_vx_after",
        /// Velocity of the first disc along y after the impact, m/s.
        FirstVyAfter = "cue_vy_after",
        /// Velocity of the second disc along x after the impact, m/s.
        SecondVxAfter = "obj_vx_after",
        /// Velocity of the second disc along y after the impact, m/s.
        SecondVyAfter = "obj_vy_after",
        /// Angular velocity of the first disc before the impact, counter-clockwise, rad/s.
        FirstSpinBefore = "cue_wz",
        /// Angular velocity of the first disc after the impact, rad/s.
        FirstSpinAfter = "cue_wz_after",
        /// Angular velocity of the second disc before the impact, rad/s.
        SecondSpinBefore = "obj_wz",
        /// Angular velocity of the second disc after the impact, rad/s.
        SecondSpinAfter = "obj_wz_after",
        /// Instant of the impact, s.
        Time = "impact_time_s",
    }
    /// Its column in discs.csv.
    pub fn column;
}

impl Quantity {
    /// The number of quantities.
    pub const COUNT: usize = Self::ALL.len();
}

impl Motion {
    /// Returns each [`Quantity`] in its order if the frames of the shot show it.
    pub(super) fn quantities(&self, shot: &ShotFrames, discs: &Discs) -> [Option<Dual>; Quantity::COUNT] {
        let Self { own, velocities, spins, radii, .. } = self;
        let change = |disc: usize| self.along(&(velocities[disc][1] - velocities[disc][0]));
        let ([u_n, u_t], [v_n, v_t]) = (change(0), change(1));
        let [[parting, slip], [parting_after, slip_after]] = [0, 1].map(|side| self.relative(side));
        let stated = discs.masses.map(|[first, second]| Dual::from_re(second / first));
        let mass_ratio = stated.unwrap_or(-u_n / v_n);
        // νRΔω; J_n/m₁ = −Δu_n, J_n/m₂ = Δv_n
        let [first, second] =
            [0, 1].map(|disc| (spins[disc][1] - spins[disc][0]) * radii[disc] * discs.inertia);
        // of both discs about the contact point, per unit of m₁: R (t × v) and νR²ω
        let angular = (first - u_t) * radii[0] + mass_ratio * (second + v_t) * radii[1];
        let [before, after] = [0, 1].map(|side| {
            let of = |disc: usize| {
                let rim = spins[disc][side] * radii[disc];
                velocities[disc][side].norm_squared() + rim * rim * discs.inertia
            };
            of(0) + mass_ratio * of(1)
        });
        let if_both = |value: Dual| (shot.turns == [true; 2]).then_some(value);
        let if_across = |value: Dual| shot.flat.is_none().then_some(value);
        let if_slip = |value: Dual| shot.knows_slip.then_some(value);
        let head = [
            Some(-parting_after / parting),
            if_across((v_t - u_t) / (v_n - u_n)),
            // Δω = −R J_t/(νMR²)
            shot.turns[0].then(|| first / u_n),
            shot.turns[1].then(|| -second / v_n),
            Some(mass_ratio),
            stated.map(|ratio| (u_n + ratio * v_n) / -u_n),
            if_across((u_t + mass_ratio * v_t) / -u_n),
            if_both(angular / (-u_n * (radii[0] + radii[1]))),
            if_both(-after / before + 1.0),
            Some(-parting),
            if_slip(-slip / parting),
            if_slip(slip),
            if_both(slip_after),
            Some(own[own::DIRECTION].cos()),
            Some(own[own::DIRECTION].sin()),
            Some(self.distance),
        ];
        let velocity = [0, 1].map(|side| velocities.map(|of| [Some(of[side].x), Some(of[side].y)]));
        let spin = [0, 1].map(|disc| spins[disc].map(|spin| shot.turns[disc].then_some(spin)));
        let tail = velocity.into_iter().flatten().chain(spin).flatten().chain([Some(own[own::TIME])]);
        let mut all = head.into_iter().chain(tail);
        std::array::from_fn(|_| all.next().flatten())
    }
}
