//! Quantities of a shot that follow from its own and shared unknowns, with exact derivatives.

use num_dual::DualNum;

use super::block::ShotFrames;
use super::motion::{Dual, Motion};
use super::own;
use crate::physics::disc::Discs;
use crate::physics::name::worded;

worded! {
    /// The quantities of a [`super::impact::DiscImpact`], in the order of the columns that report
    /// them.
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
